"""The story of a teacher: a class joins by a short address, and its cases can be looked at; what nobody in a class gets."""

from __future__ import annotations

import json
import re

import pytest
from playwright.sync_api import expect
from served import Window, served, violations

import dforce as df
from dforce.gui.document.document import FIRST

AMPLITUDE = "drive.A0"


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    with served(tmp_path_factory.mktemp("class"), "--host", "0.0.0.0") as server:
        yield server


def short_address(server):
    """Return the short address by which a class joins."""
    told = next(found for line in server.said if (found := re.search(r"A class joins at \S+/(\w+)\.", line)))
    return f"{server.home}/{told[1]}"


def joined(visit, server, name):
    """Let a student come by the short address and give a name."""
    window = visit(server, enter=lambda window: window.page.goto(short_address(server)))
    window.page.get_by_text("A run may take 5 min and have 2000 points.").wait_for()  # before anything is computed
    window.page.get_by_label("Your name").fill(name)
    window.page.get_by_role("button", name="Join").click()
    window.page.get_by_label("Your name").wait_for(state="detached")
    window.drawn()
    return window


def test_a_teacher_begins_a_class_sees_who_is_there_and_opens_the_case_of_a_student(visit, shared):
    teacher = visit(shared, enter=Window.go)
    teacher.page.get_by_role("button", name="Teach a class").click()
    teacher.page.get_by_role("button", name="Start", exact=True).click()
    invitation = teacher.page.get_by_role("dialog", name="teach a class")
    invitation.get_by_role("img", name="QR code of").wait_for()
    invitation.get_by_text("A run may take 5 min and have 2000 points.").wait_for()
    assert violations(teacher.page, "region", within=".df-dialog") == []
    with teacher.page.expect_popup() as opened:
        invitation.get_by_role("button", name="See who is there").click()
    invitation.get_by_role("button", name="Close").click()
    teacher.drawn()  # the case to talk about
    wall = opened.value
    wall.get_by_role("img", name="QR code of").wait_for()
    wall.get_by_text("Nobody is here yet").wait_for()
    assert violations(wall) == []
    ada = joined(visit, shared, "Ada")
    wall.get_by_text("1 here").wait_for()
    assert wall.get_by_role("listitem").count() == 1
    ada.type(AMPLITUDE, "17.5")
    ada.saved("17.5 nm")
    link = wall.get_by_role("link", name="open the case of Ada")
    before = link.get_attribute("href")
    ada.page.get_by_label("title of the case").fill("The answer of Ada")
    wall.get_by_text("The answer of Ada").wait_for()
    assert link.get_attribute("href") != before  # the case of this moment
    with wall.context.expect_page() as shown:
        link.click()
    case = Window(shown.value, shared)
    case.drawn()
    case.page.wait_for_function(
        "() => document.querySelector('.df-entry[data-path=\"drive.A0\"] input').value === '17.5'"
    )
    case.page.reload()
    case.drawn()
    expect(case.field(AMPLITUDE).locator("input.df-box")).to_have_value("17.5")
    expect(teacher.field(AMPLITUDE).locator("input.df-box")).to_have_value("20")  # the teacher's own case stays


