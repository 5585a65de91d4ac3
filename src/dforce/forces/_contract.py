"""The contract of a force model: one class, one scalar law.

A force on the tip is positive when it pushes the tip away from the sample (repulsive).
"""

from __future__ import annotations

import functools
import inspect
import math
import numbers
import sys
from collections.abc import Callable, Mapping
from itertools import product
from typing import Any, ClassVar, Self, get_args

from dforce.core.errors import Catalog, ForceError, ParameterError, nearest, shorten
from dforce.core.parameters import Parameters
from dforce.core.units import show

MOTION = ("d", "rate", "t")
REAL = float, numbers.Real  # the usual one first: looking into an abstract class takes ten times as long
ROOT_DEPTHS = (1e-17, 1e-13, 1e-11)  # m behind a kink
ROOT_RATES = (0.0, -1e-3, 1e-3)  # m/s
ROOT_SHARE, ROUNDING = 1.0 / 30.0, 1e-10

OF_ADHESION = dict.fromkeys(
    ("gamma", "W", "work_of_adhesion", "adhesion", "adhesion_energy"),
    "write surface_energy = gamma, half of the work of adhesion W = 2 gamma",
)
"""The hint of a force with a surface energy at other names for it."""

INTERACTIONS = (
    "van der Waals",
    "elastic contact",
    "contact viscosity",
    "double layer",
    "electrostatic bias",
    "capillary neck",
    "chemical bond",
    "solvation",
    "hydration",
    "magnetic",
)
"""The interactions that a force can contain; the attraction that makes a contact adhesive counts as van der Waals."""


def _home(model: type) -> str:
    """Return where a model is defined: its module, or the file of a plug-in."""
    name = model.__module__
    return str(sys.modules[name].__file__) if name.startswith("dforce_plugin_") else name


