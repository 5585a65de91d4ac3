r"""The tip's real path at each point of a curve, and the work of a force law along it.

A point of a curve is a periodic motion whose fundamental is known: :math:`A \cos\theta` about the height :math:`z_c`.
The force bends the path by its other harmonics, the mean included,

.. math:: z(\theta) = A \cos\theta + \mathrm{Re} \sum_{h \ne 1} G(h\omega) \hat F_h e^{i h \theta},

with the lever's response G to a force at the tip, all modes together. At high harmonics each mode is a free mass,
:math:`G = -M / h^2`, so these are integrated in one: the force, twice over the phase.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid

from dforce.core.arrays import Array, Complexes
from dforce.inverse.reconstruction._law import Law, force_of, shares

HARMONICS = 24  # with the modes' own response; beyond it a mode responds as a free mass, within 1/h^2
PASSES = 60  # of the fixed point
SETTLED = 1e-8  # change of a path, as a share of the amplitude, at which it is taken as found
CLOSER = 0.9  # instants lie ten times closer where the tip turns near the sample
INSTANTS = 448  # of a period: 3 within the time that a tip of 20 nm amplitude spends in its last 0.2 pm
FAR_OFF, LEAST_SIZE = 0.3, 0.1  # of the virial: the part that a law lacks, and the least size, of the largest
AT_ONCE = 64  # points whose paths are computed together: their arrays fit in the cache


class Motions(NamedTuple):
    """The motion at each point as far as it is known: one value each.

    Attributes
    ----------
    height, amplitude
        Average distance and amplitude of the tip's fundamental (m).
    frequency
        Of the motion (Hz).
    response
        Answer of the tip to a force at multiples 0, 1, 2, ... of the frequency (m/N), shape (points, harmonics + 1).
    mobility
        Answer of the free masses (m/N): M of :math:`G = -M / h^2`.
    """

    height: Array
    amplitude: Array
    frequency: Array
    response: Complexes
    mobility: Array

    def part(self, which: Any) -> Motions:
        """Return some of the points."""
        return Motions(*(values[which] for values in self))


class Paths(NamedTuple):
    """How paths differ from their fundamental: the deflection (m) and its slope over the phase, (points, instants)."""

    bend: Array
    slope: Array

    def part(self, which: Any) -> Paths:
        """Return the paths of some points."""
        return Paths(self.bend[which], self.slope[which])


class Rows(NamedTuple):
    """The effect along the paths of a force and a damping of unit size at each node.

    Attributes
    ----------
    virial
        Virial of the fundamental by the force at each node (m), shape (points, nodes).
    energy
        Energy that the force at each node takes from the fundamental in a period (m), by harmonics of the path.
    loss
        Energy that the damping at each node takes from it (m^2/s).
    closest
        Smallest distance of each path (m).
    """

    virial: Array
    energy: Array
    loss: Array
    closest: Array


_U = 2.0 * np.pi * np.arange(INSTANTS) / INSTANTS
ANGLE = np.pi + _U - CLOSER * np.sin(_U)  # phase of the fundamental; the tip is lowest at the first instant
WEIGHT = (1.0 - CLOSER * np.cos(_U)) / INSTANTS  # share of the period of an instant
COSINE, SINE = np.cos(ANGLE), np.sin(ANGLE)
ORDER = np.arange(HARMONICS + 1)
TURNS = np.exp(1j * ORDER[:, None] * ANGLE)
ANALYSIS = 2.0 * (WEIGHT * TURNS.conj()).T


def no_paths(motions: Motions) -> Paths:
    """Return plain sinusoids."""
    none = np.zeros((len(motions.height), INSTANTS))
    return Paths(none, none)


def impulse(motions: Motions, virial: Array) -> Paths:
    r"""Return the paths if the force acts at the turning point alone: :math:`\hat F_h = 2 (-1)^h \langle F \rangle`.

    Its mean is :math:`-V / A` then.
    """
    phasor = 2.0 * (-1.0) ** ORDER * (-virial / motions.amplitude)[:, None]
    # sum of cos(h u) / h^2 over h > 0, u counted from the turning point
    u = ANGLE - np.pi
    series = np.pi**2 / 6.0 - np.pi * u / 2.0 + u**2 / 4.0
    rate = u / 2.0 - np.pi / 2.0
    return _answer(motions, phasor, phasor[:, :1] * series, phasor[:, :1] * rate)


def _answer(motions: Motions, phasor: Array | Complexes, twice: Array, once: Array) -> Paths:
    """Return how a force bends paths: its phasors, and its part without mean integrated twice, with the slope of that."""
    mobility = motions.mobility[:, None]
    order = np.maximum(ORDER, 1)
    answer = (motions.response + np.where(ORDER == 0, 0.0, mobility / order**2)) * phasor
    answer[:, 0] *= 0.5  # a mean is half of the sum over cosines
    answer[:, 1] = mobility[:, 0] * phasor[:, 1]  # the fundamental is known: none of it
    return Paths((answer @ TURNS).real - mobility * twice, (1j * ORDER * answer @ TURNS).real - mobility * once)


def _integrated(force: Array) -> tuple[Array, Array]:
    r"""Return :math:`\sum_h \hat F_h e^{ih\theta} / h^2` of a force, and its slope, by trapezoids over the phase."""
    rest = force - force @ WEIGHT[:, None]
    slope = -cumulative_trapezoid(rest, ANGLE, initial=0.0)
    slope -= slope @ WEIGHT[:, None]
    twice = cumulative_trapezoid(slope, ANGLE, initial=0.0)
    return twice - twice @ WEIGHT[:, None], slope


def paths_of(law: Law, motions: Motions, start: Paths, virial: Array | None = None) -> Paths:
    """Return the paths of all points under a law, from a guess.

    With a known `virial` (J) of the fundamental, the part that the law lacks acts as an impulse at the turning point. The mean
    of a steep force follows from it, even if the law is not yet right at that point.
    """
    found = Paths(start.bend.copy(), start.slope.copy())
    for first in range(0, len(start.bend), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        known = None if virial is None else virial[part]
        found.bend[part], found.slope[part] = _paths_of(law, motions.part(part), start.part(part), known)
    return found


def _paths_of(law: Law, motions: Motions, start: Paths, virial: Array | None) -> Paths:
    found = start
    least = 0.0 if virial is None else LEAST_SIZE * float(np.abs(virial).max())
    before, taken = np.full(len(start.bend), np.inf), np.ones(len(start.bend))
    for _ in range(PASSES):
        force = _force_along(law, motions, found)
        answer = _answer(motions, force @ ANALYSIS, *_integrated(force))
        if virial is not None:
            lacking = virial - motions.amplitude * (force @ (WEIGHT * COSINE))
            more, alone = impulse(motions, lacking), impulse(motions, virial)
            # a law that is far off here does not determine the path: the virial alone does
            trust = (1.0 / (1.0 + (lacking / (FAR_OFF * np.maximum(np.abs(virial), least))) ** 2))[:, None]
            answer = Paths(
                *(
                    trust * (one + two) + (1.0 - trust) * three
                    for one, two, three in zip(answer, more, alone, strict=True)
                )
            )
        size = np.abs(answer.bend - found.bend).max(axis=1)
        taken = np.where(size < 0.7 * before, taken, 0.5 * taken)  # where the plain fixed point does not contract
        share, before = taken[:, None], size
        found = Paths(
            found.bend + share * (answer.bend - found.bend), found.slope + share * (answer.slope - found.slope)
        )
        if (size < SETTLED * motions.amplitude).all():
            break
    return found


def _distance(motions: Motions, paths: Paths) -> Array:
    return np.asarray(motions.height[:, None] + motions.amplitude[:, None] * COSINE + paths.bend)


def _force_along(law: Law, motions: Motions, paths: Paths) -> Array:
    """Return the force (N) along paths, with the force of the damping."""
    distance = _distance(motions, paths)
    force = force_of(law, law.force, distance)
    if np.any(law.damping):
        rate = 2.0 * np.pi * motions.frequency[:, None] * (paths.slope - motions.amplitude[:, None] * SINE)
        force -= force_of(law, law.damping, distance) * rate
    return force


def rows_of(law: Law, motions: Motions, paths: Paths) -> Rows:
    """Return the contribution of each node along the paths of all points."""
    parts = [
        _rows_of(law, motions.part(part), paths.part(part))
        for part in (slice(first, first + AT_ONCE) for first in range(0, len(motions.height), AT_ONCE))
    ]
    return Rows(*(np.concatenate(found) for found in zip(*parts, strict=True)))


def _rows_of(law: Law, motions: Motions, paths: Paths) -> Rows:
    distance = _distance(motions, paths)
    first, share = shares(law, distance)
    points, nodes = len(distance), len(law.force)
    start = first + nodes * np.arange(points)[:, None]
    places = np.stack([start + number for number in range(len(share))]).ravel()
    amplitude = motions.amplitude[:, None]

    def gathered(factor: Array) -> Array:
        found = np.bincount(places, (share * (factor * WEIGHT)).ravel(), points * nodes)
        return np.asarray(found.reshape(points, nodes), dtype=float)

    rate = 2.0 * np.pi * motions.frequency[:, None] * (paths.slope - amplitude * SINE)
    sine = 2.0 * np.pi * amplitude * SINE
    return Rows(gathered(amplitude * COSINE), gathered(sine), gathered(-rate * sine), distance.min(axis=1))


def closest(motions: Motions, paths: Paths) -> Array:
    """Return the smallest distance of each path (m)."""
    return np.asarray(_distance(motions, paths).min(axis=1))


def virials(law: Law, motions: Motions, paths: Paths) -> Array:
    """Return the virial (J) of the fundamental along each path, which keeps its shape."""
    return np.asarray(_force_along(law, motions, paths) @ (WEIGHT * COSINE) * motions.amplitude)
