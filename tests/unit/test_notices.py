"""What dForce says beside results reaches who listens, once, and never stops a run."""

import io
import sys

import pytest

from dforce.core import log, progress
from dforce.core.log import listening
from dforce.core.progress import ProgressBar


def test_a_listener_hears_the_same_sentence_once_in_a_row_and_each_new_one():
    heard = []
    with listening(heard.append):
        for text in ("compiling one", "compiling one", "compiling another", "compiling another"):
            log.announce(text)
    assert heard == ["compiling one", "compiling another"]


class FullDisk(io.StringIO):
    """A terminal whose lines go to a full disk."""

    def write(self, text):
        raise OSError(28, "No space left on device")

    def isatty(self):
        return True


def closed():
    stream = io.StringIO()
    stream.close()
    return stream


@pytest.mark.parametrize("make", [FullDisk, closed, lambda: None])
def test_a_run_goes_on_where_nothing_can_be_told(make, monkeypatch, capsys):
    monkeypatch.setattr(sys, "stderr", make())
    monkeypatch.setattr(progress, "WAIT", 0.0)
    log.announce("compiling")
    with ProgressBar("a run") as bar:
        for done in range(3):
            bar(done, 3, "")
            if bar._timer is not None:
                bar._timer.join()
    assert capsys.readouterr().out == ""
