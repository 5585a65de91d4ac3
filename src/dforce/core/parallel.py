"""Threads that share jobs, with progress and an end that can be asked for.

The compiled solvers release Python's lock, so threads use all cores without copies of the data.
"""

from __future__ import annotations

import contextvars
import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor, wait

from dforce.core.stopping import heard, watching

LOOK = 0.05  # s between looks at the jobs


def uncounted(*_: object) -> None:
    """Report to nobody."""


class Stopped(BaseException):
    """The work was stopped: no error, so that nothing on the way takes it for one."""


class Crew:
    """Runs jobs on threads and counts the points that they do.

    Parameters
    ----------
    total
        Number of points in all.
    progress
        Called in the thread that calls :meth:`run` with the points done, the points in all and a note.
    workers
        Number of threads; left out: one for each core.
    """

    def __init__(self, total: int, progress: Callable[[int, int, str], None], workers: int | None = None) -> None:
        self.total, self.done, self.progress = total, 0, progress
        self.workers = workers or cores()
        self._stopped = threading.Event()
        self._lock = threading.Lock()

    def add(self, points: int) -> None:
        """Count points, from any thread."""
        with self._lock:
            self.done += points

    def check_cancelled(self) -> None:
        """Raise :class:`Stopped`, in a job, once the work is to stop."""
        if self._stopped.is_set():
            raise Stopped

    def run(self, jobs: Iterable[Callable[[], None]], note: str = "") -> bool:
        """Do all jobs; return False when stopped by Ctrl-C, after running jobs have ended with :class:`Stopped`.

        An error in a job stops the others and is raised.
        """
        pool = ThreadPoolExecutor(self.workers)
        pending: set[Future[None]] = set()
        try:
            self.progress(self.done, self.total, note)
            # in this thread's context: who listens, and whether answers may be early
            pending = {pool.submit(contextvars.copy_context().run, self._quiet, job) for job in jobs}
            while pending:
                done, pending = wait(pending, LOOK)
                for future in done:
                    future.result()
                self.progress(self.done, self.total, note)
        except KeyboardInterrupt:
            heard()
            self._stopped.set()
            return False
        except BaseException:
            self._stopped.set()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
        return True

    def _quiet(self, job: Callable[[], None]) -> None:
        try:
            with watching(self.check_cancelled):
                if not self._stopped.is_set():
                    job()
        except Stopped:
            pass


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
