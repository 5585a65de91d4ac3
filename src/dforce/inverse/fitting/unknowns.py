"""The unknowns of a fit: parameters of the case, and the offsets and scales of the measurement.

A parameter that cannot be negative is varied by its logarithm: its errors are relative, and no step leaves its domain.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from dforce.case import Case, Fit
from dforce.case.paths import place_of, value_at
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, nearest, shorten
from dforce.core.parameter_quantity import ParameterQuantity
from dforce.findings.finding import DEGREE
from dforce.instrument.shared import values_used
from dforce.inverse.fitting.points import FROM_FREE, MeasuredPoints
from dforce.inverse.values import number_of, value_and_error, with_unit

CASE, HEIGHT, PHASE, SCALE = "case", "height", "phase", "scale"  # targets of an unknown
FREE_POINTS = 5  # used points of free motion: then they constrain A0 and the phase offset themselves
LOG_STEP, LENGTH_STEP = 1e-5, 1e-6  # of the logarithm, and of the free amplitude: differences that give derivatives
# units of unknowns that are varied by their logarithm if they start above 0
OFTEN = ("Pa", "Pa s", "J", "J/m^2", "N/m", "Hz", "m")
ROUNDING = 1e-12  # relative
MOST = 1e6  # times the start: limit of an unknown that is varied by its logarithm, without a bound
NUISANCE = ("zc_offset", "A0", "phase_offset", "amplitude_scale")


@dataclass(frozen=True)
class Unknown:
    """One unknown.

    Attributes
    ----------
    name
        Its name for the user and in the result: a path of the case, or one of :data:`NUISANCE`, with `_2` for tone 2.
    kind
        Its target: the case, the heights, a phase, or the scale of an amplitude.
    path, tone
        Its path in the case; the tone of a phase or a scale, from 0.
    unit, symbol, doc
        SI unit (degree of a phase), symbol and meaning.
    start, low, high
        Start of the fit, and bounds.
    scale
        Size of the varied number: 0 for the logarithm.
    prior
        Value and standard deviation known beforehand.
    """

    name: str
    kind: str
    path: str
    tone: int
    unit: str
    symbol: str
    doc: str
    start: float
    low: float
    high: float
    scale: float
    prior: tuple[float, float] | None = None

    @property
    def is_log(self) -> bool:
        """Whether its logarithm is varied."""
        return self.scale == 0.0

    @property
    def step(self) -> float:
        """Step of the varied number for derivatives."""
        if self.path.endswith("A0") or self.kind == HEIGHT:
            return LENGTH_STEP
        return LOG_STEP

    def varied(self, value: float) -> float:
        """Return the varied number at a value."""
        if not self.is_log:
            return value / self.scale
        return math.log(value) if value > 0.0 else -math.inf

    def value(self, varied: float) -> float:
        """Return the value of the parameter from the varied number. Rounding takes it beyond no bound."""
        value = math.exp(varied) if self.is_log else varied * self.scale
        near = ROUNDING * abs(value)
        if self.high < value < self.high + near:
            return self.high
        return self.low if self.low - near < value < self.low else value

    def slope(self, value: float) -> float:
        """Return the derivative of the value by the varied number."""
        return value if self.is_log else self.scale


def make_unknowns(
    case: Case,
    tones: int,
    free: Sequence[str],
    nuisance: Sequence[str],
    priors: Mapping[str, object],
    bounds: Mapping[str, object],
    starts: Mapping[str, object],
    products: bool = False,
) -> list[Unknown]:
    """Return the unknowns of a fit; with `products` some may be known only as products.

    Raises
    ------
    ParameterError
        For an unknown or unused parameter, two names of one parameter, a bound outside of its domain, a start outside of its
        bounds, and parameters that are known only as products.
    """
    names = [*free, *nuisance]
    if not free:
        raise ParameterError('free must name the parameters to fit, such as ["sample.youngs_modulus"]')
    names += [name for name in priors if name not in names]
    doubled = [name for name in names if names.count(name) > 1]
    if doubled:
        raise ParameterError(f"'{shorten(doubled[0])}' appears twice")
    for known, table in ((priors, "priors"), (bounds, "bounds"), (starts, "start")):
        for name in known:
            if name not in names:
                raise ParameterError(
                    f"{table} has '{shorten(name)}', but the fit does not vary it{nearest(str(name), names)}"
                )
    unknowns = [_made(case, tones, str(name)) for name in names]
    places: dict[tuple[str | int, ...], str] = {}
    for one in unknowns:
        if one.kind == CASE:
            earlier = places.setdefault(place_of(case, one.path), one.name)
            if earlier != one.name:
                raise ParameterError(f"'{earlier}' and '{one.name}' are the same parameter")
    unknowns = [_limited(one, priors, bounds, starts) for one in unknowns]
    if not products:
        refuse_products(unknowns)
    return unknowns


def given_values(case: Case, tones: int, given: Mapping[str, object], fitted: Sequence[str]) -> list[Unknown]:
    """Return the parameters that stay fixed, with their known values and errors as priors.

    Raises
    ------
    ParameterError
        For a parameter that the case does not have or use, or that is fitted, and for a value without an error.
    """
    out = []
    for name, value in given.items():
        if name in fitted:
            raise ParameterError(
                f"given has '{shorten(name)}', but the fit varies it; write its known value under priors"
            )
        one = _made(case, tones, name)
        out.append(replace(one, prior=value_and_error(f"given.{name}", value, one.unit)))
    return out


def _made(case: Case, tones: int, name: str) -> Unknown:
    """Return an unknown that starts where the case is."""
    base, _, number = name.partition("_2")
    tone = 1 if name.endswith("_2") and base in NUISANCE and not number else 0
    word = base if tone else name
    if word in NUISANCE and tone >= tones:
        raise ParameterError(f"'{name}' belongs to tone 2, but the data have {tones} tone")
    free_amplitude = case.problem.tones[tone].A0
    every = -math.inf, math.inf
    if word == "zc_offset":
        size = case.problem.tones[0].A0
        return Unknown(name, HEIGHT, "", 0, "m", r"z_\mathrm{off}", "zc minus the measured height", 0.0, *every, size)
    if word == "phase_offset":
        doc = "measured phase minus the phase of the case"
        return Unknown(name, PHASE, "", tone, DEGREE, r"\phi_\mathrm{off}", doc, 0.0, *every, 1.0)
    if word == "amplitude_scale":
        doc = "measured amplitude over the amplitude of the case"
        return Unknown(name, SCALE, "", tone, "1", "s_A", doc, 1.0, 0.0, math.inf, 0.0)
    path = name if word != "A0" else amplitude_path(case, tone)
    quantity = case.quantity(path)
    value = value_at(case, path)
    if value is None and path.endswith("A0"):
        value = free_amplitude
    if value is None:
        raise ParameterError(f"{path} is not in the case, so the fit has no start value; write it into the case")
    _refuse_unused(case, path)
    start, (low, high) = float(value), quantity.bounds()
    words, size = (quantity.unit, quantity.symbol, quantity.doc.partition(";")[0]), _scale(path, quantity, start, low)
    return Unknown(name, CASE, path, tone, *words, start, low, high, size)


def amplitude_path(case: Case, tone: int) -> str:
    """Return the path of the size of a tone's drive in a case."""
    tones = case.drive.tones
    owner, prefix = (tones[tone], f"drive.tones.{tone + 1}") if tones else (case.drive, "drive")
    return f"{prefix}.{'A0' if owner.A0 is not None else 'base_amplitude'}"


