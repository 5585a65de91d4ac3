"""Law to curve to law: forces from curves that quadrature or the solver made, their errors, gaps, and what is refused."""

import fitted_curves as fc
import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq
from scipy.special import ive

import dforce as df
from dforce.inverse.reconstruction._least import solve

K, F0, Q = 180e3, 30e3, 1e4
A = 0.1e-9
E_B, KAPPA, SIGMA = 2.15e-19, 1.55e10, 2.357e-10
DRAG_KAPPA = 5e9  # 1/m
CONTACT = 0.165e-9  # m, where the force of the deep well has its kink
SHIFT_ERROR = 2e-4  # Hz; that of 0.02 Hz at a hundredth of the stiffness


def morse(d):
    return 2.0 * KAPPA * E_B * (np.exp(-2.0 * KAPPA * (d - SIGMA)) - np.exp(-KAPPA * (d - SIGMA)))


def morse_virial(d, amplitude):
    """Return the virial (J) of a sinusoid with closest distance d, in closed form."""
    total = 0.0
    for force, kappa in (
        (2.0 * KAPPA * E_B * np.exp(2.0 * KAPPA * SIGMA), 2.0 * KAPPA), (-2.0 * KAPPA * E_B * np.exp(KAPPA * SIGMA), KAPPA),
    ):  # fmt: skip
        total = total - force * np.exp(-kappa * d) * amplitude * ive(1, kappa * amplitude)
    return total


def drag_energy(d, frequency, drag):
    """Return the energy (J) that a drag of coefficient drag e^{-kappa d} takes in a period, in closed form."""
    x = DRAG_KAPPA * A
    return 4.0 * np.pi**2 * frequency * A**2 * drag * np.exp(-DRAG_KAPPA * d) * ive(1, x) / x


def locked(noise=0.0, seed=1, loss=0.0, nearest=0.30e-9):
    """Return a phase-locked curve of a lever so stiff that its path is a sinusoid (within 4 fm), by closed forms."""
    height = np.arange(nearest, 1.5e-9, 10e-12)
    f = F0 * np.sqrt(1.0 - 2.0 * morse_virial(height - A, A) / (K * A**2))
    shift = f - F0 + noise * np.random.default_rng(seed).standard_normal(len(height))
    variables = {"height": height, "amplitude": np.full(len(height), A), "frequency_shift": shift}
    if loss:
        variables["drive_force"] = K * A / Q * f / F0 + drag_energy(height - A, f, loss) / (np.pi * A)
    attrs = {"k": K, "f0": F0, "Q": Q, "frequency_shift_error": noise or 1e-6, "amplitude_error": 1e-16}
    return xr.Dataset({name: ("point", values) for name, values in variables.items()}, attrs=attrs)


def tapping(a0=20e-9, points=120):
    """Return a measured tapping curve in the attraction -H R / 6 d^2, one harmonic, in closed form."""
    k, q = 0.9, 255.0
    amplitude = a0 * np.linspace(0.99999, 0.97, points)
    virial = k * amplitude * a0 / (2.0 * q) * np.sqrt(1.0 - (amplitude / a0) ** 2)
    far = np.sqrt((2e-20 * 2e-9 / 6.0 * amplitude**2 / virial) ** (2.0 / 3.0) + amplitude**2)
    height = far  # the lever is taken as one that does not bend: the mean deflection is 0.01 pm to 8 pm
    variables = {"height": height, "amplitude": amplitude, "phase": 180.0 - np.rad2deg(np.arcsin(amplitude / a0))}
    attrs = {"k": k, "f0": 48.9e3, "Q": q, "free_amplitude": a0, "amplitude_error": 1e-13, "phase_error": 1e-3}
    return xr.Dataset({name: ("point", values) for name, values in variables.items()}, attrs=attrs)


@pytest.fixture(scope="module")
def air():
    """The approach of the DMT law in air with a jump, and what is found of it."""
    case = df.example("figure-3-air").replace("drive.A0", "20 nm")
    curve = df.approach(case, zc=np.linspace(28e-9, 4e-9, 161), direction="approach")
    return curve, df.reconstruct(curve)


@pytest.fixture(scope="module")
def found():
    return df.reconstruct(locked())


