"""Cases: files, objects and schema, without loss; and one sentence for everything that is not a case."""

import json
import math
import pickle
import tomllib

import jsonschema
import numpy as np
import pytest
from every import every
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dforce import forces, library
from dforce.case import About, Case, case_schema, example, load_case, save_case
from dforce.core.errors import CaseError, DForceError, ParameterError, shorten
from dforce.experiments import Approach, Dwell
from dforce.instrument import Cantilever, Drive, Medium, Sample, Tip
from dforce.results.files import read

MINIMAL = {"cantilever": {"f0": "50 kHz", "k": "1 N/m", "Q": 100}, "drive": {"A0": "10 nm"}}
AIR, BIMODAL = example("figure-3-air"), example("figure-6")


def refusal(kind, call, *args, **kwargs):
    with pytest.raises(kind) as raised:
        call(*args, **kwargs)
    message = str(raised.value)
    assert "\n" not in message
    assert len(message) < 400
    return message


# --- a case in Python


def test_the_case_of_the_design_can_be_written_in_python_or_toml():
    case = Case(
        cantilever=Cantilever(f0="48.9 kHz", k="0.9 N/m", Q=255),
        drive=Drive(A0="10 nm"),
        tip=Tip(radius="2 nm"),
        sample=Sample(youngs_modulus="1 GPa", poisson_ratio=0.3),
        forces=[forces.DMT(hamaker="2e-20 J")],
        experiment={"kind": "approach", "zc": {"start": "12 nm", "stop": "1 nm", "points": 221}, "direction": "both"},
    )
    assert case == AIR.replace(title="", about=None)
    assert isinstance(case.experiment, Approach)
    assert case.problem.tones[0].force == pytest.approx(0.9 * 10e-9 / 255)


def test_a_case_is_frozen_hashable_and_can_be_sent_to_another_process():
    with pytest.raises(ParameterError, match="cannot be changed"):
        AIR.title = "x"
    assert hash(AIR) == hash(example("figure-3-air"))
    assert pickle.loads(pickle.dumps(AIR)) == AIR


def test_a_case_is_checked_as_a_whole_when_it_is_made():
    message = refusal(ParameterError, Case, **MINIMAL, forces=[{"model": "hertz"}])
    assert message == "hertz needs tip.radius, which is missing; write radius under [tip]"


# --- changing one value


@every(
    [
        (AIR, "sample.youngs_modulus", "2 GPa", lambda c: c.sample.youngs_modulus, 2e9),
        (AIR, "forces.dmt.hamaker", 1e-20, lambda c: c.forces[0].hamaker, 1e-20),
        (AIR, "forces.1.hamaker", "1e-20 J", lambda c: c.forces[0].hamaker, 1e-20),
        (AIR, "forces.1", forces.Hertz(), lambda c: c.forces[0].name, "hertz"),
        (AIR, "cantilever.f0", "50 kHz", lambda c: c.cantilever.f0, 50e3),
        (AIR, "cantilever.modes.1.f0", "50 kHz", lambda c: c.cantilever.f0, 50e3),
        (AIR, "drive.tones.1.A0", "5 nm", lambda c: c.drive.A0, 5e-9),
        (BIMODAL, "cantilever.modes.2.Q", 50, lambda c: c.cantilever.modes[1].Q, 50),
        (BIMODAL, "drive.tones.2.A0", "2 nm", lambda c: c.drive.tones[1].A0, 2e-9),
        (AIR, "drive.frequency", "50 kHz", lambda c: c.problem.tones[0].frequency, 50e3),
        (AIR, "experiment.zc.points", 11, lambda c: c.experiment.zc.points, 11),
        (AIR, "experiment.zc", "3 nm", lambda c: c.experiment.zc, (3e-9,)),
        (AIR, "experiment", {"kind": "dwell", "zc": "4 nm"}, lambda c: c.experiment, Dwell(zc="4 nm")),
        (AIR, "contact.a0", "0.2 nm", lambda c: c.problem.a0, 0.2e-9),
        (AIR, "medium", "water", lambda c: c.medium.name, "water"),
        (AIR, "medium.temperature", "300 K", lambda c: c.medium.temperature, 300.0),
        (AIR, "solver.points_per_period", 512, lambda c: c.solver.points_per_period, 512),
        (AIR, "title", "new", lambda c: c.title, "new"),
        (AIR, "about.shows", "new", lambda c: c.about.shows, "new"),
    ]
)
def test_replacing_changes_the_value_at_a_path_and_nothing_else(case, path, value, read, expected):
    new = case.replace(path, value)
    assert read(new) == expected
    assert read(case) != expected
    if not path.startswith("about"):  # that of the old case may not be true of the new one
        case, new = case.replace(about=None), new.replace(about=None)
    before, after = case.to_toml().splitlines(), new.to_toml().splitlines()
    changed = set(before) ^ set(after)
    assert len(changed) <= 8  # an experiment or a force is several lines


