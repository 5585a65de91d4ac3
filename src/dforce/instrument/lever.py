"""The lever: modes as they were measured, or a rectangular beam."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar, Literal, Self

import pydantic

from dforce.core.errors import ParameterError, nearest, shorten
from dforce.core.files import named
from dforce.core.marks import file_name, words
from dforce.core.parameters import MaybeNumber, Number, Numbers, Parameters, Part, param, part
from dforce.instrument import beam, fluid
from dforce.instrument.drift import Drift
from dforce.instrument.fluid import Wall
from dforce.instrument.history import FluidMemory, band, fluid_memory
from dforce.instrument.medium import Medium
from dforce.library.cantilevers import cantilevers, own_cantilevers

MOST_MODES = 10
LONGEST_REPEAT = 15  # periods of mode 1 after which it and an ideal higher mode repeat together
DENSEST = 50.0  # kg/m^3, of a gas: nominal frequencies are those in air


@dataclass(frozen=True)
class ModeNumbers:
    """One mode as it is in its medium.

    Attributes
    ----------
    f0, k, Q
        Resonance frequency (Hz), spring constant (N/m) and quality factor.
    base_coupling
        How strongly a base that moves drives it; 1 for a point mass.
    added_mass
        Share of the fluid in its mass; None where it is not known.
    memory
        The fluid's load in time; None where it is a mass and a damping. With it f0 and Q are those of the resonance.
    """

    f0: float
    k: float
    Q: float
    base_coupling: float = 1.0
    added_mass: float | None = None
    memory: FluidMemory | None = None

    @property
    def oscillator(self) -> tuple[float, float]:
        """Frequency (Hz) and Q of the equation of motion; with the fluid's memory those of what follows at once."""
        return (self.f0, self.Q) if self.memory is None else (self.memory.frequency, self.memory.Q)

    def stiffness(self, frequency: Any) -> Any:
        r"""Return the force over the deflection (N/m) at frequencies (Hz), where both go as :math:`e^{i \omega t}`.

        .. math:: k (1 - r^2 + i r / Q), \qquad r = \omega / \omega_0

        or with the fluid's memory what :meth:`dforce.instrument.history.FluidMemory.stiffness` says.
        """
        if self.memory is not None:
            return self.k * self.memory.stiffness(frequency)
        r = frequency / self.f0
        return self.k * ((1.0 - r) * (1.0 + r) + 1j * r / self.Q)


class Mode(Parameters):
    """One eigenmode of the cantilever, a point mass m = k / (2 pi f0)^2 on a spring with viscous damping."""

    f0: Number = param(unit="Hz", symbol="f_0", above="0 Hz", high="10 GHz", doc="resonance frequency without damping")
    k: Number = param(unit="N/m", symbol="k", above="0 N/m", high="1e8 N/m", doc="spring constant of the mode")
    # at 0.5 and below the mode does not oscillate by itself: no resonance, and no decay time 2Q/omega
    Q: Number = param(
        unit="1", symbol="Q", above=0.5, high=1e9, doc="quality factor; above 0.5, so that the mode oscillates"
    )
    base_coupling: MaybeNumber = param(
        None,
        unit="1",
        symbol=r"\chi",
        low=-10.0,
        high=10.0,
        doc="coupling of the base to the mode; 1 for a point mass; default: the coupling of a uniform beam",
    )
    added_mass: MaybeNumber = param(
        None, unit="1", symbol=r"\mu", low=0.0, below=1.0, doc="share of the fluid in the mode's mass; 0 in air"
    )


class HigherMode(Parameters):
    """What was measured of a higher mode; the rest is as of an ideal beam: f2 = 6.27 f1, k2 = 39.3 k1."""

    title_of: ClassVar[str] = "cantilever.higher_modes"

    f0: MaybeNumber = param(
        None, unit="Hz", symbol="f_0", above="0 Hz", high="10 GHz", doc="resonance frequency; left out: an ideal beam's"
    )
    k: MaybeNumber = param(
        None, unit="N/m", symbol="k", above="0 N/m", high="1e8 N/m", doc="spring constant; left out: an ideal beam's"
    )
    Q: MaybeNumber = param(
        None, unit="1", symbol="Q", above=0.5, high=1e9, doc="quality factor; left out: by Sader's theory in a gas"
    )


TILT = param(
    None,
    unit="rad",
    symbol=r"\alpha",
    low="0 deg",
    high="60 deg",
    doc="tilt of the lever against the sample, often 11 degrees; normal to the sample it is stiffer by 1/cos^2",
)


class Beam(Parameters):
    """A rectangular cantilever by material and size; its modes follow from Euler–Bernoulli theory.

    In a fluid, frequencies and quality factors follow from Sader's hydrodynamic function
    (:func:`dforce.instrument.beam.fluid_mode`). Valid for length far above width far above thickness.
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
    Q: Numbers = param(
        (),
        unit="1",
        symbol="Q",
        above=0.5,
        high=1e9,
        doc="quality factor of each mode (a number, or a list for several modes); default: from the medium",
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
            When Q is missing and does not follow from the medium.
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
        """Return a mode in a fluid, whose frequency in vacuum is known (Hz); over the sample if the tip's height is given."""
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


