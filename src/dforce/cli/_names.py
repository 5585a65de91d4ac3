"""Names that a user may type: completion in the shell, and the case of a name."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import dforce as df
from dforce.core.files import exists, named, noted

if TYPE_CHECKING:
    import xarray as xr


def complete_examples(incomplete: str) -> list[str]:
    """Return the examples that a half-typed name may become."""
    return [name for name in df.examples() if name.startswith(incomplete)]


def complete_models(incomplete: str) -> list[str]:
    """Return the force models that a half-typed name may become."""
    return [name for name in sorted(df.forces.REGISTRY) if name.startswith(incomplete)]


def complete_cases(incomplete: str) -> list[str]:
    """Return examples and the case and result files that a half-typed name may become."""
    start = Path(incomplete)
    folder = start if incomplete.endswith(("/", "\\")) else start.parent
    known = [path for ending in ("*.toml", "*.nc") for path in sorted(folder.glob(ending))]
    files = [str(path) for path in known if str(path).startswith(incomplete)]
    return complete_examples(incomplete) + files


CaseName = Annotated[
    str,
    typer.Argument(
        metavar="CASE",
        autocompletion=complete_cases,
        show_default=False,
        help="A case file (.toml), a result (.nc, .zarr), or the name of an example.",
    ),
]


@dataclass(frozen=True)
class Source:
    """A case as it was named: where it comes from, an earlier result of it, and the files that it names."""

    case: df.Case
    stem: str
    path: Path | None = None
    result: xr.Dataset | None = None
    inputs: tuple[Path, ...] = ()

    @property
    def files(self) -> tuple[Path, ...]:
        """Its own file, where it has one, and the files that it names."""
        return self.inputs if self.path is None else (self.path, *self.inputs)


def curve_of(case: df.Case) -> list[Path]:
    """Return the file of the measured curve that a case names."""
    return [] if case.data is None or not case.data.file else [named(case.data.file, "data.file", case.folder)]


def inputs_of(case: df.Case, noted_before: list[Path]) -> tuple[Path, ...]:
    """Return the files that a case names, as noted when it was loaded or read later."""
    rows = "" if case.sweep is None else case.sweep.rows
    return (*noted_before, *curve_of(case), *([named(rows, "sweep.rows", case.folder)] if rows else []))


def open_source(name: str, settings: list[str]) -> Source:
    """Return the case of a file or an example, changed by settings such as ``"drive.A0=5 nm"``."""
    path = Path(name)
    with noted() as files:
        case = df.load_case(name).set(*settings)
    if not exists(path) and name in df.examples():
        return Source(case, name, inputs=inputs_of(case, files))
    result = df.read(name) if path.suffix.lower() in (".nc", ".zarr") and not settings else None
    return Source(case, path.stem, path, result, inputs_of(case, files))
