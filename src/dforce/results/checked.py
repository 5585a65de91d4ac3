"""A store as zarr reads it, in which each file is compared with its checksum."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterable, Mapping

from zarr.abc.store import ByteRequest, Store
from zarr.core.buffer import Buffer, BufferPrototype, default_buffer_prototype
from zarr.storage import FsspecStore, LocalStore, WrapperStore

from dforce.core.errors import ResultError
from dforce.results.seal import ABSENT, Seal, damage, record_key
from dforce.results.store_files import StoreFiles, said


class Checked(WrapperStore[Store]):
    """The files of a store, for reading.

    In an unfinished store a chunk whose block has no record reads as not computed. Anywhere else a missing or changed
    file raises :class:`ResultError`, which names it.

    Parameters
    ----------
    files
        The files of the store.
    seal
        The checksums of the store.
    once
        Contents of the files that are written once, which have been compared.
    finished
        Whether each block must have a record.
    """

    def __init__(self, files: StoreFiles, seal: Seal, once: Mapping[str, bytes], finished: bool) -> None:
        super().__init__(
            LocalStore(files.folder, read_only=True)
            if files.folder is not None
            else FsspecStore.from_url(files.url, read_only=True)
        )
        self.name, self.seal, self.once, self.finished = files.name, seal, once, finished
        self._records: dict[str, dict[str, bytes]] = {}

    async def get(self, key: str, prototype: BufferPrototype, byte_range: ByteRequest | None = None) -> Buffer | None:
        """Return a file."""
        if byte_range is not None:
            raise NotImplementedError("a part of a file has no checksum")
        content = self.once.get(key)
        array, _, place = key.partition("/c/")
        if content is None and array in self.seal.arrays:
            content = await self._chunk(key, array, "/".join(place.split("/")[: len(self.seal.block)]))
        return None if content is None else prototype.buffer.from_bytes(content)

    async def get_partial_values(
        self, prototype: BufferPrototype, key_ranges: Iterable[tuple[str, ByteRequest | None]]
    ) -> list[Buffer | None]:
        """Return several files."""
        return [await self.get(key, prototype, byte_range) for key, byte_range in key_ranges]

    async def _list_dir(self, prefix: str) -> AsyncIterator[str]:
        for name in [] if prefix.strip("/") else self.seal.nodes:
            yield name

    def list_dir(self, prefix: str) -> AsyncIterator[str]:
        """Name the arrays of the store, which are known from its checksums."""
        return self._list_dir(prefix)

    async def _chunk(self, key: str, array: str, block: str) -> bytes | None:
        record = self._records.get(block)
        if record is None:
            content = await self._read(record_key(block))
            if content is None and not self.finished:
                return None
            record = None if content is None else self.seal.chunks(block, content)
            if record is None:
                raise ResultError(damage(self.name, record_key(block), content))
            self._records[block] = record
        content = None if record[array] == ABSENT else await self._read(key)
        if self.seal.of_chunk(key, content) != record[array]:
            raise ResultError(damage(self.name, key, content))
        return content

    async def _read(self, key: str) -> bytes | None:
        try:
            found = await self._store.get(key, default_buffer_prototype())
        except Exception as error:  # of the disk, or of the reader of the URL  # noqa: BLE001
            raise ResultError(f"{self.name} cannot be read: {said(error)}") from None
        return None if found is None else found.to_bytes()
