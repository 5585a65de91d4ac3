"""How far two measurements of one motion are apart, as a share of each quantity's scale.

| quantity | scale |
|---|---|
| amplitude | free amplitude A0 of its own tone |
| other lengths | A0 of the first tone |
| phase | 1 rad times A0/A |
| velocity | omega A0 |
| time, fraction | the period, 1 |
| force | the largest force of the motion |
| energy, virial | k A0^2, or k A0^2/Q where that is smaller |
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from dforce.kernel import Array, drive_of, stiffness_of
from dforce.kernel.codegen import FIRST_MODE, LENGTH, OMEGA, PER_MODE
from dforce.observables.complex_numbers import modulus
from dforce.observables.finish import driving_tone
from dforce.problem import Problem

LENGTHS = ("mean_deflection", "min_deflection", "max_deflection", "half_peak_to_peak", "min_distance")
FORCES = ("mean_force", "peak_force", "min_force")
# names that stand for others, which are the same but for a factor, or a part of them
DEVIATIONS = (
    "amplitude", "phase", "mode_amplitude", "mode_phase", "harmonic_amplitude", *LENGTHS, "peak_velocity",
    "contact_fraction", *FORCES, "virial", "dissipated_energy", "total_virial", "total_dissipated_energy",
)  # fmt: skip


def deviations(example: Problem, numbers: Array, tones: Array, a: Mapping[str, Any], b: Mapping[str, Any]) -> Array:
    """Return how far measurements are apart, (points, names) in the order of `DEVIATIONS`, the largest of each name.

    Parameters
    ----------
    example
        A problem with the modes and tones of all.
    numbers, tones
        The kernel's parameters (points, parameters) and tone tables (points, tones, columns).
    a, b
        Observables by name, points first.
    """
    count = len(numbers)
    length, omega = numbers[:, LENGTH], numbers[:, OMEGA]
    modes = numbers[:, FIRST_MODE : FIRST_MODE + PER_MODE * len(example.modes)].reshape(count, -1, PER_MODE)
    square, damping, gain = modes[:, :, 0], modes[:, :, 1], modes[:, :, 2]
    driven = [tone.mode for tone in example.tones]
    at = np.repeat(tones[:, :, :1], len(example.modes), axis=2)
    every = stiffness_of(numbers[:, None], len(example.modes), example.late_fluid, at)
    response = every[:, np.arange(len(driven)), driven]
    drive = drive_of(tones, len(example.modes))[:, np.arange(len(driven)), driven]
    free = length[:, None] * modulus(drive / response)
    of_modes = free[:, [driving_tone(example, n) for n in range(len(example.modes))]]
    energy = square / (gain * length[:, None]) * of_modes**2 * np.minimum(1.0, damping / np.sqrt(square))
    largest = np.maximum(np.abs(a["peak_force"]), np.abs(a["min_force"]))
    scales: dict[str, Any] = {
        "amplitude": free, "mode_amplitude": of_modes, "harmonic_amplitude": length[:, None],
        "phase": free / a["amplitude"], "mode_phase": of_modes / a["mode_amplitude"], "peak_velocity": omega * length,
        "contact_fraction": 1.0, "virial": energy, "dissipated_energy": energy, "total_virial": energy[:, 0],
        "total_dissipated_energy": energy[:, 0],
    }  # fmt: skip
    scales |= dict.fromkeys(LENGTHS, length) | dict.fromkeys(FORCES, largest)
    out = np.zeros((count, len(DEVIATIONS)))
    for i, name in enumerate(DEVIATIONS):
        if name not in a:
            continue
        change = np.abs(a[name] - b[name])
        if name.endswith("phase"):
            change = np.radians(np.minimum(change, 360.0 - change))
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(change > 0.0, change / scales[name], change)
        out[:, i] = share.reshape(count, -1).max(axis=1) if share.size else 0.0
    return out
