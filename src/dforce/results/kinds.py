"""The kinds of results: how each is recognized, summed up, drawn and shown. One row is one kind."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from dforce.core.errors import ParameterError
from dforce.core.quantities import AXES, OF_RESULTS
from dforce.results.dataset import COLUMN_DIMS
from dforce.results.status import check_computed

if TYPE_CHECKING:
    import xarray as xr


NO_RESULT = "this dataset is no result of a known kind, and no force curve; it has no overview and no summary"

LISTS = ("jump", "state", "search", "component", "calibration")  # dimensions of lists, along which nothing is drawn
OF_MOTIONS = frozenset(
    (*AXES, *COLUMN_DIMS, *LISTS, "crossing", "distance", "loop_time")
)  # dimensions besides the parameters of a sweep
# dimensions along which a result has at least one value
NEEDED = ("zc", "frequency", "point", "distance", "direction", "tone", "mode", "component")
MAPS = {"plan_over", "map_over"}  # attributes of results over parameters of any name

Own = dict[tuple[str, ...], str]  # functions by the quantities that they draw


@dataclass(frozen=True)
class Picture:
    """Quantities of a result against another quantity.

    Attributes
    ----------
    x, y
        Names of variables of the result; in a row of a kind an `x` of "" is the parameter of the curve.
    together
        Whether the quantities share one frame, each with its own axis; otherwise one is above the other.
    logarithmic
        Whether the quantities are shown on a logarithmic scale.
    title
        Its name in a choice of several.
    """

    x: str
    y: tuple[str, ...]
    together: bool = False
    logarithmic: bool = False
    title: str = field(default="", compare=False)

    @property
    def logarithmic_across(self) -> bool:
        """Whether the axis across is logarithmic, too: for spectral densities, which cover decades of frequency."""
        return self.logarithmic and self.x == "frequency" and bool({"spectral_density", "fitted_density"} & {*self.y})


AMPLITUDE_AND_PHASE, DENSITIES = ("amplitude", "phase"), ("spectral_density", "fitted_density")
# the names in a result for the numbers that a lock may hold
LOCKED = {"frequency": "frequency_shift", "drive": "drive_ratio", "amplitude": "amplitude", "phase": "phase"}


def measured(dataset: xr.Dataset, tone: int = 0) -> tuple[str, ...]:
    """Return the names of the two measured numbers of a tone, which neither a controller nor the drive holds."""
    held = str(dataset.attrs.get("held", "drive frequency")).split(", ")[tone:][:1] or ["drive frequency"]
    return tuple(name for number, name in LOCKED.items() if number not in held[0].split())


OF_CURVES = (
    Picture("", ("frequency_shift", "drive_ratio"), title="frequency shift and excitation"),
    Picture("", AMPLITUDE_AND_PHASE, title="amplitude and phase"),
    Picture("", ("peak_force", "min_force"), title="forces"),
    Picture("", ("max_indentation", "contact_time"), title="contact"),
    Picture("", ("total_virial", "total_dissipated_energy"), title="energies"),
    # the first question in the choice of a set point
    Picture("amplitude_ratio", ("peak_force", "max_indentation"), title="force against A/A0"),
)
OF_RECORDS = (
    Picture("time", ("deflection", "velocity", "force", "indentation"), title="traces"),
    Picture("frequency", ("spectrum",), logarithmic=True, title="spectrum"),
    Picture("distance", ("force",), title="force against distance"),
    Picture("deflection", ("velocity",), title="phase portrait"),
)
OF_SPECTRA = (Picture("frequency", DENSITIES, together=True, logarithmic=True, title="thermal spectrum"),)


@dataclass(frozen=True)
class Kind:
    """A kind of result.

    Attributes
    ----------
    name
        Its name.
    holds
        Whether a Dataset is of this kind; of several that match, the first in :data:`KINDS` counts.
    summary, picture
        Functions of the result, as ``"module:name"`` below `dforce`, loaded when they are called: `summary` gives the
        findings, and `picture`, which takes a figure as well, returns the axes. Without a picture: "".
    panel
        Its place in the window: among the "curves", over "parameters", as "measured" data; "" without a place.
    pictures
        Pictures that suit such a result, the most useful first, as far as it has their quantities.
    own
        Functions that draw some of `pictures` with further details, by their quantities. They take the result and a figure;
        for an approach a `measured` curve, too.
    figure
        Function that returns the window's figure, where the window does not show lines.
    lists
        Dimensions of which any selection from a result of this kind has one.
    """

    name: str
    holds: Callable[[xr.Dataset], bool]
    summary: str
    picture: str
    panel: str = "curves"
    pictures: tuple[Picture, ...] = OF_CURVES
    own: Own = field(default_factory=dict)
    figure: str = ""
    lists: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The name as text."""
        return self.name.replace("_", " ")

    def summed_up(self, dataset: xr.Dataset) -> Any:
        """Return the findings of a result of this kind."""
        return loaded(self.summary)(dataset)

    def drawn(self, dataset: xr.Dataset, **options: Any) -> list[Any]:
        """Return the axes of the picture of a result of this kind.

        Raises
        ------
        ParameterError
            Where there is none.
        """
        if not self.picture:
            raise ParameterError(f"this result ({self.words}) has no picture; df.summary lists its numbers")
        return _listed(loaded(self.picture)(dataset, **options))

    def drawn_alone(self, dataset: xr.Dataset, quantities: tuple[str, ...], **options: Any) -> list[Any] | None:
        """Return the axes of a picture of some quantities that this kind draws in its own way; None where it has none."""
        return _listed(loaded(self.own[quantities])(dataset, **options)) if quantities in self.own else None


