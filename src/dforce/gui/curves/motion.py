"""The motion at a point that was clicked: traces, and the tip above the sample."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui

import dforce as df
from dforce.core.notation import html_symbol
from dforce.findings.set_point import regime
from dforce.gui.curves.chart import unit_of
from dforce.gui.curves.figures import Layer
from dforce.gui.curves.other_figures import LEAST_PART
from dforce.gui.curves.panel import Panel, Scene
from dforce.gui.document.compute import LIVE, in_thread
from dforce.gui.window.shown import PagePart
from dforce.results.curves import pictures_of
from dforce.results.dataset import reader_unit

if TYPE_CHECKING:
    import xarray as xr

    from dforce.gui.document.document import Document
    from dforce.gui.window.shown import DrawnResult

PATIENCE = 10.0  # s; a motion that takes longer to settle is given up
MOST_SAMPLES = 4000  # that are sent; more are not seen
DIGITS = 5
TOO_LONG = "This motion takes too long to settle here; run a dwell at this distance."


class Drawing(ui.element, component="motion.js"):
    """The drawing and the traces."""


@dataclass(frozen=True)
class Spot:
    """A point of a result: the places along its dimensions, and the document of the curve that it follows.

    Without a document it is a point of a result that is kept.
    """

    result: xr.Dataset
    places: dict[str, int]
    document: Document | None


class MotionPanel(Panel):
    """Shows the motion at a point that was clicked; while it is behind, the animation stops."""

    title = "Motion"

    def make(self) -> None:
        """Make the drawing, in the container that is open."""
        self.shown = self.view.shown
        self.element = Drawing()
        self.spot: Spot | None = None
        self._latest = self.view.latest(self._compute)
        self.shown.mark(PagePart.MOTION, self._stand)

    def suits(self, scene: Scene) -> bool:
        """Return whether something with motions is drawn."""
        return self.spot is not None or (scene.result is not None and "amplitude" in scene.result)

    def _stand(self, behind: bool) -> None:
        self.element.props["behind"] = behind

    def take(self, layer: Layer, places: dict[str, int], document: Document | None) -> None:
        """Show the motion at a point of a result; with a document, of the curve that follows it."""
        motionless = {dim: place for dim, place in places.items() if dim in layer.result["amplitude"].dims}
        self.spot = Spot(layer.result, motionless, document)
        self.open()

    def show(self, scene: Scene | None = None) -> None:
        """Show the motion of the point that was chosen last."""
        if self.spot is not None and self.element.props.get("motion") is None:
            self._latest.ask(self.spot)

    def close(self) -> None:
        """Stop the animation: the motion is out of sight."""
        self.element.props.update(motion=None, state="")
        self.shown.show(PagePart.MOTION, None)

    def _forget(self) -> None:
        self.spot = None
        self.element.props.update(places=[], note="", error="")
        self.close()

    def follow(self, curve: DrawnResult | None, layers: Sequence[Layer]) -> None:
        """Show the motion at the same place of the curve that follows the fields.

        It is closed where that has no such place, and with the result that is kept where that is no longer drawn.
        """
        spot = self.spot
        if spot is None or (curve is not None and curve.result is spot.result):
            return
        if spot.document is None:
            if all(layer.result is not spot.result for layer in layers):
                self._forget()
            return
        places = _same_places(spot, curve.result) if curve is not None else None
        if curve is None or places is None:
            self._forget()
            return
        self.spot = Spot(curve.result, places, curve.document)
        if self.in_sight:
            self._latest.ask(self.spot)

    def place_in(self, result: xr.Dataset) -> xr.Dataset | None:
        """Return the point of a result that was clicked, or lies where a point of an earlier curve was; None without one."""
        spot = self.spot
        if spot is None or (spot.document is None and spot.result is not result):
            return None
        places = spot.places if spot.result is result else _same_places(spot, result)
        return None if places is None else result.isel(places)

    async def _compute(self, spot: Spot) -> None:
        point = spot.result.isel(spot.places)
        shown: dict[str, Any] = {"places": _places(point), "note": "", "error": "", "motion": None, "state": "done"}
        begun = time.monotonic()

        def report_progress(done: int, total: int, note: str) -> None:
            if self._latest.overtaken or time.monotonic() - begun > PATIENCE:
                raise KeyboardInterrupt

        try:
            motion = await in_thread(LIVE, lambda: _given_up(point, report_progress))
            if motion is None:
                shown["error"] = TOO_LONG
            else:
                shown |= {"note": str(motion.attrs["note"]), "motion": _plain(motion)}
        except df.DForceError as error:
            shown["error"] = _sentence(str(error))
        if not self._latest.overtaken and self.spot is spot and self.in_sight:
            self.element.props.update(shown)
            self.element.update()
            self.shown.show(PagePart.MOTION, spot.document)


def _same_places(spot: Spot, result: xr.Dataset) -> dict[str, int] | None:
    """Return where the point of another result is that lies at the same place; None where there is none."""
    places: dict[str, int] = {}
    for dim, place in spot.places.items():
        if "amplitude" not in result or dim not in result["amplitude"].dims or dim == "point":
            return None
        there = spot.result[dim].values[place]
        if result[dim].dtype.kind == "f":
            places[dim] = int(np.argmin(np.abs(result[dim].values - there)))
        else:
            places[dim] = min(place, result.sizes[dim] - 1)
    return places


def _given_up(point: xr.Dataset, report_progress: Any) -> xr.Dataset | None:
    try:
        return df.motion_at(point, report_progress)
    except KeyboardInterrupt:  # must not leave the thread, whose end it would be
        return None


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}."


def _places(point: xr.Dataset) -> list[dict[str, str]]:
    """Return where a point is: symbols with values, the direction, and which state it is."""
    along = str(point.attrs.get("along", "zc"))
    names = dict.fromkeys(["zc", along, "frequency", "direction", "state"])
    there = [point[name] for name in names if name in point.coords and point[name].ndim == 0]
    found = [{"symbol": html_symbol(str(one.attrs.get("symbol", ""))), "text": _text(one)} for one in there]
    return found + [{"symbol": "", "text": f"{word} state"} for word in (regime(point),) if word]


def _text(variable: xr.DataArray) -> str:
    if variable.dtype.kind != "f":
        words = str(variable.values)
        return words if variable.dtype.kind == "U" else f"{variable.attrs.get('long_name', variable.name)} {words}"
    scale, unit = reader_unit(variable)
    return f"{float(variable) / scale:.4g}{'' if unit == '1' else f' {unit}'}"


def _plain(motion: xr.Dataset) -> dict[str, Any]:
    """Return the data of the drawing, as plain numbers in the units shown."""
    stride = -(-motion.sizes["time"] // MOST_SAMPLES)
    seen = motion.isel(time=slice(None, None, stride))
    length, length_unit = unit_of(motion["distance"])
    force, force_unit = unit_of(motion["force"])
    time_scale, time_unit = unit_of(motion["time"])
    gap = (seen["distance"].values - float(motion.attrs["a0"])) / length
    values = seen["force"].values / force
    return {
        "traces": [_trace(motion[name], seen[name]) for name in pictures_of(motion)[0].y],
        "parts": _parts(seen, force),
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


def _parts(seen: xr.Dataset, scale: float) -> list[dict[str, Any]]:
    """Return the parts of the force where there are several, in its unit."""
    found = [one for one in seen["force_part"] if float(np.abs(one).max()) > LEAST_PART * scale]
    parts = [{"name": str(one["interaction"].values), "values": _short(one.values / scale)} for one in found]
    return parts if len(parts) > 1 else []


def _trace(whole: xr.DataArray, seen: xr.DataArray) -> dict[str, Any]:
    scale, unit = unit_of(whole)
    values = seen.values / scale
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    return {
        "name": str(whole.name),
        "label": str(whole.attrs.get("long_name", whole.name)),
        "symbol": html_symbol(str(whole.attrs.get("symbol", ""))),
        "unit": unit,
        "values": _short(values),
        "low": low,
        "high": high if high > low else low + 1.0,
    }


def _short(values: Any) -> list[float]:
    return [float(f"{value:.{DIGITS}g}") for value in values]
