"""A case: everything that a run depends on; a file, a Python object and a schema, without loss."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Self

import pydantic

from dforce.case._fit import Data, Fit
from dforce.case._html import html_of
from dforce.case._python import script_of
from dforce.case._sweep import Sweep
from dforce.case._text import text_of, value_of
from dforce.case._volts import without_volts
from dforce.case.paths import changed, place_of, quantity_at
from dforce.core import units
from dforce.core.errors import CaseError, ParameterError, checked, nearest, shorten
from dforce.core.files import beside, folder
from dforce.core.marks import file_name, words
from dforce.core.parameter_quantity import ParameterQuantity
from dforce.core.parameters import Parameters, Part, part
from dforce.core.refusals import refusal
from dforce.core.toml import read_toml
from dforce.experiments import EXPERIMENTS, Experiment
from dforce.forces import REGISTRY, Force, load_plugin
from dforce.instrument import Cantilever, Contact, Drive, Medium, Noise, Readout, Sample, Tip
from dforce.observables.averaging import common_period
from dforce.problem import Instrument, Problem
from dforce.solvers import SolverSettings

MOST_FORCES = 20
NOT_TOML = "the case is not TOML"
THERMAL = ("dwell", "thermal_spectrum")  # experiments that simulate thermal motion
NAMING = ("title", "about")  # sections that describe a case, without effect on its numbers
SHOWN = (
    "cantilever",
    "drive",
    "readout",
    "tip",
    "sample",
    "contact",
    "medium",
    "noise",
    "forces",
    "experiment",
    "solver",
)  # sections of a notebook's table, in this order


class About(Parameters):
    """Source and purpose of a case, in words; without effect on a run."""

    source: str = words("", max_length=4000, description="source of the parameters")
    shows: str = words("", max_length=4000, description="one sentence on the purpose of the case")
    unsaid: str = words("", max_length=4000, description="values missing in the source, and their choice")


class Case(Parameters):
    """A whole case: instrument, forces, experiment and solver.

    Every section is an object (:class:`dforce.Tip`) or a table (a dict with the same keys). A case is frozen and checked as a
    whole. :attr:`problem` is the case in SI with all defaults.

    Raises
    ------
    ParameterError
        With one sentence that names the path of the value at fault.
    ForceError
        When a file in `plugins` fails or breaks the contract of :class:`dforce.Force`.
    """

    title_of: ClassVar[str] = "case"
    hints: ClassVar[Mapping[str, str]] = {
        "tones": "write [[drive.tones]]",
        "modes": "write [[cantilever.modes]]",
        "excitation": 'write excitation = "base" under [drive]',
        "lever": "write [cantilever]",
        "material": "write sample",
    }

    title: str = words("", max_length=300, description="title of the case, in a line")
    plugins: Part[tuple[str, ...]] = file_name(
        (), max_length=20, description="Python files with force models of your own, beside the case file"
    )
    about: Part[About | None] = part(None, description="source and purpose of the case, and chosen values")
    cantilever: Part[Cantilever] = pydantic.Field(description="the cantilever: one mode, several, or a beam")
    drive: Part[Drive] = pydantic.Field(description="the drive: one tone or several")
    readout: Part[Readout] = part(Readout(), description="the detector: its signal from the motion")
    tip: Part[Tip] = part(Tip(), description="the tip")
    sample: Part[Sample] = part(Sample(), description="the sample")
    contact: Part[Contact] = part(Contact(), description="where contact begins")
    medium: Part[Medium] = part(Medium(), description="the medium: a name or a table")
    noise: Part[Noise] = part(Noise(), description="noise of the lever and of the detector")
    forces: Part[tuple[Force, ...]] = part((), max_length=MOST_FORCES, description="tip–sample forces; they add up")
    experiment: Part[Experiment | None] = part(None, description="the experiment: its kind and settings")
    solver: Part[SolverSettings] = part(SolverSettings(), description="settings of the solver")
    sweep: Part[Sweep | None] = part(None, description="parameters that `dforce sweep` varies, for many cases at once")
    data: Part[Data | None] = part(None, description="a measured curve for `dforce fit`")
    fit: Part[Fit | None] = part(None, description="parameters that `dforce fit` finds from a measured curve")

    @classmethod
    def root(cls) -> str:
        """Return an empty prefix: paths in messages start at the sections of the case."""
        return ""

    @pydantic.model_validator(mode="before")
    @classmethod
    def _volts_to_meters(cls, given: object) -> Any:
        return without_volts(given) if isinstance(given, dict) else given

    @pydantic.field_validator("plugins", mode="after")
    @classmethod
    def _run_plugins(cls, paths: tuple[str, ...]) -> tuple[str, ...]:
        for path in paths:
            load_plugin(path)
        return paths

    @pydantic.field_validator("forces", mode="before")
    @classmethod
    def _forces_by_model(cls, given: object) -> Any:
        if isinstance(given, Force | dict) or not isinstance(given, Iterable) or isinstance(given, str):
            raise ParameterError(f"= {shorten(given)} is not a list of forces; write [[forces]] in a file")
        items = list(itertools.islice(given, MOST_FORCES + 1))
        if len(items) > MOST_FORCES:
            raise ParameterError(f"has more than {MOST_FORCES} forces")
        models = [item.get("model") if isinstance(item, dict) else None for item in items]
        return tuple(
            _built(item, "model", REGISTRY, f"forces.{model if models.count(model) == 1 else place}", f"forces.{place}")
            for place, (item, model) in enumerate(zip(items, models, strict=True), start=1)
        )

    @pydantic.field_validator("experiment", mode="before")
    @classmethod
    def _experiment_by_kind(cls, given: object) -> Any:
        return None if given is None else _built(given, "kind", EXPERIMENTS, "experiment", "experiment", keep=True)

    @pydantic.model_validator(mode="after")
    def _makes_sense(self) -> Self:
        _ = self.folder, self.problem
        if self.experiment is not None:
            self.experiment.check(self.problem)
        kind = "" if self.experiment is None else self.experiment.kind
        if self.solver.integrator == "langevin" and kind not in ("", *THERMAL):
            raise ParameterError(
                f"solver.integrator = langevin simulates a dwell, not {kind}; df.noise computes the noise along a "
                "curve without simulation"
            )
        if self.solver.integrator == "langevin" and not self.noise.thermal:
            raise ParameterError(
                "solver.integrator = langevin simulates thermal motion, but noise.thermal = false; choose rk4 for motion "
                "without noise"
            )
        if self.solver.method != "periodic":
            self.problem.refuse_lock(f"solver.method = {self.solver.method}")
        if self.experiment is not None and self.solver.method == "periodic":
            self._refuse_other_periods(self.experiment)
            self._refuse_late_surface()
        self._refuse_low_tip()
        for path in self.sweep.over if self.sweep is not None else ():
            place_of(self, path)
        return self

    def _refuse_other_periods(self, experiment: Experiment) -> None:
        """Raise :class:`ParameterError` where a force alternates, but does not repeat after a period of the drive."""
        tones = [tone.frequency for tone in self.problem.tones]
        common = common_period(tones)
        for force in self.problem.forces:
            own = force.own_frequency
            if own is None or common is None:  # where the tones never repeat together, motions are found in time
                continue
            if experiment.path.endswith(("frequency", "f0")) or common_period([*tones, own]) != common:
                raise ParameterError(
                    f"the force {force.name} alternates at {units.show(own, 'Hz')}, so the motion does not repeat with the "
                    'drive; write solver.method = "transient"'
                )

    def _refuse_late_surface(self) -> None:
        """Raise :class:`ParameterError` where the surface of the sample does not return from tap to tap."""
        force = self.problem.late_surface
        if force is not None and self.solver.integrator != "langevin":
            takes = f"takes {units.show(force.recovery_time, 's', 3)} to return"
            raise ParameterError(
                f"the surface of {force.name} {takes if math.isfinite(force.recovery_time) else 'never returns'}, so each tap "
                'deepens it and no motion repeats: raise the relaxed modulus, or write solver.method = "transient"'
            )

    def _refuse_low_tip(self) -> None:
        """Raise :class:`ParameterError` where the lever over a wall comes to other heights than its fluid is known for."""
        beam, A0 = self.cantilever.beam, sum(tone.A0 for tone in self.problem.tones)
        if beam is None or beam.tip_height is None or self.experiment is None:
            return
        places = None if beam.wall == "at_distance" else self.experiment.range_of_zc(self.problem)
        way = A0 + (max(map(abs, places)) if places else 0.0)
        if beam.tip_height <= way:
            raise ParameterError(
                f"cantilever.beam.tip_height = {units.show(beam.tip_height, 'm', 4)} is not above the path of the tip, "
                f'{units.show(way, "m", 4)}: write cantilever.beam.wall = "at_distance", or use smaller distances'
            )

    @property
    def instrument(self) -> Instrument:
        """The sections of the instrument, without forces and noise."""
        return Instrument(self.cantilever, self.drive, self.tip, self.sample, self.contact, self.medium, self.readout)

    @functools.cached_property
    def problem(self) -> Problem:
        """The problem in SI units, every default filled in."""
        return Problem.build(self.instrument, self.forces, self.noise)

    @functools.cached_property
    def folder(self) -> Path | None:
        """The folder in which its plug-ins, the rows of its sweep and its measured curve are; None without all of them."""
        rows, curve = self.sweep is not None and self.sweep.rows, self.data is not None and self.data.file
        return folder() if self.plugins or rows or curve else None

    @checked
    def replace(self, path: str | None = None, value: object = None, **changes: Any) -> Self:
        """Return a new case with one value changed, validated again.

        The description (`about`) belongs to the old case: any change except the title removes it, unless you pass a new one.

        Parameters
        ----------
        path
            Path with dots: ``"sample.youngs_modulus"``, ``"forces.dmt.hamaker"`` or ``"forces.1.hamaker"``,
            ``"cantilever.modes.2.Q"``. Lists count from 1; a single mode or tone may be left out of the path
            (``"cantilever.Q"``).
        value
            A number in SI, text with a unit, a table or an object.
        **changes
            Whole sections by name.

        Raises
        ------
        ParameterError
            For an unknown path, with the nearest path, or for a value that is not allowed.
        """
        return self._with([] if path is None else [(path, value)], changes)

    def _with(self, assignments: list[tuple[str, Any]], sections: dict[str, Any]) -> Self:
        """Return the case with other values and sections, and with its description as long as that is true of it."""
        with beside(self.folder):
            new = type(self)(**(changed(self, assignments) | sections))
        given_anew = "about" in {path.partition(".")[0] for path in (*sections, *(path for path, _ in assignments))}
        same = all(getattr(new, name) == getattr(self, name) for name in type(self).model_fields if name not in NAMING)
        return new if given_anew or same else new.model_copy(update={"about": None})

    @checked
    def quantity(self, path: str) -> ParameterQuantity:
        """Return unit, symbol, meaning and bounds of the number at a path (see :meth:`replace`).

        Raises
        ------
        ParameterError
            For an unknown path, with the nearest path, or for a path without a number.
        """
        return quantity_at(self, path)

    @checked
    def set(self, *assignments: str) -> Self:
        """Return a new case after assignments like ``"sample.youngs_modulus=2 GPa"``, as on a command line.

        The description (`about`) is removed as in :meth:`replace`. A value is read as TOML if it is valid TOML (``5``,
        ``true``, ``["9 nm", "1 nm"]``), else as text.

        Raises
        ------
        ParameterError
            For text without a path or an equals sign, and as in :meth:`replace`.
        """
        pairs = []
        for assignment in assignments:
            path, equals, text = assignment.partition("=")
            if not equals or not path.strip():
                raise ParameterError(f"'{shorten(assignment)}' is not an assignment; write path=value")
            pairs.append((path.strip(), value_of(text.strip())))
        return self._with(pairs, {})

    def _other_way(self, name: str) -> str:
        return f"case.replace({name}=...) gives a changed copy"

    def __repr__(self) -> str:
        """Show a case in a line; :meth:`to_toml` has all of it."""
        modes, tones = self.problem.modes, self.problem.tones
        levers = [f"{units.show(m.f0, 'Hz', 4)}, {units.show(m.k, 'N/m', 4)}, Q {m.Q:.4g}" for m in modes]
        amplitudes = ", ".join(units.show(tone.A0, "m", 4) for tone in tones)
        forces = " + ".join(force.name for force in self.forces) or "no force"
        parts = [" and ".join(levers), f"A0 {amplitudes}", forces, *([self.experiment.kind] if self.experiment else [])]
        return f"<Case {shorten(self.title)!r}: {'; '.join(parts)}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """Show the parameters in a notebook: symbol, value with unit, meaning; defaults in gray."""
        shows = self.about.shows if self.about is not None and self.about.shows else ""
        return html_of(self.title, shows, {name: getattr(self, name) for name in SHOWN})

    @checked
    def to_toml(self, complete: bool = False) -> str:
        """Return the case as the text of a case file; :meth:`from_toml` reads it back as an equal case.

        Without `complete` the text contains your values only. With `complete` it also contains every default, so that a version
        of dForce with other defaults reads the same case.
        """
        return text_of(self, complete)

    @checked
    def to_python(self, name: str = "result") -> str:
        """Return a Python script that builds the case, runs it, and writes the result and its picture.

        Parameters
        ----------
        name
            Name of the two files, without their endings.
        """
        return script_of(self, name)

    @classmethod
    @checked
    def from_toml(cls, text: str) -> Self:
        """Return the case in a TOML text.

        Raises
        ------
        CaseError
            When the text is not TOML, is empty, or has more than a million characters.
        ParameterError
            When the text is TOML but not a case.
        """
        try:
            table = read_toml(text)
        except ValueError as error:  # TOMLDecodeError, and integers of thousands of digits
            raise CaseError(f"{NOT_TOML}: {shorten(str(error), 250)}") from None
        if not table:
            raise CaseError("the case is empty; it needs at least [cantilever] and [drive]")
        if "plan" in table:
            raise CaseError("a file with a table [plan] is a plan; type dforce plan FILE, or use df.load_plan")
        return cls(**table)


def _built(given: object, tag: str, known: dict[str, Any], path: str, place: str, keep: bool = False) -> Any:
    """Return the object of a table with a tag: a force by its model, an experiment by its kind."""
    if isinstance(given, tuple(set(known.values()))):
        return given
    if not isinstance(given, dict):
        raise ParameterError(f"{place} = {shorten(given)} is not a table with a {tag}")
    name, listed_by = given.get(tag), "dforce models" if tag == "model" else ""
    if name is None:
        raise ParameterError(f"{place}.{tag} is missing{nearest('', known, listed_by)}")
    if not isinstance(name, str) or name not in known:
        hint = nearest(str(name)[:100], known, listed_by)
        raise ParameterError(f"{place}.{tag} = '{shorten(name)}' is not known{hint}")
    try:
        return known[name].model_validate(given if keep else {key: given[key] for key in given if key != tag})
    except pydantic.ValidationError as error:
        raise refusal(error, known[name], path) from None