def _listed(axes: Any) -> list[Any]:
    return list(axes) if isinstance(axes, list | tuple) else [axes]


def loaded(path: str) -> Callable[..., Any]:
    """Return the function at ``"module:name"`` below `dforce`."""
    module, name = path.split(":")
    function: Callable[..., Any] = getattr(importlib.import_module(f"dforce.{module}"), name)
    return function


def _marked(mark: str) -> Callable[[xr.Dataset], bool]:
    """Return whether a Dataset has a variable or an attribute of a name."""
    return lambda dataset: mark in dataset.variables or mark in dataset.attrs


def swept(dataset: xr.Dataset, along: str = "") -> list[str]:
    """Return the dimensions of a sweep's parameters without the dimension of its curves; none for other results."""
    paths = str(dataset.attrs.get("over", "")).split()
    names = dict.fromkeys(name for path in paths for name in (path, path.split(".")[-1]))
    dims = dict.fromkeys(str(dim) for name in names if name in dataset.coords for dim in dataset.variables[name].dims)
    return [dim for dim in dims if dim != along]


def check_shape(result: xr.Dataset) -> None:
    """Refuse a result whose dimensions do not fit its kind any more: a user chose a part of it, or joined several.

    Raises
    ------
    ParameterError
        When a selection is empty or has lost a dimension of columns, and when results were joined along a dimension of
        another program, or twice along the same labels. The message contains the right choice.
    """
    mapped = [path.split(".")[-1] for over in MAPS & result.attrs.keys() for path in str(result.attrs[over]).split()]
    if result.attrs.get("interrupted") and any(result.sizes.get(dim) == 0 for dim in mapped):
        raise ParameterError(
            "the map was stopped before its first row was done, so it has no numbers; compute it again"
        )
    for dim in (dim for dim in (*NEEDED, *swept(result), *mapped) if result.sizes.get(dim) == 0):
        if dim == "point" and "searched" in result.coords:
            raise ParameterError(
                "these branches have no points: their range has no state, or a selection left none; start experiment.zc "
                "farther from the sample"
            )
        order = " and zc goes from far to near" if dim == "zc" else ""
        raise ParameterError(
            f"this result has no value along {dim} left: a slice in .sel starts at the value that comes first{order}"
        )
    indexes = result.indexes  # made anew at each call
    for dim in ("direction", "component", "parameter", *COLUMN_DIMS):
        if dim in indexes and not indexes[dim].is_unique:
            raise ParameterError(f"this result has a value twice along {dim}; choose one of each with .isel({dim}=...)")
    if not {"status", "amplitude"} <= result.variables.keys() or MAPS & result.attrs.keys():
        return  # no motions, or over parameters of any name
    for dim in (str(dim) for dim in result.dims if dim not in OF_MOTIONS and dim not in swept(result)):
        raise ParameterError(f"no result of dForce has the dimension {dim}; choose one result with .isel({dim}=0)")
    if "direction" in result.dims and "direction" not in result.coords:
        raise ParameterError("this result has lost the names of its directions; keep the coordinate direction")
    for name, variable in result.variables.items():
        row = OF_RESULTS.get(str(name))
        for dim in () if row is None else (dim for dim in row.dims if dim in NEEDED and dim not in variable.dims):
            raise ParameterError(
                f"{name} of this result has lost its dimension {dim}; choose a list, such as .isel({dim}=[0])"
            )


