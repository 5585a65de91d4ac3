"""Where a contact model stops being valid."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from dforce.forces import Force, Viscoelastic
from dforce.forces.bottom_effect import SERIES_LIMIT, BottomEffect, coefficients, polynomial
from dforce.forces.tatara import Tatara
from dforce.validity._advice import Advice, percent, rounded, shown
from dforce.validity._evidence import Evidence

SAME_ADHESION = 0.01  # relative difference of two adhesions that is rounding of a printed value, not a choice
STIFF, SOFT = 0.1, 5.0  # Tabor parameters that bound the transition from DMT to JKR
SMALL_ADHESION = 0.05  # of the load: below, Hertz' contact is accurate to this share
DEEP = 0.5  # of the radius: there the force of a sphere is 5 % below Hertz' paraboloid
COARSE = 1e-3  # error of a viscoelastic force: some 1/n^3 of its viscous part with n elements in contact
THIN = 0.1  # error of the force that is left to a support

MAP = "K. L. Johnson, J. A. Greenwood, J. Colloid Interface Sci. 192, 326 (1997)"
ROUND = ("hertz", "dmt", "jkr", "maugis_dugdale", "tatara", "sls", "sls_simple", "generalized_maxwell", "power_law")
HALF_SPACE = (*(name for name in ROUND if name != "tatara"), "sneddon")
VISCOELASTIC = ("sls", "sls_simple", "generalized_maxwell", "power_law")


class Adhesive(NamedTuple):
    """An adhesive contact: the forces that make it, and its numbers in SI."""

    forces: tuple[Force, ...]
    radius: float
    modulus: float
    a0: float
    energy: float

    @property
    def tabor(self) -> float:
        """Tabor parameter: the height of the neck that adhesion draws, over the range of the attraction."""
        work = 2.0 * self.energy
        return float((self.radius * work**2 / self.modulus**2) ** (1.0 / 3.0)) / self.a0

    @property
    def adhesion(self) -> float:
        """Adhesion in contact (N)."""
        return 4.0 * math.pi * self.radius * self.energy


def _surface_energy(force: Force) -> float:
    """Return the surface energy that a force amounts to in contact (J/m^2)."""
    values = vars(force)
    if force.name == "adhesion_hysteresis":
        return float(values["retract_energy"])
    if values.get("surface_energy") is not None:
        return float(values["surface_energy"])
    if force.name == "van_der_waals" and (values["geometry"] not in ("sphere", "exact_sphere")):
        return 0.0
    return float(values["hamaker"] / (24.0 * math.pi * values["a0"] ** 2))


def _adhesive_contacts(seen: Evidence, *wholes: str, beside: tuple[str, ...] = ()) -> Iterator[Adhesive]:
    """Give the adhesive contacts: models that are whole, and Hertz' contact beside an attraction."""
    hertz = seen.force("hertz")
    for force in seen.problem.forces:
        if force.name in wholes:
            forces: tuple[Force, ...] = (force,)
        elif force.name in beside and hertz is not None:
            forces = (force, hertz)
        else:
            continue
        values, energy = vars(forces[-1]), _surface_energy(force)
        if energy > 0.0:
            yield Adhesive(forces, values["radius"], values["E_eff"], seen.problem.a0, energy)


def _adhesion_matters(seen: Evidence, contact: Adhesive) -> bool:
    """Return whether the tip reaches contact, with an adhesion that matters beside the peak force."""
    if not seen.computed:
        return True
    peak = seen.largest("peak_force") or 0.0
    return bool(seen.deepest) and contact.adhesion > SMALL_ADHESION * peak


def pull_off(tabor: float) -> float:
    """Return the pull-off force over pi W R at a Tabor parameter: 2 for DMT to 1.5 for JKR.

    Source: O. Piétrement, M. Troyon, J. Colloid Interface Sci. 226, 166 (2000).
    """
    alpha = (1.0 - math.exp(-1.157 * tabor / 0.924)) / 1.02
    return max(0.267 * alpha**2 - 0.767 * alpha + 2.0, 1.5)


def tabor_of_dmt(seen: Evidence) -> Advice | None:
    """Compare the Tabor parameter with the range of DMT, for `dmt` and for Hertz' contact beside an attraction."""
    for contact in _adhesive_contacts(seen, "dmt", beside=("van_der_waals", "dlvo", "adhesion_hysteresis")):
        off = vars(contact.forces[0]).get("inside") == "off"
        if contact.tabor > STIFF and not off and _adhesion_matters(seen, contact):
            error = 2.0 / pull_off(contact.tabor) - 1.0
            neglects = "DMT neglects" if contact.forces[0].name == "dmt" else "An attraction beside hertz neglects"
            return Advice(
                "tabor_of_dmt",
                contact.tabor,
                STIFF,
                f"The Tabor parameter is {rounded(contact.tabor)}, so adhesion deforms the sample. {neglects} this: its "
                f"adhesion is about {percent(error)} too large. If adhesion in contact matters, use maugis_dugdale.",
                MAP,
                tuple(seen.path(force) for force in contact.forces),
            )
    return None


