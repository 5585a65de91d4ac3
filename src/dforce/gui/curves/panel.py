"""The pane below the chart: tabs, each of them one :class:`Panel`; and the tab of advice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from dforce.gui.case.entry import QuietElement
from dforce.gui.curves.figures import Drawn, Layer
from dforce.gui.window.shown import Said
from dforce.results.curves import Picture

if TYPE_CHECKING:
    import xarray as xr

    from dforce.gui.window.view import View


@dataclass(frozen=True)
class Scene:
    """The content of the chart.

    Attributes
    ----------
    layers
        The results, the last on top.
    picture
        The quantities that are drawn; None for a map, or nothing.
    drawn
        The figure.
    """

    layers: Sequence[Layer] = ()
    picture: Picture | None = None
    drawn: Drawn = field(default_factory=lambda: Drawn({}))

    @property
    def result(self) -> xr.Dataset | None:
        """The result on top."""
        return self.layers[-1].result if self.layers else None


class Panel:
    """A tab of the pane.

    Attributes
    ----------
    title
        The name of the tab.
    in_sight
        Whether the tab is open; only then it is shown anything.
    open
        Opens the tab; set by the pane.
    """

    title = ""

    def __init__(self, view: View) -> None:
        self.view = view
        self.in_sight = False
        self.open: Callable[[], None] = lambda: None

    @property
    def label(self) -> str:
        """The text of the tab: its title, perhaps with a number."""
        return self.title

    def suits(self, scene: Scene) -> bool:
        """Return whether the tab is offered beside such a scene."""
        return True

    def make(self) -> None:
        """Make the elements, in the container that is open."""

    def show(self, scene: Scene | None = None) -> None:
        """Show the content for a scene; without one, other changes."""

    def close(self) -> None:
        """Take note that the tab is no longer in sight."""


NO_ADVICE = "No advice on this case."


class Pieces(QuietElement, component="pieces.js"):
    """The list of advice."""


class AdvicePanel(Panel):
    """The list; each piece is also at its field."""

    title = "Advice"

    @property
    def label(self) -> str:
        """The title with the count."""
        count = len(self.view.said.advice)
        return f"{self.title} {count}" if count else self.title

    def make(self) -> None:
        """Make the list, in the container that is open."""
        self.list = Pieces()
        self.view.on_said.append(self._said)
        self._said(self.view.said)

    def show(self, scene: Scene | None = None) -> None:
        """Show the advice."""
        self._said(self.view.said)

    def _said(self, said: Said) -> None:
        self.list.show(pieces=list(dict.fromkeys(text for _, text in said.advice)) or [NO_ADVICE])


class Pane:
    """The tabs and the panel in sight, in the container that is open when it is made."""

    def __init__(self, view: View, panels: Sequence[Panel]) -> None:
        self.panels, self.scene, self.session = panels, Scene(), view.session
        self.wanted = self.current = next((panel for panel in panels if panel.title == view.session.tab), panels[0])
        self.frames: dict[Panel, ui.element] = {}
        self.on_turn: list[Callable[[], None]] = []
        with ui.element("div").classes("df-pane"):
            tabs = ui.tabs(on_change=self._chosen)
            self.tabs = tabs.props('dense no-caps narrow-indicator align=left aria-label="beside the chart"')
            with self.tabs.classes("df-pane-tabs"):
                self.heads = {panel: ui.tab(panel.title) for panel in panels}
            for panel in panels:
                with ui.element("div").classes("df-pane-panel") as frame:
                    frame.props.update({"role": "tabpanel", "tabindex": "0", "aria-label": panel.title})
                    panel.make()
                panel.open = partial(self.open, panel)
                self.frames[panel] = frame
        view.on_said.append(lambda said: self._heads())
        view.on_job.append(self._heads)
        self._turn(self.current)
        self._heads()

    def open(self, panel: Panel) -> None:
        """Open a tab."""
        self.wanted = panel
        self.session.tab = panel.title
        self._turn(panel)
        panel.show(self.scene)

    def show(self, scene: Scene) -> None:
        """Show the tabs for a scene; the tab that was chosen last comes back once it suits again."""
        self.scene = scene
        self._turn(self.wanted if self.wanted.suits(scene) else next(one for one in self.panels if one.suits(scene)))
        self._heads()
        self.current.show(scene)

    def _chosen(self, event: ValueChangeEventArguments[Any]) -> None:
        panel = next((panel for panel in self.panels if panel.title == event.value), self.current)
        if panel is not self.current:
            self.open(panel)

    def _turn(self, panel: Panel) -> None:
        before, self.current = self.current, panel
        if before is not panel:
            before.in_sight = False
            before.close()
        panel.in_sight = True
        for other, frame in self.frames.items():
            frame.set_visibility(other is panel)
        self.tabs.set_value(panel.title)
        for hook in self.on_turn:
            hook()

    def _heads(self) -> None:
        for panel, head in self.heads.items():
            head.set_visibility(panel is self.current or panel.suits(self.scene))
            if head.props.get("label") != panel.label:
                head.props["label"] = panel.label
