"""Files of the window: what is saved can be opened, and what is hostile or broken changes nothing."""

from __future__ import annotations

import asyncio
import errno
import functools
import io
import json
import subprocess
import sys
import threading
import time
import zipfile

import h5py
import numpy as np
import pytest
import xarray as xr
from simulated import show, window
from tiers import some_long

import dforce as df
from dforce.gui.curves.figures import Layer, picture
from dforce.gui.document.document import Document
from dforce.gui.document.session import Session
from dforce.gui.document.store import ResultStore
from dforce.gui.files import file_menu, project, uploads
from dforce.gui.window.shown import DrawnResult
from dforce.results import hdf5
from dforce.results.curves import Picture, drawable, pictures_of

CASE = df.example("figure-3-air").set("experiment.zc.points=5")


@functools.cache
def result():
    return df.run(CASE)


@functools.cache
def netcdf():
    return file_menu.written(lambda path: df.write(result(), path), ".nc")


def changed(tmp_path, change):
    """Return the bytes of a result after a change with h5py."""
    path = tmp_path / "changed.nc"
    path.write_bytes(netcdf())
    with h5py.File(path, "r+") as file:
        change(file, tmp_path)
    return path.read_bytes()


def test_a_result_comes_back_as_it_was(tmp_path):
    again = uploads.result_from(netcdf(), tmp_path)
    xr.testing.assert_identical(again, df.read(_file(tmp_path, netcdf())))
    assert not list(tmp_path.glob("upload-*"))


def _file(tmp_path, data):
    path = tmp_path / "x.nc"
    path.write_bytes(data)
    return path


def link_outside(file, tmp_path):
    file["secret"] = h5py.ExternalLink("/etc/passwd", "/x")


def soft_link(file, tmp_path):
    file["secret"] = h5py.SoftLink("/amplitude")


def data_outside(file, tmp_path):
    (tmp_path / "secret").write_bytes(b"12345678" * 8)
    file.create_dataset("secret", shape=(8,), dtype="f8", external=[(str(tmp_path / "secret"), 0, 64)])


def virtual(file, tmp_path):
    layout = h5py.VirtualLayout(shape=(5,), dtype="f8")
    layout[:] = h5py.VirtualSource(str(tmp_path / "other.h5"), "x", shape=(5,))
    file.create_virtual_dataset("secret", layout)


def endless(file, tmp_path):
    file.create_dataset("much", shape=(10**12,), dtype="f8", chunks=(1000,), fillvalue=0.0, compression="gzip")


def group(file, tmp_path):
    file.create_group("more")


def own_code(file, tmp_path):
    file.attrs["case"] = f'plugins = ["evil.py"]\n{CASE.to_toml()}'


def other_case(file, tmp_path):
    file.attrs["case"] = "[cantilever]"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (link_outside, "points to other files"), (soft_link, "points to other"), (data_outside, "data from other files"),
        (virtual, "data from other files"), (endless, "unpacks to more than"), (group, "groups"), (own_code, "not run here"),
        (other_case, "case of this result"),
    ],
)  # fmt: skip
def test_a_hostile_result_is_refused_in_a_sentence(tmp_path, change, words):
    with pytest.raises(df.ResultError, match=words) as refused:
        uploads.result_from(changed(tmp_path, change), tmp_path)
    assert str(tmp_path) not in str(refused.value)


def attribute(key, value, variable=None):
    """Return a change that gives a result, or one of its variables, another attribute."""
    return lambda file, tmp_path: (file if variable is None else file[variable]).attrs.__setitem__(key, value)


def without(name):
    return lambda file, tmp_path: file.__delitem__(name)


