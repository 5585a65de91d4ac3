"""Each piece of advice speaks where a model or a result stops meaning what it says, and is silent elsewhere."""

from __future__ import annotations

import json
import math
import re
import timeit

import numpy as np
import pytest
import xarray as xr
from every import every
from typer.testing import CliRunner

import dforce as df
from dforce.case.paths import value_at
from dforce.cli.app import app
from dforce.core.units import parse
from dforce.results.status import Status
from dforce.validity import PIECES, advice_in
from dforce.validity._evidence import Evidence
from dforce.validity.contact import pull_off

CALM = df.example("table-1-am")
AIR = df.example("figure-3-air")
STICKY = [df.forces.AdhesionHysteresis(), df.forces.Hertz()]
DMT, HERTZ, SPHERE = df.forces.DMT, df.forces.Hertz, df.forces.VanDerWaals
SALT = {"hamaker": 1e-20, "debye_length": "0.5 nm"}
LOW = SALT | {"tip_potential": "-20 mV", "sample_potential": "-10 mV"}


def over(*forces, case=CALM, **values):
    """A case with these forces, and values at paths written with two underscores."""
    for path, value in values.items():
        case = case.replace(path.replace("__", "."), value)
    return case.replace(forces=list(forces)) if forces else case


# far below resonance a lever follows its base: the tip moves by 100 nm, the deflection reads 0.26 nm
SLOW_BASE = over(drive={"excitation": "base", "base_amplitude": "100 nm", "frequency": "2.54 kHz"})


def dlvo(radius="50 nm", zc="15 nm", **given):
    """A sphere in water that stays clear of the sample."""
    case = CALM.replace(medium="water").replace("experiment.zc", zc)
    return over(df.forces.DLVO(**given), case=case, tip__radius=radius)


def tapping(case, zc=(4e-9,), **values):
    """The case with a result that holds these values at each distance."""
    zc = np.array(zc)
    inner = {"amplitude": ("zc", "tone"), "phase": ("zc", "tone"), "harmonic_amplitude": ("zc", "harmonic")}
    inner |= dict.fromkeys(("mode_amplitude", "mode_phase", "virial", "dissipated_energy"), ("zc", "mode"))
    values = {"amplitude": 4e-9, "phase": 60.0, "status": Status.OK} | values
    data = {}
    for name, value in values.items():
        array = np.asarray(value)
        if array.ndim < 2:
            array = np.broadcast_to(array, zc.shape)[:, None] if name in inner else np.broadcast_to(array, zc.shape)
        data[name] = inner.get(name, ("zc",)), array
    return case, xr.Dataset(data, {"zc": zc})


def jumping(*errors, case=CALM):
    """The case with a result that holds jumps with these errors."""
    return case, tapping(case)[1].assign(jump_error=("jump", list(errors)))


def balanced(off, case=CALM, **values):
    """A motion that the forces on it account for, but for a share of the drive."""
    (mode,), (tone,) = case.problem.modes, case.problem.tones
    c, r = 4e-9 * np.exp(-1j * math.radians(60.0)), tone.frequency / mode.f0
    work = (mode.k * (1.0 - r * r + 1j * r / mode.Q) * c - (1.0 + off) * tone.force) * np.conj(c)
    return tapping(
        case, mode_amplitude=4e-9, mode_phase=60.0, virial=work.real / 2.0, dissipated_energy=-math.pi * work.imag,
        mean_force=mode.k * 1e-11, mean_deflection=1e-11, **values,
    )  # fmt: skip


def harmonics(sixth):
    return np.array([[4e-9, 0.0, 0.0, 0.0, 0.0, sixth]])


def both_ways(other):
    """Two directions whose amplitudes differ by a share at one distance."""
    zc = np.array([6e-9, 5e-9, 4e-9])
    amplitude = np.stack([0.9 * zc, 0.9 * zc], axis=1)
    amplitude[1, 1] *= 1.0 + other
    data = {
        "amplitude": (("zc", "direction", "tone"), amplitude[..., None]),
        "phase": (("zc", "direction", "tone"), 0.0 * amplitude[..., None]),
    }
    data["status"] = ("zc", "direction"), np.zeros((3, 2), dtype=np.int8)
    return CALM, xr.Dataset(data, {"zc": zc, "direction": ["approach", "retract"]})


def noisy(phase, amplitude=1e-12, detector=None):
    """A curve with noise, read with 1 kHz."""
    case = CALM if detector is None else over(noise__detector=detector)
    n = len(phase)
    data = {name: (("zc", "tone"), np.full((n, 1), 4e-9)) for name in ("amplitude", "phase")}
    data |= {"phase_noise": (("zc", "tone"), np.array(phase)[:, None]), "status": ("zc", np.zeros(n, dtype=np.int8))}
    data["amplitude_noise"] = ("zc", "tone"), np.full((n, 1), amplitude)
    return case, xr.Dataset(data, {"zc": np.linspace(6e-9, 4e-9, n)}, {"noise_bandwidth": 1e3})


def branch(x, stable):
    """One branch along the distance."""
    n = len(x)
    data = {"amplitude": (("point", "tone"), np.full((n, 1), 1e-9)), "phase": (("point", "tone"), np.zeros((n, 1)))}
    data |= {"status": ("point", np.zeros(n, dtype=np.int8)), "stable": ("point", np.array(stable))}
    coords = {"zc": ("point", np.array(x), {"units": "m"}), "branch": ("point", np.ones(n, dtype=int))}
    return CALM, xr.Dataset(data, coords, {"along": "zc"})


def states(count):
    return CALM, xr.Dataset({"amplitude": (("state", "tone"), np.ones((count, 1)))})


