"""Files that are cut, flipped or made of nothing: a curve or one sentence, never a traceback."""

from __future__ import annotations

import files
import h5py
import measured_curve
import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import dforce as df
from dforce.inverse.readers import tables_in
from dforce.results.files import SEAL_LENGTH

HEIGHT, AMPLITUDE, LAG = measured_curve.numbers(points=40)
CUTS, SLOW = 120, 8  # of each file, and of those that a process of its own reads
MOST = 400  # characters of a sentence


def hdf5(path):
    with h5py.File(path, "w") as file:
        for name, values in (("height", HEIGHT), ("amplitude", AMPLITUDE), ("phase", LAG)):
            file[name] = values
            file[name].attrs["units"] = "deg" if name == "phase" else "m"
    return path.read_bytes()


@pytest.fixture(scope="module")
def contents(tmp_path_factory):
    """Each kind of file, as bytes."""
    folder = tmp_path_factory.mktemp("hostile")
    columns = {"Amp": AMPLITUDE, "Phase": LAG, "ZSnsr": -HEIGHT}
    channels = {"Amplitude": AMPLITUDE[None], "Phase": LAG[None], "Z-Axis Sensor": -HEIGHT[None]}
    own = folder / "own.nc"
    df.write(df.calibrate(measured_curve.dataset(points=40)), own)
    return {
        "text.csv": measured_curve.text(points=40).encode(),
        "semicolons.csv": measured_curve.text(";", ",", "\r\n", points=40).encode("utf-16"),
        "curve.ibw": files.igor_wave(columns, "SpringConstant: 2.7\rIndexes: 0,39\rDirection: NaN,1"),
        "curve.nid": files.nanosurf(
            [((-4e-8, 3.5e-8), channels)], {"Amplitude": "m", "Phase": "°", "Z-Axis Sensor": "m"}
        ),
        "curve.h5": hdf5(folder / "curve.h5"),
        "own.nc": own.read_bytes(),
    }


NAMES = ("text.csv", "semicolons.csv", "curve.ibw", "curve.nid", "curve.h5", "own.nc")


def outcome(path, content):
    """Return how many points are read, or the sentence; anything but an error of dForce goes up."""
    path.write_bytes(content)
    try:
        data = df.read_measured(path, phase_convention="lag")
    except df.DForceError as error:
        assert "\n" not in str(error) and len(str(error)) < MOST
        return str(error)
    assert np.isfinite(data.height).all() and np.isfinite(data.amplitude).all() and np.isfinite(data.phase).all()
    try:
        df.calibrate(data)
    except df.DForceError as error:
        assert "\n" not in str(error) and len(str(error)) < MOST
    return data.sizes["point"]


@pytest.mark.parametrize("name", NAMES)
def test_whole_files_are_read(tmp_path, contents, name):
    assert outcome(tmp_path / name, contents[name]) == 40


@pytest.mark.parametrize("name", NAMES)
def test_a_file_cut_anywhere_is_a_curve_or_a_sentence(tmp_path, contents, name):
    whole = contents[name]
    for end in np.unique(
        np.linspace(0, len(whole) - 1, CUTS if name not in ("curve.h5", "own.nc") else SLOW).astype(int)
    ):
        found = outcome(tmp_path / name, whole[:end])
        # of text the lines that are whole are a curve; a result that lost nothing but its seal is one, too
        sealed = name == "own.nc" and len(whole) - end <= SEAL_LENGTH
        assert isinstance(found, str) or name.endswith("csv") or sealed, end


@pytest.mark.parametrize("name", ["text.csv"])
def test_the_last_number_of_a_text_that_was_cut_is_never_a_wrong_one(tmp_path, contents, name):
    """Wherever the file is cut, the points that are read are those that were written, but for rounding."""
    whole = contents[name]
    true = {round(1e9 * h, 4): (a, p) for h, a, p in zip(HEIGHT, AMPLITUDE, LAG, strict=True)}
    start = len(whole) - len(whole.splitlines()[-1]) - 2
    for end in range(start, len(whole)):
        (tmp_path / name).write_bytes(whole[:end])
        try:
            data = df.read_measured(tmp_path / name, phase_convention="lag")
        except df.DForceError:
            continue
        for h, a, p in zip(data.height.values, data.amplitude.values, data.phase.values, strict=True):
            amplitude, phase = true[round(1e9 * h, 4)]
            assert abs(a - amplitude) < 1e-13 and abs(p - phase) < 1e-3, end


@pytest.mark.parametrize("name", NAMES)
def test_a_file_with_flipped_bytes_is_a_curve_or_a_sentence(tmp_path, contents, name):
    draw = np.random.default_rng(4)
    for _ in range(CUTS if name != "curve.h5" else SLOW):
        content = bytearray(contents[name])
        for place in draw.integers(0, len(content), size=int(draw.integers(1, 4))):
            content[place] ^= 1 << int(draw.integers(0, 8))
        outcome(tmp_path / name, bytes(content))


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.one_of(
        st.binary(max_size=300), st.text(alphabet="0123456789.,;\t\n-+e#%naNpm[]()_ ", max_size=300).map(str.encode)
    )
)
@example(b"[DataSet]\n#!")
@example(b"[DataSet]\nGroupCount=99999999999\n#!")
@example(b"\x05\x00" + b"\xff" * 100)
@example(b"1 2\n" * 20)
@example(b"height_nm,amplitude_nm,phase_deg\n" + b"1,1,1\n" * 20)
def test_anything_at_all_is_tables_or_a_sentence(content):
    try:
        tables = tables_in(content, "'file'")
    except df.DForceError as error:
        assert "\n" not in str(error)
        return
    assert tables and all(len(column.values) == len(tables[0].columns[0].values) for column in tables[0].columns)


def test_a_folder_and_a_missing_file_are_sentences(tmp_path):
    with pytest.raises(df.ResultError, match="there is no file"):
        df.read_measured(tmp_path / "nothing.csv")
    with pytest.raises(df.ResultError, match="is a folder, not a file"):
        df.read_measured(tmp_path)
