"""Checksums of a store: they bind each file to its store, its name and its block.

The attributes of a store hold the checksums of the files that are written once, and one of their own. Each block of cases has
a record: the checksum of its chunk of each array, then one of the record itself. The record is written last, so a block
without one is not computed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

ROOT = "zarr.json"  # the attributes of the store
FOLDER = "checksums"
COPY = f"{FOLDER}/zarr.json"  # of the attributes, from which they are repaired
RECORDS = f"{FOLDER}/blocks"
KEY = "dforce_checksums"  # attribute that holds the seal
SIZE = 16  # bytes of a checksum: by chance one in 10^38 agrees
ABSENT = bytes(SIZE)  # of a chunk that zarr leaves out, as it holds nothing but the fill value


@dataclass(frozen=True)
class Seal:
    """The checksums of a store.

    Attributes
    ----------
    identity
        The same for two stores of the same sweep only; part of each checksum.
    block
        Length of a block along each dimension of the cases, the first ones of each array that is written in blocks.
    arrays
        Names of these arrays, in the order of a record.
    quantities
        Names of the quantities that the sweep keeps, with spaces between them.
    files
        Checksums of the files that are written once, by key.
    """

    identity: str
    block: Mapping[str, int]
    arrays: tuple[str, ...]
    quantities: str
    files: Mapping[str, str]

    @property
    def nodes(self) -> list[str]:
        """Names of all arrays."""
        return [
            key.removesuffix("/zarr.json")
            for key in self.files
            if key.endswith("/zarr.json") and not key.startswith(FOLDER)
        ]

    def is_whole(self, key: str, content: bytes | None) -> bool:
        """Return whether a file that is written once is unchanged."""
        return content is not None and checksum(self.identity, key, content).hex() == self.files[key]

    def of_chunk(self, key: str, content: bytes | None) -> bytes:
        """Return the checksum of a chunk; None: zarr has left it out."""
        return ABSENT if content is None else checksum(self.identity, key, content)

    def record(self, block: str, checksums: Sequence[bytes]) -> bytes:
        """Return the record of a block, such as ``3/0``, from the checksums of its chunks."""
        body = b"".join(checksums)
        return body + checksum(self.identity, record_key(block), body)

    def chunks(self, block: str, record: bytes) -> dict[str, bytes] | None:
        """Return the checksums of the chunks of a block by array; None: the record has changed."""
        body, own = record[:-SIZE], record[-SIZE:]
        if len(body) != SIZE * len(self.arrays) or own != checksum(self.identity, record_key(block), body):
            return None
        return {name: body[SIZE * place : SIZE * (place + 1)] for place, name in enumerate(self.arrays)}


def checksum(identity: str, key: str, content: bytes) -> bytes:
    """Return the checksum of a file, bound to its store and its name."""
    found = hashlib.blake2b(f"{identity}\n{key}\n".encode(), digest_size=SIZE)
    found.update(content)
    return found.digest()


def identity_of(words: object) -> str:
    """Return a name for a sweep, of all that decides its numbers, as JSON holds it."""
    return hashlib.blake2b(json.dumps(words, sort_keys=True).encode(), digest_size=SIZE).hexdigest()


def record_key(block: str) -> str:
    """Return the key of the record of a block."""
    return f"{RECORDS}/c/{block}/0/0"


def sealed(attributes: Mapping[str, Any], seal: Seal) -> bytes:
    """Return the file of a store's attributes, with their checksum."""
    words = dict(attributes) | {KEY: asdict(seal)}
    words[KEY]["checksum"] = checksum(seal.identity, ROOT, _canonical(words)).hex()
    return json.dumps({"zarr_format": 3, "node_type": "group", "attributes": words}, indent=2).encode()


def attributes_in(content: bytes) -> dict[str, Any]:
    """Return the attributes in the file of a group.

    Raises
    ------
    ValueError
        When it is no such file.
    """
    found = json.loads(content)
    if not isinstance(found, dict) or not isinstance(found.get("attributes"), dict):
        raise ValueError("it has no attributes")
    return dict(found["attributes"])


def unsealed(content: bytes | None) -> tuple[dict[str, Any], Seal] | None:
    """Return the attributes of a store, and its seal; None: they are not as they were written."""
    try:
        attributes = attributes_in(content or b"")
        own = attributes[KEY].pop("checksum")
        seal = Seal(**attributes[KEY] | {"arrays": tuple(attributes[KEY]["arrays"])})
        whole = own == checksum(seal.identity, ROOT, _canonical(attributes)).hex()
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
    return ({key: value for key, value in attributes.items() if key != KEY}, seal) if whole else None


def _canonical(attributes: Mapping[str, object]) -> bytes:
    return json.dumps(attributes, sort_keys=True).encode()


def damage(name: str, key: str, content: bytes | None) -> str:
    """Return the sentence on a file of a store that is missing (None) or not as it was written."""
    state = "is missing" if content is None else "is not as it was written"
    again = f"repair it: dforce sweep CASE.toml -o {name} --resume"
    return f"{name} is damaged: {part(key)} {state}; {again}"


def part(key: str) -> str:
    """Return the words for a file of a store that is written once, a record, or a chunk."""
    array, _, rest = key.rpartition("/c/")
    if key in (ROOT, COPY):
        return f"the {'file' if key == ROOT else 'copy'} of its attributes ('{key}')"
    if array == RECORDS:
        return f"the record of block {rest.removesuffix('/0/0')} ('{key}')"
    if key.endswith("/zarr.json"):
        return f"the array '{key.removesuffix('/zarr.json')}' ('{key}')"
    return f"the chunk '{key}'"
