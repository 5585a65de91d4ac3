r"""
Why the phase jumps, and how to stay in one regime
==================================================

*On approach your phase rises above 90°, then it suddenly drops far below, and the amplitude steps up. On retract this happens
at another height. In an image it looks like contrast, but it is not.* This tutorial explains the jump, and helps to choose a
drive that avoids it.
"""

# %%
# The jump
# --------
#
# The example is a tapping cantilever over a polymer, in air:

import matplotlib.pyplot as plt
import numpy as np

import dforce as df

case = df.Case(
    title="A polymer in air",
    cantilever=df.Cantilever(f0="75 kHz", k="2.8 N/m", Q=180),
    drive=df.Drive(A0="25 nm"),
    tip=df.Tip(radius="10 nm"),
    sample=df.Sample(youngs_modulus="2 GPa"),
    forces=[df.forces.DMT(hamaker="4e-20 J")],
)
curve = df.approach(case, zc=np.linspace(30e-9, 10e-9, 201), direction="both")
df.plot.amplitude_phase(curve)
plt.show()

for finding in df.summary(curve):
    if finding.name == "jumps":
        print(finding.direction, finding.label, finding.text)

# %%
# *Amplitude (top) and phase (bottom). On approach the phase rises far above 90° before it jumps below. On retract it stays
# below 90° nearly until the free oscillation begins. Between the two jumps the same distance has two states.*
#
# A phase above 90° means net attraction over a period, below 90° net repulsion. No energy is lost here: the forces depend on
# the distance alone. The loop is not dissipation but **two steady motions at the same distance**. In this curve the distance
# changes so slowly that the motion stays on its state until the state ends (`protocol = "quasi_static"`, the default).
#
# All states
# ----------
#
# `branches` follows the periodic motions themselves, stable or not. Here they lie behind the curve:

states = df.branches(case, zc=("30 nm", "10 nm"))
df.plot.amplitude_phase(curve, states=states)
plt.show()

for finding in df.summary(states):
    print(f"{finding.label}: {finding.text}")

# %%
# *The curve, and all steady motions behind it. An experiment can show only the stable motions. The dashed line is an unstable
# motion, lost at the slightest disturbance; it connects the two stable motions at the folds (dots). Both jumps lie at a fold:
# there the stable and the unstable motion meet, and beyond it neither exists.*
#
# In sudden steps
# ---------------
#
# Many simulations, and earlier versions of dForce, move the tip by a sudden step, wait until the motion has settled, and take
# the next step. Each step disturbs the motion. A large step moves it to another state long before its own state ends.
# `protocol = "stepwise"` does the same:

steps = (0.5, 0.2, 0.1, 0.05, 0.02)  # nm
jumps = {}
upper, lower = df.plot.amplitude_phase(curve.sel(direction="approach"), states=states)
upper.lines[0].set_label("followed slowly")
print("step (nm)   stepwise   quasi-static: jump on approach (nm)")
for step in steps:
    for protocol in ("stepwise", "quasi_static"):
        zc = np.arange(30.0, 10.0 - step / 2, -step) * 1e-9
        way = df.approach(case, zc=zc, direction="approach", protocol=protocol)
        (jumps[protocol, step],) = 1e9 * way.jump_zc.values
        if protocol == "stepwise" and step >= 0.2:
            color = "C1" if step == 0.2 else "C2"
            upper.plot(
                1e9 * way.zc, 1e9 * way.amplitude, "o-", color=color, lw=0.8, ms=2.5, label=f"steps of {step} nm"
            )
            lower.plot(1e9 * way.zc, way.phase, "o-", color=color, lw=0.8, ms=2.5)
    print(f"{step:9g} {jumps['stepwise', step]:10.2f} {jumps['quasi_static', step]:14.4f}")
upper.legend(fontsize="small")
plt.show()

