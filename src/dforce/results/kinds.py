"""The kinds of results: how each is recognized, summed up, drawn and shown. One row is one kind."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from dforce.core.errors import ParameterError
from dforce.results.curves import swept
from dforce.results.status import check_computed

if TYPE_CHECKING:
    import xarray as xr


NO_RESULT = "this dataset is neither a result of an experiment nor a force curve; it has no overview and no summary"


@dataclass(frozen=True)
class Kind:
    """A kind of result.

    Attributes
    ----------
    name
        Word for it.
    holds
        Whether a Dataset is one; of several that say so the first in :data:`KINDS` is meant.
    summary, picture
        Functions of the result, as ``"module:name"`` below `dforce`, loaded when they are called: `summary` gives the
        findings, and `picture`, which takes a figure as well, returns the axes. Without a picture: "".
    panel
        Where the window shows it: among the "curves", over "parameters", as "measured" data; "" where it does not.
    """

    name: str
    holds: Callable[[xr.Dataset], bool]
    summary: str
    picture: str
    panel: str = "curves"

    @property
    def words(self) -> str:
        """The name as text."""
        return self.name.replace("_", " ")

    def summed_up(self, dataset: xr.Dataset) -> Any:
        """Return the findings of a result of this kind."""
        return _loaded(self.summary)(dataset)

    def drawn(self, dataset: xr.Dataset, **options: Any) -> list[Any]:
        """Return the axes of the picture of a result of this kind.

        Raises
        ------
        ParameterError
            Where there is none.
        """
        if not self.picture:
            raise ParameterError(f"this result ({self.words}) has no picture; df.summary lists its numbers")
        axes = _loaded(self.picture)(dataset, **options)
        return list(axes) if isinstance(axes, list | tuple) else [axes]


def _loaded(path: str) -> Callable[..., Any]:
    module, name = path.split(":")
    function: Callable[..., Any] = getattr(importlib.import_module(f"dforce.{module}"), name)
    return function


def _marked(mark: str) -> Callable[[xr.Dataset], bool]:
    """Return whether a Dataset has a variable or an attribute of a name."""
    return lambda dataset: mark in dataset.variables or mark in dataset.attrs


def _is_force_curve(dataset: xr.Dataset) -> bool:
    return "zc" not in dataset.coords and {"force", "distance"} <= {*dataset.variables}


def _is_frequency_sweep(dataset: xr.Dataset) -> bool:
    return "frequency" in dataset.dims and "amplitude" in dataset and "frequency" in dataset["amplitude"].dims


# a fit holds the measured curve, and one case of a sweep is what the sweep is made of: what holds others comes first
KINDS = (
    Kind("plan", _marked("plan_over"), "findings.others:plan", "plot.plans:plan", "parameters"),
    Kind("regimes", _marked("map_over"), "findings.others:regimes", "plot.maps:regimes", "parameters"),
    Kind("reconstruction", _marked("force_status"), "findings.others:reconstruction", "plot.reconstruction:reconstruction"),
    Kind("fit", _marked("correlation"), "findings.others:fit", "plot.fits:fit", "measured"),
    Kind("identification", _marked("verdict"), "findings.others:identification", "", ""),
    Kind("thermal_spectrum", _marked("fitted_density"), "findings.others:thermal_spectrum", "plot.thermal:thermal_spectrum"),
    Kind("measured", _marked("height"), "findings.others:measured", "plot.measured:measured", "measured"),
    Kind("sweep", lambda dataset: bool(swept(dataset)), "findings.motions:sweep", "plot.sweeps:sweep_overview"),
    Kind("branches", lambda dataset: "point" in dataset.dims, "findings.motions:branches", "plot.branches:branches_overview"),
    Kind("basins", _marked("reached"), "findings.motions:basins", "plot.basins:basins"),
    Kind("force_curve", _is_force_curve, "findings.motions:force_curve", "plot.overview:forces"),
    Kind("frequency_sweep", _is_frequency_sweep, "findings.motions:frequency_sweep", "plot.branches:resonance"),
    Kind(
        "dwell", lambda dataset: "zc" in dataset.coords and dataset["zc"].ndim == 0, "findings.motions:dwell",
        "plot.overview:dwell",
    ),
    Kind("approach", lambda dataset: "zc" in dataset.coords, "findings.motions:approach", "plot.overview:approach"),
)  # fmt: skip


def kind_of(dataset: xr.Dataset) -> Kind | None:
    """Return the kind of a result; None for a Dataset that is no result."""
    return next((kind for kind in KINDS if kind.holds(dataset)), None)


def known_kind(dataset: xr.Dataset) -> Kind:
    """Return the kind of a result.

    Raises
    ------
    ParameterError
        For a Dataset that is no result, and for one that was stopped before its first point.
    """
    kind = kind_of(dataset)
    if kind is None:
        check_computed(dataset)
        raise ParameterError(NO_RESULT)
    return kind


def is_kind(dataset: xr.Dataset, *names: str) -> bool:
    """Say whether a result is of one of some kinds.

    Raises
    ------
    ValueError
        For a name that no kind has.
    """
    unknown = set(names) - {kind.name for kind in KINDS}
    if unknown:
        raise ValueError(f"unknown kind of result: {', '.join(sorted(unknown))}")
    kind = kind_of(dataset)
    return kind is not None and kind.name in names
