"""Who computes the blocks of a map: threads of this process, or the workers of a Dask cluster."""

from __future__ import annotations

import functools
import importlib.metadata
import logging
import tempfile
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dforce.case import Case
from dforce.core.errors import ParameterError, ResultError
from dforce.core.files import beside
from dforce.core.parallel import Crew, Stopped, cores, uncounted
from dforce.core.stopping import watching
from dforce.forces import read_plugin
from dforce.maps._kept import Kept
from dforce.maps._one_by_one import cases_of
from dforce.maps._result import SweepLayout
from dforce.maps.axes import Axis

LOST = "the cluster is lost; finished blocks are kept, and another cluster can continue"
TRIES = 2  # of a block
TRIES_OF_DEAD = 8  # after Dask reports that four workers died with it: they may have been killed for another reason
LOGS = ("distributed", "distributed.client")  # where Dask reports a lost connection
AHEAD = 2  # blocks for each thread of a cluster, so that none waits for the next one
Arrays = dict[str, tuple[tuple[str, ...], Any]]  # dimensions and values by name


class Alone(Crew):
    """Does the jobs of one block in the thread that calls it, until `stop` is set."""

    def __init__(self, stop: threading.Event) -> None:
        super().__init__(0, uncounted, 1)
        self._stop = stop

    def check_cancelled(self) -> None:
        """Raise :class:`Stopped` once the work is to stop."""
        if self._stop.is_set():
            raise Stopped

    def run(self, jobs: Iterable[Callable[[], None]], note: str = "") -> bool:
        """Do all jobs; return False when stopped."""
        with watching(self.check_cancelled):
            for job in jobs:
                if not self._stop.is_set():
                    job()
        return not self._stop.is_set()


def results_of(case: Case, axes: list[Axis], kept: Kept, crew: Crew) -> Any:
    """Return the kept results of the cases of a block, as a Dataset.

    Raises
    ------
    Stopped
        When the work was stopped before its end.
    """
    cases = cases_of(SweepLayout(case, axes))
    if not cases.compute(crew, kept.computed):
        raise Stopped
    return kept.take(cases.result(case))


def arrays_of(case: Case, axes: list[Axis], kept: Kept, crew: Crew) -> Arrays:
    """Return the arrays of :func:`results_of` that differ from case to case."""
    data = results_of(case, axes, kept, crew)
    dims, known = {axis.dim for axis in axes}, {axis.name for axis in axes}
    return {
        str(name): (tuple(map(str, one.dims)), one.values)
        for name, one in data.variables.items()
        if name not in known and dims & set(one.dims)
    }


class Hands(ABC):
    """Who computes blocks."""

    @abstractmethod
    def room(self) -> int:
        """Return the largest number of running blocks."""

    @abstractmethod
    def submit(self, axes: list[Axis]) -> Future[Arrays]:
        """Begin to compute the cases of a block."""

    @abstractmethod
    def close(self) -> None:
        """Stop running blocks."""

    def points(self) -> int:
        """Return the number of finished points in running blocks, as far as it is known."""
        return 0

    def tries(self, error: BaseException) -> int:
        """Return how often a block is tried before it is left out, when it ends with an error."""
        return TRIES

    def check(self) -> None:  # noqa: B027 threads go on for ever
        """Raise :class:`ResultError` when nothing can be computed any more."""


class Threads(Hands):
    """Threads of this process."""

    def __init__(self, case: Case, kept: Kept, workers: int | None) -> None:
        self.case, self.kept, self.workers = case, kept, workers or cores()
        self._pool, self._stop = ThreadPoolExecutor(self.workers), threading.Event()
        self._crews: dict[Future[Arrays], Alone] = {}

    def room(self) -> int:
        """Return the largest number of running blocks."""
        return self.workers + 1

    def submit(self, axes: list[Axis]) -> Future[Arrays]:
        """Begin to compute the cases of a block."""
        crew = Alone(self._stop)
        future = self._pool.submit(arrays_of, self.case, axes, self.kept, crew)
        self._crews[future] = crew
        future.add_done_callback(self._crews.pop)
        return future

    def points(self) -> int:
        """Return the number of finished points in running blocks."""
        return sum(crew.done for crew in list(self._crews.values()))

    def close(self) -> None:
        """Stop running blocks."""
        self._stop.set()
        self._pool.shutdown(wait=True, cancel_futures=True)