# sphinx_gallery_start_ignore
ends = 1e9 * np.sort(states.zc.values[states.special.values == "fold"])
assert len(ends) == 2
outward = 1e9 * float(curve.jump_zc.values[curve.jump_direction.values == "retract"][-1])
slow = [jumps["quasi_static", step] for step in steps]
assert abs(outward - ends[1]) < 1e-4 * 25.0  # folds are found with more samples than jumps
assert abs(slow[0] - ends[0]) < 1e-4 * 25.0 and np.ptp(slow) < way.jump_error.item() * 25.0 < 1e-4 * 25.0
early = [jumps["stepwise", step] - ends[0] for step in steps]
assert early == sorted(early, reverse=True) and early[0] > 3.0 and early[1] > 0.9 and -0.02 <= early[-1] < 0.05
# sphinx_gallery_end_ignore

# %%
# *The approach in sudden steps of 0.5 and 0.2 nm leaves the attractive state 3.6 nm and 1 nm before it ends. The states are
# equal; only the path along them differs.*
#
# With smaller steps the jump approaches the fold; in a slow change it is at the fold on any grid. **The place of a jump is not
# a property of the system. The folds are.** Use `stepwise` to repeat the results of such a simulation.
#
# The state of each start
# -----------------------
#
# Start the motion with every amplitude and phase, and compute its final state:

starts = {
    "amplitude": {"start": "0 nm", "stop": "30 nm", "points": 31},
    "phase": {"start": "0 deg", "stop": "350 deg", "points": 36},
}
figure = plt.figure(figsize=(9.5, 5), layout="constrained")
shares = {}
for place, part in zip(("24 nm", "23 nm"), figure.subfigures(1, 2, squeeze=False)[0], strict=True):
    map_of_starts = df.basins(case, zc=place, amplitude=starts["amplitude"], phase=starts["phase"])
    df.plot.basins(map_of_starts, figure=part)
    for state in map_of_starts.state.values:
        one = map_of_starts.sel(state=state)
        regime = "attractive" if float(one.phase.sel(tone=1)) > 90.0 else "repulsive"
        shares[place, regime] = float(one.share)
        print(f"{place}: {float(one.share):6.1%} of the starts end in the {regime} state")
plt.show()

# sphinx_gallery_start_ignore
assert shares["24 nm", "attractive"] > 0.9 and shares["23 nm", "repulsive"] > 0.9
# sphinx_gallery_end_ignore

# %%
# *Every point is a start, its color is the final state; a dot marks the state itself. At 24 nm (left) nearly every start
# leads to the attractive state. One nanometer closer (right) nearly every start leads to the repulsive state; only a small
# island around the attractive state is left.*
#
# The approach of the first picture stayed in this island down to the fold, because nothing disturbed it. A real tip leaves it
# earlier, for two reasons.
#
# Thermal motion
# --------------
#
# `escape` is the distance of each stable state from the nearest unstable state. Compare it with the thermal motion of the
# lever, :math:`\sqrt{k_B T/k}` on average. This motion changes at random within a decay time, :math:`Q/\pi f_0`. Its largest
# value in a second is about :math:`\sqrt{2 \ln N}` times the average, with :math:`N` decay times in a second:

lever = case.problem.modes[0]
thermal = np.sqrt(1.380649e-23 * case.medium.temperature / lever.k)
in_a_second = thermal * np.sqrt(2.0 * np.log(np.pi * lever.f0 / lever.Q))
print(f"thermal motion: {1e12 * thermal:.0f} pm on average, {1e12 * in_a_second:.0f} pm at most in a second")