RELATIVE = {"of": "drive.A0", "start": 1.2, "stop": 0.1, "points": 5}
TWO_LOCKED = over(
    cantilever={"modes": [{"f0": 49e3, "k": 0.9, "Q": 100}, {"f0": 282e3, "k": 28.0, "Q": 200}]},
    drive={"tones": [{"A0": "7 nm"}, {"A0": "0.1 nm", "operation": "fm"}]},
)
CONE = {"tip__half_angle": "20 deg", "sample__thickness": "1 um"}
TONE2 = {"cantilever": {"modes": [{"f0": 5e4, "k": 0.9, "Q": 100}, {"f0": 31e4, "k": 35, "Q": 200}]}}
BEAM = {
    "youngs_modulus": "169 GPa",
    "density": 2330,
    "length": "225 um",
    "width": "28 um",
    "thickness": "3 um",
    "Q": 60,
}
ALTERNATING = over(df.forces.Electrostatic(bias="1 V", ac_bias="1 V", ac_frequency=CALM.problem.tones[0].frequency))
OF_TIME = df.forces.Custom(law="P1*sin(t*1e4)", P1=1e-11)
LAYER = {"geometry": "sphere"}
STIFF = over(  # a soft lever over mica, in water
    DMT(hamaker="1.5e-20 J"), cantilever={"f0": "104 kHz", "k": "0.0763 N/m", "Q": 2.51}, drive={"A0": "14 nm"},
    tip__radius="92 nm", sample={"youngs_modulus": "30 GPa", "poisson_ratio": 0.3}, experiment__zc="7.21 nm",
)  # fmt: skip
VISCOUS = df.forces.KelvinVoigt(viscosity="1 Pa s")
KEPT = {"min_distance": 0.4e-9, "max_indentation": 0.0}