def test_a_morse_force_comes_back_from_frequency_shifts_within_a_percent(found):
    law = morse(found.distance.values)
    inner = (
        found.distance > found.distance[0] + 0.03e-9
    )  # nothing lies closer than the first points, a third of a length apart
    assert float(np.abs(found.force - law)[inner].max()) < 0.01 * np.ptp(law)
    assert (found.force_status == 0).all()


WET = {
    "youngs_modulus": 169e9,
    "density": 2330.0,
    "length": 50e-6,
    "width": 30e-6,
    "thickness": 25e-6,
    "fluid": "history",
}


@pytest.mark.parametrize("phase", [90.0, 75.0])
def test_a_force_comes_back_from_frequency_shifts_in_a_fluid_with_memory(phase):
    case = df.Case(cantilever={"beam": WET}, drive={"A0": A}, medium={"density": 9970.0, "viscosity": 8.59e-2})
    (mode,) = case.problem.modes
    cotangent = 1.0 / np.tan(np.radians(phase))

    def at(virial):  # the drive that holds the phase gives what the fluid takes: what is left is 2 V / A^2
        def left(f):
            return (mode.stiffness(f) * (1.0 + 1j * cotangent)).real - 2.0 * virial / A**2

        return brentq(left, 0.5 * mode.f0, 2.0 * mode.f0, xtol=1e-9 * mode.f0, rtol=1e-15)

    height = np.arange(0.30e-9, 1.5e-9, 10e-12)
    shift = np.array([at(virial) for virial in morse_virial(height - A, A)]) - at(0.0)
    variables = {"height": height, "amplitude": np.full(len(height), A), "frequency_shift": shift}
    variables["phase"] = np.full(len(height), phase)
    attrs = {"frequency_shift_error": 1e-3, "amplitude_error": 1e-16, "phase_error": 1e-9}
    curve = xr.Dataset({name: ("point", values) for name, values in variables.items()}, attrs=attrs)
    found = df.reconstruct(curve, case)
    law = morse(found.distance.values)
    inner = found.distance > found.distance[0] + 0.03e-9
    assert float(np.abs(found.force - law)[inner].max()) < 0.01 * np.ptp(law)


def test_a_phase_locked_curve_of_an_optical_lever_has_the_amplitude_of_the_mode():
    """An optical lever that was calibrated by a force curve reads 0.917670 of the motion of mode 1."""
    case = df.Case(
        cantilever={"f0": F0, "k": K, "Q": Q},
        drive={"A0": 0.917670323115 * A, "operation": "fm"},
        readout={"kind": "optical_lever"},
    )
    curve = locked()
    found = df.reconstruct(curve.assign(amplitude=0.917670323115 * curve.amplitude), case)
    true = morse_virial(curve.height.values - A, A)
    np.testing.assert_allclose(found.fundamental_virial, true, atol=1e-6 * np.abs(true).max())


def test_what_is_doubted_about_the_curve_is_a_note_of_the_force():
    curve = tapping().assign_attrs(history=["read: text", "doubt: the amplitudes look like rms"])
    assert df.reconstruct(curve).attrs["notes"].splitlines()[0] == (
        "doubts about the measured curve: the amplitudes look like rms"
    )


def test_van_der_waals_comes_back_from_a_measured_tapping_curve():
    curve = tapping()
    found = df.reconstruct(curve)
    law = -2e-20 * 2e-9 / 6.0 / found.distance.values**2
    # the curve leaves out the bend of the lever, up to 8 pm at the closest points, 0.5 nm away
    assert float(np.abs(found.force - law).max()) < 0.05 * np.ptp(law)
    assert float(np.abs(found.force - law)[found.distance > 1e-9].max()) < 0.01 * np.ptp(law)


def test_the_law_of_an_approach_with_a_jump_comes_back_and_the_gap_stays_open(air):
    _, found = air
    low, high = float(found.gap_low[0]), float(found.gap_high[0])
    assert found.sizes["gap"] == 1 and low < -0.25e-9 and 0.03e-9 < high < 0.1e-9
    inside = (found.distance > low) & (found.distance < high)
    assert np.isnan(found.force.where(inside, drop=True)).all() and inside.sum() > 10
    assert (found.force_status.where(inside, drop=True) == 1).all()
    outer = found.where(found.distance >= high, drop=True)
    span = float(found.law_force.max() - found.law_force.min())
    assert float(abs(outer.force - outer.law_force).max()) < 0.01 * span
    below = found.where(found.distance <= low, drop=True)
    assert (abs(below.force - below.law_force) < 3.0 * below.force_error).all()
    assert "No turning points from" in found.attrs["notes"]


