"""Virial and dissipated energy at each measured point, free of any model of the force."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, checked
from dforce.inverse.curve import described

if TYPE_CHECKING:
    import xarray as xr

NEEDED = ("k", "Q", "free_amplitude")
Law = Callable[["Lever", Array, Array], Array]


class Lever(NamedTuple):
    """The lever and its drive: spring constant (N/m), quality factor, free amplitude (m), and the frequency ratio."""

    k: float
    Q: float
    A0: float
    r: float = 1.0

    @property
    def drive(self) -> float:
        """Driving force over k A0."""
        return math.hypot(1.0 - self.r**2, self.r / self.Q)


def virial(lever: Lever, amplitude: Array, lag: Array) -> Array:
    """Return the virial (J); the lag is in rad."""
    stiff = (1.0 - lever.r**2) * amplitude
    return 0.5 * lever.k * amplitude * (stiff - lever.drive * lever.A0 * np.cos(lag))


def dissipated_energy(lever: Lever, amplitude: Array, lag: Array) -> Array:
    """Return the energy that the sample takes per period (J); the lag is in rad."""
    drag = lever.r * amplitude / lever.Q
    return math.pi * lever.k * amplitude * (lever.drive * lever.A0 * np.sin(lag) - drag)


def force_lag(data: xr.Dataset, lever: Lever) -> Array:
    r"""Return the lag behind the force on the mode (rad), for phases with any origin.

    .. math:: \phi - \phi_\mathrm{free} + \arg\left( 1 - r^2 + i r / Q \right)
    """
    own = math.atan2(lever.r / lever.Q, 1.0 - lever.r**2)
    phase = np.asarray(data["phase"].values, dtype=float)
    return np.radians(phase - float(data.attrs.get("free_phase", math.degrees(own)))) + own


def passive_margin(lever: Lever, amplitude: Array, lag: Array) -> Array:
    r"""Return :math:`\sin\phi - r A / (Q g A_0)`, which is no smaller than 0 over a sample that gives no energy."""
    return np.sin(lag) - lever.r * amplitude / (lever.Q * lever.drive * lever.A0)


@checked
def energy(data: xr.Dataset) -> xr.Dataset:
    r"""Return virial and dissipated energy at each point of a calibrated curve, with their errors.

    .. math:: V = \tfrac{1}{2} k A \left[ (1 - r^2) A - g A_0 \cos\phi \right], \qquad
              E = \pi k A \left[ g A_0 \sin\phi - r A / Q \right], \qquad g = \sqrt{(1 - r^2)^2 + r^2 / Q^2}

    with the ratio r of drive frequency to resonance frequency; r = 1 if one of them is unknown. A is the amplitude of the mode.
    The phase counts from the force on the mode. With a case both include its `drive.lag`, its `readout` and a driven base. Both
    equations are exact for a mode that a force drives, with any harmonics. With a driven base E lacks the energy through the
    base.

    Sources: A. San Paulo, R. Garcia, Phys. Rev. B 64, 193411 (2001); J. P. Cleveland et al., Appl. Phys. Lett. 72, 2613
    (1998).

    Parameters
    ----------
    data
        The result of :func:`dforce.calibrate`, with `k` and `Q`.

    Returns
    -------
    xarray.Dataset
        Along `point`: `virial` and `dissipated_energy` (J, per period). `virial_error` and `dissipated_energy_error` (J) are
        random errors, from the noise of each point. `virial_common_error` and `dissipated_energy_common_error` (J) are
        systematic errors, common to all points: from the known errors of free amplitude, phase offset, k and Q.

    Raises
    ------
    ParameterError
        For a curve that is not calibrated, or without k or Q.
    """
    import xarray as xr

    missing = [name for name in NEEDED if name not in data.attrs]
    if missing or "amplitude" not in data or "phase" not in data:
        fault = f"has no {' and no '.join(missing)}" if missing else "has no amplitude and phase"
        raise ParameterError(f"data {fault}: first calibrate the curve with df.calibrate and a case or a thermal tune")
    lever = lever_of(data)
    amplitude, lag = np.asarray(data["amplitude"].values, float), force_lag(data, lever)
    share = float(data.attrs.get("mode_share", 1.0)) ** 2  # both go with the square of the amplitude
    found = xr.Dataset(coords={"direction": data["direction"]}, attrs={"k": lever.k, "Q": lever.Q})
    for name, law in (("virial", virial), ("dissipated_energy", dissipated_energy)):
        noise, common = _errors(data, law, lever, amplitude, lag)
        for ending, values in (("", law(lever, amplitude, lag)), ("_error", noise), ("_common_error", common)):
            found[f"{name}{ending}"] = ("point", share * values)
    return described(found)


def lever_of(data: xr.Dataset) -> Lever:
    """Return the lever of a calibrated curve; driven at resonance where nothing else is known."""
    known = data.attrs
    ratio = float(known["drive_frequency"]) / float(known["f0"]) if {"drive_frequency", "f0"} <= set(known) else 1.0
    return Lever(float(known["k"]), float(known["Q"]), float(known["free_amplitude"]), ratio)


def _errors(data: xr.Dataset, law: Law, lever: Lever, amplitude: Array, lag: Array) -> tuple[Array, Array]:
    """Return the random and the systematic error of a law, from differences."""
    known = data.attrs

    def change(error: float, step: Callable[[float], Array]) -> Array:
        """Return by how much the law changes for one error of something."""
        return 0.5 * (step(error) - step(-error))

    size = float(known.get("amplitude_error", 0.0))
    turn = math.radians(float(known.get("phase_error", 0.0)))
    noise = np.hypot(
        change(size, lambda e: law(lever, amplitude + e, lag)), change(turn, lambda e: law(lever, amplitude, lag + e))
    )
    offset = math.radians(float(known.get("phase_offset_error", 0.0)))
    parts = [change(offset, lambda e: law(lever, amplitude, lag + e))]
    for field, key in (("A0", "free_amplitude_error"), ("k", "k_error"), ("Q", "Q_error")):
        low, high = (
            lever._replace(**{field: getattr(lever, field) + sign * float(known.get(key, 0.0))}) for sign in (-1.0, 1.0)
        )
        parts.append(0.5 * (law(high, amplitude, lag) - law(low, amplitude, lag)))
    return np.asarray(noise, dtype=float), np.sqrt(np.sum(np.square(parts), axis=0))