def _scale(path: str, quantity: ParameterQuantity, start: float, low: float) -> float:
    """Return the size of the varied number: 0 for the logarithm."""
    if start > 0.0 and (low >= 0.0 or quantity.unit in OFTEN):
        return 0.0
    if low >= 0.0:
        raise ParameterError(f"{path} starts at {start:g}; a fit varies its logarithm: write a start above 0")
    return abs(start) or 1.0


def _refuse_unused(case: Case, path: str) -> None:
    """Raise ParameterError for a parameter that no force and no part of the instrument reads."""
    drift, section = case.cantilever.drift, path.partition(".")[0]
    given = {"cantilever.Q": "Q", "drive.A0": "A0", "drive.base_amplitude": "A0"}.get(path)
    if drift is not None and given and getattr(drift, given):
        raise ParameterError(
            f"cantilever.drift.{given} sets {given} at each distance, so the data do not constrain {path}"
        )
    if section not in ("tip", "sample", "contact", "medium"):
        return
    used = values_used([type(force) for force in case.forces])
    if path not in used and section != "medium":
        forces = ", ".join(force.name for force in case.forces) or "none"
        raise ParameterError(
            f"{path} has no effect on the forces of this case ({forces}), so the data do not constrain it"
        )


def _limited(one: Unknown, priors: Mapping[str, Any], bounds: Mapping[str, Any], starts: Mapping[str, Any]) -> Unknown:
    """Return an unknown with its prior, bounds and start."""
    name = one.name
    asked = "start"
    if name in priors:
        prior = value_and_error(f"priors.{name}", priors[name], one.unit)
        one, asked = replace(one, prior=prior, start=prior[0] if one.kind == CASE else one.start), "priors"
    if name in starts:
        one, asked = replace(one, start=number_of(f"start.{name}", starts[name], one.unit)), "start"
    if name in bounds:
        given = bounds[name]
        if isinstance(given, str) or not hasattr(given, "__len__") or len(given) != 2:
            raise ParameterError(f"bounds.{name} = {shorten(given)} is not a pair, such as ['10 MPa', '100 GPa']")
        low, high = (number_of(f"bounds.{name}", value, one.unit) for value in given)
        if not (one.low <= low < high <= one.high):
            raise ParameterError(
                f"bounds.{name} = {with_unit(low, one.unit)} to {with_unit(high, one.unit)} is not a range within "
                f"{with_unit(one.low, one.unit)} to {with_unit(one.high, one.unit)}"
            )
        one = replace(one, low=low, high=high)
    start, edges = with_unit(one.start, one.unit), [with_unit(edge, one.unit) for edge in (one.low, one.high)]
    if one.is_log and not one.start > 0.0:
        raise ParameterError(f"{asked}.{name} = {start} is not above 0")
    if not one.low <= one.start <= one.high:
        raise ParameterError(f"{name} starts at {start}, outside of its bounds {' to '.join(edges)}")
    return one