@pytest.mark.long  # each page is opened several times
def test_the_story_of_a_teacher_goes_on_after_reload_and_back_and_in_a_second_tab(visit, shared):
    teacher = visit(shared, enter=Window.go)
    page = teacher.page
    # 1. the first page, reloaded, asks again; nothing was begun
    page.get_by_role("button", name="Teach a class").click()
    page.reload()
    page.get_by_role("button", name="Teach a class").click()
    page.get_by_role("button", name="Start", exact=True).click()
    page.get_by_role("dialog", name="teach a class").wait_for()
    # 2. reloaded with the invitation open: the case to talk about is there, and the address of the class in the header
    page.reload()
    teacher.drawn()
    teacher.type(AMPLITUDE, "18")
    teacher.saved("18 nm")
    with page.expect_popup() as opened:
        page.get_by_role("link", name="Class").click()
    wall = opened.value
    # 3. who is there, on two walls, while a student goes back and forth and reloads; one person, however many pages
    second = page.context.new_page()
    second.goto(wall.url)
    student = visit(shared, enter=lambda window: window.page.goto(short_address(shared)))
    student.page.reload()
    student.page.get_by_label("Your name").fill("Grace")
    student.page.get_by_role("button", name="Join").click()
    student.page.get_by_label("Your name").wait_for(state="detached")
    student.drawn()
    student.type(AMPLITUDE, "16.5")
    student.saved("16.5 nm")
    student.page.reload()
    student.drawn()
    other = Window(student.page.context.new_page(), shared)
    other.page.goto(shared.home)
    other.drawn()
    for one in (student, other):
        expect(one.field(AMPLITUDE).locator("input.df-box")).to_have_value("16.5")
        assert not one.page.get_by_label("Your name").count()
    for one in (wall, second):
        one.reload()
        expect(one.get_by_role("listitem").filter(has_text="Grace")).to_have_count(1)
    student.page.goto("about:blank")
    student.page.go_back()
    student.drawn()
    expect(student.field(AMPLITUDE).locator("input.df-box")).to_have_value("16.5")
    # 4. the case of the student, reloaded, left and come back to; the teacher's own case stays, in a second tab, too
    with wall.context.expect_page() as shown:
        wall.get_by_role("link", name="open the case of Grace").click()
    case = Window(shown.value, shared)
    case.drawn()
    case.page.reload()
    case.drawn()
    case.page.goto("about:blank")
    case.page.go_back()
    case.drawn()
    expect(case.field(AMPLITUDE).locator("input.df-box")).to_have_value("16.5")
    own = Window(page.context.new_page(), shared)
    own.page.goto(shared.home)
    own.drawn()
    page.reload()
    teacher.drawn()
    for one in (teacher, own):
        expect(one.field(AMPLITUDE).locator("input.df-box")).to_have_value("18")


def test_the_page_of_who_is_there_is_for_the_teacher_alone(visit, shared):
    student = joined(visit, shared, "Cleo")
    assert not student.page.get_by_role("link", name="Class").count()
    student.page.goto(f"{shared.home}/class")
    student.page.get_by_text("This page is for the teacher.").wait_for()
    assert not student.page.get_by_role("listitem").count()


@pytest.mark.long  # tests/gui/test_limits.py says the same of a case
def test_in_a_class_one_asks_for_no_more_than_others_can_spare(visit, shared):
    window = visit(shared)
    window.type("experiment.zc.points", "200000")
    error = window.field("experiment.zc.points").locator(".df-error")
    error.wait_for()
    assert "the limit of this server" in error.inner_text()


def test_in_a_class_a_case_reads_no_file_of_the_teacher(visit, shared, tmp_path):
    secret = tmp_path / "own.csv"
    secret.write_text("name,f0,k\nits first cell is a secret,1,1\n")
    window, said = visit(shared), []
    for name in (secret, tmp_path / "missing.csv"):
        file = tmp_path / "case.toml"
        file.write_text(f'[cantilever]\nname = "mine"\nlibrary = "{name}"\nQ = 200\n[drive]\nA0 = "10 nm"\n')
        window.page.locator(".df-upload input[type=file]").set_input_files(file)
        sentence = window.page.locator(".q-notification", has_text="file on the server")
        sentence.wait_for()
        said.append(sentence.inner_text())
        sentence.get_by_role("button", name="Close").click()
        sentence.wait_for(state="detached")
    window.shows(df.example(FIRST))
    assert said[0] == said[1]
    assert "secret" not in said[0]


def test_in_a_class_nobody_sees_what_another_typed_or_computed(visit, shared):
    one, other = visit(shared), visit(shared)
    one.type("drive.A0", "4")
    one.shows(df.example(FIRST).replace("drive.A0", "4 nm"))
    one.page.get_by_role("button", name="Keep", exact=True).click()
    one.page.locator(".df-chip").first.wait_for()
    (identifier,) = [file.stem for file in (shared.folder / "results").rglob("*.nc")]
    other.page.reload()
    other.shows(df.example(FIRST))
    assert other.page.locator(".df-chip").count() == 0
    for path in (f"/results/{identifier}.nc", f"/{identifier}.nc", f"/download/{identifier}"):
        assert other.page.request.get(shared.home + path).status == 404
    kept = [json.loads(file.read_text()) for file in (shared.folder / "sessions").glob("document-*.json")]
    assert sum(identifier in json.dumps(one) for one in kept) <= 1
