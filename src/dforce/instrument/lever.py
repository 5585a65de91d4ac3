"""The lever: modes as they were measured, or a rectangular beam."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, ClassVar, Self

import pydantic

from dforce.core.errors import ParameterError, nearest, shorten
from dforce.core.files import named
from dforce.core.marks import file_name, words
from dforce.core.parameters import MaybeNumber, Number, Parameters, Part, param, part
from dforce.instrument import beam
from dforce.instrument.beam_lever import Beam
from dforce.instrument.drift import Drift
from dforce.instrument.medium import Medium
from dforce.instrument.modes import MOST_MODES, TILT, ModeNumbers, normal_factor, quality
from dforce.library.cantilevers import Probe, cantilevers, own_cantilevers

LONGEST_REPEAT = 15  # periods of mode 1 after which it and an ideal higher mode repeat together
DENSEST = 50.0  # kg/m^3, of a gas: nominal frequencies hold in air

resonance = functools.partial(param, unit="Hz", symbol="f_0", above="0 Hz", high="10 GHz")
stiffness = functools.partial(param, unit="N/m", symbol="k", above="0 N/m", high="1e8 N/m")
COUPLING = param(
    None,
    unit="1",
    symbol=r"\chi",
    low=-10.0,
    high=10.0,
    doc="coupling of the base to the mode; 1 for a point mass; default: the coupling of a uniform beam",
)
ADDED_MASS = param(
    None, unit="1", symbol=r"\mu", low=0.0, below=1.0, doc="share of the fluid in the mode's mass; 0 in air"
)


class Mode(Parameters):
    """One eigenmode of the cantilever: a point mass k / (2 pi f0)^2 on a spring k, with viscous damping."""

    f0: Number = resonance(doc="resonance frequency without damping")
    k: Number = stiffness(doc="spring constant of the mode")
    Q: Number = quality(doc="quality factor; above 0.5, so that the mode oscillates")
    base_coupling: MaybeNumber = COUPLING
    added_mass: MaybeNumber = ADDED_MASS


class HigherMode(Parameters):
    """Measured values of a higher mode; default: an ideal beam, f2 = 6.27 f1, k2 = 39.3 k1."""

    title_of: ClassVar[str] = "cantilever.higher_modes"

    f0: MaybeNumber = resonance(None, doc="resonance frequency; default: from an ideal beam")
    k: MaybeNumber = stiffness(None, doc="spring constant; default: from an ideal beam")
    Q: MaybeNumber = quality(None, doc="quality factor; default: by Sader's theory, in a gas")


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
    f0: MaybeNumber = resonance(None, doc="resonance frequency; with several modes each has its own")
    k: MaybeNumber = stiffness(None, doc="spring constant; with several modes each has its own")
    Q: MaybeNumber = quality(None, doc="quality factor; with several modes each has its own")
    base_coupling: MaybeNumber = COUPLING
    added_mass: MaybeNumber = ADDED_MASS
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
                raise ParameterError("cantilever.library is a file of levers; write the name of one as cantilever.name")
            return self
        if self.modes or self.beam is not None:
            other = "modes" if self.modes else "beam"
            hint = "; write measured values of higher modes under cantilever.higher_modes" if self.modes else ""
            raise ParameterError(f"cantilever has both name and {other}; write only one of them{hint}")
        if self.library is not None and self.f0 is not None and self.k is not None:
            return self  # it already has the values of its file
        known = cantilevers() if self.library is None else own_cantilevers(named(self.library, "cantilever.library"))
        if self.name not in known:
            hint = nearest(self.name[:100], known, "" if self.library else "dforce cantilevers")
            raise ParameterError(f"cantilever = '{shorten(self.name)}' is not known: write f0 and k, or a name{hint}")
        for field in ("f0", "k", "Q", "tip_radius"):
            value = getattr(known[self.name], field)
            if getattr(self, field) is None and value is not None:
                try:
                    self.quantities()[field].check(value)
                except ParameterError as error:  # of a user's file: shipped files are within bounds
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
            for name in ("f0", "k", *(() if self.sizes else ("Q",))):  # the sizes give Q in air
                self.needed(name)
        return self

    @property
    def sizes(self) -> tuple[float, float] | None:
        """Length and width (m) of a beam or a shipped cantilever; None if they are unknown."""
        known: Beam | Probe | None = self.beam
        if self.name is not None and self.library is None:
            known = cantilevers()[self.name]
        return None if known is None or not known.length or not known.width else (known.length, known.width)

    @property
    def normal_factor(self) -> float:
        """Ratio of spring constants of a tilted lever: along the normal of the sample over along its own normal."""
        return normal_factor(self.tilt if self.beam is None else self.beam.tilt)

    def resolve(self, medium: Medium) -> tuple[ModeNumbers, ...]:
        """Return the modes in the medium; values of `modes` count as measured in the medium.

        Raises
        ------
        ParameterError
            When a Q is missing and does not follow from the medium, or a higher mode has no f0 in a liquid.
        """
        if self.beam is not None:
            return self.beam.resolve(medium)
        if self.modes:
            return tuple(_measured(mode, n, mode.Q, self.tilt) for n, mode in enumerate(self.modes, start=1))
        first = _measured(self, 1, self._nominal_Q(medium) if self.Q is None else self.Q, self.tilt)
        higher = (self._higher(n, given, first, medium) for n, given in enumerate(self.higher_modes, start=2))
        return (first, *higher)

    def _higher(self, n: int, given: HigherMode, first: ModeNumbers, medium: Medium) -> ModeNumbers:
        r"""Return a higher mode: its measured values, the others from the first mode of an ideal beam.

        .. math:: f_n = (\kappa_n / \kappa_1)^2 f_1, \qquad k_n = (\kappa_n / \kappa_1)^4 k_1, \qquad
                  Q_n = Q_1\, \Gamma_i(f_1) / \Gamma_i(f_n)

        All modes of such a beam move the same mass, so that k goes as the square of f. The ratio of the frequencies is
        rounded to a simple one, 94/15 for mode 2, by less than 1e-4: tones on the modes then repeat together.
        """
        ratio, path = (beam.wavenumber(n) / beam.wavenumber(1)) ** 2, f"cantilever.higher_modes.{n - 1}"
        simple = Fraction(ratio).limit_denominator(LONGEST_REPEAT)
        if given.f0 is None and medium.density and medium.density > DENSEST:
            raise ParameterError(
                f"{path}.f0 is missing: the ratio of an ideal beam is valid only in air; write the measured f0"
            )
        f0 = float(simple) * first.f0 if given.f0 is None else given.f0
        k = ratio**2 * first.k if given.k is None else given.k * self.normal_factor
        width, Q = self.sizes[1] if self.sizes else None, given.Q
        if Q is None:
            if not (width and medium.density and medium.viscosity) or medium.density > DENSEST:
                why = "" if width else ": the width of the lever is not known"
                air = ', or write medium = "air"' if width else ""
                raise ParameterError(
                    f"{path}.Q (quality factor of mode {n}) is missing{why}; write the measured Q{air}"
                )
            damping = [
                beam.hydrodynamic_function(beam.reynolds_number(f, width, medium.density, medium.viscosity)).imag
                for f in (first.f0, f0)
            ]
            Q = first.Q * damping[0] / damping[1]
        return ModeNumbers(f0, k, Q, beam.base_coupling(n))

    def _nominal_Q(self, medium: Medium) -> float:
        """Return Q in a gas from nominal f0, k and sizes, by Sader's theory."""
        if not medium.density or not medium.viscosity:
            raise ParameterError(
                f'cantilever.Q is missing, and {self.name} has no nominal Q; write Q, or medium = "air"'
            )
        if medium.density > DENSEST:
            raise ParameterError(
                f"f0 of {self.name} is nominal in air, and a liquid lowers f0 and Q: write f0 and Q measured in the liquid"
            )
        assert self.sizes is not None  # or Q were asked for
        at_one = beam.sader_stiffness(self.needed("f0"), 1.0, *self.sizes, medium.density, medium.viscosity)
        return self.needed("k") / at_one


def _measured(given: Mode | Cantilever, n: int, Q: float, tilt: float | None) -> ModeNumbers:
    """Return a mode from its measured numbers."""
    coupling = beam.base_coupling(n) if given.base_coupling is None else given.base_coupling
    k = given.needed("k") * normal_factor(tilt)
    return ModeNumbers(given.needed("f0"), k, Q, coupling, given.added_mass)
