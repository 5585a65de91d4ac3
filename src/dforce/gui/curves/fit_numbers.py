"""What was fitted to a thermal spectrum, as a table below its picture."""

from __future__ import annotations

from collections.abc import Sequence

import dforce as df
from dforce.gui.curves.figures import Layer
from dforce.gui.curves.numbers import NumbersTable
from dforce.results.curves import Picture
from dforce.results.kinds import is_kind


class FitNumbers:
    """The table, in the container that is open when it is made."""

    def __init__(self) -> None:
        self.sheet = NumbersTable().classes("df-fit-numbers")
        self.sheet.props["label"] = "numbers of the fit"
        self.sheet.set_visibility(False)

    def show(self, layers: Sequence[Layer], wanted: Picture | None) -> None:
        """Show what the thermal spectra among the results that are drawn say, a column each."""
        spectra = [layer for layer in layers if wanted is not None and is_kind(layer.result, "thermal_spectrum")]
        self.sheet.set_visibility(bool(spectra))
        if not spectra:
            return
        found = [{one.label: one.text for one in df.summary(layer.result)} for layer in spectra]
        labels = dict.fromkeys(label for texts in found for label in texts)
        self.sheet.props.update(
            heads=["", *(layer.name for layer in spectra)] if len(spectra) > 1 else [],
            rows=[[label, *(texts.get(label, "–") for texts in found)] for label in labels],
        )
        self.sheet.update()
