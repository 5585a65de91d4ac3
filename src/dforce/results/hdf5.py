"""Checks an HDF5 file of unknown origin in a subprocess, once, before any of it is used here."""

from __future__ import annotations

import pickle
import subprocess
from typing import TYPE_CHECKING, Literal

from dforce.core import child
from dforce.core.errors import ResultError, shorten
from dforce.results import hdf5_child

if TYPE_CHECKING:
    from dforce.results.hdf5_child import Curve

START = b"\x89HDF\r\n\x1a\n"  # of every HDF5 file, netCDF among them
SECONDS = 60.0  # that looking through one may take


def look(content: bytes, kind: Literal["result", "curves"], name: str = "this file") -> list[Curve]:
    """Look through the bytes of a file in another process, and return the measured curves in it; none of a result.

    Raises
    ------
    ResultError
        When the file is not to be read, or damaged, or where no process can be started.
    """
    unseen = f"{name} is not opened: the process that checks it could not start"
    if not child.can_start():
        raise ResultError(unseen)
    try:
        done = subprocess.run(
            child.command(hdf5_child.__file__, kind),
            input=content,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=SECONDS,
            check=True,
            env=child.environment(),
        )
        wrong, curves = pickle.loads(done.stdout)  # written by our own process
    except subprocess.TimeoutExpired:
        raise ResultError(f"{name} takes too long to read") from None
    except (subprocess.SubprocessError, pickle.UnpicklingError, EOFError) as error:
        raise ResultError(f"{name} is damaged or was cut short") from error
    except OSError as error:
        raise ResultError(unseen) from error
    if wrong:
        raise ResultError(f"{name} is not opened: {shorten(wrong, 200)}")
    return list(curves)
