"""Random cases against independent integrators: the worst disagreement in every quantity, and the case that gave it."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from dforce.checks.validation.by_hand import measured
from dforce.checks.validation.checks import Check, ValidationPart
from dforce.checks.validation.comparison import SEEN, SIZES, disagreement, find, reference
from dforce.checks.validation.draws import FAMILIES, QUICK, Draw, draw
from dforce.checks.validation.identities import closures, limit
from dforce.observables.averaging import window_length

SEED = 1
DEFAULT, RESOLVED = 256, 2048  # samples per period
ASKED, ASKED_ENERGY, ASKED_PHASE = 1e-4, 1e-5, 0.01
TEXT = (
    "Random cases over fixed sums of forces that together contain every force model: Q from 1 to 2000, free amplitudes from "
    "0.1 to 100 nm, one mode or two. A motion that repeats with the tones is solved by RK4 at the default 256 samples a "
    "period (more if a mode needs it), and again with 2048. The engine finds the same periodic orbit, with a step "
    "on every kink and a tolerance of 1e-11. Some forces have a second version in plain Python, written by hand: for these, "
    "SciPy's DOP853 finds and measures the orbit once more. Extremes of forces are searched between samples. A disagreement "
    "is relative to the named size; limits are 1e-4, for energies 1e-5 of the drive's work, for phases 0.01°. Figures at the "
    "default sampling have no limit: a contact of a few samples exceeds it, and the advice of dForce warns."
)


@dataclass
class Worst:
    """The disagreements in one quantity."""

    values: list[tuple[float, Draw]] = field(default_factory=list)

    def check(self, group: str, name: str, most: float | None) -> Check:
        """Return the worst of them."""
        error, case = max(self.values, key=lambda pair: pair[0])
        size = SIZES.get(name, "")
        beyond = sum(value > asked(name) for value, _ in self.values)
        note = f"{size}; " if size else ""
        note += f"median {np.median([value for value, _ in self.values]):.0e}, "
        note += f"{beyond} of {len(self.values)} beyond {asked(name):g}"
        return Check(
            group, name.replace("_", " "), error, None, "1", error, most, f"case {case.number}: {case.text}", note
        )


def asked(name: str) -> float:
    """Return the limit of a disagreement."""
    if name in SIZES:
        return ASKED_PHASE if name == "phase" else ASKED_ENERGY if name == "total_dissipated_energy" else ASKED
    return ASKED if name == "multipliers" else limit(name)


GROUPS = {
    "default": "RK4 with its default against the engine",
    "resolved": "RK4 with 2048 samples a period against the engine",
    "by_hand": "Engine against DOP853 over laws written by hand",
    "balances": "Balances at 2048 samples a period",
}


class Tally:
    """Collects the disagreements of one case after the other."""

    def __init__(self) -> None:
        self.worst: dict[str, dict[str, Worst]] = {group: defaultdict(Worst) for group in GROUPS}
        self.outcomes: Counter[str] = Counter()

    def take(self, case: Draw) -> None:
        """Find a case's motion in all ways, and note how far they are apart."""
        problem = case.case.problem
        first = find(case.case, case.zc, DEFAULT)
        fine = first and find(case.case, case.zc, RESOLVED, first.motion)
        if first is None or fine is None:
            self.outcomes["motions that do not repeat with the tones (subharmonic, chaotic, or not settled)"] += 1
            return
        exact = reference(problem, case.zc, fine.motion)
        if exact is None:
            self.outcomes["motions without a reference: Newton's method with the engine found none"] += 1
            return
        how = (
            "found as periodic orbits"
            if fine.by_newton
            else "integrated until settled, without an orbit by Newton's method"
        )
        self.outcomes[f"steady motions {how}"] += 1
        for group, found in (("default", first), ("resolved", fine)):
            self.note(group, disagreement(problem, found.values, exact.values), case)
        if fine.values["amplitude"][0] > SEEN * problem.tones[0].A0:
            self.note("balances", closures(problem, fine.values, fine.mean_squares()), case)
        else:
            self.outcomes[
                "of these, with a tip in permanent contact (A below 0.01 A0): without balances, as no scale exists"
            ] += 1
        common = window_length([tone.frequency for tone in problem.tones])
        by_hand = measured(problem, case.zc, exact.orbit, common)
        if by_hand is not None:
            self.note("by_hand", disagreement(problem, exact.values, by_hand), case)

    def note(self, group: str, errors: dict[str, float], case: Draw) -> None:
        """Note disagreements by name in one of the comparisons of :data:`GROUPS`."""
        for name, error in errors.items():
            # NaN counts as the largest
            self.worst[group][name].values.append((error if math.isfinite(error) else math.inf, case))

    def checks(self) -> list[Check]:
        """Return the worst of each quantity in each comparison."""
        out = [
            Check("Outcome of the cases", words, float(count), None, "1", 0.0, None)
            for words, count in self.outcomes.most_common()
        ]
        for group, words in GROUPS.items():
            names = [name for name in (*SIZES, *self.worst[group]) if name in self.worst[group]]
            for name in dict.fromkeys(names):
                out.append(self.worst[group][name].check(words, name, None if group == "default" else asked(name)))
        return out

    def cases(self) -> dict[str, str]:
        """Return the files of the cases that the table names."""
        named = {}
        for group in self.worst.values():
            for worst in group.values():
                case = max(worst.values, key=lambda pair: pair[0])[1]
                named[f"case {case.number}"] = case.case.to_toml()
        return dict(sorted(named.items(), key=lambda pair: int(pair[0].split()[1])))


def part(quick: bool, tell: Callable[[str], None] = lambda text: None, count: int | None = None) -> ValidationPart:
    """Return this part of the validation: 200 cases, or a few of the shipped examples' forces."""
    families = QUICK if quick else tuple(FAMILIES)
    tally, total = Tally(), count or (12 if quick else 200)
    for number in range(total):
        if number % 20 == 0:
            tell(f"random cases {number + 1} to {min(number + 20, total)} of {total}")
        tally.take(draw(SEED, number, families))
    title = f"Random cases against independent integrators ({total} cases, seed {SEED})"
    return ValidationPart("random", title, TEXT, tuple(tally.checks()), tally.cases())
