"""Where the point masses, the drive or the still lever behind the equation of motion are too simple."""

from __future__ import annotations

import cmath
import functools
import math

import numpy as np

from dforce.core.errors import ParameterError
from dforce.forces import Force
from dforce.forces.dlvo import BOLTZMANN
from dforce.instrument import Beam, Medium, ModeNumbers, beam
from dforce.validity._advice import Advice, percent, rounded, shown
from dforce.validity._evidence import Evidence

LINE_WIDTHS = 3.0
SHARP = 10.0  # Q from which on a mode has a line that a harmonic hits or misses
HIGHEST = 10  # harmonic that a tap still drives visibly
LEFT_OUT = 0.1  # of the indentation: the peak force then changes by 15 %
ATOMIC = 2.5  # diameter of an atom over the intermolecular distance
NOISY = 0.1  # of the free amplitude
BLURRED = 0.1  # change of the mean force by the thermal motion
ALWAYS = 0.999  # share of the period in contact
UNBENT = 0.01  # of the free amplitude


@functools.lru_cache(maxsize=16)
def _next_of_a_beam(given: Beam, medium: Medium) -> ModeNumbers:
    """Return the first mode of a beam that the case leaves out."""
    more = given.model_copy(update={"modes": given.modes + 1, "Q": given.Q + given.Q[-1:]})
    return more.resolve(medium)[-1]


@functools.lru_cache(maxsize=16)
def _ratio(n: int) -> float:
    """Return the ratio of the frequencies of modes n + 1 and n of a uniform beam."""
    return (beam.wavenumber(n + 1) / beam.wavenumber(n)) ** 2


def _next_mode(seen: Evidence) -> ModeNumbers | None:
    """Return the first mode of a rectangular beam that the case leaves out; its Q is at least the last mode's.

    None where no theory describes the flow around it.
    """
    given = seen.case.cantilever.beam
    if given is not None:
        try:
            return _next_of_a_beam(given, seen.case.medium)
        except ParameterError:
            return None
    last, ratio = seen.problem.modes[-1], _ratio(len(seen.problem.modes))
    return ModeNumbers(last.f0 * ratio, last.k * ratio**2, last.Q)


def mode_left_out(seen: Evidence) -> Advice | None:
    """Look for a harmonic that would move the next mode, which is left out.

    With a result, by how much: a harmonic of the deflection gives the force's harmonic, and so the other mode's motion.
    Without one, a strong harmonic of the drive within three line widths of the mode.
    """
    first, mode = seen.problem.tones[0], _next_mode(seen)
    if mode is None:
        return None
    order = round(mode.f0 / first.frequency)
    if not 2 <= order <= HIGHEST:
        return None
    detuning = abs(order * first.frequency - mode.f0) / (mode.f0 / mode.Q)
    about = (seen.of_mode(len(seen.problem.modes) - 1, "f0"), seen.of_tone(0, "frequency"))
    where = (
        f"Harmonic {order} of the drive is {rounded(detuning)} line widths from mode {len(seen.problem.modes) + 1} of a "
        "rectangular beam, and the case does not have this mode"
    )
    remedy = "Add the modes up to this one, as measured."
    if not seen.computed and detuning < LINE_WIDTHS and mode.Q >= SHARP:
        text = f"{where}: taps may excite it. {remedy}"
        return Advice("mode_left_out", detuning, LINE_WIDTHS, text, STARK, about)
    if not seen.deepest:
        return None
    largest, frequency = float(seen.harmonic(order).max(initial=0.0)), order * first.frequency
    here = sum(_response(one, frequency) for one in seen.problem.modes)
    moved = largest * abs(_response(mode, frequency) / here)
    if moved <= LEFT_OUT * seen.deepest:
        return None
    text = (
        f"{where}: it would move by about {shown(moved, 'm')}, {percent(moved / seen.deepest)} of the indentation, and change "
        f"the peak force. {remedy}"
    )
    return Advice("mode_left_out", moved, LEFT_OUT * seen.deepest, text, STARK, about, "m")


