"""Files from outside: which kind each is, its content, once that has been written again and drawn, and the last ones."""

from __future__ import annotations

import base64
import contextlib
import datetime
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import dforce as df
from dforce.core.errors import shorten
from dforce.core.files import in_quotes, read_input, write_whole
from dforce.core.toml import LONGEST, read_toml
from dforce.gui.curves import figures, setpoint
from dforce.gui.curves.other_figures import basins
from dforce.gui.document.document import LONGEST_NAME, MOST_QUANTITIES, PLUGINS, Document
from dforce.gui.document.store import name_of, why
from dforce.gui.measured import fitting, overlay, reconstruction
from dforce.gui.measured.reading import calibrated
from dforce.gui.study import explore, pictures
from dforce.gui.study.explore import is_explorable
from dforce.inverse.readers import endings
from dforce.results import hdf5
from dforce.results.curves import Picture, drawable, pictures_of
from dforce.results.kinds import is_kind
from dforce.results.kinds import kind_of as kind_of_result
from dforce.results.measured import by_model

if TYPE_CHECKING:
    import xarray as xr

Kind = Literal["case", "result", "project", "measured"]

MOST_BYTES = 50_000_000  # of a file
ZIP = b"PK\x03\x04"


def kind_of(data: bytes, name: str = "") -> Kind:
    """Return the kind of a file by its content; if it may be a measured curve as well, by the ending of its name."""
    may_be_measured = name.lower().endswith(endings())
    if data.startswith(hdf5.START):
        return "measured" if may_be_measured else "result"
    if data.startswith(ZIP):
        return "project"
    return "measured" if may_be_measured and not _is_toml(data) else "case"


def _is_toml(data: bytes) -> bool:
    try:
        return len(data) <= LONGEST and bool(read_toml(data.decode("utf-8-sig")))
    except ValueError:
        return False


def document_from(data: bytes) -> Document:
    """Return the document of a case file.

    Raises
    ------
    CaseError, ParameterError
        When it is none.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise df.CaseError("this is not a case, result or project of dForce") from None
    return Document.of(case_of(text))


def case_of(text: str) -> df.Case:
    """Return the case of a TOML text; no Python file that it names is run.

    Raises
    ------
    CaseError, ParameterError
        When it is none.
    """
    try:
        table = read_toml(text)
    except ValueError:
        table = {}  # the sentence comes from dForce
    if "plugins" in table:
        raise df.ParameterError(PLUGINS)
    return df.Case.from_toml(text)


def result_from(data: bytes, folder: Path, pictures: Sequence[Picture] = ()) -> xr.Dataset:
    """Return the result in the bytes of a netCDF file. Blocking.

    Parameters
    ----------
    data
        The file.
    folder
        A folder for the file while it is read.
    pictures
        Pictures to draw of it, besides the usual pictures.

    Raises
    ------
    ResultError
        When it is not a result, points to other files, unpacks to too much, or cannot be written again and drawn; and when
        the folder has no room for it.
    """
    with _looked_through(data, folder) as path:
        result = _result(path)
        validate_upload(result, path.parent, pictures)
    return result


def opened_from(data: bytes, folder: Path) -> xr.Dataset:
    """Return the Dataset in the bytes of a netCDF file: a result, a sweep, a measured curve or a fit. Blocking.

    Raises
    ------
    ResultError
        As :func:`result_from`.
    """
    with _looked_through(data, folder) as path:
        result = _read(path)
        if is_kind(result, "measured", "fit"):
            validate_measured(result)
        elif is_explorable(result):
            validate_study(_result(path))
        else:
            validate_upload(_result(path), path.parent)
    return result


def beside_from(data: bytes, folder: Path) -> xr.Dataset:
    """Return the measured curve, or the fit of one, in the bytes of a netCDF file. Blocking.

    Raises
    ------
    ResultError
        As :func:`result_from`.
    """
    with _looked_through(data, folder) as path:
        result = _read(path)
        validate_measured(result)
    return result


@contextlib.contextmanager
def _looked_through(data: bytes, folder: Path) -> Iterator[Path]:
    """Give a file with bytes that are safe to be read.

    Raises
    ------
    ResultError
        When they are not, or there is no room for them.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix="upload-") as place:
            path = Path(place) / "result.nc"
            path.write_bytes(data)
            hdf5.look(data, "result")
            yield path
    except OSError as error:
        if isinstance(error, df.DForceError) and not isinstance(error.__cause__, OSError):
            raise
        raise df.ResultError(f"this file cannot be checked here: {why(error)}") from error


