"""A sweep whose result is a store: blocks of cases, computed by threads or a cluster, written by this process alone."""

from __future__ import annotations

import asyncio
import dataclasses
import itertools
import math
import os
import threading
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce._version import __version__
from dforce.case import Case
from dforce.core.errors import ParameterError, ResultError, shorten
from dforce.core.log import announce
from dforce.core.quantities import JUMPS as WORDS
from dforce.core.quantities import MOTION
from dforce.core.stopping import heard
from dforce.experiments.base import Progress
from dforce.maps._advice import advice_on_sweep
from dforce.maps._executors import LOST, Alone, Arrays, Cluster, Hands, Threads, results_of
from dforce.maps._kept import QUANTITIES, Kept
from dforce.maps._one_by_one import fill
from dforce.maps._pace import paced
from dforce.maps._result import SweepLayout
from dforce.maps._resume import check_same
from dforce.maps.axes import Axis
from dforce.results import store
from dforce.results.provenance import PLUGINS, of_plugins
from dforce.results.seal import identity_of, part
from dforce.results.status import Status
from dforce.results.store_plan import Blocks, Plan, Variable
from dforce.results.store_writer import Writer
from dforce.runs import watched
from dforce.validity import attributes

if TYPE_CHECKING:
    import xarray as xr

BLOCKS = 128  # into which a sweep is cut, at most: with each some 35 ms of a core and a file for each array are lost
MOST_POINTS = 65_536  # in a block: all their quantities are some 30 MB; larger sweeps have more blocks
MOST_JUMPS = 16  # of a curve that a store holds
MOST_STATES = 16  # of a curve at a set point that a store holds
NAMED = 3  # damaged parts that are named
DISTANCES = "zc"  # coordinate
LOOK = 0.2  # s between looks at the blocks
MOST_BRANCH_POINTS = 4096  # of all states of a case along a parameter that a store holds
LIMITS = {"jump": MOST_JUMPS, "crossing": MOST_STATES, "state": MOST_STATES, "point": MOST_BRANCH_POINTS}
Place = Mapping[str, slice]


