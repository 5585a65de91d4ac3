"""Recipes for the values in the tables: force laws, contact, layers and the cantilever.

A recipe takes the inputs from the table, all in SI, and returns a number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from dforce.forces import REGISTRY, Force, kernel_moments
from dforce.forces.bottom_effect import coefficients
from dforce.forces.jkr import contact_size
from dforce.forces.kelvin_voigt import KelvinVoigt
from dforce.forces.maugis_dugdale import contact
from dforce.forces.sls import SLS
from dforce.forces.sls_simple import SLSSimple
from dforce.instrument import Sample, Tip, beam, effective_modulus
from dforce.spectroscopy import Answer, follow

Given = Mapping[str, Any]
A0 = 0.165e-9  # m, where contact begins in all values
MOTION = ("d", "depth", "rate", "latched", "model", "number", "far", "near", "steps")  # not of the force itself
SILICON = {"youngs_modulus": 169e9, "density": 2330.0, "length": 225e-6, "width": 28e-6, "thickness": 3e-6}
HEIGHT, TURN, SPEED = 20e-9, 5e-6, 1e-3  # the triangle of Ting's values: tip radius (m), time of the turn (s), m/s


def bound(given: Given) -> Force:
    """Return the force of an entry, bound to its instrument; an option of ``none`` is left out."""
    instrument = {"contact.a0": A0} | {key: value for key, value in given.items() if "." in key}
    if "sample.youngs_modulus" in instrument:
        tip, sample = _part(Tip, instrument), _part(Sample, instrument)
        instrument["contact.E_eff"] = effective_modulus(tip, sample)
    options = {key: v for key, v in given.items() if "." not in key and key not in MOTION and v != "none"}
    return REGISTRY[given["model"]](**options).bind(instrument)


def _part(model: type[Tip | Sample], instrument: Mapping[str, object]) -> Any:
    head = model.__name__.lower() + "."
    return model(**{key.removeprefix(head): value for key, value in instrument.items() if key.startswith(head)})


def force(given: Given) -> float:
    """Return a force (N) at a distance or an indentation."""
    model = bound(given)
    d = given["d"] if "d" in given else A0 - given["depth"]
    latched = (given.get("latched", 1.0),) if model.switch is not None else ()
    return float(model.law_function()(d, given.get("rate", 0.0), 0.0, *latched, *model.values()))


def force_number(given: Given) -> float:
    """Return a number that a force derives from its parameters."""
    return float(getattr(bound(given), given["number"]))


def _effective_modulus(given: Given) -> float:
    tip = Tip(youngs_modulus=given.get("E_t"), poisson_ratio=given.get("nu_t", 0.28))
    sample = Sample(youngs_modulus=given["E_s"], poisson_ratio=given["nu_s"])
    return float(effective_modulus(tip, sample) or math.nan)


def _jkr_contact_radius(given: Given) -> float:
    model = bound(given)
    unit = (9.0 * math.pi * model.surface_energy * model.radius**2 / (4.0 * model.E_eff)) ** (1.0 / 3.0)  # type: ignore[attr-defined]
    return float(unit * contact_size(given["depth"] / model.length) ** 2)  # type: ignore[attr-defined]


def _jkr_strongest(given: Given) -> float:
    unit = force_number({**given, "number": "length"})
    return min(force({**given, "depth": share * unit}) for share in np.linspace(-1.001, -0.999, 201))


def _jkr_pull_off_depth(given: Given) -> float:
    """Return where the branch ends, from the sign of the switch."""
    from scipy.optimize import brentq

    model = bound(given)
    unit = force_number({**given, "number": "length"})

    def lets_go(depth: float) -> float:
        return float(model.switch(1.0, A0 - depth, 0.0, 0.0, *model.values()))  # type: ignore[misc]

    return float(brentq(lets_go, -3.0 * unit, -1.5 * unit, xtol=1e-25, rtol=1e-15))


def _jkr_pull_off_force(given: Given) -> float:
    # beyond the end the law keeps its value there
    return force({**given, "depth": -3.0 * force_number({**given, "number": "length"})})


def _slow_loop(given: Given) -> float:
    """Return the energy (J) that a slow cosine there and back costs."""
    far, near, steps = given.get("far", 10e-9), given.get("near", -2e-9), given.get("steps", 40_000)
    middle, swing = 0.5 * (far + near), 0.5 * (far - near)
    omega = 2.0 * math.pi

    def motion(t: float) -> tuple[float, float]:
        return middle + swing * math.cos(omega * t), -swing * omega * math.sin(omega * t)

    return float(follow(bound(given), motion, np.linspace(0.0, 1.0, steps + 1).tolist()).energy[-1])


def _maugis(given: Given) -> float:
    """Return m, the force or the indentation of Maugis' equations for a contact radius."""
    from scipy.optimize import brentq

    spread = brentq(lambda s: float(contact(s, given["transition"])[0]) - given["size"], -10.0, 5.0, xtol=1e-14)
    _, pull, depth = contact(spread, given["transition"])
    return float({"m": math.sqrt(1.0 + math.exp(2.0 * spread)), "force": pull, "depth": depth}[given["give"]])


def _viscous_cycle(given: Given) -> float:
    """Return the loss (J) of a viscous contact over a cosine, sampled densely at both ends of the contact."""
    model = KelvinVoigt(viscosity=given["viscosity"]).bind({"contact.a0": A0, "tip.radius": given["tip.radius"]})
    zc, swing, omega = 9e-9, 9.5e-9, 2.0 * math.pi * 48.9e3
    touch = math.acos((A0 - zc) / swing) / omega
    shares = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, 12_001))

    def motion(t: float) -> tuple[float, float]:
        return zc + swing * math.cos(omega * t), -swing * omega * math.sin(omega * t)

    times = touch + (2.0 * math.pi / omega - 2.0 * touch) * shares
    return float(follow(model, motion, times.tolist()).energy[-1])


