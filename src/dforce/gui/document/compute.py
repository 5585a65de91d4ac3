"""Computing off the event loop: the newest request wins, and runs with progress, Stop and a queue."""

from __future__ import annotations

import asyncio
import collections
import contextlib
import os
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, TypeVar

import dforce as df
from dforce.core.log import listening, watching
from dforce.core.progress import duration

if TYPE_CHECKING:
    import xarray as xr

    from dforce.gui.document.document import Document

T = TypeVar("T")
R = TypeVar("R")
Key = tuple[str, str]  # of a curve, by :func:`key_of`

PATIENCE = 1.0  # s of computing that a curve may take to follow the input; longer ones are for Run
LATEST = 5.0  # s that it may take on a machine that computes for others, too
STOPPED_WITHIN = 0.6  # s; work that does not stop by then counts as stopped, and ends by itself

LULL = 0.15  # s without a live curve of any page, after which there is time for the states behind them
GIVING_WAY = 0.02  # s between two checks for a live curve

TURN = 1.0  # s that a run computes while others wait
MOST_RECENT = 10_000_000  # bytes of curves, and of states behind them: some 50 cases of a class
MOST_RUNS = 64  # begun at a time; later ones wait until one has ended

# compiled solvers release Python's lock, so that threads use the cores
LIVE = ThreadPoolExecutor(max(2, os.cpu_count() or 2), thread_name_prefix="live")
BEHIND = ThreadPoolExecutor(1, thread_name_prefix="behind")  # for the states behind the curves, of one page at a time
DRAFTS = ThreadPoolExecutor(1, thread_name_prefix="draft")  # a typed law does not wait for a curve that compiles
RUNS = ThreadPoolExecutor(MOST_RUNS, thread_name_prefix="run")


class ComputeQueue:
    """Lets a few runs compute at a time; waiting runs come in the order in which they began to wait."""

    def __init__(self, at_once: int) -> None:
        self._free = at_once
        self._waiting: collections.deque[threading.Event] = collections.deque()
        self._lock = threading.Lock()

    def take(self) -> None:
        """Wait for a turn."""
        with self._lock:
            if self._free:
                self._free -= 1
                return
            mine = threading.Event()
            self._waiting.append(mine)
        mine.wait()

    def give(self) -> None:
        """End a turn: the run that has waited longest has the next."""
        with self._lock:
            if self._waiting:
                self._waiting.popleft().set()
            else:
                self._free += 1

    def pass_on(self) -> None:
        """Let waiting runs have a turn first."""
        if self._waiting:
            self.give()
            self.take()


TURNS = ComputeQueue(max(1, (os.cpu_count() or 2) - 1))


class Latest(Generic[T]):
    """Does the newest of the things asked for, one at a time; overtaken things are never begun."""

    def __init__(self, work: Callable[[T], Awaitable[None]]) -> None:
        self.work = work
        self.wanted: T | None = None
        self.task: asyncio.Task[None] | None = None
        self.ended = False

    def ask(self, thing: T) -> None:
        """Ask for a thing; it is begun when the current work is done."""
        if self.ended:
            return
        self.wanted = thing
        if not self.busy:
            self.task = asyncio.get_running_loop().create_task(self._serve())

    @property
    def overtaken(self) -> bool:
        """Whether something newer waits."""
        return self.wanted is not None

    @property
    def busy(self) -> bool:
        """Whether anything runs or waits."""
        return self.task is not None and not self.task.done()

    async def rest(self, seconds: float) -> None:
        """Wait until nothing runs, so long at most."""
        if self.task is not None and not self.task.done() and seconds > 0.0:
            await asyncio.wait({self.task}, timeout=seconds)

    def end(self) -> None:
        """Do nothing more: the page that it is done for is gone."""
        self.wanted, self.ended = None, True
        if self.task is not None:
            self.task.cancel()

    async def _serve(self) -> None:
        while self.wanted is not None:
            thing, self.wanted = self.wanted, None
            await self.work(thing)


