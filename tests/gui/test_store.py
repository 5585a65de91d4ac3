"""What is typed is kept: whole or as it was, and where it cannot be kept, that is said."""

from __future__ import annotations

import asyncio
import contextlib
import dataclasses
import json
import sys

import pytest
from simulated import until, window

import dforce as df
from dforce.gui.document import store as stores
from dforce.gui.document.document import Document
from dforce.gui.document.session import UNREAD, Session
from dforce.gui.document.store import ASIDE, KEY, Saving, Store
from dforce.gui.files.uploads import LastFiles

FIRST = Document.first()


@contextlib.contextmanager
def full_disk():
    """Let no file become longer than what a full disk would take of it."""
    resource = pytest.importorskip("resource", reason="Windows has no such limit")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_what_is_kept_is_there_after_a_restart_and_nobody_else_may_read_it(tmp_path):
    file = tmp_path / "sessions" / "one.json"
    Store(file)[KEY] = FIRST.to_plain()
    assert Document.from_plain(Store(file)[KEY]) == FIRST
    if sys.platform != "win32":
        assert file.stat().st_mode & 0o077 == 0


def test_a_last_file_that_finds_no_room_leaves_the_earlier_one_whole(tmp_path):
    files = LastFiles(tmp_path)
    files.keep(b"whole", "curve.csv")
    with full_disk(), pytest.raises(df.ResultError, match="cannot be listed for the next time: file too large"):
        files.keep(bytes(1000), "curve.csv")
    assert files.take("curve.csv") == b"whole"


def test_a_last_file_of_any_name_has_a_path_that_windows_takes(tmp_path):
    files = LastFiles(tmp_path)
    files.keep(b"whole", f"{'Spannung über Höhe, ' * 20}.csv")
    (kept,) = tmp_path.iterdir()
    folder = rf"C:\Users\{'n' * 20}\AppData\Local\dforce\window\results\{'i' * 36}\last"
    assert len(f"{folder}/{kept.name}") < 260
    assert files.listed()[0].name.endswith("über Höhe, .csv")


@pytest.mark.parametrize(
    "text", [b"", b"{", b"[]", b"3", b"\xff\xfe", b"[" * 100_000, b'{"a": ' + b"9" * 5000 + b"}", b"\0" * 9]
)
def test_a_file_that_cannot_be_read_is_put_aside(tmp_path, text):
    file = tmp_path / "one.json"
    file.write_bytes(text)
    store = Store(file)
    assert store == {}
    store[KEY] = 1
    assert json.loads(file.read_text()) == {KEY: 1}
    assert file.with_suffix(ASIDE).read_bytes() == text


def test_a_document_that_cannot_be_read_is_not_written_over(tmp_path):
    store = {KEY: FIRST.to_plain() | {"set_point": "typed"}}
    session = Session(store, tmp_path)
    assert session.document == FIRST
    session.saving.write()
    assert store[UNREAD]["set_point"] == "typed"
    assert store[KEY]["set_point"] == FIRST.set_point


def test_a_full_disk_leaves_what_was_kept_before(tmp_path):
    file = tmp_path / "one.json"
    store = Store(file)
    store[KEY] = "before"
    with full_disk(), pytest.raises(df.ResultError, match=r"large|space") as full:
        store[KEY] = "x" * 1000
    assert str(tmp_path) not in str(full.value)
    assert Store(file)[KEY] == "before"
    assert [path.name for path in tmp_path.iterdir()] == ["one.json"]


@pytest.mark.parametrize("value", [10**30, float("nan"), {"a": [1e308, -(2**70)]}, "\ud800"])
def test_no_value_keeps_others_from_being_kept(tmp_path, value):
    store = Store(tmp_path / "one.json")
    store["odd"] = value
    store[KEY] = "typed"
    assert Store(tmp_path / "one.json")[KEY] == "typed"


def test_a_person_is_told_that_what_is_typed_is_not_kept_and_when_it_is_again(tmp_path, monkeypatch):
    monkeypatch.setattr(stores, "SAVED_AFTER", 0.05)
    monkeypatch.setattr(stores, "TRIED_AGAIN", 0.05)
    file = tmp_path / "one.json"

    async def flow():
        async with window(tmp_path, Session(Store(file), tmp_path), live=False) as (user, page):
            view = page.view
            with full_disk():
                view.edit(view.document.put(("drive", "A0"), "5 nm"))
                await until(lambda: view.session.saving.unkept)
                await user.should_see("Your input is not kept")
            await until(lambda: not view.session.saving.unkept)
            await user.should_not_see("Your input is not kept")
            assert Document.from_plain(Store(file)[KEY]).value(("drive", "A0")) == "5 nm"

    asyncio.run(flow())


def test_what_was_typed_last_is_kept_when_the_server_ends(tmp_path):
    file = tmp_path / "one.json"

    async def flow():
        async with window(tmp_path, Session(Store(file), tmp_path), live=False) as (_, page):
            page.view.edit(page.view.document.put(("drive", "A0"), "7 nm"))

    asyncio.run(flow())
    assert Document.from_plain(Store(file)[KEY]).value(("drive", "A0")) == "7 nm"


def test_a_document_that_could_not_be_read_again_is_not_written(tmp_path):
    store, wrong = {KEY: FIRST.to_plain()}, dataclasses.replace(FIRST, set_point=7.0)
    with pytest.raises(df.CaseError):
        Saving(store, lambda: wrong, lambda: None).write()
    assert Document.from_plain(store[KEY]) == FIRST