STRANGE = {
    "unknown unit": attribute("units", "zorkmid", "amplitude"), "unit of no letters": attribute("units", "\x01", "amplitude"),
    "unit as number": attribute("units", 3, "amplitude"), "units in a list": attribute("units", np.arange(3), "phase"),
    "unit of an axis": attribute("units", "days since 0", "zc"), "along nothing": attribute("along", "nothing"),
    "along a number": attribute("along", 3), "along itself": attribute("along", "phase"), "no amplitude": without("amplitude"),
    "no phase": without("phase"), "no axis": without("zc"), "title of no text": attribute("title", b"\xff\xfe"),
    "label of no text": attribute("long_name", b"\xff\xfe", "phase"), "scale": attribute("scale_factor", "x", "phase"),
    "endless symbol": attribute("symbol", r"\frac{" * 500, "phase"), "flags": attribute("flag_meanings", "one", "status"),
    "a long name": lambda file, tmp_path: file.create_dataset("n" * 500, data=np.zeros(5)),
    "a map without states": lambda file, tmp_path: file.create_dataset("reached", data=np.zeros((5, 5))),
    "many quantities": lambda file, tmp_path: [file.create_dataset(f"x{n}", data=np.zeros(5)) for n in range(200)],
    "booleans": attribute("boolean_attributes", "nothing"),
}  # fmt: skip


# one of each kind is quick: a unit, an axis, a variable that is missing, a text, a flag, names, a dimension, a number too many
QUICK = {
    "unknown unit", "along itself", "no phase", "title of no text", "flags", "a long name", "a map without states",
    "many quantities",
}  # fmt: skip


@pytest.mark.parametrize("name", some_long(STRANGE, {*STRANGE} - QUICK))
@pytest.mark.slow
def test_a_strange_result_is_refused_or_can_be_drawn_and_written_again(tmp_path, name):
    data = changed(tmp_path, STRANGE[name])
    try:
        again = uploads.result_from(data, tmp_path / "folder")
    except df.DForceError as refused:
        assert "\n" not in str(refused)
        assert str(tmp_path) not in str(refused)
        return
    df.write(again, tmp_path / "again.nc")
    df.write(again, tmp_path / "again.csv")
    for quantity in drawable(again):
        picture([Layer(again)], Picture(quantity, (quantity,)))
    for usual in pictures_of(again):
        picture([Layer(again)], usual)


@pytest.mark.parametrize("name", ["unknown unit", "flags", "title of no text", "along nothing"])
def test_a_result_that_cannot_be_shown_or_kept_changes_nothing(tmp_path, name):
    async def flow():
        async with window(tmp_path / "one", live=False) as (_, page):
            session = page.view.session
            before = session.document
            with pytest.raises(df.ResultError, match="cannot be used here"):
                await page.files.open(changed(tmp_path, STRANGE[name]))
            assert (session.document, session.results.names(), session.steps) == (before, [], [])

    asyncio.run(flow())


def full(*_, **__):
    raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("slow", ["the disk", "what is read"])
def test_of_two_files_opened_at_once_the_last_one_stays_open(tmp_path, monkeypatch, slow):
    def slow_at_first(quick):
        def read(given):
            time.sleep(0.2 if "slow" in str(given)[:20] else 0.0)
            return quick(given)

        return read

    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            owner, name = (page.files.last, "take") if slow == "the disk" else (uploads, "document_from")
            monkeypatch.setattr(owner, name, slow_at_first(getattr(owner, name)))
            for name in ("slow", "quick"):
                page.files.last.keep(CASE.replace("title", name).to_toml().encode(), f"{name}.toml")
            await asyncio.gather(page.files.open_last("slow.toml"), page.files.open_last("quick.toml"))
            assert page.view.document.title == "quick"

    asyncio.run(flow())


def test_a_full_disk_at_an_upload_is_said_and_changes_nothing(tmp_path, said, monkeypatch):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            session, before = page.view.session, page.view.document
            for place, name in (
                (uploads.Path, "write_bytes"),
                (uploads.tempfile, "TemporaryDirectory"),
                (uploads.Path, "mkdir"),
            ):
                with monkeypatch.context() as disk:
                    disk.setattr(place, name, full)
                    with page.files._telling("the file could not be opened"):
                        await page.files.open(netcdf())
                assert said.pop().endswith("no space left on device.")
                assert (session.document, session.results.names(), session.steps) == (before, [], [])

    asyncio.run(flow())


