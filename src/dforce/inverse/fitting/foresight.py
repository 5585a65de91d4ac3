"""`df.identify`: the parameters that an instrument and a range of distances constrain, before a measurement."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.case.paths import value_at
from dforce.core.arrays import Array, Bools, Indices
from dforce.core.errors import ParameterError, checked, shorten
from dforce.experiments import Approach
from dforce.findings.finding import DEGREE
from dforce.inverse.fitting.certainty import NOT_TOLD, TOGETHER, Certainty, certainty, known_products
from dforce.inverse.fitting.curves import ModelBranches
from dforce.inverse.fitting.model import CurveModel
from dforce.inverse.fitting.points import BEHIND_JUMP, FROM_FREE, MeasuredPoints
from dforce.inverse.fitting.unknowns import Unknown, amplitude_path, make_unknowns, start_vector
from dforce.inverse.measured import check_measured
from dforce.inverse.values import number_of
from dforce.results.provenance import of_case
from dforce.solvers.blocks import block_type
from dforce.solvers.quasi_static_walk import Walk
from dforce.solvers.states import States

if TYPE_CHECKING:
    import xarray as xr

POINTS = 101  # of each branch
FARTHEST, NEAREST = 1.15, 0.3  # of the free amplitude: default range
AMPLITUDE_ERROR, PHASE_ERROR = 2e-3, 0.3  # of the free amplitude, and degrees: usual noise
PRIORS = {"A0": 5e-3, "Q": 0.02, "phase_offset": 0.5}  # usual errors: of the value, of the value, degrees
SAMPLE, PRIOR, ALL = "sample", "prior", "all"  # the instrument: all known, with usual errors, unknown
UNSEEN, ONLY_PRODUCT, NOT_CONSTRAINED = "not seen", "only a product", "not constrained by this curve"  # verdicts
MARGIN = 2  # points beside the end of a branch
SECOND = {"f0": 6.2, "k": 39.3, "Q": 2.5}  # a second mode over the first, as of a rectangular lever in air
SECOND_A0, SECOND_ERROR = 1.0 / 30.0, 5e-12  # of the first free amplitude; m
OTHERS = {"half the free amplitude": 0.5, "twice the free amplitude": 2.0}
WITH_SECOND = "with a second tone"


@dataclass(frozen=True)
class _Branches:
    """A case with the derivatives of its branches by all unknowns, the rows of amplitudes and phases in noise."""

    unknowns: list[Unknown]
    jacobian: Array
    kind: Indices
    nearer: Bools

    def rows(self, which: Any = slice(None)) -> tuple[list[Unknown], Array]:
        """Return the unknowns, and the derivatives at some of the points."""
        return self.unknowns, self.jacobian[which]


@checked
def identify(
    case: Case,
    zc: Any = None,
    free: Sequence[str] | None = None,
    errors: Mapping[str, Any] | None = None,
    helps: bool = True,
) -> xr.Dataset:
    """Return the expected errors of fitted parameters, before the measurement of a tapping curve.

    The errors are the Cramér–Rao bound of a fit to such a curve, from the branches of the case and their derivatives.

    Parameters
    ----------
    case
        Instrument, sample and forces, at the expected values.
    zc
        Average distances: an array (m), a list of texts, or a grid; default: 101 from 1.15 to 0.3 times the free amplitude of
        the tip. Or a measured curve (:func:`calibrate`), with its heights plus `height_offset`, and its noise.
    free
        Paths of the parameters; default: from the table `[fit]`.
    errors
        Noise: `amplitude` (m) and `phase` (degrees), with `_2` for tone 2; default: 0.2 % of the free amplitude, 0.3 degrees.
    helps
        Whether to try improvements: other free amplitudes, and a second tone on a lever with one mode.

    Returns
    -------
    xarray.Dataset
        Over `curve` (approach alone, approach and retract, each branch alone, and improvements), `known` and `parameter`:
        `error` (relative for positive parameters, else m or degrees), `verdict`. `known` is ``sample`` (exact instrument),
        ``prior`` (free amplitude, Q and phase offset to 0.5 %, 2 % and 0.5 degrees) or ``all`` (all three unknown). The offset
        of the heights is always unknown. Also `worst_pair` and `worst_correlation`. ``attrs["products"]`` lists parameters with
        only their product constrained.

    Raises
    ------
    ParameterError
        As in :func:`dforce.fit` for the parameters, and for distances without any state.
    """
    case.problem.refuse_lock("a fit")
    names = tuple(free) if free is not None else (case.fit.free if case.fit is not None else ())
    if not names:
        raise ParameterError('free must name the parameters to fit, such as ["sample.youngs_modulus"]')
    if hasattr(zc, "data_vars"):
        zc, errors = _measured(zc, errors)
    errors = errors or {}
    curves = _parts(_branches(case, zc, names, errors))
    if helps:
        for words, factor in OTHERS.items():
            curves[words] = _branches(*_with_amplitude(case, zc, factor), names, errors).rows()
        other = with_second_tone(case)
        if other is not None:
            curves[WITH_SECOND] = _branches(other, zc, names, {"amplitude_2": SECOND_ERROR, **errors}).rows()
    return _dataset(case, names, curves)


def _measured(data: xr.Dataset, errors: Mapping[str, Any] | None) -> tuple[Array, Mapping[str, Any]]:
    """Return the distances (m) of a measured curve, and its noise unless `errors` are set."""
    check_measured(data)
    known = [f"{name}{ending}" for name in ("amplitude", "phase") for ending in ("", "_2")]
    noise = {name: data.attrs[f"{name}_error"] for name in known if f"{name}_error" in data.attrs}
    return data["height"].values + float(data.attrs.get("height_offset", 0.0)), {**noise, **(errors or {})}


def with_second_tone(case: Case) -> Case | None:
    """Return a case whose lever of one mode has a second one, driven as well; None where it has several or is a beam."""
    lever = case.cantilever
    if len(case.problem.modes) > 1 or lever.modes or lever.f0 is None or case.drive.tones or case.drive.A0 is None:
        return None
    first = case.problem.modes[0]
    modes = [{"f0": first.f0, "k": first.k, "Q": first.Q}]
    modes.append({name: factor * modes[0][name] for name, factor in SECOND.items()})
    drive = {
        name: getattr(case.drive, name)
        for name in ("excitation", "fluid_follows", "piezo")
        if getattr(case.drive, name)
    }
    A0 = case.problem.tones[0].A0
    return case.replace(
        cantilever={"modes": modes}, drive={**drive, "tones": [{"A0": A0}, {"A0": SECOND_A0 * A0}]}, fit=None, data=None
    )


def _with_amplitude(case: Case, zc: object, factor: float) -> tuple[Case, Any]:
    """Return a case with another free amplitude, and distances in proportion."""
    path = amplitude_path(case, 0)
    return case.replace(path, factor * float(value_at(case, path))), factor * _distances(case, zc)


def _distances(case: Case, zc: object) -> Array:
    """Return the distances from far to near."""
    A0 = case.problem.tones[0].A0
    if zc is None:
        moved = A0 * case.problem.tip_share
        return np.linspace(FARTHEST * moved, NEAREST * moved, POINTS)
    grid = Approach(zc=zc).distances(A0)
    found = np.unique(np.asarray(grid, dtype=float))[::-1]
    if len(found) < 2:
        raise ParameterError("zc is one distance; a curve needs several")
    return found


def _branches(case: Case, zc: object, free: Sequence[str], errors: Mapping[str, object]) -> _Branches:
    along, tones = _distances(case, zc), len(case.problem.tones)
    unknowns = _all_unknowns(case, free)
    behind = _behind(case, along)
    kinds = np.repeat([FROM_FREE, BEHIND_JUMP], [len(along), len(along) if behind is not None else 0])
    heights = np.concatenate([along, along[::-1]])[: len(kinds)]
    amplitude, phase = np.ones((len(kinds), tones)), np.full((len(kinds), tones), 90.0)
    if behind is not None:
        amplitude[len(along)], phase[len(along)] = behind
    sigma_a, sigma_phi = _noise(case, errors)
    data = MeasuredPoints(
        heights, amplitude, phase, kinds.astype(np.int64), np.ones(len(kinds), bool), sigma_a, sigma_phi, 0.0, {}
    )
    model = CurveModel(case, unknowns, data)
    varied = start_vector(unknowns)
    predicted = model.predict(varied)
    used = ~predicted.lost
    for kind in (FROM_FREE, BEHIND_JUMP):
        mine = np.flatnonzero(kinds == kind)
        if predicted.lost[mine].any() and used[mine].any():  # its end is a jump
            used[mine[used[mine]][-MARGIN:]] = False
    if not used.any():
        raise ParameterError(
            "the case has no steady motion of one period at these distances, so no curve exists to fit"
        )
    slopes = model.slopes(varied, predicted) / data.sigma[:, None]
    first = np.flatnonzero(used & (kinds == FROM_FREE))
    fold = heights[first].min() if len(first) else math.inf
    return _Branches(unknowns, slopes[used], kinds[used], (heights < fold)[used])


def _noise(case: Case, errors: Mapping[str, Any]) -> tuple[Array, Array]:
    """Return the noise of amplitudes (m) and phases (degrees), (tones,) each.

    Raises
    ------
    ParameterError
        For errors of a quantity that a curve does not have, or not above 0.
    """
    amplitude, phase = [], []
    known = [f"{name}{ending}" for name in ("amplitude", "phase") for ending in ("", "_2")]
    for name in errors:
        if name not in known:
            raise ParameterError(f"errors has '{shorten(str(name))}'; known: {', '.join(known)}")
    for j, tone in enumerate(case.problem.tones):
        ending = "" if j == 0 else f"_{j + 1}"
        usual = AMPLITUDE_ERROR * tone.A0
        amplitude.append(number_of(f"errors.amplitude{ending}", errors.get(f"amplitude{ending}", usual), "m"))
        phase.append(number_of(f"errors.phase{ending}", errors.get(f"phase{ending}", PHASE_ERROR), DEGREE))
    if not min(*amplitude, *phase) > 0.0:
        raise ParameterError("the errors of amplitude and phase must be above 0")
    return np.array(amplitude), np.array(phase)


def _behind(case: Case, along: Array) -> tuple[Array, Array] | None:
    """Return amplitudes and phases at the nearest distance behind a jump of an approach; None where there is no jump."""
    curves = ModelBranches(case.problem, [], case.solver, len(case.problem.tones))
    block = block_type(curves.settings).of_one(case.problem, curves.settings, 1, points=curves.samples)
    count = len(block.memory_scale), block.hysteresis
    start = States(block.batch.at_heights(along[:1]).free(), np.zeros((1, count[0])), np.zeros((1, count[1])))
    walk = Walk(block, along[None], start, lambda points: None)
    walk.run()
    if not walk.jumps[0] or not walk.points.is_orbit[0, -1]:
        return None
    read = curves.read(block, np.zeros(1, np.int64), along[-1:], walk.points.rows[0, -1:])[0]
    return read[: curves.tones], read[curves.tones :]


def _all_unknowns(case: Case, free: Sequence[str]) -> list[Unknown]:
    """Return the unknowns of all sets: parameters, heights, then the instrument's."""
    tones = len(case.problem.tones)
    endings = ["", "_2"][: min(tones, 2)]
    nuisance = ["zc_offset", *(f"A0{ending}" for ending in endings), *(f"phase_offset{ending}" for ending in endings)]
    quality = [path for path in _quality_paths(case) if path not in free]
    free = [_of_modes(case, path) for path in free]
    wanted = [name for name in nuisance if name not in free]
    return make_unknowns(
        case, tones, [*free, *(path for path in quality if path not in free)], wanted, {}, {}, {}, True
    )


