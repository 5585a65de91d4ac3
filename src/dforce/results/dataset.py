"""The attributes of a result's variables: units, names, symbols, and the unit in which each reads best."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dforce.core import quantities, units
from dforce.core.errors import checked
from dforce.results.status import Status

if TYPE_CHECKING:
    import xarray as xr


ELECTRONVOLT = 1.602176634e-19  # J; exact in the SI since 2019
COLUMN_DIMS = (
    "tone",
    "mode",
    "harmonic",
    "multiplier",
    "model",
    "interaction",
)  # columns of a table; others are its rows


def get_ready() -> None:
    """Load the modules that save results: this takes a second or more, and a stop at the end of a run must not wait for it."""
    import xarray as xr

    xr.Variable("point", [0.0])  # looks for other kinds of arrays, and loads them


def describe(dataset: xr.Dataset) -> xr.Dataset:
    """Give every standard variable its attributes `units`, `long_name`, `symbol` and `description`.

    The words come from :mod:`dforce.core.quantities`. `status` becomes int8 with CF flags and a sentence for each
    (`flag_sentences`, one a line). The Dataset is changed in place and returned.
    """
    for name, variable in dataset.variables.items():
        row = quantities.OF_RESULTS.get(str(name))
        if row is not None:
            variable.attrs.update(row.words)
    if "status" in dataset:
        if dataset.variables["status"].dtype != np.int8:
            dataset["status"] = dataset["status"].astype(np.int8)
        dataset.variables["status"].attrs.update(
            long_name="status",
            flag_values=np.array([status.value for status in Status], dtype=np.int8),
            flag_meanings=" ".join(status.meaning for status in Status),
            flag_sentences="\n".join(status.sentence for status in Status),
        )
    return dataset


@checked
def reader_unit(variable: xr.DataArray) -> tuple[float, str]:
    """Return (scale, name) of the unit in which a variable reads best: nm rather than 1e-9 m.

    The shown value is the value divided by `scale`; the largest value chooses the unit.
    """
    unit = str(variable.attrs.get("units", "1"))
    values = np.abs(np.asarray(variable.values, dtype=float))
    finite = values[np.isfinite(values)]
    return unit_for(float(finite.max()) if finite.size else 0.0, unit, str(variable.name))


def unit_for(size: float, unit: str, name: str = "") -> tuple[float, str]:
    """Return (scale, name) of the unit for a value of this size, in the spelling of print: µm/s, °, %, eV."""
    if unit in ("degree", "deg"):
        return 1.0, "°"
    if unit == "J":  # energies of a tapping cycle: the field counts in eV
        for scale, shown in ((1e-15, "fJ"), (1e3 * ELECTRONVOLT, "keV"), (0.1 * ELECTRONVOLT, "eV")):
            if size >= scale:
                return (ELECTRONVOLT, shown) if shown == "eV" else (scale, shown)
        return (1e-3 * ELECTRONVOLT, "meV") if size else (ELECTRONVOLT, "eV")
    observable = (quantities.OBSERVABLES | quantities.AXES).get(name)
    if observable is not None and observable.shown == "%":
        return 0.01, "%"
    scale, chosen = units.reader_unit(size, unit)
    return scale, units.spelled(chosen)
