"""No observable escapes the estimated error, and so the promised accuracy."""

import numpy as np
import pytest
from compiled import DEVIATIONS, FIRST, ProblemBatch, deviations, finish_each

import dforce as df
from dforce.core.quantities import OBSERVABLES
from dforce.core.quantity import Observable, Scale

PROBLEM = df.example("figure-3-air").set("drive.excitation=base").problem  # a shaken base has all observables
LOT = ProblemBatch.of([PROBLEM])


def measured() -> dict[str, np.ndarray]:
    """Return observables of some rows: their numbers do not matter."""
    columns = FIRST + 2 * len(PROBLEM.tones) * (len(PROBLEM.modes) + 1) + 2 * 3 + 2 * len(PROBLEM.tones)
    rows = np.random.default_rng(1).uniform(0.5, 1.0, (1, 1, columns))
    return finish_each(PROBLEM, 3, rows, np.ones(1), LOT.numbers, LOT.tones)


def test_an_observable_has_a_scale_of_its_error():
    with pytest.raises(TypeError, match="scale"):
        Observable("new", "n", "m", "nm", "new", "an observable without a scale")


def test_every_observable_that_is_computed_counts_in_the_estimate():
    assert set(measured()) == set(DEVIATIONS)
    assert set(OBSERVABLES) - set(DEVIATIONS) == {name for name, row in OBSERVABLES.items() if row.scale == Scale.NONE}


def test_a_change_of_any_observable_alone_is_seen():
    found, unseen = measured(), []
    for place, name in enumerate(DEVIATIONS):
        other = found | {name: 1.001 * found[name] + 1e-30}
        seen = deviations(PROBLEM, LOT.numbers, LOT.tones, found, other)[0]
        unseen += [name] if not (seen[place] > 0.0 and np.count_nonzero(seen) == 1) else []
    assert not unseen
