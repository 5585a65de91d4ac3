"""Modulus and viscosity from a curve of AM-FM or FM-FM, with what is wrong with them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from dforce.case import case_of
from dforce.core.errors import ParameterError, checked
from dforce.inverse.bimodal import Contact, Observed, estimate, neglected
from dforce.results.dataset import describe
from dforce.validity import Advice, attributes

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case
    from dforce.core.arrays import Array

DERIVED = "derived for dForce; R. Garcia, R. Proksch, Eur. Polym. J. 49, 1897 (2013)"
ATTRACTED = 0.05  # of the largest repulsive virial of a curve: more attraction is adhesion
# what the formulas neglect: its largest share, and what it does
NEGLECTED = {
    "harmonics": (0.05, "Mode 2 also answers harmonics of tone 1 near its resonance, by {found} of the indentation"),
    "path": (0.05, "The force changes the path of mode 1 by {found} of its amplitude"),
    "amplitude_2": (0.3, "The amplitude of tone 2 is {found} of the indentation"),
    "indentation": (0.2, "The indentation is {found} of the amplitude of tone 1"),
}


@checked
def material(curve: xr.Dataset, model: Literal["hertz", "punch", "cone"] = "hertz") -> xr.Dataset:
    r"""Return modulus, indentation and viscosity that the formulas of AM-FM find along a curve.

    .. math:: \langle k_\mathrm{ts} \rangle = k_2 \left[ (f_2 / f_{02})^2 - 1 \right], \quad
              \delta = -\left( m + \tfrac{1}{2} \right) \frac{V_1}{A_1 \langle k_\mathrm{ts} \rangle}, \quad
              c = \frac{\pi \sqrt{2 A_1}\, \langle k_\mathrm{ts} \rangle}{m\, B(\tfrac{1}{2}, m)\, \delta^{m - 1/2}}, \quad
              \tan\rho = \frac{E_1}{2 \pi |V_1|}

    for a contact :math:`F = c\, \delta^m` without adhesion, with the virial and the energy of tone 1 from its amplitude, phase,
    drive and frequency. The Dataset contains advice where a neglected effect is large.

    Parameters
    ----------
    curve
        A result of :func:`dforce.approach` or :func:`dforce.dwell` of two tones, the second with ``operation = "fm"``.
    model
        Shape of the tip: ``"hertz"`` a paraboloid and ``"punch"`` a flat punch of the tip's radius, ``"cone"`` a cone of its
        half angle.

    Returns
    -------
    xarray.Dataset
        `E_eff` (Pa), `estimated_indentation` (m), `estimated_viscosity` (Pa s, as of `kelvin_voigt`) and `loss_tangent`; NaN
        where tone 1 or mode 2 is attracted. `neglected` along `effect`: the shares of what the formulas neglect. Simulated
        values: `true_E_eff`, `true_indentation`, `true_viscosity`.

    Raises
    ------
    ParameterError
        When the curve is not of two tones whose second is locked, or the tip lacks a radius or half angle.
    """
    import xarray as xr

    case = case_of(curve)
    if len(case.problem.tones) != 2 or "frequency_shift" not in curve:
        raise ParameterError(
            'the curve needs two tones with a lock; write operation = "fm" in the second of drive.tones'
        )
    contact = _contact(case, model)
    seen = _observed(curve, case)
    found = estimate(seen, contact)
    shares = neglected(seen, contact, found)
    dims = curve["mean_deflection"].dims
    variables = {
        "E_eff": (dims, found.E_eff),
        "estimated_indentation": (dims, found.indentation),
        "estimated_viscosity": (dims, found.viscosity),
        "loss_tangent": (dims, found.loss_tangent),
        "neglected": ((*dims, "effect"), np.stack(list(shares.values()), axis=-1)),
        "true_indentation": (dims, curve["max_indentation"].values),
    }
    for name, field in (("true_E_eff", "E_eff"), ("true_viscosity", "viscosity")):
        known = [
            float(getattr(force, field)) for force in case.problem.forces if getattr(force, field, None) is not None
        ]
        variables |= {name: ((), np.array(known[0]))} if known else {}
    places = {dim: curve[dim] for dim in ("zc", "direction") if dim in curve.coords}
    data = xr.Dataset(variables, places | {"effect": list(shares)})
    data.attrs = {"case": curve.attrs["case"], "model": model} | attributes(_advice(seen, shares))
    return describe(data)


def _contact(case: Case, model: str) -> Contact:
    if model == "cone":
        if case.tip.half_angle is None:
            raise ParameterError("a cone needs tip.half_angle, which is missing; write half_angle under [tip]")
        return Contact.cone(case.tip.half_angle)
    radius = case.tip.radius or case.cantilever.tip_radius
    if radius is None:
        raise ParameterError(f"{model} needs tip.radius, which is missing; write radius under [tip]")
    return Contact.punch(radius) if model == "punch" else Contact.paraboloid(radius)


def _observed(curve: xr.Dataset, case: Case) -> Observed:
    """Return what the instrument shows; resonances are counted from the free lock of the signal."""
    tones, modes, f0 = case.problem.tones, case.problem.modes, []
    for tone in tones:
        mode, cot = modes[tone.mode], 0.0
        if tone.lock is not None and "phase" in tone.lock.held:
            cot = 1.0 / math.tan(tone.lock.phase)
            lag = -cot / (2.0 * mode.Q) + math.sqrt(1.0 + cot**2 / (4.0 * mode.Q**2))
            f0.append(tone.frequency / lag)
        else:
            f0.append(mode.f0)
    first, second = modes[tones[0].mode], modes[tones[1].mode]

    def of_tone(name: str, j: int) -> Array:
        return np.asarray(curve[name].isel(tone=j).values)

    return Observed(
        (first.k, second.k),
        (first.Q, second.Q),
        (f0[0], f0[1]),
        (of_tone("drive_frequency", 0), of_tone("drive_frequency", 1)),
        (of_tone("amplitude", 0), of_tone("amplitude", 1)),
        of_tone("drive_force", 0),
        np.radians(of_tone("phase", 0)),
    )


def _advice(seen: Observed, shares: dict[str, Array]) -> list[Advice]:
    """Return what makes the numbers wrong."""
    pieces = []
    for name, (limit, text) in NEGLECTED.items():
        known = shares[name][np.isfinite(shares[name])]
        largest = float(known.max()) if known.size else 0.0
        if largest > limit:
            effect = text.format(found=f"{100.0 * largest:.2g} %")
            said = f"{effect}. The formulas of AM-FM neglect this: their modulus errs by as much or more."
            pieces.append(Advice(f"material_{name}", largest, limit, said, DERIVED, ("drive.tones",)))
    pull, push = float(np.nanmax(seen.virial)), -float(np.nanmin(seen.virial))
    if push > 0.0 and pull > ATTRACTED * push:
        text = "The curve shows attraction. The formulas of AM-FM neglect adhesion: the modulus may be several times too large."
        pieces.append(Advice("material_adhesion", pull / push, ATTRACTED, text, DERIVED, ("forces",)))
    return pieces
