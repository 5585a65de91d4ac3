"""All forces of a case over a motion given by samples, or over a slow approach and retract."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core import units
from dforce.core.arrays import Array
from dforce.core.errors import ParameterError, checked, shorten
from dforce.core.parameter_quantity import ParameterQuantity
from dforce.forces import Force
from dforce.results.dataset import describe
from dforce.results.provenance import of_case
from dforce.spectroscopy.evaluate import Answer, Motion, follow, forces_at
from dforce.validity import advice, attributes

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case
    from dforce.problem import Problem

SPEED = "10 nm/s"  # of a force curve: the viscous force of a contact is then too small to measure
POINTS = 501
STEPS = 4000  # of a motion, at least, for the energy: few samples do not show where a contact begins
TOLERANCE, ROUGH = 1e-6, 1e-3  # of the memory's integration: for a result, and to choose the distances
FELT = 0.01  # of the largest attraction: a force curve starts where less than this is left
NEAREST_START, FARTHEST_START = 2e-9, 20e-9  # m; limits of that start
LEAST_DEPTH, MOST_DEPTH = 0.3e-9, 50e-9  # m; limits of the indentation shown


@checked
def force_along(case: Case, time: Any, distance: Any, zc: Any = None) -> xr.Dataset:
    r"""Return the forces of a case over a prescribed motion.

    Between the samples the motion is a cubic spline, also for the velocity. At the start the sample is relaxed, without neck or
    contact.

    Parameters
    ----------
    case
        Instrument, sample and forces; the cantilever does not take part.
    time
        Increasing times (s), shape (n,).
    distance
        Tip–surface distances (m) at these times, shape (n,).
    zc
        Average distance (m), for a force that depends on the deflection.

    Returns
    -------
    xarray.Dataset
        Over `time`: `distance` (m), `velocity` (m/s), `indentation` (m), `force` (N), `partial_force` (N) of
        each `model`, and `energy` (J), dissipated by the sample so far, :math:`-\int F \dot d\, dt`.

    Raises
    ------
    ParameterError
        For times that do not increase, numbers that are not finite, or shapes that do not match.
    """
    t, d = _numbers(time, "s", "time"), _numbers(distance, "m", "distance")
    if len(t) != len(d):
        raise ParameterError(f"time has {len(t)} values and distance {len(d)}; pass equal numbers")
    if not np.all(np.diff(t) > 0.0):
        raise ParameterError("the times do not increase")
    motion = _spline(t, d)
    parts = math.ceil(STEPS / (len(t) - 1))
    fine = np.interp(np.arange((len(t) - 1) * parts + 1) / parts, np.arange(len(t)), t)
    place = None if zc is None else _number(zc, "m", "zc")
    problem = case.problem
    answers = [_answer(force, motion, fine.tolist(), TOLERANCE, place) for force in problem.forces]
    variables = {
        "distance": d,
        "velocity": np.array([motion(moment)[1] for moment in t.tolist()]),
        "indentation": np.clip(problem.a0 - d, 0.0, None),
        "force": _sum([answer.force[::parts] for answer in answers], d),
        "energy": _sum([answer.energy[::parts] for answer in answers], d),
    }
    found = {name: ("time", values) for name, values in variables.items()}
    return _finished(found, {"time": t}, case, [answer.force[::parts] for answer in answers])


@checked
def force_curve(case: Case, distance: Any = None, speed: Any = None, zc: Any = None) -> xr.Dataset:
    """Return the forces of a case over a slow approach and retract.

    Parameters
    ----------
    case
        Instrument, sample and forces; the cantilever does not bend here.
    distance
        Distances (m), shape (n,), in any order; the tip goes from the largest to the smallest and back. Default: 501 from the
        range of the force to twice the indentation in tapping.
    speed
        Speed of the tip (m/s, or text with a unit); default: 10 nm/s.
    zc
        Average distance (m), for a force that depends on the deflection.

    Returns
    -------
    xarray.Dataset
        `force` (N) over `direction` ("approach", "retract") and `distance`, `partial_force` (N) of each
        `model`, and `energy` (J), dissipated by the sample over the loop.

    Raises
    ------
    ParameterError
        For fewer than two distances, numbers that are not finite, or a speed that is not above 0.
    """
    chosen = _number(SPEED if speed is None else speed, "m/s", "speed")
    if chosen <= 0.0:
        raise ParameterError(f"speed = {units.show(chosen, 'm/s')} is not above 0 m/s")
    place = None if zc is None else _number(zc, "m", "zc")
    given = _range(case.problem, chosen, place) if distance is None else _numbers(distance, "m", "distance")
    if np.ptp(given) == 0.0:
        raise ParameterError("a force curve needs at least two different distances")
    fine = _fine(case.problem.a0, given.min(), given.max())
    path, where = np.unique(-np.concatenate([given, fine]), return_inverse=True)
    back = where[: len(given)]
    answers = [_there_and_back(force, -path, chosen, TOLERANCE, place) for force in case.problem.forces]
    halves = [half[:, back] for half, _ in answers]
    found = {
        "force": (("direction", "distance"), _sum(halves, np.zeros((2, len(given))))),
        "energy": sum(energy for _, energy in answers),
    }
    return _finished(found, {"direction": ["approach", "retract"], "distance": given}, case, halves)


def _answer(force: Force, motion: Motion, times: Sequence[float], tolerance: float, zc: float | None) -> Answer:
    """Return a force over a motion; the many states of a memory are worth a compilation."""
    return follow(force, motion, times, compiled=force.evolve is not None, tolerance=tolerance, zc=zc)


def _there_and_back(force: Force, path: Array, speed: float, tolerance: float, zc: float | None) -> tuple[Array, float]:
    """Return a force over a straight way to the last distance of a path and back, (2, distances), and the energy it takes."""
    if force.is_of_distance_alone:
        there = forces_at(force, path, np.full(len(path), -speed))
        return np.tile(there, (2, 1)), 0.0 if np.isfinite(there).all() else math.nan
    far, near = float(path[0]), float(path[-1])
    turn = (far - near) / speed
    way = ((far - path) / speed).tolist()
    # the way back begins just after the turn: both have the nearest distance, each with its velocity
    times = [*way, math.nextafter(turn, math.inf), *(2.0 * turn - t for t in reversed(way[:-1]))]
    # without roundings: both ways have the very same distances
    given = dict(zip(times, [*path.tolist(), *reversed(path.tolist())], strict=True))

    def motion(t: float) -> tuple[float, float]:
        if t <= turn:
            return given.get(t, far - speed * t), -speed
        return given.get(t, near + speed * (t - turn)), speed

    answer = _answer(force, motion, times, tolerance, zc)
    there, back = np.split(answer.force, 2)
    return np.stack([there, back[::-1]]), float(answer.energy[-1])


def _fine(a0: float, near: float, far: float) -> Array:
    """Return distances (m) between two, dense where contact begins: the energy must not depend on the requested ones."""
    steps = np.concatenate([[0.0], np.geomspace(1e-12, max(far - a0, a0 - near, 1e-9), POINTS)])
    both = np.concatenate([a0 - steps, a0 + steps])
    return both[(both > near) & (both < far)]


def _range(problem: Problem, speed: float, zc: float | None) -> Array:
    r"""Return distances from the onset of the forces to the indentation of tapping.

    The indentation follows from the balance of the impulses in a period: the contact's, about
    :math:`\tfrac{1}{5} F \sqrt{2\delta/A_0}\, T` with the free amplitude of the tip, against the largest that the drive
    allows, about :math:`F_0 T/2`. Twice the indentation is shown.
    """
    depths = np.concatenate([[0.0], np.geomspace(1e-12, MOST_DEPTH, 80)])
    far = np.linspace(FARTHEST_START, problem.a0, 200)
    path = np.concatenate([far[:-1], problem.a0 - depths])
    total = np.zeros((2, len(path)))
    for force in problem.forces:
        total += np.nan_to_num(_there_and_back(force, path, speed, ROUGH, zc)[0])
    tone = problem.tones[0]
    pressing = total[0, len(far) - 1 :] * np.sqrt(2.0 * depths / (tone.A0 * problem.tip_share)) / 5.0
    reached = depths[pressing > 0.5 * tone.force]
    depth = max(LEAST_DEPTH, 2.0 * float(reached[0]) if len(reached) else LEAST_DEPTH)
    felt = np.abs(total).max(axis=0) > FELT * np.abs(total[:, total[0] <= 0.0]).max(initial=0.0)
    outermost = int(np.argmax(felt)) if felt.any() else len(path) - 1
    start = max(NEAREST_START, float(path[max(outermost - 1, 0)]))
    return np.linspace(start, problem.a0 - min(depth, MOST_DEPTH), POINTS)


def _number(given: object, unit: str, name: str) -> float:
    try:
        return ParameterQuantity(unit).read(given)
    except ParameterError as error:
        raise type(error)(f"{name} {error}") from None


def _numbers(given: object, unit: str, name: str) -> Array:
    """Return numbers in SI, given as an array or as a list of texts with units."""
    quantity = ParameterQuantity(unit)
    try:
        if isinstance(given, list | tuple) and any(isinstance(item, str) for item in given):
            values = np.array([quantity.read(item) for item in given])
        else:
            values = np.asarray(given, dtype=float)
            if values.size:
                quantity.read(float(values.flat[np.abs(values).argmax()]))
    except ParameterError as error:
        raise type(error)(f"{name} {error}") from None
    except (TypeError, ValueError):
        raise ParameterError(f"{name} = {shorten(given)} is not an array") from None
    if values.ndim != 1 or len(values) < 2:
        raise ParameterError(f"{name} is not a list of at least two numbers")
    if not np.isfinite(values).all():
        raise ParameterError(f"{name} has a value that is not a finite number")
    return values


def _spline(time: Array, distance: Array) -> Motion:
    """Return the cubic spline through samples of a motion, and its slope."""
    from scipy.interpolate import CubicSpline

    knots = time.tolist()
    pieces = CubicSpline(time, distance).c.T.tolist()

    def motion(t: float) -> tuple[float, float]:
        i = min(max(bisect_right(knots, t) - 1, 0), len(pieces) - 1)
        s = t - knots[i]
        a, b, c, d = pieces[i]
        return d + s * (c + s * (b + s * a)), c + s * (2.0 * b + 3.0 * s * a)

    return motion


def _sum(parts: Sequence[Array], like: Array) -> Array:
    return np.sum(parts, axis=0) if parts else np.zeros_like(like)


def _finished(found: dict[str, Any], coords: dict[str, Any], case: Case, parts: Sequence[Array]) -> xr.Dataset:
    """Return a Dataset with each model's share, the words of every quantity, and where the result comes from."""
    import xarray as xr

    names, dims = [force.name for force in case.forces], tuple(coords)
    if parts:
        found["partial_force"] = (
            ("model", *dims),
            np.stack([parts[place] for place in np.argsort(case.problem.places)]),
        )
        coords["model"] = [
            name if names.count(name) == 1 else f"{name}_{names[:place].count(name) + 1}"
            for place, name in enumerate(names)
        ]
    data = xr.Dataset(found, coords)
    data.attrs = of_case(case, case.to_toml()) | attributes(advice(case, data))
    return describe(data)
