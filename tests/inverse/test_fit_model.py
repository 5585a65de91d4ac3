"""What a fit minimizes: its derivatives, its invariances, and what must not change it."""

import fitted_curves as fc
import numpy as np
import pytest
import xarray as xr
from fitted_curves import ETA, E, H

import dforce as df
from dforce.inverse.fitting import curves, starts
from dforce.inverse.fitting.certainty import certainty
from dforce.inverse.fitting.curves import BESIDE_END, ModelBranches, beyond
from dforce.inverse.fitting.edges import past_stability
from dforce.inverse.fitting.minimize import jacobian
from dforce.inverse.fitting.model import CurveModel, Prediction
from dforce.inverse.fitting.points import BEHIND_JUMP, FROM_FREE, MeasuredPoints
from dforce.inverse.fitting.selection import PointSelection, measured
from dforce.inverse.fitting.starts import searched
from dforce.inverse.fitting.unknowns import Unknown, make_unknowns
from dforce.solvers.block import Block
from dforce.solvers.newton import TOLERANCE
from dforce.solvers.quasi_static import Stretch
from dforce.solvers.settling import remeasured
from dforce.validity import advice_in

NUISANCE = ("zc_offset", "A0", "phase_offset")
Q = "cantilever.Q"


def model_of(name: str, free: list[str], priors: dict[str, object] | None = None) -> tuple[CurveModel, np.ndarray]:
    """Return the model of a shipped curve, and what is varied at the truth."""
    case, data = fc.case_of(name), measured(fc.data_of(name), PointSelection(margin=0))
    unknowns = make_unknowns(case, 1, free, NUISANCE, priors or {}, {}, {})
    truth = dict(zip((E, H, ETA, *NUISANCE), fc.TRUTH[name], strict=True)) | {Q: case.problem.modes[0].Q}
    return CurveModel(case, unknowns, data), np.array([one.varied(truth[one.name]) for one in unknowns])


@pytest.fixture(scope="module")
def stiff() -> tuple[CurveModel, np.ndarray, Prediction]:
    model, varied = model_of("stiff", [E, H, ETA], {Q: (180.0, 3.6)})
    return model, varied, model.predict(varied)


def test_derivatives_are_those_of_curves_that_are_followed_anew(
    stiff: tuple[CurveModel, np.ndarray, Prediction],
) -> None:
    model, varied, told = stiff
    slopes = model.slopes(varied, told)
    for i, one in enumerate(model.unknowns):
        above, below = varied.copy(), varied.copy()
        above[i] += 10.0 * one.step
        below[i] -= 10.0 * one.step
        plain = (model.predict(above).values - model.predict(below).values) / (20.0 * one.step)
        apart = np.abs(slopes[:, :, i] - plain)
        # a sample that enters the contact within the longer step bends single points; all others agree to 1e-4
        assert np.quantile(apart, 0.95, axis=0) == pytest.approx([0.0, 0.0], abs=1e-3 * np.abs(plain).max()), one.name
        assert (apart.max(axis=0) < 0.01 * np.maximum(np.abs(plain).max(axis=0), 1e-30) + 1e-12).all(), one.name


def test_differences_to_one_side_are_as_good_and_half_the_work(
    stiff: tuple[CurveModel, np.ndarray, Prediction], monkeypatch: pytest.MonkeyPatch
) -> None:
    model, varied, told = stiff
    counts, read = [], model.curves.read
    monkeypatch.setattr(
        model.curves, "read", lambda block, cases, *rest: counts.append(len(cases)) or read(block, cases, *rest)
    )
    both, one = model.slopes(varied, told), model.slopes(varied, told, both_sides=False)
    apart, size = np.abs(one - both), np.abs(both).max(axis=0) + 1e-14
    assert (apart < 1e-3 * size).all()  # the steps are 1e-5, and beside the fold the curve bends
    assert (np.median(apart, axis=0) < 1e-4 * size).all()
    pairs = 6  # five parameters, and the heights
    assert counts == [2 * pairs * len(told.values), (pairs + 1) * len(told.values)]


