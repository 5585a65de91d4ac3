"""The picture that a command draws of its result."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import dforce as df
from dforce.cli._terminal import BAD_INPUT, DONE, INSIDE_ERROR, STOPPED, say
from dforce.core.files import check_target
from dforce.core.stopping import heard

if TYPE_CHECKING:
    from dforce.plot import Sheet


class Picture:
    """A picture of a result, drawn before the result is reported; an error in it waits for the report.

    Attributes
    ----------
    asked, file
        The file that was asked for, and the same once it is written.
    """

    def __init__(self, asked: Path | None, width: str | None = None, spare: Iterable[PathLike[str]] = ()) -> None:
        """Check what was asked for, before anything is computed."""
        if asked is not None:
            check_target(asked, df.plot.FORMATS, spare)
        if width is not None:
            if asked is None:
                raise df.ParameterError("--width needs a picture; also write --plot")
            df.plot.check_width(width)
        self.asked, self._width = asked, width
        self.file: Path | None = None
        self._error: BaseException | None = None

    def draw(self, function: Callable[[Sheet], object]) -> None:
        """Draw on a sheet by a function, and write it, where a picture was asked for."""
        if self.asked is not None:
            with self.attempt():
                df.plot.save(function(df.plot.Sheet()), self.asked, width=self._width)
                self.file = self.asked

    @contextlib.contextmanager
    def attempt(self) -> Iterator[None]:
        """Do what the picture needs; an error or a stop ends it, and waits."""
        try:
            yield
        except KeyboardInterrupt as stop:
            heard()
            self._error = stop
        except Exception as error:  # whatever it is, it must not hide the result  # noqa: BLE001
            self._error = error

    def code(self, code: int) -> int:
        """Return the exit code of a command from the one of its result."""
        if self._error is None:
            return code
        if isinstance(self._error, df.DForceError):  # a result without numbers has no picture either
            return code or BAD_INPUT
        return STOPPED if isinstance(self._error, KeyboardInterrupt) else INSIDE_ERROR

    def end(self, code: int) -> int:
        """Return the exit code as well, once the result is reported; raise an error that waits."""
        if self._error is not None and (code == DONE or not isinstance(self._error, df.DForceError)):
            raise self._error
        if self._error is not None:
            say(f"dforce: {self._error}")
        return code
