"""The medium around the cantilever."""

from __future__ import annotations

from typing import Any, Self

import pydantic

from dforce import library
from dforce.core import units
from dforce.core.errors import ParameterError, nearest, shorten
from dforce.core.marks import words
from dforce.core.parameters import MaybeNumber, Number, Parameters, param

COLDEST = 150.0  # K; a number below it, for a fluid known by name, was meant in degrees Celsius


class Medium(Parameters):
    """The medium of the cantilever: a name (`medium = "water"`), numbers, or a name and some numbers."""

    name: str | None = words(
        None,
        max_length=50,
        examples=sorted(library.media()),
        description="a known medium: air, water or vacuum, with its values at 298.15 K",
    )
    density: MaybeNumber = param(None, unit="kg/m^3", symbol=r"\rho", low=0.0, high=1e5, doc="density of the fluid")
    viscosity: MaybeNumber = param(None, unit="Pa s", symbol=r"\mu", low=0.0, high=1e6, doc="viscosity of the fluid")
    permittivity: MaybeNumber = param(
        None, unit="1", symbol=r"\epsilon", low=1.0, high=1e6, doc="relative permittivity between tip and sample"
    )
    temperature: Number = param(
        "298.15 K",
        symbol="T",
        above="0 K",
        high="1e4 K",
        doc="temperature; a medium by name keeps its values at 298.15 K",
    )

    @pydantic.model_validator(mode="before")
    @classmethod
    def _name_alone(cls, data: object) -> Any:
        return {"name": data} if isinstance(data, str) else data

    @pydantic.model_validator(mode="after")
    def _known_values(self) -> Self:
        if self.name is None:
            return self
        known = library.media()
        if self.name not in known:
            raise ParameterError(
                f"medium = '{shorten(self.name)}' is not known: write its density and viscosity, "
                f"or a name{nearest(self.name, known)}"
            )
        for field in ("density", "viscosity", "permittivity"):
            if getattr(self, field) is None:
                # not marked as given by the user, so that a case written to a file keeps the name alone
                self.__dict__[field] = units.parse(known[self.name][field], self.quantities()[field].unit)
        if self.viscosity and self.temperature < COLDEST:
            given = f"medium.temperature = {units.show(self.temperature, 'K', 6)}"
            raise ParameterError(f"{given} is too cold for {self.name}; did you mean '{self.temperature:g} degC'?")
        return self
