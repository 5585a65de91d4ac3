"""Runs a sweep: blocks of cases over threads, progress, Ctrl-C, and the Dataset."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from dforce.case import Case
from dforce.core.errors import ParameterError, checked
from dforce.core.log import announce
from dforce.core.parallel import Crew
from dforce.experiments.base import Progress
from dforce.maps._advice import advice_on_sweep
from dforce.maps._kept import QUANTITIES, Kept
from dforce.maps._one_by_one import cases_of
from dforce.maps._pace import paced
from dforce.maps._result import SweepLayout
from dforce.maps._resume import check_same
from dforce.maps.axes import MOST_POINTS, axes_of, count
from dforce.runs import watched
from dforce.validity import attributes

if TYPE_CHECKING:
    import xarray as xr


@checked
def sweep(
    case: Case,
    over: Mapping[str, Any] | None = None,
    workers: int | None = None,
    progress: Progress | bool | None = None,
    quantities: Iterable[str] | None = None,
    resume: xr.Dataset | bool | None = None,
    rows: Mapping[str, Any] | None = None,
    at_set_point: float | str | None = None,
    store: str | os.PathLike[str] | None = None,
    client: Any = None,
    along: str | None = None,
) -> xr.Dataset:
    """Return the result of a case's experiment for many values of its parameters, many cases at once.

    The solver is the same as for a single approach or dwell, but solves blocks of many cases. Cases whose
    forces have no memory and no branches are integrated side by side in vector lanes. Other experiments are done case by case.
    Threads share the work.

    Parameters
    ----------
    case
        The case, with any experiment. A dwell and a thermal spectrum keep their numbers, not their records.
    over
        Values by path, such as ``{"sample.youngs_modulus": ["1 GPa", "2 GPa"], "drive.A0": np.linspace(5e-9, 20e-9, 31)}``:
        SI numbers or texts with units, or a range ``{"start": "0.1 GPa", "stop": "10 GPa", "points": 64, "spacing": "log"}``;
        all combinations are computed. Any parameter of the case is possible, and ``experiment.zc`` if it is one distance.
        Another number of the instrument, the sample or the forces costs hardly any time. Another value of any other parameter
        (a choice, a setting of the solver) builds the case again. Default, without `rows`: the table ``[sweep]`` of the case.
    workers
        Number of threads; default: one for each core.
    progress
        True for a bar, or a function called as ``progress(points done, points in all, note)``; Ctrl-C and SIGTERM keep the
        finished points.
    quantities
        Names of the quantities to keep; default: all, or the quantities of `resume`. Jumps are always kept.
    resume
        An interrupted result of the same case over the same values, to continue: complete cases are kept, the others are
        computed. A complete result is returned. With a store, True continues its blocks: each block is compared with its
        checksums, and a damaged block is computed again.
    rows
        Instead of `over`, single cases: columns of plain numbers by path, of equal length; the same as `over` with
        ``along="cases"``.
    at_set_point
        A share :math:`A / A_0`: the result contains only the states of each curve at this set point, see
        :func:`dforce.at_set_point`. The `status` of a case is the largest status among its points.
    store
        A folder ``"map.zarr"``, or a URL of fsspec, for any number of points. The result is not kept in memory, but written in
        blocks of cases, each whole or not at all.
    client
        A client of a Dask cluster (:class:`distributed.Client`), or the address of its scheduler, ``"tcp://..."``. The workers
        compute the blocks of a store; only this process writes them.
    along
        Combination of the values of `over`. ``"combinations"`` (default): all combinations, with a dimension for each path.
        ``"cases"``: lists of plain numbers with equal length; each position is a case along the dimension `case`.

    Returns
    -------
    xarray.Dataset
        First the dimensions of the sweep, in your order and named by the last word of each path (the whole path if ambiguous),
        or `case` for single cases. Then the dimensions of the experiment, such as `zc` and `direction`. Distances as shares of
        A0 lie along `zc_ratio` if A0 varies, with the coordinate `zc` of each case. Each point has a status; branches have the
        largest status of each case. Jumps of curves lie along `jump`, states of basins along `state`, points of branches along
        `point`; cases with fewer are filled up (NaN, 0, False or empty text). With a store, the numbers are read on use.

    Raises
    ------
    ParameterError
        For an unknown path, a value that is not allowed, a case without an experiment or with thermal noise, too many points in
        memory, or a `resume` of another sweep.
    CaseError
        When the file with the rows cannot be read.
    ResultError
        When a store cannot be written, exists already, or is open in another run, and when the cluster is lost; finished blocks
        are kept.
    """
    if case.experiment is None:
        raise ParameterError('a sweep repeats an experiment; give the case one, such as kind = "approach"')
    if case.solver.integrator == "langevin":
        raise ParameterError("a sweep repeats steady motion; df.noisy_motion runs many seeds under thermal noise")
    asked, axes = axes_of(case, over, rows, along)
    case = asked.model_copy(update={"sweep": None})  # each case is built without it
    layout = SweepLayout(case, axes)
    if store is not None:
        from dforce.maps._map import Map

        return Map(asked, layout, quantities, at_set_point, store).run(bool(resume), workers, client, progress)
    if client is not None:
        raise ParameterError("a cluster computes the blocks of a store; also pass store")
    if isinstance(resume, bool):
        raise ParameterError("resume=True continues a store; also pass store, or pass the result as resume")
    points = count(axes) * layout.points
    if points > MOST_POINTS:
        raise ParameterError(
            f"the sweep has {count(axes)} cases of {layout.points} points; at most {MOST_POINTS} are allowed in memory, "
            "more in a store"
        )
    if resume is not None and at_set_point is not None:
        raise ParameterError("states at a set point cannot be continued in memory; write them to a store")
    if resume is not None:
        check_same(asked, layout, resume)
        if not resume.attrs.get("interrupted"):
            announce("this sweep is complete; nothing was computed")
            return resume
    kept = Kept.of(quantities, at_set_point, layout, None if resume is None else resume.attrs[QUANTITIES])
    layout.check_corners()
    cases = cases_of(layout)
    with watched(progress, case.title) as report_progress:
        crew = Crew(points, paced(report_progress), workers)
        crew.add(0 if resume is None else cases.take(resume))
        done = cases.compute(crew, kept.computed)
    data = cases.result(asked)
    data = data.assign_attrs(attributes(advice_on_sweep(layout, data)))
    data = data if done else data.assign_attrs(kept.unfinished)
    return kept.take(data) if crew.done else data
