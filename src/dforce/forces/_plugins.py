"""The user's own force models: Python files that a case names, ``plugins = ["my_force.py"]``.

Loading such a file runs its code. Each file is announced before its first run, and a case or a result can only name a file on
this computer.
"""

from __future__ import annotations

import hashlib
import inspect
import linecache
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
import pydantic

from dforce.core import log
from dforce.core.errors import ForceError, ParameterError, checked, shorten
from dforce.core.files import named, read_input
from dforce.forces._contract import REGISTRY, Force, guarded, in_first_contact

PREFIX = "dforce_plugin_"  # of the modules that files become
MOST_BYTES = 1_000_000  # a larger file is no force model


@dataclass(frozen=True)
class _Loaded:
    digest: str
    models: tuple[type[Force], ...]


_LOADED: dict[Path, _Loaded] = {}  # of this process, by resolved path


@checked
def load_plugin(path: str | os.PathLike[str]) -> tuple[type[Force], ...]:
    """Run a Python file and return the force models that it defines; a case may then use them.

    An unchanged file, or a file of an imported package, is not run again. The first run is announced, see
    :func:`dforce.core.log.announce`.

    Parameters
    ----------
    path
        The file; a relative path starts at the folder of the case file, else at the working directory.

    Raises
    ------
    ParameterError
        When the file does not exist, cannot be read, or is not a Python file (``.py``).
    ForceError
        When the file fails, defines no force model, or defines a model against the contract.
    """
    name = shorten(str(path), 100)
    if not str(path).endswith(".py") or "\0" in str(path):
        raise ParameterError(f"the plug-in '{name}' is not a Python file (.py)")
    file = named(path, "plugins").resolve()
    content = read_plugin(file)
    if imported := _imported(file):
        return imported
    digest = hashlib.sha256(content).hexdigest()
    for place, loaded in _LOADED.items():
        same = loaded.digest == digest and (place == file or b"__file__" not in content)  # the file itself, or a copy
        if same and all(REGISTRY.get(model.name) is model for model in loaded.models):
            _LOADED[file] = loaded
            return loaded.models
    if file not in _LOADED:
        log.announce(f"Running code that is not part of dForce: {shorten(str(file), 300)}")
    models = _run(file, content, name)
    _LOADED[file] = _Loaded(digest, models)
    return models


def read_plugin(file: Path) -> bytes:
    """Return the text of a plug-in.

    Raises
    ------
    ParameterError
        When it cannot be read.
    """
    return read_input(file, "plug-in", MOST_BYTES, ParameterError, name=f"the plug-in '{shorten(str(file), 300)}'")


def code_of(forces: Iterable[Force]) -> str:
    """Return the hash of the code and arrays of all forces that dForce does not ship; empty without such forces."""
    own = {type(force) for force in forces if not type(force).__module__.startswith("dforce.")}
    hashed = hashlib.sha256()
    for model in sorted(own, key=lambda model: model.name):
        for part in _parts_of(model):
            hashed.update(part)
    return hashed.hexdigest() if own else ""


def _parts_of(model: type[Force]) -> Iterator[bytes]:
    """Give the code of a model and its arrays: of its file, or in a notebook or script, of its functions alone."""
    module = sys.modules[model.__module__]
    if model.__module__ == "__main__":
        functions = [getattr(one, "fget", getattr(one, "__func__", one)) for one in vars(model).values()]
        parts = [part for one in functions if inspect.isfunction(one) for part in (one, *read_by(one))]
        yield from (part if isinstance(part, bytes) else inspect.getsource(part).encode() for part in parts)
        return
    file = Path(str(module.__file__))
    yield (_LOADED[file].digest if file in _LOADED else hashlib.sha256(read_plugin(file)).hexdigest()).encode()
    yield from (one.tobytes() for one in vars(module).values() if one is not None and hasattr(one, "tobytes"))