@pytest.mark.parametrize(
    "change",
    [
        lambda case: case.replace("drive.A0", "5 nm"),
        lambda case: case.set("experiment.zc.points=7", "title=Mine"),
        lambda case: case.replace(forces=[forces.Hertz()]),
        lambda case: case.replace(medium="water"),
        lambda case: case.set("solver.method=transient"),
    ],
)
def test_a_description_is_of_the_case_that_it_was_written_for(change):
    changed = change(AIR)
    assert changed.about is None
    for text in (changed.to_toml(), changed.to_toml(complete=True), changed.to_python(), changed._repr_html_()):
        assert AIR.about.shows not in text
        assert AIR.about.source not in text
    assert Case.from_toml(changed.to_toml()) == changed


@pytest.mark.parametrize(
    "change",
    [
        lambda case: case.replace(title="Mine"),
        lambda case: case.set("title=Mine"),
        lambda case: case.replace("drive.A0", "0.01 um"),  # what it is anyway
        lambda case: case.replace(experiment=case.experiment),
        lambda case: case.set(),
    ],
)
def test_a_description_stays_where_nothing_but_the_title_becomes_another(change):
    assert change(AIR).about == AIR.about


def test_a_description_that_is_given_with_a_change_is_of_the_new_case():
    assert AIR.replace("drive.A0", "5 nm", about={"shows": "new"}).about == About(shows="new")
    assert AIR.replace("drive.A0", "5 nm", about=AIR.about).about == AIR.about
    assert AIR.set("drive.A0=5 nm", "about.shows=new").about.shows == "new"


def test_a_mode_given_in_a_list_may_stand_without_its_number_when_it_is_alone():
    single = Case(cantilever={"modes": [{"f0": 5e4, "k": 1, "Q": 100}]}, drive={"tones": [{"A0": 1e-8}]})
    assert single.replace("cantilever.Q", 50).cantilever.modes[0].Q == 50
    assert single.replace("drive.A0", "2 nm").drive.tones[0].A0 == 2e-9


@every(
    [
        (AIR, "sample.youngs", "no parameter 'sample.youngs'; did you mean 'sample.youngs_modulus'?"),
        (AIR, "samples.youngs_modulus", "no parameter 'samples'; did you mean 'sample'?"),
        (AIR, "drive.setpoint", "no parameter 'drive.setpoint'; write set_point under [experiment]"),
        (AIR, "drive.a0", "no parameter 'drive.a0'; did you mean 'drive.A0'?"),
        (AIR, "cantilever.q", "no parameter 'cantilever.q'; did you mean 'cantilever.Q'?"),
        (AIR, "hamaker", "no parameter 'hamaker'; did you mean 'forces.dmt.hamaker'?"),
        (AIR, "youngs_modulus", "did you mean 'tip.youngs_modulus' or 'sample.youngs_modulus'?"),
        (AIR, "forces.dmtt.hamaker", "no 'forces.dmtt'; did you mean 'forces.dmt'?"),
        (AIR, "forces.0.hamaker", "no 'forces.0'; it has 1 of them, counted from 1"),
        (AIR, "forces.2.hamaker", "no 'forces.2'; it has 1 of them, counted from 1"),
        (AIR, "forces.-1.hamaker", "no 'forces.-1'"),
        (AIR, "cantilever.beam.length", "the case has no table [cantilever.beam]; write the table"),
        (AIR, "title.x", "title is not a table in this case; it has no 'x'"),
        (AIR, "sample.youngs_modulus.x", "sample.youngs_modulus is not a table"),
        (AIR, "", "the case has no parameter ''; known: about, cantilever"),
        (AIR, "...", "the case has no parameter ''"),
        (AIR, "__class__", "the case has no parameter '__class__'"),
        (AIR, "x" * 100_000, "is not the path of a parameter"),
        (BIMODAL, "cantilever.Q", "'cantilever.Q' could be any of 2 modes; write for example cantilever.modes.1.Q"),
        (BIMODAL, "drive.A0", "could be any of 2 tones"),
        (BIMODAL, "cantilever.modes.3.Q", "no 'cantilever.modes.3'; it has 2 of them"),
    ]
)
def test_a_wrong_path_is_refused_with_the_nearest(case, path, message):
    assert message in refusal(ParameterError, case.replace, path, 1.0)