# Of each piece: the cases (with a result or without) in which it speaks, and those in which it is silent.
SPEAKS = {
    "unusual_value": [
        over(cantilever__k="40 kN/m"), over(tip__radius="10 um"), over(cantilever__f0="50 Hz"),
        over(drive__frequency=48.9), over(sample__youngs_modulus=1),
        over(experiment={"kind": "frequency_sweep", "zc": "5 nm", "frequency": [40, 60]}),
        over(sample__youngs_modulus="1 mPa"), over(drive__A0="10 um"), over(DMT(hamaker=2e-17)), over(DMT(hamaker=2e-24)),
    ],
    "law_without_value": [
        tapping(over(df.forces.Custom(law="1e-9*sqrt(d)")), (8e-9, 4e-9), status=[0, 4]),
        tapping(over(df.forces.Custom(law="1e-9*sqrt(velocity)")), status=5),
    ],
    "other_forces": [  # of Hertz 0.733 nN at an indentation of 0.5 nm
        tapping(over(HERTZ()), min_distance=-0.335e-9, min_force=0.0, peak_force=0.6e-9),
        tapping(over(HERTZ()), (5e-9, 4e-9), min_distance=-0.335e-9, min_force=0.0, peak_force=[0.733e-9, 0.8e-9]),
        tapping(over(HERTZ(), VISCOUS), min_distance=-0.335e-9, min_force=0.0, peak_force=0.6e-9),
    ],
    "sampling": [
        tapping(CALM, mean_force=1e-11, mean_deflection=1.01e-11 / 0.9),
        tapping(CALM, mean_force=0.0, mean_deflection=1e-12),
    ],
    "step_error": [balanced(3e-4), balanced(-3e-4), balanced(3e-4j)],
    "contact_sampling": [
        tapping(STIFF, min_distance=-0.07e-9),
        tapping(over(HERTZ(), df.forces.KelvinVoigt(viscosity="200 kPa s")), min_distance=-0.1e-9),
    ],
    "held_tip": [tapping(over(*STICKY, cantilever__k=0.1), (5e-9, 4e-9), status=[0, 5])],
    "jump_error": [jumping(3e-4, np.nan), jumping(1e-5, np.inf)],
    "energy_gained": [tapping(CALM, total_dissipated_energy=-1e-19), tapping(CALM, total_dissipated_energy=-1e-19, status=1)],
    "amplitude_beyond_the_drive": [tapping(CALM, amplitude=8e-9, status=1)],
    "not_settled": [tapping(CALM, (5e-9, 4e-9), status=[0, 1])],
    "inaccurate": [
        tapping(CALM, (5e-9, 4e-9), status=[0, 6], error_estimate=[1e-5, 3e-4]),
        tapping(over(solver__method="transient"), status=6, error_estimate=np.nan),
    ],
    "unresolved": [tapping(CALM, (5e-9, 4e-9), status=[0, 5])],
    "not_repeating": [tapping(CALM, (5e-9, 4e-9), status=[0, 2])],
    "own_time": [over(OF_TIME)],
    "tabor_of_dmt": [
        over(DMT(hamaker=0.8e-20)), over(SPHERE(hamaker=2e-20), HERTZ()), tapping(AIR, max_indentation=1e-10, peak_force=3e-9),
        over(df.forces.AdhesionHysteresis(), HERTZ()),
    ],
    "tabor_of_jkr": [over(df.forces.JKR(surface_energy="10 mJ/m^2"), sample__youngs_modulus="79 MPa")],
    "adhesion_left_out": [
        over(SPHERE(hamaker=2e-20, inside="off"), HERTZ()),
        tapping(over(SPHERE(hamaker=2e-20, inside="off"), HERTZ()), max_indentation=1e-10, peak_force=1e-9),
    ],
    "hamaker_and_surface_energy": [over(DMT(hamaker=2e-20, surface_energy="9.93 mJ/m^2"))],
    "indentation_and_radius": [
        df.example("figure-4-soft"), tapping(CALM, max_indentation=1.1e-9),
        tapping(over(df.forces.BottomEffect(**LAYER), **CONE), max_indentation=1.1e-9),
        tapping(over(df.forces.Tatara(), sample__radius="1 nm"), max_indentation=0.6e-9),
    ],
    "indentation_and_thickness": [
        tapping(over(sample__thickness="5 nm"), max_indentation=0.5e-9), over(sample__thickness="3 nm"),
        tapping(over(df.forces.Sneddon(geometry="cone"), **CONE), max_indentation=0.5e-6),
        tapping(over(df.forces.Sneddon(geometry="punch"), sample__thickness="5 nm"), max_indentation=1e-10),
    ],
    "indentation_beyond_the_model": [
        tapping(over(df.forces.BottomEffect(**LAYER), sample__thickness="1 nm"), max_indentation=2.1e-9),
        tapping(over(df.forces.BottomEffect(**LAYER, form="series"), sample__thickness="1 nm"), max_indentation=2e-10),
        tapping(over(df.forces.SLS(max_indentation="0.3 nm")), max_indentation=0.4e-9),
        tapping(over(df.forces.Tatara(), sample__radius="1 nm"), max_indentation=1e-7),
    ],
    "elements_in_contact": [
        tapping(over(df.forces.SLS(elements=16)), max_indentation=0.1e-9),
        tapping(over(df.forces.SLS()), max_indentation=1e-12),
    ],
    "counted_twice": [
        over(df.forces.KelvinVoigt(), df.forces.SLS()), over(HERTZ(), df.forces.Custom(law="P1*indentation**1.5", P1=1e4)),
    ],
    "attraction_of_a_small_sphere": [
        over(DMT(hamaker=2e-20), tip__radius="1 nm"), tapping(AIR, min_distance=0.5e-9), dlvo("5 nm", **LOW),
    ],
    "surface_potential": [
        dlvo(**SALT, tip_potential="-60 mV", sample_potential="-10 mV"),
        dlvo(**SALT, tip_charge="-50 mC/m^2", sample_charge="-10 mC/m^2"),
    ],
    "debye_length_and_gap": [dlvo(zc="4 nm", **LOW), tapping(dlvo(**LOW), min_distance=3e-10, peak_force=1e-11, min_force=0.0)],
    "debye_length_and_radius": [dlvo("4 nm", **LOW)],
    "low_Q": [over(cantilever__Q=2)],
    "base_in_liquid": [over(cantilever__Q=2, drive__excitation="base"), SLOW_BASE],
    "apparent_dissipation": [
        tapping(
            over(cantilever__Q=2, drive__excitation="base"), apparent_dissipated_energy=1e-15, total_dissipated_energy=0.0
        ),
    ],
    "free_lock": [over(cantilever__Q=2, drive__operation="fm", drive__phase_set_point="75 deg")],
    "harmonics_pull": [tapping(over(drive__operation="fm"), mean_force=1e-10, max_indentation=1e-10)],
    "false_dissipation": [
        tapping(over(cantilever__Q=2, drive__operation="fm"), dissipated_energy=1e-18, total_dissipated_energy=0.0),
    ],
    "sticks": [over(DMT(hamaker=2e-20), cantilever__k=0.01, drive__operation="fm")],
    "found_in_time": [tapping(TWO_LOCKED, mean_deflection=1e-12, settling_periods=1e4)],
    "nominal_sample": [over(sample="polystyrene")],
    "ideal_higher_mode": [over(cantilever={"f0": 71e3, "k": 2.1, "Q": 100, "higher_modes": [{"Q": 300}]})],
    "nominal_lever": [over(cantilever={"name": "FMR", "Q": 100}), over(cantilever={"name": "FMR", "k": 2.1, "Q": 100})],
    "mode_left_out": [
        over(cantilever__Q=50), over(cantilever={"beam": BEAM}),
        tapping(CALM, harmonic_amplitude=harmonics(5e-12), max_indentation=2e-10),
    ],
    "static_vs_modal_k": [
        tapping(CALM, mean_deflection=1.8e-9), tapping(CALM, mean_deflection=-1.8e-9),
        tapping(over(cantilever={"beam": BEAM | {"modes": 2, "Q": [200, 400]}}), mean_deflection=12e-9),
    ],
    "drive_off_resonance": [over(drive__frequency="48 kHz")],
    "begins_in_contact": [
        over(case=AIR, drive__A0="12 nm"), over(case=AIR, experiment__zc=RELATIVE | {"start": 1.01}),
        tapping(AIR, (12e-9, 11e-9), min_distance=[0.1e-9, -0.2e-9]),
    ],
    "small_amplitude": [over(drive__A0="0.2 nm")],
    "thermal_amplitude": [over(cantilever__k="0.01 N/m"), over(**TONE2, drive={"tones": [{"A0": 5e-9}, {"A0": 1e-10}]})],
    "thermal_motion_and_force": [tapping(CALM, max_indentation=1e-10), tapping(AIR, min_distance=0.2e-9, max_indentation=0.0)],
    "snap_in": [
        over(DMT(hamaker=2e-20), experiment__zc="0.3 nm"),
        tapping(AIR, (2e-9, 1e-9), contact_fraction=[0.1, 1.0], mean_force=[1e-12, -1e-10]),
    ],
    "noise_near_fold": [noisy([0.1, 0.1, 0.1, 0.1, 0.1, 0.6])],
    "detector_limited": [noisy([0.1] * 6, amplitude=3e-12, detector="50 fm/Hz^0.5")],
    "fluid_memory": [
        over(cantilever__Q=3, cantilever__f0="30 kHz", drive__frequency="15 kHz", medium="water"),
        tapping(over(cantilever__Q=3, medium="water"), harmonic_amplitude=np.array([[4e-9, 0.3e-9]])),
    ],
    "coexisting_states": [
        both_ways(0.02), branch([6e-9, 5e-9, 4e-9, 5e-9, 6e-9, 5e-9, 4e-9], [True] * 3 + [False] * 2 + [True] * 2), states(2),
        (CALM, tapping(CALM)[1].assign(jump_zc=("jump", [3e-9]))),
        (CALM, tapping(CALM)[1].assign(jump_frequency=("jump", [48e3]))),
    ],
    "set_point_met_twice": [tapping(CALM, (6e-9, 5e-9, 4e-9, 3e-9), amplitude=[5e-9, 4e-9, 4.2e-9, 3e-9])],
    "set_point_unreachable": [tapping(CALM, (3e-9, 2.8e-9, 2.6e-9), amplitude=[2e-9, 1.8e-9, 0.1e-9])],
}  # fmt: skip
SILENT = {
    "unusual_value": [CALM, AIR, over(cantilever__k="0.03 N/m", cantilever__f0="7 kHz", sample__youngs_modulus="1 kPa")],
    "law_without_value": [
        tapping(over(df.forces.Custom(law="1e-9*sqrt(d)")), status=0), tapping(CALM, status=4),
        tapping(over(df.forces.Custom(law="1e-9*sqrt(max(d, a0))")), status=4),
    ],
    "other_forces": [
        tapping(over(HERTZ()), min_distance=-0.335e-9, min_force=0.0, peak_force=0.733e-9),
        tapping(over(HERTZ()), min_distance=-0.335e-9, min_force=0.0, peak_force=0.6e-9, status=5),
        tapping(over(HERTZ(), VISCOUS), min_distance=-0.335e-9, min_force=0.0, peak_force=0.8e-9),
    ],
    "sampling": [
        tapping(CALM, mean_force=1e-11, mean_deflection=1.002e-11 / 0.9),
        tapping(CALM, (5e-9, 4e-9), mean_force=[1e-11, 1e-16], mean_deflection=[1e-11 / 0.9, 2e-16]),
        tapping(CALM, (5e-9, 4e-9), mean_force=1e-11, mean_deflection=[1e-11 / 0.9, 2e-11], status=[0, 2]),
        tapping(over(solver__settle="fixed", solver__method="transient"), mean_force=1e-11, mean_deflection=1.02e-11 / 0.9),
    ],
    "step_error": [
        balanced(1.5e-4), balanced(3e-4, status=Status.NOT_SETTLED), tapping(CALM),
        balanced(3e-4, over(solver__settle="fixed", solver__method="transient")),
    ],
    "contact_sampling": [
        tapping(CALM, min_distance=-0.06e-9), tapping(STIFF, min_distance=0.2e-9), tapping(STIFF),
        tapping(over(case=STIFF, solver__points_per_period=1024), min_distance=-0.07e-9),
        tapping(over(case=STIFF, solver={"method": "transient", "integrator": "engine"}), min_distance=-0.07e-9),
    ],
    "energy_gained": [
        tapping(CALM, total_dissipated_energy=2e-20), tapping(CALM, total_dissipated_energy=-2e-20),
        tapping(ALTERNATING, total_dissipated_energy=-1e-19),
    ],
    "amplitude_beyond_the_drive": [
        tapping(CALM, amplitude=5.2e-9), tapping(df.example("table-1-bimodal"), amplitude=8e-9),
        tapping(over(drive__frequency="48 kHz"), amplitude=8e-9), tapping(ALTERNATING, amplitude=8e-9),
    ],
    "not_settled": [tapping(CALM, (5e-9, 4e-9), status=[0, 2])],
    "inaccurate": [
        tapping(CALM, error_estimate=1e-5), tapping(CALM, (5e-9, 4e-9), status=[0, 5], error_estimate=[1e-5, np.nan]),
    ],
    "unresolved": [tapping(CALM, status=6), tapping(over(*STICKY, cantilever__k=0.1), status=5)],
    "not_repeating": [tapping(CALM, (5e-9, 4e-9), status=[0, 1])],
    "held_tip": [
        tapping(over(*STICKY, cantilever__k=0.1), status=0), tapping(over(*STICKY, cantilever__k=10.0), status=5),
        tapping(over(cantilever__k=0.1), status=5), over(*STICKY, cantilever__k=0.1),
    ],
    "jump_error": [
        jumping(9e-5, np.nan), jumping(np.nan), jumping(3e-4, case=over(solver__accuracy=1e-3)), tapping(CALM),
        jumping(3e-4, case=over(solver__points_per_period=256)),
    ],
    "own_time": [CALM, ALTERNATING, over(OF_TIME, solver={"method": "transient"})],
    "tabor_of_dmt": [
        CALM, over(DMT(hamaker=2e-20), sample__youngs_modulus="50 GPa"),
        over(df.forces.MaugisDugdale(surface_energy="10 mJ/m^2")),
        over(SPHERE(hamaker=2e-20, inside="off"), HERTZ()), tapping(AIR, max_indentation=0.0, peak_force=0.0),
        tapping(AIR, max_indentation=1e-9, peak_force=1e-8),
    ],
    "tabor_of_jkr": [over(df.forces.JKR(surface_energy="10 mJ/m^2"), sample__youngs_modulus="22 MPa")],
    "adhesion_left_out": [
        over(SPHERE(hamaker=2e-20), HERTZ()), CALM,
        tapping(over(SPHERE(hamaker=2e-20, inside="off"), HERTZ()), max_indentation=1e-10, peak_force=1e-8),
    ],
    "hamaker_and_surface_energy": [over(DMT(hamaker=2e-20, surface_energy="9.79 mJ/m^2")), AIR],
    "indentation_and_radius": [
        CALM, tapping(CALM, max_indentation=0.9e-9), tapping(over(df.forces.Sneddon(geometry="punch")), max_indentation=5e-9),
    ],
    "indentation_and_thickness": [
        CALM, tapping(over(sample__thickness="15 nm"), max_indentation=0.5e-9),
        tapping(over(df.forces.BottomEffect(**LAYER), sample__thickness="5 nm"), max_indentation=0.5e-9),
    ],
    "indentation_beyond_the_model": [
        tapping(over(df.forces.BottomEffect(**LAYER), sample__thickness="1 nm"), max_indentation=1.9e-9),
        tapping(over(df.forces.SLS()), max_indentation=1e-9),
    ],
    "elements_in_contact": [
        tapping(over(df.forces.SLS()), max_indentation=0.1e-9), tapping(over(df.forces.SLS(elements=24)), max_indentation=1e-9),
        tapping(over(df.forces.SLS(elements=4, relaxed_modulus="0.99 GPa")), max_indentation=1e-9),
        over(df.forces.SLS(elements=4)),
        tapping(over(df.forces.SLS(elements=24, max_indentation="0.5 nm")), max_indentation=0.1e-9),
    ],
    "counted_twice": [
        over(HERTZ(), df.forces.KelvinVoigt()), over(HERTZ(), df.forces.Custom(law="-P1/max(d, a0)**2", P1=1e-29)),
        over(df.forces.Custom(law="P1*indentation**1.5", P1=1e4)), over(HERTZ(), df.forces.Custom(law="1/(d - a0 + 0.5e-9)")),
    ],
    "attraction_of_a_small_sphere": [
        CALM, AIR, tapping(AIR, min_distance=0.19e-9), over(SPHERE(hamaker=2e-20, geometry="exact_sphere"), tip__radius="1 nm"),
    ],
    "surface_potential": [
        dlvo(**LOW), dlvo(**SALT, tip_potential="-25 mV", sample_potential="-10 mV"),
        dlvo(**SALT, tip_potential="-60 mV", sample_potential="-10 mV", variant="gouy_chapman"),
    ],
    "debye_length_and_gap": [
        dlvo(**LOW), dlvo(zc="4 nm", **LOW, variant="constant_charge_exact"),
        tapping(dlvo(**LOW), min_distance=3e-10, peak_force=1e-8, min_force=0.0),
    ],
    "debye_length_and_radius": [dlvo(**LOW)],
    "low_Q": [CALM, over(cantilever__Q=10), over(cantilever__Q=2, drive__excitation="base")],
    "base_in_liquid": [CALM, over(cantilever__Q=2), over(drive__excitation="base")],
    "apparent_dissipation": [
        tapping(over(cantilever__Q=2), apparent_dissipated_energy=1e-15, total_dissipated_energy=0.0),
        tapping(over(drive__excitation="base"), apparent_dissipated_energy=1e-22, total_dissipated_energy=0.0),
    ],
    "free_lock": [CALM, over(drive__operation="fm"), over(drive__operation="pm")],
    "harmonics_pull": [
        tapping(CALM, mean_force=1e-10, max_indentation=1e-10),
        tapping(over(drive__operation="fm"), mean_force=1e-12, max_indentation=1e-9),
    ],
    "false_dissipation": [
        tapping(over(cantilever__Q=2), dissipated_energy=1e-18, total_dissipated_energy=0.0),
        tapping(over(cantilever__Q=2, drive__operation="fm"), dissipated_energy=1e-18, total_dissipated_energy=1e-18),
    ],
    "sticks": [
        over(DMT(hamaker=2e-20), cantilever__k=0.01), over(DMT(hamaker=2e-20), cantilever__k=10.0, drive__operation="fm"),
        tapping(over(DMT(hamaker=2e-20), cantilever__k=0.01, drive__operation="fm")),
    ],
    "found_in_time": [
        TWO_LOCKED, tapping(TWO_LOCKED, mean_deflection=1e-12), tapping(CALM, mean_deflection=1e-12, settling_periods=1e4),
    ],
    "nominal_sample": [CALM, over(sample={"name": "polystyrene", "youngs_modulus": "2 GPa"})],
    "ideal_higher_mode": [
        CALM, over(cantilever={"f0": 71e3, "k": 2.1, "Q": 100, "higher_modes": [{"f0": 440e3, "k": 80, "Q": 300}]}),
    ],
    "nominal_lever": [CALM, over(cantilever={"name": "FMR", "f0": 71e3, "k": 2.1, "Q": 100})],
    "mode_left_out": [
        CALM, over(cantilever__Q=5), over(cantilever={"beam": BEAM | {"Q": 200}}), df.example("figure-6"),
        tapping(over(cantilever__Q=50), harmonic_amplitude=harmonics(1e-12), max_indentation=2e-10),
    ],
    "static_vs_modal_k": [
        CALM, tapping(CALM), tapping(CALM, mean_deflection=1.6e-9),
        tapping(over(cantilever={"beam": BEAM | {"modes": 2, "Q": [200, 400]}}), mean_deflection=8e-9),
        tapping(
            over(cantilever={"modes": [{"f0": 5e4, "k": 1.0, "Q": 100}, {"f0": 3e5, "k": 20.0, "Q": 300}]}),
            mean_deflection=9e-9,
        ),
    ],
    "drive_off_resonance": [CALM, over(drive__frequency="48.9 kHz"), over(drive__frequency="40 kHz", cantilever__Q=2)],
    "begins_in_contact": [
        CALM, AIR, over(case=AIR, drive__A0="12 nm", experiment__direction="retract"),
        over(case=AIR, drive__A0="12 nm", experiment__zc=RELATIVE), tapping(AIR, (12e-9, 11e-9), min_distance=[2e-9, -0.2e-9]),
        tapping(AIR, (12e-9, 11e-9), min_distance=[0.2e-9, 0.2e-9]),
    ],
    "small_amplitude": [CALM, over(drive__A0="0.5 nm"), SLOW_BASE],
    "thermal_amplitude": [CALM, over(drive__A0="1 nm"), over(cantilever__k="0.01 N/m", medium={"temperature": "4 K"})],
    "thermal_motion_and_force": [CALM, tapping(CALM, max_indentation=0.3e-9), tapping(AIR, **KEPT)],
    "snap_in": [
        AIR, over(DMT(hamaker=2e-20), experiment__zc="0.5 nm"), tapping(AIR, contact_fraction=1.0, mean_force=1e-10),
        tapping(AIR, contact_fraction=0.5, mean_force=-1e-10), over(df.forces.Custom(law="1/(d - a0)")),
    ],
    "noise_near_fold": [noisy([0.1, 0.1, 0.1, 0.1, 0.1, 0.4]), CALM],
    "detector_limited": [
        noisy([0.1] * 6, amplitude=4e-12, detector="50 fm/Hz^0.5"), noisy([0.1] * 6, amplitude=3e-12),
    ],
    "fluid_memory": [
        over(cantilever__Q=3, medium="water"), over(cantilever__Q=3, cantilever__f0="30 kHz", drive__frequency="15 kHz"),
        over(cantilever__f0="30 kHz", drive__frequency="15 kHz", medium="water"),
        tapping(over(cantilever__Q=3, medium="water"), harmonic_amplitude=np.array([[4e-9, 0.1e-9]])),
    ],
    "coexisting_states": [both_ways(0.005), branch([6e-9, 5e-9, 4e-9], [True] * 3), states(1), CALM],
    "set_point_met_twice": [tapping(CALM, (6e-9, 5e-9, 4e-9), amplitude=[5e-9, 4e-9, 4.01e-9])],
    "set_point_unreachable": [
        tapping(CALM, (3e-9, 2.8e-9, 2.6e-9), amplitude=[2e-9, 1.8e-9, 1.6e-9]),
        tapping(CALM, (3e-9, 2.8e-9, 2.6e-9, 2.4e-9), amplitude=[2e-9, 1.0e-9, 1.7e-9, 1.5e-9]),
    ],
}  # fmt: skip
CLASSES = [model.__name__ for model in df.forces.REGISTRY.values()]
# paths, sections, keys and choices of a case file; names of classes and functions
FILE_WORDS = re.compile(
    r"\b[a-z]\w*\.[a-zA-Z_]\w*|\[\w+\]|\b[a-zA-Z]+_[a-z]\w*|\w = \"|\bdf\.|"
    + "|".join(rf"\b{name}\b" for name in CLASSES if re.search("[a-z][A-Z]", name))
)
UNREAD = (
    "maugis dugdale",
    "kelvin voigt",
    "sls simple",
    "van der waals",
    "lennard jones",
)  # keys that are not yet names
BY_NAME = {piece.__name__: piece for piece in PIECES}