@dataclasses.dataclass
class Map:
    """A sweep and its store.

    Parameters
    ----------
    asked
        The case, with its table of swept parameters.
    layout
        The layout of the points of its cases in the result.
    quantities, set_point
        The quantities to keep; see :meth:`Kept.of`.
    store
        Path or URL.

    Attributes
    ----------
    kept
        The kept quantities.
    """

    asked: Case
    layout: SweepLayout
    quantities: Iterable[str] | None
    set_point: float | str | None
    store: str | os.PathLike[str]
    kept: Kept = dataclasses.field(init=False)

    def __post_init__(self) -> None:
        self.case = self.asked.model_copy(update={"sweep": None})

    def run(self, resume: bool, workers: int | None, client: Any, progress: Progress | bool | None) -> xr.Dataset:
        """Compute the blocks that are missing or damaged, and return the store, opened."""
        if client is not None and workers is not None:
            raise ParameterError("workers sets threads of this process, but a cluster has its own; pass one of the two")
        store.check_store(self.store, resume)
        with Writer(self.store) as writer, watched(progress, self.case.title) as report_progress:
            found = resume and writer.find()
            before, case = writer.seal.quantities if found else None, self.case
            kept = self.kept = Kept.of(self.quantities, self.set_point, self.layout, before)
            if found:
                self._check(writer)
                self._mend(writer)
            else:
                writer.make(self._plan())
            hands: Hands = Threads(case, kept, workers) if client is None else Cluster(case, kept, client)
            work = _Run(self, writer, hands, paced(report_progress))
            try:
                whole = work.run()
            finally:
                hands.close()
            if whole and work.computed:
                self._finish(writer)
        if whole:
            _say(writer, work)
        return store.open_store(self.store)

    def _identity(self) -> str:
        """Return a name for this sweep: the same for another one only where all its numbers are the same."""
        axes = [(axis.path, axis.dim, axis.coordinate()[1].tolist()) for axis in self.layout.axes]
        kept = sorted(self.kept.names), self.kept.set_point
        return identity_of(
            [self.asked.to_toml(complete=True), axes, *kept, __version__, of_plugins(self.asked).get(PLUGINS, "")]
        )

    def _check(self, writer: Writer) -> None:
        """Check that a store is one of this sweep, and of this version where anything is to be computed."""
        if writer.seal.identity == self._identity():
            return
        check_same(self.asked, self.layout, store.open_store(self.store), self.kept.set_point)
        if writer.damaged or not writer.finished:
            self.check_version(writer)

    def check_version(self, writer: Writer) -> None:
        """Check that a store was begun by this version."""
        begun = writer.attributes["dforce_version"]
        if begun != __version__:
            raise ParameterError(f"this store is from dForce {begun}; continue it with that version, not {__version__}")

    def _mend(self, writer: Writer) -> None:
        """Write damaged files of the store again, except its blocks."""
        if any(key in writer.seal.files for key in writer.damaged):
            writer.repair(self._plan())
        if writer.damaged:
            writer.mark({})

    def _plan(self) -> Plan:
        """Return the plan of the store, after a look at the first case of each choice."""
        import xarray as xr

        pilots = self._pilots()
        dims, axes = self.layout.dims, {axis.name for axis in self.layout.axes}
        inner: dict[str, int] = {}
        variables: dict[str, Variable] = {}
        fixed: dict[str, Any] = {}
        for pilot in pilots:
            for dim, size in pilot.sizes.items():
                if dim not in dims:
                    inner[str(dim)] = LIMITS.get(str(dim), max(size, inner.get(str(dim), 0)))
            for name, one in pilot.variables.items():
                if set(dims) <= set(one.dims) and name not in axes:
                    variables[str(name)] = _variable(str(name), one, name in pilot.coords)
                elif name not in axes and (name not in fixed or one.size > fixed[str(name)].size):
                    fixed[str(name)] = one
        if self.layout.distances is not None and DISTANCES in fixed:  # they vary along some of the axes
            fixed[DISTANCES] = (*self.layout.distances, fixed[DISTANCES].attrs)
        for dim in LIMITS.keys() & fixed.keys():  # they count, from 1
            fixed[dim] = (dim, np.arange(1, inner[dim] + 1), fixed[dim].attrs)
        if self.kept.set_point is None and self.layout.jumps:
            inner["jump"] = MOST_JUMPS
            for name in self.layout.jumps:
                none = np.empty((0,) * (len(dims) + 1), "U1" if name == "jump_direction" else float)
                variables.setdefault(
                    name, _variable(name, xr.Variable((*dims, "jump"), none, WORDS[name].words), False)
                )
        if len({pilot.sizes.get("component") for pilot in pilots}) > 1:  # forces of another choice may remember more
            variables.pop(MOTION, None)
            fixed = {name: one for name, one in fixed.items() if "component" not in one.dims}
        coords = xr.Dataset(coords=fixed | {axis.name: axis.coordinate() for axis in self.layout.axes})
        attrs = pilots[0].attrs | {"case": self.asked.to_toml(complete=True)} | self.kept.unfinished
        return Plan(variables, coords, self.blocks(), inner, attrs, self._identity(), attrs[QUANTITIES])

    def _pilots(self) -> list[xr.Dataset]:
        """Return the first case of each choice."""
        ranges = [range(len(axis.values)) for axis in self.layout.choices]
        pilots = []
        for chosen in itertools.product(*ranges):
            place = dict.fromkeys(self.layout.dims, slice(0, 1))
            place |= {axis.dim: slice(i, i + 1) for axis, i in zip(self.layout.choices, chosen, strict=True)}
            pilots.append(results_of(self.case, self._cut(place), self.kept, Alone(threading.Event())))
        return pilots

    def _cut(self, place: Place) -> list[Axis]:
        """Return the axes of the cases of a block."""
        return [dataclasses.replace(axis, values=axis.values[place[axis.dim]]) for axis in self.layout.axes]

    def blocks(self) -> Blocks:
        """Return how the cases are cut: into few blocks, the first dimensions first; it follows from the grid alone."""
        sizes = {axis.dim: len(axis.values) for axis in self.layout.axes}
        choices = {axis.dim for axis in self.layout.choices}
        points = self.layout.points
        most = max(BLOCKS, -(-math.prod(sizes.values()) * points // MOST_POINTS))
        while True:
            left = max(1, most // math.prod(sizes[dim] for dim in choices))
            lengths = dict.fromkeys(sizes, 1)
            for dim in (dim for dim in sizes if dim not in choices):
                lengths[dim] = -(-sizes[dim] // left)
                left = max(1, left // -(-sizes[dim] // lengths[dim]))
            cases = math.prod(lengths.values())
            if cases == 1 or cases * points <= MOST_POINTS:
                return Blocks(sizes, lengths)
            most += 1 + most // 64  # the lengths are whole numbers, so that a block may be a little too large

    def _finish(self, writer: Writer) -> None:
        """Give the store the advice on all cases together."""
        data = store.open_store(self.store)
        advice = advice_on_sweep(self.layout, data if self.kept.set_point is None else None)
        writer.finish(attributes(advice), self.layout.jumps, without=(QUANTITIES,))


class _Run:
    """The work on the missing blocks; only as many are submitted as may run at once."""

    def __init__(self, of: Map, writer: Writer, hands: Hands, report_progress: Progress) -> None:
        self.map, self.writer, self.hands, self.report_progress = of, writer, hands, report_progress
        self.blocks = Blocks(of.blocks().sizes, writer.seal.block)
        self.case_points = of.layout.points
        self.done = self.computed = 0
        self.pending: dict[Future[Arrays], tuple[Place, int]] = {}

    def run(self) -> bool:
        """Compute and write; return False when stopped by Ctrl-C."""
        total = int(np.prod([*self.blocks.sizes.values()], dtype=np.int64)) * self.case_points
        todo, left = self._todo(), True
        try:
            while left or self.pending:
                room = self.hands.room()
                while left and len(self.pending) < room:
                    place = next(todo, None)
                    left = place is not None
                    if place is not None:
                        self._submit(place, 1)
                self.hands.check()
                self.report_progress(min(self.done + self.hands.points(), total - bool(self.pending)), total, "")
                for future in wait(self.pending, LOOK, FIRST_COMPLETED).done:
                    self._take(future)
            self.report_progress(total, total, "")
        except KeyboardInterrupt:
            heard()
            return False
        return True

    def _todo(self) -> Iterator[Place]:
        for place in self.blocks.places():
            if self.writer.is_done(self.blocks, place):
                self.done += self._points(place)
                continue
            if not self.computed and self.writer.finished:
                self.map.check_version(self.writer)
                self.writer.mark(self.map.kept.unfinished)
            self.computed += 1
            yield place

    def _points(self, place: Place) -> int:
        return int(np.prod([part.stop - part.start for part in place.values()])) * self.case_points

    def _submit(self, place: Place, attempt: int) -> None:
        self.pending[self.hands.submit(self.map._cut(place))] = place, attempt

    def _take(self, future: Future[Arrays]) -> None:
        """Write the block of a future; a failed block is tried again, then left out."""
        place, attempt = self.pending.pop(future)
        try:
            arrays = future.result()
        except (CancelledError, asyncio.CancelledError):  # no block's own fault: nobody is there to compute it
            raise ResultError(LOST) from None
        except Exception as error:  # of a case's own: its block is tried again, then marked  # noqa: BLE001
            self.hands.check()
            if attempt < self.hands.tries(error):
                self._submit(place, attempt + 1)
                return
            where = ", ".join(f"{dim} {part.start + 1} to {part.stop}" for dim, part in place.items())
            self.writer.note(f"no result for {where}: {shorten(f'{type(error).__name__}: {error}', 300)}")
            arrays = {}
        self.writer.put(self.blocks, place, arrays, int(Status.BROKEN))
        self.done += self._points(place)


def _say(writer: Writer, work: _Run) -> None:
    """Report the repaired parts of a store, or that there was nothing to do."""
    damaged = [part(key) for key in writer.damaged]
    if damaged:
        more = f" and {len(damaged) - NAMED} more" if len(damaged) > NAMED else ""
        announce(f"{writer.files.name} was damaged and is now repaired: {', '.join(damaged[:NAMED])}{more}")
    elif not work.computed:
        announce(f"{writer.files.name} is complete and undamaged; nothing was computed")


def _variable(name: str, one: xr.Variable, is_coordinate: bool) -> Variable:
    """Return how a store holds a variable of a result."""
    kind = str if one.dtype.kind in "OUT" else one.dtype
    empty = fill(name, one.dtype)
    return Variable(
        tuple(map(str, one.dims)), kind, int(empty) if name == "status" else empty, one.attrs, is_coordinate
    )
