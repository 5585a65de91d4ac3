"""Oscillating force of layered solvent."""

from __future__ import annotations

from math import cos, exp, pi

from dforce.core.parameters import Number, param, shared
from dforce.forces._contract import Force


class Solvation(Force):
    r"""Layers of solvent between tip and sample: a force that oscillates with a molecule's size and decays.

    .. math:: F = -F_0 \cos\left(\frac{2\pi d}{\sigma} + \varphi\right) e^{-d/\sigma} \quad (d > a_0)

    and its value at :math:`a_0` in contact. An empirical law: fit amplitude and phase to a measured curve.
    """

    name = "solvation"
    also_called = ("oscillatory", "structural force", "layering", "solvent layers")
    contains = ("solvation",)
    source = "J. N. Israelachvili, Intermolecular and Surface Forces, Academic Press (2011)"

    a0: float = shared("contact.a0")
    amplitude: Number = param("1 nN", symbol="F_0", doc="amplitude, extrapolated to zero distance")
    molecule: Number = param(
        "0.3 nm", above="0 nm", symbol=r"\sigma", doc="size of a molecule: period and decay length"
    )
    phase: Number = param("0 deg", symbol=r"\varphi", doc="phase of the oscillation at zero distance")

    @staticmethod
    def law(d: float, rate: float, t: float, amplitude: float, molecule: float, phase: float, a0: float) -> float:
        x = (d if d > a0 else a0) / molecule
        return -amplitude * cos(2.0 * pi * x + phase) * exp(-x)

    def kinks(self) -> tuple[float, ...]:
        return (self.a0,)