def tabor_of_jkr(seen: Evidence) -> Advice | None:
    """Compare the Tabor parameter with the range of JKR."""
    for contact in _adhesive_contacts(seen, "jkr"):
        if contact.tabor < SOFT and _adhesion_matters(seen, contact):
            error = 1.0 - 1.5 / pull_off(contact.tabor)
            return Advice(
                "tabor_of_jkr",
                contact.tabor,
                SOFT,
                f"The Tabor parameter is {rounded(contact.tabor)}, so the attraction reaches beyond the contact. JKR neglects "
                f"this: its pull-off force is about {percent(error)} too small. Use maugis_dugdale, or dmt below {STIFF}.",
                MAP,
                (seen.path(contact.forces[0]),),
            )
    return None


def adhesion_left_out(seen: Evidence) -> Advice | None:
    """Compare the attraction that ends at contact with the load, where Hertz' contact acts alone inside."""
    for contact in _adhesive_contacts(seen, beside=("van_der_waals",)):
        force = contact.forces[0]
        if vars(force)["inside"] == "constant" or not _adhesion_matters(seen, contact):
            continue
        adhesion = contact.adhesion
        peak = seen.largest("peak_force")
        beside = f", {percent(adhesion / peak)} of the peak force" if peak and peak > 0.0 else ""
        return Advice(
            "adhesion_left_out",
            adhesion,
            SMALL_ADHESION * peak if peak else 0.0,
            f"The attraction ends at contact, where it is {shown(adhesion, 'N')}{beside}: the force jumps there, and the "
            'contact does not stick. Remove inside = "off", or use dmt, unless you want this jump.',
            f"{MAP}: adhesion below 5 % of the load",
            (seen.path(force, "inside"), seen.path(contact.forces[1])),
            "N",
        )
    return None


def hamaker_and_surface_energy(seen: Evidence) -> Advice | None:
    """Compare the adhesion in contact with the attraction at contact, where a force has both."""
    force = seen.force("dmt")
    if force is None:
        return None
    values = vars(force)
    hamaker, energy = values["hamaker"], values["surface_energy"]
    if hamaker is None or energy is None:
        return None
    implied = hamaker / (24.0 * math.pi * values["a0"] ** 2)
    if abs(energy - implied) <= SAME_ADHESION * abs(implied):
        return None
    return Advice(
        "hamaker_and_surface_energy",
        energy,
        implied,
        f"The surface energy is {shown(energy, 'J/m^2')}, and the Hamaker constant implies {shown(implied, 'J/m^2')}, so "
        "the force jumps at contact. Remove one of them; dForce then computes it from the other.",
        "continuity of the DMT force at a0: gamma = H / (24 pi a0^2)",
        (seen.path(force, "surface_energy"), seen.path(force, "hamaker")),
        "J/m^2",
    )


def indentation_and_radius(seen: Evidence) -> Advice | None:
    """Compare the indentation with the radius of a model that takes the tip for a paraboloid."""
    force = next((f for f in seen.problem.forces if f.name in ROUND or _is_round_layer(f)), None)
    if force is None or not seen.deepest:
        return None
    radius = min(vars(force)["radius"], vars(force).get("sample_radius", math.inf))
    if seen.deepest <= DEEP * radius:
        return None
    verb = "is" if seen.computed else "will be about"
    return Advice(
        "indentation_and_radius",
        seen.deepest,
        DEEP * radius,
        f"The indentation {verb} {shown(seen.deepest, 'm')} with a radius of {shown(radius, 'm')}. There the force of a "
        "sphere is smaller than the force of the paraboloid in this model, and a real tip has a conical shape. Use a larger "
        "radius, a smaller A0, or sneddon (cone, exact_sphere).",
        "I. N. Sneddon, Int. J. Eng. Sci. 3, 47 (1965): the force of a sphere is 5 % smaller at half the radius",
        ("tip.radius", seen.path(force)),
        "m",
    )


def _is_round_layer(force: Force) -> bool:
    return isinstance(force, BottomEffect) and force.geometry == "sphere"