figure, axes = plt.subplots(figsize=(6.5, 4.0), layout="constrained")
unstable = np.flatnonzero(~states.stable.values)  # the states stand in their order along the curve, from far away on
parts = {"attractive": slice(0, unstable[0]), "repulsive": slice(unstable[-1] + 1, None)}
folds = np.sort(states.zc.values[states.special.values == "fold"])
within_reach = {}
for (regime, part), fold in zip(parts.items(), folds, strict=True):
    one = states.isel(point=part)
    one = one.isel(point=np.flatnonzero(np.isfinite(one.escape.values))).sortby("escape")
    axes.semilogy(1e9 * one.zc, 1e9 * one.escape, ".-", markersize=3, label=f"{regime} state")
    squares, before = np.append(0.0, one.escape**2), np.append(0.0, np.abs(one.zc - fold))
    within_reach[regime] = np.interp(in_a_second**2, squares, before)  # a straight line near the fold
    print(f"{regime}: within reach of the thermal motion {1e12 * within_reach[regime]:.2g} pm before its end")
axes.axhline(1e9 * thermal, color="0.5", linestyle=":", label="thermal motion, average")
axes.axhline(1e9 * in_a_second, color="0.5", linestyle="--", label="largest in a second")
axes.set(xlabel="average distance (nm)", ylabel="distance to the unstable state (nm)")
axes.legend(fontsize="small")
plt.show()

# sphinx_gallery_start_ignore
assert 37e-12 < thermal < 39e-12 and 140e-12 < in_a_second < 150e-12
assert 0.2e-9 < within_reach["attractive"] < 0.3e-9 and within_reach["repulsive"] < 1e-12
# sphinx_gallery_end_ignore

# %%
# *Distance of each stable state from the unstable state. Toward its fold it falls to zero, as a square root. The attractive
# state is within reach of the thermal motion a quarter of a nanometer before its end, the repulsive state less than a
# picometer before.*
#
# So a microscope that waits a second at each distance jumps inward some tenths of a nanometer before the fold. The place
# differs from approach to approach. Outward it jumps at the fold. This is an estimate. Near the fold the motion returns more
# slowly and goes farther. Moreover, `escape` is the distance to the unstable state, not to the nearest point of the border
# between the basins. A softer lever moves more: a tenth of the stiffness means three times the thermal motion.
#
# Finite speed
# ------------
#
# A decay time is 0.76 ms here. A tip that moves by a nanometer in this time is faster than its motion. The amplitude still
# belongs to a larger distance, and is nearer to the amplitude of the unstable state. To see this, let the sample rise towards
# the tip at a constant speed. The force depends on time: DMT with the surface at a height `P1 t` until it stops at `P2`. A
# dwell records the whole motion:

law = "-H*R/6/max(d - min(P1*t, P2), a0)**2 + 4/3*E_eff*sqrt(R)*max(a0 - d + min(P1*t, P2), 0)**1.5"
far, rise = 27e-9, 10e-9
speeds = {3e-6: "C1", 1e-6: "C4", 1e-7: "C2"}  # m/s, and a color
below = {}
upper, lower = df.plot.amplitude_phase(curve.sel(direction="approach"), states=states)
upper.lines[0].set_label("followed slowly")
for speed, color in speeds.items():
    periods = int(rise / speed * lever.f0) + 2000  # and until the motion has settled over the sample at rest
    rising = case.replace(
        forces=[df.forces.Custom(law=law, hamaker="4e-20 J", P1=speed, P2=rise)],
        solver={"settle": "fixed", "periods": periods},
    )
    motion = df.dwell(rising, zc=far, record="all", recorded_periods=1)
    samples = int(motion.attrs["samples_per_period"])
    turn = np.exp(-2j * np.pi * np.arange(samples) / samples)
    lock_in = 2.0 * np.mean(motion.deflection.values.reshape(-1, samples) * turn, axis=1)  # a value for each period
    zc = far - np.minimum(speed * (np.arange(len(lock_in)) + 0.5) / lever.f0, rise)
    phase = -np.degrees(np.angle(lock_in))
    below[speed] = 1e9 * zc[np.flatnonzero((phase < 90.0) & (zc < 26e-9))[0]]
    print(f"{1e6 * speed:g} µm/s: the phase falls below 90° at {below[speed]:.2f} nm")
    upper.plot(1e9 * zc, 1e9 * np.abs(lock_in), color=color, linewidth=0.9, label=f"{1e6 * speed:g} µm/s")
    lower.plot(1e9 * zc, phase, color=color, linewidth=0.9)