def _triangle(t: float) -> tuple[float, float]:
    depth, rate = (SPEED * t, -SPEED) if t <= TURN else (SPEED * (2.0 * TURN - t), SPEED)
    return A0 - depth, rate


@lru_cache(maxsize=8)
def _pressed(elements: int) -> Answer:
    """Return the answer of a standard linear solid to the triangle; without elements the answer of ``sls_simple``."""
    solid = {"instant_modulus": 1e9, "relaxed_modulus": 1e8, "relaxation_time": 1e-5}
    room = {"elements": elements, "max_indentation": SPEED * TURN}
    model: Force = SLS(**solid, **room) if elements else SLSSimple(**solid)
    # Poisson's ratio of zero, where Young's modulus equals the plane-strain modulus
    model = model.bind({"tip.radius": HEIGHT, "sample.poisson_ratio": 0.0, "contact.a0": A0})
    # the speed jumps at the turn, so the step after it begins just after it
    times = np.union1d(np.linspace(0.0, 2.0 * TURN, 2001), [np.nextafter(TURN, 1.0)])
    return follow(model, _triangle, times.tolist(), compiled=True)


def _limit(give: Callable[[Answer], float]) -> float:
    """Return the value for infinitely many elements: the error falls with the square of their number."""
    coarse, fine = (give(_pressed(elements)) for elements in (100, 200))
    return fine + (fine - coarse) / 3.0


def _at(share: float) -> Callable[[Answer], float]:
    return lambda answer: float(np.interp(share * TURN, answer.time, answer.force))


def _ting_detachment(given: Given) -> float:
    answer = _pressed(200)
    return float(answer.time[answer.force > 0.0][-1]) / TURN


def _beam_ratio(given: Given) -> float:
    n = given["n"]
    first, mode = beam.vacuum_mode(1, **SILICON), beam.vacuum_mode(n, **SILICON)
    size = {key: SILICON[key] for key in ("youngs_modulus", "length", "width", "thickness")}
    mass = SILICON["density"] * SILICON["length"] * SILICON["width"] * SILICON["thickness"]
    return {
        "over_static": mode.stiffness / beam.static_stiffness(**size),
        "stiffness": mode.stiffness / first.stiffness,
        "frequency": mode.frequency / first.frequency,
        "slope": beam.end_slope(n),
        "lever": beam.lever_factor(n),
        "mass": mode.stiffness / (2.0 * math.pi * mode.frequency) ** 2 / mass,
    }[str(given["give"])]


def _silicon(given: Given) -> float:
    if not given["n"]:
        return beam.static_stiffness(SILICON["youngs_modulus"], *(SILICON[x] for x in ("length", "width", "thickness")))
    mode = beam.vacuum_mode(given["n"], **SILICON)
    return mode.frequency if given["give"] == "f" else mode.stiffness


def _in_fluid(given: Given) -> float:
    free = beam.vacuum_mode(given["n"], **SILICON)
    wet = beam.fluid_mode(free.frequency, SILICON["density"], SILICON["width"], SILICON["thickness"], *given["fluid"])
    return wet.frequency if given["give"] == "f" else wet.Q


def layer_ratio(given: Given) -> float:
    """Return the force on a thin sample over that on a half-space, at a depth of the series' variable."""
    shape, reach, thickness, angle = given["geometry"], given["reach"], 1e-6, math.radians(30.0)
    radius = reach * thickness if shape == "punch" else 10e-6
    depth = {"sphere": (reach * thickness) ** 2 / radius, "cone": reach * thickness / math.tan(angle), "punch": 10e-9}[
        str(shape)
    ]
    common = {
        "tip.radius": radius,
        "tip.half_angle": angle,
        "sample.thickness": thickness,
        "sample.poisson_ratio": 0.5,
        "contact.E_eff": 1e4,
        "depth": depth,
    }
    half_space = {"model": "hertz"} if shape == "sphere" else {"model": "sneddon", "geometry": shape}
    return force({**common, "model": "bottom_effect", "geometry": shape}) / force({**common, **half_space})


FORCE_RECIPES: dict[str, Callable[[Given], float]] = {
    "force": force,
    "force_number": force_number,
    "effective_modulus": _effective_modulus,
    "jkr_contact_radius": _jkr_contact_radius,
    "jkr_strongest": _jkr_strongest,
    "jkr_pull_off_depth": _jkr_pull_off_depth,
    "jkr_pull_off_force": _jkr_pull_off_force,
    "slow_loop": _slow_loop,
    "maugis": _maugis,
    "viscous_cycle": _viscous_cycle,
    "ting": lambda given: _limit(_at(given["share"])),
    "ting_energy": lambda given: _limit(lambda answer: float(answer.energy[-1])),
    "ting_detachment": _ting_detachment,
    "lee_radok": lambda given: _at(given["share"])(_pressed(0)),
    "wavenumber": lambda given: beam.wavenumber(given["n"]),
    "beam_ratio": _beam_ratio,
    "silicon": _silicon,
    "hydrodynamic": lambda given: float(getattr(beam.hydrodynamic_function(given["reynolds"]), given["give"])),
    "in_fluid": _in_fluid,
    "layer_moment": lambda given: kernel_moments(given["poisson"])[given["order"] // 2],
    "layer_coefficient": lambda given: coefficients(given["geometry"], given["poisson"])[given["order"] - 1],
    "layer_ratio": layer_ratio,
}