def given(example):
    return example if isinstance(example, tuple) else (example, None)


def pairs(table):
    return [(name, example) for name, row in table.items() for example in row]


def test_advice_does_not_ask_for_the_flow_of_a_mode_that_takes_no_part():
    beam = BEAM | {"width": "28 um", "modes": 2, "tip_height": "15 um", "tilt": "11 deg"}
    wet = CALM.replace(medium="water", cantilever={"beam": {key: value for key, value in beam.items() if key != "Q"}})
    # mode 3 has Re = 1974 there, which no table of the flow at a wall knows
    assert "mode_left_out" not in {piece.name for piece in df.advice(wet)}


def test_the_fluid_is_asked_about_a_shaken_base_only_where_it_damps_the_lever():
    liquid = over(cantilever__Q=2, drive__excitation="base")
    for case, asked in ((liquid, True), (SLOW_BASE, False)):
        (piece,) = [one for one in df.advice(case) if one.name == "base_in_liquid"]
        assert ("fluid_follows" in piece.text) is asked
        assert ("base_amplitude under [drive]" in piece.text) is not asked


def test_a_motion_that_does_not_repeat_is_blamed_on_a_force_of_time_and_on_taps_without_one():
    for case, why in ((CALM, "A tap may take more energy"), (ALTERNATING, "The force electrostatic depends on time")):
        (found,) = (
            one for one in df.advice(*tapping(case, status=Status.NOT_REPEATING)) if one.name == "not_repeating"
        )
        assert why in found.text


