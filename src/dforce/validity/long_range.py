"""Where a long-range force stops being valid."""

from __future__ import annotations

import math

from dforce.forces.dlvo import DLVO, VACUUM_PERMITTIVITY
from dforce.validity._advice import Advice, percent, shown
from dforce.validity._evidence import Evidence

SPHERE_ERROR = 0.1  # of an attraction; Hamaker constants are hardly known better
LINEAR = 0.025  # V; k_B T / e at room temperature
DERJAGUIN = ("dmt", "van_der_waals", "dlvo", "jkr", "maugis_dugdale", "adhesion_hysteresis")


def attraction_of_a_small_sphere(seen: Evidence) -> Advice | None:
    """Compare the distance with the radius, where the attraction is Derjaguin's -HR/6d²."""
    force = seen.force(*DERJAGUIN)
    if force is None or vars(force).get("geometry", "sphere") != "sphere" or vars(force).get("hamaker") == 0.0:
        return None
    radius = vars(force)["radius"]
    excess = (1.0 + seen.closest / (2.0 * radius)) ** 2 - 1.0
    if excess <= SPHERE_ERROR:
        return None
    return Advice(
        "attraction_of_a_small_sphere",
        excess,
        SPHERE_ERROR,
        f"The attraction -HR/6d² of {force.name} is {percent(excess)} too large for a radius of {shown(radius, 'm')} at "
        f"{shown(seen.closest, 'm')}, the closest distance, and more farther out. Use van_der_waals with geometry = "
        '"exact_sphere", beside hertz for the contact.',
        "H. C. Hamaker, Physica 4, 1058 (1937): the exact sphere is smaller by (1 + d/2R)^2",
        ("tip.radius", seen.path(force)),
    )


def _dlvo(seen: Evidence) -> DLVO | None:
    return next((force for force in seen.problem.forces if isinstance(force, DLVO)), None)


def surface_potential(seen: Evidence) -> Advice | None:
    """Compare the surface potentials with the range of the linear Poisson–Boltzmann equation."""
    force = _dlvo(seen)
    if force is None or force.variant == "gouy_chapman":
        return None
    per_charge = force.screening / (force.permittivity * VACUUM_PERMITTIVITY)
    potentials = {surface: abs(force.charge(surface)) * per_charge for surface in ("tip", "sample")}
    surface, highest = max(potentials.items(), key=lambda item: item[1])
    if highest <= LINEAR * 1.001:  # so that 25 mV as text is no more than 25 mV
        return None
    field = f"{surface}_charge" if getattr(force, f"{surface}_charge") is not None else f"{surface}_potential"
    return Advice(
        "surface_potential",
        highest,
        LINEAR,
        f"The potential of the {surface} is {shown(highest, 'V')}, but the linear theory of this variant holds up to 25 mV: "
        'it overestimates the double layer. Use variant = "gouy_chapman".',
        "J. N. Israelachvili, Intermolecular and Surface Forces, Academic Press (2011): e psi < k_B T",
        (seen.path(force, field), seen.path(force, "variant")),
        "V",
    )


def debye_length_and_gap(seen: Evidence) -> Advice | None:
    """Compare the gap with the Debye length, where the double layers are superposed or expanded."""
    force = _dlvo(seen)
    if force is None or force.variant == "constant_charge_exact" or seen.closest >= force.screening:
        return None
    layer = abs(force.first) * math.exp(-seen.closest / force.screening)
    largest = max(seen.largest("peak_force") or 0.0, -float(min(seen.values("min_force"), default=0.0)))
    if layer == 0.0 or (seen.computed and layer < 0.1 * largest):
        return None
    return Advice(
        "debye_length_and_gap",
        seen.closest,
        force.screening,
        f"The gap closes to {shown(seen.closest, 'm')} with a Debye length of {shown(force.screening, 'm')}: nearer than one "
        "Debye length, constant charge and constant potential differ by a factor of two and more. "
        'Use variant = "constant_charge_exact" for constant charge, or treat the force there as approximate.',
        "R. Hogg, T. W. Healy, D. W. Fuerstenau, Trans. Faraday Soc. 62, 1638 (1966): the ratio of both is coth(d / 2 lambda)",
        (seen.path(force, "variant"), seen.path(force)),
        "m",
    )


def debye_length_and_radius(seen: Evidence) -> Advice | None:
    """Compare the Debye length with the tip radius, which Derjaguin's approximation takes for large."""
    force = _dlvo(seen)
    if force is None or force.screening <= SPHERE_ERROR * force.radius:
        return None
    error = force.screening / force.radius
    return Advice(
        "debye_length_and_radius",
        error,
        SPHERE_ERROR,
        f"The Debye length is {percent(error)} of the tip radius, and the double layer of dlvo is too large by about that "
        "share. It assumes a flat tip over a Debye length. Use a larger radius or more salt, or treat the force as "
        "approximate.",
        "S. Bhattacharjee, M. Elimelech, J. Colloid Interface Sci. 193, 273 (1997): the force of a sphere is smaller by "
        "1 - lambda/R",
        (seen.path(force), "tip.radius"),
    )


PIECES = (attraction_of_a_small_sphere, surface_potential, debye_length_and_gap, debye_length_and_radius)