def test_curves_that_fit_one_branch_badly_are_not_followed_along_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    model, varied = model_of("stiff", [E, H, ETA])
    followed: list[int] = []
    solve = ModelBranches.solve
    monkeypatch.setattr(
        ModelBranches,
        "solve",
        lambda self, problems, *rest: followed.append(len(problems)) or solve(self, problems, *rest),
    )
    found = searched(model, varied)
    assert followed[0] == 64 and sum(followed[1:]) < 50
    monkeypatch.setattr(starts, "ABREAST", 64)
    whole = searched(model, varied)
    for one, other in zip(found, whole, strict=True):
        assert (one.varied == other.varied).all() and one.chi2 == pytest.approx(other.chi2, rel=1e-12)


def test_points_of_approach_and_retract_at_the_same_heights_lie_on_one_curve(
    stiff: tuple[CurveModel, np.ndarray, Prediction],
) -> None:
    model, varied, told = stiff
    curve = fc.data_of("stiff")
    twice = np.repeat(np.arange(curve.sizes["point"]), 2)
    data = measured(curve.isel(point=twice), PointSelection(margin=0))
    both = CurveModel(model.case, model.unknowns, data)
    again = both.predict(varied)
    assert not again.lost.any()
    # a walk of other steps ends within the tolerance of Newton's method
    np.testing.assert_allclose(again.values[:, 0], told.values[twice, 0], rtol=1e-6)
    np.testing.assert_allclose(again.values[:, 1], told.values[twice, 1], atol=1e-4)
    ends = [abs(one.slopes(varied, one.predict(varied))).max() for one in (model, both)]
    assert ends[1] == pytest.approx(ends[0], rel=1e-3)


def test_a_phase_offset_has_the_derivative_one(stiff: tuple[CurveModel, np.ndarray, Prediction]) -> None:
    model, varied, told = stiff
    column = model.slopes(varied, told)[:, :, [one.name for one in model.unknowns].index("phase_offset")]
    assert (column[:, 1] == 1.0).all() and (column[:, 0] == 0.0).all()


def test_errors_at_the_truth_are_those_of_the_reference(stiff: tuple[CurveModel, np.ndarray, Prediction]) -> None:
    model, varied, told = stiff
    found = certainty(jacobian(model, varied, told), model.unknowns)
    slope = np.array([1.0 if one.is_log else one.scale for one in model.unknowns])
    A0 = 30e-9
    reference = [
        0.0598,
        0.0528,
        0.226,
        0.0162e-9,
        0.0107e-9 / A0,
        0.0589,
        0.0200,
    ]  # H and E too: E H eta zoff A0 offset Q
    assert found.errors * slope == pytest.approx(reference, rel=0.10)


@pytest.mark.parametrize("factor", [0.5, 3.0])
def test_curves_depend_on_forces_over_the_spring_constant_only(factor: float) -> None:
    case = fc.case_of("stiff")
    values = {"cantilever.k": 2.7, E: 2e9, H: 6e-20, ETA: 20.0}
    same(case, {path: factor * value for path, value in values.items()})


@pytest.mark.parametrize("factor", [0.5, 3.0])
def test_curves_do_not_tell_the_radius(factor: float) -> None:
    powers = {"tip.radius": (8e-9, 1.0), E: (2e9, -0.5), H: (6e-20, -1.0), ETA: (20.0, -0.5)}
    same(fc.case_of("stiff"), {path: value * factor**power for path, (value, power) in powers.items()})


def same(case: df.Case, changes: dict[str, float]) -> None:
    """Check that another case has the same curve: within 1e-9 of the amplitude, and of a radian."""
    other = case
    for path, value in changes.items():
        other = other.replace(path, value)
    data = measured(fc.data_of("stiff"), PointSelection(margin=0))
    told = []
    for one in (case, other):
        model = CurveModel(one, make_unknowns(one, 1, [E], ["zc_offset"], {}, {}, {}), data)
        told.append(model.predict(np.array([model.unknowns[0].varied(model.unknowns[0].start), 0.35 / 30.0])).values)
    assert told[1][:, 0] == pytest.approx(told[0][:, 0], rel=1e-9)
    assert told[1][:, 1] == pytest.approx(told[0][:, 1], abs=np.degrees(1e-9))