@dataclass(frozen=True)
class Sent:
    """The order to the workers of a cluster: the case as text, the files of its plug-ins, the kept names, the version."""

    text: str
    plugins: tuple[tuple[str, bytes], ...]
    kept: Kept
    version: str

    @classmethod
    def of(cls, case: Case, kept: Kept) -> Sent:
        """Return the order for a case."""
        files = tuple((path, read_plugin(Path(case.folder or "", path))) for path in case.plugins)
        return cls(case.to_toml(complete=True), files, kept, importlib.metadata.version("dforce"))


@functools.lru_cache(maxsize=4)
def _case_of(sent: Sent) -> Case:
    """Return the case that was sent, in a worker."""
    here = importlib.metadata.version("dforce")
    if here != sent.version:
        raise ParameterError(f"a worker of the cluster has dForce {here}, but the sweep has {sent.version}")
    folder = Path(tempfile.mkdtemp(prefix="dforce-plugins-")) if sent.plugins else None
    for name, content in sent.plugins:
        file = Path(str(folder), Path(name).name)
        file.write_bytes(content)
    with beside(folder):
        return Case.from_toml(sent.text)


def _compute(sent: Sent, axes: list[Axis]) -> Arrays:
    """Compute the cases of a block, in a worker."""
    return arrays_of(_case_of(sent), axes, sent.kept, Alone(threading.Event()))


class Cluster(Hands):
    """The workers of a Dask cluster, known by a client or the address of the scheduler."""

    def __init__(self, case: Case, kept: Kept, client: Any) -> None:
        try:
            import distributed
        except ImportError:
            raise ParameterError('a cluster needs Dask, which is not installed: pip install "dforce[maps]"') from None
        self._own = isinstance(client, str)
        self._levels = {name: logging.getLogger(name).level for name in LOGS}
        if self._own:  # a lost scheduler is one sentence here, not a traceback in a log
            self._log(dict.fromkeys(LOGS, logging.CRITICAL))
        try:
            connect: Any = distributed.Client
            self.client: Any = connect(client, set_as_default=False) if self._own else client
            self._pool = self.client.get_executor(pure=False)
        except (OSError, ValueError, AttributeError) as error:
            self._log(self._levels)
            raise ResultError(f"no cluster answers at '{client}': {error}") from None
        self._sent = Sent.of(case, kept)

    def room(self) -> int:
        """Return the largest number of running blocks."""
        self.check()
        try:
            threads: dict[str, int] = self.client.nthreads()
        except OSError:  # Dask raises this when a connection has ended
            raise ResultError(LOST) from None
        return max(1, AHEAD * sum(threads.values()))

    def submit(self, axes: list[Axis]) -> Future[Arrays]:
        """Begin to compute the cases of a block."""
        future: Future[Arrays] = self._pool.submit(_compute, self._sent, axes)
        return future

    def tries(self, error: BaseException) -> int:
        """Return how often a block is tried before it is left out, when it ends with an error."""
        from distributed import KilledWorker

        return TRIES_OF_DEAD if isinstance(error, KilledWorker) else TRIES

    def check(self) -> None:
        """Raise :class:`ResultError` when the scheduler is gone."""
        if self.client.status in ("closed", "closing"):
            raise ResultError(LOST)

    def close(self) -> None:
        """Forget running blocks."""
        self._pool.shutdown(wait=False)
        if self._own:
            self.client.close(timeout=5)
            self._log(self._levels)

    def _log(self, levels: dict[str, int]) -> None:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)