def _read(path: Path) -> xr.Dataset:
    try:
        return df.read(path)
    except df.ResultError as error:
        raise df.ResultError(str(error).replace(in_quotes(path), "this file")) from None


def _result(path: Path) -> xr.Dataset:
    result = _read(path)
    try:
        case_of(str(result.attrs.get("case", "")))
    except df.DForceError as error:
        raise df.ResultError(f"the case of this result cannot be used here: {error}") from None
    if "status" not in result and not is_kind(result, "reconstruction", "regimes"):
        raise df.ResultError("this is not the result of an experiment")
    return result


UNUSABLE = "this result cannot be used here: it differs from results of dForce"


def validate_upload(result: xr.Dataset, folder: Path, chosen: Sequence[Picture] = ()) -> None:
    """Write a result again, and draw and describe all of it. Blocking.

    Parameters
    ----------
    result
        The result read.
    folder
        A folder to write it to.
    chosen
        Pictures to draw of it, besides the usual pictures.

    Raises
    ------
    ResultError
        When any of this fails, and for a result that is neither of an experiment nor a reconstructed force.
    """
    kind = kind_of_result(result)
    if kind is None or kind.panel != "curves":
        words = "unknown to dForce" if kind is None else f"({kind.words})"
        raise df.ResultError(
            f"the window shows results of experiments, but this result is of another kind {words}; "
            "draw it with dforce plot, or with df.plot.overview in Python"
        )
    try:
        df.write(result, folder / "again.nc")
        df.write(result.isel({dim: slice(2) for dim in result.dims}), folder / "again.csv")
        names = [str(name) for name in result.variables]
        if len(names) > MOST_QUANTITIES or max(map(len, names)) > LONGEST_NAME:
            raise ValueError("more quantities than an experiment has, or longer names")
        if kind.name == "basins":
            basins(result)
        elif kind.name == "reconstruction":
            reconstruction.figure_of(result)
        else:
            for picture in _pictures(result, chosen):
                states = setpoint.states_of(result, 0.8, picture)
                figures.picture([figures.Layer(result, states=states)], picture)
                if states is not None:
                    setpoint.table_of([figures.Layer(result, states=states)], picture)
            for name in drawable(result):
                figures.picture([figures.Layer(result)], Picture(name, (name,)))
        name_of(result, None, ())
    except OSError as error:  # a full disk is not a fault of the file
        if isinstance(error.__cause__, OSError) or not isinstance(error, df.DForceError):
            raise
        raise df.ResultError(UNUSABLE) from error
    except Exception as error:  # no fault of the file may reach the page
        raise df.ResultError(UNUSABLE) from error


def validate_study(result: xr.Dataset) -> None:
    """Draw each quantity of a result over parameters. Blocking.

    Raises
    ------
    ResultError
        When something of that fails.
    """
    try:
        names = explore.quantities(result)
        if not 0 < len(names) <= MOST_QUANTITIES or max(len(str(name)) for name in result.variables) > LONGEST_NAME:
            raise ValueError("no quantities, more than an experiment has, or longer names")
        for name in names:
            choice = explore.fitting(result, explore.Choice(name))
            pictures.figure(result, choice)
            for dim in choice.places:
                explore.label_of(result, dim), explore.places_of(result, dim)
            explore.settings_at(result, explore.picked(result, choice, 0.0, 0.0))
            explore.gaps_of(result, name)
    except Exception as error:  # no fault of the file may reach the page
        raise df.ResultError(UNUSABLE) from error