def test_a_fit_without_noise_returns_the_truth() -> None:
    # the model's own curve, so that the sampling is the same
    model, varied = model_of("stiff", [E, H, ETA])
    values = model.predict(varied).values
    data = fc.data_of("stiff")
    data["amplitude"], data["phase"] = ("point", values[:, 0]), ("point", values[:, 1])
    case = fc.case_of("stiff").replace("solver.points_per_period", 256)  # no more samples than the data have
    fit = df.fit(case, data, free=[E, H, ETA], margin=0, start={E: 3e9, H: 4e-20, ETA: 10.0})
    truth = dict(zip((E, H, ETA, *NUISANCE), fc.TRUTH["stiff"], strict=True))
    assert fit.attrs["chi2"] < 1e-4
    for name, value in truth.items():
        assert float(fit["value"].sel(parameter=name)) == pytest.approx(value, rel=1e-5), name


def test_a_fit_does_not_depend_on_the_order_the_origin_of_heights_or_the_size_of_errors() -> None:
    case, data = fc.case_of("air"), fc.data_of("air")
    order = np.random.default_rng(1).permutation(data.sizes["point"])
    far = data.assign(height=data["height"] + 1e-9)
    noisy = data.assign_attrs({name: 2.0 * value for name, value in data.attrs.items()})
    plain, mixed, shifted, doubled = (
        df.fit(case, one, free=[H], search=False) for one in (data, data.isel(point=order), far, noisy)
    )
    errors = plain["error"]
    # Newton's method accepts orbits within TOLERANCE of A0, 5e-7 errors of an amplitude. Random signs over the points make this
    # 7e-8 of chi2. Searches ended within 5e-4 errors of each other; they did within 2e-4 with a tolerance of 1e-12.
    orbit = TOLERANCE * case.drive.A0 / data.attrs["amplitude_error"]
    chi2 = pytest.approx(plain.attrs["chi2"], abs=2.0 * np.sqrt(plain.attrs["chi2"]) * orbit)
    assert float((abs(mixed["value"] - plain["value"]) / errors).max()) < 1e-3
    assert mixed.attrs["chi2"] == chi2
    moved = shifted["value"] - plain["value"]
    assert float(moved.sel(parameter="zc_offset")) == pytest.approx(-1e-9, rel=1e-6)
    assert shifted.attrs["chi2"] == chi2
    for name in (H, "A0", "phase_offset"):
        assert abs(float(moved.sel(parameter=name))) < 1e-3 * float(errors.sel(parameter=name)), name
    assert (doubled["error"] / errors).values == pytest.approx(2.0, rel=5e-5)
    assert doubled.attrs["chi2"] == pytest.approx(0.25 * plain.attrs["chi2"], rel=1e-6)


def test_correlated_neighbors_widen_the_errors() -> None:
    case, data = fc.case_of("air"), fc.data_of("air")
    plain = df.fit(case, data, free=[H], search=False)
    wide = df.fit(case, data.assign_attrs(neighbor_correlation=0.5), free=[H], search=False)
    assert (wide["error"] / plain["error"]).values == pytest.approx(np.sqrt(3.0), rel=1e-6)


def test_errors_of_given_values_are_passed_on_as_the_forces_scale() -> None:
    given = {"cantilever.k": (2.7, 0.135), "tip.radius": "8.0(8) nm"}  # 5 % and 10 %
    fit = df.fit(fc.case_of("stiff"), fc.data_of("stiff"), free=[E, H, ETA], given=given, margin=0, search=False)
    relative = fit["error_given"] / fit["value"]
    # all forces scale as k; E and viscosity as R^-1/2, H as R^-1
    for name, power in ((E, 0.5), (H, 1.0), (ETA, 0.5)):
        assert float(relative.sel(parameter=name)) == pytest.approx(np.hypot(0.05, 0.10 * power), rel=1e-3), name
    assert float(relative.sel(parameter="A0")) < 1e-6


def test_a_given_value_takes_the_place_of_the_one_in_the_case() -> None:
    fit = df.fit(fc.case_of("air"), fc.data_of("air"), free=[H], given={"tip.radius": "4.0(4) nm"}, search=False)
    assert df.Case.from_toml(fit.attrs["case"]).tip.radius == 4e-9
    # of H R alone the data tell: 1.996e-20 J at 2 nm
    assert float(fit["value"].sel(parameter=H)) == pytest.approx(0.998e-20, rel=0.005)


