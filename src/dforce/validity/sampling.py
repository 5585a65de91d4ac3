"""Where the numerical solution is not accurate enough for the motion, or has not come to its end."""

from __future__ import annotations

import math

import numpy as np

from dforce.core.arrays import Array
from dforce.core.units import show_range
from dforce.forces.adhesion_hysteresis import AdhesionHysteresis
from dforce.observables.misfit import GROSS, MEASURED, OF_MODES, misfit
from dforce.results.status import Status, repeats
from dforce.solvers.integrator import sample_count
from dforce.validity._advice import JOINED, Advice, percent, shown
from dforce.validity._evidence import Evidence
from dforce.validity.laws import force_at

SEEN = 2e-4  # of the drive: 0.01 degrees at resonance; RK4 by itself may turn a mode by half of that
CLOSURE = 0.005  # of the mean force
GAINED = 0.05  # of the energy that the drive can give in a period
BEYOND = 1.5  # of the amplitude F Q / k at resonance; in a frequency sweep the drive differs a little from the case's
SWINGS = 12  # samples in an oscillation of the tip held by the contact; RK4 turns its phase by 2e-3 a bounce then
ENOUGH = 24  # the same where nothing is left to be seen
TOO_STEEP = (
    ". The force changes too steeply for the samples, so forces, energies and perhaps the state itself are wrong. "
    "Raise solver.points_per_period until this advice is gone."
)
MOST_ASKED = 65_536  # the largest solver.points_per_period
CLEVELAND = "conservation of energy: J. P. Cleveland et al., Appl. Phys. Lett. 72, 2613 (1998)"


def sampling(seen: Evidence) -> Advice | None:
    r"""Compare the mean force with the mean deflection: the difference shows the error of the sampling.

    Over any period of a steady motion :math:`\langle F \rangle = k \langle z \rangle`. Steep walls passed within few samples
    spoil the sum of the forces first. A motion that does not repeat begins and ends its record at different speeds.
    """
    force, deflection = seen.repeating("mean_force"), seen.repeating("mean_deflection")
    settings = seen.case.solver
    if not force.size or force.shape != deflection.shape or settings.settle == "fixed":
        return None
    k = 1.0 / sum(1.0 / mode.k for mode in seen.problem.modes)
    scale = float(np.abs([force, k * deflection]).max())
    left = settings.settle_tolerance if settings.method == "transient" else 1e-8  # of the settling, in free amplitudes
    error = float(np.abs(force - k * deflection).max()) - 10.0 * left * k * seen.problem.tones[0].A0
    if error <= CLOSURE * scale:
        return None
    why = JOINED if _is_of_another_case(_misfits(seen)) else TOO_STEEP
    return Advice(
        "sampling",
        error / scale,
        CLOSURE,
        f"The mean force and k times the mean deflection differ by {percent(error / scale)}, but are equal in a steady "
        f"motion{why}",
        "the mean of the equation of motion over a period: <F> = k <z>",
        ("solver.points_per_period",),
    )


def step_error(seen: Evidence) -> Advice | None:
    r"""Compare force and motion in each mode's equation at its tone: the difference shows the error of the steps.

    Over a period of a steady motion :math:`(k - m \omega^2 + i c \omega) X = D + f` with the complex amplitude :math:`X`, the
    drive :math:`D` and the force's component :math:`f`. The residual changes amplitude and phase as a spurious force
    would.
    """
    off = _misfits(seen)
    if off is None or not off.size or off.max() <= SEEN:
        return None
    found = float(off.max())
    text = (
        f"The error of the steps acts on the tip like a force of {percent(found)} of the drive. Phases are off by about "
        f"{math.degrees(found):.2g}° and energies by {percent(found)} of the largest energy from the drive; forces and the "
        "mean deflection may be off by more. Raise solver.points_per_period until this advice is gone."
    )
    if _is_of_another_case(off):
        text = f"The motions miss the tip equation of the case by {percent(found)} of the drive{JOINED}"
    return Advice(
        "step_error",
        found,
        SEEN,
        text,
        "the tip equation over a period, component by component",
        ("solver.points_per_period",),
    )


def _is_of_another_case(off: Array | None) -> bool:
    return off is not None and off.max(initial=0.0) > GROSS  # a run gives such a motion no numbers


