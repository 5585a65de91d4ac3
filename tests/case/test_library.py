"""What is shipped as data: examples and media."""

import pytest

from dforce import library
from dforce.case import Case, example
from dforce.core.errors import ParameterError

NAMES = {
    "table-1-am", "table-1-bimodal", "figure-2", "figure-3-air", "figure-3-water", "figure-4-hard",
    "figure-4-soft", "figure-5", "figure-6", "figure-7-low", "figure-7-high",
}  # fmt: skip

# Tables 1, 3 and 4: f (kHz), k (N/m), Q, A0 (nm) of each mode; R (nm), E (Pa), H (J), viscosity (Pa s)
PAPER = {
    "table-1-am": ([(48.9, 0.9, 100, 5)], 2, 1e9, 0, 0),
    "table-1-bimodal": ([(48.9, 0.9, 100, 5), (282, 28, 200, 1)], 20, 1e9, 0, 0),
    "figure-2": ([(49.9, 0.9, 100, 1)], 2, 1e9, 0.8e-20, 0),
    "figure-3-air": ([(48.9, 0.9, 255, 10)], 2, 1e9, 2e-20, 0),
    "figure-3-water": ([(48.9, 0.9, 2, 10)], 2, 1e9, 0, 0),
    "figure-4-hard": ([(48.9, 10, 100, 10)], 2, 50e9, 0, 0),
    "figure-4-soft": ([(48.9, 10, 100, 10)], 2, 50e6, 0, 0),
    "figure-5": ([(49, 0.9, 50, 10)], 2, 50e6, 0, 100),
    "figure-6": ([(50, 0.9, 10, 10), (310, 35.2, 62.7, 1)], 1, 1e9, 4e-20, 0),
    "figure-7-low": ([(48.9, 0.9, 255, 17), (306.6, 35.2, 1000, 1)], 20, 1e9, 4e-20, 0),
    "figure-7-high": ([(48.9, 0.9, 255, 17), (306.6, 35.2, 1000, 1)], 20, 1e9, 9e-20, 0),
}


def test_the_cases_of_the_papers_tables_are_all_there():
    assert set(library.examples()) >= NAMES
    assert set(PAPER) == NAMES


@pytest.mark.parametrize("name", sorted(PAPER))
def test_an_example_has_the_numbers_printed_in_its_table(name):
    modes, radius, modulus, hamaker, viscosity = PAPER[name]
    case = example(name)
    problem = case.problem
    found = [(m.f0, m.k, m.Q, t.A0) for m, t in zip(problem.modes, problem.tones, strict=True)]
    assert found == [(pytest.approx(f * 1e3), k, Q, pytest.approx(A0 * 1e-9)) for f, k, Q, A0 in modes]
    assert case.tip.radius == pytest.approx(radius * 1e-9)
    assert case.sample.youngs_modulus == modulus
    models = {force.name: force for force in problem.forces}
    assert getattr(models.get("dmt"), "hamaker", 0) == hamaker
    assert getattr(models.get("kelvin_voigt"), "viscosity", 0) == viscosity


@pytest.mark.parametrize("name", sorted(library.examples()))
def test_an_example_says_where_it_is_from_what_it_shows_and_what_is_unsaid(name):
    shipped = library.examples()[name]
    for words in (shipped.title, shipped.source, shipped.shows, shipped.unsaid):
        assert len(words) > 10
    assert shipped.shows.endswith(".")
    about = example(name).about
    assert about is not None
    assert (about.source, about.shows, about.unsaid) == (shipped.source, shipped.shows, shipped.unsaid)


@pytest.mark.parametrize("name", sorted(library.examples()))
def test_an_example_survives_being_written_and_read(name):
    case = example(name)
    assert case.experiment is not None
    assert Case.from_toml(case.to_toml()) == case


def test_the_example_of_figure_3_goes_both_ways_over_221_distances():
    experiment = example("figure-3-air").experiment
    assert (experiment.direction, experiment.zc.points) == ("both", 221)
    assert (experiment.zc.start, experiment.zc.stop) == (12e-9, 1e-9)


def test_an_unknown_example_is_refused_with_the_nearest():
    with pytest.raises(ParameterError, match="no example 'figure-3-ari'; did you mean 'figure-3-air'"):
        example("figure-3-ari")
    with pytest.raises(ParameterError) as raised:
        example("x" * 100_000)
    assert len(str(raised.value)) < 400
