"""Parts of results and results put together, as users make them with xarray: each is read, or refused with what to choose."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path

import fitted_curves
import measured_curve
import numpy as np
import pytest
import synthetic
import xarray as xr

import dforce as df

CASE = df.Case(
    cantilever={"f0": 48.9e3, "k": 0.9, "Q": 100},
    drive={"A0": "10 nm"},
    tip={"radius": "2 nm"},
    sample={"youngs_modulus": "1 GPa"},
    forces=[df.forces.DMT(hamaker=2e-20)],
)
ZC = {"start": "11.5 nm", "stop": "3 nm", "points": 18}


@functools.cache
def curve() -> xr.Dataset:
    return df.approach(CASE, zc=ZC, direction="both")


@functools.cache
def states() -> xr.Dataset:
    return df.sweep(
        CASE.replace("experiment", {"kind": "approach", "zc": ZC}), {"tip.radius": ["2 nm", "3 nm"]}, at_set_point=0.8
    )


CHOICES = {
    "a slice from near to far": (lambda: curve().sel(zc=slice(3e-9, 9e-9)), "a slice in .sel starts at the value that comes "
                                 "first and zc goes from far to near"),
    "one tone": (lambda: curve().isel(tone=0), "amplitude of this result has lost its dimension tone; choose a list, such as "
                 ".isel(tone=[0])"),
    "one mode": (lambda: curve().isel(mode=0), "has lost its dimension mode; choose a list, such as .isel(mode=[0])"),
    "one number of the motions": (lambda: curve().isel(component=0), "has lost its dimension component"),
    "two results side by side": (lambda: xr.concat([curve(), curve()], "run"), "no result of dForce has the dimension run; "
                                 "choose one result with .isel(run=0)"),
    "two results in a list": (lambda: xr.concat([curve(), curve()], "case"), "no result of dForce has the dimension case; "
                              "choose one result with .isel(case=0)"),
    "two results, same directions": (lambda: curve().isel(direction=[0, 0]), "a value twice along direction"),
    "no names of directions": (lambda: curve().drop_vars("direction"), "keep the coordinate direction"),
    "no case of a sweep": (lambda: states().isel(radius=[]), "no value along radius left"),
    "one point of a force curve": (lambda: synthetic.force_curve().isel(distance=0), "choose a list along it, such as "
                                   ".isel(distance=[0])"),
    "one parameter of a fit": (lambda: fitted_curves.result().isel(parameter=0), "such as .isel(parameter=[0])"),
    "one point of a measurement": (lambda: measured_curve.dataset().isel(point=0), "such as .isel(point=[0])"),
    "a parameter twice": (lambda: fitted_curves.result().isel(parameter=[0, 0]), "a value twice along parameter"),
    "no column of a map": (lambda: xr.Dataset(coords={"radius": []}, attrs={"map_over": "tip.radius"}), "along radius left"),
    "energies of a measurement": (
        lambda: df.energy(df.calibrate(measured_curve.dataset(), thermal={"k": 2.0, "Q": 100})), "no result of a known kind"
    ),
}  # fmt: skip


@pytest.mark.parametrize("chosen", CHOICES)
@pytest.mark.parametrize("read", [df.summary, df.report, df.answer, df.plot.overview])
def test_what_cannot_be_read_is_refused_with_what_to_choose(chosen: str, read: Callable[[xr.Dataset], object]) -> None:
    make, words = CHOICES[chosen]
    with pytest.raises(df.ParameterError) as error:
        read(make())
    assert words in str(error.value)


@pytest.mark.parametrize("chosen", ["one tone", "one mode", "two results side by side", "a slice from near to far"])
def test_set_points_and_advice_refuse_it_in_the_same_words(chosen: str) -> None:
    make, words = CHOICES[chosen]
    for read in (df.at_set_point, df.advice):
        with pytest.raises(df.ParameterError) as error:
            read(make())
        assert words in str(error.value)


def test_half_of_the_motions_is_refused_where_they_are_needed() -> None:
    for read in (df.summary, df.at_set_point):
        with pytest.raises(df.ParameterError, match="keep its dimension component whole"):
            read(curve().isel(component=[0]))


def test_states_at_a_set_point_have_no_set_points_again() -> None:
    with pytest.raises(df.ParameterError, match="lists the states at a set point already"):
        df.at_set_point(states())


def test_states_at_a_set_point_of_one_curve_are_listed_and_have_no_picture() -> None:
    found = df.at_set_point(curve(), 0.8)
    assert "points" not in {line.name for line in df.summary(found)}
    with pytest.raises(df.ParameterError, match="draw the curve, or list them"):
        df.plot.overview(found)


def test_a_force_curve_has_no_set_points_and_never_had_a_status() -> None:
    with pytest.raises(df.ParameterError, match="not a curve of amplitudes"):
        df.at_set_point(synthetic.force_curve())


def test_no_point_is_used_without_its_status() -> None:
    for read in (df.at_set_point, df.answer):
        with pytest.raises(df.ParameterError, match="lost its status"):
            read(curve().drop_vars("status"))


PARTS = {
    "some harmonics": lambda: curve().isel(harmonic=[0, 2]),
    "one harmonic": lambda: curve().isel(harmonic=2),
    "no harmonic": lambda: curve().isel(harmonic=[]),
    "one multiplier": lambda: curve().isel(multiplier=[0]),
    "from near to far": lambda: curve().isel(zc=slice(None, None, -1)),
}


@pytest.mark.parametrize("part", PARTS)
def test_a_part_has_the_set_points_of_the_whole(part: str) -> None:
    whole, found = df.at_set_point(curve()), df.at_set_point(PARTS[part]())
    for name in found.data_vars:
        kept = whole[name].sel(
            {dim: found[dim] for dim in whole[name].dims if dim in found.coords and dim != "crossing"}
        )
        np.testing.assert_allclose(np.sort(found[name], axis=0), np.sort(kept, axis=0), rtol=1e-6, err_msg=str(name))


def test_set_points_of_the_stable_branches_alone() -> None:
    branches = df.branches(CASE, zc=("12 nm", "6 nm"))
    stable = df.at_set_point(branches.where(branches["stable"]))
    assert stable.sizes["crossing"] and bool(stable["stable"].all())


CHANGED = {
    "a fit without its tones": lambda: df.plot.fit(fitted_curves.result().isel(tone=0)),
    "forces without a direction": lambda: df.plot.force_curve(synthetic.force_curve().isel(direction=[])),
    "several fits": lambda: df.summary(xr.concat([fitted_curves.result()] * 2, "run")),
    "a curve in one dimension": lambda: df.write(curve().stack(all=["zc", "tone"]), "curve.nc"),
}


@pytest.mark.parametrize("call", CHANGED)
def test_a_result_that_is_changed_too_much_is_refused_with_the_reason_and_a_remedy(call: str, workdir: Path) -> None:
    with pytest.raises(
        df.ParameterError, match=r"Dataset \(.*; pass it as dForce returned it, or choose parts by lists"
    ) as error:
        CHANGED[call]()
    assert error.value.__cause__ is not None and not list(workdir.iterdir())