def indentation_and_thickness(seen: Evidence) -> Advice | None:
    """Compare a thin sample with the contact, where the model has no support below it."""
    thickness = seen.case.sample.thickness
    force = seen.force(*HALF_SPACE)
    if thickness is None or force is None or not seen.deepest:
        return None
    values = vars(force)
    shape = {"pyramid": "cone", "cone": "cone", "punch": "punch"}.get(values.get("geometry", ""), "sphere")
    if shape == "cone":
        reach = math.tan(values["half_angle"]) * seen.deepest
    else:
        reach = values["radius"] if shape == "punch" else math.sqrt(values["radius"] * seen.deepest)
    x = min(reach / thickness, SERIES_LIMIT.get(shape, 0.5))
    error = 1.0 - 1.0 / polynomial(x, coefficients(shape, seen.case.sample.poisson_ratio))
    if error <= THIN:
        return None
    least = "at least " if reach / thickness > x else ""
    return Advice(
        "indentation_and_thickness",
        error,
        THIN,
        f"The contact feels the support below the {shown(thickness, 'm')} thick sample: the force of {force.name} is "
        f"{least}{percent(error)} too small. Use bottom_effect instead.",
        "E. K. Dimitriadis et al., Biophys. J. 82, 2798 (2002); coefficients as in bottom_effect",
        ("sample.thickness", seen.path(force)),
    )


def indentation_beyond_the_model(seen: Evidence) -> Advice | None:
    """Compare the indentation with the one to which a model's law is known; beyond, it goes on along a tangent."""
    for force in seen.problem.forces:
        if isinstance(force, BottomEffect):
            limit, remedy = force.deepest, "The sample is too thin for this tip and load"
        elif isinstance(force, Tatara):
            limit, remedy = force.limit, "The sample is too soft for this load"
        elif getattr(force, "max_indentation", None) is not None:
            limit, remedy = vars(force)["max_indentation"], "Raise max_indentation"
        else:
            continue
        if seen.deepest and seen.deepest > limit:
            return Advice(
                "indentation_beyond_the_model",
                seen.deepest,
                limit,
                f"The indentation is {shown(seen.deepest, 'm')}, but the law of {force.name} is valid only up to "
                f"{shown(limit, 'm')}. {remedy}, or use a smaller A0.",
                f"the range of {force.name} (see its page)",
                (seen.path(force), seen.of_tone(0, "A0")),
                "m",
            )
    return None


def elements_in_contact(seen: Evidence) -> Advice | None:
    """Count the elements of a viscoelastic sample that the deepest contact presses down; each sees a stretch of it alike."""
    for force in seen.problem.forces:
        if not isinstance(force, Viscoelastic) or not seen.deepest:
            continue
        pressed = force.elements * (force.radius * seen.deepest / force.reach**2) ** 0.25
        error = sum(force.shares) / max(pressed, 1.0) ** 3
        if error > COARSE:
            wanted = math.ceil(force.elements * (error / COARSE) ** (1.0 / 3.0))
            return Advice(
                "elements_in_contact",
                pressed,
                pressed * (error / COARSE) ** (1.0 / 3.0),
                f"The tip presses only {pressed:.0f} of the {force.elements} elements of {force.name}, so its force and loss "
                f"have an error of about {percent(error)}. Set {seen.path(force, 'elements')} = {wanted}, or lower "
                f"{seen.path(force, 'max_indentation')}.",
                f"the error falls with the cube of their number (see the page of {force.name})",
                (seen.path(force, "elements"), seen.path(force, "max_indentation")),
            )
    return None


def counted_twice(seen: Evidence) -> Advice | None:
    """Find a second viscosity, and a law of one's own that repels in contact beside an elastic contact."""
    drag, solid = seen.force("kelvin_voigt"), seen.force(*VISCOELASTIC)
    if drag is not None and solid is not None:
        return Advice(
            "counted_twice",
            2,
            1,
            f"{solid.name} includes a viscosity, and kelvin_voigt adds another: the energy loss counts twice. "
            "Remove one of them.",
            "the viscosity of the contact counts once",
            (seen.path(drag), seen.path(solid)),
        )
    own = [force for force in seen.problem.forces if not force.contains]
    contact = next((force for force in seen.problem.forces if "elastic contact" in force.contains), None)
    for force in own if contact is not None else []:
        push, usual = _push(force, seen.problem.a0), _push(contact, seen.problem.a0) if contact else 0.0
        if math.inf > push > 0.1 * usual > 0.0:
            return Advice(
                "counted_twice",
                push / usual,
                0.1,
                f"{force.name} pushes the tip out of contact, and so does {contact.name if contact else ''}: "
                "the elastic contact may count twice. If so, remove one of them.",
                "the elastic contact counts once",
                (seen.path(force), seen.path(contact)) if contact else (),
            )
    return None


PROBE = 0.5e-9  # m; an indentation at which every elastic contact pushes


def _push(force: Force, a0: float) -> float:
    """Return by how much a force grows over an indentation (N); NaN where the law has no value or needs a history."""
    if force.leading() != ("d", "rate", "t"):
        return math.nan
    law, values = force.plain_law(), force.values()
    return law(a0 - PROBE, 0.0, 0.0, *values) - law(a0, 0.0, 0.0, *values)


PIECES = (
    tabor_of_dmt,
    tabor_of_jkr,
    adhesion_left_out,
    hamaker_and_surface_energy,
    indentation_and_radius,
    indentation_and_thickness,
    indentation_beyond_the_model,
    elements_in_contact,
    counted_twice,
)