def refuse_products(unknowns: Sequence[Unknown]) -> None:
    """Raise ParameterError for parameters of which any data can constrain only a product.

    All forces scale with k at fixed Q: k and the strengths of forces are known only as ratios. The same holds for the radius
    and the strengths of forces of a paraboloid.
    """
    known = {one.path: one for one in unknowns if one.kind == CASE}
    strengths = [path for path in known if path.startswith(("sample.", "forces."))]
    unknown = [path for path, one in known.items() if one.prior is None]
    lever = [path for path in unknown if path.startswith("cantilever.") and path.endswith((".k", ".Q"))]
    for k in (path for path in lever if path.endswith(".k")):
        if k[:-1] + "Q" in lever:
            raise ParameterError(f"{k} and {k[:-1]}Q cannot both be fitted without a prior for one of them")
    for path in unknown:
        if not strengths:
            break
        if path == "tip.radius":
            raise ParameterError(
                f"tip.radius and {strengths[0]} cannot both be fitted: a curve constrains only their product, such as "
                "E sqrt(R), H R; write priors for tip.radius, or remove it"
            )
        if path.startswith("cantilever") and path.endswith(".k"):
            raise ParameterError(
                f"{path} and {strengths[0]} cannot both be fitted: a curve constrains only forces over k; write priors for "
                f"{path}, from a thermal spectrum, or remove it"
            )


def start_vector(unknowns: Sequence[Unknown]) -> Array:
    """Return the varied numbers at the start."""
    return np.array([one.varied(one.start) for one in unknowns])


def limits(unknowns: Sequence[Unknown]) -> tuple[Array, Array]:
    """Return the bounds of the varied numbers."""
    low, high = (
        np.array([one.varied(edge) for one, edge in zip(unknowns, edges, strict=True)])
        for edges in ([one.low for one in unknowns], [one.high for one in unknowns])
    )
    for i, one in enumerate(unknowns):
        if one.is_log:
            start = one.varied(one.start)
            low[i], high[i] = max(low[i], start - math.log(MOST)), min(high[i], start + math.log(MOST))
    return low, high


def usual_nuisance(case: Case, settings: Fit, read: MeasuredPoints) -> tuple[str, ...]:
    """Return the nuisance parameters: the usual ones of each tone, without an amplitude that the case sets at each distance."""
    if settings.nuisance != Fit().nuisance:
        return settings.nuisance
    if case.cantilever.drift is not None and case.cantilever.drift.A0:
        return tuple(name for name in settings.nuisance if name != "A0")
    if read.tones == 1:
        return settings.nuisance
    return (*settings.nuisance, "A0_2", "phase_offset_2")


def with_free_part(unknowns: list[Unknown], data: MeasuredPoints, given: set[str]) -> list[Unknown]:
    """Return unknowns with priors from the free part, unless its points are in the fit."""
    free = data.attrs.get("free_amplitude")
    if free is None:
        return unknowns
    points = np.flatnonzero(data.used)
    is_free = np.abs(data.amplitude[points, 0] - float(free)) < 3.0 * data.amplitude_error[0]
    if (is_free & (data.branch[points] == FROM_FREE)).sum() >= FREE_POINTS:
        return unknowns
    out = []
    for one in unknowns:
        known = {
            "A0": (float(free), data.attrs.get("free_amplitude_error")),
            "phase_offset": (0.0, data.attrs.get("phase_offset_error")),
        }.get(one.name)
        if known is not None and known[1] and one.name not in given:
            one = replace(one, prior=(known[0], float(known[1])), start=known[0])
        out.append(one)
    return out