def test_distances_as_shares_of_the_free_amplitude_are_those_in_meters():
    shares = {"of": "drive.A0", "start": 1.2, "stop": 0.03, "points": 11}
    grids = [shares, {"start": "12 nm", "stop": "0.3 nm", "points": 11}]
    told = [df.advice(AIR.replace("experiment", {"kind": "approach", "zc": grid})) for grid in grids]
    assert "snap_in" in {piece.name for piece in told[1]}
    assert [piece.name for piece in told[0]] == [piece.name for piece in told[1]]


def test_a_curve_that_begins_in_contact_is_told_by_the_dataset_the_command_line_and_sweeps(tmp_path):
    case = AIR.replace("drive.A0", "13 nm").set("experiment.zc.points=23")
    result = df.run(case)
    (piece,) = [one for one in advice_in(result) if one.name == "begins_in_contact"]
    assert "begins at 12 nm" in piece.text and "the closest distance there is" in piece.text
    (tmp_path / "case.toml").write_text(case.to_toml())
    assert "begins at 12 nm" in CliRunner().invoke(app, ["check", str(tmp_path / "case.toml")]).stdout
    done = CliRunner().invoke(app, ["run", str(tmp_path / "case.toml"), "-o", str(tmp_path / "out.nc")])
    assert "advice: The approach begins at 12 nm" in done.stdout + done.stderr
    over = {"drive.A0": ["8 nm", "13 nm"]}
    for more in ({}, {"at_set_point": 0.8}, {"at_set_point": 0.8, "store": tmp_path / "map.zarr"}):
        grid = df.sweep(case, over=over, **more)
        (piece,) = [one for one in advice_in(grid) if one.name == "begins_in_contact"]
        assert piece.text.startswith("At drive.A0 = 13 nm: The approach begins at 12 nm")


