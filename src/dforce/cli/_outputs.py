"""The files that a command makes of its result."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterable, Iterator
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import dforce as df
from dforce.cli._terminal import DONE, exit_code, say
from dforce.core.files import check_target, in_quotes
from dforce.core.stopping import heard

if TYPE_CHECKING:
    import xarray as xr

    from dforce.plot import Sheet


class Outputs:
    """The files of a result, written before the result is reported; an error in one waits for the report.

    Attributes
    ----------
    picture
        The file of the picture, once it is written.
    written
        The names of all files, once they are.
    """

    def __init__(
        self,
        asked: Path | None = None,
        width: str | None = None,
        *,
        output: Path | None = None,
        spare: Iterable[PathLike[str]] = (),
    ) -> None:
        """Check the picture and the file that were asked for, before anything is computed; neither replaces a file to spare."""
        if output is not None:
            check_target(output, spare=spare)
        if asked is not None:
            check_target(asked, df.plot.FORMATS, spare)
        if width is not None:
            if asked is None:
                raise df.ParameterError("--width needs a picture; also write --plot")
            df.plot.check_width(width)
        self._asked, self._width = asked, width
        self.picture: Path | None = None
        self.written: list[str] = []
        self._error: BaseException | None = None
        self._lost = False

    def keep(self, result: xr.Dataset, output: Path | None) -> None:
        """Write a result where a file was asked for."""
        if output is not None:
            self.write(lambda: df.write(result, output), result)

    def write(self, function: Callable[[], Path], result: xr.Dataset) -> Path | None:
        """Write a result by a function; return its file, None where there is none."""
        path = None
        with self.attempt():
            path = function()
            self.written.append(str(path))
        self._lost = path is None
        if isinstance(self._error, df.ResultError):
            self._error = _rescued(result, self._error)
        return path

    def draw(self, function: Callable[[Sheet], object]) -> None:
        """Draw on a sheet by a function, and write it, where a picture was asked for."""
        if self._asked is not None:
            with self.attempt():
                df.plot.save(function(df.plot.Sheet()), self._asked, width=self._width)
                if self.picture is None:  # else it is drawn anew
                    self.written.append(str(self._asked))
                self.picture = self._asked

    @contextlib.contextmanager
    def attempt(self) -> Iterator[None]:
        """Work on a file inside; an error or a stop ends the work, and is raised later."""
        try:
            yield
        except KeyboardInterrupt as stop:
            heard()
            self._error = self._error or stop
        except Exception as error:  # no error may hide the result  # noqa: BLE001
            self._error = self._error or error

    def code(self, code: int) -> int:
        """Return the exit code of a command from the one of its result."""
        if self._error is None or self._is_told_by(code):
            return code
        return exit_code(self._error)

    def end(self, code: int) -> int:
        """Return the exit code as well, once the result is reported; raise an error that waits."""
        if self._error is None:
            return code
        if not self._is_told_by(code):
            raise self._error
        say(f"dforce: {self._error}")
        return code

    def _is_told_by(self, code: int) -> bool:
        """Return whether the exit code of the result explains the missing picture: the result lacks numbers, too."""
        return code != DONE and not self._lost and isinstance(self._error, df.DForceError)


def _rescued(result: xr.Dataset, error: df.ResultError) -> df.ResultError:
    """Write a result without a place to the folder for temporary files; return the error with the new path."""
    place = Path(tempfile.mkdtemp(prefix="dforce-"))
    try:
        kept = df.write(result, place / "result.nc")
    except OSError:  # no room there either
        place.rmdir()
        return error
    return df.ResultError(f"{error}; the result is in {in_quotes(kept)} instead, so move it from there")
