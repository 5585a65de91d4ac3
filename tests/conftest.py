"""Settings that every test shares."""

import functools
import math
import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings

# The readline of a parent sets these for its children: what a command prints would be wrapped at 80 columns.
for name in ("COLUMNS", "LINES"):
    os.environ.pop(name, None)

# Before anything imports numpy: a process a core runs tests, and threads of OpenBLAS would take the core of another to wait.
os.environ["OPENBLAS_NUM_THREADS"] = "1"

# pytest.approx allows an absolute error of 1e-12 besides the relative one: forces and energies in SI are smaller than that.
type(pytest.approx(0.0)).DEFAULT_ABSOLUTE_TOLERANCE = 0.0

# Before anything imports matplotlib: no test needs a screen.
os.environ["MPLBACKEND"] = "Agg"

# No deadline: the first example of a case compiles its kernel.
settings.register_profile("here", deadline=None)
# In CI the same examples every time, so that a red run is a change's own fault.
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")


# Folders whose files take longest come first: no worker waits at the end for a long file of the other.
FIRST = ("physics", "inverse", "kernel", "sweeps", "browser")


def pytest_collection_modifyitems(items):
    """Put tests in the order in which several processes take their files."""
    folders = Path(__file__).parent
    place = {folder: number for number, folder in enumerate(FIRST)}
    items.sort(key=lambda item: place.get(item.path.relative_to(folders).parts[0], len(FIRST)))


def pytest_addoption(parser):
    parser.addoption(
        "--ulps", type=int, default=0, help="put each number of the levers so many units in the last place off"
    )


def pytest_configure(config):
    """Let every step round otherwise, so that a test which hangs on last bits fails."""
    if ulps := config.getoption("ulps"):
        import last_bits

        patch = pytest.MonkeyPatch()
        last_bits.put_levers_off(patch, ulps)  # before test modules make their cases
        config.add_cleanup(patch.undo)


@pytest.fixture(autouse=True)
def no_figure_is_left_open():
    """Close what a test has drawn on pyplot's figures, which stay open by themselves."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


@pytest.fixture
def run_as(monkeypatch):
    """Give a function that replaces `df.run`, for the command line and the window."""
    return functools.partial(monkeypatch.setattr, "dforce.run")


@pytest.fixture
def every_look(monkeypatch):
    """Let progress be reported at each look, however quick a run is."""
    monkeypatch.setattr("dforce.runs.LOOKS_A_SECOND", math.inf)


@pytest.fixture
def cases_a_block(monkeypatch):
    """Give a function that cuts sweeps into blocks of so many cases."""

    def cut(count):
        for name in ("BLOCK", "LEAST_BLOCK"):
            monkeypatch.setattr(f"dforce.maps._part.{name}", count)

    return cut


@pytest.fixture
def as_sampled(monkeypatch):
    """Leave what errs by too much as it was found, instead of finding it again with more samples."""
    monkeypatch.setattr("dforce.solvers.sample_counts.FINER", ())


@pytest.fixture
def workdir(tmp_path, monkeypatch):
    """A folder of the test's own, in which it works."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