def test_every_piece_has_a_case_where_it_speaks_and_one_where_it_is_silent():
    assert set(SPEAKS) == set(SILENT) == set(BY_NAME)
    assert all(SPEAKS.values()) and all(SILENT.values())


@every(pairs(SPEAKS), lambda pair: pair[0])
def test_it_speaks(name, example):
    case, result = given(example)
    piece = BY_NAME[name](Evidence(case, result))
    assert piece is not None
    assert piece in df.advice(case, result)
    assert piece.name == name
    assert math.isfinite(piece.found) and math.isfinite(piece.limit) and piece.found != piece.limit
    assert piece.text.endswith(".") and 1 <= piece.text.count(". ") + 1 <= 3 and "\n" not in piece.text
    assert piece.source and piece.about
    for path in piece.about:
        value_at(case, path)  # says so when the case has no such path
    parse(1.0, piece.unit)


@every(pairs(SPEAKS), lambda pair: pair[0])
def test_it_speaks_in_the_words_of_the_window_there(name, example):
    words = pytest.importorskip("dforce.gui.case.fields")
    document = pytest.importorskip("dforce.gui.document.document").Document
    case, result = given(example)
    for piece in df.advice(case, result):
        text = words.with_labels(document.of(case), piece.text)
        assert not FILE_WORDS.search(text), text
        assert not [key for key in UNREAD if key in text], text
        assert not text[0].islower() or text.startswith("f0 "), text


