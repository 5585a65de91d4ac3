"""Which amounts in a result are above their estimated error: of the others a reader is shown "none"."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import Array, Bools
from dforce.core.errors import ParameterError, checked, nearest, shorten
from dforce.core.quantities import AMOUNTS, OBSERVABLES
from dforce.core.quantity import Scale
from dforce.observables.deviation import FAINT
from dforce.observables.finish import driving_tone
from dforce.results.dataset import COLUMN_DIMS
from dforce.solvers.settings import SolverSettings

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem
    from dforce.results.curves import Line

SCALE = "error_scale"  # attribute of an amount (SI): its estimated error is the result's error_estimate times this
ROUNDING = 1e-12  # of sums of force times distance
ERRORS = ("error_estimate", "peak_force", "min_force")  # quantities that give the errors of others
USUAL: float = SolverSettings.model_fields["accuracy"].default  # where no error was estimated


def with_scales(dataset: xr.Dataset, problem: Problem) -> xr.Dataset:
    """Write into each amount of a result the scale of its error, and return the result.

    The scales come from :mod:`dforce.observables.deviation`. The scale of forces is the largest force of each motion, from
    the result itself, and at least the scale from there.
    """
    first = problem.tones[0]
    of_modes = np.array([_energy(problem, n) for n in range(len(problem.modes))])
    of_tones = np.array([of_modes[tone.mode] for tone in problem.tones])
    scales = {
        Scale.LENGTH: first.A0,
        Scale.ENERGY: of_modes[0],
        Scale.POWER: of_modes[0] * first.frequency,
        Scale.PERIOD: 1.0 / first.frequency,
        Scale.ONE: 1.0,
        Scale.FORCE: FAINT * float(np.abs(problem.tip_drive).max()),
    }
    of_each = {"mode": of_modes, "tone": of_tones}  # energies
    for name in _scaled_by_case(dataset):
        variable = dataset.variables[name]
        scale = next((of_each[dim] for dim in of_each if dim in variable.dims), scales[OBSERVABLES[name].scale])
        variable.attrs[SCALE] = scale if np.size(scale) > 1 else float(np.ravel(scale)[0])
    return dataset


def scaled(dataset: xr.Dataset, problem: Problem) -> xr.Dataset:
    """Return a result with the scales: itself where it has them, else a copy."""
    if all(SCALE in dataset.variables[name].attrs for name in _scaled_by_case(dataset)):
        return dataset
    return with_scales(dataset.copy(), problem)


def _scaled_by_case(dataset: xr.Dataset) -> list[str]:
    """Return the amounts of a result whose errors have scales that follow from the case."""
    return [name for name in AMOUNTS if name in dataset.variables and name in OBSERVABLES]


def _energy(problem: Problem, n: int) -> float:
    """Return k A0 of a mode times the larger of A0, or A0 / Q for Q > 1, and the path of the base; A0 at its driving tone."""
    mode = problem.modes[n]
    free = float(abs(problem.free[driving_tone(problem, n), n]))
    return mode.k * free * max(free * min(1.0, 1.0 / mode.Q), float(np.abs(problem.base).max()))


@checked
def error_of(dataset: xr.Dataset, name: str) -> Array:
    """Return the estimated error (SI) of a quantity at each point of a result; 0 for quantities that are no amounts.

    Without an estimated error of the motion the default accuracy is used; without a scale in the result, the largest value
    in the same unit.

    Raises
    ------
    ParameterError
        When the result has no such quantity.
    """
    if name not in dataset.variables:
        raise ParameterError(
            f"this result has no '{shorten(name)}'{nearest(name, map(str, dataset.variables), 'printing the result')}"
        )
    variable = dataset.variables[name]
    if name not in AMOUNTS:
        return np.zeros(variable.shape)
    if name not in OBSERVABLES and {"force", "distance"} <= {*dataset.variables}:
        force, distance = dataset.variables["force"].values, dataset.variables["distance"].values
        return np.full(variable.shape, ROUNDING * float(np.nanmax(np.abs(force)) * np.ptp(distance)))
    share: Any = USUAL
    estimate = dataset.variables.get("error_estimate")
    if estimate is not None and {*estimate.dims} <= {*variable.dims}:
        share = _spread(np.where(np.isfinite(estimate.values), estimate.values, USUAL), estimate.dims, variable.dims)
    scale: Any = _alike(dataset, variable)
    if SCALE in variable.attrs:
        inner = [dim for dim in variable.dims if dim in COLUMN_DIMS]
        of_case = _spread(np.reshape(variable.attrs[SCALE], [-1] if inner else []), inner, variable.dims)
        scale = np.fmax(scale, of_case) if OBSERVABLES[name].scale == Scale.FORCE else of_case
    return np.asarray(np.broadcast_to(share * scale, variable.shape))


def _spread(values: Any, own: Sequence[Hashable], dims: Sequence[Hashable]) -> Any:
    """Return values with their dimensions in the order `dims`, and a length of 1 along missing dimensions."""
    values = np.transpose(values, [list(own).index(dim) for dim in dims if dim in own])
    return values[tuple(slice(None) if dim in own else None for dim in dims)]


def _alike(dataset: xr.Dataset, variable: xr.Variable) -> Any:
    """Return the largest size among the quantities with the unit of one: of forces at each point, of others in the result."""
    unit, of_forces = variable.attrs.get("units", "1"), variable.attrs.get("units") == "N"
    alike = [dataset.variables[name] for name in AMOUNTS if name in dataset.variables]
    sizes = [
        np.abs(one.values)
        for one in alike
        if one.attrs.get("units", "1") == unit and (one.dims == variable.dims or not of_forces)
    ]
    if of_forces:
        return np.fmax.reduce(sizes)
    return max(float(np.max(size, initial=0.0, where=np.isfinite(size))) for size in sizes)


@checked
def largest_error(dataset: xr.Dataset, name: str) -> float:
    """Return the largest estimated error (SI) of a quantity in a result; a line that stays below is drawn at 0."""
    error = error_of(dataset, name)
    return float(np.max(error, initial=0.0, where=np.isfinite(error)))


@checked
def is_none(dataset: xr.Dataset, name: str) -> Bools:
    """Return at which points of a result there is none of a quantity: it is below its estimated error.

    Of a peak force only repulsion counts, and of a lowest force only attraction.

    Raises
    ------
    ParameterError
        When the result has no such quantity.
    """
    error = error_of(dataset, name)
    if name not in AMOUNTS:
        return np.zeros(error.shape, dtype=bool)
    values, side = dataset.variables[name].values, {"peak_force": 1, "min_force": -1}.get(name)
    return np.asarray((side * values if side else np.abs(values)) <= error)


def along(values: Any, dims: Sequence[Hashable], line: Line) -> Any:
    """Return the values at the points of a line of a quantity with these dimensions."""
    inner = {dim: line.column for dim in dims if dim in COLUMN_DIMS}
    return values[tuple({**line.chosen, **inner}.get(str(dim), line.places) for dim in dims)]
