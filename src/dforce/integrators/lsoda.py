"""SciPy's LSODA over the compiled right-hand side: the paper's choice.

Adams and BDF methods of variable order, 1 to 12 and 1 to 5 (A. C. Hindmarsh, in Scientific Computing, North-Holland
(1983); L. Petzold, SIAM J. Sci. Stat. Comput. 4, 136 (1983)). It is read at the samples of a period, and takes its own steps.
They are at most 1/60 of the period of the fastest mode, so that none steps over a contact.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from dforce.integrators.events import risen
from dforce.integrators.loops import keep_rest, seconds
from dforce.kernel.vocabulary import (
    distance,
    drive_at,
    evolve,
    force,
    keep,
    memory_size,
    motion,
    motion_of,
    motion_size,
    rate_of,
)

MOST_SWITCHES = 12  # between two samples; a force that switches more often has no branch to be on
LANDED = 1e-10  # how near behind a switch is near enough, relative to the way there


def derivative(tau: float, state: Any, start: float, latched: Any, tones: Any, bases: Any, p: Any) -> Any:
    """Return the rates of change of motion and memory; `start` is the scaled time at which tau is zero."""
    size = motion_size()
    change = np.empty(state.shape[0])
    y = motion_of(state.reshape(1, state.shape[0]), 0)
    d, rate, t = distance(y, p), rate_of(y, p), seconds(start + tau, p)
    if memory_size(state[size:]):
        evolve(d, rate, t, state[size:], change[size:], p)
    slopes = motion(drive_at(tones, bases, tau), force(d, rate, t, state[size:], latched, p), y, p)
    keep(change.reshape(1, state.shape[0]), 0, slopes)
    return change


def sample(state: Any, t: float, latched: Any, p: Any, samples: Any, i: int) -> int:
    """Write a state as sample i of a period; return which latch must switch, or -1."""
    size = motion_size()
    y = motion_of(state.reshape(1, state.shape[0]), 0)
    keep(samples, i, y)
    f = force(distance(y, p), rate_of(y, p), t, state[size:], latched, p)
    keep_rest(samples, i, state[size:], latched, f)
    return risen(y, t, latched, p)


class Flow:
    """The motion from one state on, at the scaled time zero; keeps LSODA's history from sample to sample.

    Parameters
    ----------
    rates, take
        The compiled :func:`derivative` and :func:`sample`.
    state
        Motion and memory.
    equation
        Further arguments of both: the scaled time of the run at which this flow starts, the branches, which are changed in
        place, tones and bases, and the parameters.
    tolerance, most
        Relative tolerance, and the longest step (scaled time).
    """

    def __init__(
        self, rates: Any, take: Any, state: Any, equation: tuple[Any, ...], tolerance: float, most: float
    ) -> None:
        self.rates, self.take, self.equation = rates, take, equation
        self.start, self.latched, _, _, self.p = equation
        self.tolerance, self.most = tolerance, most
        self.state, self.tau = state, 0.0
        self.solver = self._begin()

    def _begin(self) -> Any:
        """Return SciPy's integrator at the state and time reached."""
        from scipy.integrate import ode

        def rates(tau: float, state: Any) -> Any:  # older versions of SciPy cannot call a compiled function
            return self.rates(tau, state, *self.equation)

        limits = {"rtol": self.tolerance, "atol": self.tolerance * 1e-3, "nsteps": 100_000, "max_step": self.most}
        solver = ode(rates).set_integrator("lsoda", **limits)
        solver.set_initial_value(self.state.copy(), self.tau)  # SciPy works in place
        return solver

    def sample(self, samples: Any, row: int) -> int:
        """Write the state as a sample; return which latch must switch, or -1."""
        return int(self.take(self.state, seconds(self.start + self.tau, self.p), self.latched, self.p, samples, row))

    def _go(self, end: float, samples: Any, row: int) -> int:
        """Integrate to a time, sample, and return which latch must switch, or -1."""
        self.state, self.tau = self.solver.integrate(end).copy(), end
        if not self.solver.successful():
            self.state = np.full_like(self.state, np.nan)
        return self.sample(samples, row)

    def advance(self, end: float, samples: Any, row: int) -> None:
        """Integrate to a time, switching branches on the way, and write the state there as a sample."""
        before = self.state, self.tau
        which = self._go(end, samples, row)
        for _ in range(MOST_SWITCHES):
            if which < 0:
                return
            which = self._first_switch(*before, which, samples, row)
            self.latched[which] = 1.0 - self.latched[which]
            before = self.state, self.tau
            self.solver = self._begin()
            which = self._go(end, samples, row)

    def _first_switch(self, state: Any, low: float, which: int, samples: Any, row: int) -> int:
        """Go to the first switch after an earlier state, found by bisection, and return which latch it is."""
        origin, high = low, self.tau
        found = self.state, high, which
        while high - low > LANDED * (found[1] - origin) and low < (middle := 0.5 * (low + high)) < high:
            self.state, self.tau = state, origin
            self.solver = self._begin()
            now = self._go(middle, samples, row)
            if now >= 0:
                found, high = (self.state, middle, now), middle
            else:
                low = middle
        self.state, self.tau, which = found
        return which
