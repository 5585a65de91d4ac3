"""What `dforce validate` says: every published value, and the quick part of the rest."""

import json
import math

import pytest
from every import every
from typer.testing import CliRunner

import dforce as df
from dforce.checks.validation import published, validation_page
from dforce.checks.validation.checks import Check, deviation, half_a_digit
from dforce.checks.validation.disagreements import Tally
from dforce.checks.validation.draws import FAMILIES, draw
from dforce.cli.app import app
from dforce.forces import REGISTRY

ENTRIES = [entry for table in published.TABLES for entry in published.entries(table)]


@pytest.mark.timeout(1800)  # some compile
@every(ENTRIES, lambda entry: f"{entry['group']}: {entry['what']}")
def test_published_value_is_met(entry):
    check = published.check(entry)
    assert check.met, f"{check.found!r} is off {check.expected!r} by {check.error:.2g}, more than {check.limit:.2g}"


def test_a_limit_wider_than_the_digits_has_its_reason():
    assert not [entry["what"] for entry in ENTRIES if "within" in entry and not entry.get("note")]


def test_a_value_is_met_to_half_a_unit_of_its_last_digit():
    assert half_a_digit("-2.50e-9") == pytest.approx(0.005 / 2.5)
    assert half_a_digit("120") == pytest.approx(0.5 / 120)

    def met(*numbers, **limits):
        error, limit = deviation(*numbers, **limits)
        return Check("", "", numbers[0], float(numbers[1]), "m", error, limit).met

    assert met(2.5049e-9, "2.50e-9")
    assert not met(2.5051e-9, "2.50e-9")
    assert not met(math.nan, "2.50e-9")
    assert met(1e-12, "0.0", within=1e-3, of=1e-9)


def test_random_cases_hold_every_shipped_force_and_come_back_by_number():
    cases = [draw(1, number) for number in range(2 * len(FAMILIES))]
    used = {force.name for case in cases for force in case.case.forces}
    assert used == {name for name, model in REGISTRY.items() if model.__module__.startswith("dforce.forces.")}
    assert draw(1, 3).case == cases[3].case
    assert draw(2, 3).case != cases[3].case


def test_a_disagreement_that_is_no_number_is_the_worst():
    tally, case = Tally(), draw(1, 0)
    for error in (1e-9, math.nan, 1e-9):
        tally.note("resolved", {"orbit": error}, case)
    (check,) = tally.checks()
    assert not check.met
    assert "1 of 3 beyond" in check.note


@pytest.fixture(scope="module")
def quick():
    """Return what the command printed, as data: run once for all tests."""
    done = CliRunner().invoke(app, ["validate", "--quick", "--json"])
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)


def test_quick_part_meets_all_of_its_checks(quick):
    assert quick["met"]
    assert quick["quick"]
    limited = [check for part in quick["parts"] for check in part["checks"] if check["limit"] is not None]
    assert len(limited) > 250
    assert all(check["error"] <= check["limit"] for check in limited)


def test_page_holds_every_check_and_the_cases_that_it_names(quick):
    page = validation_page(quick)
    for part in quick["parts"]:
        assert f"## {part['title']}" in page
        assert all(check["name"] in page for check in part["checks"])
        for name, text in part["cases"].items():
            assert name in page
            df.Case.from_toml(text)
    assert "Every check is met." in page


def test_page_says_what_is_not_met(quick):
    part = json.loads(json.dumps(quick["parts"][0]))
    part["checks"][0] |= {"met": False, "error": 0.5, "note": "it was broken"}
    page = validation_page(quick | {"parts": [part]})
    assert "## Not met" in page
    assert "it was broken" in page
    assert "**not met**" in page


def test_page_is_written_whole_and_a_miss_is_the_exit_code(tmp_path, monkeypatch, quick):
    monkeypatch.setattr("dforce.checks.validation.validate", lambda quick, progress: given)
    given = quick
    target = tmp_path / "page.md"
    assert CliRunner().invoke(app, ["validate", "-o", str(target)]).exit_code == 0
    assert target.read_text(encoding="utf-8") == validation_page(quick)
    given = quick | {"met": False}
    assert CliRunner().invoke(app, ["validate"]).exit_code == 1
    assert CliRunner().invoke(app, ["validate", "-o", "page.pdf"]).exit_code == 2
