"""The evidence for advice: a case and quantities of its result, each computed once."""

from __future__ import annotations

import functools
import math
from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.core.arrays import Array, Bools
from dforce.forces import Force
from dforce.results.significance import is_none, scaled
from dforce.results.status import Status, repeats

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case


class Evidence:
    """A case, its problem, and the values of its result at points whose motion can be trusted."""

    def __init__(self, case: Case, result: xr.Dataset | None) -> None:
        self.case, self.problem = case, case.problem
        self.result = None if result is None else scaled(_in_order(result), self.problem)
        self._values: dict[str, Array] = {}

    @property
    def computed(self) -> bool:
        """Whether there is a result with a steady motion in it."""
        return self.result is not None and "amplitude" in self.result.variables and self.values("amplitude").size > 0

    @property
    def is_force_curve(self) -> bool:
        """Whether the result is a force curve: a tip on a prescribed path, without a cantilever."""
        return self.result is not None and "force" in self.result.variables and "amplitude" not in self.result.variables

    # the case

    def force(self, *names: str) -> Force | None:
        """Return the first force that has one of these names."""
        return next((force for force in self.problem.forces if force.name in names), None)

    def path(self, force: Force, field: str = "") -> str:
        """Return the path of a force, or of one of its fields, in the case."""
        same = [other.name for other in self.problem.forces].count(force.name)
        place = force.name if same == 1 else str(1 + self.problem.places[self.problem.forces.index(force)])
        return f"forces.{place}.{field}" if field else f"forces.{place}"

    def of_mode(self, number: int, field: str) -> str:
        """Return the path of a number of a mode, counted from 0."""
        if self.case.cantilever.beam is not None:
            return "cantilever.beam"
        if number and self.case.cantilever.higher_modes:
            return f"cantilever.higher_modes.{number}.{field}"
        return f"cantilever.modes.{number + 1}.{field}" if self.case.cantilever.modes else f"cantilever.{field}"

    def of_tone(self, number: int, field: str) -> str:
        """Return the path of a number of a tone, counted from 0."""
        return f"drive.tones.{number + 1}.{field}" if self.case.drive.tones else f"drive.{field}"

    def free_motion(self, number: int) -> float:
        """Return the free amplitude (m) of a tone's own mode; the detector may read another one."""
        return float(abs(self.problem.free[number, self.problem.tones[number].mode]))

    @functools.cached_property
    def range_of_zc(self) -> tuple[float, float] | None:
        """Nearest and farthest average distance of the experiment (m), if known."""
        experiment = self.case.experiment
        return None if experiment is None else experiment.range_of_zc(self.problem)

    # the result

    def array(self, name: str) -> Array | None:
        """Return a variable of the result, as it is; of several tones or modes the first."""
        if self.result is None or name not in self.result.variables:
            return None
        variable = self.result.variables[name]
        return self._first_of(variable.dims, variable.values)

    @staticmethod
    def _first_of(dims: Sequence[Hashable], values: Any) -> Array:
        """Return values with these dimensions; of several tones or modes the first."""
        return np.asarray(values[tuple(0 if dim in ("tone", "mode") else slice(None) for dim in dims)])

    @functools.cached_property
    def stable(self) -> Bools | None:
        """Which points of branches are stable; None for other results."""
        array = self.array("stable")
        return None if array is None else np.asarray(array, dtype=bool)

    @functools.cached_property
    def _trusted(self) -> Bools | None:
        """Where the motion settled and is stable; None where a result does not show it."""
        status = self.array("status")
        if status is None:
            return None
        settled = np.asarray(repeats(status) | (status == Status.NOT_REPEATING))
        return settled if self.stable is None else self.stable & settled

    def values(self, name: str) -> Array:
        """Return the finite values of a variable at all points that can be trusted, in one row."""
        if name not in self._values:
            array = self.array(name)
            self._values[name] = np.empty(0) if array is None else self._known(array)
        return self._values[name]

    def repeating(self, name: str) -> Array:
        """Return :meth:`values` only at points whose motion repeats from period to period."""
        array, status = self.array(name), self.array("status")
        if array is None or status is None or status.shape != array.shape:
            return self.values(name)
        return self._known(np.where(repeats(status), array, np.nan))

    def _known(self, array: Array) -> Array:
        """Return the finite values of an array at all points that can be trusted, in one row."""
        trusted = self._trusted
        if trusted is not None and trusted.shape == array.shape:
            array = array[trusted]
        return array[np.isfinite(array)]

    def amounts(self, name: str) -> Array:
        """Return :meth:`values` of an amount, 0 where it is below its estimated error."""
        array = self.array(name)
        if array is None or self.result is None:
            return np.empty(0)
        none = self._first_of(self.result.variables[name].dims, is_none(self.result, name))
        return self._known(np.where(none, 0.0, array))

    def harmonic(self, order: int) -> Array:
        """Return the amplitudes of a harmonic at all points that can be trusted."""
        array, trusted = self.array("harmonic_amplitude"), self._trusted
        if array is None or trusted is None or trusted.shape != array.shape[:-1] or order > array.shape[-1]:
            return np.empty(0)
        chosen = array[..., order - 1][trusted]
        return np.asarray(chosen[np.isfinite(chosen)])

    @functools.cached_property
    def motion(self) -> Any:
        """Complex amplitude of the first tone at each point; NaN where it cannot be trusted, None without one."""
        amplitude, phase, trusted = self.array("amplitude"), self.array("phase"), self._trusted
        if amplitude is None or phase is None or trusted is None or trusted.shape != amplitude.shape:
            return None
        return np.where(trusted, amplitude * np.exp(1j * np.radians(phase)), np.nan)

    @functools.cached_property
    def along(self) -> str:
        """Dimension of a curve over distance or frequency; empty for other results."""
        dims = () if self.result is None or self.motion is None else self.result.variables["amplitude"].dims
        return next((dim for dim in ("zc", "frequency") if dim in dims), "")

    @functools.cached_property
    def curves(self) -> list[tuple[str, Array, Array]]:
        """Each curve over distance, from far to near: direction, distances, amplitudes of the first tone."""
        zc, motion = self.array("zc"), self.motion
        if self.along != "zc" or zc is None or motion.ndim > 2 or zc.size < 3:
            return []
        order = np.argsort(-zc)
        amplitudes = np.abs(motion[order]).reshape(zc.size, -1).T
        ways = ("approach", "retract") if len(amplitudes) == 2 else ("curve",)
        there = np.isfinite(amplitudes)
        return [(way, zc[order][is_], row[is_]) for way, row, is_ in zip(ways, amplitudes, there, strict=True)]

    def largest(self, name: str) -> float | None:
        """Return the largest value of a variable; None without one."""
        values = self.values(name)
        return float(values.max()) if values.size else None

    @functools.cached_property
    def closest(self) -> float:
        """Smallest tip–surface distance (m), a0 or more; without a result, the smallest of the free motion."""
        found = self.values("distance" if self.is_force_curve else "min_distance")
        if found.size:
            nearest = float(found.min())
        elif self.range_of_zc is not None:
            free = np.abs(self.problem.free).sum() + np.abs(self.problem.base).sum()
            nearest = self.range_of_zc[0] - float(free)
        else:
            nearest = 0.0
        return max(nearest, self.problem.a0)

    @functools.cached_property
    def deepest(self) -> float | None:
        """Largest indentation (m); without a result, the expected indentation of a Hertz contact, if it is one."""
        if self.is_force_curve:
            return None  # how deep it goes is the user's choice, and shown
        depths = self.amounts("max_indentation")
        return float(depths.max()) if depths.size else None if self.computed else self._expected_indentation()

    def _expected_indentation(self) -> float | None:
        r"""Return the indentation expected of one mode driven at resonance over Hertz' contact alone (m).

        Hertz' force, averaged over a harmonic motion whose amplitude A far exceeds the indentation, is
        :math:`\tfrac{3}{16} \sqrt{2/A}\, n \delta^2`, :math:`n = \tfrac{4}{3} E_\mathrm{eff} \sqrt R`. The mean force of a
        contact that dissipates nothing is :math:`\tfrac{1}{2} F_0 \sqrt{1 - A^2/A_0^2}` (from the virial).
        """
        hertz = self.force("hertz")
        problem, tone, stiffness = self.problem, self.problem.tones[0], hertz.numbers()[0] if hertz else 0.0
        single = len(problem.forces) == len(problem.modes) == len(problem.tones) == 1
        if not stiffness or not single or tone.frequency != problem.modes[0].f0 or self.range_of_zc is None:
            return None
        A0 = self.free_motion(0)
        near, far = (min(max(zc / A0, 0.0), 1.0) for zc in self.range_of_zc)
        ratio = min(max(near, math.sqrt(1.0 / 3.0)), far)  # largest at A = A0 / sqrt(3)
        mean_force = 0.5 * tone.force * math.sqrt(1.0 - ratio**2)
        return math.sqrt(16.0 / 3.0 * mean_force / stiffness * math.sqrt(0.5 * ratio * A0))


def _in_order(result: xr.Dataset) -> xr.Dataset:
    """Return a result with its dimensions in the order of a run, even if a user has transposed it."""
    dims = result.variables["amplitude"].dims if "amplitude" in result.variables else ()
    order = [dim for dim in ("zc", "frequency", "direction") if dim in dims]
    return result if [dim for dim in dims if dim in order] == order else result.transpose(*order, ...)
