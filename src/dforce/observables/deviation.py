"""How far two measurements of one motion are apart, as a share of each observable's scale: see ``core.quantity.Scale``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from dforce.core.arrays import Array
from dforce.core.quantities import OBSERVABLES
from dforce.core.quantity import Scale
from dforce.kernel import base_of, drive_of, modes_of
from dforce.kernel.codegen import LENGTH, OMEGA
from dforce.observables.complex_numbers import modulus
from dforce.observables.finish import driving_tone, free_signals
from dforce.problem import Problem

FAINT = 1e-4  # of the drive: a weaker force hardly moves the lever, and where the tip just touches it is none
DEVIATIONS = tuple(name for name, row in OBSERVABLES.items() if row.scale != Scale.NONE)


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
    square, damping, gain = np.moveaxis(modes_of(numbers, len(example.modes)), 2, 0)
    base, (_, moved, seen) = base_of(tones), free_signals(example, numbers, tones)
    free, read = length[:, None] * modulus(moved), length[:, None] * modulus(seen)  # read: A0, at this frequency
    of_modes = free[:, [driving_tone(example, n) for n in range(len(example.modes))]]
    shaken = length[:, None] * np.abs(base).max(axis=1, keepdims=True)  # the tip moves so far beside its deflection
    path = np.maximum(of_modes * np.minimum(1.0, damping / np.sqrt(square)), shaken)
    energy = square / (gain * length[:, None]) * of_modes * path
    drives = np.abs(drive_of(tones, len(example.modes)) / gain[:, None]).max(axis=(1, 2))  # of the driving forces (N)
    largest = np.maximum.reduce([np.abs(a["peak_force"]), np.abs(a["min_force"]), FAINT * drives])
    # of observables over tones, over modes, and of all others
    lengths = {"tone": read, "mode": of_modes}
    energies = {"tone": energy[:, example.own_modes], "mode": energy}
    plain = {
        Scale.SPEED: omega * np.maximum(length, shaken[:, 0]),
        Scale.PERIOD: 2.0 * np.pi / omega,
        Scale.ONE: 1.0,
        Scale.FORCE: largest,
        Scale.POWER: energy[:, 0] * omega / (2.0 * np.pi),
    }
    out = np.zeros((count, len(DEVIATIONS)))
    with np.errstate(divide="ignore", invalid="ignore"):
        for i, name in enumerate(DEVIATIONS):
            if name not in a:
                continue
            row, change = OBSERVABLES[name], np.abs(a[name] - b[name])
            over = row.dims[0] if row.dims else ""
            first = np.s_[:, None] if row.dims else np.s_[:]
            if row.scale == Scale.ENERGY:
                scale = energies.get(over, energy[:, 0][first])
            elif row.scale == Scale.LENGTH:
                scale = lengths.get(over, length[first])
            elif row.scale == Scale.PHASE:
                change = np.radians(np.minimum(change, 360.0 - change))
                scale = lengths.get(over, length[first]) / a[name.replace("phase", "amplitude")]
            else:
                scale = plain[row.scale]
            share = np.where(change > 0.0, change / scale, change)
            out[:, i] = share.reshape(count, -1).max(axis=1) if share.size else 0.0
    return out