def validate_measured(result: xr.Dataset) -> None:
    """Calibrate and describe a measured curve, or describe a fit of one. Blocking.

    Raises
    ------
    ResultError
        When it is neither, or something of that fails.
    """
    if not is_kind(result, "measured", "fit"):
        raise df.ResultError("this is neither a measured curve nor its fit")
    try:
        if is_kind(result, "measured"):
            by_model(calibrated(result, {}, None))
        else:
            df.fit_report(result)
            for name in ("amplitude", "phase"):
                overlay.along(result, result[f"{name}_fit"].values[:, 0])
            for name in map(str, result["parameter"].values):
                fitting.found(result, name), fitting.note(result, name)
    except df.ParameterError:  # the settings kept beside the curve complete it
        return
    except Exception as error:  # no fault of the file may reach the page
        raise df.ResultError(UNUSABLE) from error


def _pictures(result: xr.Dataset, chosen: Sequence[Picture]) -> Iterator[Picture]:
    """Give the usual pictures of a result, and the chosen pictures whose quantities it has."""
    yield from pictures_of(result)
    known = set(drawable(result))
    yield from (picture for picture in chosen if {picture.x, *picture.y} <= known)


LAST = (
    "last"  # the folder of the files opened last, in a session's folder: a browser cannot open a file again by its name
)
MOST_LAST = 6
MOST_LAST_BYTES = 100_000_000  # of all of them
LONGEST_FILE_NAME = 90  # bytes of a name; a longer one keeps its end, for Windows takes no path of 260 characters


@dataclass(frozen=True)
class LastFile:
    """A file that was opened: its name, and when (s since 1970)."""

    name: str
    opened: float

    def words(self, now: datetime.datetime) -> str:
        """Return its name with the day, or the time of today."""
        at = datetime.datetime.fromtimestamp(self.opened)
        days = (now.date() - at.date()).days
        when = f"{at:%H:%M}" if days == 0 else "yesterday" if days == 1 else f"{at.day} {at:%b}"
        return f"{shorten(self.name, 40)} ({when})"


class LastFiles:
    """The files of one session; a file that is opened again replaces its earlier content.

    Parameters
    ----------
    folder
        Their folder; it is made for the first file.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def keep(self, data: bytes, name: str) -> None:
        """Keep a file; the oldest ones go when there are too many. Blocking.

        Raises
        ------
        ResultError
            When it cannot be written.
        """
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_whole(self._path(name), data)
            sizes = [path.stat().st_size for path in self._paths()]
            for number, path in enumerate(self._paths()):
                if number and (number >= MOST_LAST or sum(sizes[: number + 1]) > MOST_LAST_BYTES):
                    path.unlink(missing_ok=True)
        except OSError as error:
            raise df.ResultError(f"the file is open, but cannot be listed for the next time: {why(error)}") from error

    def take(self, name: str) -> bytes:
        """Return a file. Blocking.

        Raises
        ------
        ResultError
            When it is no longer kept.
        """
        try:
            return read_input(self._path(name), "file", MOST_LAST_BYTES, df.ResultError)
        except df.ResultError:
            raise df.ResultError(
                f"the file '{shorten(name, 60)}' is no longer kept here; open it from your disk"
            ) from None

    def listed(self) -> list[LastFile]:
        """Return the files, the last one first."""
        coded = [(path.name.removeprefix("file-"), path.stat().st_mtime) for path in self._paths()]
        return [LastFile(base64.urlsafe_b64decode(name).decode(errors="replace"), opened) for name, opened in coded]

    def forget(self) -> None:
        """Remove all of them."""
        for path in self._paths():
            path.unlink(missing_ok=True)

    def _path(self, name: str) -> Path:
        cut = name.encode(errors="replace")[-LONGEST_FILE_NAME:].decode(errors="ignore")
        return self.folder / f"file-{base64.urlsafe_b64encode(cut.encode()).decode('ascii')}"

    def _paths(self) -> list[Path]:
        return sorted(self.folder.glob("file-*"), key=lambda path: path.stat().st_mtime, reverse=True)


def list_opened(session: Path, file: Path) -> None:
    """List a file of this computer that was named at the start, unless it is missing or too large. Blocking."""
    with contextlib.suppress(OSError, df.ResultError):
        LastFiles(session / LAST).keep(read_input(file, "file", MOST_LAST_BYTES, df.ResultError), file.name)