def test_lost_points_leave_a_fold_along_the_chord_that_ends_the_branch() -> None:
    end, before = np.array([4.0, 100.0]), np.array([0.04, 0.01, 0.0025])
    known = end + np.sqrt(before)[:, None] * np.array([1.0, -30.0])  # as beside a fold: with the root of the distance
    behind = np.array([0.0, BESIDE_END, 0.01])
    values = beyond(end, known, before, behind)
    chord = np.sqrt(BESIDE_END) * np.array([1.0, -30.0])
    assert values[0] == pytest.approx(end) and values[1] == pytest.approx(end - chord)
    # a point that lies so far behind the end is excluded by more than any noise
    assert values[2] == pytest.approx(end - 0.01 / BESIDE_END * chord)


def test_a_model_whose_branch_ends_early_counts_lost_points() -> None:
    model, varied = model_of("stiff", [E, H, ETA])
    names = [one.name for one in model.unknowns]
    off = varied.copy()
    off[names.index(H)] += np.log(0.4)  # less attraction: the branch of free motion ends farther out
    told = model.predict(off)
    near = model.data.height[model.points][told.lost]
    assert 0 < told.lost.sum() < 40
    assert (model.data.branch[model.points][told.lost] == 1).all()
    assert near.max() < model.data.height[model.data.branch == 1].max() - 5e-9
    assert np.isfinite(told.values).all()


def test_a_branch_goes_on_where_its_motion_doubles_its_period_and_comes_back_and_a_fit_counts_these_points() -> None:
    case = df.Case(
        cantilever={"modes": [{"f0": 75e3, "k": 2.0, "Q": 180.0}, {"f0": 470e3, "k": 80.0, "Q": 450.0}]},
        drive={"tones": [{"A0": 20e-9, "mode": 1}, {"A0": 0.5e-9, "mode": 2}]},
        tip={"radius": 8e-9}, sample={"youngs_modulus": 1.5e9, "poisson_ratio": 0.35},
        forces=[df.forces.DMT(hamaker=6e-20), df.forces.KelvinVoigt(viscosity=50.0)],
    )  # fmt: skip
    height = np.linspace(24e-9, 10e-9, 71)
    curve = df.approach(case, zc=height)
    assert set(curve["repeat_periods"].values[-4:]) == {15.0, 30.0} and curve["repeat_periods"].values[-1] == 30.0
    amplitude, phase = (curve[name].values for name in ("amplitude", "phase"))
    data = fc.dataset(height, amplitude[:, 0], phase[:, 0], np.ones(71), (1e-12, 0.1))
    data = data.assign(amplitude_2=("point", amplitude[:, 1]), phase_2=("point", phase[:, 1]))
    data.attrs |= {"amplitude_2_error": 1e-12, "phase_2_error": 0.1}
    points = measured(data, PointSelection())
    told = CurveModel(case, make_unknowns(case, 2, [E], ("zc_offset",), {}, {}, {}), points).predict(
        np.array([np.log(1.5e9), 0.0])
    )
    assert not told.lost.any()
    # the orbit at the center of a doubled motion is near its mean
    assert told.values[:, :2] == pytest.approx(amplitude, abs=1e-12)
    assert told.values[:, 2:] == pytest.approx(phase, abs=0.1)
    fit = df.fit(case, data, free=[E], nuisance=["zc_offset"], search=False)
    text = next(piece.text for piece in advice_in(fit) if piece.name == "unstable_points")
    count = int((curve["repeat_periods"] == 30.0).sum())
    assert f"doubles its period, or becomes a torus, at {count} of 71 points" in text