@every(
    [
        ("tip.radius", -2e-9, "tip.radius = -2 nm is not above 0 nm"),
        ("tip.radius", math.nan, "tip.radius is nan, which is not a finite number"),
        ("tip.radius", math.inf, "tip.radius is inf, which is not a finite number"),
        ("tip.radius", True, "tip.radius is true, which is neither a number nor text"),
        ("tip.radius", "9" * 100_000, "tip.radius is '999"),
        ("tip.radius", "2 quux", "where 'quux' is not a known unit (for example in nm)"),
        ("cantilever.f0", "48.9 nm", "cantilever.f0 is '48.9 nm', which is a length, not a frequency"),
        ("drive.excitation", "acoustic", "is not one of 'force' or 'base' (force: magnetic or photothermal"),
        ("cantilever.Q", "high", "cantilever.Q is 'high', which is not a number"),
        ("drive.frequency", "resonance", "not a number with a unit (for example in kHz), nor the word 'peak'"),
        ("cantilever.f0", "1e5 rad/s", "not a frequency in Hz; divide an angular frequency by 2 pi"),
        ("forces.dmt.hamaker", "-1 J", "forces.dmt.hamaker = -1 J is below 0 J"),
        ("forces", [{"model": "dtm"}], "forces.1.model = 'dtm' is not known; did you mean 'dmt'?"),
        ("forces", [{}], "forces.1.model is missing; dforce models lists all"),
        ("forces", 3, "forces = 3 is not a list of forces"),
        ("forces", [3], "forces.1 = 3 is not a table with a model"),
        ("forces", [{"model": "dmt", "hamakr": 1}], "forces.dmt has no parameter 'hamakr'; did you mean 'hamaker'?"),
        ("forces", [{"model": "hertz", "radius": 1}], "takes 'radius' from the instrument: set tip.radius instead"),
        ("forces", [{"model": "hertz"}] * 2, "hertz appears twice"),
        ("forces", [{"model": "hertz"}] * 21, "forces"),
        ("experiment.zc", [], "experiment.zc has 0 distances"),
        ("experiment.zc.points", 10**9, "experiment.zc.points = 1000000000 is above 1000000"),
        ("experiment.zc.points", 0, "experiment.zc.points = 0 is below 1"),
        ("experiment.zc.points", 2.5, "experiment.zc.points = 2.5 is not a whole number"),
        ("experiment.zc.points", True, "experiment.zc.points = true is not allowed"),
        ("experiment.zc", {"start": "1 nm"}, "experiment.zc.stop (last average distance) is missing"),
        ("experiment.direction", "up", "experiment.direction = 'up' is not one of"),
        ("experiment.start", "fre", "experiment.start = 'fre' is not one of 'free' or 'rest'; did you mean 'free'?"),
        ("experiment", {"kind": "dwel"}, "experiment.kind = 'dwel' is not known; did you mean 'dwell'?"),
        ("experiment", {"zc": "1 nm"}, "experiment.kind is missing; known: "),
        ("experiment", 3, "experiment = 3 is not a table with a kind"),
        ("solver.points_per_period", math.nan, "solver.points_per_period = nan"),
        ("title", "x" * 100_000, "is longer than 300 characters"),
        ("title", 3, "title = 3 is not text"),
        (
            "medium",
            "watr",
            "medium = 'watr' is not known: write its density and viscosity, or a name; did you mean 'water'?",
        ),
    ]
)
def test_a_value_that_is_not_allowed_is_one_sentence_with_its_path(path, value, message):
    assert message in refusal(ParameterError, AIR.replace, path, value)


# --- assignments as on a command line


