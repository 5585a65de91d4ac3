"""A motion recorded at one distance: traces over time and a spectrum."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from dforce.core.arrays import AnyArray, Array
from dforce.core.errors import ParameterError
from dforce.observables.averaging import weights, window_length

if TYPE_CHECKING:
    import xarray as xr

    from dforce.solvers.integrator import Integrator, Motion

MOST_SAMPLES = 20_000_000  # of a trace: beyond this it does not fit into a picture, nor soon into memory
LONGEST_SPECTRUM = 1024  # periods: resolves tones that differ by a hundredth of the first tone's frequency


def check_length(periods: int, samples: int) -> None:
    """Raise :class:`ParameterError` where a record of so many periods, with so many samples each, is too long."""
    if periods * samples > MOST_SAMPLES:
        raise ParameterError(
            f"a record of {periods} periods with {samples} samples each is too long; "
            'lower experiment.recorded_periods, or record = "settled"'
        )


def record_traces(data: xr.Dataset, integrator: Integrator, motion: Motion, count: int) -> Motion:
    """Add traces over `count` periods of the first tone from a motion on; return the motion after them."""
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
    return motion


def base_motion(integrator: Integrator, period: int) -> Array:
    """Return the base's share of each mode's motion (m), as it is solved, over a period, (modes, samples)."""
    problem, out = integrator.problem, np.zeros((len(integrator.problem.modes), integrator.points))
    turns = period + np.arange(integrator.points) / integrator.points
    for tone, moved in zip(problem.tones, problem.base, strict=True):
        ratio = tone.frequency / problem.tones[0].frequency
        out[tone.mode] += (moved * np.exp(1j * (tone.phase + 2.0 * math.pi * ((ratio * turns) % 1.0)))).real
    return out


def record_spectrum(data: xr.Dataset, integrator: Integrator, motion: Motion, count: int) -> None:
    """Add the spectrum of at least `count` periods of the first tone from a motion on."""
    problem, modes = integrator.problem, len(integrator.problem.modes)
    # tones that do not repeat within the record need a longer record to be resolved
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


def amplitude_spectrum(z: AnyArray, weight: AnyArray) -> AnyArray:
    """Return the amplitude (m) of each frequency in a record, its samples weighted; the mean at frequency zero."""
    c = np.fft.rfft(z * weight) / weight.sum()
    c[1:] *= 2.0
    if len(z) % 2 == 0:
        c[-1] *= 0.5
    return np.asarray(np.abs(c))
