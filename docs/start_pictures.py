"""Pictures of the questions on the first page of the window, drawn from shipped results: python docs/start_pictures.py."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np

import dforce as df
from dforce.core.arrays import Array

FOLDER = Path(df.__file__).parent / "gui" / "window" / "pictures"
WIDTH, HEIGHT, EDGE = 200, 100, 8
MODEL, DATA, LIMIT = "#0072b2", "#b8480a", "#7a8794"
Line = tuple[Array, Array]


def scaled(lines: list[Line]) -> list[Line]:
    """Return lines that fill the picture together."""
    (x0, x1), (y0, y1) = (
        (min(np.nanmin(line[n]) for line in lines), max(np.nanmax(line[n]) for line in lines)) for n in (0, 1)
    )
    return [
        (EDGE + (WIDTH - 2 * EDGE) * (x - x0) / (x1 - x0), HEIGHT - EDGE - (HEIGHT - 2 * EDGE) * (y - y0) / (y1 - y0))
        for x, y in lines
    ]


def path(line: Line, color: str = MODEL, more: str = "") -> str:
    """Return a line of the picture; points that are none are left out."""
    there = np.isfinite(line[0]) & np.isfinite(line[1])
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in zip(line[0][there], line[1][there], strict=True))
    return f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="2.5" {more}/>'


def dots(line: Line) -> str:
    """Return measured points."""
    return "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2" fill="{DATA}"/>' for x, y in zip(*line, strict=True))


def approach(name: str, quantity: str, **changed: str) -> list[Line]:
    """Return a quantity of an example over the distance, a line for each direction."""
    case = df.example(name)
    for key, value in changed.items():
        case = case.replace(key.replace("__", "."), value)
    result = df.run(case)
    values = result[quantity].transpose(..., "zc").values.reshape(-1, result.sizes["zc"])
    return [(result["zc"].values, row) for row in values]


def curve() -> str:
    """Draw the shipped measured curve of a stiff sample."""
    rows = np.loadtxt((files("dforce.library") / "measured" / "stiff.csv").read_text().splitlines(), delimiter=",")
    x, phase = scaled([(rows[:, 0], rows[:, 2])])[0]
    return dots((x[::2], phase[::2]))


def safe() -> str:
    """Draw the indentation of a soft sample, and a limit."""
    zc, depth = approach("figure-4-soft", "max_indentation")[0]
    line, limit = scaled([(zc, depth), (zc, np.full_like(depth, 0.5 * np.nanmax(depth)))])
    return path(limit, LIMIT, 'stroke-dasharray="6 5"') + path(line)


def states() -> str:
    """Draw the phase on the way in and out."""
    there, back = scaled(approach("hysteresis", "phase"))
    return path(back, MODEL, 'opacity="0.5"') + path(there)


def bimodal() -> str:
    """Draw the deflection of two modes."""
    result = df.run(df.example("figure-6"))
    deflection = result["deflection"].values.ravel()[:600]
    return path(scaled([(np.arange(600.0), deflection)])[0])


def thermal() -> str:
    """Draw the spectral density of the shipped thermal motion."""
    rows = np.genfromtxt(files("dforce.library") / "measured" / "thermal.csv", delimiter=",", skip_header=1)
    rows = rows[np.isfinite(rows).all(axis=1) & (rows > 0.0).all(axis=1)]
    return path(scaled([(rows[:, 0], np.log10(rows[:, 1]))])[0], DATA)


def class_() -> str:
    """Draw the amplitude at three free amplitudes."""
    lines = scaled([approach("hysteresis", "amplitude", drive__A0=f"{A0} nm")[0] for A0 in (12, 16, 20)])
    return "".join(path(line, MODEL, f'opacity="{0.4 + 0.3 * n:.1f}"') for n, line in enumerate(lines))


def main() -> None:
    """Write the pictures."""
    FOLDER.mkdir(exist_ok=True)
    for draw in (curve, safe, states, bimodal, thermal, class_):
        text = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}">{draw()}</svg>\n'
        (FOLDER / f"{draw.__name__.rstrip('_')}.svg").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
