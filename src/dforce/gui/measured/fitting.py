"""A fit of the measured curve: lever and tip that it takes for exact, its free parameters, its values, and its consequences.

A curve is fitted as well with another spring constant, Q or tip radius, by other values of the sample: no check of the fit
finds the mistake. So a person confirms lever and tip before a fit, and each fitted value names them.
"""

from __future__ import annotations

import asyncio
import functools
import math
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import background_tasks

import dforce as df
from dforce.core.units import show
from dforce.findings.finding import with_error
from dforce.findings.fits import is_constrained, verdict
from dforce.gui.case.fields import field_at, label_of
from dforce.gui.case.values import ParameterRow, read, rows_of, shown
from dforce.gui.document.compute import Job
from dforce.gui.document.document import NAMING, Document, Path, path_of
from dforce.inverse.values import show as show_with_error

if TYPE_CHECKING:
    import xarray as xr

DIGITS = 6  # of values that are taken over, and of lever and tip
SECTIONS = ("sample", "contact", "tip", "medium", "cantilever")
FREE = ("fit", "free")
NUISANCE = {
    "zc_offset": "Offset of the heights",
    "A0": "Free amplitude",
    "phase_offset": "Offset of the phase",
    "amplitude_scale": "Scale of the amplitude",
}
BESIDE = (*NAMING, "experiment", "solver")  # sections that a fit does not depend on
NOT_SEEN = "Not constrained by these data."
PRODUCT = "Only a product is constrained"
UNCONFIRMED = (
    "Confirm lever and tip: with wrong values the fit looks as good, but its results are wrong. Choose a lever, type its "
    "values, or drop a thermal spectrum; then confirm."
)
TYPED = {"f0": "Hz", "k": "N/m", "Q": "1", "R": "m"}  # units of the numbers of lever and tip
HELD = {"k": ".k", "Q": ".Q", "R": "tip.radius"}  # a wrong value of these scales the forces; how paths to them end
LONGEST = 40  # characters of a value


def lever_and_tip(case: df.Case) -> dict[str, str]:
    """Return the values that a fit takes for exact, as text: f0, k and Q of each mode, then the shape of the tip."""
    found: dict[str, str] = {}
    modes = case.problem.modes
    for number, mode in enumerate(modes, start=1):
        ending = "" if len(modes) == 1 else f" of mode {number}"
        found |= {
            f"f0{ending}": show(mode.f0, "Hz", DIGITS),
            f"k{ending}": show(mode.k, "N/m", DIGITS),
            f"Q{ending}": f"{mode.Q:.{DIGITS}g}",
        }
    if case.tip is not None and case.tip.radius is not None:
        found["R"] = show(case.tip.radius, "m", DIGITS)
    if case.tip is not None and case.tip.half_angle is not None:
        found["half-angle"] = show(case.tip.half_angle, "deg", DIGITS)
    return found


def lever_of(document: Document) -> dict[str, str]:
    """Return the lever and the tip that a document has; empty while it is not a case."""
    try:
        return lever_and_tip(document.case())
    except (df.DForceError, TypeError):
        return {}


def why_no_lever(document: Document) -> str:
    """Return why a document has no lever and tip; empty where it has them."""
    try:
        document.case()
    except (df.DForceError, TypeError) as error:
        return str(error)
    return ""


def _place_of(document: Document, name: str) -> Path:
    """Return where a value of lever or tip is typed; () where it follows from others, as of a beam."""
    if name == "R":
        return ("tip", "radius")
    if document.value(("cantilever", "beam")):
        return ()
    return ("cantilever", "modes", 0, name) if document.value(("cantilever", "modes")) else ("cantilever", name)


def typed_lever(document: Document) -> list[dict[str, str]]:
    """Return the values of lever and tip that can be typed, each with its name and its text."""
    values = lever_of(document)
    found = []
    for name in TYPED:
        place = _place_of(document, name)
        if place:
            text = document.value(place)
            found.append({"name": name, "text": str(text if text is not None else values.get(name, ""))})
    return found


def with_value(document: Document, name: str, text: str) -> Document:
    """Return a document with a value of lever or tip as typed, by default in the unit of its field; nothing takes it away."""
    place = _place_of(document, name) if name in TYPED else ()
    field = field_at(document, place)
    if field is None:
        return document
    return document.put(place, read(field, field.shapes[0], text[:LONGEST], shown(field, document.value(place))[1]))


def with_library(document: Document, name: str) -> Document:
    """Return a document with a lever of the library, and with its tip where the library has one.

    Its Q comes from the medium or has to be typed: few makers state one.
    """
    probe = df.cantilevers().get(name)
    if probe is None:
        return document
    document = document.put(("cantilever",), {"name": name})
    if probe.tip_radius is not None:
        document = document.put(("tip", "radius"), show(probe.tip_radius, "m", DIGITS))
    return document