def _of_modes(case: Case, path: str) -> str:
    """Return the path of a lever's value where it was one of the only mode, and there are more now."""
    parts = path.split(".")
    single = parts[0] == "cantilever" and len(parts) == 2 and parts[1] in SECOND and case.cantilever.modes
    return f"cantilever.modes.1.{parts[1]}" if single else path


def _quality_paths(case: Case) -> list[str]:
    if case.cantilever.modes:
        tones = {tone.mode for tone in case.problem.tones}
        given = [mode.Q is not None for mode in case.cantilever.modes]
        return [f"cantilever.modes.{n + 1}.Q" for n in sorted(tones) if given[n]]
    return ["cantilever.Q"] if isinstance(case.cantilever.Q, float) else []


def _parts(found: _Branches) -> dict[str, tuple[list[Unknown], Array]]:
    """Return the parts of the Jacobian for each curve, by its name."""
    behind = found.kind == BEHIND_JUMP
    if not behind.any():
        return {"approach": found.rows()}
    return {
        "approach": found.rows(~behind | found.nearer),
        "approach and retract": found.rows(),
        "before the jump": found.rows(~behind),
        "behind the jump": found.rows(behind),
    }


def _with_known(unknowns: list[Unknown], jacobian: Array, free: Sequence[str], known: str) -> tuple[list[int], Array]:
    """Return which unknowns a set has, and its Jacobian with its priors."""
    rows, which = [jacobian.reshape(-1, len(unknowns))], []
    for i, one in enumerate(unknowns):
        own = i < len(free) or one.name == "zc_offset"
        if own or known != SAMPLE:
            which.append(i)
        if known == PRIOR and not own:
            row = np.zeros((1, len(unknowns)))
            share = PRIORS["Q" if one.path.endswith(".Q") else one.name.removesuffix("_2")]
            row[0, i] = 1.0 / share  # of a logarithm, and of a phase in degrees
            rows.append(row)
    return which, np.concatenate(rows)[:, which]


