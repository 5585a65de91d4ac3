"""Cantilevers known by name: what is shipped is plausible, and a file of one's own does the same."""

import pytest
from every import every
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.core.errors import ParameterError
from dforce.instrument import Medium, beam
from dforce.observables.averaging import common_period

SILICON, DENSITY = 169e9, 2330.0


@every(df.cantilevers().items(), lambda item: item[0])
def test_what_is_shipped_is_plausible(name, probe):
    assert 5e3 < probe.f0 < 3e6
    assert 0.01 < probe.k < 100.0
    assert probe.Q is None  # no maker gives one
    assert 0.5e-9 < probe.tip_radius < 50e-9
    assert probe.maker
    assert "memory" not in probe.source
    if probe.length is not None:  # sizes that do not fit are not shipped
        assert probe.length > probe.width > probe.thickness
        mode = beam.vacuum_mode(1, SILICON, DENSITY, probe.length, probe.width, probe.thickness)
        assert mode.stiffness == pytest.approx(probe.k, rel=0.12)
        assert mode.frequency == pytest.approx(probe.f0, rel=0.12)


def test_doubtful_cantilevers_are_not_shipped():
    known = df.cantilevers()
    assert len(known) == 50
    assert not {"55AC-NA", "TESPA", "RTESPA-300", "BL-AC40TS"} & set(known)


def test_a_name_gives_nominal_values_and_numbers_beside_it_come_first():
    case = df.Case(
        cantilever="PPP-NCHR", drive={"A0": 10e-9}, medium="air", forces=[{"model": "van_der_waals", "hamaker": 1e-19}]
    )
    (mode,), probe = case.problem.modes, df.cantilevers()["PPP-NCHR"]
    assert (mode.f0, mode.k) == (probe.f0, probe.k)
    assert case.problem.forces[0].radius == probe.tip_radius
    assert case.to_toml().startswith('cantilever = "PPP-NCHR"')
    assert df.Case.from_toml(case.to_toml()) == case
    measured = case.replace("cantilever.f0", "312 kHz").replace("tip.radius", "12 nm")
    assert measured.problem.modes[0].f0 == 312e3
    assert measured.problem.forces[0].radius == 12e-9


def test_Q_in_air_is_the_one_for_which_sader_finds_the_nominal_k():
    lever, air = df.Cantilever(name="FMR"), Medium(name="air")
    (mode,), probe = lever.resolve(air), df.cantilevers()["FMR"]
    k = beam.sader_stiffness(probe.f0, mode.Q, probe.length, probe.width, air.density, air.viscosity)
    assert k == pytest.approx(probe.k, rel=1e-12)


def test_a_file_of_ones_own_is_read_once_and_the_case_keeps_what_it_said(workdir):
    (workdir / "my.csv").write_text("name,f0,k,Q,tip_radius\nmine,71.3 kHz,2.1 N/m,180,9 nm\n", encoding="utf-8")
    case = df.Case(cantilever={"name": "mine", "library": "my.csv"}, drive={"A0": 10e-9})
    assert (case.cantilever.f0, case.cantilever.k, case.cantilever.Q) == (71.3e3, 2.1, 180.0)
    (workdir / "my.csv").unlink()
    assert df.Case.from_toml(case.to_toml()).problem == case.problem


def test_spaces_behind_commas_and_a_mark_of_the_encoding_do_no_harm(workdir):
    (workdir / "my.csv").write_text("# my levers\nname, f0, k, Q\n\nmine, 71.3 kHz, 2.1, 180\n", encoding="utf-8-sig")
    lever = df.Cantilever(name="mine", library="my.csv")
    assert (lever.f0, lever.k, lever.Q) == (71.3e3, 2.1, 180.0)


def test_a_file_lies_beside_the_case_that_names_it(tmp_path):
    (tmp_path / "my.csv").write_text("name,f0,k\nmine,71300,2.1\n", encoding="utf-8")
    text = 'cantilever = { name = "mine", library = "my.csv", Q = 180 }\ndrive = { A0 = "10 nm" }\n'
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    assert df.load_case(tmp_path / "case.toml").problem.modes[0].k == 2.1


