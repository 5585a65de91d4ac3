"""A sweep in a store: the same numbers as in memory, whole blocks only, and going on after anything."""

from __future__ import annotations

import functools
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from tiers import some_long

import dforce as df
from dforce.maps import _executors
from dforce.maps._map import Map
from dforce.results.store_plan import Blocks
from dforce.results.store_writer import Writer

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

pytest.importorskip("zarr")

OVER = {
    "sample.youngs_modulus": {"start": "0.3 GPa", "stop": "3 GPa", "points": 5, "spacing": "log"},
    "drive.A0": [6e-9, 8e-9, 15e-9],
}


def case(**changes: object) -> df.Case:
    values = {
        "cantilever": df.Cantilever(f0="50 kHz", k=1.0, Q=100.0),
        "drive": df.Drive(A0="8 nm"),
        "tip": df.Tip(radius="5 nm"),
        "sample": df.Sample(youngs_modulus="1 GPa"),
        "forces": [df.forces.DMT(hamaker="3e-20 J")],
        "experiment": df.experiments.Approach(zc={"start": "18 nm", "stop": "6 nm", "points": 9}, direction="both"),
    }
    return df.Case(**values | changes)


@functools.cache
def in_memory() -> xr.Dataset:
    """Return the map over OVER."""
    return df.sweep(case(), OVER)


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "map.zarr"


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cut the map over OVER into blocks of two cases."""
    monkeypatch.setattr("dforce.maps._map.BLOCKS", 10)


def same(store: xr.Dataset, memory: xr.Dataset) -> None:
    """Assert that a store holds the numbers of a result in memory, bit for bit; it has more room for jumps."""
    loaded = store.load()
    assert set(loaded.variables) == set(memory.variables)
    for name, one in memory.variables.items():
        other = loaded.variables[name]
        assert other.dims == one.dims
        for dim in set(one.dims) & {"jump", "crossing"}:
            other = other.isel({dim: slice(one.sizes[dim])})
        np.testing.assert_array_equal(other.values.astype(one.dtype), one.values, err_msg=str(name))
        assert other.attrs.keys() == one.attrs.keys()
    # advice on states at a set point is given where their curves are at hand
    apart = {"date"} | ({"advice", "advice_pieces"} if "set_point" in memory.attrs else set())
    one, other = ({key: value for key, value in data.attrs.items() if key not in apart} for data in (store, memory))
    assert one == other


@pytest.mark.usefixtures("small")
def test_a_store_holds_the_numbers_of_a_result_in_memory(store):
    memory = in_memory()
    assert "jump_zc" in memory
    same(df.sweep(case(), OVER, store=store), memory)
    assert next(iter(df.read(store).data_vars)) == next(iter(memory.data_vars))
    assert df.load_case(store) == case()
    assert not list(store.parent.glob("*.lock"))


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize(
    "kind",
    [
        {"over": OVER, "quantities": ["amplitude", "phase"]},
        {"over": OVER, "at_set_point": 0.8},
        {"rows": {"drive.A0": [6e-9, 8e-9, 9e-9], "tip.radius": [5e-9, 6e-9, 7e-9]}},
        {"over": {"solver.method": ["periodic", "transient"], "drive.A0": [6e-9, 7e-9, 8e-9]}},
    ],
    ids=["some quantities", "states at a set point", "rows", "a choice"],
)
def test_every_kind_of_sweep_fits_into_a_store(store, kind):
    small = case(experiment=df.experiments.Approach(zc={"start": "12 nm", "stop": "6 nm", "points": 9}))
    same(df.sweep(small, store=store, **kind), df.sweep(small, **kind))


def test_a_dwell_over_distances_fits_into_a_store(store):
    over = {"experiment.zc": [5e-9, 6e-9, 7e-9], "drive.A0": [8e-9, 9e-9]}
    dwell = case(experiment=df.experiments.Dwell(zc="7 nm"))
    same(df.sweep(dwell, over, store=store), df.sweep(dwell, over))


@pytest.mark.usefixtures("small")
def test_a_store_that_was_stopped_goes_on(store):
    def stop(done: int, total: int, note: str) -> None:
        if done:
            raise KeyboardInterrupt

    part = df.sweep(case(), OVER, store=store, workers=1, progress=stop)
    assert part.attrs["interrupted"] == 1
    assert (part.status == df.Status.NOT_COMPUTED).any()
    with pytest.raises(df.ResultError, match="exists already; continue it"):
        df.sweep(case(), OVER, store=store)
    for other in (case(), OVER | {"drive.A0": [6e-9, 8e-9, 14e-9]}), (case().replace("cantilever.k", 2.0), OVER):
        with pytest.raises(df.ParameterError, match=r"so it cannot be continued|belongs to another case"):
            df.sweep(*other, store=store, resume=True)
    with pytest.raises(df.ParameterError, match="so it cannot be continued"):
        df.sweep(case(), OVER, store=store, resume=True, at_set_point=0.8)
    same(df.sweep(case(), OVER, store=store, resume=True), in_memory())
    same(df.sweep(case(), OVER, store=store, resume=True), in_memory())


def test_a_complete_store_of_another_case_says_so(store):
    over = {"drive.A0": [6e-9, 8e-9]}
    df.sweep(case(), over, store=store, quantities=["amplitude"])
    for other in (case().replace("cantilever.k", 2.0), over), (case(), {"drive.A0": [6e-9, 7e-9]}), (case(), OVER):
        with pytest.raises(df.ParameterError, match=r"so it cannot be continued|belongs to another case"):
            df.sweep(*other, store=store, resume=True)


@pytest.mark.usefixtures("small")
def test_only_one_run_writes_a_store(store):
    with Writer(store), pytest.raises(df.ResultError, match="is open in another run"):
        df.sweep(case(), OVER, store=store)


KILLED = """
import os, signal, sys
import dforce as df
import dforce.maps._map
from dforce.results.store_files import StoreFiles

