"""A damaged store is named in one sentence, and going on with it repairs it."""

from __future__ import annotations

import importlib.util
import random
import shutil
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import dforce as df
from dforce.cli.app import app

pytestmark = pytest.mark.slow  # processes, stops and sweeps; left out by `make check`

pytest.importorskip("zarr")

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "stores.py"
specification = importlib.util.spec_from_file_location("stores", SCRIPT)
assert specification is not None
assert specification.loader is not None
benchmark: Any = importlib.util.module_from_spec(specification)
specification.loader.exec_module(benchmark)

SWEPT = benchmark.case().replace(sweep={"over": {"drive.A0": [6e-9, 7e-9, 8e-9]}})
KEPT = ["amplitude", "phase"]
REPAIR = "; repair it: dforce sweep CASE.toml -o 'map.zarr' --resume"


@pytest.fixture(scope="module")
def undamaged(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("stores"))
        return [path.absolute() for path in benchmark.stores()]


@pytest.mark.parametrize("fault", benchmark.FAULTS, ids=lambda fault: fault.__name__)
def test_each_damage_is_named_in_one_sentence_and_repaired_bit_for_bit(fault, undamaged, workdir):
    assert benchmark.miss(fault, random.Random(1), *undamaged)[1] == ""


@pytest.fixture
def store(workdir: Path) -> Path:
    df.sweep(SWEPT, quantities=KEPT, store="map.zarr")
    Path("map.toml").write_text(SWEPT.to_toml())
    return Path("map.zarr")


def sweep(**settings: Any) -> xr.Dataset:
    return df.sweep(SWEPT, store="map.zarr", resume=True, **settings)


def command(*words: str) -> str:
    """Run `dforce sweep`; return what it said."""
    done = CliRunner().invoke(app, ["sweep", "map.toml", *words])
    assert done.exit_code == 0, done.output
    return " ".join(done.stderr.split())


def test_a_chunk_that_is_gone_is_named_when_it_is_read_and_other_arrays_are_read(store):
    (store / "amplitude" / "c" / "1" / "0" / "0" / "0").unlink()
    data = df.read(store)
    assert np.isfinite(data.phase.values).all()
    with pytest.raises(df.ResultError) as raised:
        data.amplitude.values  # noqa: B018
    assert str(raised.value) == f"'map.zarr' is damaged: the chunk 'amplitude/c/1/0/0/0' is missing{REPAIR}"
    np.testing.assert_array_equal(data.amplitude[0].values, df.sweep(SWEPT).amplitude[0].values)


def test_an_array_that_is_gone_is_named_when_the_store_is_opened(store):
    shutil.rmtree(store / "phase")
    with pytest.raises(df.ResultError) as raised:
        df.read(store)
    assert str(raised.value) == f"'map.zarr' is damaged: the array 'phase' ('phase/zarr.json') is missing{REPAIR}"


def test_the_command_repairs_a_store_and_says_which_part(store):
    wanted = df.read(store).load()
    (store / "status" / "c" / "0" / "0" / "0").write_bytes(b"?")
    said = command("-o", "map.zarr", "--resume")
    assert "'map.zarr' was damaged and is now repaired: the chunk 'status/c/0/0/0'" in said
    xr.testing.assert_identical(df.read(store).load(), wanted)


def test_going_on_with_a_complete_store_computes_nothing_says_so_and_draws(store):
    before = benchmark.content(store)
    said = command("-o", "map.zarr", "--resume", "--plot", "map.png", "--quiet")
    assert said == "'map.zarr' is complete and undamaged; nothing was computed"
    assert Path("map.png").stat().st_size > 10_000
    assert benchmark.content(store) == before


def test_going_on_with_a_complete_file_computes_nothing_says_so_and_draws(store):
    command("-o", "map.nc")
    said = command("-o", "map.nc", "--resume", "--plot", "map.png", "--quiet")
    assert said == "this sweep is complete; nothing was computed"
    assert Path("map.png").stat().st_size > 10_000


def test_a_repair_that_is_stopped_leaves_the_store_unfinished_and_goes_on(store):
    wanted = df.read(store).load()
    for chunk in store.glob("amplitude/c/*/0/0/0"):
        chunk.unlink()

    def stop(done: int, total: int, note: str) -> None:  # at once: both blocks may be done when it is asked again
        raise KeyboardInterrupt

    part = sweep(progress=stop, workers=1)
    assert part.attrs["interrupted"] == 1
    with pytest.raises(df.ResultError, match="is damaged: the chunk 'amplitude/c/"):
        part.amplitude.load()
    xr.testing.assert_identical(sweep().load(), wanted)


def test_a_link_opens_no_store_twice(store):
    from dforce.results.store_writer import Writer

    Path("link.zarr").symlink_to(store, target_is_directory=True)
    with Writer(store), pytest.raises(df.ResultError, match=r"'link.zarr' is open in another run"):
        df.sweep(SWEPT, store="link.zarr", resume=True)


def test_a_store_without_checksums_says_how_to_read_it(store):
    import zarr

    group = zarr.open_group(store)
    shutil.rmtree(store / "checksums")
    del group.attrs["dforce_checksums"]
    for use in (lambda: df.read(store), sweep):
        with pytest.raises(df.ResultError, match="has no checksums: an earlier dForce or another program wrote it; "):
            use()


def test_xarray_opens_a_store_directly(store):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        data = xr.open_zarr(store, chunks=None, consolidated=False)
    assert "blocks" not in data
    for name, values in df.read(store).variables.items():
        np.testing.assert_array_equal(data[name].values, values.values)


def test_a_store_is_made_in_no_folder_that_has_other_files(store):
    Path("new.zarr").mkdir()
    Path("new.zarr", "notes.txt").write_text("mine")
    with pytest.raises(
        df.ResultError, match=r"'new.zarr' contains 'notes.txt' from another sweep; choose another name"
    ):
        df.sweep(SWEPT, store="new.zarr", resume=True)
    assert Path("new.zarr", "notes.txt").read_text() == "mine"


def test_a_store_that_lost_both_copies_of_its_attributes_says_what_to_do(store):
    for key in ("zarr.json", "checksums/zarr.json"):
        (store / key).write_bytes(b"{")
    with pytest.raises(df.ResultError, match=r"lacks its attributes .* remove it, then compute it again"):
        sweep()


def test_the_same_sweep_gives_the_same_files_again(store):
    df.sweep(SWEPT, quantities=KEPT, store="again.zarr")
    one, other = benchmark.content(store), benchmark.content(Path("again.zarr"))
    for key in ("zarr.json", "checksums/zarr.json"):  # they contain the date
        one.pop(key)
        other.pop(key)
    assert one == other
