"""Forces in files of the user's own and in other packages."""

import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from compiled import compose
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app
from dforce.core import log
from dforce.core.errors import CaseError, ForceError, ParameterError
from dforce.core.files import beside
from dforce.forces import REGISTRY, _plugins

GOOD = '''
from math import exp

import dforce as df


class Repulsion(df.Force):
    r"""Exponential repulsion.

    .. math:: F = F_0 e^{-d/L}
    """

    name = "repulsion"
    source = "this test"
    a0: float = df.shared("contact.a0")
    strength: float = df.param("1 nN", low="0 N", symbol="F_0", doc="force at zero distance")

    @staticmethod
    def law(d, rate, t, strength, a0):
        return strength * exp(-max(d, a0) / 1e-9)

    def kinks(self):
        return (self.a0,)
'''
CASE = """
plugins = ["repulsion.py"]
[cantilever]
f0 = "48.9 kHz"
k = "0.9 N/m"
Q = 30
[drive]
A0 = "10 nm"
[[forces]]
model = "repulsion"
strength = "2 nN"
[experiment]
kind = "dwell"
zc = "9 nm"
[solver]
method = "transient"
settle = "fixed"
periods = 10
"""


@pytest.fixture
def said(monkeypatch):
    """Return what is announced; models of the test's own are forgotten after it."""
    sentences, before = [], dict(REGISTRY)
    monkeypatch.setattr(log, "announce", sentences.append)
    monkeypatch.setattr(_plugins, "_LOADED", {})
    yield sentences
    REGISTRY.clear()
    REGISTRY.update(before)


@pytest.fixture
def folder(tmp_path, said):
    (tmp_path / "repulsion.py").write_text(GOOD)
    (tmp_path / "case.toml").write_text(CASE)
    return tmp_path


def test_a_plugin_is_found_beside_the_case_file_and_announced_once(folder, said):
    case = df.load_case(folder / "case.toml")
    df.load_case(folder / "case.toml")
    assert case.forces[0].strength == 2e-9
    assert said == [f"Running code that is not part of dForce: {folder / 'repulsion.py'}"]
    assert not (folder / "__pycache__").exists()


def test_a_case_with_a_plugin_can_be_changed_from_anywhere_and_written_back(folder, tmp_path_factory, monkeypatch):
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    case = df.load_case(folder / "case.toml")
    assert case.replace("forces.repulsion.strength", "3 nN").forces[0].strength == 3e-9
    assert case.set("drive.A0=5 nm").forces == case.forces
    df.save_case(case, folder / "again.toml")
    assert df.load_case(folder / "again.toml") == case


def test_a_result_finds_its_plugin_in_its_folder_or_beside_itself_or_says_where_it_looked(folder, tmp_path_factory):
    case, elsewhere = df.load_case(folder / "case.toml"), tmp_path_factory.mktemp("elsewhere")
    result, gone = df.force_curve(case), folder.with_name("gone")
    for place in (folder, elsewhere):
        df.write(result, place / "out.nc")
        assert df.load_case(place / "out.nc") == case
    folder.rename(gone)
    assert df.load_case(gone / "out.nc").forces == case.forces
    with pytest.raises(CaseError, match=rf"out\.nc: the plug-in '{elsewhere}/repulsion\.py': there is no such file"):
        df.load_case(elsewhere / "out.nc")


TABLE = "TABLE = np.array([{}])\n\n\nclass Repulsion"


def test_a_result_is_not_continued_with_a_plugin_whose_code_or_array_has_changed(folder):
    def write(number):
        text = GOOD.replace("import dforce as df", "import numpy as np\nimport dforce as df")
        (folder / "repulsion.py").write_text(text.replace("class Repulsion", TABLE.format(number)))
        return df.load_case(folder / "case.toml")

    case, over, store = write(1.0), {"forces.repulsion.strength": ["1 nN", "2 nN"]}, folder / "swept.zarr"
    stopped = df.run(case).assign_attrs(interrupted=1)
    df.sweep(case, over, store=store)  # from another folder
    assert df.sweep(write(1.0), over, store=store, resume=True).sizes["strength"] == 2
    changed = write(2.0)
    for go_on in (lambda: df.run(changed, resume=stopped), lambda: df.sweep(changed, over, store=store, resume=True)):
        with pytest.raises(ParameterError, match="a force model of your own has changed since this result"):
            go_on()


CURVE = {"kind": "approach", "zc": {"start": "12 nm", "stop": "8 nm", "points": 5}}


