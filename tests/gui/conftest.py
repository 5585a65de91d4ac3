"""What tests of the window share."""

import functools

import pytest

from dforce.gui.curves.states import RECENT_STATES
from dforce.gui.document.compute import RECENT
from dforce.gui.files import file_menu
from dforce.gui.window import dialogs


@pytest.fixture(autouse=True)
def _no_recent_curves():
    RECENT.clear()
    RECENT_STATES.clear()


@pytest.fixture
def live_as(monkeypatch):
    """Give a function that replaces the computation of the curve that follows what is typed."""
    return functools.partial(monkeypatch.setattr, "dforce.gui.window.view.live_curve")


@pytest.fixture
def said(monkeypatch):
    """Give the list of what the window says to a person."""
    sentences = []
    monkeypatch.setattr(dialogs, "say", sentences.append)
    return sentences


@pytest.fixture
def catch(monkeypatch):
    """Give a function that returns, once there is a window, the list of what the browser is sent to save."""

    def caught():
        sent = []
        monkeypatch.setattr(
            file_menu.ui.download, "content", lambda content, name, kind="": sent.append((name, content)), raising=False
        )
        return sent

    return caught