def _dataset(case: Case, free: Sequence[str], curves: dict[str, tuple[list[Unknown], Array]]) -> xr.Dataset:
    import xarray as xr

    sets = [SAMPLE, PRIOR, ALL]
    longest = max((found[0] for found in curves.values()), key=len)
    names = [one.name for one in next(iter(curves.values()))[0]]
    names += [one.name for one in longest if one.name not in names and "modes" not in one.name]
    shape = (len(curves), len(sets), len(names))
    error, verdict = np.full(shape, np.nan), np.full(shape, "", dtype="<U40")
    worst, pair = np.full(shape[:2], np.nan), np.full(shape[:2], "", dtype=f"<U{2 * max(map(len, names)) + 5}")
    products = []
    for c, (unknowns, jacobian) in enumerate(curves.values()):
        for k, known in enumerate(sets):
            which, rows = _with_known(unknowns, jacobian, free, known)
            some = [unknowns[i] for i in which]
            found = certainty(rows, some)
            slope = np.array([1.0 if one.is_log else one.scale for one in some])
            for one, sigma, text in zip(some, found.errors * slope, _verdicts(some, found), strict=True):
                name = one.name.replace("modes.1.", "") if one.name not in names else one.name
                if name in names:
                    error[c, k, names.index(name)], verdict[c, k, names.index(name)] = sigma, text
            worst[c, k], both = found.closest
            pair[c, k] = ", ".join(some[i].name for i in both)
            if len(found.dead):
                products.append(f"{list(curves)[c]}, {known}: {', '.join(known_products(found.dead, some))}")
    first = next(iter(curves.values()))[0]
    unit = {one.name: "1" if one.is_log else one.unit for one in [*longest, *first]}
    dims = ("curve", "known")
    return xr.Dataset(
        {
            "error": ((*dims, "parameter"), error),
            "verdict": ((*dims, "parameter"), verdict),
            "worst_correlation": (dims, worst),
            "worst_pair": (dims, pair),
        },
        {
            "curve": list(curves),
            "known": sets,
            "parameter": names,
            "unit": ("parameter", [unit[name] for name in names]),
        },
        of_case(case) | {"kind": "identify", "free": list(free), "products": "\n".join(products)},
    )


def _verdicts(unknowns: list[Unknown], found: Certainty) -> list[str]:
    """Return words for the certainty of each unknown."""
    out = []
    correlation = np.abs(np.nan_to_num(found.correlation - np.diag(np.diag(found.correlation))))
    for i, (one, error) in enumerate(zip(unknowns, found.errors, strict=True)):
        if not found.seen[i]:
            out.append(UNSEEN)
        elif math.isinf(error):
            out.append(ONLY_PRODUCT)
        elif one.is_log and error > NOT_TOLD:
            out.append(NOT_CONSTRAINED)
        elif correlation[i].max(initial=0.0) > TOGETHER:
            out.append("only together with another")
        else:
            out.append("told")
    return out
