"""The vocabulary in which solvers and observables are written.

The kernel defines each name here for one combination of modes and forces (see ``codegen``): the solvers' loops import these
names, and the linker replaces them by the composed functions. The functions here are never called.

Scaled quantities: length in the first tone's free amplitude, time in 1/omega of the first tone. The motion is a tuple
``y = (x1, v1, x2, v2, ...)`` of scaled deflections and velocities, and behind them velocities of fluid that follows late;
`p` is the tuple of all parameters. Distances `d`, their `rate`, the time `t`, forces and the forces' memory are in SI units.
"""

from __future__ import annotations

from typing import Any


def memory_size(memory: Any) -> int:
    """Return the number of numbers in the forces' memory."""
    raise NotImplementedError


def latch_count(latched: Any) -> int:
    """Return the number of forces with two branches."""
    raise NotImplementedError


def has_states() -> bool:
    """Return whether forces have a memory or branches: code for any forces is compiled with only this information."""
    raise NotImplementedError


def branches_begin(p: Any) -> int:
    """Return the column of a period's samples with the first branch, behind motion and memory; the force is in the last."""
    raise NotImplementedError


def mode_count() -> int:
    """Return the number of modes."""
    raise NotImplementedError


def fluid_size() -> int:
    """Return the number of states of the fluid's memory, of all modes."""
    raise NotImplementedError


def motion_size() -> int:
    """Return the number of numbers in a motion y."""
    raise NotImplementedError


def distance(y: Any, p: Any) -> float:
    """Return the tip–surface distance d (m)."""
    raise NotImplementedError


def rate_of(y: Any, p: Any) -> float:
    """Return the tip's velocity (m/s)."""
    raise NotImplementedError


def force(d: float, rate: float, t: float, memory: Any, latched: Any, p: Any) -> float:
    """Return the sum of all forces on the tip (N)."""
    raise NotImplementedError


def is_rooted(p: Any) -> bool:
    """Return whether a force begins like a root of the distance beside a kink."""
    raise NotImplementedError


def each_force(d: Any, rate: Any, t: float, step: float, out: Any, p: Any) -> None:
    """Write the force on the tip (N) at each of many distances, at times from t on; for forces without memory or branches."""
    raise NotImplementedError


def free_acceleration(u: Any, y: Any, p: Any) -> Any:
    """Return d2x/dtau2 of each mode under the drive `u` (one value per mode) without forces."""
    raise NotImplementedError


def forced(a: Any, f: float, p: Any) -> Any:
    """Return the accelerations of the modes with the part of the force `f` (N)."""
    raise NotImplementedError


def yielding(p: Any) -> float:
    """Return d2d/dtau2 of the tip for each force (m/N)."""
    raise NotImplementedError


def motion(u: Any, f: float, y: Any, p: Any) -> Any:
    """Return dy/dtau under the drive `u` (one value per mode) and the force `f` (N)."""
    raise NotImplementedError


def evolve(d: float, rate: float, t: float, memory: Any, change: Any, p: Any) -> None:
    """Write the rates of change of the forces' states (per scaled time) into `change`."""
    raise NotImplementedError


def switch(which: int, latched: Any, d: float, rate: float, t: float, p: Any) -> float:
    """Return the function of one latch that rises through zero where its branch changes."""
    raise NotImplementedError


def coasted(y: Any, h: float) -> Any:
    """Return the motion with each deflection increased by h times its velocity."""
    raise NotImplementedError


def bent(y: Any, h: float, a: Any) -> Any:
    """Return the motion with each deflection increased by h times the mode's `a`."""
    raise NotImplementedError


def pushed(y: Any, h: float, a: Any) -> Any:
    """Return the motion with each velocity increased by h times the mode's `a`."""
    raise NotImplementedError


def arrived(y: Any, h: float, a1: Any, a2: Any, a3: Any, a4: Any) -> Any:
    """Return the motion at the end of a Runge–Kutta step of length h from the four accelerations; `y` has coasted over it."""
    raise NotImplementedError


def fluid_slopes(y: Any, p: Any) -> Any:
    """Return the rates of change of the states of the fluid's memory."""
    raise NotImplementedError


def followed(y: Any, start: Any, h: float, slopes: Any) -> Any:
    """Return the motion y with the fluid's memory of another one, increased by h times these slopes."""
    raise NotImplementedError


def fluid_mean(k1: Any, k2: Any, k3: Any, k4: Any) -> Any:
    """Return the slope of the fluid's memory over a Runge–Kutta step from the slopes at its four stages."""
    raise NotImplementedError


def blend(y: Any, share1: float, y1: Any, share2: float, y2: Any) -> Any:
    """Return the motion y moved by shares of the ways to two others."""
    raise NotImplementedError


def column(lanes: Any, j: int) -> Any:
    """Return the motion y of lane j."""
    raise NotImplementedError


def put_column(lanes: Any, j: int, y: Any) -> None:
    """Write the motion y of lane j."""
    raise NotImplementedError


def parameters_of(table: Any, j: int) -> Any:
    """Return the parameter tuple p of lane j."""
    raise NotImplementedError


def unpacked(tip: Any) -> Any:
    """Return the parameter tuple p of a tip equation, for a function that is called by address."""
    raise NotImplementedError


def of_case(p: Any, table: Any, j: int, others: Any) -> Any:
    """Return the tip equation of lane j; `p` belongs to another lane, and `others` gets the numbers of lane j."""
    raise NotImplementedError


def shaped(room: Any, rows: int, columns: int, lanes: int) -> Any:
    """Return the beginning of an array of numbers as one of three dimensions, which lasts as long as that one."""
    raise NotImplementedError


def waves_at(waves: Any, i: int) -> Any:
    """Return cosine and minus sine of each tone at time i of a table (2 tones, times), as a tuple, as far as they count."""
    raise NotImplementedError


def lane_drive(amplitudes: Any, j: int, c: Any) -> Any:
    """Return the drive on each mode of lane j: the tones' amplitudes, (2 tones times modes, lanes), times the waves c."""
    raise NotImplementedError


def from_vector(vector: Any) -> Any:
    """Return the motion y that an array holds."""
    raise NotImplementedError


def row(table: Any, i: int) -> Any:
    """Return row i of a table with one column per mode, as a tuple."""
    raise NotImplementedError


def motion_of(samples: Any, i: int) -> Any:
    """Return the motion y at sample i of a recorded period."""
    raise NotImplementedError


def keep(samples: Any, i: int, y: Any) -> None:
    """Write the motion y as sample i of a recorded period."""
    raise NotImplementedError


def drive_at(tones: Any, bases: Any, tau: float) -> Any:
    """Return the drive on each mode at the scaled time `tau` within the period."""
    raise NotImplementedError


def drive_between(u0: Any, u1: Any, u2: Any, s: float) -> Any:
    """Return the drive at the share s of a step, by the parabola through its values at both ends and in the middle."""
    raise NotImplementedError