def curve_of(case):
    return case.replace(experiment=CURVE, solver=df.SolverSettings())


def test_a_result_finds_its_plugin_from_anywhere(folder, tmp_path_factory, monkeypatch):
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    curve = df.run(curve_of(df.load_case(folder / "case.toml")))
    wanted = df.noise(curve, "1 kHz").amplitude_noise
    assert np.isfinite(wanted).all()
    assert df.advice(curve) is not None
    df.write(curve, "curve.nc")
    np.testing.assert_array_equal(df.noise(df.read("curve.nc"), "1 kHz").amplitude_noise, wanted)
    folder.rename(folder.with_name("moved"))  # as on another computer
    (folder.with_name("moved") / "repulsion.py").rename("repulsion.py")
    np.testing.assert_array_equal(df.noise(df.read("curve.nc"), "1 kHz").amplitude_noise, wanted)


def test_a_result_with_a_plugin_does_not_show_the_home_of_the_user(folder, tmp_path_factory, monkeypatch):
    monkeypatch.chdir(tmp_path_factory.mktemp("elsewhere"))
    monkeypatch.setenv("HOME", str(folder.parent))
    monkeypatch.setenv("USERPROFILE", str(folder.parent))
    curve = df.run(curve_of(df.load_case(folder / "case.toml")))
    assert str(folder.parent) not in str(curve.attrs)
    df.write(curve, "curve.nc")
    assert np.isfinite(df.noise(df.read("curve.nc"), "1 kHz").amplitude_noise).any()


def test_a_result_is_understood_by_the_model_that_it_was_computed_with(folder, monkeypatch):
    monkeypatch.chdir(folder)
    case = curve_of(df.load_case("case.toml"))
    old, twice = df.run(case), df.run(case.replace("forces.repulsion.strength", "4 nN"))
    wanted = [df.noise(curve, "1 kHz").amplitude_noise for curve in (old, twice)][1]
    (folder / "repulsion.py").write_text(GOOD.replace("return strength", "return 2.0 * strength"))
    new = df.run(curve_of(df.load_case("case.toml")))
    assert new.attrs["case"] == old.attrs["case"]
    np.testing.assert_allclose(df.noise(new, "1 kHz").amplitude_noise, wanted, rtol=1e-6)
    with pytest.raises(ParameterError, match="a force model of your own has changed since this result"):
        df.noise(old, "1 kHz")


def test_a_model_that_a_script_or_notebook_defines_anew_is_not_taken_for_the_old_one(tmp_path):
    lines = [GOOD, "case = df.Case.from_toml(CASE)", "old = df.run(case)", GOOD.replace("return", "return 2.0 *", 1)]
    lines += ["try:", "    df.advice(old)", "except df.ParameterError as error:", "    print(error)"]
    lines += [
        "new = df.run(df.Case.from_toml(CASE))",
        "df.advice(new)",
        "print(new.attrs['case'] == old.attrs['case'])",
    ]
    text = CASE.replace('plugins = ["repulsion.py"]', "")
    (tmp_path / "script.py").write_text(f"CASE = {text!r}\n" + "\n".join(lines))
    done = subprocess.run([sys.executable, tmp_path / "script.py"], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        "a force model of your own has changed since this result; compute the result anew",
        "True",
    ]


def test_a_constant_and_a_function_that_a_notebook_defines_anew_change_the_law(folder, monkeypatch):
    text = GOOD.replace("class Rep", "SCALE = 1.0\n\n\ndef share():\n    return 1.0\n\n\nclass Rep")
    (folder / "repulsion.py").write_text(text.replace("return strength", "return SCALE * share() * strength"))
    case = curve_of(df.load_case(folder / "case.toml"))
    once, twice = (df.run(case.replace("forces.repulsion.strength", one)).amplitude for one in ("2 nN", "4 nN"))
    module = sys.modules[type(case.forces[0]).__module__]
    for name, value in {"SCALE": 2.0, "share": double}.items():
        with monkeypatch.context() as changed:
            changed.setattr(module, name, value)
            np.testing.assert_array_equal(df.run(case).amplitude, twice)
        np.testing.assert_array_equal(df.run(case).amplitude, once)


def double():
    return 2.0