@every(pairs(SILENT), lambda pair: pair[0])
def test_it_is_silent(name, example):
    assert BY_NAME[name](Evidence(*given(example))) is None


def test_advice_is_read_back_from_a_result_and_its_file(tmp_path):
    result = df.run(AIR)
    (piece,) = df.advice(AIR, result)
    assert piece.name == "thermal_motion_and_force"
    assert result.attrs["advice"] == piece.text
    df.write(result, tmp_path / "air.nc")
    df.write(result, tmp_path / "air.csv")
    assert advice_in(df.read(tmp_path / "air.nc")) == [piece]
    assert json.dumps(piece.text, ensure_ascii=False) in (tmp_path / "air.csv").read_text(encoding="utf-8")


def test_a_calm_case_gives_no_advice():
    assert df.advice(CALM) == []
    result = df.run(CALM)
    assert result.attrs["advice"] == ""
    assert advice_in(result) == df.advice(CALM, result) == []


def test_the_tabor_parameter_says_how_far_the_adhesion_is_off():
    # R W^2 / (E_eff^2 a0^3) to the power 1/3, with W twice the 0.00389727439466 J/m^2 that 0.8e-20 J implies
    found = next(piece for piece in df.advice(over(DMT(hamaker="0.8e-20 J"))) if piece.name == "tabor_of_dmt").found
    E_eff = 1e9 / 0.91
    assert found == pytest.approx((2e-9 * (2 * 0.00389727439466) ** 2 / (E_eff**2 * 0.165e-9**3)) ** (1 / 3), rel=1e-9)
    assert pull_off(0.0) == 2.0 and pull_off(1e3) == pytest.approx(1.5, abs=0.01)  # DMT and JKR, over pi W R


@pytest.mark.parametrize("example", ["table-1-am", "figure-4-hard", "figure-4-soft"])
def test_the_indentation_expected_before_a_run_is_that_of_the_run(example):
    case = df.example(example)
    # the estimate takes the indentation for small against the amplitude; on the soft sample it is half of it
    assert Evidence(case, None).deepest == pytest.approx(Evidence(case, df.run(case)).deepest, rel=0.1)


def test_the_error_of_a_thin_sample_is_the_one_that_the_bottom_effect_makes():
    thin = over(sample__thickness="3 nm")
    (piece,) = (
        one for one in df.advice(*tapping(thin, max_indentation=0.5e-9)) if one.name == "indentation_and_thickness"
    )
    depth = 0.165e-9 - np.array([0.5e-9, 0.4e-9])
    forces = [
        df.force_curve(thin.replace(forces=[model]), distance=depth).force.values.max()
        for model in (HERTZ(), df.forces.BottomEffect(**LAYER))
    ]
    assert piece.found == pytest.approx(1 - forces[0] / forces[1], rel=0.01)  # the series is 1e-3 off there


def test_a_still_lever_snaps_in_where_the_gradient_of_the_attraction_reaches_its_spring_constant():
    case = over(DMT(hamaker=2e-20), experiment__zc="0.2 nm")
    (piece,) = (one for one in df.advice(case) if one.name == "snap_in")
    c = 2e-20 * 2e-9 / 6
    d = (2 * c / 0.9) ** (1 / 3)
    assert piece.limit == pytest.approx(d + c / (0.9 * d**2), rel=0.03)  # sampled by 24 distances


@pytest.mark.long
def test_a_steep_wall_passed_in_too_few_samples_is_told():
    wall = df.forces.LennardJones(work_of_adhesion="50 mJ/m^2")
    case = over(wall, cantilever__Q=5, drive__A0="10 nm", solver__method="transient")
    start = {"amplitude": "5 nm", "phase": "30 deg"}
    # the coarse motion is chaotic
    coarse, fine = (
        df.approach(
            case.replace("solver.points_per_period", samples),
            zc={"start": "5.2 nm", "stop": "4.8 nm", "points": distances}, start=start, protocol="stepwise",
            carry_state=False,
        )
        for samples, distances in ((256, 33), (4096, 5))
    )  # fmt: skip
    assert "sampling" in {piece.name for piece in advice_in(coarse)}
    assert not {"amplitude_beyond_the_drive", "sampling"} & {piece.name for piece in advice_in(fine)}


def test_a_contact_sampled_too_coarsely_is_told_and_the_samples_advised_are_enough():
    coarse = df.run(STIFF.replace("solver.points_per_period", 256))
    (piece,) = (one for one in advice_in(coarse) if one.name == "contact_sampling")
    advised = int(piece.text.rstrip(".").split()[-1])
    better, best = (df.run(STIFF.replace("solver.points_per_period", points)) for points in (advised, 8 * advised))
    assert "contact_sampling" not in {one.name for one in advice_in(better)}
    assert abs(float(coarse.phase[0] - best.phase[0])) > 1.0
    assert abs(float(better.phase[0] - best.phase[0])) < 0.05
    assert float(better.peak_force) == pytest.approx(float(best.peak_force), rel=1e-3)


def test_the_mean_force_is_off_by_about_as_much_as_the_advice_on_the_sampling_says(monkeypatch):
    # left as they are, instead of found again with more samples
    monkeypatch.setattr("dforce.procedures.statuses.is_wrong", lambda *found: np.zeros(1, dtype=bool))
    wall = df.forces.LennardJones(work_of_adhesion="50 mJ/m^2")
    case = over(wall, cantilever__Q=5, experiment__zc="5 nm", drive__A0="10 nm", solver__method="transient")
    case = case.replace("experiment.start", {"amplitude": "5 nm", "phase": "30 deg"})
    coarse, fine = (df.run(case.replace("solver.points_per_period", points)) for points in (768, 8192))
    (piece,) = (one for one in advice_in(coarse) if one.name == "sampling")
    assert piece.found == pytest.approx(abs(float(coarse.mean_force / fine.mean_force) - 1), rel=0.5)