def test_assignments_take_numbers_booleans_lists_tables_and_text_with_units():
    case = AIR.set(
        "sample.youngs_modulus=2 GPa",
        "experiment.protocol=stepwise",
        "experiment.carry_state=false",
        "experiment.zc={ start = '5 nm', stop = '1 nm', points = 3 }",
        "solver.points_per_period = 128",
        "forces.dmt.hamaker=1e-20",
        "title=Hard, in air = dry",
    )
    assert case.sample.youngs_modulus == 2e9
    assert case.experiment.carry_state is False
    assert case.experiment.zc.points == 3
    assert case.solver.points_per_period == 128
    assert case.forces[0].hamaker == 1e-20
    assert case.title == "Hard, in air = dry"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sample.youngs_modulus", "'sample.youngs_modulus' is not an assignment; write path=value"),
        ("=3", "'=3' is not an assignment"),
        ("tip.radius=nan", "tip.radius is nan, which is not a finite number"),
        ("tip.radius=true", "tip.radius is true"),
        ("tip.radius=", "tip.radius is '', which is not a number with a unit"),
        ("tip.radius=2020-01-01", "tip.radius is '2020-01-01', where '-01-01' is not a"),
        ("tip.radius=" + "[" * 100_000, "tip.radius is '[[["),
        ("tip.radius=1\ntitle=3", "tip.radius is '1?title=3'"),
        ("experiment.carry_state=maybe", "experiment.carry_state = 'maybe' is neither true nor false"),
    ],
    ids=shorten,
)
def test_a_wrong_assignment_is_one_sentence(text, message):
    assert message in refusal(ParameterError, AIR.set, text)


# --- TOML, in and out

LENGTH, MODULUS = st.floats(1e-12, 1e-6), st.floats(1e3, 1e12)
PHASE, DISTANCE = st.floats(-6, 6), st.floats(-1e-7, 1e-6)
WORDS = st.text(st.characters(codec="utf-8"), max_size=50)
QUALITY = st.floats(0.6, 1e6)


def table(optional=None, **keys):
    return st.fixed_dictionaries(keys, optional=optional)


MODE = table(f0=st.floats(1e3, 1e7), k=st.floats(1e-4, 1e4), Q=QUALITY)
BEAM = table(
    youngs_modulus=st.floats(1e9, 1e12),
    density=st.floats(1e3, 2e4),
    length=st.floats(1e-4, 5e-4),
    width=st.floats(1e-6, 1e-4),
    thickness=st.floats(1e-6, 1e-5),
    Q=QUALITY,
)
TONE = table({"frequency": st.floats(5e3, 1e6), "phase": PHASE}, A0=LENGTH)
SEVERAL_TONES = table(
    {"acts_on": st.sampled_from(["all_modes", "own_mode"])},
    tones=st.lists(TONE.map(lambda tone: tone | {"mode": 1}), min_size=1, max_size=3),
)
START = st.sampled_from(["free", "rest"]) | table(amplitude=LENGTH, phase=PHASE)
GRID = table(start=LENGTH, stop=LENGTH, points=st.integers(1, 10**6)).filter(lambda grid: grid["start"] != grid["stop"])
DWELL = table({"start": START}, kind=st.just("dwell"), zc=DISTANCE)
APPROACH = table(
    {"direction": st.sampled_from(["approach", "retract", "both"]), "carry_state": st.booleans(), "start": START},
    kind=st.just("approach"),
    zc=GRID | st.lists(DISTANCE, min_size=1, max_size=5),
).map(lambda given: given if given.get("carry_state", True) else given | {"protocol": "stepwise"})
FORCES = [
    [],
    [{"model": "hertz"}],
    [{"model": "dmt", "hamaker": "2e-20 J"}, {"model": "kelvin_voigt", "viscosity": 31.4}],
]
MEDIA = ["water", "air", {"name": "water", "temperature": 310.0}, {"density": 1000.0}]
CASES = table(
    {
        "title": WORDS,
        "about": table(shows=WORDS),
        "contact": table(a0=st.floats(1e-11, 1e-9)),
        "medium": st.sampled_from(MEDIA),
        "experiment": DWELL | APPROACH,
    },
    cantilever=MODE | table(modes=st.lists(MODE, min_size=1, max_size=3)) | table(beam=BEAM),
    drive=TONE | SEVERAL_TONES,
    tip=table({"youngs_modulus": MODULUS, "half_angle": st.floats(0.01, 1.5)}, radius=LENGTH),
    sample=table({"poisson_ratio": st.floats(0.0, 0.5)}, youngs_modulus=MODULUS),
    forces=st.sampled_from(FORCES),
)


@given(CASES)
@settings(max_examples=150, suppress_health_check=[HealthCheck.too_slow])
def test_a_case_becomes_text_and_comes_back_without_loss(given_case):
    case = Case(**given_case)
    for text in (case.to_toml(), case.to_toml(complete=True)):
        back = Case.from_toml(text)
        assert back == case
        assert back.problem == case.problem
    assert Case.from_toml(case.to_toml()).to_toml() == case.to_toml()


