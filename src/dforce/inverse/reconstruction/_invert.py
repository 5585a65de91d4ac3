"""The exact inverse: force and damping whose virial and energy along the tip's real paths match a curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from dforce.core.arrays import Array
from dforce.inverse.reconstruction._gaps import Gap, gaps_in, hidden_error
from dforce.inverse.reconstruction._law import Law, force_of, laid
from dforce.inverse.reconstruction._least import LeastSquares, evidence, solve
from dforce.inverse.reconstruction._path import Paths, Rows, closest, impulse, no_paths, paths_of, rows_of, virials
from dforce.inverse.reconstruction._points import Balance, CurvePoints, standard_deviation

MOST_NODES, LEAST_NODES = 260, 60
WIDTHS = (0.003, 0.01, 0.03, 0.1, 0.3)  # of the stretch of dense nodes, as shares of the range of distances
FIRST_WIDTH = 0.03
# The force that bends the paths is smoothed, and less from step to step: by which share of a virial it may miss it. A step
# lasts until the paths have settled.
DOUBTS = (3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4)
CLOSE = 0.1  # share of that by which a virial may still change when paths have settled
ROUNDS = 30
LEAST_SHARE = 0.1  # of the way to the new paths; a smaller one leads nowhere
SMALLEST_DOUBT = 1e-5  # of the largest virial: by nodes and instants
PLAIN_DOUBT = 1e-3  # of a virial, by sinusoids for paths
LEAST_SIZE = 0.1  # of the largest virial
WIDTH_ROUND = 2
FAR = 0.25  # share of the nodes, from the last node, that determine the fall of the force beyond
LONGER = 1.5  # times its length: an error of how the force falls beyond the last node
BESIDE = 5  # points that share the error of computation
SEEN = 3.0  # errors above which a force or a loss is seen
LEAST_LOSS = 1e-3  # share of the energy that the medium takes, below which no loss is looked for


@dataclass(frozen=True)
class Inverse:
    """A force that explains a curve.

    Attributes
    ----------
    law
        Force and damping at nodes.
    fit, damping
        The least squares behind both; None without a significant loss.
    hidden, beyond, unsettled
        Errors of the force (N) at the nodes by forces that hide between points, by the force beyond the last node, and by
        paths that have not converged.
    rows, balance, harmonics, when
        The last paths, and quantities along them.
    virial_error, energy_error, sample_energy
        Values of each point (J).
    gaps
        Distances at which no motion turned.
    sinusoid
        The force by the same inverse with plain sinusoids for paths.
    rounds, off
        Number of updates of the paths, and the change of each point's virial in the last update (J).
    """

    law: Law
    fit: LeastSquares
    damping: LeastSquares | None
    hidden: Array
    beyond: Array
    unsettled: Array
    rows: Rows
    balance: Balance
    virial_error: Array
    energy_error: Array
    sample_energy: Array
    gaps: list[Gap]
    sinusoid: Law
    rounds: int
    off: Array


def invert(
    reading: CurvePoints, balance: Balance, shifted: list[Balance], lossy: bool, report_progress: Callable[[int], None]
) -> Inverse:
    """Return the force behind the points of a curve.

    Parameters
    ----------
    reading, balance
        The points, and their virials and energies.
    shifted
        The same with each measured quantity a little off, for the errors of the force.
    lossy
        Whether a drag may be looked for.
    report_progress
        Called with the number of each round.
    """
    motions, count = balance.motions, len(balance.virial)
    low = motions.height - motions.amplitude
    span, nodes = float(np.ptp(low)), int(np.clip(2 * count, LEAST_NODES, MOST_NODES))
    law = laid(float(low.min()), float(low.max()), FIRST_WIDTH * span, nodes)
    energy_error = standard_deviation(one.energy - balance.energy for one in shifted)
    size = np.maximum(np.abs(balance.virial), LEAST_SIZE * np.abs(balance.virial).max())
    sinusoid = _plain(law, balance, shifted, size)
    rounding = _rounding(reading, balance)
    paths, off, moved, rounds = impulse(motions, balance.virial), size, size, 0
    for doubt in DOUBTS:
        started, before, done, share = (paths, off, moved), np.inf, False, 1.0
        while not done and rounds < ROUNDS and share > LEAST_SHARE:
            rounds += 1
            report_progress(rounds)
            law = _laid_anew(law, low, closest(motions, paths), law.width)
            error = np.hypot(np.hypot(_virial_error(law, balance, shifted, paths), rounding), doubt * size)
            if rounds == WIDTH_ROUND:
                law = _best_width(law, balance, error, paths, span)
            fit = solve(rows_of(law, motions, paths).virial, balance.virial, error)
            law = law._replace(force=fit.values, length=_fall(law, fit))
            new = paths_of(law, motions, paths, balance.virial)
            moved = virials(law, motions, new) - virials(law, motions, paths)
            off = maximum_filter1d(np.abs(moved), BESIDE)
            change = float(np.sqrt(np.mean((off / size) ** 2)))
            if rounds > WIDTH_ROUND + 1 and change > before:
                share *= 0.5  # the force is steep: the new paths go too far
            paths = Paths(*(one + share * (other - one) for one, other in zip(paths, new, strict=True)))
            before, done = change, change < CLOSE * doubt
        if not done:
            if doubt != DOUBTS[0]:
                paths, off, moved = started  # so little smoothed, the force is too noisy to bend the paths by
            break
    law = _laid_anew(law, low, closest(motions, paths), law.width)
    virial_error = np.hypot(_virial_error(law, balance, shifted, paths), rounding)
    virial_error = np.sqrt(virial_error**2 + off**2 + (SMALLEST_DOUBT * size.max()) ** 2)
    rows = rows_of(law, motions, paths)
    fit = solve(rows.virial, balance.virial, virial_error)
    law = law._replace(force=fit.values, length=_fall(law, fit))
    sample = balance.energy - rows.energy @ fit.values
    damping: LeastSquares | None = None
    if lossy and np.isfinite(sample).all() and _is_seen(sample, energy_error, balance):
        damping = solve(rows.loss, sample, energy_error)
        law = law._replace(damping=damping.values)
    gaps = gaps_in(rows.closest, reading.distance_error)
    longer = rows_of(law._replace(length=LONGER * law.length), motions, paths).virial
    return Inverse(
        law=law,
        fit=fit,
        damping=damping,
        hidden=hidden_error(law, fit.gain, rows),
        beyond=np.abs(fit.gain @ ((longer - rows.virial) @ fit.values)),
        unsettled=np.abs(fit.gain @ moved),
        rows=rows,
        balance=balance,
        virial_error=virial_error,
        energy_error=energy_error,
        sample_energy=sample,
        gaps=gaps,
        sinusoid=sinusoid,
        rounds=rounds,
        off=off,
    )


def _plain(law: Law, balance: Balance, shifted: list[Balance], size: Array) -> Law:
    """Return the force by plain sinusoids for paths."""
    error = standard_deviation(one.virial - balance.virial for one in shifted)
    rows = rows_of(law, balance.motions, no_paths(balance.motions))
    return law._replace(force=solve(rows.virial, balance.virial, np.hypot(error, PLAIN_DOUBT * size)).values)


def _laid_anew(law: Law, low: Array, closest: Array, width: float) -> Law:
    """Return the law at nodes between the closest and the farthest turning point of the paths."""
    new = laid(float(closest.min()), float(max(closest.max(), low.max())), width, len(law.force))
    return new._replace(
        force=force_of(law, law.force, new.nodes), damping=force_of(law, law.damping, new.nodes), length=law.length
    )


def _best_width(law: Law, balance: Balance, error: Array, paths: Paths, span: float) -> Law:
    """Return the law at the nodes that make the data most likely."""
    laws = [_laid_anew(law, law.nodes[-1:], law.nodes, share * span) for share in WIDTHS]
    likely = [evidence(rows_of(one, balance.motions, paths).virial, balance.virial, error) for one in laws]
    return laws[int(np.argmax(likely))]


def _virial_error(law: Law, balance: Balance, shifted: list[Balance], paths: Paths) -> Array:
    """Return the error of each virial (J), with the effect of errors of the motion on the virial along the path."""
    here = virials(law, balance.motions, paths)
    return standard_deviation(one.virial - balance.virial - virials(law, one.motions, paths) + here for one in shifted)


def _fall(law: Law, fit: LeastSquares) -> float:
    r"""Return the length of the force beyond the last node, from the line of :math:`|F|^{-1/2}` over the outer nodes."""
    far = slice(int((1.0 - FAR) * len(law.force)), None)
    d, force = law.nodes[far], fit.values[far]
    if (np.abs(force) < SEEN * fit.error[far]).any() or np.ptp(np.sign(force)):
        return float(law.nodes[-1] - law.nodes[0])
    slope, start = np.polyfit(d - d[-1], np.abs(force) ** -0.5, 1)
    return float(start / slope) if slope > 0.0 else float(law.nodes[-1] - law.nodes[0])


def _is_seen(energy: Array, error: Array, balance: Balance) -> bool:
    """Return whether the sample takes energy."""
    motions = balance.motions
    medium = np.pi * np.abs(np.imag(1.0 / motions.response[:, 1])) * motions.amplitude**2
    return bool((energy > np.maximum(SEEN * error, LEAST_LOSS * medium)).sum() > len(energy) // 20)


def _rounding(reading: CurvePoints, balance: Balance) -> Array:
    """Return by how much amplitude and phase of a computed curve miss its own virial (J), at each point or beside it."""
    if reading.virial is None:
        return np.zeros_like(balance.virial)
    return np.asarray(maximum_filter1d(np.abs(balance.virial - reading.virial), BESIDE))