def unconfirmed(document: Document, values: dict[str, str]) -> str:
    """Return the request to confirm these values; empty if they are confirmed for the document's measured curve."""
    confirmed = document.measured is not None and values and dict(document.measured.confirmed) == values
    return "" if confirmed else UNCONFIRMED


def lever_in_words(values: dict[str, str]) -> str:
    """Return values for a sentence: ``k = 2.7 N/m, R = 8 nm``."""
    return ", ".join(f"{name} = {value}" for name, value in values.items())


def with_tune(document: Document, tune: df.ThermalTune) -> Document:
    """Return a document whose lever has the values of a tune; the error of k counts in a fit."""
    modes = bool(document.value(("cantilever", "modes")))
    base = ("cantilever", "modes", 0) if modes else ("cantilever",)
    for name, (value, error) in tune.as_table().items():
        digits = 2 + max(0, math.floor(math.log10(value)) - math.floor(math.log10(error)))  # two of the error
        text = df.show(value, TYPED[name], digits)
        document = document.put((*base, name), text if name != "Q" else float(text))
    path = "cantilever.modes.1.k" if modes else "cantilever.k"
    return document.put(("fit", "given", path), [tune.k, tune.k_error])


def tune_in_words(tune: df.ThermalTune) -> str:
    """Return the values of a tune for a sentence."""
    return ", ".join(f"{name} = {show_with_error(*pair, TYPED[name])}" for name, pair in tune.as_table().items()) + "."


def rows(document: Document) -> list[ParameterRow]:
    """Return the parameters of a document that a fit may find, the forces' and the sample's parameters first."""
    found = rows_of(document, SECTIONS)
    known = {row.path for row in found}
    others = [name for name in free_names(document) if path_of(document, name) not in known]
    return [*found, *(ParameterRow(name, path_of(document, name), name, "", "") for name in others)]


def free_names(document: Document) -> list[str]:
    """Return the names of the parameters that are to be fitted."""
    given = document.value(FREE)
    return [str(name) for name in given] if isinstance(given, list | tuple) else []


def free_paths(document: Document) -> set[Path]:
    """Return the paths of the parameters to fit."""
    return {path_of(document, name) for name in free_names(document)}


def with_free(document: Document, row: ParameterRow, free: bool) -> Document:
    """Return a document in which a parameter is to be fitted, or no longer."""
    names = [name for name in free_names(document) if name != row.name and path_of(document, name) != row.path]
    return document.put(FREE, [*names, row.name] if free else names)


def found(fit: xr.Dataset, name: str) -> str:
    """Return value and error of a parameter of a fit as text; empty where it was not fitted or cannot be known."""
    one = _one(fit, name)
    if one is None or not is_constrained(one) or bool(one["at_bound"]):
        return ""
    value, error, unit = with_error(float(one["value"]), float(one["error"]), str(one["unit"].values))
    return f"{value} ± {error} {unit}".replace("none", "?").strip()


def found_for(fit: xr.Dataset, name: str) -> str:
    """Return value and error of a parameter of a fit, and for which k, Q and R they hold; empty as :func:`found`."""
    text = found(fit, name)
    return f"{text} {_holds_for(fit)}".strip() if text else ""


@functools.lru_cache(maxsize=16)
def holds_for(case: str, fitted: tuple[str, ...] = ()) -> str:
    """Return for which k, Q and R the values of a fit hold, from its case as text; without a value that was fitted itself."""
    try:
        values = lever_and_tip(df.Case.from_toml(case))
    except df.DForceError:
        return ""
    kept = {
        name: value
        for name, value in values.items()
        if name[0] in HELD and not any(path.endswith(HELD[name[0]]) for path in fitted)
    }
    return f"for {lever_in_words(kept)}" if kept else ""


def _holds_for(fit: xr.Dataset) -> str:
    return holds_for(str(fit.attrs.get("case", "")), tuple(map(str, fit["parameter"].values)))


def note(fit: xr.Dataset, name: str) -> str:
    """Return why a parameter of a fit cannot be known; empty where it is."""
    one = _one(fit, name)
    if one is None:
        return ""
    if not bool(one["seen"]):
        return NOT_SEEN
    if math.isinf(float(one["error"])):
        products = [line for line in str(fit.attrs.get("products", "")).splitlines() if name in line]
        return f"{PRODUCT}{': ' if products else '.'}{'; '.join(products)}"
    return "The value lies at its bound." if bool(one["at_bound"]) else ""