def _misfits(seen: Evidence) -> Array | None:
    """Return by how much the tip equation is missed at the points that settled, in units of the drive."""
    result, settings = seen.result, seen.case.solver
    along_other = seen.along == "frequency" or getattr(seen.case.experiment, "parameter", None) is not None
    along_other |= seen.problem.heights is not None or seen.problem.is_locked
    if result is None or along_other or settings.settle == "fixed" or not {*MEASURED, "status"} <= {*result.variables}:
        return None
    settled = repeats(result.variables["status"].values)
    if seen.stable is not None:
        settled = settled & seen.stable
    values = {}
    for name in MEASURED:
        variable = result.variables[name]
        array = np.moveaxis(variable.values, variable.dims.index("mode"), -1) if name in OF_MODES else variable.values
        if array.shape[: settled.ndim] != settled.shape:
            return None
        values[name] = array[settled]
    off = misfit(seen.problem, values)
    # a transient may stop so far from its end, in free amplitudes; at resonance that takes as much of the drive
    left = settings.settle_tolerance if settings.method == "transient" else 0.0
    return off[np.isfinite(off)] - 100.0 * left


def contact_sampling(seen: Evidence) -> Advice | None:
    r"""Compare the samples with the fastest motion of the tip in contact.

    At the nearest distance the force acts as a spring :math:`\kappa = -\partial F/\partial d` and a dashpot
    :math:`-\partial F/\partial \dot d` between tip and sample. The fastest of the modes on it moves at the rate
    :math:`|\lambda|`, the largest eigenvalue of their linear equations. RK4 errs by :math:`(|\lambda| h)^4/120` in the phase
    and :math:`(|\lambda| h)^5/144` in the amplitude, a radian.
    """
    settings, problem = seen.case.solver, seen.problem
    if not seen.computed or settings.integrator != "rk4":
        return None
    nearest = seen.values("min_distance")
    if not nearest.size or nearest.min() >= problem.a0:
        return None

    rate, first = _fastest(seen, float(nearest.min())), problem.tones[0].frequency
    taken = seen.result.attrs.get("samples_per_period", 0) if seen.result is not None else 0
    samples = 2.0 * math.pi * first * (taken or sample_count(problem, settings)) / rate if rate > 0.0 else math.inf
    if samples >= SWINGS:
        return None
    needed = 256 * math.ceil(ENOUGH * rate / (2.0 * math.pi * first) / 256)
    way = (
        f"Raise solver.points_per_period to {needed}" if needed <= MOST_ASKED else 'Write solver.integrator = "engine"'
    )
    return Advice(
        "contact_sampling",
        samples,
        SWINGS,
        f"In contact the tip oscillates at {shown(rate / (2.0 * math.pi), 'Hz')}, with only {samples:.2g} samples per period. "
        f"Amplitudes, phases and forces may have errors of some percent, multipliers larger errors. {way}.",
        "the error terms of RK4 for a linear oscillator: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential "
        "Equations I, Springer (1993), chapter II",
        ("solver.points_per_period",),
    )


def _fastest(seen: Evidence, d: float) -> float:
    """Return the fastest rate (1/s) at which the modes move while the force holds the tip at a distance (m).

    It is zero where a law has no value.
    """
    modes = seen.problem.modes
    count, step = len(modes), 1e-4 * seen.problem.a0
    slow = step * seen.problem.tones[0].frequency
    spring = (_force(seen, d - step, 0.0) - _force(seen, d + step, 0.0)) / (2.0 * step)
    dashpot = (_force(seen, d, -slow) - _force(seen, d, slow)) / (2.0 * slow)
    if not math.isfinite(spring + dashpot):
        return 0.0
    own, Q = np.array([mode.oscillator for mode in modes]).T
    mass = np.array([mode.k for mode in modes]) / (2.0 * math.pi * own) ** 2
    damping = mass * 2.0 * math.pi * own / Q
    stiffness = np.diag([mode.k for mode in modes]) + max(spring, 0.0)
    linear = np.zeros((2 * count, 2 * count))
    linear[:count, count:] = np.eye(count)
    linear[count:, :count] = -stiffness / mass[:, None]
    linear[count:, count:] = -(np.diag(damping) + max(dashpot, 0.0)) / mass[:, None]
    return float(np.abs(np.linalg.eigvals(linear)).max())


def _force(seen: Evidence, d: float, rate: float) -> float:
    """Return the sum of the forces (N) in first contact."""
    return sum(force_at(seen, force, d, rate) for force in seen.problem.forces)


