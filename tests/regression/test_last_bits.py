"""No decision hangs on last bits: its tests pass with other code of BLAS, of NumPy and of the compiler."""

import os
import subprocess
import sys
from pathlib import Path

import last_bits
import numpy as np
import pytest

import dforce as df
from dforce.problem import Problem

ROOT = Path(__file__).parents[2]
# where states fold, double, end or are told apart; add `tests` to see all
PHYSICS = ("branches", "all_states", "basins", "noise", "quasi_static", "quasiperiodic")
DECISIONS = [
    "tests/runs/test_stability.py", "tests/maps", "tests/convergence", *(f"tests/physics/test_{name}.py" for name in PHYSICS)
]  # fmt: skip
FOUND = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])  # vector units that this processor has
SETTINGS = {
    "levers an ulp up": ({}, ["--ulps=1"]),
    "levers three ulps down": ({}, ["--ulps=-3"]),
    "BLAS without AVX": ({"OPENBLAS_CORETYPE": "Nehalem"}, []),
    "BLAS of Haswell": ({"OPENBLAS_CORETYPE": "Haswell"}, []),
    "BLAS of Zen": ({"OPENBLAS_CORETYPE": "Zen"}, []),
    "BLAS of SkylakeX": ({"OPENBLAS_CORETYPE": "SkylakeX"}, []),
    "NumPy without vector units": ({"NPY_DISABLE_CPU_FEATURES": " ".join(FOUND)}, []),
    "compiled for any processor": ({"NUMBA_CPU_NAME": "generic"}, []),
}
NEEDS = {
    "Haswell": "AVX2 X86_V3",
    "Zen": "AVX2 X86_V3",
    "SkylakeX": "AVX512F X86_V4",
}  # any of them, as NumPy calls them


@pytest.mark.long
@pytest.mark.timeout(7200)  # seconds; for any processor all kernels are compiled anew
@pytest.mark.parametrize("setting", SETTINGS)
def test_decisions_do_not_hang_on_last_bits(setting):
    environment, options = SETTINGS[setting]
    needed = NEEDS.get(environment.get("OPENBLAS_CORETYPE", ""), "").split()
    if needed and not set(needed) & set(FOUND):
        pytest.skip(f"this processor lacks {' or '.join(needed)}")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", *options, *DECISIONS],
        cwd=ROOT, env=os.environ | environment, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout


def test_levers_are_an_ulp_off_however_a_problem_is_built(monkeypatch):
    case = df.example("figure-3-air")
    parts = case.instrument, case.forces
    levers = [mode.f0 for mode in Problem.build(*parts).modes]
    last_bits.put_levers_off(monkeypatch, 1)
    for problem in (Problem.build(*parts), Problem.build(parts[0], forces=parts[1])):
        assert [mode.f0 for mode in problem.modes] == [np.nextafter(f0, np.inf) for f0 in levers]