dforce.maps._map.BLOCKS = 10
path, blocks, write, records = sys.argv[1], int(sys.argv[2]), StoreFiles.write, []

def written(files, content):
    if len(records) == blocks and any("status/c/" in key for key in content):
        write(files, dict(list(content.items())[:2]))
        os.kill(os.getpid(), signal.SIGKILL)
    write(files, content)
    records.extend(key for key in content if key.startswith("checksums/blocks/c/"))

StoreFiles.write = written
df.sweep(df.Case.from_toml(sys.stdin.read()), store=path, workers=1, quantities=sys.argv[3:] or None)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGKILL")
@pytest.mark.usefixtures("small")
def test_a_store_goes_on_after_its_writer_was_killed_inside_a_block(store):
    swept = case(sweep={"over": OVER})
    whole = df.sweep(swept)
    for blocks in (0, 3):
        shutil.rmtree(store, ignore_errors=True)
        arguments = [sys.executable, "-c", KILLED, str(store), str(blocks)]
        killed = subprocess.run(arguments, input=swept.to_toml(), text=True, check=False)
        assert killed.returncode == -signal.SIGKILL
        done = df.read(store)
        assert (
            int((done.status != df.Status.NOT_COMPUTED).sum()) == {0: 0, 3: 90}[blocks]
        )  # there and back, of two, one and two cases
        same(df.sweep(swept, store=store, resume=True), whole)


