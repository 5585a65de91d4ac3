"""Writes a store: blocks of cases, one chunk of each array, whole or not at all.

A chunk is encoded in memory and written as it is. The record of a block, with the checksums of its chunks, is written last: a
block is done where its record agrees with them. One process at a time may write, and holds a lock beside the store.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from dforce.core.errors import ResultError, shorten
from dforce.core.files import TEMPORARY, reason
from dforce.results.seal import ABSENT, COPY, ROOT, Seal, checksum, record_key, sealed, unsealed
from dforce.results.store import UNFINISHED, read_root, whole_files, zarr_package
from dforce.results.store_files import StoreFiles, said
from dforce.results.store_plan import Blocks, Plan, encoded, plain

STATUS = "status"
NOTES = "notes"  # attribute: remarks on faulty blocks, a sentence a line
COORDINATES = "coordinates"  # attribute by which xarray finds coordinates among the arrays


class Writer:
    """Writes blocks into a store; a context manager that holds the store's lock.

    Attributes
    ----------
    attributes, seal
        Attributes and checksums of the store, once it is found or made.
    damaged
        Keys of the files that were missing or changed.
    finished
        Whether all blocks had been written when the store was found.

    Raises
    ------
    ResultError
        When another run has the store open, and, in any method, when a file cannot be read or written.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        import filelock

        self.files = StoreFiles(path)
        self._lock = None if self.files.folder is None else filelock.FileLock(f"{self.files.folder}.lock", timeout=0)
        self.attributes: dict[str, Any] = {}
        self.seal = Seal("", {}, (), "", {})
        self.damaged: list[str] = []
        self.finished = False
        self._filled: set[str] = set()  # arrays that have a chunk
        self._desk: dict[str, Any] = {}  # files that zarr encodes in memory
        self._arrays: dict[str, Any] = {}

    def __enter__(self) -> Writer:
        """Take the lock, and remove half-written files of a killed writer."""
        import filelock

        if self._lock is None or self.files.folder is None:
            return self
        try:
            self._lock.acquire()
        except filelock.Timeout:
            raise ResultError(f"the store {self.files.name} is open in another run") from None
        except OSError as error:
            raise ResultError(f"{self.files.name} cannot be written: {reason(error)}") from None
        for file in self.files.folder.rglob("*.tmp"):
            if TEMPORARY.fullmatch(file.name):
                file.unlink(missing_ok=True)
        return self

    def __exit__(self, *raised: object) -> None:
        """Give the lock back."""
        if self._lock is not None:
            if os.name == "posix":  # Windows removes no file that is open
                Path(self._lock.lock_file).unlink(missing_ok=True)
            self._lock.release()

    def find(self) -> bool:
        """Read the attributes of the store, from their copy where they are damaged; return False where it is to be made."""
        there = self.files.read([ROOT, COPY])
        whole = {key: unsealed(content) for key, content in there.items()}
        found = whole.get(ROOT) or whole.get(COPY)
        if found is not None:
            self.attributes, self.seal = found
            self.finished = UNFINISHED not in self.attributes
            self.damaged += [key for key in (ROOT, COPY) if whole.get(key) is None]
            kept = whole_files(self.files, self.seal)
            self.damaged += [key for key in self.seal.files if key not in kept]
            self._take(kept)
            return True
        if COPY in there:
            raise ResultError(
                f"{self.files.name} lacks its attributes ('{ROOT}') and their copy ('{COPY}'); "
                "remove it, then compute it again without --resume"
            )
        if there:
            read_root(self.files)  # names the reason
        return False

    def make(self, plan: Plan) -> None:
        """Make the store, with its arrays but none of their chunks; its attributes are written last.

        Raises
        ------
        ResultError
            When the folder holds other files.
        """
        with self._as_sentence():
            files = encoded(plan)
            there = {key for key in self.files.all_keys() if TEMPORARY.fullmatch(Path(key).name) is None}
            for key in sorted(there - {*files}):
                raise ResultError(
                    f"{self.files.name} contains '{shorten(key)}' from another sweep; choose another name"
                )
            self.seal = Seal(plan.identity, dict(plan.blocks.block), tuple(plan.variables), plan.quantities, {})
            self._write_once(files)
            named = [*map(str, plan.coords.coords), *(key for key, one in plan.variables.items() if one.is_coordinate)]
            self._put_attributes(plain(plan.attrs) | {COORDINATES: " ".join(named), UNFINISHED: 1})

    def repair(self, plan: Plan) -> None:
        """Write the damaged ones of the files that are written once anew."""
        with self._as_sentence():
            files = encoded(plan)
            self._write_once({key: files[key] for key in self.damaged if key in self.seal.files})

    def _write_once(self, files: Mapping[str, bytes]) -> None:
        """Write files that are written once; the seal has their checksums from now on."""
        self.files.write(files)
        sums = {key: checksum(self.seal.identity, key, content).hex() for key, content in files.items()}
        self.seal = replace(self.seal, files={**self.seal.files, **sums})
        self._take(whole_files(self.files, self.seal))

    def mark(self, attrs: Mapping[str, object]) -> None:
        """Add attributes to the store, such as its unfinished state, and mend damaged attributes."""
        with self._as_sentence():
            self._put_attributes(self.attributes | plain(attrs))

    def _put_attributes(self, attributes: Mapping[str, object]) -> None:
        """Write attributes of the store; the copy first, so that one of the two is whole at any moment."""
        self.attributes = dict(attributes)
        content = sealed(self.attributes, self.seal)
        self.files.write({COPY: content})
        self.files.write({ROOT: content})

    def _take(self, files: Mapping[str, bytes]) -> None:
        """Open the arrays in memory, where their chunks are encoded."""
        zarr = zarr_package()
        buffer = zarr.core.buffer.default_buffer_prototype().buffer
        self._desk = {key: buffer.from_bytes(files[key]) for key in files if key.endswith(ROOT)}
        store = zarr.storage.MemoryStore(self._desk)
        names = [name for name in self.seal.arrays if f"{name}/{ROOT}" in files]
        self._arrays = {name: zarr.open_array(store, path=name, mode="r+", zarr_format=3) for name in names}

    def is_done(self, blocks: Blocks, place: Mapping[str, slice]) -> bool:
        """Return whether a block is written and all its chunks are unchanged."""
        block = blocks.name(place)
        own = record_key(block)
        record = self.files.read([own]).get(own)
        if record is None and not self.finished:
            return False
        sums = None if record is None else self.seal.chunks(block, record)
        if sums is None:
            self.damaged.append(own)
            return False
        keys = {name: self._key(name, block) for name in sums if name in self._arrays}
        there = self.files.read(keys.values())
        wrong = [key for name, key in keys.items() if self.seal.of_chunk(key, there.get(key)) != sums[name]]
        self.damaged += wrong
        self._filled |= {name for name in keys if sums[name] != ABSENT}
        return not wrong

    def put(
        self,
        blocks: Blocks,
        place: Mapping[str, slice],
        arrays: Mapping[str, tuple[tuple[str, ...], object]],
        broken: int,
    ) -> None:
        """Write a block, its record last.

        Parameters
        ----------
        blocks, place
            How the cases are cut, and where the block is along their dimensions.
        arrays
            Dimensions and values by name. Shorter values than the store has room for are filled up; of longer ones the first
            are kept, and the store notes it.
        broken
            The status where there is none.
        """
        block = blocks.name(place)
        with self._as_sentence():
            chunks: dict[str, bytes] = {}
            sums = dict.fromkeys(self.seal.arrays, ABSENT)
            for name, array in self._arrays.items():
                if name != STATUS and name not in arrays:
                    continue
                region = tuple(place.get(dim, slice(None)) for dim in array.metadata.dimension_names)
                array[region] = self._fitted(name, place, *arrays[name]) if name in arrays else broken
                key = self._key(name, block)
                encoded = self._desk.pop(key, None)
                if encoded is not None:  # else zarr leaves it out, as it holds nothing but the fill value
                    chunks[key] = encoded.to_bytes()
                    sums[name] = self.seal.of_chunk(key, chunks[key])
            self._filled |= {name for name, one in sums.items() if one != ABSENT}
            self.files.write(chunks)
            self.files.remove({self._key(name, block) for name in self._arrays} - {*chunks})
            self.files.write({record_key(block): self.seal.record(block, [*sums.values()])})

    def _key(self, name: str, block: str) -> str:
        array = self._arrays[name]
        return "/".join([name, "c", block, *["0"] * (array.ndim - len(self.seal.block))])

    def _fitted(self, name: str, place: Mapping[str, slice], dims: tuple[str, ...], values: Any) -> Any:
        """Return values as long as the store has room behind the cases."""
        array = self._arrays[name]
        names = array.metadata.dimension_names
        values = np.moveaxis(values, [dims.index(dim) for dim in names], range(len(names)))
        room = tuple(
            place[dim].stop - place[dim].start if dim in place else n for dim, n in zip(names, array.shape, strict=True)
        )
        if values.shape == room:
            return values
        for dim, length, n in zip(names, values.shape, room, strict=True):
            if length > n:
                self.note(f"some curves have more than {n} values along {dim}; only the first {n} of each are kept")
        out = np.full(room, array.fill_value, values.dtype)
        part = tuple(slice(min(pair)) for pair in zip(values.shape, room, strict=True))
        out[part] = values[part]
        return out

    def note(self, sentence: str) -> None:
        """Add a sentence to the notes of the store on its blocks."""
        before = str(self.attributes.get(NOTES, "")).splitlines()
        if sentence not in before:
            with self._as_sentence():
                self._put_attributes(self.attributes | {NOTES: "\n".join([*before, sentence])})

    def finish(self, attrs: Mapping[str, object], empty: Sequence[str], without: Sequence[str]) -> None:
        """Write attributes of a complete result, without some that it had, and without arrays if all of them stayed empty."""
        kept = {key: value for key, value in self.attributes.items() if key not in {*without, UNFINISHED}}
        gone = [f"{name}/{ROOT}" for name in empty if name in self._arrays] if self._filled.isdisjoint(empty) else []
        files = {key: one for key, one in self.seal.files.items() if key not in gone}
        self.seal = replace(self.seal, files=files)
        with self._as_sentence():
            self._put_attributes(kept | plain(attrs))
            self.files.remove(gone)

    @contextlib.contextmanager
    def _as_sentence(self) -> Iterator[None]:
        """Turn an error inside into a sentence."""
        try:
            yield
        except ResultError:
            raise
        except Exception as error:  # of zarr, or of the file system of the URL
            raise ResultError(
                f"the store {self.files.name} could not be written: {said(error)}; finished blocks are kept"
            ) from error
