"""The instrument: cantilever, drive, tip, sample, contact and medium, as a user describes them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self

import pydantic

from dforce import beam, library, units
from dforce.errors import ParameterError, nearest, shorten
from dforce.parameters import MaybeNumber, Number, Numbers, Parameters, Part, param, part

# J. N. Israelachvili, Intermolecular and Surface Forces, Academic Press (2011)
A0_DEFAULT = "0.165 nm"
MOST_MODES = 10


@dataclass(frozen=True)
class ModeNumbers:
    """One mode: resonance frequency `f0` (Hz), spring constant `k` (N/m) and quality factor `Q`."""

    f0: float
    k: float
    Q: float


@dataclass(frozen=True)
class ToneNumbers:
    """One tone of the drive.

    Attributes
    ----------
    frequency
        Hz.
    phase
        Phase at time zero (rad).
    A0
        Free amplitude of its mode (m).
    mode
        Its mode, counted from 0.
    force
        Amplitude of the driving force (N).
    """

    frequency: float
    phase: float
    A0: float
    mode: int
    force: float


def drive_force(mode: ModeNumbers, A0: float, frequency: float) -> float:
    r"""Return the force (N) that moves a free mode by the amplitude `A0` (m) at a frequency (Hz).

    .. math:: F = k A_0 \sqrt{(1 - r^2)^2 + (r / Q)^2}, \qquad r = \omega / \omega_0

    which is :math:`k A_0 / Q` at resonance.
    """
    r = frequency / mode.f0
    return mode.k * A0 * math.hypot((1.0 - r) * (1.0 + r), r / mode.Q)


class Medium(Parameters):
    """What the cantilever moves in: a name (`medium = "water"`), numbers, or a name and some numbers."""

    name: str | None = pydantic.Field(
        default=None,
        max_length=50,
        examples=sorted(library.media()),
        description="a known medium: air, water or vacuum, with its values at 298.15 K",
    )
    density: MaybeNumber = param(None, unit="kg/m^3", symbol=r"\rho", low=0.0, high=1e5, doc="density of the fluid")
    viscosity: MaybeNumber = param(None, unit="Pa s", symbol=r"\mu", low=0.0, high=1e6, doc="viscosity of the fluid")
    permittivity: MaybeNumber = param(
        None,
        unit="1",
        symbol=r"\epsilon",
        low=1.0,
        high=1e6,
        doc="relative permittivity between tip and sample",
    )
    temperature: Number = param(
        "298.15 K", symbol="T", above="0 K", high="1e4 K",
        doc="temperature; the values of a medium known by name stay those at 298.15 K",
    )  # fmt: skip

    @pydantic.model_validator(mode="before")
    @classmethod
    def _name_alone(cls, data: Any) -> Any:
        return {"name": data} if isinstance(data, str) else data

    @pydantic.model_validator(mode="after")
    def _known_values(self) -> Self:
        if self.name is None:
            return self
        known = library.media()
        if self.name not in known:
            raise ParameterError(f"medium = '{shorten(self.name)}' is not known{nearest(self.name, known)}")
        for field in ("density", "viscosity", "permittivity"):
            if getattr(self, field) is None:
                # not marked as given by the user, so that a case written to a file keeps the name alone
                self.__dict__[field] = units.parse(known[self.name][field], self.quantities()[field].unit)
        return self


class Mode(Parameters):
    """One eigenmode of the cantilever, a point mass m = k / (2 pi f0)^2 on a spring with viscous damping."""

    f0: Number = param(unit="Hz", symbol="f_0", above="0 Hz", high="10 GHz", doc="resonance frequency without damping")
    k: Number = param(unit="N/m", symbol="k", above="0 N/m", high="1e8 N/m", doc="spring constant of the mode")
    # at 0.5 and below the mode does not oscillate by itself: no resonance, and no decay time 2Q/omega
    Q: Number = param(
        unit="1",
        symbol="Q",
        above=0.5,
        high=1e9,
        doc="quality factor; above 0.5, so that the mode oscillates",
    )


class Beam(Parameters):
    """A rectangular cantilever by material and size; its modes follow from Euler–Bernoulli theory.

    In a fluid, frequencies and quality factors follow from Sader's hydrodynamic function
    (:func:`dforce.beam.fluid_mode`). Valid for length far above width far above thickness.
    """

    title_of: ClassVar[str] = "cantilever.beam"
    # silicon along <110>: M. A. Hopcroft, W. D. Nix, T. W. Kenny, J. Microelectromech. Syst. 19, 229 (2010)
    example: ClassVar[Mapping[str, Any]] = {
        "youngs_modulus": "169 GPa", "density": "2330 kg/m^3", "length": "225 um", "width": "30 um", "thickness": "3 um",
    }  # fmt: skip

    youngs_modulus: Number = param(
        unit="Pa", symbol="E", above="0 GPa", high="10 TPa", doc="Young's modulus of the beam"
    )
    density: Number = param(unit="kg/m^3", symbol=r"\rho_c", above=0.0, high=1e5, doc="density of the beam")
    length: Number = param(unit="m", symbol="L", above="0 um", high="0.1 m", doc="length of the beam")
    width: Number = param(unit="m", symbol="b", above="0 um", high="0.1 m", doc="width of the beam")
    thickness: Number = param(unit="m", symbol="h", above="0 um", high="0.1 m", doc="thickness of the beam")
    modes: int = pydantic.Field(default=1, ge=1, le=MOST_MODES, description="number of flexural modes that take part")
    Q: Numbers = param(
        (), unit="1", symbol="Q", above=0.5, high=1e9,
        doc="quality factor of each mode (a number, or a list for several modes); left out: from the medium",
    )  # fmt: skip

    @pydantic.field_validator("Q", mode="before")
    @classmethod
    def _one_or_many(cls, given: Any) -> Any:
        return given if isinstance(given, list | tuple) else (given,)

    @pydantic.model_validator(mode="after")
    def _a_Q_for_each(self) -> Self:
        if self.Q and len(self.Q) != self.modes:
            raise ParameterError(
                f"cantilever.beam.Q has {len(self.Q)} values for {self.modes} modes; give one for each"
            )
        return self

    def resolve(self, medium: Medium) -> tuple[ModeNumbers, ...]:
        """Return the modes in a medium; in a fluid f0 is by Sader's theory, and so is Q unless it is given.

        Raises
        ------
        ParameterError
            When Q is not given and the medium does not tell it.
        """
        return tuple(self._mode(n, medium) for n in range(1, self.modes + 1))

    def _mode(self, n: int, medium: Medium) -> ModeNumbers:
        free = beam.vacuum_mode(n, self.youngs_modulus, self.density, self.length, self.width, self.thickness)
        f0, Q = free.frequency, self.Q[n - 1] if self.Q else math.nan
        if medium.density and medium.viscosity:
            wet = beam.fluid_mode(
                free.frequency, self.density, self.width, self.thickness, medium.density, medium.viscosity
            )
            f0, Q = wet.frequency, self.Q[n - 1] if self.Q else wet.Q
        elif not self.Q:
            why = "vacuum does not damp the beam" if medium.name == "vacuum" else "no fluid is given"
            raise ParameterError(f'cantilever.beam.Q is missing, and {why}; give Q, or write medium = "air"')
        if Q <= 0.5:
            raise ParameterError(f"mode {n} of cantilever.beam has Q = {Q:.3g} in this medium; it must be above 0.5")
        return ModeNumbers(f0, free.stiffness, Q)


class Cantilever(Parameters):
    """The cantilever: one mode by `f0`, `k` and `Q`, several by `modes`, or a rectangular `beam`."""

    ways: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "one mode": ("f0", "k", "Q"), "several modes": ("modes",), "a beam": ("beam",),
    }  # fmt: skip

    f0: MaybeNumber = param(
        None,
        unit="Hz",
        symbol="f_0",
        above="0 Hz",
        high="10 GHz",
        doc="resonance frequency; of several modes each has its own",
    )
    k: MaybeNumber = param(
        None,
        unit="N/m",
        symbol="k",
        above="0 N/m",
        high="1e8 N/m",
        doc="spring constant; of several modes each has its own",
    )
    Q: MaybeNumber = param(
        None, unit="1", symbol="Q", above=0.5, high=1e9, doc="quality factor; of several modes each has its own"
    )
    modes: Part[tuple[Mode, ...]] = part((), max_length=MOST_MODES, description="modes, the softest first")
    beam: Part[Beam | None] = part(None, description="a rectangular cantilever, instead of its modes")

    @pydantic.model_validator(mode="after")
    def _one_description(self) -> Self:
        given = [name for name in ("f0", "k", "Q") if getattr(self, name) is not None]
        ways = [
            *(["f0, k, Q"] if given else []),
            *(["modes"] if self.modes else []),
            *(["beam"] if self.beam else []),
        ]
        if len(ways) > 1:
            raise ParameterError(f"cantilever has both {ways[0]} and {ways[1]}; give only one of them")
        if not ways:
            raise ParameterError("cantilever is empty; give f0, k and Q, or a list of modes, or a beam")
        if given:
            for name in ("f0", "k", "Q"):
                self.needed(name)
        return self

    def resolve(self, medium: Medium) -> tuple[ModeNumbers, ...]:
        """Return the modes as they are in the medium; given modes are taken as measured there."""
        if self.beam is not None:
            return self.beam.resolve(medium)
        if self.modes:
            return tuple(ModeNumbers(mode.f0, mode.k, mode.Q) for mode in self.modes)
        return (ModeNumbers(self.needed("f0"), self.needed("k"), self.needed("Q")),)


class Tone(Parameters):
    """One tone of the drive, by the free amplitude that it gives its mode."""

    A0: Number = param(
        unit="m", symbol="A_0", above="0 nm", high="1 mm", doc="free amplitude of its mode at its frequency"
    )
    frequency: MaybeNumber = param(
        None,
        unit="Hz",
        symbol="f",
        above="0 Hz",
        high="10 GHz",
        doc="drive frequency; left out: the f0 of its mode",
    )
    mode: int | None = pydantic.Field(
        default=None,
        ge=1,
        le=MOST_MODES,
        description="mode that A0 is meant for, from 1; left out: the tone's place in the list",
    )
    phase: Number = param(
        "0 deg", symbol=r"\theta", low="-360 deg", high="360 deg", doc="phase of the tone at time zero"
    )


class Drive(Parameters):
    """The drive, a force at the tip: one tone by `A0` (`frequency`, `mode`, `phase`), or `tones`."""

    ways: ClassVar[Mapping[str, tuple[str, ...]]] = {
        "one tone": ("A0", "frequency", "mode", "phase"), "several tones": ("tones",),
    }  # fmt: skip

    A0: MaybeNumber = param(
        None, unit="m", symbol="A_0", above="0 nm", high="1 mm", doc="free amplitude; of several tones each has its own"
    )
    frequency: MaybeNumber = param(
        None,
        unit="Hz",
        symbol="f",
        above="0 Hz",
        high="10 GHz",
        doc="drive frequency; left out: the f0 of its mode",
    )
    mode: int | None = pydantic.Field(
        default=None, ge=1, le=MOST_MODES, description="mode that is driven, from 1; left out: 1"
    )
    phase: Number = param(
        "0 deg", symbol=r"\theta", low="-360 deg", high="360 deg", doc="phase of the drive at time zero"
    )
    tones: Part[tuple[Tone, ...]] = part((), max_length=MOST_MODES, description="tones, instead of a single one")
    acts_on: Literal["all_modes", "own_mode"] = pydantic.Field(
        default="all_modes",
        title="A tone acts on",
        description="all_modes: a tone is a force on the tip, so on every mode; own_mode: only on its own",
    )

    @pydantic.model_validator(mode="after")
    def _one_description(self) -> Self:
        single = [name for name in ("A0", "frequency", "mode", "phase") if getattr(self, name)]
        if self.tones and single:
            raise ParameterError(f"drive has both {single[0]} and tones; give only one of them")
        if not self.tones:
            self.needed("A0")
        return self

    def resolve(self, modes: tuple[ModeNumbers, ...]) -> tuple[ToneNumbers, ...]:
        """Return the tones with mode, frequency and force filled in.

        Raises
        ------
        ParameterError
            When a tone is meant for a mode that the cantilever does not have.
        """
        if self.tones:
            return tuple(
                _tone(f"drive.tones.{place}.mode", tone.A0, tone, tone.mode or place, modes)
                for place, tone in enumerate(self.tones, start=1)
            )
        return (_tone("drive.mode", self.needed("A0"), self, self.mode or 1, modes),)


def _tone(path: str, A0: float, given: Tone | Drive, mode: int, modes: tuple[ModeNumbers, ...]) -> ToneNumbers:
    if mode > len(modes):
        count = "1 mode" if len(modes) == 1 else f"{len(modes)} modes"
        raise ParameterError(f"{path} = {mode}, but the cantilever has only {count}")
    own = modes[mode - 1]
    frequency = own.f0 if given.frequency is None else given.frequency
    return ToneNumbers(frequency, given.phase, A0, mode - 1, drive_force(own, A0, frequency))


class Tip(Parameters):
    """The tip; without a Young's modulus it is rigid."""

    radius: MaybeNumber = param(None, unit="m", symbol="R", above="0 nm", high="1 mm", doc="radius of the tip's apex")
    youngs_modulus: MaybeNumber = param(
        None,
        unit="Pa",
        symbol="E_t",
        above="0 GPa",
        high="10 TPa",
        doc="Young's modulus of the tip; left out: rigid",
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


class Sample(Parameters):
    """The sample; flat and thick, unless a model asks for a thickness or a radius."""

    youngs_modulus: MaybeNumber = param(
        None, unit="Pa", symbol="E_s", above="0 GPa", high="10 TPa", doc="Young's modulus of the sample"
    )
    poisson_ratio: Number = param(
        0.3, unit="1", symbol=r"\nu_s", low=0.0, high=0.5, doc="Poisson's ratio of the sample"
    )
    thickness: MaybeNumber = param(
        None,
        unit="m",
        symbol="h_s",
        above="0 nm",
        high="1 m",
        doc="thickness of a thin sample on a stiff support",
    )
    radius: MaybeNumber = param(
        None, unit="m", symbol="R_s", above="0 nm", high="1 m", doc="radius of a spherical sample"
    )


class Contact(Parameters):
    """Where contact begins, the same for all forces."""

    a0: Number = param(
        A0_DEFAULT,
        symbol="a_0",
        above="0 nm",
        high="10 nm",
        doc="intermolecular distance; contact is at d < a0",
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
