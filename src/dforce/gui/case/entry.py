"""The elements of a form: one field, and one parameter on a slider."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from nicegui import ui
from nicegui.events import GenericEventArguments

LONGEST = 2000  # characters of a field
BETWEEN = 0.04  # s between two messages of a slider that is dragged


class Caption(NamedTuple):
    """Words for a field: `symbol` is HTML made by :func:`dforce.core.notation.html_symbol`, the others are text."""

    label: str
    symbol: str = ""
    help: str = ""


class Entry(ui.element, component="entry.js"):
    """One field: label, symbol, text or choice or switch, unit, error, advice and a button for a slider.

    Parameters
    ----------
    path
        Name of the parameter in the case, shown as help.
    caption
        Words for it.
    kind
        "text", "choice" or "switch".
    known
        Texts that are offered, such as the names of known media; others may be typed.
    on_typed
        Called with the text and the unit shown, as typed; a switch gives "true" or "false".
    on_unit
        Called with a unit that was chosen.
    on_slider
        Called when the slider's button is pressed; without it there is none.
    """

    def __init__(
        self,
        path: str,
        caption: Caption,
        *,
        on_typed: Callable[[str, str], None],
        kind: str = "text",
        known: Sequence[str] = (),
        numeric: bool = False,
        on_unit: Callable[[str], None] | None = None,
        on_slider: Callable[[], None] | None = None,
    ) -> None:
        super().__init__()
        self._ahead = False  # the browser was told a text that the page's own list of properties does not hold yet
        self.props.update(
            path=path,
            **caption._asdict(),
            kind=kind,
            known=list(known),
            numeric=numeric,
            slidable=on_slider is not None,
            longest=LONGEST,
        )

        def typed(event: GenericEventArguments) -> None:
            on_typed(str(event.args["text"])[:LONGEST], str(event.args["unit"])[:40])
            self.client.run_javascript(f"dforceUnsent.arrived({json.dumps(path)}, {int(event.args.get('number', 0))})")

        self.on("typed", typed)
        if on_unit is not None:
            self.on("unit", lambda event: on_unit(str(event.args)[:40]))
        if on_slider is not None:
            self.on("slider", lambda: on_slider())

    def show(self, **changed: Any) -> None:
        """Show other texts, units, options, an error, a note or advice; nothing is sent where nothing changed."""
        different = {key: value for key, value in changed.items() if self.props.get(key) != value}
        if set(different) <= {"text", "unit"} and "text" in self.props:
            with self.props.suspend_updates():
                self.props.update(different)
            if different:
                self._ahead = True
                self.run_method("take", self.props["text"], self.props.get("unit", ""))
        else:
            self.props.update(different)

    def settle(self) -> None:
        """Let the page know the text for good: a field that is not on show now takes it from there when it is."""
        if self._ahead:
            self._ahead = False
            self.update()


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
        self._there: float | None = None  # what the browser shows
        self._ahead = False  # the browser was told a value that the page's own list of properties does not hold yet

        def slide(event: GenericEventArguments) -> None:
            self._there = float(event.args)
            on_slide(self._there)

        self.on("slide", slide, throttle=BETWEEN)
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
        """Let the page know the value for good: a slider that is not on show now takes it from there when it is."""
        if self._ahead:
            self._ahead = False
            self.update()
