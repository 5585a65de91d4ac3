"""Keeps the texts of composed modules on disk, so that a process need not write them anew only to find their names.

A text follows from the sources of dForce, the shipped laws among them, and from the combination that is asked for. Both are
hashed; laws from elsewhere (expressions, files of a user's own) are composed each time.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path

from dforce.forces import Force
from dforce.kernel.cache import TEXTS, cache_folder, make_folder, oldest
from dforce.kernel.cache_files import keep, kept

MOST_TEXTS = 200  # kept; the least recently written go first
SHIPPED = "dforce."
ASIDE = {"checks", "cli", "gui", "plot"}  # no kernel is made of these


@functools.cache
def sources() -> str:
    """Return the hash of everything in the package that a kernel may be made of."""
    package = Path(__file__).parent.parent
    files = [path for path in package.rglob("*.py") if path.relative_to(package).parts[0] not in ASIDE]
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def is_shipped(force: Force) -> bool:
    """Return whether the sources of dForce hold the law of a force."""
    law = force.law_function()
    owner = getattr(type(force), law.__name__, None)
    return type(force).__module__.startswith(SHIPPED) and law.__module__.startswith(SHIPPED) and owner is law


def remembered(parts: Iterable[object], forces: Iterable[Force], compose: Callable[[], str]) -> str:
    """Return the text for a combination: the kept text, else composed text, which is then kept if possible.

    Parameters
    ----------
    parts
        The inputs of the text besides the forces' laws, compared by their ``repr``.
    forces
        The bound forces; only their laws matter.
    compose
        Function that makes the text.
    """
    given = [*map(repr, parts)]
    for force in forces:
        if not is_shipped(force):
            return compose()
        law = force.law_function()
        given.append(repr((type(force).__module__, type(force).__name__, law.__name__)))
    key = hashlib.sha256("\0".join([sources(), *given]).encode()).hexdigest()[:20]
    file = cache_folder(TEXTS) / TEXTS / f"{key}.text"
    content = kept(file)
    if content is not None:
        return content.decode()
    text = compose()
    with contextlib.suppress(OSError):  # the folder of compiled code reports that nothing can be kept there
        make_folder(file.parent)
        keep(file, text.encode())
        for path in oldest(list(file.parent.glob("*.text")), MOST_TEXTS):
            path.unlink(missing_ok=True)
    return text