@pytest.fixture
def bucket(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """An object store of this machine, which speaks as Amazon's S3 does."""
    pytest.importorskip("s3fs")
    server = pytest.importorskip("moto.server").ThreadedMotoServer(port=0)
    server.start()
    host, port = server.get_host_and_port()
    secrets = {"AWS_ACCESS_KEY_ID": "a", "AWS_SECRET_ACCESS_KEY": "b", "AWS_DEFAULT_REGION": "us-east-1"}
    for name, value in (secrets | {"AWS_ENDPOINT_URL": f"http://{host}:{port}"}).items():
        monkeypatch.setenv(name, value)
    import s3fs

    s3fs.S3FileSystem.clear_instance_cache()
    s3fs.S3FileSystem().makedirs("maps", exist_ok=True)
    yield "s3://maps"
    server.stop()


@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGKILL")
@pytest.mark.filterwarnings("ignore")  # of moto and s3fs
@pytest.mark.usefixtures("small")
def test_a_store_of_objects_goes_on_after_its_writer_was_killed_inside_a_block(bucket):
    swept, url = case(sweep={"over": OVER}), f"{bucket}/map.zarr"
    arguments = [sys.executable, "-c", KILLED, url, "3", "amplitude"]
    killed = subprocess.run(arguments, input=swept.to_toml(), text=True, check=False)
    assert killed.returncode == -signal.SIGKILL
    done = df.read(url)
    assert int((done.status != df.Status.NOT_COMPUTED).sum()) == 90
    with pytest.raises(df.ResultError, match="exists already; continue it"):
        df.sweep(swept, store=url)
    same(df.sweep(swept, store=url, resume=True), df.sweep(swept, quantities=["amplitude"]))
    same(df.sweep(swept, store=url, resume=True), df.sweep(swept, quantities=["amplitude"]))


@pytest.mark.usefixtures("small")
def test_a_full_disk_is_one_sentence_and_no_loss(store, monkeypatch):
    put, left = Writer._fitted, [40]

    def full(*arguments: Any) -> Any:
        left[0] -= 1
        if left[0] < 0:
            raise OSError(28, "No space left on device")
        return put(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(Writer, "_fitted", full)
        with pytest.raises(df.ResultError, match="no space left on device; finished blocks are kept"):
            df.sweep(case(), OVER, store=store)
    assert (df.read(store).status == df.Status.OK).any()
    same(df.sweep(case(), OVER, store=store, resume=True), in_memory())


@pytest.mark.usefixtures("small")
def test_a_block_that_fails_twice_is_left_out_with_its_sentence(store, monkeypatch):
    solve, tries = _executors.arrays_of, []

    def failing(one: Any, axes: Any, kept: Any, crew: Any) -> Any:
        if axes[0].values[0] == pytest.approx(3e9):
            tries.append(axes[1].values)
            raise ZeroDivisionError("nothing to divide by")
        return solve(one, axes, kept, crew)

    monkeypatch.setattr(_executors, "arrays_of", failing)
    result = df.sweep(case(), OVER, store=store)
    broken = (result.status == df.Status.BROKEN).all(("zc", "direction"))
    assert broken.values.tolist() == [[False] * 3] * 4 + [[True] * 3]
    assert len(tries) == 4  # two blocks, twice each
    assert min(result.attrs["notes"].splitlines()) == (
        "no result for youngs_modulus 5 to 5, A0 1 to 2: ZeroDivisionError: nothing to divide by"
    )
    assert np.isnan(result.amplitude.values[4]).all()


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("kind", some_long(["memory", "file"], long=["file"]))
def test_a_store_may_lie_at_a_url(store, kind):
    url = f"memory://{store.name}" if kind == "memory" else store.as_uri()

    def stop(done: int, total: int, note: str) -> None:
        if done:
            raise KeyboardInterrupt

    assert df.sweep(case(), OVER, store=url, workers=1, progress=stop).attrs["interrupted"] == 1
    with pytest.raises(df.ResultError, match="exists already; continue it"):
        df.sweep(case(), OVER, store=url)
    same(df.sweep(case(), OVER, store=url, resume=True), in_memory())
    same(df.read(url), in_memory())
    assert df.load_case(url) == case()
    assert store.is_dir() == (kind == "file")


@pytest.mark.parametrize(
    ("url", "sentence"),
    [
        ("zip9://map.zarr", "cannot be reached: Protocol not known: zip9"),
        ("dropbox://map.zarr", "needs a package that is not installed: .*dropbox"),
        ("memory://nothing.zarr", "there is no store"),
    ],
)
def test_a_url_that_is_of_no_use_is_one_sentence(url, sentence):
    with pytest.raises(df.ResultError, match=sentence) as read:
        df.read(url)
    with pytest.raises(df.ResultError, match=sentence) as resumed:
        df.sweep(case(), OVER, store=url, resume=True)
    assert "\n" not in f"{read.value}{resumed.value}"


def test_a_store_that_is_none_is_one_sentence(tmp_path):
    (tmp_path / "empty.zarr").mkdir()
    for path, sentence in (
        ("no.zarr", "there is no store"),
        ("empty.zarr", "cannot be read as a store|is not a store of dForce"),
    ):
        with pytest.raises(df.ResultError, match=sentence):
            df.read(tmp_path / path)
    for settings, sentence in (
        ({"store": tmp_path / "map.nc"}, "must end in '.zarr'"),
        ({"store": tmp_path / "no" / "map.zarr"}, "there is no folder"),
        ({"store": tmp_path / "no.zarr", "resume": True}, "to continue"),
    ):
        with pytest.raises(df.ResultError, match=sentence):
            df.sweep(case(), OVER, **settings)
    with pytest.raises(df.ParameterError, match="also pass store"):
        df.sweep(case(), OVER, client="tcp://127.0.0.1:1")


def test_blocks_are_known_one_by_one_however_many_there_are():
    blocks = Blocks({"a": 10**6, "b": 10**6}, {"a": 1, "b": 100})
    assert next(blocks.places()) == {"a": slice(0, 1), "b": slice(0, 100)}  # a list of them would fill the memory
    assert np.prod(blocks.counts) == 10**10


@pytest.mark.parametrize(
    ("lengths", "points", "blocks"),
    [
        ((15,), 9, 15),
        ((600,), 9, 120),
        ((40, 50), 9, 120),
        ((3, 1000, 7), 9, 126),
        ((1_000_000,), 9, 138),
        ((5,), 10**6, 5),
    ],
)
def test_the_number_of_blocks_follows_from_the_grid_alone(lengths, points, blocks, store):
    from dforce.maps._result import SweepLayout
    from dforce.maps.axes import make_axes

    starts = {"tip.radius": 5e-9, "drive.A0": 5e-9, "cantilever.Q": 100.0}
    over = {
        path: {"start": start, "stop": 2 * start, "points": n}
        for (path, start), n in zip(starts.items(), lengths, strict=False)
    }
    zc = {"start": "12 nm", "stop": "6 nm", "points": points}
    swept = case(experiment=df.experiments.Approach(zc=zc))
    cut = Map(swept, SweepLayout(swept, make_axes(swept, over)), None, None, store).blocks()
    assert np.prod(cut.counts) == blocks
    assert list(cut.sizes.values()) == list(lengths)
