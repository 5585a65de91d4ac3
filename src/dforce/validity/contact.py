"""Where a contact model stops being valid."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from dforce.validity._advice import Advice

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case

SAME_ADHESION = 0.01  # relative difference of two adhesions that is rounding of a printed value, not a choice


def hamaker_and_surface_energy(case: Case, result: xr.Dataset | None) -> Advice | None:
    """Compare the adhesion in contact with the attraction at contact, where a force was given both."""
    for force in case.problem.forces:
        hamaker, energy = getattr(force, "hamaker", None), getattr(force, "surface_energy", None)
        if force.name != "dmt" or hamaker is None or energy is None:
            continue
        implied = hamaker / (24.0 * math.pi * case.contact.a0**2)
        if abs(energy - implied) > SAME_ADHESION * abs(implied):
            return Advice(
                "hamaker_and_surface_energy",
                energy,
                implied,
                f"dmt is given a surface energy of {1e3 * energy:.3g} mJ/m² and a Hamaker constant that implies "
                f"{1e3 * implied:.3g} mJ/m², so its force jumps at contact; give one of them, and the other follows.",
                "continuity of the DMT force at a0: gamma = H / (24 pi a0^2)",
                ("forces.dmt.surface_energy", "forces.dmt.hamaker"),
                "J/m^2",
            )
    return None