@pytest.mark.parametrize(
    ("law", "sentence"),
    [
        (
            "np.where(d < a0, strength, 0.0)",
            "the law of 'repulsion' at d = 10 nm returns ndarray, but must return a number",
        ),
        ("strength if d < a0 else None", "at d = 10 nm returns NoneType, but must"),
        ("strength * (a0 - d) ** 1.5", "at d = 10 nm returns complex, but must"),
        ("strength + ''", "at d = 10 nm fails: TypeError: unsupported operand"),
        ("strength * len(f'{d:.3f}')", "the tip equation for repulsion cannot be compiled: "),
    ],
)
def test_a_law_without_a_number_or_that_cannot_be_compiled_is_one_sentence(folder, law, sentence):
    text = GOOD.replace("import dforce", "import numpy as np\nimport dforce")
    (folder / "repulsion.py").write_text(text.replace("strength * exp(-max(d, a0) / 1e-9)", law))
    with pytest.raises(ForceError, match=re.escape(sentence)):
        df.run(df.load_case(folder / "case.toml"))


@pytest.mark.parametrize(
    ("law", "sentence"),
    [
        (
            "strength if d > 3e-9 else None",
            r"the law of 'repulsion' at d = \S+ nm returns NoneType, but must return a number",
        ),
        ("strength * (d - 3e-9) ** 1.5", r"the law of 'repulsion' at d = \S+ nm returns complex, but must"),
        (
            "strength * (0.0, 1.0, 2.0)[int(2e8 * (d - 2e-9))]",
            "at d = 20 nm fails: IndexError: tuple index out of range",
        ),
    ],
)
def test_a_law_that_gives_no_number_ends_a_force_curve_in_one_sentence(folder, law, sentence):
    (folder / "repulsion.py").write_text(GOOD.replace("strength * exp(-max(d, a0) / 1e-9)", law))
    case = df.load_case(folder / "case.toml")
    with pytest.raises(ForceError, match=sentence):
        df.force_curve(case, distance=["20 nm", "8 nm", "2 nm", "1 nm"])


@pytest.mark.parametrize(
    ("part", "argument", "body", "sentence"),
    [
        (
            "switch",
            "latched",
            "return None",
            "the switch of 'repulsion' at d = 10 nm returns NoneType, but must return a number",
        ),
        (
            "switch",
            "latched",
            "raise KeyError('side')",
            "the switch of 'repulsion' at d = 10 nm fails: KeyError: 'side'",
        ),
        (
            "evolve",
            "memory",
            "raise KeyError('rate')",
            "the evolve of 'repulsion' at d = 10 nm fails: KeyError: 'rate'",
        ),
        (
            "evolve",
            "memory",
            "change[5] = 1.0",
            "the evolve of 'repulsion' at d = 10 nm fails: IndexError: index 5 is out",
        ),
    ],
)
@pytest.mark.parametrize("ask", [df.force_curve, df.run])
def test_a_switch_or_an_evolve_that_fails_is_one_sentence(folder, part, argument, body, sentence, ask):
    _write(folder, part, argument, body)
    with pytest.raises(ForceError, match=re.escape(sentence)):
        ask(df.load_case(folder / "case.toml"))


def test_an_evolve_that_divides_by_zero_is_refused_where_a_force_follows_a_path(folder):
    _write(folder, "evolve", "memory", "change[0] = 1.0 / (0.0 * d)")
    with pytest.raises(ForceError, match=r"the evolve of 'repulsion' at d = \S+ nm gives no finite number"):
        df.force_curve(df.load_case(folder / "case.toml"))


def _write(folder, part, argument, body):
    """Write a plug-in whose switch or evolve has the given body."""
    first = "latched, d, rate, t" if part == "switch" else "d, rate, t, memory, change"
    text = GOOD.replace("law(d, rate, t,", f"law(d, rate, t, {argument},")
    arguments = text.partition("def law(")[2].partition(")")[0].removeprefix(f"d, rate, t, {argument}, ")
    text = text.rstrip() + f"\n\n    @staticmethod\n    def {part}({first}, {arguments}):\n        {body}\n"
    if part == "evolve":
        text = text.replace('    name = "repulsion"', '    name = "repulsion"\n    memory = 1')
    (folder / "repulsion.py").write_text(text)


@pytest.mark.parametrize(
    ("law", "sentence"),
    [
        (
            "-strength * math.sqrt(d - 3e-9)",
            "the law of repulsion gives no finite number at d = 3 nm; make it finite there",
        ),
        ("-strength if d > 3e-9 else None", "the law of 'repulsion' at d = 3 nm returns NoneType, but must"),
    ],
)
@pytest.mark.parametrize(
    "ask", [lambda case: df.snap_in_rate(case, "8 nm"), lambda case: df.snap_in_distance(case, "1 um/s")]
)
def test_a_law_without_a_number_ends_the_search_for_a_barrier_in_one_sentence(folder, law, sentence, ask):
    text = GOOD.replace("import dforce", "import math\nimport dforce")
    (folder / "repulsion.py").write_text(text.replace("strength * exp(-max(d, a0) / 1e-9)", law))
    with pytest.raises(ForceError, match=sentence):
        ask(df.load_case(folder / "case.toml"))