def test_a_force_curve_is_told_of_its_forces_alone():
    slack = over(DMT(hamaker=2e-20), cantilever__Q=2)
    assert [piece.name for piece in advice_in(df.force_curve(slack))] == ["tabor_of_dmt"]
    assert {piece.name for piece in df.advice(slack)} == {"tabor_of_dmt", "low_Q"}


def test_a_continued_run_is_advised_on_as_a_whole(every_look):
    case = AIR.replace("experiment.zc", {"start": "12 nm", "stop": "3 nm", "points": 181}).set(
        "experiment.direction=approach"
    )

    def stop(done, total, note):
        if 5 <= done < total:
            raise KeyboardInterrupt

    part = df.run(case, progress=stop)
    assert part.attrs["interrupted"]
    whole = df.run(case, resume=part)
    assert advice_in(whole) == df.advice(case, df.run(case)) != advice_in(part)


def test_advice_costs_little_beside_a_run():
    result = df.run(CALM)
    once = min(timeit.repeat(lambda: df.advice(CALM, result), number=10, repeat=5)) / 10
    whole = min(timeit.repeat(lambda: df.run(CALM), number=1, repeat=5))  # the advice included
    assert once < 0.5 * whole  # timed in one go, so that a busy machine slows both


@pytest.mark.parametrize("name", sorted(df.forces.REGISTRY))
def test_every_force_model_can_be_advised_on(name):
    model = df.forces.REGISTRY[name]
    # instrument values for the models that ask for more than the example has
    more = {"tip.half_angle": "20 deg", "sample.thickness": "500 nm", "sample.radius": "50 nm", "medium": "water"}
    case = CALM
    for path, value in more.items():
        case = case.replace(path, value)
    pieces = df.advice(case.replace(forces=[model(**model.example)]))
    assert all(piece.text for piece in pieces)


@pytest.mark.slow
def test_advice_takes_a_result_alone_which_tells_its_case():
    case = df.example("figure-3-air-jump")
    result = df.run(case)
    assert df.advice(result) == df.advice(case, result) == advice_in(result) != []
    assert df.advice(result.transpose("direction", ...)) == df.advice(result)
    swept = df.sweep(case, over={"drive.A0": ["9 nm", "10 nm"]})
    assert df.advice(swept) == advice_in(swept) != []


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda result: df.advice(result, result), "both arguments are results"),
        (lambda result: df.advice(result.drop_attrs()), "does not contain its case"),
    ],
)
def test_advice_on_a_result_that_tells_no_case_is_refused_in_a_sentence(call, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        call(df.force_curve(df.example("figure-3-air")))


def test_motions_that_a_fixed_number_of_periods_leaves_unsettled_need_more_of_these():
    solver = {"method": "transient", "integrator": "rk4", "settle": "fixed", "periods": 50}
    curve = df.approach(df.example("figure-3-air").replace(solver=solver), ["11 nm", "9 nm"])
    said = next(piece for piece in df.advice(curve) if piece.name == "not_settled")
    assert "after solver.periods, " in said.text and "Raise solver.periods," in said.text
    assert said.about == ("solver.periods", "solver.settle_tolerance")
    assert df.answer(curve).endswith("settled. Raise the number of periods to settle.")
    longer = df.approach(df.example("figure-3-air").replace(solver=solver | {"periods": 5000}), ["11 nm", "9 nm"])
    assert not (longer.status == df.Status.NOT_SETTLED).any()


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [(1.54e-8, 1.54e-8, "At 15.4 nm"), (1.5402e-8, 1.541e-8, "Between 15.402 nm and 15.41 nm")],
)
def test_a_narrow_range_of_two_states_has_two_ends_or_is_one_place(low, high, words):
    zc = np.unique([1.7e-8, high, low, 1.4e-8])[::-1]
    apart = (zc >= low) & (zc <= high)
    curve = df.approach(CALM, zc, direction="both")
    curve["amplitude"] *= 1.0 - 0.1 * xr.DataArray(apart, dims="zc") * xr.DataArray([0.0, 1.0], dims="direction")
    said = next(piece.text for piece in df.advice(curve) if piece.name == "coexisting_states")
    assert said.startswith(f"{words} approach and retract end in different states.")


def test_a_motion_that_grows_without_bound_is_told_without_digits():
    found = df.advice(*tapping(CALM, total_dissipated_energy=-1e-3, status=1))
    (said,) = [piece.text for piece in found if piece.name == "energy_gained"]
    assert "adds energy to the tip: more than 10000 % of the largest energy" in said


def test_advice_on_amplitudes_counts_the_motion_of_the_mode_that_an_optical_lever_enlarges():
    """The lever reads mode 2 enlarged by 3.187: 1 nm of it is 0.31 nm of the motion."""
    modes = [{"f0": "70 kHz", "k": 3.0, "Q": 30}, {"f0": "439 kHz", "k": 4.0, "Q": 100}]
    tones = [{"A0": "2 nm"}, {"A0": "1 nm", "frequency": "430 kHz"}]
    optical = over(cantilever={"modes": modes}, drive={"tones": tones}, readout={"kind": "optical_lever"})
    told = {piece.name: piece for piece in df.advice(optical)}
    thermal = told["thermal_amplitude"]
    assert thermal.found / thermal.limit == pytest.approx(
        10.0 * math.sqrt(1.380649e-23 * 298.15 / 4.0) * 3.187186e9, rel=1e-5
    )
    r = 430.0 / 439.0
    at_f0 = 100.0 * math.hypot(1.0 - r**2, r / 100.0)  # nm, as the detector reads it
    assert f"the same drive would reach {at_f0:.3g} nm" in told["drive_off_resonance"].text
