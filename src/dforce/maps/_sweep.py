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
from dforce.maps._cases import cases_of
from dforce.maps._pace import paced
from dforce.maps._result import QUANTITIES, unfinished
from dforce.maps._resume import ALL, check_same, quantities_of
from dforce.maps._states import NEEDED, check_set_point, states_of
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

    A single run is a block of one case, and a sweep solves blocks of many by the same solver: cases whose forces have no
    memory and no branches march side by side in vector lanes. Threads share the blocks.

    Parameters
    ----------
    case
        The case; its experiment is an approach or a dwell. Of a dwell only the scalars are kept.
    over
        Values by path, such as ``{"sample.youngs_modulus": ["1 GPa", "2 GPa"], "drive.A0": np.linspace(5e-9, 20e-9, 31)}``:
        SI numbers or texts with units, or a range ``{"start": "0.1 GPa", "stop": "10 GPa", "points": 64, "spacing": "log"}``;
        all combinations are computed. Any parameter of the case may be named, and ``experiment.zc`` of a dwell. Numbers of
        the instrument, the sample and the forces cost next to nothing a case; every value of any other parameter (a
        choice, a solver's setting) builds the case anew. Left out, with `rows`: what the case says under ``[sweep]``.
    workers
        Threads; left out: one for each core.
    progress
        True for a bar, or a function called as ``progress(points done, points in all, note)``; Ctrl-C and SIGTERM
        keep what is done.
    quantities
        Names of the quantities to keep; left out: all, or those of `resume`. Jumps are kept in any case.
    resume
        An interrupted result of the same case over the same values, to be continued: cases with all their points are
        kept as they are, the others are computed; a complete one is returned. With a store, True to go on with its
        blocks: each is compared with its checksums, and a damaged one is computed again.
    rows
        Instead of `over`, cases one by one: columns of plain numbers by path, all of the same length; the same as `over` with
        ``along="cases"``.
    at_set_point
        A share :math:`A / A_0`: only the states of each curve there are returned, see :func:`dforce.at_set_point`. The
        `status` of a case is the largest number among those of its points.
    store
        Where the result is written in blocks of cases, each whole or not at all, instead of being kept in memory: a folder
        ``"map.zarr"``, or a URL that fsspec knows. There may be any number of points.
    client
        A client of a Dask cluster (:class:`distributed.Client`), or the address of its scheduler, ``"tcp://..."``, whose
        workers compute the blocks of a store. This process alone writes them.
    along
        How the values of `over` go together: ``"combinations"`` (left out): all of them, a dimension for each path;
        ``"cases"``: the lists are equally long and hold plain numbers, each place in them is a case, and there is one
        dimension, `case`.

    Returns
    -------
    xarray.Dataset
        The dimensions of the sweep first, in the order given and named by the last word of each path (the whole path where
        that is ambiguous), or `case` of cases one by one, then `zc` and `direction` of an approach. Distances that are shares
        of A0 lie along `zc_ratio` where A0 varies, with the coordinate `zc` of each case. A status for each point. The jumps
        of the curves lie along `jump`, filled up with NaN (and empty directions) where a curve has fewer than others. With a
        store, that is opened: its numbers are read when they are asked for.

    Raises
    ------
    ParameterError
        For a path that the case does not have, a value that is not allowed, a case without such an experiment, or a
        `resume` that belongs to another sweep.
    CaseError
        When the file of a case's rows cannot be read.
    ResultError
        When a store cannot be written, is there already, or is open in another run, and when the cluster is lost; the blocks
        that are done stay there.
    """
    if case.experiment is None:
        raise ParameterError('a sweep repeats an experiment; give the case one, such as kind = "approach"')
    if case.solver.integrator == "langevin":
        raise ParameterError("a sweep repeats steady motion; df.noisy_motion runs many seeds under thermal noise")
    names = None if quantities is None else list(quantities)
    set_point = check_set_point(case, at_set_point, names)
    asked, axes = axes_of(case, over, rows, along)
    case = asked.model_copy(update={"sweep": None})  # each case is built without it
    cases = cases_of(case, axes)
    layout = cases.layout
    if store is not None:
        from dforce.maps._map import Map

        return Map(asked, layout, names, set_point, store).run(bool(resume), workers, client, progress)
    if client is not None:
        raise ParameterError("a cluster computes the blocks of a store; give the store as well")
    if isinstance(resume, bool):
        raise ParameterError(
            "resume=True goes on with a store, and none is given; give the store, or the result as resume"
        )
    points = count(axes) * layout.points
    if points > MOST_POINTS:
        raise ParameterError(
            f"the sweep has {count(axes)} cases of {layout.points} points; at most {MOST_POINTS} are allowed in memory, "
            "more in a store"
        )
    if resume is not None and set_point is not None:
        raise ParameterError("states at a set point alone cannot be continued; write them to a store, which can")
    if resume is not None:
        check_same(asked, layout, resume)
        if not resume.attrs.get("interrupted"):
            announce("this sweep is complete; nothing was computed")
            return resume
    kept = quantities_of(names, None if resume is None else frozenset(resume.attrs[QUANTITIES].split()), layout)
    with watched(progress, case.title) as tell:
        crew = Crew(points, paced(tell), workers)
        crew.add(0 if resume is None else cases.take(resume))
        done = cases.compute(crew, kept if set_point is None else kept | NEEDED)
    data = cases.result(asked)
    data = data.assign_attrs(attributes(advice_on_sweep(asked, axes, data)))
    data = data if done else data.assign_attrs(unfinished(kept))
    if set_point is None or crew.done == 0:
        return data
    return states_of(data, layout, set_point, None if kept == ALL else kept)
