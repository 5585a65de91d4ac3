"""The tip."""

from __future__ import annotations

from dforce.core.parameters import MaybeNumber, Number, Parameters, param


class Tip(Parameters):
    """The tip; without a Young's modulus it is rigid."""

    radius: MaybeNumber = param(None, unit="m", symbol="R", above="0 nm", high="1 mm", doc="radius of the tip's apex")
    youngs_modulus: MaybeNumber = param(
        None, unit="Pa", symbol="E_t", above="0 GPa", high="10 TPa", doc="Young's modulus of the tip; default: rigid"
    )
    poisson_ratio: Number = param(
        0.28, unit="1", symbol=r"\nu_t", low=0.0, high=0.5, doc="Poisson's ratio of the tip (silicon: 0.28)"
    )
    half_angle: MaybeNumber = param(
        None,
        unit="rad",
        symbol=r"\theta",
        above="0 deg",
        below="90 deg",
        doc="angle between a cone's axis and its side",
    )