@pytest.fixture
def unwritable(monkeypatch):
    """Give a function after which the disk is full for results of the window."""
    plain = df.write

    def write(result, path, **_):
        if path.parent.name == "store":
            raise df.ResultError(f"'{path}' could not be written: no space left on device") from OSError(
                errno.ENOSPC, "No space left"
            )
        return plain(result, path)

    return functools.partial(monkeypatch.setattr, df, "write", write)


def test_a_result_that_finds_no_place_is_not_shown_in_place_of_the_case(tmp_path, unwritable):
    async def flow():
        async with window(tmp_path / "store", live=False) as (_, page):
            session, before = page.view.session, page.view.document
            unwritable()
            with pytest.raises(df.ResultError, match="no space left"):
                await page.files.open(netcdf())
            assert (session.document, session.results.names(), session.steps) == (before, [], [])

    asyncio.run(flow())


def test_the_result_of_a_run_that_finds_no_place_is_shown_and_that_is_said(tmp_path, said, unwritable):
    async def flow():
        async with window(tmp_path / "store", live=False) as (user, page):
            shown = []
            page.view.show_result = shown.append
            unwritable()
            page.view.edit(Document.of(CASE), anew=True)
            await page.view.run()
            assert shown == [page.view.session.job.result]
            await user.should_see("this result could not be kept: no space left")
            page.view.curve = DrawnResult(page.view.document, shown[0])
            await page.plots.kept._keep()
            assert said == ["No space left."]

    asyncio.run(flow())


