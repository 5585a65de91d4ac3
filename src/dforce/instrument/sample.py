"""The sample, and the contact between tip and sample."""

from __future__ import annotations

from typing import Any, Self

import pydantic

from dforce.core.errors import ParameterError, nearest, shorten
from dforce.core.marks import words
from dforce.core.parameters import MaybeNumber, Number, Parameters, param
from dforce.instrument.tip import Tip
from dforce.library.materials import materials

# J. N. Israelachvili, Intermolecular and Surface Forces, Academic Press (2011)
A0_DEFAULT = "0.165 nm"


class Sample(Parameters):
    """The sample, by name (`sample = "polystyrene"`) or by numbers. It is flat and thick, unless a force needs its size."""

    name: str | None = words(
        None,
        max_length=50,
        examples=list(materials()),
        description="name of a material: its nominal Young's modulus and Poisson's ratio are the defaults",
    )
    youngs_modulus: MaybeNumber = param(
        None, unit="Pa", symbol="E_s", above="0 GPa", high="10 TPa", doc="Young's modulus of the sample"
    )
    poisson_ratio: Number = param(
        0.3, unit="1", symbol=r"\nu_s", low=0.0, high=0.5, doc="Poisson's ratio of the sample"
    )
    thickness: MaybeNumber = param(
        None, unit="m", symbol="h_s", above="0 nm", high="1 m", doc="thickness of a thin sample on a stiff support"
    )
    radius: MaybeNumber = param(
        None, unit="m", symbol="R_s", above="0 nm", high="1 m", doc="radius of a spherical sample"
    )

    @pydantic.model_validator(mode="before")
    @classmethod
    def _name_alone(cls, data: object) -> Any:
        return {"name": data} if isinstance(data, str) else data

    @pydantic.model_validator(mode="after")
    def _known_values(self) -> Self:
        if self.name is None:
            return self
        if self.name not in materials():
            raise ParameterError(
                f"sample = '{shorten(self.name)}' is not known: write youngs_modulus, "
                f"or a name{nearest(self.name[:100], materials(), 'dforce materials')}"
            )
        for field in ("youngs_modulus", "poisson_ratio"):
            value = getattr(materials()[self.name], field)
            if value is not None and (field not in self.model_fields_set or getattr(self, field) is None):
                # not marked as given by the user, so that a case written to a file keeps the name alone
                self.__dict__[field] = value
        return self


class Contact(Parameters):
    """The start of contact, the same for all forces."""

    a0: Number = param(
        A0_DEFAULT, symbol="a_0", above="0 nm", high="10 nm", doc="intermolecular distance; contact is at d < a0"
    )


def effective_modulus(tip: Tip, sample: Sample) -> float | None:
    r"""Return the effective modulus (Pa) of the contact, None when the sample's is not known.

    .. math:: \frac{1}{E_\mathrm{eff}} = \frac{1 - \nu_t^2}{E_t} + \frac{1 - \nu_s^2}{E_s}

    A rigid tip leaves the second term alone. Source: H. Hertz, J. reine angew. Math. 92, 156 (1881).
    """
    if sample.youngs_modulus is None:
        return None
    compliance = (1.0 - sample.poisson_ratio**2) / sample.youngs_modulus
    if tip.youngs_modulus is not None:
        compliance += (1.0 - tip.poisson_ratio**2) / tip.youngs_modulus
    return 1.0 / compliance
