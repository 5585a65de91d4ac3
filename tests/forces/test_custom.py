"""A force written as an expression: what it means, what it may not hold, and what becomes of it in a run."""

import math
import random
import re

import numpy as np
import pytest
from compiled import compose
from every import every
from hypothesis import given
from hypothesis import strategies as st

import dforce as df
from dforce import kernel
from dforce.checks.battery import INSTRUMENT, compile_function
from dforce.core.errors import ParameterError
from dforce.forces import DMT, Custom

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

A0, R, E_EFF = INSTRUMENT["contact.a0"], INSTRUMENT["tip.radius"], INSTRUMENT["contact.E_eff"]
AS_DMT = "where(d > a0, -H*R/(6*d**2), 4/3*E_eff*sqrt(R)*indentation**1.5 - H*R/(6*a0**2))"
SPRING = f"{AS_DMT} - P1*k/Q*z"  # and beside it a spring P1/Q times as stiff as the cantilever
DISTANCES = (-2e-9, 0.0, 0.1e-9, A0, 0.2e-9, 1e-9, 3e-8)


def make(law, **given):
    return Custom(law=law, **given).bind(INSTRUMENT)


def value(force, d=1e-9, rate=0.0, t=0.0, zc=None):
    place = () if zc is None else (zc,)
    return force.law_function()(d, rate, t, *place, *force.values())


def case(*forces, **settings):
    return df.Case(
        cantilever=df.Cantilever(f0="48.9 kHz", k="0.9 N/m", Q=30),
        drive=df.Drive(A0="10 nm"),
        tip=df.Tip(radius="2 nm"),
        sample=df.Sample(youngs_modulus="1 GPa", poisson_ratio=0.3),
        forces=forces,
        solver={"method": "transient", **settings},
    )


@pytest.mark.parametrize("d", DISTANCES)
def test_an_expression_equals_the_built_in_force_that_it_spells_out(bound, d):
    built_in = bound(DMT(hamaker=2e-20))
    expected = DMT.law(d, 0.0, 0.0, *built_in.values())
    # a few roundings in another order, and both terms of the contact cancel in part
    assert value(make(AS_DMT, hamaker=2e-20), d) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        ("d + 2*t - velocity", 1e-9 + 2 * 3.0 - 0.5),
        ("R*E_eff*k/Q", R * E_EFF * 1.0 / 100.0),
        ("z", 1e-9 - 4e-9),
        ("-P1**2", -4.0),
        ("2**-P1", 0.25),
        ("2**3**2", 512.0),
        ("P1**-1.5 + P1**0.5", 2.0**-1.5 + 2.0**0.5),
        ("P1**0.3", 2.0**0.3),
        ("1 if 0 < d < 1e-8 else 2", 1.0),
        ("where(d > 1 or not d > 0, 5, 6)", 6.0),
        ("min(3, P1, 5) + max(1, d)", 3.0),
        ("abs(-P1) + sign(-d)", 1.0),
        ("sin(P1)**2 + cos(P1)**2 + atan(tan(1)) - pi/pi", 1.0),
        ("exp(log(P1)) + log10(100) + cosh(0) + sinh(0) + tanh(0) + asin(0) + acos(1)", 5.0),
        ("indentation", 0.0),
        ("1e-9", 1e-9),
        ("−2·P1³×P1", -32.0),  # as typeset in a paper
    ],
)
def test_an_expression_means_what_it_says(law, expected):
    force = make(law, P1=2.0)
    zc = 4e-9 if "zc" in force.leading() else None
    assert value(force, 1e-9, 0.5, 3.0, zc) == pytest.approx(expected, rel=1e-14)


REFUSED = {
    "__import__('os').system('touch caught')": "an attribute",
    "open('caught', 'w')": "unknown function 'open'",
    "eval('1')": "unknown function 'eval'",
    "import os": "not an expression",
    "d.__class__": "an attribute",
    "().__class__.__bases__[0].__subclasses__()": "an attribute",
    "__builtins__": "unknown name '__builtins__'",
    "(lambda: d)()": "a lambda",
    "[d for d in d]": "a comprehension",
    "sum(d for d in d)": "unknown function 'sum'",
    "max(d for d in d)": "fewer than two",
    "d[0]": "an index",
    "(d := 3)": "an assignment",
    "f'{d}'": "text",
    "'a'*10**9": "the text 'a'",
    "1j": "only plain numbers",
    "True": "only plain numbers",
    "np.exp(d)": "an attribute",
    "sqrt(*d)": "not plain",
    "sqrt(x=d)": "not plain",
    "9**9**9": "'9 ** 9 ** 9', which is not a finite number",
    "9**9**9*d": "not a finite number",
    "1e999": "not a finite number",
    "1/0 + d": "'1 / 0', which is not a finite number",
    "log(-1)": "not a finite number",
    "9" * 1900: "not a finite number",
    "indentatoin": "did you mean 'indentation'",
    "sqr(d)": "did you mean 'sqrt'",
    "exp": "without its arguments",
    "d(3)": "d is a number and not a function",
    "sqrt(d, 2)": "2 instead of 1",
    "0,5*P1": "has a comma outside a function; write decimals with a point, such as 0.5",
    "P1*exp(-d*0,5)": "2 instead of 1; write decimals with a point",
    "max(0,5*P1, d)": "has '0,5' in max; write decimals with a point, such as 0.5, and a space after other commas",
    "()": "a list",
    "d < a0": "in place of a number",
    "where(d, 1, 2)": "in place of a condition",
    "d % 2": "the operators are",
    "d // 2": "the operators are",
    "-d^2": "write ** for a power",
    "F = -d": "only the right side",
    "d # half": "no comments",
    "d +": "not an expression",
    "": "is empty",
    "d\0": "not an expression",
    "(" * 300 + "d" + ")" * 300: "not an expression",
    "(" * 150 + "d" + "+1)" * 150: "nested",
    "-" * 1500 + "d": "nested",
    "+".join("d" * 900): "nested",
    "sin(" * 100 + "d" + ")" * 100: "nested",
    f"max({','.join('d' * 900)})": "more than 400",
    "d" * 1_000_000: "longer than 2000 characters",
    "d+" * 500_000: "longer than 2000 characters",
}