def answers(fit: xr.Dataset, listed: list[ParameterRow], document: Document) -> list[str]:
    """Return the fitted values of the rows of a list, or why there are none, as text, then the k, Q and R behind them."""
    names = [(row.label, name_in(fit, row, document)) for row in listed]
    lines = [f"{label}: {found(fit, name) or note(fit, name)}" for label, name in names if name]
    given, doubt = _holds_for(fit), verdict(fit)
    lines = [*lines, f"{given[0].upper()}{given[1:]}"] if lines and given else lines
    return [doubt, *lines] if doubt else lines


def others(fit: xr.Dataset, listed: list[ParameterRow], document: Document) -> list[str]:
    """Return the fitted values besides the rows of a list, as text."""
    paths = {row.path for row in listed}
    names = [name for name in map(str, fit["parameter"].values) if _path(document, name) not in paths]
    return [f"{_label(document, name)}: {found(fit, name) or note(fit, name)}" for name in names]


def name_in(fit: xr.Dataset, row: ParameterRow, document: Document) -> str:
    """Return the name that a row has in a fit; empty where it was not fitted."""
    return next((name for name in map(str, fit["parameter"].values) if path_of(document, name) == row.path), "")


def taken_over(document: Document, fit: xr.Dataset) -> Document:
    """Return a document with the values of a fit; parameters that the data do not constrain keep their values."""
    for name, unit, value, seen in zip(
        fit["parameter"].values, fit["unit"].values, fit["value"].values, fit["seen"].values, strict=True
    ):
        path = _path(document, str(name))
        if path and seen:
            rounded = float(f"{value:.{DIGITS}g}")
            document = document.put(path, show(rounded, str(unit), DIGITS) if str(unit) != "1" else rounded)
    return document


def refused(job: Job | None, document: Document) -> str:
    """Return why the fit of a document failed; empty where it did not, and once the document has changed."""
    if job is None or job.document is None or job.state != "failed":
        return ""
    same = job.is_of(document) and job.document.value(("fit",)) == document.value(("fit",))
    return job.error if same else ""


def offsets(fit: xr.Dataset) -> tuple[float | None, float]:
    """Return by how much a fit shifts the heights (m; None: not fitted) and turns the phases (degrees)."""
    shift, turn = _one(fit, "zc_offset"), _one(fit, "phase_offset")
    return (None if shift is None else float(shift["value"]), 0.0 if turn is None else float(turn["value"]))


def is_of(fit: xr.Dataset, document: Document) -> bool:
    """Return whether a fit belongs to the case of a document, for any values of the fitted parameters."""
    try:
        now = tomllib.loads(document.case().to_toml(complete=True))
        start = tomllib.loads(str(fit.attrs["start_case"]))
    except (df.DForceError, TypeError, ValueError, KeyError):
        return False
    return _rest(now, fit) == _rest(start, fit)


def _rest(table: dict[str, Any], fit: xr.Dataset) -> dict[str, Any]:
    """Return the tables of a case that a fit depends on, without fitted parameters and parameters with known values."""
    document = Document({name: part for name, part in table.items() if name not in BESIDE})
    given = table.get("fit", {}).get("given", {})
    for name in map(str, [*fit["parameter"].values, *given]):
        if path := _path(document, name):
            document = document.put(path, "fitted")
    return dict(document.table)


def _path(document: Document, name: str) -> Path:
    """Return the path of a fit's parameter in a document; () for a parameter of the measurement."""
    base, _, tone = name.partition("_2")
    if base == "A0":
        tones = document.value(("drive", "tones"))
        return ("drive", "tones", 1 if tone == "" and name != base else 0, "A0") if tones else ("drive", "A0")
    return () if base in NUISANCE else path_of(document, name)


def _label(document: Document, name: str) -> str:
    base = name.removesuffix("_2")
    if base in NUISANCE:
        return f"{NUISANCE[base]}{', tone 2' if base != name else ''}"
    path = path_of(document, name)
    return label_of(document, path) if field_at(document, path) is not None else name


def _one(fit: xr.Dataset, name: str) -> xr.Dataset | None:
    return fit.sel(parameter=name) if name in fit["parameter"].values else None


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
        """Find the parameters of a document's case that the range of a curve does not constrain; at once if known."""
        names = free_names(document)
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


LIMIT = "1 nN"


@dataclass
class SafeJob(Job):
    """A computation of safe settings.

    Attributes
    ----------
    limit, share
        The largest peak force as typed, and the set point.
    fit
        The fit of whose best case they are.
    """

    limit: str = LIMIT
    share: float = 0.8
    fit: xr.Dataset | None = None

    def compute(self) -> xr.Dataset:
        """Return the safe settings."""
        return df.safe_settings(
            self.case if self.fit is None else self.fit, self.limit, self.share, progress=self._watch
        )

    def sentences(self) -> list[str]:
        """Return the findings, as sentences."""
        return [] if self.result is None else [str(text) for text in np.atleast_1d(self.result.attrs["findings"])]