def _is_force_curve(dataset: xr.Dataset) -> bool:
    return "zc" not in dataset.coords and {"force", "distance"} <= {*dataset.variables}


def _is_branches(dataset: xr.Dataset) -> bool:
    return "point" in dataset.dims and "along" in dataset.attrs


def _is_frequency_sweep(dataset: xr.Dataset) -> bool:
    amplitude = dataset.variables.get("amplitude")
    return amplitude is not None and "frequency" in amplitude.dims


def _is_dwell(dataset: xr.Dataset) -> bool:
    if "zc" not in dataset.coords or dataset.variables["zc"].ndim:
        return False
    return "amplitude" not in dataset or set(dataset.variables["amplitude"].dims) <= set(COLUMN_DIMS)


def _is_approach(dataset: xr.Dataset) -> bool:
    return "zc" in dataset.coords and dataset.variables["zc"].ndim > 0


FORCE: Own = {("force",): "plot.forces:force_distance"}
RECORD: Own = FORCE | {("spectrum",): "plot.motion:spectrum", ("velocity",): "plot.motion:phase_portrait"}

# a fit contains the measured curve, and a sweep contains its cases: kinds that contain others come first
KINDS = (
    Kind("plan", _marked("plan_over"), "findings.plans:plan", "plot.plans:plan", "parameters"),
    Kind("regimes", _marked("map_over"), "findings.others:regimes", "plot.maps:regimes", "parameters"),
    Kind("reconstruction", _marked("force_status"), "findings.others:reconstruction", "plot.reconstruction:reconstruction",
         figure="gui.measured.reconstruction:figure_of", lists=("distance",)),
    Kind("material", _marked("loss_tangent"), "findings.others:material", "", ""),
    Kind("fit", _marked("correlation"), "findings.fits:fit", "plot.fits:fit", "measured", lists=("parameter",)),
    Kind("identification", _marked("verdict"), "findings.others:identification", "", ""),
    Kind("thermal_spectrum", _marked("fitted_density"), "findings.others:thermal_spectrum", "plot.thermal:thermal_spectrum",
         pictures=OF_SPECTRA, own={DENSITIES: "plot.thermal:thermal_spectrum"}),
    Kind("measured", _marked("height"), "findings.others:measured", "plot.measured:measured", "measured", lists=("point",)),
    Kind("sweep", lambda dataset: bool(swept(dataset)), "findings.motions:sweep", "plot.sweeps:sweep_overview"),
    Kind("branches", _is_branches, "findings.motions:branches", "plot.branches:branches_overview",
         own={AMPLITUDE_AND_PHASE: "plot.branches:branches"}),
    Kind("basins", _marked("reached"), "findings.motions:basins", "plot.basins:basins",
         figure="gui.curves.other_figures:basins", lists=("state",)),
    Kind("force_curve", _is_force_curve, "findings.motions:force_curve", "plot.overview:forces", pictures=OF_RECORDS,
         own={("force",): "plot.forces:against_distance"}, lists=("distance", "time")),
    Kind("frequency_sweep", _is_frequency_sweep, "findings.motions:frequency_sweep", "plot.branches:resonance",
         own={AMPLITUDE_AND_PHASE: "plot.branches:resonance"}),
    Kind("dwell", _is_dwell, "findings.motions:dwell", "plot.overview:dwell", pictures=OF_RECORDS, own=RECORD),
    Kind("approach", _is_approach, "findings.motions:approach", "plot.overview:approach",
         own={AMPLITUDE_AND_PHASE: "plot.distances:amplitude_phase"}),
)  # fmt: skip


def kind_of(dataset: xr.Dataset) -> Kind | None:
    """Return the kind of a result; None for a Dataset that is no result."""
    return next((kind for kind in KINDS if kind.holds(dataset)), None)


def known_kind(dataset: xr.Dataset) -> Kind:
    """Return the kind of a result.

    Raises
    ------
    ParameterError
        For a Dataset that is not a result or has no finished point, and see :func:`check_shape`.
    """
    check_shape(dataset)
    kind = kind_of(dataset)
    if kind is None:
        check_computed(dataset)
        raise ParameterError(NO_RESULT)
    if kind.lists and not {*kind.lists} & {*dataset.dims}:
        dim = kind.lists[0]
        raise ParameterError(
            f"{kind.words} needs its dimension {dim}; choose a list along it, such as .isel({dim}=[0])"
        )
    return kind


def is_kind(dataset: xr.Dataset, *names: str) -> bool:
    """Return whether a result is of one of the named kinds.

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