def test_closest_approaches_are_those_of_the_solver(air):
    curve, found = air
    settled = curve.min_distance.values[np.isin(curve.status.values, (0, 6))]
    assert found.closest_approach.values == pytest.approx(settled, abs=5e-13)


def test_formulas_stop_at_the_gap_and_the_inverse_with_sinusoids_stands_beside(air):
    _, found = air
    below = found.classic_force.where(found.distance < float(found.gap_low[0]), drop=True)
    assert np.isnan(below.sel(formula=["sader_jarvis", "holscher", "payam"])).all()
    assert np.isfinite(below.sel(formula="sinusoid")).any()


def test_a_loss_by_drag_comes_back_as_its_coefficient():
    drag = 1e-6
    found = df.reconstruct(locked(loss=drag))
    middle = found.where((found.distance > 0.23e-9) & (found.distance < 1e-9), drop=True)
    expected = drag * np.exp(-DRAG_KAPPA * middle.distance.values)
    assert middle.damping.values == pytest.approx(expected, abs=0.02 * expected[0])
    energy = drag_energy(found.closest_approach.values, F0, drag)  # the frequency moves by 0.01 %
    assert found.sample_energy.values == pytest.approx(energy, abs=2e-3 * energy.max())


def test_without_a_loss_there_is_no_damping(found, air):
    assert "damping" not in found and "damping" not in air[1]


def test_a_loss_of_a_force_with_memory_is_no_drag():
    case = df.Case(
        cantilever=df.Cantilever(k=K, f0=F0, Q=Q), drive=df.Drive(A0=A), tip=df.Tip(radius="2 nm"),
        forces=[df.forces.PowerLaw(modulus_at_reference="1 GPa")],
    )  # fmt: skip
    found = df.reconstruct(locked(loss=1e-6), case)
    assert float(found.sample_energy.max()) > 0.0 and "damping" not in found
    assert "so there is no damping" in found.notes and "the damping is valid" not in found.notes


def test_least_squares_choose_a_smoothing_that_the_noise_does_not_move():
    nodes, points, draw = np.linspace(0.0, 1.0, 60), np.linspace(0.0, 1.0, 120), np.random.default_rng(1)
    matrix = np.exp(-np.abs(points[:, None] - nodes) / 0.3)
    law, error = np.exp(-nodes / 0.2) - 3.0 * np.exp(-(((nodes - 0.3) / 0.08) ** 2)), np.full(120, 0.02)
    fits = [solve(matrix, matrix @ law + error * draw.standard_normal(120), error) for _ in range(200)]
    spread = np.var([fit.values for fit in fits], axis=0, ddof=1).mean()
    # 200 repeats of some 20 values that are told apart: known to 1 %
    assert np.sqrt(spread / np.mean([np.diag(fit.noise) for fit in fits])) == pytest.approx(1.0, abs=0.05)
    sigma = np.sqrt([np.diag(fit.noise + fit.smoothing) for fit in fits])
    assert (np.abs([fit.values - law for fit in fits]) < 2.0 * sigma).mean() > 0.95


def test_errors_of_least_squares_are_above_zero_where_the_data_tell_all_curvatures():
    place = np.linspace(0.0, 1.0, 60)
    matrix = np.exp(-60.0 * np.abs(place[:, None] - place) - 20.0 * place[:, None])
    found = solve(matrix, matrix @ np.random.default_rng(1).standard_normal(60), np.full(60, 1e-9))
    assert (np.diag(found.noise + found.smoothing) > 0.0).all()  # smoothing hides less than its parts are rounded by


@pytest.mark.long
def test_the_predicted_noise_is_the_spread_of_noisy_repeats():
    grid = np.linspace(0.25e-9, 1e-9, 60)
    forces, noises = [], []
    for seed in range(16):
        one = df.reconstruct(locked(SHIFT_ERROR, seed))
        forces.append(np.interp(grid, one.distance, one.force))
        noises.append(np.interp(grid, one.distance, one.force_noise))
    spread, predicted = np.std(forces, axis=0, ddof=1), np.sqrt(np.mean(np.square(noises), axis=0))
    # 16 repeats of some ten independent stretches of distance: 6 %, and the smoothing differs from repeat to repeat
    assert np.sqrt(np.mean(spread**2) / np.mean(predicted**2)) == pytest.approx(1.0, abs=0.25)