def static_vs_modal_k(seen: Evidence) -> Advice | None:
    """Compare the omitted modes' part of the mean deflection with the free amplitude."""
    modes, A0 = seen.problem.modes, seen.problem.tones[0].A0
    static = modes[0].k / beam.static_factor()
    missing = 1.0 - static * sum(1.0 / mode.k for mode in modes)
    bent, mean = seen.values("mean_deflection"), 0.0
    if bent.size:
        mean = float(bent[np.abs(bent).argmax()])
    if missing * abs(mean) <= UNBENT * A0:
        return None
    stiffer = missing / (1.0 - missing)
    given = "its first mode is" if len(modes) == 1 else f"its first {len(modes)} modes are"
    return Advice(
        "static_vs_modal_k",
        missing * abs(mean) / A0,
        UNBENT,
        f"The mean force bends the lever by {shown(abs(mean), 'm')}. A beam with all modes would bend by "
        f"{shown(stiffer * abs(mean), 'm')} more: under a static force {given} {percent(stiffer)} too stiff. Add one mode, "
        "or add this bending to zc.",
        "H.-J. Butt, M. Jaschke, Nanotechnology 6, 1 (1995): k of mode 1 is 1.0302 times the static k",
        (seen.of_mode(0, "k"),),
    )


STARK = "R. W. Stark, W. M. Heckl, Surf. Sci. 457, 219 (2000); the modes of a uniform beam"


def _response(mode: ModeNumbers, frequency: float) -> complex:
    """Return the deflection of a mode per force at a frequency (m/N)."""
    return complex(1.0 / mode.stiffness(frequency))


def drive_off_resonance(seen: Evidence) -> Advice | None:
    """Compare the frequency of a tone with the line of its mode, at which A0 is most often measured."""
    for number, tone in enumerate(seen.problem.tones):
        mode = seen.problem.modes[tone.mode]
        widths = abs(tone.frequency - mode.f0) / (mode.f0 / mode.Q)
        if widths > 1.0:
            at_f0 = float(abs(seen.problem.at_frequency(mode.f0, number).free[number, tone.mode]))
            peak = tone.A0 * at_f0 / seen.free_motion(number)
            return Advice(
                "drive_off_resonance",
                widths,
                1.0,
                f"The drive is {rounded(widths)} line widths off resonance, and A0 is the free amplitude there: at f0 the same "
                f"drive would reach {shown(peak, 'm')}. If A0 was measured at resonance, enter a smaller A0.",
                "the free response of the mode: F0 = k A0 sqrt((1 - r^2)^2 + (r/Q)^2)",
                (seen.of_tone(number, "frequency"), seen.of_tone(number, "A0")),
            )
    return None


def small_amplitude(seen: Evidence) -> Advice | None:
    """Compare the free motion of the tip at the first tone with the size of an atom."""
    problem = seen.problem
    tone, limit = problem.tones[0], ATOMIC * problem.a0
    A0 = abs(problem.free[0].sum() + problem.base[0] * cmath.exp(1j * tone.phase))
    if limit <= A0:
        return None
    return Advice(
        "small_amplitude",
        A0,
        limit,
        f"The free amplitude is {shown(A0, 'm')}, less than the diameter of an atom ({shown(limit, 'm')}): the tip then feels "
        "single atoms, but all forces here treat tip and sample as continuous. Use a larger A0, or use only the trend.",
        "J. N. Israelachvili, Intermolecular and Surface Forces, Academic Press (2011): a0 is an atom's diameter over 2.5",
        (seen.of_tone(0, "A0"), "contact.a0"),
        "m",
    )


def thermal_amplitude(seen: Evidence) -> Advice | None:
    """Compare the thermal motion of each driven mode, which is left out, with its free amplitude."""
    temperature = seen.case.medium.temperature
    for number, tone in enumerate(seen.problem.tones):
        mode = seen.problem.modes[tone.mode]
        moved, free = math.sqrt(BOLTZMANN * temperature / mode.k), seen.free_motion(number)
        if moved > NOISY * free:
            return Advice(
                "thermal_amplitude",
                moved,
                NOISY * free,
                f"The thermal motion of mode {tone.mode + 1} is {shown(moved, 'm')} (rms), {percent(moved / free)} of its "
                "free amplitude, and the model neglects it. Use a larger A0 or a stiffer cantilever, or treat the result as "
                "a mean.",
                EQUIPARTITION,
                (seen.of_tone(number, "A0"), seen.of_mode(tone.mode, "k")),
                "m",
            )
    return None


EQUIPARTITION = "equipartition, <z^2> = k_B T / k: H.-J. Butt, M. Jaschke, Nanotechnology 6, 1 (1995)"


