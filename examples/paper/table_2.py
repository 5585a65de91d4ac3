"""
Table 2: LSODA against RK4, then and now
========================================

In the paper LSODA is 2.8 to 11.1 times faster than RK4; the ratio grows with the number of points per period. Both integrators
called Python functions then. dForce compiles the whole right-hand side, and now RK4 is faster.
"""

# %%
# Over Python
# -----------
#
# The first function makes the right-hand side for a Hertz contact in Python: each stage of an integrator calls it once.
# Lengths are in units of the free amplitude, time in 1/ω. SciPy's LSODA and a plain RK4 integrate a few periods from rest,
# with 128 points per period.

import math
import time

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import ode

import dforce as df

POINTS, FEW = 128, 8


def rates_of(case):
    """Return the function dy/dτ of (τ, y), for a case with a Hertz contact alone."""
    problem, zc = case.problem, case.experiment.zc
    first = problem.tones[0]
    stiffness, a0 = problem.forces[0].numbers()
    modes = [
        ((mode.f0 / first.frequency) ** 2, mode.f0 / first.frequency / mode.Q, 1.0 / (mode.k * first.A0))
        for mode in problem.modes
    ]
    tones = [(tone.frequency / first.frequency, problem.drive[j].real) for j, tone in enumerate(problem.tones)]

    def rates(tau, y):
        depth = a0 - zc - first.A0 * sum(y[0::2])
        force = stiffness * depth * math.sqrt(depth) if depth > 0.0 else 0.0
        out = []
        for n, (square, damping, gain) in enumerate(modes):
            push = force + sum(drive[n] * math.cos(ratio * tau) for ratio, drive in tones)
            out += [y[2 * n + 1], square * (gain * push - y[2 * n]) - damping * y[2 * n + 1]]
        return out

    return rates


def lsoda(rates, size):
    solver = ode(rates).set_integrator("lsoda", rtol=1e-8, atol=1e-9, nsteps=10_000)
    solver.set_initial_value(np.zeros(size), 0.0)
    for i in range(POINTS * FEW):
        solver.integrate((i + 1) * 2.0 * math.pi / POINTS)


def rk4(rates, size):
    h, y = 2.0 * math.pi / POINTS, np.zeros(size)
    for i in range(POINTS * FEW):
        tau = i * h
        k1 = np.array(rates(tau, y))
        k2 = np.array(rates(tau + 0.5 * h, y + 0.5 * h * k1))
        k3 = np.array(rates(tau + 0.5 * h, y + 0.5 * h * k2))
        k4 = np.array(rates(tau + h, y + h * k3))
        y = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


def best(work, *arguments):
    """Return the shorter processor time (s) of two runs, after a first run that does not count."""
    times = []
    for _ in range(3):
        begin = time.process_time()
        work(*arguments)
        times.append(time.process_time() - begin)
    return min(times[1:])


# %%
# Compiled
# --------
#
# dForce computes the same motions for a fixed number of periods. The difference between a long and a short run is the time of
# the periods alone. Both tones repeat together after 163 periods (282 kHz / 48.9 kHz = 940/163), and dForce integrates
# whole repetitions.

REPETITION = 163
LENGTHS = {"lsoda": (REPETITION, 4 * REPETITION), "rk4": (REPETITION, 50 * REPETITION)}


def compiled(case, integrator):
    """Return the time (s) in which dForce integrates one period of the first tone."""
    settings = {"method": "transient", "integrator": integrator, "points_per_period": POINTS}
    short, long = LENGTHS[integrator]
    fixed = [case.replace("solver", {**settings, "settle": "fixed", "periods": periods}) for periods in (short, long)]
    return (best(df.run, fixed[1]) - best(df.run, fixed[0])) / (long - short)


PRINTED = {"Hertz": 2.8, "Hertz, bimodal": 4.5}  # table 2, m = 128
CASES = {"Hertz": df.example("table-1-am"), "Hertz, bimodal": df.example("table-1-bimodal")}
times = {}
for motion, case in CASES.items():
    rates, size = rates_of(case), 2 * len(case.problem.modes)
    for method, integrate in (("LSODA", lsoda), ("RK4", rk4)):
        times[method, "over Python", motion] = best(integrate, rates, size) / FEW
        times[method, "compiled", motion] = compiled(case, method.lower())


def period(method, way, motion):
    """Return the measured time (s) of one period of a motion."""
    return times[method, way, motion]


print(f"{'time of RK4 over time of LSODA':32s} {'printed':>8s} {'Python':>8s} {'compiled':>9s}")
ratios = {}
for motion, printed in PRINTED.items():
    ratios[motion] = [period("RK4", way, motion) / period("LSODA", way, motion) for way in ("over Python", "compiled")]
    print(
        f"{'AM' if motion == 'Hertz' else 'bimodal':32s} {printed:8.1f} {ratios[motion][0]:8.2f} {ratios[motion][1]:9.3f}"
    )
for motion in PRINTED:
    gain = period("LSODA", "over Python", motion) / period("RK4", "compiled", motion)
    print(f"{motion}: compiled RK4 is {gain:.0f} times faster than LSODA over Python")

# %%
# One picture
# -----------

figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
width = 0.2
ways = [(method, way) for way in ("over Python", "compiled") for method in ("LSODA", "RK4")]
for i, (method, way) in enumerate(ways):
    microseconds = [period(method, way, motion) * 1e6 for motion in PRINTED]
    axes.bar([place + (i - 1.5) * width for place in range(len(PRINTED))], microseconds, width, label=f"{method} {way}")
axes.set(yscale="log", ylabel="time of a period (µs)")
axes.set_xticks(range(len(PRINTED)), ["AM", "bimodal"])
axes.legend(fontsize="small")
plt.show()

# %%
# *Time of one period of the first tone, on a logarithmic axis. A call of a Python right-hand side takes microseconds. LSODA
# makes fewer calls, so in AM it is faster; for the bimodal motion both times are similar. A compiled call takes nanoseconds:
# the bookkeeping of LSODA dominates, and RK4 is faster. The ratio over Python depends on the tolerance of LSODA, which is
# missing in the paper.*
