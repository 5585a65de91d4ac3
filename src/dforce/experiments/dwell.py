"""Dwell: the motion at one distance, as traces over time and a spectrum."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import Number, Part, param, part
from dforce.experiments.base import CaseLike, MotionExperiment, Progress, Start, initial_motion, tapping_distance

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem
    from dforce.solvers import SolverSettings
    from dforce.solvers.integrator import Integrator, Motion

MOST_SAMPLES = 20_000_000  # of a trace: beyond this it does not fit into a picture, nor soon into memory

LONGEST_SPECTRUM = 1024  # periods: tells tones apart that differ by a hundredth of the first one's frequency


class Dwell(MotionExperiment):
    """The tip stays at one average distance; its motion is recorded once it has settled."""

    kind: Literal["dwell"] = "dwell"
    zc: Number = param(unit="m", symbol="z_c", doc="average tip–surface distance")
    start: Part[Start] = part("free", description="motion at the start: free, rest, or an amplitude and a phase")
    record: Literal["settled", "all"] = pydantic.Field(
        default="settled",
        title="What is recorded",
        description="record the settled motion only, or everything from the start as well",
    )
    recorded_periods: int = pydantic.Field(
        default=8, ge=1, le=100_000, description="periods of the first tone that are recorded once settled"
    )

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return typical distances; see :class:`Experiment`."""
        return {"zc": tapping_distance(problem)}

    def run(
        self, problem: Problem, settings: SolverSettings, progress: Progress, earlier: xr.Dataset | None = None,
        case: CaseLike | None = None,
    ) -> xr.Dataset:  # fmt: skip
        """Return traces, spectrum and scalars; see :class:`Experiment`."""
        problem = problem.at_height(self.zc)
        if settings.integrator == "langevin":
            from dforce.experiments._thermal import thermal_dwell

            return thermal_dwell(self, problem, settings, progress)
        from dforce.experiments.motion import base_of, rows_of, scales_of, with_motions
        from dforce.experiments.table import Table
        from dforce.results.status import Status
        from dforce.solvers.block import Block
        from dforce.solvers.protocols import settle_at
        from dforce.solvers.sample_counts import sample_counts
        from dforce.solvers.states import States

        if self.record == "all":  # the whole way there is asked for, so it has to be gone
            settings = settings.replace(method="transient")
        table = Table((), {}, problem, self.harmonics)
        plain = Block.of_one(problem, settings, self.harmonics)
        try:
            progress(0, 1, "settling")
            for points, _ in sample_counts(plain.points, settings):
                block = Block.of_one(problem, settings, self.harmonics, lambda: progress(0, 1, "settling"), points)
                integrator = block.integrator(0, self.zc)
                first = initial_motion(integrator, self.start)
                found = settle_at(block, first, self.zc)
                table.put((), found, problem)
                if table.status[()] != Status.UNRESOLVED:
                    break
        except KeyboardInterrupt:
            data = Table((), {}, problem, self.harmonics).dataset().assign_coords(zc=self.zc)
            data.attrs["interrupted"] = 1
            return data
        data = table.dataset().assign_coords(zc=self.zc)
        integrator = block.integrator(0, self.zc)
        data.attrs["samples_per_period"] = integrator.points
        if table.status[()] not in (Status.FAILED, Status.UNRESOLVED):
            settling = int(found.values["settling_periods"])
            motion, count = found.motion, self.recorded_periods
            if self.record == "all":
                motion, count = first, settling + self.recorded_periods
            if count * integrator.points > MOST_SAMPLES:
                raise ParameterError(
                    f"a record of {count} periods with {integrator.points} samples each is too long; "
                    'lower experiment.recorded_periods, or record = "settled"'
                )
            motion = record_traces(data, integrator, motion, count)
            data = with_motions(
                data, (), rows_of(States.of(found.motion), scales_of(problem), base_of(problem), problem)[0], problem
            )
            record_spectrum(data, integrator, motion, self.recorded_periods)
        progress(1, 1, "")
        return data


def record_traces(data: xr.Dataset, integrator: Integrator, motion: Motion, count: int) -> Motion:
    """Add traces over `count` periods of the first tone from a motion on; return the motion after them."""
    from dforce.results.dataset import describe

    problem, scales = integrator.problem, integrator.scales
    modes, period = len(problem.modes), 1.0 / problem.tones[0].frequency
    start, blocks, bases = motion.period, [], []
    for _ in range(count):
        bases.append(base_motion(integrator, motion.period))
        motion, block = integrator.record(motion)
        blocks.append(block[:-1, [*range(2 * modes), -1]])  # the last sample is the next period's first
    samples, base = np.concatenate(blocks), np.concatenate(bases, axis=1)
    z_n, v_n = samples[:, 0 : 2 * modes : 2].T * scales.length - base, samples[:, 1 : 2 * modes : 2].T * scales.speed
    z, moved = z_n.sum(0), base.sum(0)
    d = float(data["zc"]) + moved + z
    # whole periods from the first drive's phase zero: time counts from the start of the record
    data["time"] = ("time", np.arange(len(z)) * period / integrator.points)
    data["deflection"] = ("time", z)
    data["mode_deflection"] = (("mode", "time"), z_n)
    if problem.shaken is not None:
        data["base"] = ("time", moved)
    data["velocity"] = ("time", v_n.sum(0))
    data["distance"] = ("time", d)
    data["force"] = ("time", samples[:, -1])
    data["indentation"] = ("time", np.maximum(problem.a0 - d, 0.0))
    data.attrs["record_start_period"] = start
    describe(data)
    return motion


def base_motion(integrator: Integrator, period: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return what of each mode's motion (m), as it is solved, is that of the base over a period, (modes, samples)."""
    problem, out = integrator.problem, np.zeros((len(integrator.problem.modes), integrator.points))
    turns = period + np.arange(integrator.points) / integrator.points
    for tone, moved in zip(problem.tones, problem.base, strict=True):
        ratio = tone.frequency / problem.tones[0].frequency
        out[tone.mode] += (moved * np.exp(1j * (tone.phase + 2.0 * math.pi * ((ratio * turns) % 1.0)))).real
    return out


def record_spectrum(data: xr.Dataset, integrator: Integrator, motion: Motion, count: int) -> None:
    """Add the spectrum of at least `count` periods of the first tone from a motion on."""
    from dforce.observables.averaging import weights, window_length
    from dforce.results.dataset import describe

    problem, modes = integrator.problem, len(integrator.problem.modes)
    # tones that do not repeat within the record need a longer one to be told apart
    frequencies = [tone.frequency for tone in problem.tones]
    window = min(window_length(frequencies), LONGEST_SPECTRUM)
    longer = []
    for _ in range(window * math.ceil(count / window)):
        base = base_motion(integrator, motion.period).sum(0)
        motion, block = integrator.record(motion)
        longer.append(block[:-1, 0 : 2 * modes : 2].sum(1) * integrator.scales.length - base)
    each = np.repeat(weights(frequencies, len(longer)), integrator.points)
    data["frequency"] = ("frequency", np.fft.rfftfreq(len(each), 1.0 / frequencies[0] / integrator.points))
    data["spectrum"] = ("frequency", amplitude_spectrum(np.concatenate(longer), each))
    describe(data)


def amplitude_spectrum(z: np.ndarray[Any, Any], weight: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return the amplitude (m) of each frequency in a record, its samples weighted; the mean at frequency zero."""
    c = np.fft.rfft(z * weight) / weight.sum()
    c[1:] *= 2.0
    if len(z) % 2 == 0:
        c[-1] *= 0.5
    return np.asarray(np.abs(c))