class Cantilever(Parameters):
    """The cantilever: one mode by `f0`, `k` and `Q`, several by `modes`, or a rectangular `beam`."""

    ways: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "one mode": ("name", "library", "f0", "k", "Q", "tip_radius", "base_coupling", "added_mass", "higher_modes"),
        "several modes": ("modes",),
        "a beam": ("beam",),
    }

    name: str | None = words(
        None,
        max_length=50,
        examples=list(cantilevers()),
        description="name of a cantilever, with nominal f0, k and tip radius as defaults",
    )
    library: str | None = file_name(
        None, max_length=500, through_named=True, description="your own CSV file of cantilevers"
    )
    f0: MaybeNumber = param(
        None,
        unit="Hz",
        symbol="f_0",
        above="0 Hz",
        high="10 GHz",
        doc="resonance frequency; with several modes each has its own",
    )
    k: MaybeNumber = param(
        None,
        unit="N/m",
        symbol="k",
        above="0 N/m",
        high="1e8 N/m",
        doc="spring constant; with several modes each has its own",
    )
    Q: MaybeNumber = param(
        None, unit="1", symbol="Q", above=0.5, high=1e9, doc="quality factor; with several modes each has its own"
    )
    base_coupling: MaybeNumber = param(
        None,
        unit="1",
        symbol=r"\chi",
        low=-10.0,
        high=10.0,
        doc="coupling of the base to the mode; 1 for a point mass; default: the coupling of a uniform beam",
    )
    added_mass: MaybeNumber = param(
        None, unit="1", symbol=r"\mu", low=0.0, below=1.0, doc="share of the fluid in the mode's mass; 0 in air"
    )
    tip_radius: MaybeNumber = param(
        None,
        unit="m",
        symbol="R",
        above="0 nm",
        high="1 mm",
        doc="tip radius of a cantilever by name; tip.radius replaces it",
    )
    tilt: MaybeNumber = TILT
    drift: Part[Drift | None] = part(None, description="change of Q or the free amplitude toward the sample")
    higher_modes: Part[tuple[HigherMode, ...]] = part(
        (),
        max_length=MOST_MODES - 1,
        description="modes above the first: their number, or a table of measured values for each; default values: an ideal "
        "beam",
    )
    modes: Part[tuple[Mode, ...]] = part((), max_length=MOST_MODES, description="modes, the softest first")
    beam: Part[Beam | None] = part(None, description="a rectangular cantilever, instead of its modes")

    @pydantic.model_validator(mode="before")
    @classmethod
    def _name_alone(cls, data: object) -> Any:
        return {"name": data} if isinstance(data, str) else data

    @pydantic.field_validator("higher_modes", mode="before")
    @classmethod
    def _so_many(cls, given: object) -> object:
        if isinstance(given, int) and not isinstance(given, bool):
            if not 0 <= given < MOST_MODES:
                raise ParameterError(f"= {given} is not from 0 to {MOST_MODES - 1}")
            return ({},) * given
        return given

    @pydantic.model_validator(mode="after")
    def _known_values(self) -> Self:
        if self.name is None:
            if self.library is not None:
                raise ParameterError("cantilever.library needs a name; write cantilever.name")
            return self
        if self.modes or self.beam is not None:
            other = "modes" if self.modes else "beam"
            hint = "; write measured values of higher modes under cantilever.higher_modes" if self.modes else ""
            raise ParameterError(f"cantilever has both name and {other}; write only one of them{hint}")
        if self.library is not None and self.f0 is not None and self.k is not None:
            return self  # it holds what it needs, wherever its file is
        known = cantilevers() if self.library is None else own_cantilevers(named(self.library, "cantilever.library"))
        if self.name not in known:
            raise ParameterError(f"cantilever = '{shorten(self.name)}' is not known{nearest(self.name, known)}")
        for field in ("f0", "k", "Q", "tip_radius"):
            value = getattr(known[self.name], field)
            if getattr(self, field) is None and value is not None:
                try:
                    self.quantities()[field].check(value)
                except ParameterError as error:  # of a file: those that are shipped are within bounds
                    where = f"cantilever.library = '{shorten(str(self.library))}', {shorten(self.name)}"
                    raise ParameterError(f"{where}: {field} {error}") from None
                self.__dict__[field] = value
                if self.library is not None:  # a case has to mean the same where the file is not
                    self.model_fields_set.add(field)
        return self

    @pydantic.model_validator(mode="after")
    def _one_description(self) -> Self:
        given = [name for name in self.ways["one mode"] if getattr(self, name) not in (None, ())]
        ways = [*(["f0, k, Q"] if given else []), *(["modes"] if self.modes else []), *(["beam"] if self.beam else [])]
        if self.beam is not None and self.tilt is not None:
            raise ParameterError("cantilever.tilt is for modes; for a beam write cantilever.beam.tilt")
        if self.beam is not None and self.drift is not None:
            raise ParameterError('cantilever.drift is for modes; for a beam write wall = "at_distance"')
        if len(ways) > 1:
            raise ParameterError(f"cantilever has both {ways[0]} and {ways[1]}; write only one of them")
        if not ways:
            raise ParameterError("cantilever is empty; write f0, k and Q, or a list of modes, or a beam")
        if given:
            for name in ("f0", "k", *(("Q",) if not self._has_sizes() else ())):
                self.needed(name)
        return self

    def _has_sizes(self) -> bool:
        """Whether the sizes of a shipped cantilever are known, which tell its Q in air."""
        return self.name is not None and self.library is None and cantilevers()[self.name].length is not None

    def resolve(self, medium: Medium) -> tuple[ModeNumbers, ...]:
        """Return the modes in the medium; values of `modes` count as measured in the medium.

        Raises
        ------
        ParameterError
            When a cantilever by name has no Q, and the medium is not a gas with a known Q.
        """
        if self.beam is not None:
            return self.beam.resolve(medium)
        if self.modes:
            return tuple(_measured(mode, n, mode.Q, self.tilt) for n, mode in enumerate(self.modes, start=1))
        first = _measured(self, 1, self._nominal_Q(medium) if self.Q is None else self.Q, self.tilt)
        higher = (self._higher(n, given, first, medium) for n, given in enumerate(self.higher_modes, start=2))
        return (first, *higher)

    def _higher(self, n: int, given: HigherMode, first: ModeNumbers, medium: Medium) -> ModeNumbers:
        r"""Return a higher mode: what was measured of it, the rest from the first mode of an ideal beam.

        .. math:: f_n = (\kappa_n / \kappa_1)^2 f_1, \qquad k_n = (\kappa_n / \kappa_1)^4 k_1, \qquad
                  Q_n = Q_1\, \Gamma_i(f_1) / \Gamma_i(f_n)

        All modes of such a beam move the same mass, so that k goes as the square of f. The ratio of the frequencies is
        rounded to a simple one, 94/15 for mode 2, by less than 1e-4: tones on the modes then repeat together.
        """
        ratio, path = (beam.wavenumber(n) / beam.wavenumber(1)) ** 2, f"cantilever.higher_modes.{n - 1}"
        simple = Fraction(ratio).limit_denominator(LONGEST_REPEAT)
        if given.f0 is None and medium.density and medium.density > DENSEST:
            raise ParameterError(f"{path}.f0 is missing: the ratio of an ideal beam holds in air; give f0 as measured")
        f0 = float(simple) * first.f0 if given.f0 is None else given.f0
        k = ratio**2 * first.k if given.k is None else given.k * normal_factor(self.tilt)
        shipped = self.name is not None and self.library is None
        width = cantilevers()[str(self.name)].width if shipped else None
        Q = given.Q
        if Q is None:
            if not (width and medium.density and medium.viscosity) or medium.density > DENSEST:
                why = "" if width else ": the width of the lever is not known"
                air = ', or write medium = "air"' if width else ""
                raise ParameterError(f"{path}.Q (quality factor of mode {n}) is missing{why}; give Q as measured{air}")
            damping = [
                beam.hydrodynamic_function(beam.reynolds_number(f, width, medium.density, medium.viscosity)).imag
                for f in (first.f0, f0)
            ]
            Q = first.Q * damping[0] / damping[1]
        return ModeNumbers(f0, k, Q, beam.base_coupling(n))

    def _nominal_Q(self, medium: Medium) -> float:
        """Return Q in a gas from nominal f0, k and sizes, by Sader's theory."""
        probe = cantilevers()[str(self.name)]
        if not medium.density or not medium.viscosity:
            raise ParameterError(
                f'cantilever.Q is missing, and {self.name} has no nominal Q; write Q, or medium = "air"'
            )
        if medium.density > DENSEST:
            raise ParameterError(
                f"f0 of {self.name} is nominal in air, and a liquid lowers f0 and Q: write f0 and Q measured in the liquid"
            )
        length, width = float(probe.length or 0.0), float(probe.width or 0.0)
        at_one = beam.sader_stiffness(self.needed("f0"), 1.0, length, width, medium.density, medium.viscosity)
        return self.needed("k") / at_one


def normal_factor(tilt: float | None) -> float:
    r"""Return by how much a lever that is tilted (rad) is stiffer across the sample than across itself.

    .. math:: \frac{k_\perp}{k} = \frac{1}{\cos^2 \alpha}

    Source: L.-O. Heim, M. Kappl, H.-J. Butt, Langmuir 20, 2760 (2004), without the moment of the tip's height.
    """
    return 1.0 / math.cos(tilt or 0.0) ** 2


def _measured(given: Mode | Cantilever, n: int, Q: float, tilt: float | None) -> ModeNumbers:
    """Return a mode that was given by its numbers."""
    coupling = beam.base_coupling(n) if given.base_coupling is None else given.base_coupling
    k = given.needed("k") * normal_factor(tilt)
    return ModeNumbers(given.needed("f0"), k, Q, coupling, given.added_mass)
