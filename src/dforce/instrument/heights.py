r"""A lever that changes with its height: how the fluid below it, or anything else, damps it on its way to the sample.

The numbers of modes and tones are known at some distances. Between two of them squares of frequencies, dampings
:math:`f_0/Q`, forces and motions of the base change linearly; beyond the last they stay.
"""

from __future__ import annotations

import bisect
import dataclasses
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dforce.core.arrays import Array
from dforce.core.errors import ParameterError
from dforce.instrument.beam_lever import Beam
from dforce.instrument.drive import Drive, ToneNumbers
from dforce.instrument.lever import Cantilever
from dforce.instrument.medium import Medium
from dforce.instrument.modes import ModeNumbers
from dforce.instrument.readout import Readout

# relative change of Q or the free amplitude from one distance to the next: numbers in between are not quite linear, and
# are off by a quarter of its square
STEP = 1e-3
MOST = 4096  # distances at which a lever is known, about: where it changes more than that allows, steps are longer
NEAREST, FARTHEST, HEIGHTS = 0.5, 20.0, 80  # heights of the tip between which the flow at a wall is computed


@dataclass(frozen=True)
class Heights:
    """Modes and tones at some average distances (m), which rise."""

    zc: tuple[float, ...]
    modes: tuple[tuple[ModeNumbers, ...], ...]
    tones: tuple[tuple[ToneNumbers, ...], ...]

    def at(self, zc: float) -> tuple[tuple[ModeNumbers, ...], tuple[ToneNumbers, ...]]:
        """Return modes and tones at a distance (m)."""
        place, share = self.place(zc)
        modes = tuple(_mode_between(a, b, share) for a, b in zip(*self.modes[place : place + 2], strict=True))
        tones = tuple(_tone_between(a, b, share) for a, b in zip(*self.tones[place : place + 2], strict=True))
        return modes, tones

    def place(self, zc: float) -> tuple[int, float]:
        """Return the number of the interval that a distance (m) is in, and how far, 0 to 1."""
        place = min(max(bisect.bisect_right(self.zc, zc) - 1, 0), len(self.zc) - 2)
        low, high = self.zc[place : place + 2]
        return place, min(max((zc - low) / (high - low), 0.0), 1.0)


def _mode_between(a: ModeNumbers, b: ModeNumbers, share: float) -> ModeNumbers:
    f0 = math.sqrt(_between(a.f0**2, b.f0**2, share))
    damping = _between(a.f0 / a.Q, b.f0 / b.Q, share)
    added = None if a.added_mass is None or b.added_mass is None else _between(a.added_mass, b.added_mass, share)
    return dataclasses.replace(a, f0=f0, Q=f0 / damping, added_mass=added)


def _tone_between(a: ToneNumbers, b: ToneNumbers, share: float) -> ToneNumbers:
    return dataclasses.replace(a, force=_between(a.force, b.force, share), base=_between(a.base, b.base, share))


def _between(a: float, b: float, share: float) -> float:
    return (1.0 - share) * a + share * b


@functools.lru_cache(maxsize=256)  # the problems of a sweep often share a lever
def heights_of(
    cantilever: Cantilever,
    drive: Drive,
    medium: Medium,
    readout: Readout,
    modes: tuple[ModeNumbers, ...],
    tones: tuple[ToneNumbers, ...],
) -> Heights | None:
    """Return a lever's modes and tones at each height; None where they are `modes` and `tones` at every height.

    Raises
    ------
    ParameterError
        When a drift has several modes or tones, or the lever leaves the range of the theory of the flow at a wall.
    """
    if cantilever.beam is not None and cantilever.beam.wall == "at_distance":
        return _over_wall(cantilever.beam, medium, tones)
    drift = cantilever.drift
    if drift is None:
        return None
    if len(modes) > 1 or len(tones) > 1:
        raise ParameterError("cantilever.drift needs one mode and one tone")
    zc = _fine(drift.zc, drift.Q, drift.A0)
    Q = np.interp(zc, drift.zc, drift.Q) if drift.Q else np.full(len(zc), modes[0].Q)
    there = [(dataclasses.replace(modes[0], Q=float(one)),) for one in Q]
    moved = [tones] * len(zc)
    if drift.A0:
        given = {"frequency": tones[0].frequency, "base_amplitude": None}
        changed = [drive.model_copy(update=given | {"A0": float(one)}) for one in np.interp(zc, drift.zc, drift.A0)]
        found = [one.resolve(mode, readout)[0] for one, mode in zip(changed, there, strict=True)]
        moved = [(dataclasses.replace(one, A0=tones[0].A0),) for one in found]
    return Heights(tuple(zc.tolist()), tuple(there), tuple(moved))


def _over_wall(beam: Beam, medium: Medium, tones: tuple[ToneNumbers, ...]) -> Heights:
    height = beam.needed("tip_height")
    heights = np.append(height, height * np.geomspace(NEAREST, FARTHEST, HEIGHTS))
    heights = np.unique(heights[heights >= beam.nearest()])
    known = []
    for one in heights.tolist():
        try:
            known.append((one - height, beam.model_copy(update={"tip_height": one}).resolve(medium)))
        except ParameterError:
            if one >= height:  # nearer than its tip is high a lever is by nanometers, and may stop to oscillate before
                raise
            known.clear()
    return _between_computed(known, tones)


def _between_computed(known: list[tuple[float, tuple[ModeNumbers, ...]]], tones: tuple[ToneNumbers, ...]) -> Heights:
    """Return modes computed at some distances (m) and so many between them that each step changes little."""
    from scipy.interpolate import CubicSpline  # loading it takes long

    zc, modes = np.array([one for one, _ in known]), [there for _, there in known]
    fine = _fine(zc, *np.array([[mode.Q for mode in there] for there in modes]).T)

    def between(name: str, n: int) -> Array:
        return np.asarray(CubicSpline(zc, [getattr(there[n], name) for there in modes])(fine))

    each = [
        [
            dataclasses.replace(modes[0][n], f0=float(f0), Q=float(Q), added_mass=float(added))
            for f0, Q, added in zip(*(between(name, n) for name in ("f0", "Q", "added_mass")), strict=True)
        ]
        for n in range(len(modes[0]))
    ]
    return Heights(tuple(fine.tolist()), tuple(zip(*each, strict=True)), (tones,) * len(fine))


def _fine(zc: Sequence[float] | Array, *columns: Sequence[float] | Array) -> Array:
    """Return distances (m) between given ones, so that no column, linear in between, changes by more than a step at once."""
    given = [np.asarray(column) for column in columns if len(column)]
    changes = [np.abs(np.diff(np.log(column))) for column in given]
    step = max(STEP, float(np.sum(changes)) / MOST)
    places = [np.asarray(zc)]
    for column, change in zip(given, changes, strict=True):
        for i in np.flatnonzero(change > step).tolist():
            levels = np.geomspace(column[i], column[i + 1], math.ceil(change[i] / step) + 1)[1:-1]
            places.append(zc[i] + (zc[i + 1] - zc[i]) * (levels - column[i]) / (column[i + 1] - column[i]))
    return np.unique(np.concatenate(places))