def test_a_copy_of_a_plugin_is_the_same_model_and_another_file_of_its_name_is_refused(folder, tmp_path_factory):
    case, elsewhere = df.load_case(folder / "case.toml"), tmp_path_factory.mktemp("elsewhere")
    for name in ("repulsion.py", "case.toml"):
        (elsewhere / name).write_text((folder / name).read_text())
    assert df.load_case(elsewhere / "case.toml") == case
    (elsewhere / "repulsion.py").write_text(GOOD + "\n")
    with pytest.raises(ForceError, match=rf"of {elsewhere}/repulsion.py is already defined in {folder}/repulsion.py;"):
        df.load_case(elsewhere / "case.toml")
    (folder / "repulsion.py").write_text(GOOD.replace("return strength", "return 2.0 * strength"))
    (elsewhere / "repulsion.py").write_text(GOOD)  # the first text, whose model another one has replaced
    df.load_case(folder / "case.toml")
    with pytest.raises(ForceError, match="rename one"):
        df.load_case(elsewhere / "case.toml")


def test_a_plugin_that_has_changed_is_run_again_and_gives_another_kernel(folder):
    before = df.load_case(folder / "case.toml")
    text = compose(1, before.problem.forces, {})
    (folder / "repulsion.py").write_text(GOOD.replace("/ 1e-9", "/ 2e-9"))
    after = df.load_case(folder / "case.toml")
    assert after.forces[0] != before.forces[0]
    assert compose(1, after.problem.forces, {}) == text.replace("/ 1e-09", "/ 2e-09") != text


def test_a_kernel_does_not_depend_on_where_the_plugin_lies(folder, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    for name in ("case.toml", "repulsion.py"):
        (elsewhere / name).write_text((folder / name).read_text())
    text = compose(1, df.load_case(folder / "case.toml").problem.forces, {})
    REGISTRY.pop("repulsion")
    assert compose(1, df.load_case(elsewhere / "case.toml").problem.forces, {}) == text


def test_a_plugin_passes_the_battery_and_a_bad_one_does_not(folder):
    (model,) = df.load_plugin(folder / "repulsion.py")
    df.check_force(model)
    (folder / "repulsion.py").write_text(GOOD.replace("def kinks", "def other"))
    (model,) = df.load_plugin(folder / "repulsion.py")
    with pytest.raises(ForceError, match="declare the kink"):
        df.check_force(model)


BAD = {
    "x = 1/0": "ZeroDivisionError in line 1: division by zero",
    "x = ": "it is not Python: invalid syntax in line 1",
    "x = '\0'": "null byte",
    GOOD.replace(": float = df.param", " = df.param"): "field '.*' has no type; write NAME: float = param",
    "import sys\nsys.exit(3)": "SystemExit in line 2: 3",
    "import nowhere_at_all": "ModuleNotFoundError in line 1",
    "x = 1": "it defines no force model",
    "raise RuntimeError": "RuntimeError in line 1",
    GOOD.replace('"repulsion"', '"dmt"'): "'dmt' of .* is already defined in dforce.forces.dmt; rename one",
    GOOD.replace("t, strength", "t, stength"): "takes 'stength', neither a field nor a property",
}


@pytest.mark.parametrize("text", BAD, ids=range(len(BAD)))
def test_a_plugin_that_cannot_be_used_is_one_sentence_and_leaves_nothing(text, tmp_path, said):
    (tmp_path / "mine.py").write_text(text)
    before = dict(REGISTRY)
    with pytest.raises(ForceError, match=rf"^the plug-in '.*mine\.py' cannot be used: .*({BAD[text]})") as caught:
        df.load_plugin(tmp_path / "mine.py")
    assert "\n" not in str(caught.value)
    assert before == REGISTRY
    assert not [name for name in sys.modules if name.startswith("dforce_plugin") and name.endswith(".mine")]


def test_a_failed_change_leaves_the_older_models(folder):
    df.load_plugin(folder / "repulsion.py")
    model = REGISTRY["repulsion"]
    (folder / "repulsion.py").write_text(GOOD + "\n1/0\n")
    with pytest.raises(ForceError, match="ZeroDivisionError"):
        df.load_plugin(folder / "repulsion.py")
    assert REGISTRY["repulsion"] is model


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("nothing.py", "nothing.py': there is no such file"),
        ("folder.py", "folder.py' is a folder, not a file"),
        ("case.toml", "is not a Python file"),
        ("https://example.org/force.py", "there is no such file"),
        ("a\0.py", "is not a Python file"),
        ("x" * 5000 + ".py", "cannot be read|there is no such file"),
        ("huge.py", "is larger than 1 MB"),
    ],
)
def test_what_is_no_plugin_is_one_sentence(folder, name, words):
    (folder / "folder.py").mkdir()
    (folder / "huge.py").write_text("#" * 1_000_001)
    with beside(folder), pytest.raises(ParameterError, match=words) as caught:
        df.load_plugin(name)
    assert len(str(caught.value)) < 500