def energy_gained(seen: Evidence) -> Advice | None:
    """Look for points at which the sample gives energy, which nothing but an error or an active force can do."""
    array = seen.array("total_dissipated_energy")
    if array is None or any(force.timed for force in seen.problem.forces):
        return None
    given = -float(np.nanmin(array, initial=math.inf))
    problem = seen.problem
    sizes = np.abs(problem.free).max(axis=1) + np.abs(problem.base)
    most = float(math.pi * np.abs(problem.tip_drive).max(axis=1) @ sizes)
    if not given > GAINED * most:
        return None
    return Advice(
        "energy_gained",
        given,
        GAINED * most,
        f"The sample adds energy to the tip: {percent(given / most)} of the largest energy from the drive. A passive "
        "sample cannot add energy: the force is too steep for the samples. Raise solver.points_per_period, or correct your own "
        "force if it repels the tip more on retract than on approach.",
        CLEVELAND,
        ("solver.points_per_period", "forces"),
        "J",
    )


def amplitude_beyond_the_drive(seen: Evidence) -> Advice | None:
    """Look for amplitudes that the drive cannot maintain against the mode's damping over any passive sample."""
    problem = seen.problem
    array = seen.array("tip_amplitude" if problem.tip_differs else "amplitude")
    timed = any(force.timed for force in problem.forces)
    if array is None or len(problem.tones) > 1 or timed or problem.heights is not None:
        return None
    tone, mode = problem.tones[0], problem.modes[problem.tones[0].mode]
    lost = mode.stiffness(tone.frequency).imag
    most = float(abs(problem.tip_drive[0, tone.mode]) / lost + abs(problem.base[0]))
    found = float(np.nanmax(array, initial=0.0))
    if found <= BEYOND * most:
        return None
    return Advice(
        "amplitude_beyond_the_drive",
        found,
        BEYOND * most,
        f"The amplitude reaches {shown(found, 'm')}, but the drive can reach {shown(most, 'm')} at most: the force is "
        "too steep for the samples, and adds energy. Raise solver.points_per_period.",
        CLEVELAND,
        ("solver.points_per_period", "forces"),
        "m",
    )


def not_settled(seen: Evidence) -> Advice | None:
    """Count the points whose motion was still moving when the largest number of periods was reached."""
    status = seen.array("status")
    moving = 0 if status is None else int(np.count_nonzero(status == Status.NOT_SETTLED))
    if status is None or moving == 0:
        return None
    is_fixed = seen.case.solver.settle == "fixed"
    after, key = ("solver.periods", "periods") if is_fixed else ("the largest number of periods", "max_periods")
    return Advice(
        "not_settled",
        moving,
        0,
        f"{moving} of {status.size} points had not settled after {after}, so their values still depend on the start. Raise "
        f"solver.{key}, or look at one of them with a dwell.",
        "solver.settle_tolerance",
        (f"solver.{key}", "solver.settle_tolerance"),
    )


def inaccurate(seen: Evidence) -> Advice | None:
    """Count the points whose estimated error is above the accuracy asked for, or unknown."""
    status, error = seen.array("status"), seen.array("error_estimate")
    settings = seen.case.solver
    if status is None or error is None or error.shape != status.shape:
        return None
    off = status == Status.INACCURATE
    if not off.any() or settings.accuracy is None:
        return None
    known = error[off & np.isfinite(error)]
    amount = f"up to {percent(known.max())} of the scale of a quantity" if known.size else "unknown"
    steps = (
        "raise solver.points_per_period"
        if settings.method == "periodic"
        else "choose a smaller solver.settle_tolerance"
    )
    return Advice(
        "inaccurate",
        int(np.count_nonzero(off)),
        0,
        f"{np.count_nonzero(off)} of {status.size} points are less accurate than solver.accuracy = {settings.accuracy:.1g}: "
        f"their estimated error is {amount}. Use them with this error (error_estimate), or {steps}.",
        "solver.accuracy",
        ("solver.accuracy", "solver.points_per_period", "solver.settle_tolerance"),
    )


def unresolved(seen: Evidence) -> Advice | None:
    """Count the points without a result because of a steep force or a tip that sticks."""
    status = seen.array("status")
    lost = 0 if status is None else int(np.count_nonzero(status == Status.UNRESOLVED))
    if status is None or lost == 0 or held_tip(seen) is not None:
        return None
    cause = "the force is too steep for the samples, or the tip sticks"
    remedy = "Raise solver.points_per_period. If this does not help, use"
    jumping = next((force.name for force in seen.problem.forces if force.jumps()), None)
    if jumping is not None:
        cause, remedy = f"the tip may rest where the force {jumping} jumps", "More samples do not help there: use"
    return Advice(
        "unresolved",
        lost,
        0,
        f"{lost} of {status.size} points have no result: {cause}. {remedy} a larger A0 or a stiffer lever.",
        "solver.accuracy",
        ("solver.points_per_period", seen.of_tone(0, "A0"), seen.of_mode(seen.problem.tones[0].mode, "k")),
    )


