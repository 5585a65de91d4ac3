"""How the window is started."""

from __future__ import annotations

import contextlib
import importlib.util
import ipaddress
import os
import socket
import urllib.parse
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from served import Server, served

import dforce as df
from dforce.gui.files.uploads import LAST, LastFiles
from dforce.gui.window import server


def test_a_port_that_is_taken_is_said():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(df.ParameterError, match=f"cannot listen at 127.0.0.1, port {port}"):
            server.listening("127.0.0.1", port)


@pytest.fixture
def unknown(monkeypatch):
    """Let this computer have a name that nobody else knows."""
    monkeypatch.setattr(server.socket, "gethostname", lambda: "only-known-here")


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_a_class_is_told_a_number_and_not_a_name_that_its_network_may_not_know(host, unknown):
    named = server._named(host)
    if named.strip("[]") == "only-known-here":
        pytest.skip("this computer is on no network of this kind")
    assert ipaddress.ip_address(named.strip("[]"))
    assert named.startswith("[") == (host == "::")


def test_a_computer_on_no_network_tells_its_name(unknown, monkeypatch):
    class Nowhere(socket.socket):
        def connect(self, address):
            raise OSError("Network is unreachable")

    monkeypatch.setattr(server.socket, "socket", Nowhere)
    assert server._named("0.0.0.0") == "only-known-here"


def test_another_port_is_found_where_the_usual_one_is_taken(monkeypatch):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        monkeypatch.setattr(server, "PORT", taken.getsockname()[1])
        with server.listening("127.0.0.1") as found:
            assert found.getsockname()[1] not in (0, server.PORT)


def opened(server):
    """Open the address that a server printed, and return the answer."""
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    return opener.open(f"{server.home}/?{urllib.parse.urlsplit(server.address).query}", timeout=60)


def test_two_that_start_at_once_each_answer_at_the_address_that_they_print(tmp_path):
    with ThreadPoolExecutor() as pool, contextlib.ExitStack() as running:
        both = list(pool.map(lambda name: Server(tmp_path / name, port=0), "ab"))
        for one in both:
            running.callback(one.stop)
        assert [opened(one).status for one in both] == [200, 200]


def test_an_address_of_another_computer_is_refused():
    with pytest.raises(df.ParameterError, match=r"cannot listen at 192\.0\.2\.1"):
        server.listening("192.0.2.1")


@pytest.mark.parametrize(
    ("port", "host"), [(8571, "localhost:8571"), (80, "localhost"), (80, "127.0.0.1"), (80, "[::1]:80")]
)
def test_a_browser_finds_the_page_at_every_port(port, host):
    assert host in server.own_hosts(port)
    assert "localhost" not in server.own_hosts(8571)


def test_an_application_window_is_a_browser_without_bars(monkeypatch, tmp_path):
    started = []
    monkeypatch.setattr(server.shutil, "which", lambda name: f"/usr/bin/{name}" if name == "chromium" else None)

    class Running:
        def __init__(self, command, **streams):
            started.append(command)

        def wait(self, timeout):
            raise server.subprocess.TimeoutExpired(started[0], timeout)

    monkeypatch.setattr(server.subprocess, "Popen", Running)
    assert server.open_window("http://127.0.0.1:8571/?key=x", tmp_path)
    assert started[0][:2] == ["/usr/bin/chromium", "--app=http://127.0.0.1:8571/?key=x"]


@pytest.mark.skipif(os.name != "posix", reason="a program of one line is a shell script")
@pytest.mark.parametrize(("code", "opened"), [(1, False), (0, True)])
def test_a_browser_that_cannot_start_is_said_and_one_that_hands_over_is_not(
    monkeypatch, tmp_path, capsys, code, opened
):
    program = tmp_path / "chromium"
    program.write_text(f"#!/bin/sh\nexit {code}\n")
    program.chmod(0o755)
    monkeypatch.setattr(server, "find_browser", lambda: str(program))
    assert server.open_window("http://127.0.0.1:8571/?key=x", tmp_path) is opened
    assert ("could not be started" in capsys.readouterr().err) is not opened


def test_a_browser_that_one_person_installed_is_found(monkeypatch, tmp_path):
    monkeypatch.setattr(server.shutil, "which", lambda name: None)
    monkeypatch.setenv("HOME" if os.name == "posix" else "USERPROFILE", str(tmp_path))
    own = [place for place in server.PLACES if place.startswith("~")]
    program = Path(own[0]).expanduser()
    program.parent.mkdir(parents=True)
    program.touch()
    monkeypatch.setattr(server, "PLACES", own)
    assert server.find_browser() == str(program)


def test_without_such_a_browser_the_window_says_so(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(server.shutil, "which", lambda name: None)
    monkeypatch.setattr(server, "PLACES", ())
    assert not server.open_window("http://127.0.0.1:8571/?key=x", tmp_path)
    assert "opens in the browser" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("lacking", "words"),
    [
        ({"nicegui", "plotly"}, "nicegui and plotly, but they are not installed"),
        ({"plotly"}, "plotly, but it is not installed"),
    ],
)
def test_without_its_packages_the_command_says_what_to_install(monkeypatch, lacking, words):
    from dforce.cli.gui import gui

    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name in lacking else name)
    with pytest.raises(df.ParameterError, match=rf'the window needs {words}; run: pip install "dforce\[gui\]"'):
        gui()


def test_a_file_named_at_the_start_is_among_the_last_files(tmp_path):
    file = tmp_path / "my lever.toml"
    df.save_case(df.example("figure-3-air"), file)
    with served(tmp_path / "window", str(file)) as server:
        assert opened(server).status == 200
        (folder,) = (tmp_path / "window" / "results").glob(f"*/{LAST}")
        assert [one.name for one in LastFiles(folder).listed()] == ["my lever.toml"]
        assert LastFiles(folder).take("my lever.toml") == file.read_bytes()
