"""A curve as an instrument would measure it, by formulas: an attractive and a repulsive part, noise, a free part."""

from __future__ import annotations

import io

import numpy as np
import xarray as xr

A0, K, Q, F0 = 20e-9, 2.0, 100.0, 70e3
NOISE, TURN = 30e-12, 0.2  # m, degrees


def numbers(points=120, seed=1, both=True, noise=1.0):
    """Return heights (m, from far to near), amplitudes (m) and lags (degrees) that a conservative sample allows.

    Over a conservative sample sin(phase) = A/A0: the amplitude decides both. The tip is free above 25 nm, attracted down to
    18 nm, and repelled below.
    """
    height = np.linspace(40e-9, 5e-9, points)
    draw = np.random.default_rng(seed)
    amplitude = np.where(height > 25e-9, A0, np.where(height > 18e-9, A0 - 0.3 * (25e-9 - height), height - 1e-9))
    lag = np.degrees(np.arcsin(np.minimum(amplitude / A0, 1.0)))
    lag = np.where(height > 18e-9, 180.0 - lag, lag) if both else lag
    return height, amplitude + noise * NOISE * draw.normal(size=points), lag + noise * TURN * draw.normal(size=points)


def text(separator=",", decimal=".", newline="\n", heading="height_nm,amplitude_nm,phase_deg", **how):
    """Return a table of the curve, in nm and degrees."""
    lines = [separator.join(heading.split(","))]
    for h, a, phi in zip(*numbers(**how), strict=True):
        cells = (f"{1e9 * h:.4f}", f"{1e9 * a:.5f}", f"{phi:.4f}")
        lines.append(separator.join(cell.replace(".", decimal) for cell in cells))
    return newline.join([*lines, ""])


def dataset(**how):
    """Return the curve as `df.read_measured` gives it."""
    height, amplitude, lag = numbers(**how)
    return xr.Dataset(
        {"height": ("point", height), "amplitude": ("point", amplitude), "phase": ("point", lag)},
        coords={"direction": ("point", np.repeat("approach", len(height)))},
        attrs={"phase_convention": "lag", "history": ["read: made by formulas"]},
    )


def density(frequency, k=2.0, Q=100.0, f0=70e3, background=1e-28, temperature=298.15):
    """Return the one-sided power density of the thermal motion (m²/Hz)."""
    r = frequency / f0
    mean_square = 1.380649e-23 * temperature / k
    return mean_square * 2.0 / (np.pi * f0 * Q) / ((1.0 - r**2) ** 2 + r**2 / Q**2) + background


def spectrum(averages=20, seed=1, points=2000, **lever):
    """Return frequencies (Hz) and power densities (m²/Hz) of averaged spectra."""
    frequency = np.linspace(50e3, 90e3, points)
    draw = np.random.default_rng(seed)
    return frequency, density(frequency, **lever) * draw.gamma(averages, 1.0 / averages, size=points)


def spectrum_text(**how):
    """Return a spectrum as a text file."""
    content = io.StringIO()
    content.write("frequency (Hz),PSD (m^2/Hz)\n")
    for f, s in zip(*spectrum(**how), strict=True):
        content.write(f"{f:.3f},{s:.6e}\n")
    return content.getvalue()
