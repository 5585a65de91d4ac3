"""The lever as a rectangular beam: modes from its material and size, in vacuum or in a fluid."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

import pydantic

from dforce.core.errors import ParameterError
from dforce.core.parameters import MaybeNumber, Number, Numbers, Parameters, param
from dforce.instrument import beam, fluid
from dforce.instrument.fluid import Wall
from dforce.instrument.history import FluidMemory, band, fluid_memory
from dforce.instrument.medium import Medium
from dforce.instrument.modes import MOST_MODES, TILT, ModeNumbers, normal_factor, quality


class Beam(Parameters):
    """A rectangular cantilever by material and size; its modes follow from Euler–Bernoulli theory.

    In a fluid, frequencies and quality factors follow from Sader's hydrodynamic function
    (:func:`dforce.instrument.beam.fluid_mode`). Valid if the length is far above the width, and the width far above the
    thickness.
    """

    title_of: ClassVar[str] = "cantilever.beam"
    # silicon along <110>: M. A. Hopcroft, W. D. Nix, T. W. Kenny, J. Microelectromech. Syst. 19, 229 (2010)
    example: ClassVar[Mapping[str, Any]] = {
        "youngs_modulus": "169 GPa",
        "density": "2330 kg/m^3",
        "length": "225 um",
        "width": "30 um",
        "thickness": "3 um",
    }

    youngs_modulus: Number = param(
        unit="Pa", symbol="E", above="0 GPa", high="10 TPa", doc="Young's modulus of the beam"
    )
    density: Number = param(unit="kg/m^3", symbol=r"\rho_c", above=0.0, high=1e5, doc="density of the beam")
    length: Number = param(unit="m", symbol="L", above="0 um", high="0.1 m", doc="length of the beam")
    width: Number = param(unit="m", symbol="b", above="0 um", high="0.1 m", doc="width of the beam")
    thickness: Number = param(unit="m", symbol="h", above="0 um", high="0.1 m", doc="thickness of the beam")
    modes: int = pydantic.Field(default=1, ge=1, le=MOST_MODES, description="number of flexural modes")
    tip_height: MaybeNumber = param(
        None,
        unit="m",
        symbol="h_t",
        above="0 um",
        high="1 mm",
        doc="height of the tip, from the sample to the end of the lever; the fluid in between adds damping; default: far",
    )
    tilt: MaybeNumber = TILT
    wall: Literal["at_sample", "at_distance"] = pydantic.Field(
        default="at_sample",
        title="Height above the sample",
        description="at_sample: load of the fluid with the tip at the sample; at_distance: load at each distance",
    )
    fluid: Literal["constant", "history"] = pydantic.Field(
        default="constant",
        title="Load of the fluid",
        description="constant: mass and damping at the resonance of each mode; history: as functions of the frequency, "
        "with a memory of the motion",
    )
    Q: Numbers = quality(
        (), doc="quality factor of each mode (a number, or a list for several modes); default: from the medium"
    )

    @pydantic.field_validator("Q", mode="before")
    @classmethod
    def _one_or_many(cls, given: object) -> Any:
        return given if isinstance(given, list | tuple) else (given,)

    @pydantic.model_validator(mode="after")
    def _a_Q_for_each(self) -> Self:
        if self.Q and len(self.Q) != self.modes:
            raise ParameterError(
                f"cantilever.beam.Q has {len(self.Q)} values for {self.modes} modes; write one for each"
            )
        if self.wall == "at_distance":
            if self.tip_height is None:
                raise ParameterError('cantilever.beam.wall = "at_distance" needs cantilever.beam.tip_height')
            if self.Q or self.fluid == "history":
                other = "Q" if self.Q else 'fluid = "history"'
                raise ParameterError(f'cantilever.beam.wall = "at_distance" excludes {other}; remove one of them')
        if self.Q and self.fluid == "history":
            raise ParameterError(
                'cantilever.beam has both Q and fluid = "history", which determines Q; write only one of them'
            )
        return self

    def resolve(self, medium: Medium) -> tuple[ModeNumbers, ...]:
        """Return the modes in a medium; in a fluid f0 follows from Sader's theory, and so does a missing Q.

        Raises
        ------
        ParameterError
            When Q is missing and does not follow from the medium, or a mode has no resonance there (Q of 0.5 or less).
        """
        if self.fluid == "history" and not (medium.density and medium.viscosity):
            raise ParameterError(
                'cantilever.beam.fluid = "history" needs a fluid with density and viscosity; write medium = "water"'
            )
        found = tuple(self._mode(n, medium) for n in range(1, self.modes + 1))
        if self.fluid == "history":
            low, high = band([mode.f0 for mode in found])
            if self.tip_height is not None:  # the flow near a wall is known within limits
                known = fluid.known_near_wall(self.width, medium.needed("density"), medium.needed("viscosity"))
                low, high = max(low, known[0]), min(high, known[1])
            found = tuple(self._remembering(n, mode, medium, low, high) for n, mode in enumerate(found, start=1))
        for n, mode in enumerate(found, start=1):
            if mode.Q <= 0.5:
                raise ParameterError(
                    f"mode {n} of cantilever.beam has Q = {mode.Q:.3g} in this medium; it must be above 0.5"
                )
        return found

    def _mode(self, n: int, medium: Medium) -> ModeNumbers:
        free = self._in_vacuum(n)
        f0, Q, added_mass = free.frequency, self.Q[n - 1] if self.Q else math.nan, 0.0
        if medium.density and medium.viscosity:
            wet = self._wet(n, free.frequency, medium.density, medium.viscosity)
            f0, Q, added_mass = wet.frequency, self.Q[n - 1] if self.Q else wet.Q, wet.added_mass
        elif not self.Q:
            why = "vacuum does not damp the beam" if medium.name == "vacuum" else "no fluid is set"
            raise ParameterError(f'cantilever.beam.Q is missing, and {why}; write Q, or medium = "air"')
        return ModeNumbers(f0, free.stiffness * normal_factor(self.tilt), Q, beam.base_coupling(n), added_mass)

    def _in_vacuum(self, n: int) -> beam.BeamMode:
        return beam.vacuum_mode(n, self.youngs_modulus, self.density, self.length, self.width, self.thickness)

    def nearest(self) -> float:
        """Return the least height (m) with a known flow below the lever."""
        return fluid.LEAST_GAP * self.width * (1.0 + 1e-12)

    @property
    def _wall(self) -> Wall | None:
        return None if self.tip_height is None else Wall(self.tip_height, self.tilt or 0.0, self.length)

    def _wet(self, n: int, frequency: float, density: float, viscosity: float) -> beam.FluidMode:
        """Return a mode in a fluid from its frequency in vacuum (Hz); over the sample if the tip's height is set."""
        numbers = (frequency, self.density, self.width, self.thickness, density, viscosity)
        if self._wall is None:
            return beam.fluid_mode(*numbers)
        try:
            return fluid.mode_near_wall(n, *numbers, self._wall)
        except ParameterError as error:
            raise ParameterError(f"mode {n} of cantilever.beam at tip_height: {error}") from None

    def _remembering(self, n: int, mode: ModeNumbers, medium: Medium, low: float, high: float) -> ModeNumbers:
        """Return a mode with the fluid's memory between two frequencies (Hz)."""
        flowing = (self.width, medium.needed("density"), medium.needed("viscosity"))
        load = math.pi * flowing[1] * self.width / (4.0 * self.density * self.thickness)
        try:
            memory = _memory(n, self._in_vacuum(n).frequency, load, flowing, self._wall, low, high)
            f0, Q = memory.resonance()
        except ParameterError as error:
            raise ParameterError(f"mode {n} of cantilever.beam with its fluid's history: {error}") from None
        return dataclasses.replace(mode, f0=f0, Q=Q, memory=memory)


@functools.lru_cache(maxsize=256)
def _memory(
    n: int,
    vacuum_frequency: float,
    load: float,
    flowing: tuple[float, float, float],
    wall: Wall | None,
    low: float,
    high: float,
) -> FluidMemory:
    """Return the fluid's memory on a mode; `flowing` are width (m), density and viscosity."""
    gamma = fluid.free_flow(*flowing) if wall is None else fluid.wall_flow(n, *flowing, wall)
    return fluid_memory(vacuum_frequency, load, gamma, low, high)
