"""Work that is not done in vain: where a memory or a motion does not come to rest, and where a state is found early."""

from types import SimpleNamespace

import numpy as np
import pytest
from compiled import Block, States

import dforce as df
from dforce.experiments.base import initial_motions
from dforce.solvers import period_map, settling, state_ends

ONE = np.array([0])


def block_and_start(zc, **case):
    case = df.Case(**case)
    block = Block.of_one(case.problem, case.solver, 1)
    return block, States.of(*initial_motions(block, np.array([zc]), "free"))


def test_a_memory_that_does_not_come_to_rest_is_given_up_early(monkeypatch):
    passes = []

    def restless(y, of_period, table, forces, samples, p):
        memory = forces[0]
        passes.append(memory[0])
        memory[0] += 1.0 + 0.5 * np.sin(7.0 * memory[0])
        return y

    meanings = {"motion_size": lambda: 2, "mode_count": lambda: 1, "from_vector": tuple, "of_case": lambda *_: ()}
    for name, meaning in (meanings | {"advance": restless}).items():
        monkeypatch.setattr(period_map, name, meaning)
    columns, lanes = 3, np.zeros((1, 3))
    model = SimpleNamespace(
        memory_scale=np.ones(1), hysteresis=0, gain=np.ones((1, 1)), elements=np.array([0, 1]), tip=None
    )
    drive = SimpleNamespace(points=16, periods=1, waves=np.zeros((1, 2, 33)), phases=np.zeros((1, 1)))
    slots = period_map.Slots(
        np.zeros(1, int), np.zeros(1), np.zeros((1, 2)), np.zeros((1, 1)), np.zeros((1, 0)), np.zeros((1, 4, 2)),
        np.zeros((1, 1)), np.zeros((1, 0)), np.zeros((1, 4, 1)), np.zeros((1, 1, 1)), np.zeros(1, int),
    )  # fmt: skip
    tones = np.zeros((columns, 1, period_map.FIRST_DRIVE + 2))
    numbers = np.zeros((period_map.OTHERS, columns))
    given = numbers, lanes, tones, np.zeros((2, columns)), np.zeros((2, columns))
    period_map.march_columns(slots, (ONE, 1, columns), False, given, (model, drive, None))
    assert columns * period_map.MOST_VAIN < len(passes) < period_map.MEMORY_PASSES


def test_a_motion_that_wanders_is_not_settled_again_and_again():
    block, start = block_and_start(
        2.5e-9,
        cantilever=df.Cantilever(f0=50e3, k=2.0, Q=300.0),
        drive=df.Drive(A0=5e-9),
        tip=df.Tip(radius=8e-9),
        sample=df.Sample(youngs_modulus=2e9, poisson_ratio=0.3),
        forces=[df.forces.Hertz(), df.forces.Capillary()],
    )
    _, _, good, periods = settling.settled(block, ONE, start, np.array([2.5e-9]))
    assert not good[0]
    assert 0 < periods[0] <= block.most_periods(ONE)[0]


@pytest.mark.parametrize("is_smooth", [False, True])
def test_guesses_of_a_doubled_state_are_tried_in_turns_where_motions_march_in_turns(monkeypatch, is_smooth):
    tried = []

    def found_at_once(block, cases, start, at, cycles):
        tried.append(len(cases))
        return SimpleNamespace(
            done=np.ones(len(cases), int), last_x=start.x, last_memory=start.memory, last_branch=start.branch
        )

    def other_side(cases, states, at, periods):
        return States(-states.x, states.memory, states.branch)

    monkeypatch.setattr(state_ends, "polished", found_at_once)
    block, single = SimpleNamespace(is_smooth=is_smooth, advance=other_side), States(*np.zeros((3, 1, 2)))
    found = state_ends.doubled(block, 0, 1e-9, single, np.array([1.0, 0.0]), 1)
    assert found.x[0, 0] == state_ends.KICKS[0]
    assert tried == [len(state_ends.KICKS) if is_smooth else 1]
