"""The summary of a plan: how much is allowed, and the points that it names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from dforce.findings.finding import Finding, number
from dforce.results.significance import is_none

if TYPE_CHECKING:
    import xarray as xr

NAMED = {"recommended": "most room", "best": "best by the goal", "least_violation": "least violation"}
TOLD = ("phase", "peak_force", "max_indentation", "contact_time")


def plan(dataset: xr.Dataset) -> Iterator[Finding]:
    """Give how many states are allowed, by which limits, the points with a name, and the other findings."""
    count = float(dataset["allowed"].sum())
    yield Finding("allowed", "allowed states", f"{count:.0f} of {states(dataset)}", count, "1")
    yield Finding("limits", "limits", str(dataset.attrs.get("limits", "")) or "none", float("nan"), "1")
    for name in named(dataset):
        yield Finding(name, NAMED[name], in_words(dataset, name), float("nan"), "1")
    if "findings" in dataset.attrs:
        found = " ".join(str(dataset.attrs["findings"]).splitlines())
        yield Finding("findings", "findings", found, float("nan"), "1")


def states(dataset: xr.Dataset) -> int:
    """Return how many states a plan has found."""
    return int((dataset["limit_hit"] != "no state").sum())


def named(dataset: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Return the points to which a plan gives a name, SI values by name."""
    names = [name for name in NAMED if name in dataset and bool(dataset[name].any())]
    return {name: _values(_at(dataset, name), _axes(dataset)) for name in names}


def in_words(dataset: xr.Dataset, name: str) -> str:
    """Return a point with a name for a reader."""
    point, words = _at(dataset, name), []
    for key, value in _values(point, _axes(dataset)).items():
        if isinstance(value, str):
            words += [f"{key.replace('_', ' ')} {value}"] if value else []
            continue
        shown = number(value, str(point[key].attrs.get("units", "1")), key, bool(is_none(point, key).ravel()[0]))
        words.append(f"{key.replace('_', ' ')} {shown}{' margins' if key == 'room' else ''}")
    return ", ".join(words)


def _at(dataset: xr.Dataset, name: str) -> xr.Dataset:
    places = dataset[name].values.nonzero()
    return dataset.isel({dim: int(place[0]) for dim, place in zip(dataset[name].dims, places, strict=True)})


def _axes(dataset: xr.Dataset) -> list[str]:
    return [str(dim) for dim in dataset["allowed"].dims if dim != "state"]


def _values(point: xr.Dataset, axes: list[str]) -> dict[str, Any]:
    values = {key: float(point[key]) for key in (*axes, "zc")}
    values |= {key: float(point[key].values.ravel()[0]) for key in TOLD}
    return values | {
        "room": float(point["room"]),
        "regime": str(point["regime"].values),
        "limit_hit": str(point["limit_hit"].values),
    }
