"""`df.safe_settings`: the free amplitudes that press a sample by less than a limit, at one set point."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from dforce.case import Case, case_of
from dforce.core.errors import ParameterError, checked
from dforce.core.units import parse_share, show, show_range
from dforce.experiments.base import Progress
from dforce.findings.fits import NO_MODEL, is_constrained, judged_fit, verdict
from dforce.inverse._plan_words import UNSTEADY
from dforce.inverse.planner import plan
from dforce.inverse.values import above_zero

if TYPE_CHECKING:
    import xarray as xr

AMPLITUDES = 13  # from an eighth of the free amplitude to all of it, evenly in its logarithm
SMALLEST = 1.0 / 8.0
DIGITS = 3


@checked
def safe_settings(
    result: xr.Dataset | Case,
    limit: float | str = "1 nN",
    set_point: float | str = 0.8,
    progress: Progress | bool | None = None,
) -> xr.Dataset:
    """Return peak force and indentation at a set point against the free amplitude, and the amplitudes that keep a limit.

    Of all stable states at the set point, the state with the largest peak force counts. :func:`plan` varies other settings,
    too.

    Parameters
    ----------
    result
        A case, or a fit with its best case.
    limit
        Largest peak force (N, or text with a unit).
    set_point
        The share :math:`A / A_0`: 0.8 or ``"80 %"``.
    progress
        True for a bar, or a function called as ``progress(done, total, note)``.

    Returns
    -------
    xarray.Dataset
        Over `A0` (m), 13 values from an eighth of the free amplitude of the case up to all of it: `peak_force` (N) and
        `max_indentation` (m) of the counting state. Also `states` (number of stable states), `unsteady` and `allowed`. If
        `unsteady` is true, motions alternate or beat, with unknown forces. The attribute `findings` lists sentences; doubts
        about a fit come first.

    Raises
    ------
    ParameterError
        For a result that is neither a fit nor a case, a limit that is not a force above 0, and a drive without a free
        amplitude. Also for a fit whose model does not describe the data, and for a case that :func:`plan` refuses.
    KeyboardInterrupt
        When the work is stopped before the states are solved.
    """
    import xarray as xr

    doubts = [] if isinstance(result, Case) else list(_doubts(result))
    case, share, most = _case(result), parse_share(set_point, "set_point"), above_zero("limit", limit, "N")
    path = "drive.tones.1.A0" if case.drive.tones else "drive.A0"
    A0 = case.drive.tones[0].A0 if case.drive.tones else case.drive.A0
    if A0 is None:
        raise ParameterError("the drive has no free amplitude (drive.A0), which safe settings vary")
    amplitudes = np.geomspace(SMALLEST * A0, A0, AMPLITUDES)
    bare = case.model_copy(update={"fit": None, "data": None})
    found = plan(bare, {path: amplitudes.tolist()}, [share], {"peak_force": f"< {most!r} N"}, progress=progress)
    forces, depths = (found[name].values[:, 0, :] for name in ("peak_force", "max_indentation"))
    unsteady = found["unsteady"].values[:, 0]
    states = np.isfinite(forces).sum(axis=1)
    hardest = np.argmax(np.where(np.isfinite(forces), forces, -np.inf), axis=1)[:, None]
    force, depth = (np.take_along_axis(values, hardest, axis=1)[:, 0] for values in (forces, depths))
    out = xr.Dataset(
        {
            "peak_force": ("A0", force, {"units": "N"}),
            "max_indentation": ("A0", depth, {"units": "m"}),
            "states": ("A0", states),
            "unsteady": ("A0", unsteady),
            "allowed": ("A0", (force < most) & ~unsteady),
        },
        {"A0": ("A0", amplitudes, {"units": "m"})},
        {"kind": "safe_settings", "limit": most, "set_point": share},
    )
    out.attrs["findings"] = [*doubts, *_sentences(out)]
    return out


def _case(result: xr.Dataset | Case) -> Case:
    """Return the case of a fit, or a case itself."""
    if isinstance(result, Case):
        return result
    if result.attrs.get("kind") != "fit":
        raise ParameterError("result is neither a fit nor a case; get a fit from df.fit(case, data, free=[...])")
    if judged_fit(result).word == NO_MODEL:
        raise ParameterError("the model of this fit does not describe the data, so its case shows no safe settings")
    return case_of(result)


def _doubts(fit: xr.Dataset) -> Iterator[str]:
    """Give why the forces of the best case of a fit may differ from the forces on the sample."""
    if doubt := verdict(fit):
        yield doubt
    unknown = [str(name) for name in fit["parameter"].values if not is_constrained(fit.sel(parameter=name))]
    if unknown:
        yield f"The data do not constrain {', '.join(unknown)}: the forces hold for the value in the case."


def _sentences(found: xr.Dataset) -> Iterator[str]:
    """Give the peak force at the free amplitude of the case, and the amplitudes that keep the limit."""
    amplitudes, force = found["A0"].values, found["peak_force"].values
    allowed = found["allowed"].values
    limit, share = show(found.attrs["limit"], "N", DIGITS), f"{100.0 * found.attrs['set_point']:.3g} %"
    yield _at(found, len(amplitudes) - 1, share)
    unsteady = found["unsteady"].values
    known = np.flatnonzero(np.isfinite(force) | unsteady)
    if unsteady.any():
        some = amplitudes[unsteady].tolist()
        ends = show(some[0], "m", DIGITS) if len(some) == 1 else show_range(some[0], some[-1], "m", DIGITS)
        yield f"At {share} of {len(some)} of {len(amplitudes)} free amplitudes ({ends}) {UNSTEADY}: they are not allowed."
    if not len(known):
        return
    if allowed[known].all():
        every = show_range(float(amplitudes[known[0]]), float(amplitudes[known[-1]]), "m", DIGITS)
        yield f"The peak force stays below {limit} at every free amplitude from {every}."
        return
    count = int(np.argmin(allowed[known]))  # up to these, from the smallest on, all are allowed
    if not count:
        yield (
            f"No free amplitude from {show(float(amplitudes[known[0]]), 'm', DIGITS)} keeps the peak force below {limit}: "
            "use a softer lever, or a higher set point."
        )
        return
    highest = int(known[count - 1])
    yield f"The peak force stays below {limit} up to a free amplitude of {show(float(amplitudes[highest]), 'm', DIGITS)}."
    yield _at(found, highest, share)


def _at(found: xr.Dataset, place: int, share: str) -> str:
    """Return the words for one free amplitude."""
    one = found.isel(A0=place)
    where = f"At {share} of A0 = {show(float(one['A0']), 'm', DIGITS)}"
    force, depth = float(one["peak_force"]), float(one["max_indentation"])
    if not np.isfinite(force):
        return f"{where} no steady state was found."
    if force <= 0.0:
        said = "the force stays attractive"
    else:
        deep = f" and indents {show(depth, 'm', DIGITS)}" if depth > 0.0 else ""
        said = f"the tip presses with {show(force, 'N', DIGITS)}{deep}"
    return f"{where} {said}." + (" A second state exists." if int(one["states"]) > 1 else "")