def test_distances_that_only_noise_leads_to_are_not_determined():
    """The closest of many points are there by their noise: the repulsion is several errors too small."""
    case = df.Case(
        cantilever={"f0": "276 kHz", "k": "15.9 N/m", "Q": 233}, drive={"A0": "33.2 nm"}, tip={"radius": "11.6 nm"},
        sample={"youngs_modulus": "85 MPa", "poisson_ratio": 0.3}, forces=[df.forces.DMT(hamaker="14 zJ")],
    )  # fmt: skip
    curve = df.approach(case, zc={"start": "43 nm", "stop": "10 nm", "points": 120}, direction="both")
    draw, columns = np.random.default_rng(1), {}
    for name, error in (("amplitude", 0.1e-9), ("phase", 0.1)):
        ways = [curve.sel(direction=way).sortby("zc")[name].values.reshape(-1) for way in ("approach", "retract")]
        values = np.concatenate(ways)
        columns[name] = ("point", values + error * draw.normal(size=len(values)))
    columns["direction"] = ("point", np.repeat(["approach", "retract"], 120))
    columns["height"] = ("point", np.tile(np.sort(curve["zc"].values), 2))
    attrs = {
        "k": 15.9,
        "f0": 276e3,
        "Q": 233.0,
        "free_amplitude": 33.2e-9,
        "amplitude_error": 0.1e-9,
        "phase_error": 0.1,
    }
    found = df.reconstruct(xr.Dataset(columns, attrs=attrs))
    law = df.force_curve(case, distance=found["distance"].values[::-1])["force"].sel(direction="approach").values[::-1]
    off = np.abs(found["force"].values - law) / found["force_error"].values
    sure = found["force_status"].values == 0
    near = found["distance"].values < -0.3e-9  # the kink of the contact is smoothed, as `resolution` shows
    assert sure[near].sum() > 100 and off[near & sure].max() < 4.0 < off[near].max()


def measured(case, zc, points, amplitude_error, phase_error, seed=1):
    """Return approach and retract with noise, as a measured curve, and the law's force at distances."""
    curve = df.approach(case, zc={"start": zc[0], "stop": zc[1], "points": points}, direction="both")
    draw, ways = np.random.default_rng(seed), ("approach", "retract")

    def column(name):
        return np.concatenate([curve[name].sel(direction=way).values.reshape(-1) for way in ways])

    (mode,) = case.problem.modes
    columns = {
        "height": np.concatenate([curve["zc"].values] * 2),
        "amplitude": column("amplitude") + amplitude_error * draw.normal(size=2 * points),
        "phase": column("phase") + phase_error * draw.normal(size=2 * points),
        "direction": np.repeat(ways, points),
    }
    attrs = {"k": mode.k, "f0": mode.f0, "Q": mode.Q, "free_amplitude": float(abs(case.problem.detected_free[0]))}
    attrs |= {"amplitude_error": amplitude_error, "phase_error": phase_error}
    return xr.Dataset({name: ("point", values) for name, values in columns.items()}, attrs=attrs)


def dmt(f0, k, q, a0, radius, modulus, hamaker):
    return df.Case(
        cantilever={"f0": f0, "k": k, "Q": q}, drive={"A0": a0}, tip={"radius": radius},
        sample={"youngs_modulus": modulus, "poisson_ratio": 0.3}, forces=[df.forces.DMT(hamaker=hamaker)],
    )  # fmt: skip


STIFF = dmt("157 kHz", "5.6 N/m", 180, "10.5 nm", "12.3 nm", "14 GPa", "14.5 zJ")
SOFT = dmt("105 kHz", "0.5 N/m", 207, "14.7 nm", "9 nm", "55 MPa", "25 zJ")


@pytest.mark.parametrize(
    ("case", "zc", "points", "noise"),
    [
        pytest.param(STIFF, ("18.5 nm", "3.1 nm"), 100, (2e-12, 0.01), id="a kink"),
        pytest.param(SOFT, ("15.7 nm", "4.4 nm"), 100, (2e-12, 0.01), id="a force that does not end with the curve"),
    ],
)
def test_a_determined_force_lies_within_three_errors_of_the_law(case, zc, points, noise):
    found = df.reconstruct(measured(case, zc, points, *noise))
    law = df.force_curve(case, distance=found.distance.values[::-1]).force.sel(direction="approach").values[::-1]
    off = (np.abs(found.force - law) / found.force_error).values[found.force_status.values == 0]
    assert off.max() < 3.0 and np.mean(off < 2.0) > 0.95