@pytest.mark.parametrize(
    ("lever", "medium", "message"),
    [
        (
            "PPP-NCHRR",
            "air",
            "cantilever = 'PPP-NCHRR' is not known: write f0 and k, or a name; did you mean 'PPP-NCHR'?",
        ),
        ("PPP-NCHR", "water", "write f0 and Q measured in the liquid"),
        ("PPP-NCHR", "vacuum", "PPP-NCHR has no nominal Q"),
        ("PNP-DB-A", "air", "cantilever.Q (quality factor) is missing"),
        ({"name": "FMR", "beam": {"length": 1e-4}}, "air", "cantilever.beam"),
        ({"name": "FMR", "modes": [{"f0": 1, "k": 1, "Q": 1}]}, "air", "cantilever has both name and modes"),
        ({"f0": 1, "k": 1, "Q": 1, "library": "my.csv"}, "air", "is a file of levers; write the name of one"),
        ({"name": "mine", "library": "none.csv"}, "air", "cantilever.library = 'none.csv': there is no such file"),
        ({"name": "mine", "library": "none.txt"}, "air", "its name must end in .csv"),
    ],
)
def test_what_is_not_known_is_said_in_a_sentence(lever, medium, message):
    with pytest.raises(ParameterError) as raised:
        df.Case(cantilever=lever, drive={"A0": 10e-9}, medium=medium)
    assert message in str(raised.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,f0\nmine,1\n", "has no column 'k'"),
        ("name,f0,k,colour\nmine,1,1,red\n", "has a column 'colour'"),
        ("name,f0,k\nmine,1 nm,1\n", "cantilever 1: f0 is '1 nm', which is a length"),
        ("name,f0,k\nmine,1 kHz,-1\n", "no number below 0"),
        ("name,f0,k\nother,1 kHz,1\n", "cantilever = 'mine' is not known"),
        (
            "name,f0,k\nmine,1 kHz,1\nmine,2 kHz,1\n",
            "cantilever.library = 'my.csv', cantilever 2: 'mine' appears twice",
        ),
        ("name,f0,k\nmine,1 kHz,1,8 nm\n", "'my.csv', cantilever 1: it has 4 cells for 3 columns"),
        ("name,f0,k\nmine,1 kHz\n", "'my.csv', cantilever 1: it has 2 cells for 3 columns"),
        (f"name,f0,k\nmine,1 kHz,{'1' * 200_000}\n", "'my.csv' is not a table: field larger than field limit"),
        ("name,f0,f0,k\nmine,1 kHz,2 kHz,1\n", "'my.csv' has two columns 'f0'"),
        ("name,f0,k,tip_radius\nmine,1 kHz,1,3 m\n", "'my.csv', mine: tip_radius = 3 m is above 1 mm"),
    ],
)
def test_a_file_that_is_no_list_is_refused(workdir, text, message):
    (workdir / "my.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ParameterError) as raised:
        df.Cantilever(name="mine", library="my.csv", Q=100)
    assert message in str(raised.value)


def test_the_command_lists_them_and_says_that_they_are_nominal():
    run = CliRunner().invoke
    listed = run(app, ["cantilevers"])
    assert listed.exit_code == 0
    assert all(name in listed.output for name in df.cantilevers())
    assert "nominal" in listed.output
    one = run(app, ["cantilevers", "FMR"])
    assert run(app, ["cantilevers", "fmr"]).stdout == one.stdout
    assert "75 kHz" in one.output
    assert "pyDAMPF" in one.output
    assert run(app, ["cantilevers", "FRM"]).exit_code == 2


def bimodal(**lever):
    """Return a lever of the library under two tones in air."""
    return df.Case(
        cantilever={"name": "PPP-NCHR", "Q": 400} | lever,
        drive={"tones": [{"A0": "10 nm"}, {"A0": "1 nm"}]},
        medium="air",
        forces=[{"model": "van_der_waals", "hamaker": 1e-19}],
    )


def test_a_lever_by_name_has_the_second_mode_of_an_ideal_beam():
    first, second = bimodal(higher_modes=1).problem.modes
    assert second.f0 / first.f0 == pytest.approx((beam.wavenumber(2) / beam.wavenumber(1)) ** 2, rel=1e-4)
    assert common_period([first.f0, second.f0]) == 15
    assert second.k / first.k == pytest.approx(39.28, rel=1e-3)
    probe, air = df.cantilevers()["PPP-NCHR"], Medium(name="air")
    # what Sader's formula finds from mode 2 by its own f and Q is the same lever: k goes as Q f^2 times the damping
    found = [
        beam.sader_stiffness(mode.f0, mode.Q, probe.length, probe.width, air.density, air.viscosity) / mode.k
        for mode in (first, second)
    ]
    assert found[1] == pytest.approx(found[0], rel=1e-4)  # the rounded frequency
    assert bimodal(higher_modes=1).problem.tones[1].frequency == second.f0


def test_what_was_measured_of_a_higher_mode_comes_first():
    case = bimodal(higher_modes=[{"f0": "2.0 MHz", "Q": 700}])
    second = case.problem.modes[1]
    assert (second.f0, second.Q) == (2.0e6, 700.0)
    assert second.k == bimodal(higher_modes=1).problem.modes[1].k
    assert [piece.name for piece in df.advice(case) if "higher" in piece.name] == ["ideal_higher_mode"]
    (piece,) = (piece for piece in df.advice(case) if piece.name == "ideal_higher_mode")
    assert piece.about == ("cantilever.higher_modes.1.k",)
    assert case.replace("cantilever.higher_modes.1.k", 1500).problem.modes[1].k == 1500.0


def test_a_case_with_higher_modes_is_kept_by_its_text():
    case = bimodal(higher_modes=1)
    assert df.Case.from_toml(case.to_toml()) == case
    assert df.Case.from_toml(case.to_toml(complete=True)).problem.modes == case.problem.modes
    assert "higher_modes=[{}]" in case.to_python()


@pytest.mark.parametrize(
    ("lever", "sentence"),
    [
        ({}, "the cantilever has only 1 mode; add modes by cantilever.higher_modes"),
        ({"higher_modes": 10}, "cantilever.higher_modes = 10 is not from 0 to 9"),
        ({"higher_modes": True}, "cantilever.higher_modes = true is not allowed here"),
        ({"higher_modes": [{"q": 3}]}, "cantilever.higher_modes.1 has no parameter 'q'"),
        ({"name": "ScanAsyst-Air", "higher_modes": 1}, "higher_modes.1.Q (quality factor of mode 2) is missing: the width"),
        ({"modes": [{"f0": 1e5, "k": 1, "Q": 9}]}, "under cantilever.higher_modes"),
    ],
)  # fmt: skip
def test_a_second_mode_that_is_not_known_is_asked_for(lever, sentence):
    with pytest.raises(ParameterError) as error:
        bimodal(**lever)
    assert sentence in str(error.value)


def test_the_ratio_of_an_ideal_beam_is_not_taken_in_a_liquid():
    with pytest.raises(ParameterError, match="write the measured f0"):
        bimodal(higher_modes=[{"Q": 5}], f0="130 kHz").replace("medium", "water")
