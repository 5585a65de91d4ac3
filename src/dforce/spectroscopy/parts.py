"""The parts of a force: its interactions along a motion, such as van der Waals, elastic contact and contact viscosity."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dforce.case import case_of
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, checked
from dforce.forces import Force
from dforce.results.dataset import describe
from dforce.results.provenance import of_case
from dforce.spectroscopy.evaluate import forces_at

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem


@checked
def force_parts(result: xr.Dataset) -> xr.Dataset:
    """Return the parts of the force in a force curve or a motion, by interaction.

    These forces are the total minus all other parts: forces with memory or two branches, and forces that depend on time. In a
    result without velocity, such as a force curve, so are forces that dissipate energy.

    Parameters
    ----------
    result
        Result of :func:`dforce.force_curve`, :func:`dforce.force_along` or a dwell, with its `distance` (m) and `force` (N).

    Returns
    -------
    xarray.Dataset
        `force_part` (N) over `interaction` and the dimensions of the force. The parts add up to the force.

    Raises
    ------
    ParameterError
        When the result has no force over a distance, or contains no case.
    """
    import xarray as xr

    if not {"distance", "force"} <= {*result.variables} or "force" not in result.data_vars:
        raise ParameterError("this result has no force over a distance; use df.force_curve or a dwell")
    case = case_of(result)
    force = result["force"].reset_coords(drop=True)
    given = result["distance"].variable
    shape = [size if dim in given.dims else 1 for dim, size in force.sizes.items()]
    ordered = given.transpose(*(dim for dim in force.dims if dim in given.dims)).values
    distance = np.broadcast_to(ordered.reshape(shape), force.shape)
    velocity = result["velocity"].values if "velocity" in result else None
    zc = float(result["zc"]) if "zc" in result.coords and result["zc"].ndim == 0 else None
    names, parts = parts_along(case.problem, distance, velocity, force.values, zc)
    data = xr.Dataset({"force_part": (("interaction", *force.dims), parts)}, {"interaction": names, **force.coords})
    return describe(data).assign_attrs(of_case(case, case.to_toml()))


def parts_along(
    problem: Problem, distance: Array, velocity: Array | None, force: Array, zc: float | None
) -> tuple[list[str], Array]:
    """Return the names of the parts of a force (N), and the parts, (parts, *shape of the force)."""
    found: dict[str, Array] = {}
    late: list[str] = []
    rates = np.zeros(force.shape) if velocity is None else velocity
    for one in problem.forces:
        if _needs_more(one, velocity is not None, zc is not None):
            late.append(_label(one))
            continue
        for part in one.parts():
            name = _label(part)
            found[name] = found.get(name, np.zeros(force.shape)) + forces_at(part, distance, rates, zc)
    if late:
        name = ", ".join(dict.fromkeys(late))
        found[name] = found.get(name, np.zeros(force.shape)) + force - sum(found.values())
    return list(found), np.array(list(found.values())).reshape(len(found), *force.shape)


def _label(force: Force) -> str:
    return ", ".join(force.contains) or force.name.replace("_", " ")


def _needs_more(force: Force, has_velocity: bool, has_place: bool) -> bool:
    """Return whether a force needs more than the motion at one time."""
    if force.memory or force.switch is not None or force.timed:
        return True
    return (force.dissipative and not has_velocity) or ("zc" in force.leading() and not has_place)
