"""A sweep whose result is a store: blocks of cases, computed by threads or a cluster, written by this process alone."""

from __future__ import annotations

import asyncio
import dataclasses
import itertools
import os
import threading
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.case import Case
from dforce.core.errors import ParameterError, ResultError, shorten
from dforce.core.quantities import JUMPS as WORDS
from dforce.core.quantities import MOTION
from dforce.experiments import Approach
from dforce.experiments.base import Progress
from dforce.maps._advice import advice_on_sweep
from dforce.maps._executors import LOST, Alone, Arrays, Cluster, Hands, Kept, Threads
from dforce.maps._pace import paced
from dforce.maps._result import JUMPS, QUANTITIES, Layout, unfinished
from dforce.maps._resume import ALL, check_same, quantities_of
from dforce.maps.axes import Axis
from dforce.results import store
from dforce.results.status import Status
from dforce.runs import watched
from dforce.validity import attributes

if TYPE_CHECKING:
    import xarray as xr

SECONDS = 4.0  # of work in a block: little is lost with one, and what goes with each costs nothing beside it
MOST_POINTS = 65_536  # in a block: all their quantities are some 30 MB
PILOT = 8  # cases that say how long one takes
MOST_JUMPS = 16  # of a curve that a store holds
MOST_STATES = 16  # of a curve at a set point that a store holds
LOOK = 0.2  # s between looks at the blocks
LIMITS = {"jump": MOST_JUMPS, "crossing": MOST_STATES}
Place = Mapping[str, slice]