class Force(Parameters):
    r"""A tip–sample force: one class for runs, case files, checks and pages.

    A subclass is a frozen pydantic model: its docstring is its page, its fields are its parameters
    (:func:`dforce.param`, :func:`dforce.shared`), and `law` is its physics. See ``hertz.py`` for a short
    example.

    The law
        ``law(d, rate, t, *arguments)`` returns the force on the tip in newtons, at the tip–surface distance
        `d` (m), its rate of change `rate` (m/s) and the time `t` (s). It is plain Python on floats with
        functions of `math`, and runs interpreted in a test and compiled in the kernel. Each argument after
        the first three is the name of a field or of a property of the class. A property is a number, or a tuple of numbers,
        derived from fields once per run. It may use functions and numbers defined at the top of its own file or of another
        force's. A choice (a `Literal` field) enters the law through a property, as a number. A law that also depends on the
        deflection takes `zc`, the average distance (m), before these arguments.

    Optional members
        `potential(d, *arguments)`
            the energy U (J); then the law must equal -dU/dd.
        `kinks()`, `jumps()`
            distances (m) at which the law is not smooth, and the subset at which it is not continuous; solvers end a step on
            them if possible. `is_rooted`: whether the law is like a square root of the distance beside a kink; by default a
            numerical test decides.
        `memory`, `evolve(d, rate, t, memory, change, *arguments)`
            number of state variables (a property, or a class attribute), and the function that writes their
            rates of change (per second) into `change`; the law then takes `memory` after `t`. `memory_scale` is the scale of
            tolerances (in the unit of the states). States start at zero, the relaxed sample. `rates` are the relaxation
            rates (1/s) of the states. For a row of equal elements `rates` lists one element alone. Solvers resolve the
            fastest rate, and predict the resting states from all rates. Without `rates` a fast relaxation may be missed.
            `recovery_time` is the mean time (s) in which a free surface returns. A case with too long a time is refused, unless
            ``method = "transient"``.
        `switch(latched, d, rate, t, *arguments)`
            for a force with two branches (with and without a neck): the branch changes where the value of this function becomes
            positive, also at the start of a motion. The law then takes `latched` (0.0 or 1.0) after `t` (and after `memory`),
            and `switch` takes it first; a run starts at 0.0. Either branch must be finite at every distance.
        `law_function()`, `values()`
            for a law that depends on parameters, as in `custom` and `electrostatic`: the law of this force, and its arguments.
        `parts()`
            for a force of several interactions: the forces that add up to it, so that pictures show each.

    Attributes
    ----------
    name
        Key of the model in case files.
    title
        Its name for readers, such as ``"van der Waals"``; by default the name of the class.
    also_called
        Its other names and abbreviations in the field, for searches.
    contains
        The interactions in the model, from :data:`INTERACTIONS`; two forces with the same interaction are refused.
    dissipative
        Whether the sample dissipates energy over a cycle.
    timed
        Whether the law depends explicitly on the time `t`, as with an alternating bias. With ``method = "periodic"`` the time
        begins anew with each common period of the tones, so the law must repeat with them; see `own_frequency`.
    source
        Source of the equation.
    example
        Typical values of the parameters without a default, for checks and forms.
    """

    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    also_called: ClassVar[tuple[str, ...]] = ()
    contains: ClassVar[tuple[str, ...]] = ()
    dissipative: ClassVar[bool] = False
    timed: ClassVar[bool] = False
    source: ClassVar[str] = ""
    memory: ClassVar[int] = 0
    memory_scale: ClassVar[float] = 1e-9

    law: ClassVar[Callable[..., float]]
    potential: ClassVar[Callable[..., float] | None] = None
    evolve: ClassVar[Callable[..., None] | None] = None
    switch: ClassVar[Callable[..., float] | None] = None

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Check the contract and register the model under its name."""
        super().__pydantic_init_subclass__(**kwargs)
        cls.title_of = cls.name
        if not cls.name:
            return  # an abstract family, not a model
        _check_contract(cls)
        known = REGISTRY.get(cls.name)
        if known is not None and known.__module__ != cls.__module__:
            raise ForceError(f"the force '{cls.name}' of {_home(cls)} is already defined in {_home(known)}; rename one")
        REGISTRY[cls.name] = cls

    @property
    def rates(self) -> tuple[float, ...]:
        """Inverse relaxation times of the states of one element (1/s); empty without a memory, or if they are unknown."""
        return ()

    @property
    def recovery_time(self) -> float:
        """Mean time (s) in which a free surface returns: infinite if it never returns, 0 if the time is unknown."""
        return 0.0

    @property
    def fastest_rate(self) -> float:
        """Inverse of the shortest relaxation time of the memory (1/s); 0 without `rates`."""
        return max(self.rates, default=0.0)

    @property
    def is_rooted(self) -> bool:
        """Whether the law starts like a square root of the distance at a kink: solvers take shorter steps there."""
        return _is_rooted(self.law_function(), self.leading(), self.memory, self.kinks(), self.values())

    @property
    def own_frequency(self) -> float | None:
        """Frequency (Hz) at which the law alternates in time; None if it does not, or if the frequency is unknown."""
        return None

    @property
    def is_of_distance_alone(self) -> bool:
        """Whether the force depends on the distance alone: without loss, time, memory, branch or average distance."""
        alone = len(self.leading()) == len(MOTION) and self.memory == 0 and self.switch is None
        return alone and not self.dissipative and not self.timed

    @property
    def is_passive(self) -> bool:
        """Whether the sample never adds energy over a cycle: true for the models of dForce."""
        return not self.timed and type(self).__module__.startswith(__package__ + ".") and self.name != "custom"

    def law_function(self) -> Callable[..., float]:
        """Return the law of this force: the law of its class, unless the law depends on the parameters."""
        return type(self).law

    def plain_law(self) -> Callable[..., float]:
        """Return the law for calls in Python, :func:`guarded`."""
        return guarded(self.name, self.law_function())

    def leading(self) -> tuple[str, ...]:
        """Return the first arguments of the law: the motion, then memory, latch and `zc` if any."""
        return _leading(type(self), self.law_function())

    def arguments(self) -> tuple[str, ...]:
        """Return the further arguments of the law: names of fields and properties."""
        return names_of(self.law_function())[len(self.leading()) :]

    def parts(self) -> tuple[Force, ...]:
        """Return the bound forces that add up to this force, one for each interaction; by default the force itself."""
        return (self,)

    def kinks(self) -> tuple[float, ...]:
        """Return the distances (m) at which the law is not smooth."""
        return ()

    def jumps(self) -> tuple[float, ...]:
        """Return the distances (m), among the kinks, at which the law is not continuous."""
        return ()

    def bind(self, instrument: Mapping[str, float | None]) -> Self:
        """Return the force with its shared parameters taken from the instrument.

        Parameters
        ----------
        instrument
            SI values by path, such as ``{"tip.radius": 2e-9}``.

        Raises
        ------
        ParameterError
            When the instrument lacks a necessary value, or the values contradict each other.
        """
        bound = self.model_copy(update={field: instrument.get(path) for field, path in self.shared_fields().items()})
        for field in self.shared_fields():
            if type(None) not in get_args(self.__class__.model_fields[field].annotation):
                bound.needed(field)
        bound.check_bound()
        return bound

    def needed(self, field: str) -> float:
        """Return the number in a field; raise :class:`ParameterError` if it is missing."""
        value = getattr(self, field)
        if value is None:
            raise ParameterError(f"{self.name} needs {self.shared_fields().get(field, field)}, which is missing")
        return float(value)

    def check_bound(self) -> None:
        """Raise :class:`ParameterError` when the bound values contradict each other."""
        self.numbers()

    def values(self) -> tuple[Any, ...]:
        """Return the arguments of the law in SI, each a number or a tuple of numbers; the force must be bound."""
        given = (getattr(self, name) for name in self.arguments())
        return tuple(tuple(map(float, value)) if isinstance(value, tuple) else float(value) for value in given)

    def numbers(self) -> tuple[float, ...]:
        """Return the arguments of the law in SI as a flat tuple of numbers."""
        row: list[float] = []
        for value in self.values():
            row.extend(value if isinstance(value, tuple) else (value,))
        return tuple(row)

    def layout(self) -> tuple[int | None, ...]:
        """Return the length of each argument as a tuple; None for a plain number."""
        return tuple(len(value) if isinstance(value, tuple) else None for value in self.values())


class Models(Catalog[type[Force]]):
    """All force models by their keys."""

    kind = "force model"
    listed_by = "dforce models"

    def synonyms(self) -> dict[str, tuple[str, ...]]:
        """Return the other names of each model."""
        return {name: model.also_called for name, model in self.items()}


REGISTRY = Models()


@functools.lru_cache(maxsize=256)
def names_of(law: Callable[..., float]) -> tuple[str, ...]:
    """Return the names of a law's arguments."""
    return tuple(inspect.signature(law).parameters)


