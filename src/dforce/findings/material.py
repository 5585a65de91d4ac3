"""Modulus and viscosity from the observables of AM-FM and FM-FM, and where the usual formulas break."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from dforce.case import case_of
from dforce.core.errors import ParameterError, checked
from dforce.results.dataset import describe
from dforce.results.provenance import of_case
from dforce.validity import Advice, attributes

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case
    from dforce.core.arrays import Array

DERIVED = "derived for dForce; R. Garcia, R. Proksch, Eur. Polym. J. 49, 1897 (2013)"
PHASES = 4096  # points of a period, for the Fourier coefficients of the force
ATTRACTED = 0.05  # of the largest repulsive virial of a curve: more attraction is adhesion
# the terms that the formulas neglect: the largest share, and the words for the term
NEGLECTED = {
    "harmonics": (0.05, "Mode 2 also answers harmonics of tone 1 near its resonance, by {} of the indentation"),
    "path": (0.05, "The force changes the path of mode 1 by {} of its amplitude"),
    "amplitude_2": (0.3, "The amplitude of tone 2 is {} of the indentation"),
    "indentation": (0.2, "The indentation is {} of the amplitude of tone 1"),
    "signal": (0.002, "Other modes in the signal shift the free lock of tone 2 by {} from the resonance of mode 2"),
}


@checked
def material(curve: xr.Dataset, model: Literal["hertz", "punch", "cone"] = "hertz") -> xr.Dataset:
    r"""Return modulus, indentation and viscosity that the formulas of AM-FM find along a curve.

    .. math:: \langle k_\mathrm{ts} \rangle = k_2 \left[ (f_2 / f_{02})^2 - 1 \right] + F_2 \cos\phi_2 / A_2, \quad
              \delta = -\left( m + \tfrac{1}{2} \right) \frac{V_1}{A_1 \langle k_\mathrm{ts} \rangle}, \quad
              c = \frac{\pi \sqrt{2 A_1}\, \langle k_\mathrm{ts} \rangle}{m\, B(\tfrac{1}{2}, m)\, \delta^{m - 1/2}}, \quad
              \tan\rho = \frac{E_1}{2 \pi |V_1|} = \frac{\omega_1 \eta}{2 E_\mathrm{eff}}

    for a contact :math:`F = c\, \delta^m` without adhesion, with the virial and the energy of tone 1,

    .. math:: V_1 = \tfrac{1}{2} A_1 \left[ k_1 (1 - r_1^2) A_1 - F_1 \cos\phi_1 \right], \quad
              E_1 = \pi A_1 \left[ F_1 \sin\phi_1 - k_1 r_1 A_1 / Q_1 \right].

    The Dataset contains advice where a neglected effect is large.

    Source: derived here; R. Garcia, R. Proksch, Eur. Polym. J. 49, 1897 (2013) for the paraboloid on resonance.

    Parameters
    ----------
    curve
        A result of :func:`dforce.approach` or :func:`dforce.dwell` of two tones, the second with ``operation = "fm"``.
    model
        Shape of the tip: ``"hertz"`` a paraboloid and ``"punch"`` a flat punch of the tip's radius, ``"cone"`` a cone of its
        half angle.

    Returns
    -------
    xarray.Dataset
        `E_eff` (Pa), `estimated_indentation` (m), `estimated_viscosity` (Pa s, as in `kelvin_voigt`) and `loss_tangent`; NaN
        where tone 1 or mode 2 is attracted. `neglected` along `effect`: the size of each neglected effect, as a share. For
        comparison the simulated values: `true_E_eff`, `true_indentation`, `true_viscosity`.

    Raises
    ------
    ParameterError
        When the curve does not have two tones with the second locked, or the tip lacks a radius or half angle.
    """
    import xarray as xr

    case = case_of(curve)
    if len(case.problem.tones) != 2 or "frequency_shift" not in curve:
        raise ParameterError(
            'the curve needs two tones with a lock; write operation = "fm" in the second of drive.tones'
        )
    contact, seen = _contact(case, model), _observed(curve, case)
    found = estimate(seen, contact)
    shift = abs(seen.f0[1] / case.problem.modes[case.problem.tones[1].mode].f0 - 1.0)
    shares = neglected(seen, contact, found) | {"signal": np.full(found.E_eff.shape, shift)}
    dims = curve["mean_deflection"].dims
    variables = {
        "E_eff": (dims, found.E_eff),
        "estimated_indentation": (dims, found.indentation),
        "estimated_viscosity": (dims, found.viscosity),
        "loss_tangent": (dims, found.loss_tangent),
        "neglected": ((*dims, "effect"), np.stack(list(shares.values()), axis=-1)),
        "true_indentation": (dims, curve["max_indentation"].values),
    }
    for name in ("E_eff", "viscosity"):
        known = [float(getattr(force, name)) for force in case.problem.forces if getattr(force, name, None) is not None]
        variables |= {f"true_{name}": ((), np.array(known[0]))} if known else {}
    places = {dim: curve[dim] for dim in ("zc", "direction") if dim in curve.coords}
    data = xr.Dataset(variables, places | {"effect": list(shares)})
    data.attrs = of_case(case, curve.attrs["case"]) | {"model": model} | attributes(_advice(seen, shares))
    return describe(data)


class PowerContact(NamedTuple):
    """A contact F = E_eff s d^m: its power m, and s (m^(2 - m))."""

    power: float
    shape: float

    @classmethod
    def punch(cls, radius: float) -> PowerContact:
        """Return a flat punch of a radius (m)."""
        return cls(1.0, 2.0 * radius)

    @classmethod
    def paraboloid(cls, radius: float) -> PowerContact:
        """Return a paraboloid, as Hertz' sphere, of a radius (m)."""
        return cls(1.5, 4.0 / 3.0 * math.sqrt(radius))

    @classmethod
    def cone(cls, half_angle: float) -> PowerContact:
        """Return a cone of a half angle (rad)."""
        return cls(2.0, 2.0 / math.pi * math.tan(half_angle))


