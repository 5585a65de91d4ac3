"""HDF5: a data set for each quantity, its unit in the attribute `units`; each group that holds some is a curve."""

from __future__ import annotations

import pickle
import subprocess
from itertools import starmap

from dforce.core import child
from dforce.core.errors import ResultError
from dforce.inverse.table import Column, Table

LONGEST = 60.0  # s that a file is read


def read(content: bytes, name: str) -> list[Table]:
    """Return the curves in an HDF5 file.

    HDF5 may run for ever on a damaged file, or end its process: so the file is read by a process of its own.

    Raises
    ------
    ResultError
        When it is damaged, or no group of it holds columns of one length.
    """
    none_started = f"{name} cannot be read: no process could be started for it"
    if not child.can_start():
        raise ResultError(none_started)
    try:
        done = subprocess.run(
            child.command("-m", "dforce.inverse.readers.hdf5_groups"), input=content, capture_output=True, timeout=LONGEST,
            check=True, env=child.environment(),
        )  # fmt: skip
        found = pickle.loads(done.stdout)  # written by our own process
    except (subprocess.SubprocessError, pickle.UnpicklingError, EOFError) as error:
        raise ResultError(f"{name} is damaged or was cut short") from error
    except OSError as error:
        raise ResultError(none_started) from error
    if not found:
        raise ResultError(f"{name} has no group with data sets of one length, which the columns of a curve are")
    return [Table(tuple(starmap(Column, columns)), "HDF5", notes=notes) for columns, notes in found]
