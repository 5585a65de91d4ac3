"""What was fitted to a thermal spectrum, as a tab."""

from __future__ import annotations

import dforce as df
from dforce.gui.curves.figures import Layer
from dforce.gui.curves.numbers import NumbersTable
from dforce.gui.curves.panel import Panel, Scene
from dforce.results.kinds import is_kind


class FitNumbers(Panel):
    """The table, a column for each spectrum that is drawn."""

    title = "Thermal tune"

    def suits(self, scene: Scene) -> bool:
        """Return whether a thermal spectrum is drawn."""
        return bool(_spectra(scene))

    def make(self) -> None:
        """Make the table, in the container that is open."""
        self.sheet = NumbersTable().classes("df-fit-numbers")
        self.sheet.props["label"] = "numbers of the fit"

    def show(self, scene: Scene | None = None) -> None:
        """Show what the thermal spectra among the results that are drawn say, a column each."""
        spectra = [] if scene is None else _spectra(scene)
        if not spectra:
            return
        found = [{one.label: one.text for one in df.summary(layer.result)} for layer in spectra]
        labels = dict.fromkeys(label for texts in found for label in texts)
        self.sheet.props.update(
            heads=["", *(layer.name for layer in spectra)] if len(spectra) > 1 else [],
            rows=[[label, *(texts.get(label, "–") for texts in found)] for label in labels],
        )
        self.sheet.update()


def _spectra(scene: Scene) -> list[Layer]:
    """Return the thermal spectra of a scene."""
    if scene.picture is None:
        return []
    return [layer for layer in scene.layers if is_kind(layer.result, "thermal_spectrum")]