class Observed(NamedTuple):
    """Observables of both tones, in SI: `k`, `Q` and `f0` of both modes, (2,); frequencies and amplitudes, (2, points).

    `drive` (N) and `phase` (rad, lag behind this force) belong to tone 1, (points,). `pull` (N/m) is the part of the
    other drive in phase with mode 2, over its amplitude, (points,): 0 at a phase of 90 degrees.
    """

    k: Array
    Q: Array
    f0: Array
    frequency: Array
    amplitude: Array
    drive: Array
    phase: Array
    pull: Array | float = 0.0

    @property
    def mean_stiffness(self) -> Array:
        """Mean stiffness of the contact that mode 2 sees (N/m)."""
        return np.asarray(self.k[1] * ((self.frequency[1] / self.f0[1]) ** 2 - 1.0) + self.pull)

    @property
    def virial(self) -> Array:
        """Virial of tone 1 (J)."""
        A, r = self.amplitude[0], self.frequency[0] / self.f0[0]
        return np.asarray(0.5 * A * (self.k[0] * (1.0 - r**2) * A - self.drive * np.cos(self.phase)))

    @property
    def dissipated_energy(self) -> Array:
        """Energy that the sample takes from tone 1 per period (J)."""
        A, r = self.amplitude[0], self.frequency[0] / self.f0[0]
        return np.asarray(np.pi * A * (self.drive * np.sin(self.phase) - self.k[0] * r * A / self.Q[0]))


class Estimate(NamedTuple):
    """A contact from observables: effective modulus (Pa), indentation (m), viscosity (Pa s), loss tangent, peak force (N)."""

    E_eff: Array
    indentation: Array
    viscosity: Array
    loss_tangent: Array
    peak_force: Array


def estimate(seen: Observed, contact: PowerContact) -> Estimate:
    """Return the contact that the formulas find in observables; NaN where tone 1 or mode 2 is attracted."""
    m, A, stiffness, virial = contact.power, seen.amplitude[0], seen.mean_stiffness, seen.virial
    repels = (stiffness > 0.0) & (virial < 0.0)
    stiffness, virial = np.where(repels, stiffness, np.nan), np.where(repels, virial, np.nan)
    beta = math.sqrt(math.pi) * math.gamma(m) / math.gamma(m + 0.5)  # B(1/2, m)
    indentation = -(m + 0.5) * virial / (A * stiffness)
    c = np.pi * np.sqrt(2.0 * A) * stiffness / (m * beta * indentation ** (m - 0.5))
    modulus, tangent = c / contact.shape, -seen.dissipated_energy / (2.0 * np.pi * virial)
    return Estimate(modulus, indentation, modulus * tangent / (np.pi * seen.frequency[0]), tangent, c * indentation**m)


