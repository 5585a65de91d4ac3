"""A force that the user writes as an expression."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NamedTuple

import pydantic

from dforce.core.errors import ParameterError
from dforce.core.marks import words
from dforce.core.parameters import MaybeNumber, Number, param, shared
from dforce.forces import _expression
from dforce.forces._contract import Force

FIELDS = {"R": "radius", "H": "hamaker"}  # where the expression's name is not the field's
PROBES = (-1e-9, 0.1e-9, 0.5e-9, 1e-9, 1e-8, 1e-7)  # m; a law that is finite at none of them is a mistake


class NameInLaw(NamedTuple):
    """A name that a law may use: its SI unit, empty for a number without one, and its meaning."""

    unit: str
    help: str


NAMES_IN_LAW = {
    "d": NameInLaw("m", "distance between tip and surface"),
    "indentation": NameInLaw("m", "a0 - d in contact, else 0"),
    "velocity": NameInLaw("m/s", "velocity of the tip, positive away from the sample"),
    "z": NameInLaw("m", "d - zc: deflection of the tip, with the motion of a driven base"),
    "t": NameInLaw("s", "time"),
    "R": NameInLaw("m", "tip radius"),
    "a0": NameInLaw("m", "intermolecular distance: contact begins there"),
    "E_eff": NameInLaw("Pa", "effective modulus of tip and sample"),
    "k": NameInLaw("N/m", "spring constant of mode 1"),
    "Q": NameInLaw("", "quality factor of mode 1"),
    "H": NameInLaw("J", "Hamaker constant, a parameter below"),
    **{name: NameInLaw("", "a number of your own in SI units, below") for name in ("P1", "P2", "P3", "P4")},
}


class _Of:
    """Whether the law of a force depends on a variable; for the class: whether any law may."""

    def __init__(self, variable: str) -> None:
        self.variable = variable

    def __get__(self, force: Custom | None, owner: type[Custom]) -> bool:
        return force is None or self.variable in force.expression.variables


class Custom(Force):
    r"""Your own force, as an expression.

    .. math:: F = F(d, z, \delta, \dot d, t, R, H, a_0, E_\mathrm{eff}, k, Q, P_1, P_2, P_3, P_4)

    For example ``law = "-P1*exp(-max(d, a0)/P2) + P3*sqrt(R)*indentation**1.5"``. All in SI units, the
    force in N, repulsive positive:

    - `d` distance (m); `indentation`, a0 - d in contact, else 0 (m); `velocity` of the tip, upward positive
      (m/s); `z`, d minus the average distance (m); `t` time (s)
    - `R` tip radius (m); `a0` intermolecular distance (m); `E_eff` effective modulus (Pa); `k` (N/m) and
      `Q` of mode 1; these come from the instrument
    - `H` Hamaker constant (J), the parameter `hamaker`; `P1` to `P4`, numbers of your own, in SI units

    Operators: ``+ - * / **``, comparisons, ``and or not``, ``x if condition else y``, ``where(condition, x,
    y)``. Functions: abs, exp, log, log10, sqrt, sign, sin, cos, tan, asin, acos, atan, sinh, cosh, tanh,
    min, max; and pi. The expression is compiled and as fast as a built-in force. It has no memory and no branches: a law with
    states of its own is a class in a Python file.

    Make it finite at every distance that the tip may reach: the force of contact starts at d = a0, and
    ``max(d, a0)`` keeps an attraction from growing beyond. Comparisons of d or the indentation define kinks for the solvers; a
    kink by min, max or abs at another place costs accuracy. dForce cannot detect the interactions in your law: with other
    forces, make sure that no interaction counts twice.
    """

    name = "custom"
    title = "Own law"
    also_called = ("own force", "user-defined force", "formula")
    source = "H. V. Guzman, P. D. Garcia, R. Garcia, Beilstein J. Nanotechnol. 6, 369 (2015), eq. 22"
    example: ClassVar[Mapping[str, Any]] = {
        "law": "-P1*exp(-max(d, a0)/P2) + P3*sqrt(R)*indentation**1.5 - P4*indentation*velocity",
        "P1": 2e-10,
        "P2": 5e-10,
        "P3": 1.5e9,
        "P4": 1.0,
    }
    dissipative = _Of("velocity")
    timed = _Of("t")

    law: str = words(  # type: ignore[assignment,misc]
        max_length=_expression.LONGEST, description="the force (N), an expression in SI units"
    )
    hamaker: MaybeNumber = param(None, unit="J", symbol="H", doc="Hamaker constant, H in the law")
    P1: Number = param(0.0, symbol="P_1", doc="first number of your own, in SI units")
    P2: Number = param(0.0, symbol="P_2", doc="second number of your own, in SI units")
    P3: Number = param(0.0, symbol="P_3", doc="third number of your own, in SI units")
    P4: Number = param(0.0, symbol="P_4", doc="fourth number of your own, in SI units")
    radius: float | None = shared("tip.radius")
    a0: float | None = shared("contact.a0")
    E_eff: float | None = shared("contact.E_eff")
    k: float | None = shared("cantilever.k")
    Q: float | None = shared("cantilever.Q")

    @pydantic.field_validator("law", mode="after")
    @classmethod
    def _is_an_expression(cls, text: str) -> str:
        _expression.read(text)
        return text

    @property
    def expression(self) -> _expression.Expression:
        """The law, checked and compiled to Python."""
        return _expression.read(self.law)

    def law_function(self) -> Callable[..., float]:
        return self.expression.function

    def values(self) -> tuple[float, ...]:
        return self._prepared()[0]

    def _prepared(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the constants of the law and the distances at which a comparison turns."""
        names = self.expression.variables & set(_expression.PARAMETERS)
        return self.expression.prepare({name: self.needed(FIELDS.get(name, name)) for name in names})

    def check_bound(self) -> None:
        for value, meaning in zip(self.values(), self.expression.meanings, strict=True):
            if not math.isfinite(value):
                raise ParameterError(f"custom.law has '{meaning}', which is {value} here")
        if not any(math.isfinite(self._at(d, rate)) for d in PROBES for rate in (0.0, 1e-6)):
            zeros = [name for name in sorted(self.expression.variables) if getattr(self, name, None) == 0.0]
            hint = f", perhaps because of {' and '.join(zeros)} = 0" if zeros else ""
            raise ParameterError(f"custom.law is a finite number at no distance{hint}")

    def _at(self, d: float, rate: float = 0.0) -> float:
        place = (d,) if "z" in self.expression.variables else ()  # no deflection
        return self.law_function()(d, rate, 0.0, *place, *self.values())

    def kinks(self) -> tuple[float, ...]:
        places = {edge for edge in self._prepared()[1] if math.isfinite(edge)}
        if "indentation" in self.expression.variables:
            places.add(self.needed("a0"))
        return tuple(sorted(places))

    def jumps(self) -> tuple[float, ...]:
        values = [abs(self._at(d)) for d in (*PROBES, *self.kinks())]
        scale = max(filter(math.isfinite, values), default=0.0)
        steps = {kink: abs(self._at(kink + 1e-19) - self._at(kink - 1e-19)) for kink in self.kinks()}
        return tuple(kink for kink, step in steps.items() if not step <= 1e-6 * scale)