async def in_thread(pool: ThreadPoolExecutor, work: Callable[[], R]) -> R:
    """Do blocking work in a thread."""
    return await asyncio.get_running_loop().run_in_executor(pool, work)


class RecentCurves:
    """The last curves, or states behind them, that pages computed, for pages that ask for the same: in a class many do.

    Parameters
    ----------
    most_bytes
        Of all curves; the least recently used go first.
    """

    def __init__(self, most_bytes: int) -> None:
        self.most_bytes = most_bytes
        self._curves: collections.OrderedDict[Key, xr.Dataset] = collections.OrderedDict()
        self._bytes: dict[Key, int] = {}
        self._lock = threading.Lock()

    def take(self, key: Key) -> xr.Dataset | None:
        """Return the curve of a case, as its own Dataset; None where it is not known."""
        with self._lock:
            curve = self._curves.get(key)
            if curve is None:
                return None
            self._curves.move_to_end(key)
        return curve.copy(deep=False)

    def keep(self, key: Key, curve: xr.Dataset) -> None:
        """Keep the curve of a case."""
        with self._lock:
            self._curves[key], self._bytes[key] = curve, curve.nbytes
            while len(self._curves) > 1 and sum(self._bytes.values()) > self.most_bytes:
                del self._bytes[self._curves.popitem(last=False)[0]]

    def clear(self) -> None:
        """Forget all of them."""
        self._curves.clear()
        self._bytes.clear()


def key_of(case: df.Case) -> Key:
    """Return all that a curve depends on: the text of its case, and the numbers, some of which a file of levers may hold."""
    return case.to_toml(), repr(case.problem)


RECENT = RecentCurves(MOST_RECENT)


class Overtaken(Exception):  # no error: something newer is computed
    """A newer request gives up the current computation, with all its results."""


class LiveCurves:
    """The live curves of all pages that are computed: the states behind curves give way to them."""

    def __init__(self) -> None:
        self._threads: set[int] = set()
        self._ended = -LULL

    @contextlib.contextmanager
    def one_more(self) -> Iterator[None]:
        """Count the thread among those with a live curve."""
        self._threads.add(threading.get_ident())
        try:
            yield
        finally:
            self._ended = time.monotonic()
            self._threads.discard(threading.get_ident())

    def rest(self, seconds: float) -> bool:
        """Return whether none has been computed for so long."""
        return not self._threads and time.monotonic() - self._ended >= seconds

    def give_way(self, overtaken: Callable[[], bool]) -> None:
        """Wait, in a thread, for a lull.

        Raises
        ------
        Overtaken
            When something newer is asked for.
        """
        while not (is_overtaken := overtaken()) and not self.rest(LULL):
            time.sleep(GIVING_WAY)
        if is_overtaken:
            raise Overtaken


LIVE_CURVES = LiveCurves()


@dataclass(frozen=True)
class Live:
    """A live curve: the result, whether it was given up because it takes too long, and whether code was compiled for it."""

    result: xr.Dataset | None
    gave_up: bool = False
    compiled: bool = False


def live_curve(
    case: df.Case,
    overtaken: Callable[[], bool],
    say: Callable[[str], None],
    patience: float = PATIENCE,
    latest: float = LATEST,
) -> Live:
    """Return the result of a case's experiment if it is quick.

    Parameters
    ----------
    case
        The case to compute.
    overtaken
        Returns whether newer work waits, so that this may be given up.
    say
        Called, in this thread, with messages of dForce, such as on compiling; the time for that is not counted.
    patience, latest
        It is given up after computing for so long, or after waiting for so long (s).
    """
    began: tuple[float, float] | None = None

    def report_progress(done: int, total: int, note: str) -> None:
        nonlocal began
        now = time.thread_time() - heard.seconds, time.monotonic() - heard.seconds
        began = now if began is None else began
        computed, waited = now[0] - began[0], now[1] - began[1]
        if done < total and (computed > patience or waited > latest or (waited > 0.2 and overtaken())):
            raise KeyboardInterrupt

    with LIVE_CURVES.one_more(), listening(say) as heard, watching(heard.watch):
        result = df.run(case, progress=report_progress)
    return Live(result, bool(result.attrs.get("interrupted")), heard.seconds > 0.0)


