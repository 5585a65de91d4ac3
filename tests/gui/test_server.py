"""How the window is started."""

from __future__ import annotations

import importlib.util
import socket

import pytest

import dforce as df
from dforce.gui import server


def test_a_port_that_is_taken_is_said():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(df.ParameterError, match=f"cannot listen at 127.0.0.1, port {port}"):
            server.free_port("127.0.0.1", port)


def test_another_port_is_found_where_the_usual_one_is_taken(monkeypatch):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        monkeypatch.setattr(server, "PORT", taken.getsockname()[1])
        assert server.free_port("127.0.0.1") not in (0, server.PORT)


def test_an_address_of_another_computer_is_refused():
    with pytest.raises(df.ParameterError, match=r"cannot listen at 192\.0\.2\.1"):
        server.free_port("192.0.2.1")


def test_an_application_window_is_a_browser_without_bars(monkeypatch, tmp_path):
    started = []
    monkeypatch.setattr(server.shutil, "which", lambda name: f"/usr/bin/{name}" if name == "chromium" else None)
    monkeypatch.setattr(server.subprocess, "Popen", lambda command, **streams: started.append(command))
    assert server.open_window("http://127.0.0.1:8571/?key=x", tmp_path)
    assert started[0][:2] == ["/usr/bin/chromium", "--app=http://127.0.0.1:8571/?key=x"]


def test_without_such_a_browser_the_window_says_so(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(server.shutil, "which", lambda name: None)
    monkeypatch.setattr(server, "PLACES", ())
    assert not server.open_window("http://127.0.0.1:8571/?key=x", tmp_path)
    assert "opens in the browser" in capsys.readouterr().err


def test_without_its_packages_the_command_says_what_to_install(monkeypatch):
    from dforce.cli.gui import gui

    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(df.ParameterError, match=r'pip install "dforce\[gui\]"'):
        gui()
