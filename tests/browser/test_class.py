"""The story of a teacher: a class joins by a short address, and its cases can be looked at."""

from __future__ import annotations

import re

import pytest
from served import Window, served, violations

AMPLITUDE = "drive.A0"


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    with served(tmp_path_factory.mktemp("class"), "--host", "0.0.0.0") as server:
        yield server


def joined(visit, server, name):
    """Let a student come by the short address and give a name."""
    told = next(found for line in server.said if (found := re.search(r"A class joins at \S+/(\w+)\.", line)))
    window = visit(server, enter=lambda window: window.page.goto(f"{server.home}/{told[1]}"))
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
    joined(visit, shared, "Ben")
    wall.get_by_text("2 here").wait_for()
    assert wall.get_by_role("listitem").count() == 2
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


def test_the_page_of_who_is_there_is_for_the_teacher_alone(visit, shared):
    student = joined(visit, shared, "Cleo")
    assert not student.page.get_by_role("link", name="Class").count()
    student.page.goto(f"{shared.home}/class")
    student.page.get_by_text("This page is for the teacher.").wait_for()
    assert not student.page.get_by_role("listitem").count()
