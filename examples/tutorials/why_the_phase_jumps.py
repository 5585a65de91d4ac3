r"""
Why the phase jumps, and how to stay in one regime
==================================================

*On the way to the surface your phase rises above 90°, then it suddenly drops far below, and the amplitude steps up. On the
way back it happens at another height. In an image it looks like contrast, and is none.* This tutorial shows what happens
and how to choose a drive that avoids it.
"""

# %%
# The jump
# --------
#
# A tapping cantilever over a polymer, in air:

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
df.plot.amplitude_phase(curve, figure=plt.figure(figsize=(6, 6)))
plt.show()

for finding in df.summary(curve):
    if finding.name == "jumps":
        print(finding.direction, finding.label, finding.text)

# %%
# *Amplitude (top) and phase (bottom). On the way in the phase climbs far above 90° before it jumps below; on
# the way out it stays below 90° nearly to where the free oscillation begins. Between the two jumps the same
# distance has two answers.*
#
# A phase above 90° says that attraction wins over a period, below 90° that repulsion wins. No energy is lost
# here: the forces depend on the distance alone. The loop is not dissipation but **two steady motions at the
# same distance**.
#
# All states
# ----------
#
# `branches` does not wait for a motion to settle; it follows the periodic motions themselves, stable or not:

states = df.branches(case, zc=("30 nm", "10 nm"))
df.plot.branches(states, figure=plt.figure(figsize=(6, 6)))
plt.show()

for finding in df.summary(states):
    print(f"{finding.label}: {finding.text}")

# %%
# *All steady motions. The full lines are stable: an experiment can see them. The dashed line is a motion that
# exists but falls to one side or the other at the slightest disturbance; it joins the two at the folds. The
# jumps of the first picture lie where a full line ends.*
#
# The jump inward comes at the fold, or a little earlier: at how far depends on how coarse the steps of the
# approach are, and in an experiment on noise and on the feedback. **The place of a jump is no property of the
# sample.** The folds are.
#
# Which state you get
# -------------------
#
# Start the motion in every way, with every amplitude and phase, and see where it settles:

starts = {
    "amplitude": {"start": "0 nm", "stop": "30 nm", "points": 31},
    "phase": {"start": "0 deg", "stop": "350 deg", "points": 36},
}
figure = plt.figure(figsize=(9.5, 5), layout="constrained")
shares = {}
for zc, part in zip(("24 nm", "23 nm"), figure.subfigures(1, 2), strict=True):
    map_of_starts = df.basins(case, zc=zc, **starts)
    df.plot.basins(map_of_starts, figure=part)
    for state in map_of_starts.state.values:
        one = map_of_starts.sel(state=state)
        regime = "attractive" if float(one.phase.sel(tone=1)) > 90.0 else "repulsive"
        shares[zc, regime] = float(one.share)
        print(f"{zc}: {float(one.share):6.1%} of the starts end in the {regime} state")
plt.show()

# sphinx_gallery_start_ignore
assert shares["24 nm", "attractive"] > 0.9 and shares["23 nm", "repulsive"] > 0.9
folds = states.zc.values[states.special.values == "fold"]
inward = float(curve.jump_zc.values[curve.jump_direction.values == "approach"][0])
outward = float(curve.jump_zc.values[curve.jump_direction.values == "retract"][-1])
assert len(folds) == 2
assert -0.01e-9 < inward - folds.min() < 0.5e-9
assert abs(outward - folds.max()) < 0.05e-9
# sphinx_gallery_end_ignore

# %%
# *Every point is a start, its color the state it ends in; a dot marks the state itself. At 24 nm (left)
# nearly every start leads to the attractive state, one nanometer closer (right) nearly every one to the
# repulsive state, and only a small island around the attractive one is left.*
#
# The approach of the first picture stayed in that island all the way down to the fold, because nothing
# disturbed it. A real tip meets noise and edges, and leaves it earlier. That is why the jump of an instrument
# comes and goes.

# %%
# Stay in one regime
# ------------------
#
# The free amplitude decides. Repeat the approach for amplitudes from 5 to 60 nm and look at the phase at each
# set point:

free_amplitudes = np.linspace(5e-9, 60e-9, 56)
approach = df.Approach(zc={"start": "65 nm", "stop": "2 nm", "points": 316})
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
assert (phase[free_amplitudes < 20e-9] > 90.0).all()
assert (phase[free_amplitudes > 45e-9][:, set_points <= 0.95] < 90.0).all()
between = phase[(free_amplitudes > 25e-9) & (free_amplitudes < 35e-9)]
assert (between > 90.0).any() and (between < 90.0).any()
# sphinx_gallery_end_ignore

# %%
# *Phase at each set point and free amplitude, on approach. Blue: net attraction at every set point, with a
# free amplitude below some 20 nm. Red: net repulsion. At the amplitudes in between a change of set point
# crosses the border.*
#
# So, for this cantilever and sample:
#
# - to stay **attractive** (gentle, long-ranged), use a free amplitude well below 20 nm;
# - to stay **repulsive** (sharp, sensitive to stiffness), use one above 45 nm and a set point of 95 % or
#   less, or come from a point that is safely in the red and do not go near the border;
# - **avoid the middle**: there a phase image shows the border, not the sample.
#
# The border moves with the tip radius, the Hamaker constant and the cantilever. Change the case above to
# yours: a sharper tip or a weaker attraction moves it to smaller amplitudes, a higher `k/Q` too.
