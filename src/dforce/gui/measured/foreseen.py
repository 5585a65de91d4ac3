"""What the range of a measured curve does not constrain, found before its fit."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING

from nicegui import background_tasks

import dforce as df
from dforce.gui.document.document import Document
from dforce.gui.measured import fitting

if TYPE_CHECKING:
    import xarray as xr

REST = 0.4  # s without a change before it is computed
BOTH = "approach and retract"


class Foreseen:
    """Sentences on the parameters that a fit would leave unconstrained, by their names.

    Parameters
    ----------
    look
        Called when there are others.
    """

    def __init__(self, look: Callable[[], None]) -> None:
        self.look = look
        self.sentences: dict[str, str] = {}
        self._asked: object = None

    def ask(self, document: Document, curve: xr.Dataset) -> None:
        """Find what the range of a curve does not constrain of a document's case; at once where it is known."""
        names = fitting.free_names(document)
        shift = document.measured.shift if document.measured is not None else 0.0
        asked = document.table, document.off, tuple(names), shift, document.measured and document.measured.id
        if asked == self._asked:
            return
        self._asked, self.sentences = asked, {}
        if names:
            background_tasks.create(self._find(asked, document, curve.assign_attrs(height_offset=shift), names))

    async def _find(self, asked: object, document: Document, curve: xr.Dataset, names: list[str]) -> None:
        await asyncio.sleep(REST)
        if asked != self._asked:
            return
        try:
            case = document.case()
            found = await asyncio.to_thread(_sentences, case, curve, names)
        except (df.DForceError, TypeError):  # a case that is being typed; a fit refuses with the same sentence
            return
        if asked == self._asked and found:
            self.sentences = found
            self.look()


def _sentences(case: df.Case, curve: xr.Dataset, names: list[str]) -> dict[str, str]:
    """Return why each parameter is not constrained. Blocking."""
    result = df.identify(case, curve, names, helps=False)
    both = {"approach", "retract"} <= set(curve["direction"].values.astype(str))
    return df.identify_in_words(result, curve=BOTH if both and BOTH in result["curve"].values else None)
