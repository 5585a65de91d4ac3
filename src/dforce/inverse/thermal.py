"""The thermal tune: f0, Q and the spring constant from the spectrum of the free lever's thermal motion."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from dforce.core import units
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, ResultError, UnitError, checked, shorten
from dforce.instrument import beam
from dforce.instrument.resonances import FittedResonance, Resonance, most_likely
from dforce.inverse.readers import content_of, tables_in
from dforce.inverse.table import OF_NOBODY, Column, MeasuredTable
from dforce.inverse.values import ends, measured, show
from dforce.inverse.words import DENSITY, bare, known_unit, naming, scale_to
from dforce.results.dataset import describe

if TYPE_CHECKING:
    import xarray as xr

BOLTZMANN = 1.380649e-23  # J/K; exact in the SI since 2019
ROOM = 298.15  # K
FEWEST = 12  # points of a spectrum about its peak
WIDTHS, FEW = 5.0, 20  # f0/Q on both sides of the peak that are fitted, and the fewest points there
WIDEST = (0.5, 1.5)  # of f0: farther off is no longer this mode alone
ABOVE = 4.0  # times the level around it that a peak reaches
DENSITIES = {"m^2/Hz": 1.0, "m/Hz^0.5": 2.0}  # powers that make a power density of them
VOLTS = {"V^2/Hz": 1.0, "V/Hz^0.5": 2.0}
SMOOTH = 10.0  # spectra in a smoothed point, to find the peak
LEVERS = ("static", "mode")
BEYOND_WINDOWS = 3  # points of a spectrum that are farther apart than Hann's window makes alike
ARRAYS = replace(OF_NOBODY, kind="two arrays")
COARSE = 0.03  # of Q: least bias of a coarse spectrum that is doubted
MISFIT = 3.0  # errors of a correlation of neighbors that is none


@dataclass(frozen=True)
class ThermalTune:
    """f0, k and Q from a thermal spectrum, with standard errors.

    Attributes
    ----------
    f0, k, Q
        Resonance frequency (Hz), spring constant of mode 1 (N/m), quality factor.
    f0_error, k_error, Q_error
        Their standard errors: from the fit, and for k also from the errors of temperature and sensitivity.
    k_static
        Static spring constant (N/m), if the lever is a uniform beam.
    mean_square
        Thermal mean square of the deflection at the detector (m²).
    background
        White background (m²/Hz).
    averages
        Number of averaged spectra, from the scatter around the fit.
    band
        Lowest and highest frequency of the fit (Hz).
    history
        A sentence for each step.
    spectrum
        Frequencies (Hz) and power densities (m²/Hz) of the measurement.
    """

    f0: float
    f0_error: float
    k: float
    k_error: float
    Q: float
    Q_error: float
    k_static: float
    mean_square: float
    background: float
    averages: float
    band: tuple[float, float]
    history: tuple[str, ...]
    spectrum: tuple[Array, Array] = field(repr=False, compare=False)

    def __repr__(self) -> str:
        units = {"f0": "Hz", "k": "N/m", "Q": "1"}
        told = (f"{name} = {show(*pair, units[name])}" for name, pair in self.as_table().items())
        return f"<ThermalTune {', '.join(told)}>"

    def as_table(self) -> dict[str, tuple[float, float]]:
        """Return value and error of f0, k and Q by name."""
        return {name: (getattr(self, name), getattr(self, f"{name}_error")) for name in ("f0", "k", "Q")}

    def density(self, frequency: Array) -> Array:
        """Return the fitted power density (m²/Hz) at frequencies (Hz)."""
        return Resonance(self.f0, self.Q, self.mean_square, self.background).density(frequency)

    def dataset(self) -> xr.Dataset:
        """Return measured and fitted power density (m²/Hz) along `frequency`, for ``df.plot.thermal_spectrum``."""
        import xarray as xr

        frequency, density = self.spectrum
        columns = {
            "spectral_density": ("frequency", density),
            "fitted_density": ("frequency", self.density(frequency)),
            "fitted_f0": ((), self.f0),
            "fitted_Q": ((), self.Q),
        }
        return describe(xr.Dataset(columns, {"frequency": frequency}))


@checked
def thermal_tune(
    spectrum: str | os.PathLike[str] | ArrayLike,
    density: ArrayLike | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    unit: str | None = None,
    sensitivity: Any = None,
    calibrated: str = "static",
    temperature: Any = None,
    band: Sequence[Any] | None = None,
) -> ThermalTune:
    r"""Return f0, Q and k of a lever from the spectrum of its thermal motion.

    .. math:: S(f) = W + \langle z^2 \rangle \frac{2}{\pi f_0 Q}\, \frac{1}{(1 - r^2)^2 + r^2 / Q^2}, \qquad r = f / f_0, \qquad
              k = \frac{k_\mathrm{B} T}{\langle z^2 \rangle}

    with the one-sided density S and a white background W (m²/Hz). An optical lever calibrated by a force curve measures mode 1
    as :math:`s_1 z`, with the slope :math:`s_1` at the end: then :math:`k = s_1^2 k_\mathrm{B} T / \langle z^2 \rangle`. The
    static spring constant is :math:`12 k / \kappa_1^4`.

    Source: H.-J. Butt, M. Jaschke, Nanotechnology 6, 1 (1995).

    Parameters
    ----------
    spectrum
        A file: of any kind that :func:`dforce.read_measured` reads, with columns of frequency and density (m²/Hz or m/√Hz, or
        in volts), or a saved result of :func:`dforce.thermal_spectrum`. Or frequencies (Hz), an array.
    density
        Densities at these frequencies, an array of the same length, in `unit`.
    columns
        Names of the columns, ``{"frequency": ..., "density": ...}``, if their headings are unknown to dForce.
    unit
        Unit of a density without a unit in its column, and of an array: ``"pm/sqrt(Hz)"``.
    sensitivity
        Sensitivity that converts volts (m/V, or text such as ``"52(1) nm/V"``, with its error for the error of k).
    calibrated
        Calibration of the sensitivity: ``"static"``, by a force curve on a hard sample (an optical lever then has another
        sensitivity to mode 1), or ``"mode"``, for this mode.
    temperature
        Temperature (K, or text such as ``"25 degC"`` or ``"298(1) K"``); default: 298.15 K.
    band
        Lowest and highest frequency of the fit (Hz, or texts with units); default: 5 widths of the peak on both sides.

    Raises
    ------
    ResultError
        For a file that cannot be read, or a spectrum with too few points or without a clear peak.
    ParameterError
        If a necessary setting is missing in the file, and for arrays of other shapes or without a unit.
    """
    if calibrated not in LEVERS:
        raise ParameterError(f"calibrated = '{shorten(calibrated)}' is not one of {', '.join(LEVERS)}")
    if density is None and isinstance(spectrum, str | os.PathLike):
        content, name = content_of(spectrum)
        table = tables_in(content, name)[0]
    else:
        table, name = _arrays(spectrum, density, unit), "the spectrum"
    length = None if sensitivity is None else measured(sensitivity, "m/V", "sensitivity")
    warm = measured(ROOM if temperature is None else temperature, "K", "temperature")
    if warm.value <= 0.0 or (length is not None and length.value <= 0.0):
        raise ParameterError("temperature and sensitivity must be above 0")
    frequency, power, how = _spectrum(table, columns or {}, unit, None if length is None else length.value, name)
    tune = _fitted(frequency, power, None if band is None else ends(band, "Hz", "band", "frequency"), name)
    history = [f"read: {table.reader}, {len(frequency)} points", how, *tune.history]
    factor = beam.lever_factor(1) ** 2 if calibrated == "static" else 1.0
    k = factor * BOLTZMANN * warm.value / tune.mean_square
    relative = [tune.k_error / tune.k, (warm.error or 0.0) / warm.value]
    if length is not None and length.error is not None and "V" in how:
        relative.append(2.0 * length.error / length.value)
    k_error = k * math.sqrt(sum(part**2 for part in relative))
    k_static = k * 12.0 / beam.wavenumber(1) ** 4
    way = (
        f"static sensitivity: the end slope of mode 1 is smaller by {factor:.4f}"
        if calibrated == "static"
        else "sensitivity of the mode itself"
    )
    history.append(
        f"k: {show(k, k_error, 'N/m')} of mode 1, {units.show(k_static, 'N/m', 4)} static, by equipartition at "
        f"{warm.value:.5g} K ({way})"
    )
    return replace(tune, k=k, k_error=k_error, k_static=k_static, history=tuple(history), spectrum=(frequency, power))


def _arrays(frequency: object, density: object, unit: str | None) -> MeasuredTable:
    """Return a table of frequencies and densities from arrays."""
    if density is None or isinstance(frequency, str | os.PathLike):
        raise ParameterError("pass a file, or two arrays: frequencies (Hz) and densities, with their unit")
    values = []
    for name, given in (("frequency", frequency), ("density", density)):
        try:
            array = np.asarray(given, dtype=float)
        except (TypeError, ValueError):
            raise ParameterError(f"{name} is not an array of numbers") from None
        if array.ndim != 1:
            raise ParameterError(f"{name} has {array.ndim} dimensions; it must have one")
        values.append(array)
    if len(values[0]) != len(values[1]):
        raise ParameterError(f"there are {len(values[0])} frequencies and {len(values[1])} densities")
    if unit is not None and known_unit(unit) is None:
        raise ParameterError(f"unit = '{shorten(unit)}' is not a known unit, such as 'm^2/Hz' or 'pm/sqrt(Hz)'")
    return MeasuredTable((Column("frequency", "Hz", values[0]), Column("density", None, values[1])), reader=ARRAYS)


def _spectrum(
    table: MeasuredTable, columns: Mapping[str, str], unit: str | None, sensitivity: float | None, name: str
) -> tuple[Array, Array, str]:
    """Return frequencies (Hz), power densities (m²/Hz), and a sentence on the unit."""
    unknown = [key for key in columns if key not in ("frequency", "density")]
    if unknown:
        raise ParameterError(f"columns: '{shorten(unknown[0])}' is neither frequency nor density")
    frequency = _column(table, columns.get("frequency"), ("frequency", "freq", "f"), "frequency", name)
    density = _column(table, columns.get("density"), DENSITY, "density", name)
    said = known_unit(unit) if unit is not None else density.unit
    if not said:
        raise ParameterError(
            f"{name} has no unit for the density (column '{density.name}'); write unit = 'm^2/Hz', "
            "'pm/sqrt(Hz)' or 'V/sqrt(Hz)'"
        )
    power, volts, scale = _scale(said, density.name, name)
    if volts and sensitivity is None:
        raise ParameterError(
            f"{name} has the density in {said}; write the sensitivity, such as sensitivity = '52 nm/V'"
        )
    scale *= float(sensitivity or 1.0) ** (2.0 / power) if volts else 1.0
    unused = "" if volts or sensitivity is None else "; the sensitivity is not used"
    f = np.asarray(frequency.values, dtype=float) * scale_to(frequency.unit or "Hz", "Hz")
    s = np.asarray(density.values, dtype=float) * scale
    for column, values in ((frequency, f), (density, s)):
        if not (values > 0.0).any():
            none = "no numbers" if not np.isfinite(values).any() else f"no value above 0 in its {len(values)} points"
            raise ResultError(f"{name}: the column '{shorten(column.name, 30)}' contains {none}; choose another column")
    keep = np.isfinite(f) & np.isfinite(s) & (s > 0.0) & (f > 0.0)
    order = np.argsort(f[keep], kind="stable")
    return f[keep][order], s[keep][order] ** power, f"density: column '{density.name}' in {said}{unused}"


def _column(table: MeasuredTable, wanted: str | None, known: Sequence[str], noun: str, name: str) -> Column:
    numbers = table.numbers
    found = [one for one in numbers if (bare(one.name) in known if wanted is None else one.name == wanted)]
    if len(found) != 1:
        there = ", ".join(f"'{shorten(column.name, 30)}'" for column in numbers[:20])
        asked = f"no column '{shorten(wanted)}'" if wanted else f"{len(found)} columns" if found else "no column"
        raise ParameterError(f"{name} has {asked} for the {noun}; name it with {naming(noun)}; its columns: {there}")
    return found[0]


def _scale(unit: str, column: str, name: str) -> tuple[float, bool, float]:
    """Return the power that makes a power density, whether it is in volts, and the scale to SI units."""
    for table, volts in ((DENSITIES, False), (VOLTS, True)):
        for stored, power in table.items():
            try:
                return power, volts, scale_to(unit, stored)
            except UnitError:
                continue
    raise ParameterError(
        f"{name}: the unit {unit} of the column '{column}' is not a density, such as m^2/Hz or pm/sqrt(Hz)"
    )


def _fitted(frequency: Array, power: Array, band: tuple[float, float] | None, name: str) -> ThermalTune:
    """Return the fit of a spectrum, with k of 1 at a mean square of 1; its errors are of the fit alone."""
    if band is not None:
        inside = (frequency >= band[0]) & (frequency <= band[1])
        frequency, power = frequency[inside], power[inside]
    if (count := len(np.unique(frequency))) < FEWEST:
        where = "" if band is None else " in the band"
        raise ResultError(
            f"{name} has densities above 0 at {count} {'frequency' if count == 1 else 'frequencies'}{where}, but a fit "
            f"needs {FEWEST} or more"
        )
    every, start = (frequency, power), _start(frequency, power, name)
    fit = _most_likely(frequency, power, start, name)
    for widths in (3.0 * WIDTHS, WIDTHS) if band is None else ():
        frequency, power = _about(every, fit.peak, widths, name)
        fit = _most_likely(frequency, power, replace(fit.peak, background=start.background), name)
    peak = fit.peak
    factor, doubts = _misfit(power / peak.density(frequency) - 1.0)
    errors = [factor * error for error in fit.errors]
    step, width = float(np.median(np.diff(frequency))), peak.f0 / peak.Q
    low = step / (math.pi * width)  # a segment of 1/step without a window widens the peak by step/pi
    if low > max(errors[1], COARSE):
        doubts += (
            f"doubt: the frequencies are {units.show(step, 'Hz', 2)} apart, and the peak is {units.show(width, 'Hz', 2)} wide: "
            f"Q may be too low by up to {low:.0%}; average longer records",
        )
    if not frequency[0] < peak.f0 < frequency[-1] or errors[1] > 0.5:
        raise ResultError(f"{name} has no clear peak for f0 and Q; pass the frequencies around it as band")
    ends = (float(frequency[0]), float(frequency[-1]))
    history = (
        f"fit: {len(frequency)} points from {units.show_range(*ends, 'Hz', 5)}, as of {fit.averages:.3g} averaged spectra",
        *doubts,
        f"f0: {show(peak.f0, peak.f0 * errors[0], 'Hz')}",
        f"Q: {show(peak.Q, peak.Q * errors[1], '1')}",
    )
    return ThermalTune(
        peak.f0,
        peak.f0 * errors[0],
        1.0,
        errors[2],
        peak.Q,
        peak.Q * errors[1],
        1.0,
        peak.mean_square,
        peak.background,
        fit.averages,
        ends,
        history,
        every,
    )


def _most_likely(frequency: Array, power: Array, start: Resonance, name: str) -> FittedResonance:
    try:
        return most_likely(frequency, power, start)
    except ArithmeticError:
        raise ResultError(
            f"{name} has a peak that one resonance does not fit; pass the frequencies around it as band"
        ) from None


def _about(every: tuple[Array, Array], peak: Resonance, widths: float, name: str) -> tuple[Array, Array]:
    """Return the points within so many widths of a peak, and not so far that another mode counts."""
    frequency, power = every
    half = max(widths * peak.f0 / peak.Q, FEW * float(np.median(np.diff(frequency))))
    inside = np.abs(frequency - peak.f0) <= min(half, (1.0 - WIDEST[0]) * peak.f0)
    if int(inside.sum()) < FEWEST:
        raise ResultError(f"{name} has {int(inside.sum())} points around its peak, but a fit needs {FEWEST} or more")
    return frequency[inside], power[inside]


def _misfit(rest: Array) -> tuple[float, tuple[str, ...]]:
    """Return the factor of errors where neighbors deviate from the fit together, and a sentence on it.

    A window of the spectra, such as Hann's, correlates neighbors over at most two points. If they deviate together farther
    along, the peak is not one steady resonance: it drifted while spectra were averaged, or overlaps another.
    """
    together, along = (_correlation(rest, points) for points in (1, BEYOND_WINDOWS))
    chance = 1.0 / math.sqrt(len(rest))
    limit, together = MISFIT * chance, min(together, 0.95)
    factor = math.sqrt((1.0 + together) / (1.0 - together)) if together > chance else 1.0
    if together < limit:  # few points of a coarse spectrum do not show the window, which makes their errors larger
        return factor, ()
    larger = f"all errors are enlarged by {factor:.1f}"
    if along < limit:
        return factor, (f"neighbors are correlated by {together:.2f}, as after windowing of the spectra; {larger}",)
    return factor, (
        f"doubt: neighboring residuals are correlated by {together:.2f}, so this is not the peak of one steady "
        f"resonance; {larger}",
    )


def _correlation(rest: Array, points: int) -> float:
    """Return how much values so many points apart are alike."""
    return float((rest[points:] * rest[:-points]).sum() / (rest**2).sum())


def _start(frequency: Array, power: Array, name: str) -> Resonance:
    """Return the resonance to start from: by the highest smoothed point, and the area about it."""
    scatter = 0.5 * float(np.diff(np.log(power)).var())  # of neighbors: 1.6 for single spectra
    count = int(np.clip(round(SMOOTH * scatter), 1, max(len(power) // 20, 1)))
    smooth = np.convolve(power, np.ones(count) / count, mode="same")
    # above the low frequencies, where drift and hum are
    low = int(np.searchsorted(frequency, 0.02 * frequency[-1]))
    peak = low + int(np.argmax(smooth[low:]))
    level = float(np.median(power))
    if smooth[peak] < ABOVE * level:
        raise ResultError(f"{name} has no peak above its background")
    f0, step = float(frequency[peak]), float(np.median(np.diff(frequency)))
    near = (frequency > WIDEST[0] * f0) & (frequency < WIDEST[1] * f0)
    area = float(np.clip(smooth[near] - level, 0.0, None).sum()) * step
    height = float(smooth[peak]) - level
    return Resonance(f0, max(0.5 * math.pi * f0 * height / area, 0.6), area, level)