def test_a_branch_behind_a_jump_may_begin_at_the_phase_of_free_motion() -> None:
    case = df.Case(
        cantilever={"f0": 25e3, "k": 0.1, "Q": 2.0}, drive={"A0": 12e-9}, tip={"radius": 20e-9},
        sample={"youngs_modulus": 533e3, "poisson_ratio": 0.3},
        forces=[df.forces.DMT(hamaker=5.3e-22), df.forces.KelvinVoigt(viscosity=7.2)],
    )  # fmt: skip
    height = np.linspace(12e-9, 2.4e-9, 20)
    curve = df.approach(case, zc=height)
    amplitude, phase = (curve[name].values for name in ("amplitude", "phase"))
    assert 90.0 < phase[-1, 0] < 90.3  # a soft sample in water: the lever follows it up to here
    behind, every = np.full(20, BEHIND_JUMP), np.ones(20, bool)
    points = MeasuredPoints(height, amplitude, phase, behind, every, np.full(1, 1e-11), np.full(1, 0.3), 0.0, {})
    model = CurveModel(case, make_unknowns(case, 1, [E], ("zc_offset",), {}, {}, {}), points)
    told = model.predict(np.array([np.log(533e3), 0.0]))
    assert not told.lost.any()
    assert (model.residuals(told) ** 2).sum() < 1e-2


def test_unknowns_are_varied_by_their_logarithm_where_they_cannot_be_negative() -> None:
    made = {one.name: one for one in make_unknowns(fc.case_of("stiff"), 1, [E, H], NUISANCE, {}, {}, {})}
    assert made[E].is_log and made[H].is_log and made["A0"].is_log and not made["zc_offset"].is_log
    one: Unknown = made[E]
    assert one.value(one.varied(3e9)) == pytest.approx(3e9, rel=1e-14)
    assert made["zc_offset"].value(made["zc_offset"].varied(1e-10)) == pytest.approx(1e-10, rel=1e-14)


def test_values_behind_a_branch_are_finite_where_a_step_at_its_end_leads_nowhere(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model, varied = model_of("stiff", [E, H, ETA])
    off = varied.copy()
    off[[one.name for one in model.unknowns].index(H)] += np.log(0.4)

    def nowhere(*arguments: object) -> tuple[object, ...]:
        rows, *others = remeasured(*arguments)
        return np.full_like(rows, np.nan), *others

    monkeypatch.setattr("dforce.inverse.fitting.curves.remeasured", nowhere)
    told = model.predict(off)
    assert told.lost.any() and np.isfinite(told.values).all()


def test_a_hidden_jump_leaves_free_motion_or_attraction_and_no_gap_between_repulsive_points() -> None:
    approach, retract = np.arange(40.0, 9.5, -0.5), np.array([*range(10, 25), 28.5, 29.5, 30.5, *range(31, 41)])
    height = np.concatenate([approach, retract])
    attracted = np.where(np.arange(len(height)) < len(approach), height > 22.8, height > 30.0)
    phase = np.where(attracted, 90.0 + np.clip(4.7 * (31.0 - height), 0.0, None), 7.0 + 3.8 * (height - 10.0))
    data = xr.Dataset(
        {
            "height": ("point", height * 1e-9),
            "amplitude": ("point", np.where(attracted, np.minimum(height, 30.0), height + 0.5) * 1e-9),
            "phase": ("point", phase),
        },
        {"direction": ("point", np.repeat(["approach", "retract"], [len(approach), len(retract)]))},
        {"amplitude_error": 6e-11, "phase_error": 0.3},
    )
    found = measured(data, PointSelection())
    assert (found.branch == np.where(attracted, FROM_FREE, BEHIND_JUMP)).all()


def test_a_branch_whose_derivatives_overflowed_ends_there_without_a_warning_of_numpy(
    stiff: tuple[CurveModel, np.ndarray, Prediction], monkeypatch: pytest.MonkeyPatch
) -> None:
    """So it is with a trial of 700 GPa and 3 MPa s, where the contact stops the tip; warnings are errors here."""
    model, varied, told = stiff

    def overflowed(block: Block, which: np.ndarray, stretch: Stretch, values: np.ndarray) -> None:
        stretch.done[:] -= 1  # the last point is left, and the state before it has no derivatives
        stretch.last_value[:], stretch.last_x[:] = values[:, stretch.done[0] - 1], stretch.x[:, stretch.done[0] - 1]
        stretch.last_monodromy[:] = np.nan
        past_stability(block, which, stretch, values)

    monkeypatch.setattr(curves, "past_stability", overflowed)
    assert not told.lost.any()
    assert model.predict(varied).lost.sum() == len(model.stretches)