def deep_well(d):
    return -5e-9 * np.where(d > CONTACT, CONTACT / np.maximum(d, CONTACT), 1.0) ** 2 + 20.0 * np.maximum(
        CONTACT - d, 0.0
    )


def test_the_lowest_force_of_a_deep_well_with_a_kink_has_an_error_that_covers_it():
    amplitude, angle = 1e-9, np.pi * (np.arange(4000) + 0.5) / 4000
    height = amplitude + np.arange(-0.3e-9, 2e-9, 10e-12)
    path = amplitude * np.cos(angle)
    virial = np.array([np.mean(deep_well(one + path) * path) for one in height])
    shift = F0 * np.sqrt(1.0 - 2.0 * virial / (K * amplitude**2)) - F0
    error = 0.01 * np.abs(shift).max()
    shift = shift + error * np.random.default_rng(2).standard_normal(len(height))
    variables = {"height": height, "amplitude": np.full(len(height), amplitude), "frequency_shift": shift}
    attrs = {"k": K, "f0": F0, "Q": Q, "frequency_shift_error": error, "amplitude_error": 1e-16}
    found = df.reconstruct(xr.Dataset({name: ("point", values) for name, values in variables.items()}, attrs=attrs))
    off = np.abs(found.force - deep_well(found.distance.values)) / found.force_error
    near = np.abs(found.distance - CONTACT) < 0.05e-9
    assert (found.force_status == 0).all() and off[near].max() < 2.0


def test_a_force_between_points_far_apart_has_an_error_that_covers_it():
    found = df.reconstruct(locked().isel(point=slice(0, None, 4)))  # 40 pm apart, with a well 0.1 nm wide
    off = np.abs(found.force - morse(found.distance.values)) / found.force_error
    assert off.max() < 2.0


def test_a_steep_wall_does_not_widen_the_error_of_the_well_before_it():
    found = df.reconstruct(locked(nearest=0.21e-9))  # up to 300 nN; the well is 1.7 nN deep
    well = found.isel(distance=int(found.force.values.argmin()))
    assert abs(well.force - morse(well.distance.values)) < 3.0 * well.force_error < 0.1 * abs(well.force)


def test_noise_of_the_distances_counts_in_the_error_of_a_steep_force():
    # the curve that is shipped: 60 pm of noise, over a force that is 0.3 nm long
    data = fc.data_of("stiff").assign_attrs(free_amplitude=30e-9)
    data["height"], data["phase"] = data["height"] + 0.35e-9, data["phase"] - 1.2
    case = fc.case_of("stiff")
    found = df.reconstruct(data, case)
    found = found.isel(distance=(found.distance > found.gap_high.max()).values)
    law = df.force_curve(case, distance=found.distance.values[::-1]).force.sel(direction="approach").values[::-1]
    off = np.abs(found.force.values - law) / found.force_error.values
    assert np.sqrt(np.mean(off**2)) < 1.3
    assert np.mean(off < 2.0) > 0.9
    steepest = int(np.argmax(np.gradient(found.force, found.distance)))
    unsure = df.reconstruct(data.assign_attrs(height_error=0.2e-9), case)
    wider = np.interp(found.distance[steepest], unsure.distance, unsure.force_error)
    assert wider > found.force_error[steepest]


def test_the_result_goes_to_a_file_and_back(found, tmp_path):
    again = df.read(df.write(found, tmp_path / "force.nc"))
    assert again.force.equals(found.force) and again.attrs["notes"] == found.attrs["notes"]
    assert "force (N)" in df.write(found, tmp_path / "force.csv").read_text()