def not_repeating(seen: Evidence) -> Advice | None:
    """Report along a curve over the distance where the motion does not repeat from period to period."""
    status, zc = seen.array("status"), seen.array("zc")
    if status is None or zc is None or seen.along != "zc":
        return None
    wanders = status == Status.NOT_REPEATING
    if not wanders.any():
        return None
    there = zc[wanders if wanders.shape == zc.shape else wanders.any(axis=tuple(range(1, wanders.ndim)))]
    count, where = int(np.count_nonzero(wanders)), show_range(there.max(), there.min(), "m", 3)
    timed = next((force for force in seen.problem.forces if force.timed), None)
    why = (
        "A tap may take more energy than the drive gives in a period. Choose a larger A0, a stiffer lever or a lower Q."
    )
    if timed is not None:
        why = f"The force {timed.name} depends on time and may have another period: record the motion with a dwell."
    return Advice(
        "not_repeating",
        count,
        0,
        f"{count} of {status.size} points do not repeat from period to period ({where}): their amplitudes are means, and set "
        f"points there have no steady state. {why}",
        "solver.settle_tolerance",
        (seen.of_tone(0, "A0"), "experiment.zc"),
    )


def held_tip(seen: Evidence) -> Advice | None:
    """Compare adhesion hysteresis with the force of the spring at full amplitude, where points have no result."""
    status = seen.array("status")
    unresolved = 0 if status is None else int(np.count_nonzero(status == Status.UNRESOLVED))
    forces = [force for force in seen.problem.forces if isinstance(force, AdhesionHysteresis)]
    tone = seen.problem.tones[0]
    spring = seen.problem.modes[tone.mode].k * seen.free_motion(0)
    if status is None or unresolved == 0 or not forces or forces[0].retract_adhesion <= spring:
        return None
    adhesion = forces[0].retract_adhesion
    return Advice(
        "held_tip",
        adhesion,
        spring,
        f"{unresolved} of {status.size} points have no result, and the tip may stick to the sample. The adhesion on retract, "
        f"{shown(adhesion, 'N')}, exceeds the force of the spring at full amplitude, {shown(spring, 'N')}. Choose a stiffer "
        "lever, a larger amplitude or a smaller retract_energy; more samples do not help a tip that sticks.",
        "balance of forces on a tip at rest",
        (seen.of_mode(tone.mode, "k"), seen.of_tone(0, "A0"), "forces.adhesion_hysteresis"),
        "N",
    )


def jump_error(seen: Evidence) -> Advice | None:
    """Count the jumps whose places may be off by more than the accuracy asked for, or by an unknown amount."""
    off, accuracy = seen.array("jump_error"), seen.case.solver.accuracy
    if off is None or accuracy is None or not (off > accuracy).any():
        return None
    count, most = int(np.count_nonzero(off > accuracy)), float(np.nanmax(off))
    scale = "the linewidth f0/Q" if seen.along == "frequency" else "A0"
    amount = f"up to {most:.1g} of {scale}" if math.isfinite(most) else "an unknown amount"
    return Advice(
        "jump_error",
        count,
        0,
        f"The places of jumps may have an error of {amount}. For {count} of them it is above solver.accuracy = {accuracy:.1g}. "
        'Compare with the folds of experiment.kind = "branches", or raise solver.points_per_period.',
        "solver.accuracy",
        ("solver.accuracy", "solver.points_per_period"),
    )


def own_time(seen: Evidence) -> Advice | None:
    """Count the forces of time that may have another period than the drive, whose period is all that the solver looks at."""
    names = [force.name for force in seen.problem.forces if force.timed and force.own_frequency is None]
    if not names or seen.case.solver.method != "periodic":
        return None
    return Advice(
        "own_time",
        len(names),
        0,
        f"The force {names[0]} depends on time, and dForce assumes that it repeats with each period of the drive. If it "
        'does not, write solver.method = "transient".',
        "solver.method",
        ("forces", "solver.method"),
    )


PIECES = (
    sampling,
    step_error,
    contact_sampling,
    energy_gained,
    amplitude_beyond_the_drive,
    not_settled,
    inaccurate,
    unresolved,
    not_repeating,
    held_tip,
    jump_error,
    own_time,
)
