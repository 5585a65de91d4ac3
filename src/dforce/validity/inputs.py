"""Values so far from any instrument or sample that a unit may have slipped."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from dforce.core.units import show_range
from dforce.experiments import FrequencySweep
from dforce.experiments.base import values_of
from dforce.library.cantilevers import NOMINAL
from dforce.library.materials import materials
from dforce.validity._advice import Advice, shown
from dforce.validity._evidence import Evidence

HAMAKER = (1e-23, 5e-18, "J")
ENERGY = (1e-5, 10.0, "J/m^2")


@dataclass(frozen=True)
class Usual:
    """The range of a value in use, in SI."""

    low: float
    high: float
    unit: str


# Usual ranges of parts on sale and of natural materials, wider by a factor of ten or more on both sides.
USUAL = {
    "f0": Usual(300.0, 50e6, "Hz"),
    "k": Usual(1e-3, 1e4, "N/m"),
    "A0": Usual(10e-12, 1e-6, "m"),
    "tip.radius": Usual(0.2e-9, 5e-6, "m"),
    "tip.youngs_modulus": Usual(1e6, 2e12, "Pa"),
    "sample.youngs_modulus": Usual(10.0, 2e12, "Pa"),
    "sample.thickness": Usual(0.2e-9, 0.01, "m"),
    "contact.a0": Usual(0.05e-9, 2e-9, "m"),
    "medium.temperature": Usual(0.01, 600.0, "K"),
    "hamaker": Usual(*HAMAKER),
    "surface_energy": Usual(*ENERGY),
    "approach_energy": Usual(*ENERGY),
    "retract_energy": Usual(*ENERGY),
    "work_of_adhesion": Usual(*ENERGY),
    "debye_length": Usual(0.1e-9, 1e-6, "m"),
    "salt": Usual(1e-4, 6e3, "mol/m^3"),
}


def unusual_value(seen: Evidence) -> Advice | None:
    """Look for values that no instrument or sample has, as after a slip of a unit."""
    odd = [(path, value, usual) for path, value, usual in _values(seen) if not usual.low <= abs(value) <= usual.high]
    if not odd:
        return None
    said = ", ".join(f"{path} = {shown(value, usual.unit)}" for path, value, usual in odd)
    _, value, usual = odd[0]
    limit = usual.low if abs(value) < usual.low else usual.high
    return Advice(
        "unusual_value",
        value,
        limit,
        f"No usual instrument or sample has {said}: usual are {show_range(usual.low, usual.high, usual.unit, 3)}"
        f"{' for the first of them' if len(odd) > 1 else ''}. Check the unit; if it is "
        "right, the models may not be valid.",
        "usual instruments and samples, with a margin of a factor of ten",
        tuple(path for path, _, _ in odd),
        usual.unit,
    )


def _values(seen: Evidence) -> Iterator[tuple[str, float, Usual]]:
    """Give the path, the value and the usual range of each value that is not zero."""
    for number, mode in enumerate(seen.problem.modes):
        yield seen.of_mode(number, "f0"), mode.f0, USUAL["f0"]
        yield seen.of_mode(number, "k"), mode.k, USUAL["k"]
    for number, tone in enumerate(seen.problem.tones):
        yield seen.of_tone(number, "A0"), tone.A0, USUAL["A0"]
        if tone.frequency != seen.problem.modes[tone.mode].f0:
            yield seen.of_tone(number, "frequency"), tone.frequency, USUAL["f0"]
    if isinstance(seen.case.experiment, FrequencySweep):
        yield "experiment.frequency", float(values_of(seen.case.experiment.frequency).min()), USUAL["f0"]
    for path, usual in USUAL.items():
        section, _, field = path.partition(".")
        value = getattr(getattr(seen.case, section), field) if field else None
        if value:
            yield path, value, usual
    for force in seen.problem.forces:
        for field in type(force).quantities():
            usual_here, value = USUAL.get(field), getattr(force, field)
            if usual_here is not None and isinstance(value, float) and value:
                yield seen.path(force, field), value, usual_here


def nominal_lever(seen: Evidence) -> Advice | None:
    """Look for a cantilever that is known by its name alone."""
    lever = seen.case.cantilever
    taken = [field for field in ("f0", "k") if lever.name is not None and field not in lever.model_fields_set]
    if not taken:
        return None
    return Advice(
        "nominal_lever",
        len(taken),
        0.0,
        f"{' and '.join(taken)} of {lever.name} {'are' if len(taken) > 1 else 'is'} the maker's nominal "
        f"{'values' if len(taken) > 1 else 'value'}: {NOMINAL}, and write them after the name.",
        "tolerances of thickness: f0 is proportional to the thickness, k to its cube",
        tuple(f"cantilever.{field}" for field in taken),
    )


def ideal_higher_mode(seen: Evidence) -> Advice | None:
    """Look for higher modes whose frequency or spring constant comes from an ideal beam."""
    modes = seen.case.cantilever.higher_modes
    taken = [
        (n, field) for n, mode in enumerate(modes, start=2) for field in ("f0", "k") if getattr(mode, field) is None
    ]
    if not taken:
        return None
    said = ", ".join(
        f"{field} of mode {n} = {shown(getattr(seen.problem.modes[n - 1], field), USUAL[field].unit)}"
        for n, field in taken
    )
    return Advice(
        "ideal_higher_mode",
        len(taken),
        0.0,
        f"An ideal beam gives {said} (f2 = 6.27 f1, k2 = 39.3 k1). A heavy tip or a pointed end changes them. "
        "Measure f0 in a tune, and write it under cantilever.higher_modes.",
        "Euler-Bernoulli beam with one free end, without the mass of a tip",
        tuple(f"cantilever.higher_modes.{n - 1}.{field}" for n, field in taken),
    )


def nominal_sample(seen: Evidence) -> Advice | None:
    """Look for a sample whose Young's modulus is known by its name alone."""
    name = seen.case.sample.name
    if name is None or "youngs_modulus" in seen.case.sample.model_fields_set:
        return None
    material = materials()[name]
    spread = f", from {material.range}" if material.range else ""
    return Advice(
        "nominal_sample",
        material.youngs_modulus,
        0.0,
        f"Young's modulus of {name} is nominal: {shown(material.youngs_modulus, 'Pa')}{spread}. Run the case at both "
        "ends of the range, or write a measured sample.youngs_modulus beside the name.",
        material.source,
        ("sample.youngs_modulus",),
        "Pa",
    )


PIECES = (unusual_value, nominal_lever, nominal_sample, ideal_higher_mode)
