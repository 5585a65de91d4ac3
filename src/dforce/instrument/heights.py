r"""A lever that changes with its height: how the fluid below it, or anything else, damps it on its way to the sample.

The numbers of modes and tones are known at some distances. Between two of them squares of frequencies, dampings
:math:`f_0/Q`, forces and motions of the base change linearly; beyond the last they stay.
"""

from __future__ import annotations

import bisect
import dataclasses
import functools
import math
from dataclasses import dataclass

import numpy as np

from dforce.core.errors import ParameterError
from dforce.instrument.beam_lever import Beam
from dforce.instrument.drive import Drive, ToneNumbers
from dforce.instrument.lever import Cantilever
from dforce.instrument.medium import Medium
from dforce.instrument.modes import ModeNumbers
from dforce.instrument.readout import Readout

PARTS = 64  # of each interval that a user gives: between them numbers that change together are not quite linear
MOST = 512  # parts of all intervals together: where many are given, little changes in each
NEAREST, FARTHEST, HEIGHTS = 0.5, 20.0, 80  # heights of the tip between which the flow at a wall is tabulated


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


@functools.lru_cache(maxsize=256)  # the problems of a sweep share what does not change in it
def heights_of(
    cantilever: Cantilever,
    drive: Drive,
    medium: Medium,
    readout: Readout,
    modes: tuple[ModeNumbers, ...],
    tones: tuple[ToneNumbers, ...],
) -> Heights | None:
    """Return what a lever and its drive are at each height; None where they stay what they are, `modes` and `tones`.

    Raises
    ------
    ParameterError
        When what drifts is that of several modes or tones, or leaves what is known of the flow at a wall.
    """
    if cantilever.beam is not None and cantilever.beam.wall == "at_distance":
        return _over_wall(cantilever.beam, medium, tones)
    drift = cantilever.drift
    if drift is None:
        return None
    if len(modes) > 1 or len(tones) > 1:
        raise ParameterError("cantilever.drift needs one mode and one tone")
    parts = min(PARTS, max(1, MOST // (len(drift.zc) - 1)))
    zc = np.unique(np.concatenate([np.linspace(a, b, parts + 1) for a, b in zip(drift.zc, drift.zc[1:], strict=False)]))
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
    zc, modes = zip(*known, strict=True)
    return Heights(zc, modes, (tones,) * len(known))