def check_answers(force: Force) -> None:
    """Refuse a bound force whose law, `switch` or `evolve` fails, or returns something else than a number.

    Where arithmetic fails nothing is refused: the compiled law gives no number there, and a motion may never come there.

    Raises
    ------
    ForceError
        With the distance, and the failure or the kind of the answer.
    """
    for d in (1e-8, 1e-9, 1e-10, -1e-9):
        in_first_contact(force, d, 0.0, 1e-8)
        if force.switch is not None:
            for latched in (0.0, 1.0):
                guarded(force.name, force.switch, "switch")(latched, d, 0.0, 0.0, *force.values())
        if force.evolve is not None:
            memory, change = np.zeros((2, force.memory))
            guarded(force.name, force.evolve, "evolve")(d, 0.0, 0.0, memory, change, *force.values())


def read_by(function: Callable[..., Any], known: tuple[object, ...] = ()) -> Iterator[FunctionType | bytes]:
    """Give the numbers, arrays and functions that a function reads from its file, through other functions, too."""
    function = inspect.unwrap(function)
    for name in function.__code__.co_names:
        value = function.__globals__.get(name)
        if isinstance(value, FunctionType) and value not in known:
            yield value
            yield from read_by(value, (*known, function, value))
        elif isinstance(value, int | float | tuple):
            yield f"{name} = {value!r}".encode()
        elif value is not None and not isinstance(value, type) and hasattr(value, "tobytes"):
            yield f"{name} = ".encode() + value.tobytes()


def _imported(file: Path) -> tuple[type[Force], ...]:
    """Return the models of a file that is imported as part of a package; run anew, it would clash with itself."""
    found = []
    for model in REGISTRY.values():
        module = sys.modules.get(model.__module__)
        own = getattr(module, "__file__", None)
        if own and not model.__module__.startswith(PREFIX) and Path(own).resolve() == file:
            found.append(model)
    return tuple(found)


def _run(file: Path, content: bytes, name: str) -> tuple[type[Force], ...]:
    """Run a file as a module; after a failure everything is as before."""
    # the file's name comes last, so that kernels have the same names for its functions in any folder
    place = hashlib.sha256(str(file).encode()).hexdigest()[:8]
    module = ModuleType(f"{PREFIX}{place}.{re.sub(r'[^0-9a-zA-Z]', '_', file.stem)}")
    module.__file__ = str(file)
    before, older = dict(REGISTRY), sys.modules.get(module.__name__)
    for model in [key for key, value in REGISTRY.items() if value.__module__ == module.__name__]:
        del REGISTRY[model]  # an older version of the file may have had other models
    sys.modules[module.__name__] = module
    linecache.checkcache(str(file))  # the kernel reads the laws' source there
    try:
        exec(compile(content, str(file), "exec"), module.__dict__)
        models = tuple(model for model in REGISTRY.values() if model.__module__ == module.__name__)
        if not models:
            raise ForceError("it defines no force model, a subclass of dforce.Force with a name")
    except BaseException as error:
        REGISTRY.clear()
        REGISTRY.update(before)
        del sys.modules[module.__name__]
        if older is not None:
            sys.modules[module.__name__] = older
        if isinstance(error, KeyboardInterrupt):
            raise
        raise ForceError(f"the plug-in '{name}' cannot be used: {_reason(error, file)}") from error
    return models


def _reason(error: BaseException, file: Path) -> str:
    """Return why a file failed, and in which of its lines."""
    if isinstance(error, ForceError | ParameterError):
        return str(error)
    if isinstance(error, pydantic.errors.PydanticUserError) and error.code == "model-field-missing-annotation":
        return f"{str(error).partition(' requires')[0].lower()} has no type; write NAME: float = param(...)"
    text = shorten(str(error), 200)
    if isinstance(error, SyntaxError) and error.filename == str(file):
        return f"it is not Python: {error.msg}" + (f" in line {error.lineno}" if error.lineno else "")
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
    place = f" in line {lines[-1]}" if lines else ""
    return f"{type(error).__name__}{place}{': ' if text else ''}{text}"
