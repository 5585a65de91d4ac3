"""Approach: amplitude, phase and every other quantity against the average distance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pydantic

from dforce.experiments._experiment import (
    CaseLike,
    Distances,
    Experiment,
    Grid,
    Progress,
    Start,
    initial_motion,
    whole_range,
)
from dforce.experiments._restart import restore, stop
from dforce.parameters import param
from dforce.quantities import JUMPS

if TYPE_CHECKING:
    import xarray as xr

    from dforce.problem import Problem
    from dforce.solvers import SolverSettings
    from dforce.solvers.orbit import Jump


class Approach(Experiment):
    """The tip goes through a list of average distances and settles at each of them."""

    kind: Literal["approach"] = "approach"
    zc: Distances = param(unit="m", symbol="z_c", doc="average distances: a grid {start, stop, points} or a list")
    direction: Literal["approach", "retract", "both"] = pydantic.Field(
        "approach", description="approach (far to near), retract (near to far), or both one after the other"
    )
    carry_state: bool = pydantic.Field(
        True, description="start each distance from the motion at the one before; otherwise each from `start`"
    )
    start: Start = pydantic.Field("free", description="motion at the start: free, rest, or an amplitude and a phase")

    def distances(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return the average distances (m), as given."""
        return self.zc.values() if isinstance(self.zc, Grid) else np.array(self.zc)

    def visits(self) -> list[tuple[int, ...]]:
        """Return the places of the result in the order in which the tip comes to them."""
        far_to_near = [int(i) for i in np.argsort(-self.distances(), kind="stable")]
        if self.direction == "approach":
            return [(i,) for i in far_to_near]
        if self.direction == "retract":
            return [(i,) for i in reversed(far_to_near)]
        there, back = [(i, 0) for i in far_to_near], [(i, 1) for i in reversed(far_to_near)]
        return [*there, *back]

    @classmethod
    def suggested(cls, problem: Problem) -> dict[str, Any]:
        """Return typical distances; see :class:`Experiment`."""
        return {"zc": whole_range(problem)}

    def run(
        self, problem: Problem, settings: SolverSettings, progress: Progress, earlier: xr.Dataset | None = None,
        case: CaseLike | None = None,
    ) -> xr.Dataset:  # fmt: skip
        """Return the curve; see :class:`Experiment`."""
        from dforce.experiments._table import Table
        from dforce.results import Status
        from dforce.solvers.find import make_finder

        finder = make_finder(problem, settings, self.harmonics)
        integrator = finder.integrator
        zc, visits = self.distances(), self.visits()
        coords: dict[str, Any] = {"zc": zc}
        if self.direction == "both":
            coords["direction"] = ["approach", "retract"]
        table = Table(tuple(coords), coords, integrator)
        motion = initial_motion(integrator, self.start)
        done, before = 0, None
        if earlier is not None:
            done, motion = restore(table, earlier, visits, motion)
            finder.jumps += jumps_of(earlier)
            if done and self.carry_state:
                before = float(zc[visits[done - 1][0]])

        def watch() -> None:
            progress(done, len(visits), f"zc = {1e9 * zc[visits[done][0]]:.4g} nm")

        try:
            while done < len(visits):
                watch()
                to_come = [place[0] for place in visits[done:]]
                for found in finder.stretches(motion, zc[to_come if self.carry_state else to_come[:1]], watch, before):
                    table.put(visits[done : done + len(found)], found)
                    motion, done = found.motion, done + len(found)
                before = None
                # a motion that is no number cannot be carried on
                if not self.carry_state or not motion.is_finite:
                    motion = initial_motion(integrator, self.start, motion.period)
            progress(done, len(visits), "")
        except KeyboardInterrupt:
            pass
        table.write()
        for place in visits[done:]:
            table.status[place] = Status.NOT_COMPUTED  # even if stopped just before it counted as done
        jumps = {
            name: ("jump", [getattr(jump, name.removeprefix("jump_")) for jump in finder.jumps])
            for name in (JUMPS if finder.jumps else ())
        }
        data = table.dataset(jumps)
        data.attrs["samples_per_period"] = integrator.points
        if done < len(visits):
            stop(data, motion)
        return data


def jumps_of(data: xr.Dataset) -> list[Jump]:
    """Return the jumps that a result holds."""
    from dforce.solvers.orbit import Jump

    if "jump_zc" not in data:
        return []
    rows = zip(*(data[name].values for name in JUMPS), strict=True)
    return [Jump(float(zc), float(before), float(after), str(way)) for zc, before, after, way in rows]