def test_the_picture_shows_force_band_and_gap(air):
    axes = df.plot.reconstruction(air[1], formulas=True)
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert {"law", "reconstructed", "two errors", "force unknown", "Sader and Jarvis"} <= set(labels)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda c: c.isel(point=slice(0, 5)), "the curve has 5 usable points"),
        (lambda c: c.isel(point=np.random.default_rng(1).permutation(c.sizes["point"])), "turn back at point"),
        (lambda c: c.assign_attrs({key: c.attrs[key] for key in c.attrs if key != "k"}).pipe(without, "k"), "instrument: k;"),
        (lambda c: without(c, "free_amplitude"), "instrument: free_amplitude;"),
        (lambda c: without(c, "phase_error"), "phase_error"),
        (lambda c: c.assign_attrs(free_amplitude=15e-9), "above the free amplitude"),
        (lambda c: c.assign(amplitude=-c.amplitude), "not above 0"),
        (lambda c: c.assign(phase=c.phase * np.nan), "no finite number at point 1"),
        (lambda c: c.drop_vars("phase"), "has no 'phase'"),
        (lambda c: c.assign(phase=c.phase * 0.0 + np.rad2deg(np.arccos(0.0)), amplitude=c.amplitude), "free lever"),
        (lambda c: c.drop_vars("height"), "not a curve over the distance"),
        (lambda c: xr.concat([c.isel(point=slice(0, 4)), c.isel(point=slice(-4, None))], "point"), "a jump divides the points"),
    ],
)  # fmt: skip
def test_bad_curves_are_refused_in_a_sentence(change, sentence):
    with pytest.raises(df.ParameterError, match=sentence):
        df.reconstruct(change(tapping()))


def without(curve, name):
    """Return a curve without an attribute."""
    curve = curve.copy()
    curve.attrs = {key: value for key, value in curve.attrs.items() if key != name}
    return curve


def test_joined_curves_of_different_levers_are_refused():
    """Both were taken for curves of the first lever."""
    case, zc = df.example("figure-3-air"), np.linspace(14e-9, 10e-9, 10)
    curve, stiffer = (
        df.approach(one, zc=zc + off) for one, off in ((case, 5e-9), (case.replace("cantilever.k", 2.0), 0.0))
    )
    joined = xr.concat([curve, stiffer], "zc", data_vars="minimal", coords="minimal", compat="override")
    with pytest.raises(df.ParameterError, match="points of another case"):
        df.reconstruct(joined)
    (piece,) = [one for one in df.advice(joined) if one.name == "step_error"]
    assert "joined results" in piece.text
    assert "solver.points_per_period" not in "".join(one.text for one in df.advice(joined))  # more samples do not help
    assert "step_error" not in {one.name for one in df.advice(curve)}


def test_joined_curves_over_different_samples_are_refused():
    """Both were taken for curves over the first sample."""
    case, zc = df.example("hysteresis"), np.linspace(16e-9, 12e-9, 10)
    curve, softer = (
        df.approach(one, zc=zc + off)
        for one, off in ((case, 2e-9), (case.replace("sample.youngs_modulus", "50 MPa"), 0.0))
    )
    joined = xr.concat([curve, softer], "zc", data_vars="minimal", coords="minimal", compat="override")
    with pytest.raises(df.ParameterError, match="points of another case"):
        df.reconstruct(joined)
    (piece,) = [one for one in df.advice(joined) if one.name == "other_forces"]
    assert "joined results" in piece.text
    assert piece.text in df.answer(joined)
    for one in (curve, softer):
        assert "other_forces" not in {piece.name for piece in df.advice(one)}
        assert "joined" not in df.answer(one)


def test_a_curve_of_two_tones_is_refused():
    curve = xr.Dataset(
        {"zc": ("zc", [1e-9]), "status": ("zc", [0]), "amplitude": (("zc", "tone"), [[1e-9, 1e-9]]),
         "phase": (("zc", "tone"), [[90.0, 90.0]])},
        attrs={"case": df.example("figure-6").to_toml()},
    )  # fmt: skip
    with pytest.raises(df.ParameterError, match="2 tones"):
        df.reconstruct(curve)


def test_where_the_noise_hides_the_force_nothing_is_determined():
    case = df.Case(
        cantilever={"f0": "300 kHz", "k": "18 N/m", "Q": 374}, drive={"A0": "17.7 nm"}, tip={"radius": "2 nm"},
        forces=[df.forces.Morse(bond_energy="105 zJ", decay=1.28e10, bond_length="0.2357 nm")],
    )  # fmt: skip
    curve = measured(case, ("18.7 nm", "8 nm"), 40, 20e-12, 0.1)
    for seed in (4, 8):  # the force found hangs on last bits: with these a wrong one seemed determined
        last_bits = 1.0 + 1e-9 * np.random.default_rng(seed).standard_normal(curve.amplitude.shape)
        found = df.reconstruct(curve.assign(amplitude=curve.amplitude * last_bits))
        assert not (found.force_status == 0).any()
        assert "the force doubles over less than the error of the distance" in found.attrs["notes"]
