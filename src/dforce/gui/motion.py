"""The motion at a point that was clicked: traces, and the tip above the sample."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui

import dforce as df
from dforce.gui.compute import LIVE, Latest, in_thread
from dforce.gui.figures import Layer, unit_of

if TYPE_CHECKING:
    import xarray as xr

PATIENCE = 10.0  # s; a motion that takes longer to settle is given up
MOST_SAMPLES = 4000  # that are sent; more are not seen
DIGITS = 5
TOO_LONG = "This motion takes too long to settle; run a dwell at this distance instead."


class Drawing(ui.element, component="motion.js"):
    """The drawing and the traces."""


@dataclass(frozen=True)
class Spot:
    """A point of a result: the places along its dimensions, and whether it is of the curve that follows the fields."""

    result: xr.Dataset
    places: dict[str, int]
    name: str
    follows: bool


class MotionPanel:
    """Shows the motion at a point; hidden until one is clicked."""

    def __init__(self) -> None:
        self.element = Drawing()
        self.element.set_visibility(False)
        self.element.on("close", self.close)
        self.spot: Spot | None = None
        self._latest = Latest(self._compute)

    def open(self, layer: Layer, places: dict[str, int], follows: bool) -> None:
        """Show the motion at a point of a result."""
        motionless = {dim: place for dim, place in places.items() if dim in layer.result["amplitude"].dims}
        self.spot = Spot(layer.result, motionless, layer.name, follows)
        self.element.set_visibility(True)
        self._latest.ask(self.spot)

    def close(self) -> None:
        """Hide it."""
        self.spot = None
        self.element.props["motion"] = None  # what is not seen need not move
        self.element.set_visibility(False)

    def follow(self, result: xr.Dataset | None) -> None:
        """Show the motion at the same place of the curve that follows the fields, or nothing where it has no such place."""
        spot = self.spot
        if spot is None or not spot.follows or result is None or result is spot.result:
            return
        places: dict[str, int] = {}
        for dim, place in spot.places.items():
            if "amplitude" not in result or dim not in result["amplitude"].dims or dim == "point":
                self.close()
                return
            there = spot.result[dim].values[place]
            if result[dim].dtype.kind == "f":
                places[dim] = int(np.argmin(np.abs(result[dim].values - there)))
            else:
                places[dim] = min(place, result.sizes[dim] - 1)
        self.spot = Spot(result, places, spot.name, True)
        self._latest.ask(self.spot)

    async def _compute(self, spot: Spot) -> None:
        point = spot.result.isel(spot.places)
        shown: dict[str, Any] = {"places": _places(point), "note": "", "error": "", "motion": None, "state": "done"}
        begun = time.monotonic()

        def watch(done: int, total: int, note: str) -> None:
            if self._latest.overtaken or time.monotonic() - begun > PATIENCE:
                raise KeyboardInterrupt

        try:
            motion = await in_thread(LIVE, lambda: _given_up(point, watch))
            if motion is None:
                shown["error"] = TOO_LONG
            else:
                shown |= {"note": str(motion.attrs["note"]), "motion": _plain(motion)}
        except df.DForceError as error:
            shown["error"] = _sentence(str(error))
        if not self._latest.overtaken and self.spot is spot:
            self.element.props.update(shown)
            self.element.update()


def _given_up(point: xr.Dataset, watch: Any) -> xr.Dataset | None:
    try:
        return df.motion_at(point, watch)
    except KeyboardInterrupt:  # must not leave the thread, whose end it would be
        return None


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}."


def _places(point: xr.Dataset) -> list[dict[str, str]]:
    """Return where a point is: symbols with values, the direction, and which state it is."""
    along = str(point.attrs.get("along", "zc"))
    names = dict.fromkeys(["zc", along, "frequency", "direction", "state"])
    there = [point[name] for name in names if name in point.coords and point[name].ndim == 0]
    found = [{"symbol": df.html_symbol(str(one.attrs.get("symbol", ""))), "text": _text(one)} for one in there]
    return found + [{"symbol": "", "text": f"{word} state"} for word in (df.regime(point),) if word]


def _text(variable: xr.DataArray) -> str:
    if variable.dtype.kind != "f":
        words = str(variable.values)
        return words if variable.dtype.kind == "U" else f"{variable.attrs.get('long_name', variable.name)} {words}"
    scale, unit = df.reader_unit(variable)
    return f"{float(variable) / scale:.4g}{'' if unit == '1' else f' {unit}'}"


def _plain(motion: xr.Dataset) -> dict[str, Any]:
    """Return what the drawing needs, as plain numbers in the units shown."""
    stride = -(-motion.sizes["time"] // MOST_SAMPLES)
    seen = motion.isel(time=slice(None, None, stride))
    length, length_unit = unit_of(motion["distance"])
    force, force_unit = unit_of(motion["force"])
    time_scale, time_unit = unit_of(motion["time"])
    gap = (seen["distance"].values - float(motion.attrs["a0"])) / length
    values = seen["force"].values / force
    return {
        "traces": [_trace(motion[name], seen[name]) for name in df.pictures_of(motion)[0].y],
        "gap": _short(gap),
        "force": _short(values),
        "peak": float(np.abs(values).max()),
        "deepest": float(motion["indentation"].max()) / length,
        "rest": (float(motion["zc"]) - float(motion.attrs["a0"])) / length,
        "radius": float(motion.attrs.get("tip_radius", 0.0)) / length,
        "length": length_unit,
        "forceUnit": force_unit,
        "time": time_unit,
        "step": float(seen["time"][1]) / time_scale,
        "second": time_scale,
        "periods": int(motion.attrs["periods"]),
    }


def _trace(whole: xr.DataArray, seen: xr.DataArray) -> dict[str, Any]:
    scale, unit = unit_of(whole)
    values = seen.values / scale
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    return {
        "name": str(whole.name), "label": str(whole.attrs.get("long_name", whole.name)),
        "symbol": df.html_symbol(str(whole.attrs.get("symbol", ""))), "unit": unit, "values": _short(values), "low": low,
        "high": high if high > low else low + 1.0,
    }  # fmt: skip


def _short(values: Any) -> list[float]:
    return [float(f"{value:.{DIGITS}g}") for value in values]