@every(REFUSED)
def test_what_an_expression_may_not_hold_is_one_clear_sentence(law, workdir):
    with pytest.raises(ParameterError, match=re.escape(REFUSED[law])) as caught:
        Custom(law=law)
    sentence = str(caught.value)
    assert sentence.startswith("custom.law ")
    assert "\n" not in sentence
    assert len(sentence) < 400
    assert not list(workdir.iterdir())


def test_a_law_of_many_arguments_and_levels_is_accepted_within_the_limits():
    assert value(make(f"min({','.join(['d'] * 300)})")) == 1e-9
    assert value(make("sin(" * 50 + "d" + ")" * 50)) == pytest.approx(1e-9)


ALPHABET = ["d", "a0", "P1", "t", "(", ")", "+", "-", "*", "**", "/", ",", "<", "if", "else", "and", "not"]
ALPHABET += ["exp", "where(", "min(", "1e9", "2", "0", ".", "_", "lambda", ":", "[", "]", "'", " ", "\n", "é", "for"]


@given(st.one_of(st.text(max_size=60), st.lists(st.sampled_from(ALPHABET), max_size=25).map("".join)))
def test_any_text_is_a_force_or_one_sentence(text):
    try:
        force = Custom(law=text)
    except ParameterError as error:
        assert "\n" not in str(error)
    else:
        assert force.law == text


def random_expression(rng, depth=0):
    """Return an expression; every kind of operation may take every other as its part."""

    def part():
        return random_expression(rng, depth + 1)

    if depth > 4 or rng.random() < 0.15:
        return rng.choice(["d", "velocity", "t", "indentation", "R", "a0", "P1", "P2", "2", "0", "1.5e-9", "1e9"])
    kinds = ["({} + {})", "({} - {})", "{} * {}", "{} / {}", "({})**2", "({})**-1", "({})**1.5", "({})**({})"]
    kinds += ["-({})", "exp({})", "log({})", "sqrt({})", "sin({})", "acos({})", "sinh({})", "abs({})"]
    kinds += ["min({}, {})", "max({}, {}, {})", "where({} < {}, {}, {})", "({} if {} > {} else {})"]
    kind = rng.choice(kinds)
    return kind.format(*(part() for _ in range(kind.count("{}"))))


def test_random_expressions_are_compiled_to_what_they_are_interpreted_as():
    rng = random.Random(3)  # a fixed seed: each law is compiled, which takes its time
    compared = 0
    while compared < 30:
        try:
            force = make(random_expression(rng), P1=1e-10, P2=0.0)
        except ParameterError:
            continue  # not finite for constants or anywhere
        fast = compile_function(force.law_function())
        for d in DISTANCES:
            for rate, t in ((0.0, 0.0), (-1e-3, 2e-4)):
                plain, quick = value(force, d, rate, t), fast(d, rate, t, *force.values())
                same = plain == quick or (math.isnan(plain) and math.isnan(quick))
                # whole powers are multiplied out when compiled, and differences of near numbers magnify that
                assert same or plain == pytest.approx(quick, rel=1e-6), force.law
        compared += 1


@pytest.mark.parametrize(
    ("law", "at", "expected"),
    [
        ("1/(d - d)", 1e-9, math.inf),
        ("log(-d)", 1e-9, math.nan),
        ("sqrt(-d)", 1e-9, math.nan),
        ("(-d)**0.3", 1e-9, math.nan),
        ("exp(-1/where(d > 0, 0, 1))", 1e-9, 0.0),
        ("exp(1/d)", 1e-9, math.inf),
        ("asin(1 + d)", 1.0, math.nan),
        ("sin(1/(d - d))", 1e-9, math.nan),
    ],
)
def test_what_has_no_value_is_infinite_or_not_a_number_and_never_an_exception(law, at, expected):
    force = Custom(law=law)  # unbound: nowhere finite is refused when it is bound
    fast = compile_function(force.law_function())
    for result in (value(force, at), fast(at, 0.0, 0.0)):
        assert result == expected or (math.isnan(result) and math.isnan(expected))