def _leading(cls: type[Force], law: Callable[..., float]) -> tuple[str, ...]:
    """Return the names that the law must start with."""
    memory = ("memory",) if cls.evolve is not None else ()
    latch = ("latched",) if cls.switch is not None else ()
    place = ("zc",) if "zc" in names_of(law) else ()
    return (*MOTION, *memory, *latch, *place)


@functools.lru_cache(maxsize=256)
def _is_rooted(
    law: Callable[..., float],
    leading: tuple[str, ...],
    memory: int,
    kinks: tuple[float, ...],
    values: tuple[object, ...],
) -> bool:
    """Try a law at some depths behind its kinks: from a hundredth of a depth to the whole a root grows by 10, a line by 100."""
    for kink, rate, latched in product(kinks, ROOT_RATES, (0.0, 1.0)):
        given = {"rate": rate, "t": 0.0, "memory": [0.0] * memory, "latched": latched, "zc": kink}
        rest = [given[name] for name in leading[1:]]
        try:
            edge, near, deep = (law(kink - depth, *rest, *values) for depth in ROOT_DEPTHS)
        except (ArithmeticError, ValueError):  # no number, no root
            continue
        if abs(near - edge) > ROOT_SHARE * abs(deep - edge) and abs(deep - edge) > ROUNDING * abs(edge):
            return True
    return False


