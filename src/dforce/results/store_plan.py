"""The layout of a store: its arrays, how they are cut into blocks, and the files that are written once."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dforce.results.seal import COPY, RECORDS, ROOT, SIZE
from dforce.results.store import zarr_package

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Variable:
    """An array of a store that is written in blocks.

    Attributes
    ----------
    dims, dtype, attrs
        Its dimensions (the cases' dimensions first), kind of numbers (str: text), and attributes.
    fill
        The value where nothing was written.
    is_coordinate
        Whether it belongs to the coordinates of the result.
    """

    dims: tuple[str, ...]
    dtype: Any
    fill: Any
    attrs: Mapping[str, Any]
    is_coordinate: bool = False


@dataclass(frozen=True)
class Blocks:
    """How cases are cut into blocks: the length of each dimension, and of a block along it."""

    sizes: Mapping[str, int]
    block: Mapping[str, int]

    def places(self) -> Iterator[dict[str, slice]]:
        """Give the place of each block."""
        starts = [range(0, size, self.block[dim]) for dim, size in self.sizes.items()]
        for corner in itertools.product(*starts):
            yield {
                dim: slice(start, min(start + self.block[dim], self.sizes[dim]))
                for dim, start in zip(self.sizes, corner, strict=True)
            }

    def name(self, place: Mapping[str, slice]) -> str:
        """Return the name of the block at a place, such as ``3/0``: its number along each dimension."""
        return "/".join(str(place[dim].start // self.block[dim]) for dim in self.sizes)

    @property
    def counts(self) -> tuple[int, ...]:
        """Number of blocks along each dimension."""
        return tuple(-(-size // self.block[dim]) for dim, size in self.sizes.items())


@dataclass(frozen=True)
class Plan:
    """The layout of a store.

    Attributes
    ----------
    variables
        The arrays that are written in blocks, by name, `status` among them.
    coords
        The coordinates, which are written once.
    blocks, inner
        The cut of the cases, and the lengths of the dimensions behind them, which are whole in a block.
    attrs
        Attributes of the result.
    identity, quantities
        See :class:`dforce.results.seal.Seal`.
    """

    variables: Mapping[str, Variable]
    coords: xr.Dataset
    blocks: Blocks
    inner: Mapping[str, int]
    attrs: Mapping[str, Any]
    identity: str
    quantities: str

    @property
    def lengths(self) -> dict[str, int]:
        """Length of each dimension of the arrays that are written in blocks."""
        return {**self.blocks.sizes, **self.inner}

    @property
    def chunk(self) -> dict[str, int]:
        """Length of a chunk along each of them."""
        return {**self.blocks.block, **self.inner}


def encoded(plan: Plan) -> dict[str, bytes]:
    """Return the files of a store that are written once: the arrays, and the chunks of the coordinates."""
    zarr = zarr_package()
    desk: dict[str, Any] = {}
    group = zarr.open_group(zarr.storage.MemoryStore(desk), mode="w", zarr_format=3)
    for name, one in plan.variables.items():
        group.create_array(
            name,
            shape=[plan.lengths[dim] for dim in one.dims],
            dtype=one.dtype,
            fill_value=one.fill,
            dimension_names=one.dims,
            chunks=[max(1, plan.chunk[dim]) for dim in one.dims],
            attributes=plain(one.attrs),
            compressors=zarr.codecs.ZstdCodec(level=3, checksum=True),
        )
    for key, coord in plan.coords.coords.items():
        text = coord.dtype.kind in "OUT"
        array = group.create_array(
            str(key),
            shape=coord.shape,
            dtype=str if text else coord.dtype,
            chunks=[max(1, n) for n in coord.shape],
            dimension_names=coord.dims,
            attributes=plain(coord.attrs),
            fill_value="" if text else None,
        )
        array[...] = coord.values.astype(np.str_) if text else coord.values
    rows, counts = len(plan.variables) + 1, plan.blocks.counts
    group.create_array(
        RECORDS,
        shape=[*counts, rows, SIZE],
        dtype=np.uint8,
        fill_value=0,
        dimension_names=[*(f"block_{dim}" for dim in plan.blocks.sizes), "array", "byte"],
        chunks=[*(1 for _ in counts), rows, SIZE],
        compressors=None,
    )
    return {key: one.to_bytes() for key, one in desk.items() if key not in (ROOT, COPY)}


def plain(attrs: Mapping[str, object]) -> dict[str, Any]:
    """Return attributes as JSON holds them."""
    return {
        str(key): value.tolist() if isinstance(value, np.ndarray | np.generic) else value
        for key, value in attrs.items()
    }
