"""What tests of the window share."""

import functools

import pytest

from dforce.gui import error_messages, files


@pytest.fixture
def live_as(monkeypatch):
    """Give a function that replaces the computation of the curve that follows what is typed."""
    return functools.partial(monkeypatch.setattr, "dforce.gui.view.live_curve")


@pytest.fixture
def said(monkeypatch):
    """Give the list of what the window says to a person."""
    sentences = []
    monkeypatch.setattr(error_messages, "say", sentences.append)
    return sentences


@pytest.fixture
def catch(monkeypatch):
    """Give a function that returns, once there is a window, the list of what the browser is sent to save."""

    def caught():
        sent = []
        monkeypatch.setattr(
            files.ui.download, "content", lambda content, name, kind="": sent.append((name, content)), raising=False
        )
        return sent

    return caught