def test_only_what_the_law_depends_on_must_be_given():
    assert Custom(law="P1*d", P1=2.0).bind({}).values() == (2.0,)
    with pytest.raises(ParameterError, match="custom needs hamaker, which is missing"):
        make("H/d")
    with pytest.raises(ParameterError, match=r"custom needs tip\.radius, which is missing; write radius under"):
        df.Case(cantilever=df.Cantilever(f0=5e4, k=1.0, Q=100), drive=df.Drive(A0=1e-8), forces=[Custom(law="R*d")])


def test_a_law_that_is_nowhere_a_number_is_refused_with_the_parameter_that_is_zero():
    with pytest.raises(ParameterError, match="has 'P1 / P2', which is inf here"):
        make("P1/P2*d", P1=1.0)
    with pytest.raises(ParameterError, match="finite number at no distance, perhaps because of P2 = 0"):
        make("d/P2")


def test_what_depends_on_speed_takes_energy_and_what_depends_on_time_says_so():
    assert [make(law).dissipative for law in ("d", "d*velocity")] == [False, True]
    assert [make(law).timed for law in ("d", "d*sin(t)")] == [False, True]


def test_kinks_are_where_the_law_bends_and_jumps_where_it_breaks():
    assert make("P1*indentation").kinks() == (A0,)
    assert make("d*P1").kinks() == ()
    bent = make("where(d < 2*a0, 2*a0 - d, 0)")
    assert (bent.kinks(), bent.jumps()) == ((2 * A0,), ())
    broken = make("where(indentation > P1, 1e-9, 0)", P1=1e-10)
    assert broken.kinks() == (A0 - 1e-10, A0)
    assert broken.jumps() == (A0 - 1e-10,)


def test_a_case_keeps_the_law_in_its_file_and_its_values_can_be_changed():
    text = """
[cantilever]
f0 = "48.9 kHz"
k = "0.9 N/m"
Q = 30
[drive]
A0 = "10 nm"
[tip]
radius = "2 nm"
[[forces]]
model = "custom"
law = "-P1*exp(-d/P2) + P3*sqrt(R)*indentation**1.5"
P1 = 1e-9
P2 = 1e-9
"""
    read = df.Case.from_toml(text)
    assert df.Case.from_toml(read.to_toml()) == read
    assert read.replace("forces.custom.P3", 2.0).forces[0].P3 == 2.0
    assert read.set("forces.custom.law=-P1*exp(-d/P2)").forces[0].law == "-P1*exp(-d/P2)"
    with pytest.raises(ParameterError, match=r"^forces\.custom\.law has the unknown name 'x'"):
        read.set("forces.custom.law=x")


def composed(*forces):
    return compose(1, case(*forces).problem.forces, {})


def test_parameters_share_a_kernel_and_laws_do_not():
    one, same = Custom(law="P1*d", P1=1.0), Custom(law="P1 * d", P1=2.0)
    other = Custom(law="P1*d*d", P1=1.0)
    assert composed(one) == composed(same)
    assert composed(one) != composed(other)
    bound = [force.bind(INSTRUMENT) for force in (one, one.replace(P1=3.0), other)]
    signatures = [kernel.signature(force) for force in bound]
    assert signatures[0] == signatures[1] != signatures[2]


def test_no_text_of_the_user_reaches_a_kernel():
    law = "P1 * (((d)))  + 0x10*P2 - 1_000*velocity"
    text = composed(Custom(law=law, P1=1.0))
    assert "c0 * d + c1 - 1000.0 * rate" in text
    assert not any(part in text for part in ("(((", "0x10", "1_000", "P1"))


def test_several_custom_forces_add_up():
    forces = case(Custom(law="P1*d", P1=1.0), Custom(law="P1*d", P1=2.0), Custom(law="-3*d + 1e-9")).problem.forces
    assert sorted(value(force, 2e-9) for force in forces) == pytest.approx([-5e-9, 2e-9, 4e-9])


def test_a_law_of_the_deflection_is_a_spring_beside_the_cantilever():
    # driven at f0 the deflection is F0 / (dk + i k/Q): with dk = k/Q smaller by the square root of 2
    settled = df.dwell(case(Custom(law=SPRING, hamaker=0.0, P1=1.0)), zc=100e-9)
    assert float(settled.amplitude[0]) == pytest.approx(10e-9 / math.sqrt(2.0), rel=1e-5)


def test_a_run_with_a_custom_force_equals_one_with_the_built_in():
    settings = {"settle": "fixed", "periods": 60}
    forces = DMT(hamaker=2e-20), Custom(law=SPRING, hamaker=2e-20, P1=0.0)
    runs = [df.dwell(case(force, **settings), zc=8e-9) for force in forces]
    for name in ("amplitude", "phase", "peak_force"):
        # 60 periods of roundings in another order
        np.testing.assert_allclose(runs[1][name], runs[0][name], rtol=1e-9)


def test_all_names_of_a_law_are_listed_where_one_is_unknown():
    with pytest.raises(ParameterError, match=r"'v'; known: E_eff, H, P1, .*, t, velocity, z$"):
        df.forces.Custom(law="-P1*v")
