"""The one door of tests to the compiled rooms: where a name of these moves, it is mended here."""

from __future__ import annotations

from dforce.integrators.loops import phases, tabulate
from dforce.kernel.cache import KernelCache
from dforce.kernel.codegen import compose
from dforce.kernel.linker import compile_function
from dforce.observables.averaging import common_period, weights, window_length
from dforce.observables.complex_numbers import modulus, phase_lag, product
from dforce.observables.deviation import DEVIATIONS, deviations
from dforce.observables.finish import finish, finish_each
from dforce.observables.measure import F_V, FIRST, F, Z
from dforce.observables.misfit import reach
from dforce.solvers.block import Block
from dforce.solvers.integrator import INTEGRATORS, RK4, sample_count, with_amplitudes
from dforce.solvers.langevin import Langevin, free_motion, linear_step, noise_root
from dforce.solvers.linear_noise import linear_noise
from dforce.solvers.model import retune
from dforce.solvers.orbit import FOLD, Orbit
from dforce.solvers.parameter_range import ParameterRange
from dforce.solvers.period_map import FD_STEP
from dforce.solvers.philox import normals, philox
from dforce.solvers.problem_batch import ProblemBatch
from dforce.solvers.search import Known, search, why_unproven
from dforce.solvers.settling import apart
from dforce.solvers.stability import CRITICAL, ERROR, STABLE, UNSTABLE, is_stable, stability
from dforce.solvers.states import States
from dforce.solvers.transient import steady

__all__ = [
    "CRITICAL",
    "DEVIATIONS",
    "ERROR",
    "FD_STEP",
    "FIRST",
    "FOLD",
    "F_V",
    "INTEGRATORS",
    "RK4",
    "STABLE",
    "UNSTABLE",
    "Block",
    "F",
    "KernelCache",
    "Known",
    "Langevin",
    "Orbit",
    "ParameterRange",
    "ProblemBatch",
    "States",
    "Z",
    "apart",
    "common_period",
    "compile_function",
    "compose",
    "deviations",
    "finish",
    "finish_each",
    "free_motion",
    "is_stable",
    "linear_noise",
    "linear_step",
    "modulus",
    "noise_root",
    "normals",
    "phase_lag",
    "phases",
    "philox",
    "product",
    "reach",
    "retune",
    "sample_count",
    "search",
    "stability",
    "steady",
    "step_noise",
    "tabulate",
    "weights",
    "why_unproven",
    "window_length",
    "with_amplitudes",
]


def step_noise(mode, h, kT):
    """Return the covariance that noise adds to a free mode over a time (s)."""
    root = noise_root(mode, h, kT)
    return root @ root.T