PACKAGE = {
    "good_force.py": GOOD,
    "good_force-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: good-force\nVersion: 1.0\n",
    "good_force-1.0.dist-info/entry_points.txt": "[dforce.forces]\nrepulsion = good_force\n",
    "bad_force.py": "x = 1/0\n",
    "bad_force-1.0.dist-info/METADATA": "Metadata-Version: 2.1\nName: bad-force\nVersion: 1.0\n",
    "bad_force-1.0.dist-info/entry_points.txt": "[dforce.forces]\nbroken = bad_force\n",
}


def test_another_package_adds_a_force_and_a_broken_one_takes_no_other_with_it(tmp_path):
    for name, text in PACKAGE.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    code = """
        import sys
        import dforce as df
        assert "good_force" not in sys.modules  # nothing is loaded before it is needed
        force = df.forces.Repulsion()
        print(force.bind({"contact.a0": 1e-10}).name, "dmt" in df.forces.REGISTRY)
        print(len(df.forces.code_of([force])), len(df.forces.code_of([df.forces.DMT(hamaker=1e-20)])))
    """
    ran = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)],
        env={**os.environ, "PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert ran.stdout.split() == ["repulsion", "True", "64", "0"]
    assert ran.stderr.strip() == (
        "The force plug-in 'broken' (bad_force) cannot be loaded: ZeroDivisionError: division by zero"
    )


def test_advice_names_the_distance_where_a_law_of_a_file_has_no_value(folder):
    """The law fails in Python where its compiled form gives NaN, and the curve ended with Python's error."""
    rooted = GOOD.replace(
        "strength * exp(-max(d, a0) / 1e-9)", "strength * (sqrt(d / 9e-9) - 1.0) if d < 9e-9 else 0.0"
    )
    (folder / "repulsion.py").write_text(rooted.replace("import exp", "import sqrt"))
    case = df.load_case(folder / "case.toml").set("forces.1.strength=20 pN").replace(solver={})
    curve = df.approach(case, zc=["15 nm", "12 nm", "9 nm", "6 nm"])
    assert curve["status"].values[0] == df.Status.OK and curve["status"].values[-1] == df.Status.FAILED
    (piece,) = [one for one in df.advice(curve) if one.name == "law_without_value"]
    assert "repulsion gives no finite number at d = -" in piece.text
    # motions without an end have no winding number: samples were added between them for many minutes
    found = df.branches(case, zc=["12 nm", "9 nm"])
    assert (found["status"] == df.Status.OK).any() and (found["index_sum"] != 1).any()
    assert "law_without_value" in {one.name for one in df.advice(found)}


@pytest.mark.parametrize("name", ["hertz", "capillary"])
def test_a_file_of_the_package_itself_is_checked_like_any_other(name):
    file = Path(sys.modules[df.forces.REGISTRY[name].__module__].__file__)
    before = dict(df.forces.REGISTRY)
    assert df.load_plugin(file) == (df.forces.REGISTRY[name],)
    done = CliRunner().invoke(app, ["models", "check", str(file)])
    assert (done.exit_code, done.output) == (0, f"{name}: passes every check\n")
    assert before == df.forces.REGISTRY


def test_the_guide_to_a_new_force_says_what_the_contract_demands():
    guide = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    guide = " ".join(guide.split("## Add a force")[1].split("\n## ")[0].split())
    assert "name of a field, such as `a0`, or of a property of the class, such as `stiffness`" in guide
    model = df.forces.REGISTRY["hertz"]
    assert "a0" in model.model_fields and isinstance(model.stiffness, property)
    # what every shipped model gives is explained
    assert all(f"`{word}" in guide for word in ("name`", "source`", "contains`", "law(", "potential(", "kinks`"))
    assert model.contains[0] in guide
