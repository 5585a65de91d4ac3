"""Parts of a page: the document of each, which parts are behind, and the words between them."""

from __future__ import annotations

import asyncio
import dataclasses
import enum
import time
from collections import defaultdict
from collections.abc import Callable
from typing import TYPE_CHECKING

import dforce as df
from dforce.gui.case.fields import in_words, with_labels
from dforce.gui.document.document import Document, Path, path_of

if TYPE_CHECKING:
    import xarray as xr


class PagePart(enum.Enum):
    """A part of a page that shows results; its value: seconds that it may be behind before it is marked.

    While something is dragged, the parts beside the curves are updated twice a second, and the advice at the end.
    """

    CURVES = "curves", 0.3
    BESIDE = "the table at the set point, the numbers and the differences", 0.8
    MOTION = "the motion", 0.8
    FORCE = "the force curve", 0.8
    ADVICE = "the advice", 0.8

    @property
    def patience(self) -> float:
        """The seconds that it may be behind."""
        return self.value[1]


class ShownParts:
    """Remembers the document of each part of a page; a part of another case than the current input is behind.

    Parameters
    ----------
    current
        Function that returns the current document.
    """

    def __init__(self, current: Callable[[], Document]) -> None:
        self._current = current
        self._of: dict[PagePart, Document] = {}
        self._since: dict[PagePart, float] = {}  # when parts that are behind fell behind
        self._marked: set[PagePart] = set()
        self._marks: defaultdict[PagePart, list[Callable[[bool], object]]] = defaultdict(list)
        self._timer: asyncio.TimerHandle | None = None

    def mark(self, part: PagePart, mark: Callable[[bool], object]) -> None:
        """Have a function called with True when a part is behind for too long, and with False when it is no more."""
        self._marks[part].append(mark)

    def of(self, part: PagePart) -> Document | None:
        """Return the document of a part, None where it shows nothing."""
        return self._of.get(part)

    def show(self, part: PagePart, document: Document | None) -> None:
        """Take note that a part now shows something of a document; None: nothing, or nothing that follows one."""
        self._since.pop(part, None)
        self._of.pop(part, None)
        if document is not None:
            self._of[part] = document
        self.look()

    def look(self) -> None:
        """Mark the parts that are behind for too long, and look again when the next one may be."""
        now, current = time.monotonic(), self._current()
        behind = [part for part, document in self._of.items() if not document.same_case(current)]
        self._since = {part: self._since.get(part, now) for part in behind}
        left = {part: since + part.patience - now for part, since in self._since.items()}
        marked = {part for part in behind if left[part] <= 0.0}
        changed, self._marked = marked ^ self._marked, marked
        self.end()
        waiting = [left[part] for part in behind if part not in marked]
        if waiting:
            self._timer = asyncio.get_running_loop().call_later(min(waiting), self.look)
        for part in changed:
            for mark in self._marks[part]:
                mark(part in marked)

    def end(self) -> None:
        """Look no more by itself."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


@dataclasses.dataclass(frozen=True)
class Said:
    """The messages on a document: the error, its place, and the advice on its case."""

    wrong: str = ""
    where: Path = ()
    advice: tuple[tuple[Path, str], ...] = ()

    @classmethod
    def of_error(cls, document: Document, error: Exception) -> Said:
        """Return the fault of a document in the words of its forms, with its place."""
        return cls(in_words(document, str(error)), path_of(document, str(error)))

    @classmethod
    def of_advice(cls, document: Document, advice: list[df.Advice]) -> Said:
        """Return each piece of advice with the path of the first field that it is about."""
        return cls(
            advice=tuple(
                (
                    next(filter(None, (path_of(document, name) for name in piece.about)), ()),
                    with_labels(document, piece.text),
                )
                for piece in advice
            )
        )


@dataclasses.dataclass(frozen=True)
class Waiting:
    """Text of an empty chart: a sentence, and the share that is done (0: not known yet, None: nothing runs)."""

    text: str = ""
    share: float | None = None


@dataclasses.dataclass(frozen=True)
class DrawnResult:
    """A result, and the document whose case it is of."""

    document: Document
    result: xr.Dataset


@dataclasses.dataclass(frozen=True)
class WantedResult:
    """The content of a page: the curve that follows a document, or a result of its case.

    Attributes
    ----------
    run
        Whether it is run where a live curve takes too long.
    again
        Whether it was given up before.
    """

    document: Document
    result: xr.Dataset | None = None
    run: bool = False
    again: bool = False


@dataclasses.dataclass(frozen=True)
class Followed:
    """A document whose live curve was computed: its case, and its result unless that takes too long."""

    document: Document
    case: df.Case
    result: xr.Dataset | None