def neglected(seen: Observed, contact: PowerContact, found: Estimate) -> dict[str, Array]:
    """Return the terms that the formulas neglect, each as a share of the term assumed much larger, see `NEGLECTED`."""
    A, f1 = seen.amplitude[0], seen.frequency[0]
    theta = 2.0 * np.pi / PHASES * np.arange(PHASES)
    depth = 1.0 - A[..., None] / found.indentation[..., None] * (1.0 - np.cos(theta))
    force = found.peak_force[..., None] * np.where(depth > 0.0, np.abs(depth) ** contact.power, 0.0)
    answer = np.zeros_like(A)
    for beside in (-1.0, 0.0, 1.0):
        h = np.round(seen.f0[1] / f1) + beside
        r = h * f1 / seen.f0[1]
        pushed = 2.0 * (force * np.cos(h[..., None] * theta)).mean(axis=-1)
        with np.errstate(invalid="ignore"):
            answer += np.abs(pushed / (seen.k[1] * (1.0 - r**2 + 1j * r / seen.Q[1])))
    return {
        "harmonics": answer / found.indentation,
        "path": found.peak_force / (seen.k[0] * A),
        "amplitude_2": seen.amplitude[1] / found.indentation,
        "indentation": found.indentation / A,
    }


def _contact(case: Case, model: str) -> PowerContact:
    if model == "cone":
        if case.tip.half_angle is None:
            raise ParameterError("a cone needs tip.half_angle, which is missing; write half_angle under [tip]")
        return PowerContact.cone(case.tip.half_angle)
    radius = case.tip.radius or case.cantilever.tip_radius
    if radius is None:
        raise ParameterError(f"{model} needs tip.radius, which is missing; write radius under [tip]")
    return PowerContact.punch(radius) if model == "punch" else PowerContact.paraboloid(radius)


def _observed(curve: xr.Dataset, case: Case) -> Observed:
    """Return the observables of the instrument; resonances are at the free locks, where free motion lags by 90 degrees."""
    problem, tones = case.problem, case.problem.tones
    modes = [problem.modes[tone.mode] for tone in tones]
    f0 = [mode.f0 for mode in modes]
    names = ("drive_frequency", "amplitude", "drive_force", "phase")
    frequency, amplitude, drive, phase = (curve[name].transpose("tone", ...).values.copy() for name in names)
    lags = np.radians(phase)
    for j, (tone, mode) in enumerate(zip(tones, modes, strict=True)):
        # the signal and the motion of the mode keep their ratio, as every force acts on all modes
        ratio = complex(problem.free[j, tone.mode] / problem.detected_free[j])
        force = cmath.phase(complex(problem.drive[j, tone.mode]))
        if tone.lock is not None and "phase" in tone.lock.held:
            lags[j] = tone.lock.phase + force  # of the signal that the lock reads
            cot = 1.0 / math.tan(tone.lock.phase + force) / (2.0 * mode.Q)
            f0[j] = tone.frequency / (math.hypot(1.0, cot) - cot)
        else:
            lags[j] += force - cmath.phase(ratio)
        amplitude[j] *= abs(ratio)
    k, Q = (np.array([getattr(mode, name) for mode in modes]) for name in ("k", "Q"))
    pull = drive[1] * np.sin(0.5 * np.pi - lags[1]) / amplitude[1]  # exactly 0 at 90 degrees
    return Observed(k, Q, np.array(f0), frequency, amplitude, drive[0], lags[0], pull)


def _advice(seen: Observed, shares: dict[str, Array]) -> list[Advice]:
    """Return advice where the numbers are wrong."""
    pieces = []
    for name, (limit, text) in NEGLECTED.items():
        largest = float(np.max(shares[name], initial=0.0, where=np.isfinite(shares[name])))
        if largest > limit:
            effect = text.format(f"{100.0 * largest:.2g} %")
            said = f"{effect}. The formulas of AM-FM neglect this, so their modulus is wrong."
            pieces.append(Advice(f"material_{name}", largest, limit, said, DERIVED, ("drive.tones",)))
    pull, push = float(np.nanmax(seen.virial, initial=0.0)), -float(np.nanmin(seen.virial, initial=0.0))
    if push > 0.0 and pull > ATTRACTED * push:
        text = "The curve shows attraction. The formulas of AM-FM neglect adhesion: the modulus may be several times too large."
        pieces.append(Advice("material_adhesion", pull / push, ATTRACTED, text, DERIVED, ("forces",)))
    return pieces