for axes in (upper, lower):
    axes.set_xlim(17.5, 27.0)
upper.set_ylim(17.0, 25.5)
upper.legend(fontsize="small")
plt.show()

# sphinx_gallery_start_ignore
assert 4.5 < below[3e-6] - ends[0] < 4.9 and 0.6 < below[1e-6] - ends[0] < 0.9
assert -0.12 < below[1e-7] - ends[0] < 0.0
assert round(1e3 * lever.Q / (np.pi * lever.f0), 2) == 0.76
# sphinx_gallery_end_ignore

# %%
# *Amplitude and phase of every period while the sample rises, over the slow curve and all states. At 3 µm/s the motion hardly
# reaches the attractive state, and leaves it nearly 5 nm before its end; at 1 µm/s it leaves 0.7 nm before. At 0.1 µm/s it
# leaves at the fold. Its phase falls below 90° a little later, because this takes time, too.*
#
# A feedback, an edge of the sample and the steps of a piezo disturb the motion in the same way. They determine *when* the tip
# jumps. `branches` and the slow curve show *between which states* it jumps, and the range of each.

# %%
# Stay in one regime
# ------------------
#
# The free amplitude selects the regime. Repeat the approach for amplitudes from 5 to 60 nm and compare the phase at each set
# point:

free_amplitudes = np.linspace(5e-9, 60e-9, 56)
approach = df.experiments.Approach(zc={"start": "65 nm", "stop": "2 nm", "points": 316})
grid = df.sweep(
    case.replace("experiment", approach),
    over={"drive.A0": free_amplitudes},
    quantities=["amplitude", "phase", "peak_force"],
)

set_points = np.linspace(0.4, 0.98, 59)
phase = np.empty((len(free_amplitudes), len(set_points)))
for row, A0 in enumerate(free_amplitudes):
    one = grid.sel(A0=A0, tone=1)
    # the first distance, from far away, at which the amplitude has fallen to the set point
    first = [int(np.argmax(one.amplitude.values <= ratio * A0)) for ratio in set_points]
    phase[row] = one.phase.values[first]

figure, axes = plt.subplots(figsize=(6.5, 4.5), layout="constrained")
colors = axes.pcolormesh(set_points, free_amplitudes * 1e9, phase, cmap="RdBu", vmin=20, vmax=160)
figure.colorbar(colors, label="phase lag (°)")
axes.set(xlabel="set point $A/A_0$", ylabel="free amplitude $A_0$ (nm)")
plt.show()

# sphinx_gallery_start_ignore
assert (phase[free_amplitudes < 23.5e-9] > 90.0).all()
assert (phase[free_amplitudes > 39.5e-9][:, set_points <= 0.95] < 90.0).all()
between = phase[(free_amplitudes > 25e-9) & (free_amplitudes < 35e-9)]
assert (between > 90.0).any() and (between < 90.0).any()
# sphinx_gallery_end_ignore

# %%
# *Phase at each set point and free amplitude, on approach. Blue: net attraction at every set point, with a free amplitude below
# about 23 nm. Red: net repulsion. At the amplitudes in between a change of set point crosses the border.*
#
# So, for this cantilever and sample:
#
# - to stay **attractive** (gentle, long-ranged), use a free amplitude well below 23 nm;
# - to stay **repulsive** (sharp, sensitive to stiffness), use a free amplitude above 40 nm and a set point of 95 % or less. Or
#   start from a point well inside the red part and keep away from the border;
# - **avoid the middle**: there a phase image shows the border, not the sample.
#
# The border moves with the tip radius, the Hamaker constant and the cantilever. Change the case above to your values. A sharper
# tip or a weaker attraction moves it to smaller amplitudes, and so does a higher `k/Q`.