class Map:
    """A sweep and its store.

    Parameters
    ----------
    asked
        The case, with the table that it was asked by.
    layout
        How the points of its cases lie in the result.
    names
        Quantities to keep; None: all.
    set_point
        Keep the states there only; None: whole curves.
    store
        Path or URL.
    """

    def __init__(
        self, asked: Case, layout: Layout, names: list[str] | None, set_point: float | None, store: str | os.PathLike[str]
    ) -> None:  # fmt: skip
        self.asked, self.layout, self.names, self.set_point, self.store = asked, layout, names, set_point, store
        self.case = asked.model_copy(update={"sweep": None})

    def run(self, resume: bool, workers: int | None, client: Any, progress: Progress | bool | None) -> xr.Dataset:
        """Compute the blocks that are missing, and return the store, opened."""
        if client is not None and workers is not None:
            raise ParameterError("workers are threads of this process, and a cluster has its own; give one of the two")
        store.check_store(self.store, resume)
        with store.Writer(self.store) as writer, watched(progress, self.case.title) as tell:
            earlier = store.open_store(self.store) if resume and writer.is_made() else None
            if earlier is not None:
                self._check(earlier)
            names = quantities_of(self.names, earlier)
            kept = Kept(names, None if names == ALL else names, self.set_point)
            if earlier is None:
                self._make(writer, kept)
            hands: Hands = Threads(self.case, kept, workers) if client is None else Cluster(self.case, kept, client)
            try:
                whole = _Run(self, writer, hands, paced(tell)).run()
            finally:
                hands.close()
            if whole:
                self._finish(writer)
        return store.open_store(self.store)

    def _check(self, earlier: xr.Dataset) -> None:
        """Check that a store is an unfinished one of this sweep."""
        from dforce._version import __version__

        check_same(self.asked, self.layout, earlier, self.set_point)
        if earlier.attrs["dforce_version"] != __version__:
            raise ParameterError(
                f"this store was begun by dForce {earlier.attrs['dforce_version']}, so {__version__} does not go on with it"
            )

    def _make(self, writer: store.Writer, kept: Kept) -> None:
        """Make the store after a look at some cases, which say what there is to hold and how long a case takes."""
        import xarray as xr

        pilots, seconds = self._pilots(kept)
        dims, axes = self.layout.dims, {axis.name for axis in self.layout.axes}
        inner: dict[str, int] = {}
        variables: dict[str, store.Variable] = {}
        fixed: dict[str, Any] = {}
        for pilot in pilots:
            for dim, size in pilot.sizes.items():
                if dim not in dims:
                    inner[str(dim)] = LIMITS.get(str(dim), max(size, inner.get(str(dim), 0)))
            for name, one in pilot.variables.items():
                if set(one.dims) & set(dims) and name not in axes:
                    variables[str(name)] = _variable(one, name in pilot.coords)
                elif name not in axes and (name not in fixed or one.size > fixed[str(name)].size):
                    fixed[str(name)] = one
        if self.set_point is None and isinstance(self.case.experiment, Approach):
            inner["jump"] = MOST_JUMPS
            for name in JUMPS:
                variables.setdefault(name, _jump_variable(name, dims))
        if len({pilot.sizes.get("component") for pilot in pilots}) > 1:  # forces of another choice may remember more
            variables.pop(MOTION, None)
            fixed = {name: one for name, one in fixed.items() if "component" not in one.dims}
        coords = xr.Dataset(coords=fixed | {axis.name: axis.coordinate() for axis in self.layout.axes})
        attrs = pilots[0].attrs | {"case": self.asked.to_toml(complete=True)} | unfinished(kept.names)
        writer.make(variables, coords, self._blocks(seconds), inner, attrs)

    def _pilots(self, kept: Kept) -> tuple[list[xr.Dataset], float]:
        """Return the first cases of each choice, and how long (s) a case takes."""
        found: list[xr.Dataset] = []
        seconds = 0.0
        for chosen in itertools.product(*(range(len(axis.values)) for axis in self.layout.choices)):
            place = {axis.dim: slice(i, i + 1) for axis, i in zip(self.layout.choices, chosen, strict=True)}
            if not found:  # compiles what is not compiled yet
                kept.result(self.case, self._cut(self._first(place, 1)), Alone(threading.Event()))
            axes = self._cut(self._first(place, 1 if found else PILOT))
            start = time.monotonic()
            found.append(kept.result(self.case, axes, Alone(threading.Event())))
            seconds = max(seconds, (time.monotonic() - start) / found[-1]["status"].isel(self._inner(found[-1])).size)
        return found, seconds

    def _inner(self, data: xr.Dataset) -> dict[str, int]:
        return {str(dim): 0 for dim in data["status"].dims if dim not in self.layout.dims}

    def _first(self, place: Place, cases: int) -> Place:
        """Return the place of the first cases, along the last dimension that is no choice."""
        lengths = dict.fromkeys(self.layout.dims, 1)
        numbers = [dim for dim in self.layout.dims if dim not in place]
        if numbers:
            lengths[numbers[-1]] = cases
        return {dim: slice(0, length) for dim, length in lengths.items()} | dict(place)

    def _cut(self, place: Place) -> list[Axis]:
        """Return the axes of the cases of a block."""
        return [dataclasses.replace(axis, values=axis.values[place[axis.dim]]) for axis in self.layout.axes]

    def _blocks(self, seconds: float) -> store.Blocks:
        """Return how the cases are cut into blocks of some seconds, when one takes so long."""
        cases = max(1, min(int(SECONDS / seconds), MOST_POINTS // len(self.layout.visits)))
        sizes = {dim: len(axis.values) for axis in self.layout.axes for dim in (axis.dim,)}
        choices = {axis.dim for axis in self.layout.choices}
        lengths = {}
        for dim in reversed(sizes):
            lengths[dim] = 1 if dim in choices else min(sizes[dim], cases)
            cases = max(1, cases // lengths[dim]) if lengths[dim] == sizes[dim] or dim in choices else 1
        return store.Blocks(sizes, {dim: lengths[dim] for dim in sizes})

    def _finish(self, writer: store.Writer) -> None:
        """Give the store what is said about all cases together."""
        data = store.open_store(self.store)
        advice = advice_on_sweep(self.asked, self.layout.axes, data) if self.set_point is None else []
        writer.finish(attributes(advice), JUMPS, without=(QUANTITIES,))


class _Run:
    """The work on the blocks that are missing; never more of them are known than are under way."""

    def __init__(self, of: Map, writer: store.Writer, hands: Hands, tell: Progress) -> None:
        self.map, self.writer, self.hands, self.tell = of, writer, hands, tell
        self.blocks = writer.blocks(of.layout.dims)
        self.case_points = len(of.layout.visits)
        self.done = 0
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
                self.tell(min(self.done + self.hands.points(), total - bool(self.pending)), total, "")
                for future in wait(self.pending, LOOK, FIRST_COMPLETED).done:
                    self._take(future)
            self.tell(total, total, "")
        except KeyboardInterrupt:
            return False
        return True

    def _todo(self) -> Iterator[Place]:
        for place in self.blocks.places():
            if self.writer.is_done(place, Status.NOT_COMPUTED):
                self.done += self._points(place)
            else:
                yield place

    def _points(self, place: Place) -> int:
        return int(np.prod([part.stop - part.start for part in place.values()])) * self.case_points

    def _submit(self, place: Place, attempt: int) -> None:
        self.pending[self.hands.submit(self.map._cut(place))] = place, attempt

    def _take(self, future: Future[Arrays]) -> None:
        """Write the block that a future holds; one that failed is tried again, then left out."""
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
        self.writer.put(place, arrays, int(Status.BROKEN))
        self.done += self._points(place)


def _variable(one: xr.Variable, is_coordinate: bool) -> store.Variable:
    """Return how a store holds a variable of a result."""
    if one.dtype.kind in "OUT":
        return store.Variable(tuple(map(str, one.dims)), str, "", one.attrs, is_coordinate)
    fill: Any = np.nan if one.dtype.kind == "f" else False if one.dtype.kind == "b" else int(Status.NOT_COMPUTED)
    return store.Variable(tuple(map(str, one.dims)), one.dtype, fill, one.attrs, is_coordinate)


def _jump_variable(name: str, dims: tuple[str, ...]) -> store.Variable:
    """Return how a store holds what is noted of jumps."""
    row = WORDS[name]
    words = {"units": row.unit, "long_name": row.label, "symbol": row.symbol, "description": row.doc}
    is_text = name == "jump_direction"
    attrs = {key: word for key, word in words.items() if word}
    return store.Variable((*dims, "jump"), str if is_text else np.float64, "" if is_text else np.nan, attrs)