def test_the_text_of_a_case_reads_like_the_design():
    text = BIMODAL.replace(title="A title", about=None, medium="water").to_toml()
    assert text.startswith(
        'title = "A title"\nmedium = "water"\n\n[[cantilever.modes]]\nf0 = "50 kHz"\nk = "0.9 N/m"\nQ = 10\n'
    )
    assert '\n\n[[forces]]\nmodel = "dmt"\nhamaker = "40 zJ"\n' in text
    assert 'zc = { start = "12 nm", stop = "1 nm", points = 221 }\n' in AIR.to_toml()


def test_complete_text_holds_the_defaults_too():
    written = tomllib.loads(AIR.to_toml(complete=True))
    assert written["contact"] == {"a0": "0.165 nm"}
    assert written["solver"]["points_per_period"] == 256


def test_text_that_needs_escapes_survives():
    title = 'quote " backslash \\ tab \t newline \n delete \x7f umlaut ü emoji 😀'
    case = AIR.replace("title", title)
    assert Case.from_toml(case.to_toml()).title == title


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the case is empty"),
        ("# nothing", "the case is empty"),
        ("a =", "the case is not TOML"),
        (
            "[drive]\nA0 = 10 nm",
            "(at line 2, column 9) in 'A0 = 10 nm'; write numbers as 5.0, units as \"10 nm\" in plain quotes",
        ),
        (
            "[drive]\nA0 = \N{LEFT DOUBLE QUOTATION MARK}10 nm\N{RIGHT DOUBLE QUOTATION MARK}",
            "in plain quotes, and each name once",
        ),
        ("[tip]\n[tip]", "in '[tip]'; write numbers as 5.0"),
        ("\0\1\2", "the case is not TOML"),
        ("a = " + "[" * 100_000, "the case is not TOML: it is nested too deeply"),
        ("x." * 5000 + "y = 1", "the case is not TOML: line 1 has a key of more than 12 parts"),
        ("x = 1", "case has no parameter 'x'; known: about, cantilever"),
        ("[drive]\nA0 = '1 nm'", "cantilever (the cantilever: one mode, several, or a beam) is missing"),
        ("cantilever = 3\ndrive = 4", "cantilever = 3 is not a table of parameters"),
        ("a = " + "1" * 5000, "the case is not TOML"),
        ("#" * 1_000_001, "the limit is 1000000"),
        ("[cantilever]\nf0 = nan\nk = 1\nQ = 2\n[drive]\nA0 = 1", "cantilever.f0 is nan"),
        ("[cantilever]\nf0 = 2020-01-01\nk = 1\nQ = 2\n[drive]\nA0 = 1", "cantilever.f0 is datetime.date(2020, 1, 1)"),
        ("[sampel]\n[cantilever]\n[drive]", "case has no parameter 'sampel'; did you mean 'sample'?"),
    ],
    ids=shorten,
)
def test_text_that_is_not_a_case_is_one_sentence(text, message):
    assert message in refusal(DForceError, Case.from_toml, text)


def test_a_measured_file_in_the_place_of_a_case_is_told_by_what_reads_it(tmp_path):
    file = tmp_path / "curve.csv"
    file.write_text("height (nm),amplitude (nm)\n1,2\n")
    assert refusal(DForceError, load_case, file).endswith("; to read a measured curve type dforce read FILE")
    assert "dforce read FILE a measured curve" in refusal(DForceError, read, file)


@given(st.text(max_size=200))
def test_no_text_gives_anything_but_a_case_or_a_sentence(text):
    try:
        Case.from_toml(text)
    except DForceError as error:
        assert "\n" not in str(error)


# --- files


def test_a_case_file_is_written_and_read(tmp_path):
    path = tmp_path / "case.toml"
    save_case(AIR, path)
    assert load_case(path) == AIR
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))  # as an editor of Windows does
    assert load_case(path) == AIR
    assert [file.name for file in tmp_path.iterdir()] == ["case.toml"]