def guarded(name: str, function: Callable[..., Any], part: str = "law") -> Callable[..., float]:
    """Return a law, or a force's `switch` or `evolve`, as plain Python that gives NaN where arithmetic fails, as compiled.

    Raises
    ------
    ForceError
        From the returned function, where the given function fails otherwise or returns no number.
    """

    def answer(*arguments: Any) -> float:
        try:
            value: Any = function(*arguments)
        except (ArithmeticError, ValueError):
            return math.nan
        except Exception as error:
            raise refused(f"fails: {type(error).__name__}: {shorten(str(error), 200)}", arguments) from error
        if part == "evolve":  # it writes its answer
            return 0.0
        if not isinstance(value, REAL):
            raise refused(f"returns {type(value).__name__}, but must return a number", arguments)
        return float(value)

    def refused(fault: str, arguments: tuple[Any, ...]) -> ForceError:
        d = arguments[1 if part == "switch" else 0]
        return ForceError(f"the {part} of '{name}' at d = {show(d, 'm', 3)} {fault}")

    return answer


def in_first_contact(force: Force, d: float, rate: float, zc: float) -> float:
    """Return a bound force (N) with rested memories, on the branch of a contact that is there; NaN where it has no value."""
    given = {"d": d, "rate": rate, "t": 0.0, "memory": [0.0] * force.memory, "latched": 1.0, "zc": zc}
    return force.plain_law()(*(given[name] for name in force.leading()), *force.values())


def makes_its_laws(cls: type[Force]) -> bool:
    """Return whether each force of the class makes its own law from its parameters."""
    overridden = cls.law_function is not Force.law_function
    return overridden and not isinstance(inspect.getattr_static(cls, "law", None), staticmethod)


def _check_contract(cls: type[Force]) -> None:
    for interaction in cls.contains:
        if interaction not in INTERACTIONS:
            raise ForceError(f"'{cls.name}' contains '{interaction}'{nearest(interaction, INTERACTIONS)}")
    if cls.evolve is None and cls.memory != 0:
        raise ForceError(f"'{cls.name}' has a memory, but no 'evolve'")
    if cls.evolve is not None and cls.memory == 0:
        raise ForceError(f"'{cls.name}' has 'evolve', but no memory: set it to the number of its states")
    if makes_its_laws(cls):
        return
    law = cls.__dict__.get("law") or getattr(cls, "law", None)
    if law is None:
        raise ForceError(f"the force '{cls.name}' has no law")
    names = tuple(inspect.signature(cls.law).parameters)
    leading = _leading(cls, cls.law)
    if names[: len(leading)] != leading:
        raise ForceError(f"the law of '{cls.name}' must start with {', '.join(leading)}; it has {', '.join(names)}")
    for name in names[len(leading) :]:
        if name not in cls.model_fields and not isinstance(inspect.getattr_static(cls, name, None), property):
            raise ForceError(f"the law of '{cls.name}' takes '{name}', neither a field nor a property of the class")
    arguments = names[len(leading) :]
    for other, start in (
        ("potential", ("d",)),
        ("evolve", (*MOTION, "memory", "change")),
        ("switch", ("latched", *MOTION)),
    ):
        function = getattr(cls, other)
        if function is not None and tuple(inspect.signature(function).parameters) != (*start, *arguments):
            raise ForceError(f"'{other}' of '{cls.name}' must take {', '.join((*start, *arguments))}")
