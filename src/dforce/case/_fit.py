"""The tables `[data]` and `[fit]` of a case: a measured curve, and the parameters to fit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

import pydantic

from dforce.core.errors import ParameterError, shorten
from dforce.core.marks import file_name, words
from dforce.core.parameters import Parameters, Part

MOST_FREE = 20  # parameters of a fit
LEAST_DRAWS = 20  # of a bootstrap: fewer give no error


class Data(Parameters):
    """A measured curve: its file, and the settings to read it."""

    title_of: ClassVar[str] = "data"

    file: str = file_name(
        "",
        max_length=1000,
        through_named=True,
        description="file of the curve, beside the case file: .csv, .txt, .h5, ...",
    )
    columns: Part[dict[str, str]] = words(
        {}, description='column of each quantity in the file, such as { height = "ZSnsr", amplitude = "Amp" }'
    )
    units: Part[dict[str, str]] = words({}, description='units of columns without a unit, such as { height = "nm" }')
    phase_convention: str = words(
        "", max_length=20, description="sign and zero of the phase in the file: lag, 90-lag, lag-90 or lead"
    )
    use: Part[dict[str, Any]] = words(
        {},
        description='points to use: { height = ["-40 nm", "5 nm"], direction = "approach" }, or several '
        'ranges, [["-40 nm", "-10 nm"], ["0 nm", "5 nm"]]; default: all',
    )

    read: Part[dict[str, Any]] = words(
        {}, description='other options of df.read_measured, such as { sensitivity = "52 nm/V" }'
    )
    calibrate: Part[dict[str, Any]] = words(
        {}, description='options of df.calibrate, such as { free_amplitude = "30 nm" }'
    )

    @pydantic.field_validator("columns", "units", "use", "read", "calibrate", mode="before")
    @classmethod
    def _tables(cls, given: object) -> Any:
        if not isinstance(given, Mapping):
            raise ParameterError(f"= {shorten(given)} is not a table")
        return {str(key): list(value) if isinstance(value, tuple) else value for key, value in given.items()}

    @pydantic.model_validator(mode="after")
    def _known_uses(self) -> Self:
        for key in self.use:
            if key not in ("height", "direction"):
                raise ParameterError(f"use has '{shorten(key)}'; known: height, direction")
        return self


class Fit(Parameters):
    """Parameters to fit from a measured curve, and prior values."""

    title_of: ClassVar[str] = "fit"

    free: Part[tuple[str, ...]] = words(
        (), max_length=MOST_FREE, description="paths of the parameters to fit, such as sample.youngs_modulus"
    )
    nuisance: Part[tuple[str, ...]] = words(
        ("zc_offset", "A0", "phase_offset"),
        max_length=MOST_FREE,
        description="offsets fitted as well: zc_offset, A0, phase_offset, amplitude_scale; with _2 for tone 2. By default "
        "tone 2 "
        "has the same offsets as tone 1",
    )
    priors: Part[dict[str, Any]] = words(
        {},
        description='prior values with errors; these parameters are fitted, too, such as { "cantilever.Q" = "180(4)" }',
    )
    bounds: Part[dict[str, Any]] = words(
        {}, description='bounds, such as { "sample.youngs_modulus" = ["10 MPa", "100 GPa"] }'
    )
    start: Part[dict[str, Any]] = words({}, description="start values; default: the values of the case")
    given: Part[dict[str, Any]] = words(
        {}, description='fixed values with errors, passed on to the result, such as { "cantilever.k" = "2.7(2) N/m" }'
    )
    errors: Part[dict[str, Any]] = words(
        {},
        description='standard deviations of amplitude, phase and height; default, or "from free part": from the data',
    )
    branch: Literal["measured", "attractive", "repulsive"] = pydantic.Field(
        default="measured", description="measured: each point on its own branch; else one branch only"
    )
    margin: int | None = pydantic.Field(
        default=None,
        ge=0,
        le=1000,
        description="number of points left out beside each jump; default: 1, or 0 with a column branch in the data",
    )
    search: bool = pydantic.Field(
        default=True, description="whether to try several starts around the start values; false: only the start values"
    )
    profile: Part[tuple[str, ...]] = words(
        (), max_length=MOST_FREE, description="parameters with a profile of chi2: asymmetric errors, slower"
    )

    bootstrap: int = pydantic.Field(
        default=0,
        ge=0,
        le=100_000,
        description="number of fits to redrawn residuals, for errors if the noise differs from the free part; 0: none",
    )

    @pydantic.field_validator("bootstrap")
    @classmethod
    def _enough(cls, given: int) -> int:
        if 0 < given < LEAST_DRAWS:
            raise ParameterError(f"= {given} fits are too few for an error; write 0, or {LEAST_DRAWS} or more")
        return given

    @pydantic.field_validator("free", "nuisance", "profile", mode="before")
    @classmethod
    def _names(cls, given: object) -> Any:
        if isinstance(given, str) or not hasattr(given, "__iter__"):
            raise ParameterError(f"= {shorten(given)} is not a list of names")
        return tuple(str(name) for name in given)

    @pydantic.field_validator("priors", "bounds", "start", "given", "errors", mode="before")
    @classmethod
    def _tables(cls, given: object) -> Any:
        if not isinstance(given, Mapping):
            raise ParameterError(f"= {shorten(given)} is not a table of values by name")
        return {str(key): _plain(value) for key, value in given.items()}


def _plain(value: object) -> Any:
    """Return numbers, texts and pairs as a file holds them."""
    if isinstance(value, str):
        return value
    if hasattr(value, "tolist"):
        value = value.tolist()
    return [_plain(item) for item in value] if isinstance(value, tuple | list) else value