@pytest.mark.parametrize(
    "broken",
    [lambda: b"\x89HDF\r\n\x1a\n", lambda: netcdf()[: len(netcdf()) // 2], lambda: hdf5.START + bytes(range(256)) * 40],
    ids=["signature", "half", "noise"],
)
def test_a_broken_result_is_refused_in_a_sentence(tmp_path, broken):
    with pytest.raises(df.ResultError, match="damaged or was cut short"):
        uploads.result_from(broken(), tmp_path)


def test_no_python_file_that_a_case_names_is_run(tmp_path):
    with pytest.raises(df.ParameterError, match="not run here"):
        uploads.document_from(f'plugins = ["evil.py"]\n{CASE.to_toml()}'.encode())


@pytest.mark.parametrize("data", [b"", b"\xff\xfe\x00", b"[cantilever", b"x = 1", b"<html><script>alert(1)</script>"])
def test_what_is_no_case_is_refused_in_a_sentence(data):
    with pytest.raises(df.DForceError):
        uploads.document_from(data)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Give the file of a project with one result, and its document."""
    folder = tmp_path_factory.mktemp("project")

    async def make():
        session = Session({}, folder)
        session.document = Document.of(CASE).put(("drive", "A0"), "5 n")  # typed halfway
        await session.keep(result())
        session.look(Document.from_plain(session.document.to_plain() | {"plots": [
            {"x": "zc", "y": ["phase"], "together": False, "logarithmic": False}]}))  # fmt: skip
        return project.packed(session.document, session.results, session.measured.results), session.document

    return asyncio.run(make())


@pytest.mark.slow
def test_a_project_comes_back_with_all_that_was_typed_and_its_results(tmp_path, made):
    data, document = made

    async def flow():
        async with window(tmp_path / "two", live=False) as (_, page):
            session = page.view.session
            await session.keep(result())
            await page.files.open(data)
            first, second = session.document.results
            assert (first.shown, second.shown) == (False, True)
            assert second.name == document.results[0].name
            assert session.document.table == document.table
            assert session.document.plots == document.plots
            xr.testing.assert_equal(session.results.take(second.id), result())
            session.undo()
            assert len(session.document.results) == 2

    asyncio.run(flow())


def test_results_that_end_together_are_all_in_the_list_in_their_order(tmp_path, monkeypatch):
    first, second = (result().assign_attrs(title=title) for title in ("first", "second"))
    written, keep = threading.Event(), ResultStore.keep

    def keep_slowly(store, given):
        if given is first:
            written.wait(1.0)  # for the second, had it not to wait for its turn
        name = keep(store, given)
        if given is second:
            written.set()
        return name

    monkeypatch.setattr(ResultStore, "keep", keep_slowly)

    async def flow():
        session = Session({}, tmp_path)
        await asyncio.gather(session.keep(first), session.keep(second))
        titles = [session.results.take(kept.id).attrs["title"] for kept in session.document.results]
        assert titles == ["first", "second"]
        assert len({kept.color for kept in session.document.results}) == 2

    asyncio.run(flow())


def repacked(data, **changes):
    """Return a project with other entries, None for one that is missing."""
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            kind = "document" if name == project.DOCUMENT else "result"
            entry = changes.get(kind, lambda content: content)(old.read(name))
            if entry is not None:
                new.writestr(name, entry)
    return stream.getvalue()


def with_document(change):
    def changed_(content):
        plain = json.loads(content)
        change(plain["document"])
        return json.dumps(plain)

    return {"document": changed_}


HOSTILE = {
    "no document": {"document": lambda content: None},
    "no result": {"result": lambda content: None},
    "half a result": {"result": lambda content: content[: len(content) // 2]},
    "no json": {"document": lambda content: b"{"},
    "deep json": {"document": lambda content: b"[" * 100_000},
    "another version": {"document": lambda content: content.replace(b'"format": 1', b'"format": 99')},
    "too much": {"result": lambda content: bytes(uploads.MOST_BYTES + 1)},
    "a path": with_document(lambda plain: plain["results"][0].update(id="../../secret")),
    "no list": with_document(lambda plain: plain.update(results=3)),
    "no table": with_document(lambda plain: plain.update(table=[])),
    "plugins": with_document(lambda plain: plain["table"].update(plugins=["evil.py"])),
    "no plugins": with_document(lambda plain: plain["table"].update(plugins=[])),
    "a color of no theme": with_document(lambda plain: plain["results"][0].update(color=10**30)),
    "an endless number": {"document": lambda content: content.replace(b'"set_point": 0.8', b'"set_point": 1e400')},
    "a number of thousands of digits": {"document": lambda content: content.replace(b"0.8", b"9" * 5000)},
    "a result of other make": {"result": lambda content: content.replace(b"degree", b"dogree")},
    "a slider without end": with_document(
        lambda plain: plain.update(sliders=[{"path": ["drive", "A0"], "low": 0.0, "high": float("inf")}])
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_broken_project_is_refused_in_a_sentence(tmp_path, made, name):
    with pytest.raises(df.DForceError) as refused:
        project.unpacked(repacked(made[0], **HOSTILE[name]), tmp_path)
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_a_project_whose_forms_cannot_be_made_changes_nothing(tmp_path, made):
    broken = with_document(lambda plain: plain["table"].update(cantilever={"modes": 3}))

    async def flow():
        async with window(tmp_path / "two", live=False) as (_, page):
            session = page.view.session
            await session.keep(result())
            before, store = session.document, session.results.names()
            with pytest.raises(df.CaseError, match="cannot be shown"):
                await page.files.open(repacked(made[0], **broken))
            assert (session.document, session.results.names(), session.steps) == (before, store, [])

    asyncio.run(flow())


@pytest.mark.slow
def test_no_picture_that_a_project_asks_for_fails_on_its_results(tmp_path, made):
    names = drawable(result())
    plots = [{"x": x, "y": names, "together": way, "logarithmic": way} for x in names[:5] for way in (False, True)]

    async def flow():
        async with window(tmp_path / "two", live=False) as (_, page):
            await page.files.open(repacked(made[0], **with_document(lambda plain: plain.update(plots=plots))))
            await page.plots._redraw()
            assert page.plots.drawn.traces

    asyncio.run(flow())


def test_a_zip_that_is_cut_short_is_refused(tmp_path, made):
    with pytest.raises(df.ResultError, match="damaged"):
        project.unpacked(made[0][:-30], tmp_path)


@pytest.mark.slow
def test_a_result_that_is_opened_is_kept_and_its_case_shown(tmp_path):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            await page.files.open(netcdf())
            (kept,) = page.view.document.results
            assert page.view.document.case() == CASE.from_toml(result().attrs["case"])
            assert page.view.session.kept_as(page.view.session.results_of[kept.id]) == kept

    asyncio.run(flow())


def test_a_result_that_is_kept_is_the_curve_of_its_case_in_the_next_page(tmp_path):
    async def flow():
        session = Session({}, tmp_path)
        await session.keep(result())
        case = df.Case.from_toml(result().attrs["case"])
        assert session.kept_as(session.kept_of(case)) == session.document.results[0]
        assert session.kept_of(case.replace("drive.A0", "9 nm")) is None

    asyncio.run(flow())


@pytest.mark.parametrize(("ending", "start"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")])
def test_a_figure_of_what_is_drawn_is_saved_in_each_format(ending, start):
    layers = [Layer(result(), "<b>$one", 1), Layer(result(), "two", 2)]
    assert file_menu.figure_file(layers, Picture("zc", ("phase",)), ending, "85 mm").startswith(start)


def test_a_figure_that_cannot_be_drawn_says_so_in_a_sentence():
    strange = result().copy()
    strange["phase"].attrs["symbol"] = r"\nosuch{"
    with pytest.raises(df.ResultError, match="cannot be drawn"):
        file_menu.figure_file([Layer(strange)], Picture("zc", ("phase",)), ".png", "85 mm")


@pytest.mark.parametrize(
    ("title", "name"),
    [
        ("Figure 3, in air", "figure-3-in-air"),
        ("../../etc/passwd", "etc-passwd"),
        ("<script>", "script"),
        ("Übung: Äpfel, 40 N/m", "ubung-apfel-40-n-m"),
        ("", "dforce"),
        ("Aux", "dforce-aux"),  # a device of Windows
        ("LPT 1", "lpt-1"),
        ("com1", "dforce-com1"),
    ],
)
def test_the_name_of_a_file_holds_letters_and_digits_only(title, name):
    assert file_menu.stem(title) == name


def test_the_script_that_is_saved_is_that_of_the_case(tmp_path, catch):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            saved = catch()
            page.view.edit(Document.of(CASE), anew=True)
            await page.files.save_script()
            await page.files.save_case()
            names: dict[str, object] = {}
            exec(saved[0][1].partition("result =")[0], names)
            assert saved[0][0] == "figure-3-of-the-2015-paper-in-air.py"
            assert names["case"] == CASE == df.Case.from_toml(saved[1][1])

    asyncio.run(flow())


def test_a_table_that_is_saved_holds_the_numbers(tmp_path, catch):
    async def flow():
        async with window(tmp_path, live=False) as (_, page):
            saved = catch()
            show(page, result())
            await page.files.save_result("", ".csv")
            header, *rows = [line for line in saved[0][1].decode().splitlines() if not line.startswith("#")]
            place = header.split(",").index("amplitude_tone1 (m)")
            np.testing.assert_array_equal(
                [float(row.split(",")[place]) for row in rows], result()["amplitude"].isel(tone=0).values.T.ravel()
            )

    asyncio.run(flow())


def test_a_file_is_looked_through_by_the_libraries_that_the_server_has(tmp_path, monkeypatch):
    (tmp_path / "h5py.py").write_text(
        "import sys, pickle; sys.stdout.buffer.write(pickle.dumps(('a library of a user', []))); raise SystemExit"
    )
    with monkeypatch.context() as patch:
        patch.chdir(tmp_path)  # files that lie there are none of them
        with pytest.raises(df.ResultError, match="damaged"):
            hdf5.look(hdf5.START, "result")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(df.ResultError, match="a library of a user"):
        hdf5.look(hdf5.START, "result")


@pytest.mark.parametrize(("name", "value"), [("frozen", True), ("executable", "")])
def test_a_file_is_not_called_damaged_where_no_process_can_be_started(name, value, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, name, value, raising=False)
    with pytest.raises(df.ResultError, match="the process that checks it could not start"):
        hdf5.look(hdf5.START, "result")


def test_a_system_without_room_for_processes_is_told_of_as_such(tmp_path, monkeypatch):
    def none_left(*command, **how):
        raise BlockingIOError("no more processes")

    monkeypatch.setattr(subprocess, "run", none_left)
    with pytest.raises(df.ResultError, match="the process that checks it could not start"):
        hdf5.look(hdf5.START, "result")