def thermal_motion_and_force(seen: Evidence) -> Advice | None:
    r"""Compare the thermal motion with the indentation, or with the closest distance where there is no contact.

    At an amplitude far above both, the mean force goes as :math:`\delta^2` in Hertz' contact and as
    :math:`d^{-3/2}` in van der Waals attraction. Fluctuations of variance :math:`s^2` change these means by
    :math:`s^2/\delta^2` and :math:`\tfrac{15}{8} s^2/d^2`.
    """
    if not seen.computed or not seen.problem.forces:
        return None
    compliance = sum(1.0 / mode.k for mode in seen.problem.modes)
    moved = math.sqrt(BOLTZMANN * seen.case.medium.temperature * compliance)
    if seen.deepest:
        limit, length = math.sqrt(BLURRED) * seen.deepest, f"the indentation is {shown(seen.deepest, 'm')}"
    else:
        limit, length = (
            math.sqrt(BLURRED * 8.0 / 15.0) * seen.closest,
            f"the closest distance is {shown(seen.closest, 'm')}",
        )
    if moved <= limit:
        return None
    return Advice(
        "thermal_motion_and_force",
        moved,
        limit,
        f"The thermal motion is {shown(moved, 'm')} (rms), and {length}: it changes the mean force by more than 10 %, and "
        "jumps come earlier. The model neglects it. Use a stiffer cantilever, or treat forces and jumps as approximate.",
        EQUIPARTITION,
        (seen.of_mode(0, "k"), "medium.temperature"),
        "m",
    )


def snap_in(seen: Evidence) -> Advice | None:
    """Look for distances at which the attraction's gradient exceeds the spring constant, or the tip stays in contact."""
    k = 1.0 / sum(1.0 / mode.k for mode in seen.problem.modes)
    about = (seen.of_mode(0, "k"), "experiment.zc")
    if seen.computed:
        stays, mean_force = seen.values("contact_fraction"), seen.values("mean_force")
        if stays.shape != mean_force.shape or not np.any(held := (stays > ALWAYS) & (mean_force < 0.0)):
            return None
        count = int(np.count_nonzero(held))
        return Advice(
            "snap_in",
            count,
            0.0,
            f"At {count} of {held.size} points the sample pulls the tip and keeps it in contact: the lever has snapped in, and "
            "this is not tapping. Use larger distances, a larger A0 or a stiffer cantilever.",
            BURNHAM,
            about,
        )
    if seen.range_of_zc is None:
        return None
    at = _static_snap_in(seen.problem.forces, seen.problem.a0, k)
    nearest = seen.range_of_zc[0]
    if at is None or nearest >= at:
        return None
    return Advice(
        "snap_in",
        nearest,
        at,
        f"A still lever of this spring constant snaps in at {shown(at, 'm')}, where the gradient of the attraction exceeds k, "
        f"and the experiment goes down to {shown(nearest, 'm')}. There the tip stops tapping. Use larger distances or a "
        "stiffer cantilever.",
        BURNHAM,
        about,
        "m",
    )


BURNHAM = "N. A. Burnham, R. J. Colton, J. Vac. Sci. Technol. A 7, 2906 (1989): dF/dd > k"
FARTHEST, STEPS = 30e-9, 24  # m; beyond, no attraction pulls in a lever that is used for tapping


def _static_snap_in(forces: tuple[Force, ...], a0: float, k: float) -> float | None:
    """Return the average distance (m) at which a still tip that comes slowly snaps in; None where it does not.

    It rests where k (d - zc) = F(d); coming nearer, it snaps in where zc stops falling with d.
    """
    steady = [force for force in forces if force.leading() == ("d", "rate", "t") and not force.timed]
    laws = [(force.plain_law(), force.values()) for force in steady]
    ratio, d, last = (a0 / FARTHEST) ** (1.0 / STEPS), FARTHEST, math.inf
    for _ in range(STEPS):
        zc = d - sum(law(d, 0.0, 0.0, *values) for law, values in laws) / k
        if math.isnan(zc):
            return None  # a law without a value there
        if zc > last:
            return last
        d, last = d * ratio, zc
    return None


PIECES = (
    mode_left_out,
    static_vs_modal_k,
    drive_off_resonance,
    small_amplitude,
    thermal_amplitude,
    thermal_motion_and_force,
    snap_in,
)
