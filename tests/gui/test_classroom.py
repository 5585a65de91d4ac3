"""A class: guests come by a short address, and the teacher sees who is there."""

from __future__ import annotations

import asyncio
import re
import types

import pytest

import dforce as df
from dforce.gui.document.document import Document
from dforce.gui.document.session import Session
from dforce.gui.window.address import from_link
from dforce.gui.window.classroom import LETTERS, limits_in_words, new_code, people
from dforce.gui.window.security import GUEST, SHARED, Guard

SECRET, CODE = "s" * 43, "abcd2345"


def ask(path, cookie="", query=""):
    """Return what the guard sends for a request, and whether the page behind it is told of a guest."""
    sent, seen = [], []

    async def inner(scope, receive, send):
        seen.append(scope[GUEST])
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def send(message):
        sent.append(message)

    async def receive():
        return {"type": "http.request", "body": b""}

    headers = [(b"host", b"192.0.2.7:8571"), (b"cookie", cookie.encode())]
    scope = {"type": "http", "path": path, "query_string": query.encode(), "headers": headers}
    asyncio.run(Guard(inner, SECRET, "dforce-8571", code=CODE)(scope, receive, send))
    return sent[0], seen


def cookie_of(start):
    return re.match(r"[^;]+", dict(start["headers"])[b"set-cookie"].decode())[0]


def test_a_guest_comes_by_the_short_address_and_is_known_as_a_guest():
    start, _ = ask(f"/{CODE}")
    assert start["status"] == 303 and dict(start["headers"])[b"location"] == b"/"
    cookie = cookie_of(start)
    assert SECRET not in cookie
    assert ask("/", cookie)[1] == [True]


def test_a_teacher_is_no_guest_and_stays_one_after_a_look_at_the_short_address():
    cookie = cookie_of(ask("/", query=f"key={SECRET}")[0])
    assert ask("/", cookie)[1] == [False]
    assert cookie_of(ask(f"/{CODE.upper()}", cookie)[0]) == cookie


@pytest.mark.parametrize("path", ["/", "/abcd2346", "/abcd", "/class", "//"])
def test_without_the_code_nobody_comes_in(path):
    assert ask(path)[0]["status"] == 403


def test_a_code_can_be_read_from_a_wall_and_is_another_one_each_time():
    assert not set(LETTERS) & set("il1o0")
    assert len({new_code() for _ in range(100)}) == 100


def test_the_limits_are_told_as_they_are():
    assert "A run may take 5 min and have 2000 points." in limits_in_words(SHARED)


def test_the_teacher_sees_the_guests_that_are_there_and_their_cases(tmp_path):
    def session(name, person, views):
        made = Session({}, tmp_path / name)
        made.document = Document.of(df.example("figure-3-air"))
        made.person, made.views = person, views
        return made

    page = types.SimpleNamespace()
    sessions = {
        "t": session("t", None, [page]), "a": session("a", "Ada", [page]), "b": session("b", "", [page]),
        "c": session("c", "Gone", []),
    }  # fmt: skip
    found = people(sessions)
    assert [one[0] for one in found] == ["Ada", "Guest 2"]
    assert from_link(found[0][4], Document.first()).same_case(sessions["a"].document)