def test_a_file_that_cannot_be_written_is_one_sentence_and_leaves_nothing(tmp_path):
    (tmp_path / "case.toml").mkdir()
    message = refusal(CaseError, save_case, AIR, tmp_path / "case.toml")
    assert "could not be written" in message
    assert [file.name for file in tmp_path.iterdir()] == ["case.toml"]
    assert "could not be written" in refusal(CaseError, save_case, AIR, tmp_path / "no" / "case.toml")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "case.toml: the case is empty"),
        (b"\x89PNG\r\n\x1a\n\xff", "case.toml: the file is not text in UTF-8"),
        ('[drive]\nA0 = "5 nm"'.encode("utf-16"), "if it is text, save it in the editor with the encoding UTF-8"),
        (b"#" * 1_000_001, "case.toml' is larger than 1 MB, the limit for a case"),
        (
            b"[tip]\nradius = -1\n[cantilever]\nf0=1\nk=1\nQ=1\n[drive]\nA0=1e-9",
            "case.toml: tip.radius = -1 m is not above 0 nm",
        ),
        (b"\x89HDF\r\n\x1a\n broken", "case.toml: the file of results is damaged or cut off"),
    ],
    ids=shorten,
)
def test_a_file_that_is_not_a_case_is_one_sentence_with_its_name(tmp_path, content, message):
    path = tmp_path / "case.toml"
    path.write_bytes(content)
    assert message in refusal(CaseError, load_case, path)


def test_a_result_that_is_not_one_is_not_taken_for_a_case_file(tmp_path):
    path = tmp_path / "out.nc"
    for content in (b"", b"\xff\xfe", b"[drive]\n"):
        path.write_bytes(content)
        assert "out.nc: the file is damaged or not a file of results" in refusal(CaseError, load_case, path)


def test_what_is_not_a_file_is_one_sentence(tmp_path):
    assert "is a folder" in refusal(CaseError, load_case, tmp_path)
    assert "did you mean the example 'figure-3-air'?" in refusal(CaseError, load_case, tmp_path / "figure-3-ari.toml")
    assert "there is no file" in refusal(CaseError, load_case, tmp_path / "zzz")
    assert "cannot be read" in refusal(CaseError, load_case, "a\0b")
    assert "cannot be read" in refusal(CaseError, load_case, "x" * 10_000)


def test_the_case_inside_a_file_of_results_can_be_loaded(tmp_path):
    import h5py

    with h5py.File(tmp_path / "out.nc", "w") as file:
        file.attrs["case"] = AIR.to_toml(complete=True)
    assert load_case(tmp_path / "out.nc") == AIR


# --- the schema

SCHEMA = case_schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def test_the_schema_is_one_and_can_be_written():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert json.loads(json.dumps(SCHEMA)) == SCHEMA


@pytest.mark.parametrize("name", sorted(library.examples()))
def test_the_schema_accepts_the_examples(name):
    VALIDATOR.validate(tomllib.loads(library.example_text(name)))
    VALIDATOR.validate(tomllib.loads(example(name).to_toml(complete=True)))


@pytest.mark.parametrize(
    "mistake",
    [
        lambda case: case["sample"].update(youngs=1),
        lambda case: case["tip"].update(radius=-1e-9),
        lambda case: case["tip"].update(radius="small"),
        lambda case: case["tip"].update(radius=True),
        lambda case: case["forces"][0].update(model="dtm"),
        lambda case: case["forces"][0].update(radius=1e-9),
        lambda case: case["experiment"].pop("kind"),
        lambda case: case["experiment"].update(direction="up"),
        lambda case: case.update(medium="watr"),
        lambda case: case.pop("drive"),
    ],
    ids=range(10),
)
def test_the_schema_refuses_what_a_case_refuses(mistake):
    table = tomllib.loads(library.example_text("figure-3-air"))
    mistake(table)
    assert not VALIDATOR.is_valid(table)
    with pytest.raises(ParameterError):
        Case(**table)


def test_the_schema_describes_every_key_of_the_instrument():
    for section in ("Tip", "Sample", "Mode", "Tone", "Contact", "Beam"):
        found = SCHEMA["$defs"][section]
        table = found["anyOf"][1] if "anyOf" in found else found  # beside the names that are known
        for name, key in table["properties"].items():
            assert key["description"], f"{section}.{name}"
    assert SCHEMA["$defs"]["Tip"]["properties"]["radius"]["unit"] == "m"


def test_a_list_of_distances_may_be_an_array():
    distances = np.linspace(2e-9, 1e-9, 3)
    case = AIR.replace("experiment.zc", distances)
    assert case.experiment.zc == tuple(distances)
    assert Case.from_toml(case.to_toml()) == case


def test_about_and_medium_are_plain_sections():
    case = Case(**MINIMAL, about=About(shows="x"), medium=Medium(name="air"))
    assert 'medium = "air"' in case.to_toml()