@dataclass
class Job:
    """A current run, for threads and views."""

    case: df.Case
    seconds: float = float("inf")  # allowed
    document: Document | None = None  # that the case is of
    state: str = "queued"  # queued | running | done | stopped | failed
    done: int = 0
    total: int = 0
    note: str = ""
    error: str = ""
    result: xr.Dataset | None = None
    began: float = field(default_factory=time.monotonic)
    stopping: threading.Event = field(default_factory=threading.Event)
    turn: float = 0.0  # when its turn began

    @property
    def busy(self) -> bool:
        """Whether it waits or runs."""
        return self.state in ("queued", "running")

    @property
    def share(self) -> float:
        """Share that is done, 0 to 1."""
        return self.done / self.total if self.total else 0.0

    def time_left(self) -> float | None:
        """Return the seconds that are left, by the pace so far; None before the first point."""
        if not 0 < self.done < self.total:
            return None
        return (time.monotonic() - self.began) * (self.total - self.done) / self.done

    def is_of(self, document: Document) -> bool:
        """Return whether it runs the case of a document."""
        return self.document is not None and self.document.same_case(document)

    def words(self) -> str:
        """Return the progress in words."""
        if self.state == "queued":
            return "waiting"
        if self.state == "failed":
            return self.error
        if self.state == "stopped" and self.error:
            return self.error
        if self.state == "stopped":
            return f"stopped at {self.done} of {self.total}" if self.total else "stopped"
        if self.state == "done":
            return self.error
        left = self.time_left()
        count = f"{self.done} of {self.total}" if self.total else self.note
        return f"{count}, {duration(left)} left" if left is not None else count

    def work(self) -> None:
        """Run the case in turns with others; blocking, in a thread."""
        TURNS.take()
        try:
            self._work()
        finally:
            TURNS.give()

    def _work(self) -> None:
        if self.stopping.is_set():
            self.state = "stopped"
            return
        self.state, self.began = "running", time.monotonic()
        self.turn = self.began
        try:
            with listening(self._hear) as heard, watching(heard.watch):
                result = self.compute()
        except KeyboardInterrupt:  # stopped before there was anything to keep; it must not end the window
            self.state = "stopped"
            return
        except df.DForceError as error:
            self.error, self.state = str(error), "failed"
            return
        except Exception as error:  # a defect of dForce must not leave the window waiting  # noqa: BLE001
            self.error, self.state = (
                f"an error inside dForce, please report it: {type(error).__name__}: {error}",
                "failed",
            )
            return
        self.result = result
        self.state = "stopped" if result.attrs.get("interrupted") else "done"

    def compute(self) -> xr.Dataset:
        """Return the result of the case; after a stop its finished part."""
        return df.run(self.case, progress=self._watch)

    def _hear(self, text: str) -> None:
        self.note = text

    def _watch(self, done: int, total: int, note: str) -> None:
        if done == 0:  # a first compilation is over, and is no part of the pace
            self.began = time.monotonic()
        self.done, self.total, self.note = done, total, note
        if time.monotonic() - self.turn > TURN and not self.stopping.is_set():
            paused = time.monotonic()
            TURNS.pass_on()
            self.turn = time.monotonic()
            self.began += self.turn - paused  # the time of other runs does not count
        if done < total and (self.stopping.is_set() or time.monotonic() - self.began > self.seconds):
            raise KeyboardInterrupt

    async def go(self, look: Callable[[], None], every: float = 0.1) -> None:
        """Do the run in the queue's turn; `look` is called now and then, and at the end.

        Work that does not stop in time, such as a compilation, counts as stopped, and still gives its result when it ends.
        """
        future = asyncio.ensure_future(in_thread(RUNS, self.work))
        since: float | None = None
        while not future.done():
            await asyncio.wait({future}, timeout=every)
            if self.stopping.is_set() and not future.done():
                since = since or time.monotonic()
                if time.monotonic() - since > STOPPED_WITHIN:
                    self.state = "stopped"
            look()
        look()
