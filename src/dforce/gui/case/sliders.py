"""Parameters on sliders: the choice, their ranges, and the updates while a slider is dragged."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence

from nicegui import ui
from nicegui.events import GenericEventArguments

import dforce as df
from dforce.core.units import parse
from dforce.gui.case import values
from dforce.gui.case.fields import Field, name_of, within_sentence
from dforce.gui.document.document import LARGEST, MOST_SLIDERS, Path, Slider
from dforce.gui.window.view import View

STEPS = 200  # of a slider, about


def toggle(view: View, path: Path, field: Field) -> None:
    """Put a parameter on a slider, from half its value to twice that; or take it off."""
    document = view.document
    others = tuple(slider for slider in document.sliders if slider.path != path)
    if len(others) == len(document.sliders):
        value, unit = number_at(view, path, field)
        if value is None or not abs(value) <= LARGEST / 2.0:
            ui.notify("Type a value first; the slider then starts from it.")
            return
        if len(others) >= MOST_SLIDERS:
            ui.notify(f"At most {MOST_SLIDERS} sliders are possible.")
            return
        low, high = within(field, unit, min(0.5 * value, 2.0 * value), max(0.5 * value, 2.0 * value))
        others = (*others, Slider(path, low, high, unit))
    view.edit(dataclasses.replace(document, sliders=others))


def number_at(view: View, path: Path, field: Field) -> tuple[float | None, str]:
    """Return the number at a path in the unit that its field shows, None where it shows none, and that unit."""
    value = view.document.value(path)
    text, unit = values.shown(field, field.default if value is None else value)
    try:
        return _number(text), unit
    except (ValueError, df.ParameterError):
        return None, unit


def _number(text: str) -> float:
    """Return a typed number; a number beyond any slider is a ValueError."""
    number = float(values.with_point(text))
    if not abs(number) <= LARGEST:
        raise ValueError("a number out of bounds")
    return number


def within(field: Field, unit: str, low: float, high: float) -> tuple[float, float]:
    """Return a range that is not empty and keeps to the bounds of the parameter."""
    if not low < high:
        high = low + (abs(low) or 1.0)
    if field.quantity is not None:
        scale = parse(f"1 {unit}", field.unit) if unit != "1" else 1.0
        least, most = (bound / scale for bound in field.quantity.bounds())
        if least > low or (field.quantity.above is not None and least >= low):
            low = least
            high = max(high, low + (abs(low) or 1.0)) if high <= low else high
            low += step_of(low, min(high, most)) if field.quantity.above is not None else 0.0
        high = min(high, most)
        if not low < high:  # both ends were typed beyond the bound
            low = max(least, high - 0.5 * abs(high))
    return _tidy(low), _tidy(high)


def ends_of(slider: Slider, field: Field, unit: str) -> tuple[float, float]:
    """Return the ends of a slider in the unit that its field shows now."""
    ends = slider.low, slider.high
    if slider.unit in ("", unit):
        return ends
    low, high = (float(values.in_unit(repr(end), slider.unit, unit, field.unit)) for end in ends)
    return low, high


def step_of(low: float, high: float) -> float:
    """Return a round step, 1, 2 or 5 times a power of ten, of which about 200 make the range."""
    raw = (high - low) / STEPS
    power = 10.0 ** math.floor(math.log10(raw)) if raw > 0.0 else 1.0
    return next(n * power for n in (1.0, 2.0, 5.0, 10.0) if n * power >= raw * 0.999)


def _tidy(value: float) -> float:
    return float(f"{value:.9g}")


class SliderElement(ui.element, component="slider.js"):
    """A parameter on a slider.

    Parameters
    ----------
    on_slide
        Called with the number while the slider is dragged, at most 25 times a second, and with the last one.
    on_range
        Called with the two ends as typed.
    """

    def __init__(
        self, path: str, label: str, *, on_slide: Callable[[float], None], on_range: Callable[[Sequence[str]], None]
    ) -> None:
        super().__init__()
        self.props.update(path=path, label=label)
        self._there: float | None = None  # the value in the browser
        self._ahead = False  # the browser has a value that the page's own list of properties does not contain yet

        def slide(event: GenericEventArguments) -> None:
            self._there = float(event.args)
            on_slide(self._there)

        self.on("slide", slide)
        self.on("range", lambda event: on_range([str(end)[:40] for end in event.args]))

    def show(self, unit: str, low: float, high: float, step: float, given: float) -> None:
        """Show a range and a value."""
        changed = {"unit": unit, "low": low, "high": high, "step": step, "given": given}
        different = {key for key, value in changed.items() if self.props.get(key) != value}
        if different == {"given"}:
            with self.props.suspend_updates():
                self.props.update(changed)
            self._ahead = True
            if given != self._there:
                self.run_method("take", given)
        elif different:
            self.props.update(changed)
        self._there = given

    def settle(self) -> None:
        """Write the value to the page: a hidden slider takes it from there when it is shown."""
        if self._ahead:
            self._ahead = False
            self.update()


class Sliders:
    """The sliders of a page, each at the field of its parameter; see :class:`dforce.gui.case.entry.Companion`."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.places: dict[Path, tuple[Field, ui.element]] = {}
        self.made: dict[Path, SliderElement] = {}
        view.on_said.append(lambda said: self.settle())

    def clear(self) -> None:
        """Forget all fields: they are made anew."""
        self.places.clear()
        self.made.clear()

    def place(self, path: Path, field: Field) -> None:
        """Make room for the slider of a field, in the container that is open."""
        self.places[path] = field, ui.element("div")

    def show(self) -> None:
        """Show the sliders of the document, their ranges and values; a value beyond its range makes that wider."""
        sliders = {slider.path: slider for slider in self.view.document.sliders if slider.path in self.places}
        for path in [path for path in self.made if path not in sliders]:
            self.made.pop(path).delete()
        for path, slider in sliders.items():
            field, place = self.places[path]
            if path not in self.made:
                with place:
                    self._make(path, field)
            value, unit = number_at(self.view, path, field)
            if value is not None:
                low, high = ends_of(slider, field, unit)
                if not low <= value <= high:
                    low, high = within(field, unit, min(low, value), max(high, value))
                step = 1.0 if field.shapes[0].kind == "whole" else step_of(low, high)
                self.made[path].show(unit, low, high, step, value)

    def settle(self) -> None:
        """Write the values to the page: a hidden slider takes them from there when it is shown."""
        for element in self.made.values():
            element.settle()

    def _make(self, path: Path, field: Field) -> None:
        self.made[path] = SliderElement(
            ".".join(map(str, path)),
            self._label(path, field),
            on_slide=lambda value: self._slide(path, field, value),
            on_range=lambda ends: self._range(path, field, ends),
        )

    def _label(self, path: Path, field: Field) -> str:
        """Return the label of a slider; with several modes, tones or forces it names the one."""
        places = [n for n, step in enumerate(path) if isinstance(step, int)]
        if not places:
            return field.label
        listed, place = path[: places[-1]], int(path[places[-1]])
        if len(self.view.document.value(listed) or ()) < 2:
            return field.label
        model = df.forces.REGISTRY.get(str(self.view.document.value((*listed, place, "model"))))
        owner = name_of(model) if model is not None else f"{str(listed[-1]).removesuffix('s').capitalize()} {place + 1}"
        return f"{owner}: {within_sentence(field.label)}"

    def _slide(self, path: Path, field: Field, value: float) -> None:
        unit = number_at(self.view, path, field)[1]
        text: str | int = f"{value:.9g}" if unit in ("1", "") else f"{value:.9g} {unit}"
        if field.shapes[0].kind == "whole":
            text = round(value)
        elif field.quantity is None:
            self.view.edit(self.view.document.put(path, value), name=f"slide {path}")
            return
        self.view.edit(self.view.document.put(path, text), name=f"slide {path}")

    def _range(self, path: Path, field: Field, ends: Sequence[str]) -> None:
        unit = number_at(self.view, path, field)[1]
        try:
            low, high = map(_number, ends)
        except (ValueError, df.ParameterError):
            ui.notify("The ends of a slider are two numbers.")
            low, high = next(ends_of(s, field, unit) for s in self.view.document.sliders if s.path == path)
        low, high = within(field, unit, min(low, high), max(low, high))
        sliders = tuple(
            dataclasses.replace(slider, low=low, high=high, unit=unit) if slider.path == path else slider
            for slider in self.view.document.sliders
        )
        self.view.edit(dataclasses.replace(self.view.document, sliders=sliders))
