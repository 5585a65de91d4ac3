"""Damaged stores: each damage is named in one sentence, and `--resume` repairs it.

    python benchmarks/stores.py [--stores 100] [--seed 1]

A map is written to a store, and another one, over other values, to a second. Copies of the first are damaged, each by a random
fault in random files. Reading a copy must end with one sentence that names a damaged file or its array. `df.sweep(resume=True)`
must repair it: each file equal byte for byte to the undamaged one, so each number bit for bit. Any miss ends with exit code 1.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import random
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import xarray as xr

import dforce as df

OVER = {"sample.youngs_modulus": [0.3e9, 0.6e9, 1e9, 2e9, 3e9], "drive.A0": [6e-9, 7e-9, 8e-9, 9e-9]}
KEPT = ["amplitude", "phase", "peak_force", "min_force", "jump_zc"]
Fault = Callable[[random.Random, Path, Path], list[str]]


def case() -> df.Case:
    """Return an approach in air."""
    return df.example("figure-3-air").replace("experiment.zc", {"start": "12 nm", "stop": "4 nm", "points": 17})


def files(store: Path, pattern: str) -> list[Path]:
    """Return files of a store, in a fixed order."""
    return sorted(file for file in store.glob(pattern) if file.is_file())


def chunk(draw: random.Random, store: Path) -> Path:
    """Return a random chunk of an array or record of a block."""
    return draw.choice([file for file in files(store, "**/c/**/*") if len(file.relative_to(store).parts) > 3])


def keys(store: Path, *damaged: Path) -> list[str]:
    """Return the keys of files."""
    return [file.relative_to(store).as_posix() for file in damaged]


def cut(draw: random.Random, file: Path) -> None:
    """Cut a file short."""
    content = file.read_bytes()
    file.write_bytes(content[: draw.randrange(len(content))])


def flip(draw: random.Random, file: Path) -> None:
    """Flip some bits of a file."""
    content = bytearray(file.read_bytes())
    for place in draw.sample(range(len(content)), min(len(content), draw.randint(1, 4))):
        content[place] ^= 1 << draw.randrange(8)
    file.write_bytes(content)


def remove_chunk(draw: random.Random, store: Path, other: Path) -> list[str]:
    """Remove a chunk."""
    file = chunk(draw, store)
    file.unlink()
    return keys(store, file)


def cut_chunk(draw: random.Random, store: Path, other: Path) -> list[str]:
    """Cut a chunk short."""
    file = chunk(draw, store)
    cut(draw, file)
    return keys(store, file)


def flip_chunk(draw: random.Random, store: Path, other: Path) -> list[str]:
    """Flip bits of a chunk."""
    file = chunk(draw, store)
    flip(draw, file)
    return keys(store, file)


def swap_chunks(draw: random.Random, store: Path, other: Path) -> list[str]:
    """Swap two chunks of an array that differ."""
    one = chunk(draw, store)
    rest = files(store / one.relative_to(store).parts[0], "**/c/**/*")
    second = draw.choice([file for file in rest if file.read_bytes() != one.read_bytes()] or [chunk(draw, store)])
    first, then = one.read_bytes(), second.read_bytes()
    one.write_bytes(then)
    second.write_bytes(first)
    return keys(store, one, second) if first != then else swap_chunks(draw, store, other)


def remove_array(draw: random.Random, store: Path, other: Path) -> list[str]:
    """Remove the folder of an array."""
    folder = draw.choice(sorted(path for path in store.iterdir() if path.is_dir()))
    damaged = keys(store, *files(folder, "**/*"))
    shutil.rmtree(folder)
    return damaged


def cut_metadata(draw: random.Random, store: Path, other: Path) -> list[str]:
    """Cut metadata short, or remove them."""
    file = draw.choice(files(store, "**/zarr.json"))
    cut(draw, file)
    if draw.random() < 0.3:
        file.unlink()
    return keys(store, file)


def edit_metadata(draw: random.Random, store: Path, other: Path) -> list[str]:
    """Change a number or a word in metadata, which stay well formed."""
    file = draw.choice(files(store, "**/zarr.json"))
    words = json.loads(file.read_text())
    places = words["attributes"]
    if file.parent not in (store, store / "checksums") and draw.random() < 0.7:
        places = words
        words["fill_value"], words["shape"] = 0, [n + draw.randint(0, 1) for n in words["shape"]]
    name = draw.choice([key for key, value in places.items() if isinstance(value, str)] or ["note"])
    places[name] = str(places.get(name, "")).replace("0", "1") + " "
    file.write_text(json.dumps(words))
    return keys(store, file)


def change_coordinate(draw: random.Random, store: Path, other: Path) -> list[str]:
    """Flip bits of a coordinate, or take it from another store."""
    name = draw.choice([str(key) for key in df.read(store).coords])
    found = files(store / name, "c/**/*") or files(store / name, "c")
    if not found:  # zarr leaves out a chunk of zeros
        return change_coordinate(draw, store, other)
    theirs = other / found[0].relative_to(store)
    if theirs.read_bytes() != found[0].read_bytes() and draw.random() < 0.5:
        shutil.copy(theirs, found[0])
    else:
        flip(draw, found[0])
    return keys(store, found[0])


def take_block(draw: random.Random, store: Path, other: Path) -> list[str]:
    """Take chunks of a block, and perhaps its record, from another store."""
    record = draw.choice(files(store, "checksums/blocks/c/**/*"))
    block = "/".join(record.relative_to(store / "checksums/blocks/c").parts[:2])
    arrays = [path for path in sorted(store.iterdir()) if (path / "c" / block).exists() and path.name != "checksums"]
    taken = [file for array in arrays for file in files(array, f"c/{block}/**/*") or files(array, f"c/{block}")]
    taken += [record] if draw.random() < 0.5 else []
    damaged = []
    for file in taken:
        theirs = other / file.relative_to(store)
        if theirs.exists() and theirs.read_bytes() != file.read_bytes():
            shutil.copy(theirs, file)
            damaged.append(file)
    return keys(store, *damaged)


FAULTS: tuple[Fault, ...] = (
    remove_chunk, cut_chunk, flip_chunk, swap_chunks, remove_array, cut_metadata, edit_metadata, change_coordinate, take_block,
)  # fmt: skip


def content(store: Path) -> dict[str, object]:
    """Return the files of a store; its attributes as they are read."""
    found: dict[str, object] = {file.relative_to(store).as_posix(): file.read_bytes() for file in files(store, "**/*")}
    return found | {key: json.loads(store.joinpath(key).read_text()) for key in ("zarr.json", "checksums/zarr.json")}


def sentence(store: Path) -> str:
    """Return the sentence with which reading a store ends; nothing: it was read."""
    try:
        df.read(store).load()
    except df.ResultError as error:
        return str(error)
    return ""


def stores() -> tuple[Path, Path]:
    """Write a map to a store, and another one to a second; return both."""
    whole, other = Path("whole.zarr"), Path("other.zarr")
    df.sweep(case(), OVER, quantities=KEPT, store=whole)
    df.sweep(case(), OVER | {"drive.A0": [6.5e-9, 7.5e-9, 8.5e-9, 9.5e-9]}, quantities=KEPT, store=other)
    return whole, other


def miss(fault: Fault, draw: random.Random, whole: Path, other: Path) -> tuple[str, str]:
    """Damage a copy of a store and repair it; return the sentence that names the damage, and a miss, if any."""
    copy = Path("copy.zarr")
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(whole, copy)
    damaged = fault(draw, copy, other)
    said = sentence(copy)
    names = {f"'{key}'" for key in damaged} | {f"'{key.split('/')[0]}'" for key in damaged}
    if "\n" in said or not any(name in said for name in names):
        return said, f"the sentence names none of {sorted(names)}"
    df.sweep(case(), OVER, quantities=KEPT, store=copy, resume=True)
    if content(copy) != content(whole):
        return said, "the repaired store differs"
    xr.testing.assert_identical(df.read(copy).load(), df.read(whole).load())
    return said, ""


def main() -> int:
    """Damage and repair; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stores", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    misses = 0
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):  # so that sentences name short paths
        whole, other = stores()
        for seed in range(asked.seed, asked.seed + asked.stores):
            draw = random.Random(seed)
            fault = draw.choice(FAULTS)
            said, missed = miss(fault, draw, whole, other)
            misses += bool(missed)
            told = f"{said or 'nothing was said'}{missed and f'; MISS: {missed}'}"
            print(f"seed {seed}: {str(fault.__doc__).rstrip('.')}: {told}", flush=True)
    print(
        f"{asked.stores} damaged stores, {misses} misses: each other one named in one sentence, and repaired bit for bit"
    )
    return 1 if misses else 0


if __name__ == "__main__":
    raise SystemExit(main())
