r"""
A soft sample in liquid, without breaking it
============================================

*You image a protein or a membrane in water. The force must stay below 200 pN, and the indentation below 2 nm.
Which free amplitude and which set point may you use?* The instrument shows amplitude and phase, not the peak force. This
tutorial computes the peak force for all settings at once.
"""

# %%
# The experiment
# --------------
#
# The cantilever is small and soft, in water, with a low quality factor; the sample has 20 MPa. The force is an elastic contact,
# :doc:`hertz </forces/hertz>`: in a buffer with enough salt the attraction is small.

import matplotlib.pyplot as plt
import numpy as np

import dforce as df

case = df.Case(
    title="A soft sample in water",
    cantilever=df.Cantilever(f0="25 kHz", k="0.1 N/m", Q=2),
    drive=df.Drive(A0="10 nm"),
    tip=df.Tip(radius="20 nm"),
    sample=df.Sample(youngs_modulus="20 MPa", poisson_ratio=0.5),
    forces=[df.forces.Hertz()],
    experiment=df.experiments.Approach(zc={"start": "26 nm", "stop": "-2 nm", "points": 141}),
)

# %%
# First read the advice on the model:

for piece in df.advice(case):
    print(f"{piece.name}: {piece.text}\n")

# %%
# The advice on the low quality factor matters: these numbers are valid for a lever that is driven directly (by light, or a
# magnet), not for base excitation.
#
# One curve
# ---------

curve = df.run(case)
df.plot.curve(curve, ["amplitude", "peak_force"])
plt.show()

# %%
# *Amplitude and peak force against the average distance. The amplitude falls slowly, because the sample is soft. The peak force
# rises steeply at the first touch, and more slowly from then on.*
#
# So a lower set point costs little after the first touch, but a larger free amplitude costs much.
#
# All amplitudes and set points
# -----------------------------
#
# `sweep` repeats the approach for many free amplitudes, side by side. It takes a few seconds for all 37.

free_amplitudes = np.linspace(1e-9, 19e-9, 37)
quantities = ["amplitude_ratio", "peak_force", "max_indentation"]
grid = df.sweep(case, over={"drive.A0": free_amplitudes}, quantities=quantities)
print(dict(grid.sizes))

# %%
# An instrument keeps the amplitude at a set point, and the distance follows. So for each free amplitude, read the forces at
# amplitudes from 50 % to 98 % of the free amplitude.

set_points = np.linspace(0.5, 0.98, 49)
states = [df.at_set_point(grid, set_point, ["peak_force", "max_indentation"]) for set_point in set_points]
print(states[0])

# %%
# `crossing` counts the states: here each amplitude occurs once, at the distance `zc`.

force = np.transpose([state.peak_force.isel(crossing=0) * 1e12 for state in states])
depth = np.transpose([state.max_indentation.isel(crossing=0) * 1e9 for state in states])

# sphinx_gallery_start_ignore
assert all(state.sizes["crossing"] == 1 and state.zc.notnull().all() for state in states)
# sphinx_gallery_end_ignore

figure, axes = plt.subplots(figsize=(6.5, 4.5), layout="constrained")
filled = axes.contourf(
    set_points, free_amplitudes * 1e9, force, levels=np.geomspace(20, 5000, 21), norm="log", cmap="cividis"
)
figure.colorbar(filled, label="peak force (pN)", ticks=[20, 50, 100, 200, 500, 1000, 2000, 5000], format="%d")
for levels, values, color, text in (([200.0], force, "white", "200 pN"), ([2.0], depth, "red", "2 nm")):
    lines = axes.contour(set_points, free_amplitudes * 1e9, values, levels=levels, colors=color)
    axes.clabel(lines, fmt=text)
axes.set(xlabel="set point $A/A_0$", ylabel="free amplitude $A_0$ (nm)")
plt.show()

# %%
# *Peak force (color) against set point and free amplitude. Below the white line the force is under 200 pN, below the red line
# the indentation is under 2 nm. The lines are nearly flat: the free amplitude matters most.*
#
# The largest free amplitudes within both limits:

for set_point in (0.7, 0.8, 0.9, 0.95):
    column = int(np.argmin(abs(set_points - set_point)))
    kept = (force[:, column] < 200.0) & (depth[:, column] < 2.0)
    print(f"set point {set_point:.0%}: A0 up to {free_amplitudes[kept].max() * 1e9:.1f} nm")

# %%
# If the sample is softer or stiffer than expected
# ------------------------------------------------
#
# The modulus of a new sample is unknown. At a free amplitude of 2 nm and a set point of 90 %:

moduli = np.geomspace(2e6, 200e6, 9)
careful = case.set('drive.A0 = "2 nm"', 'experiment.zc = { start = "4 nm", stop = "-4 nm", points = 161 }')
softer = df.sweep(careful, over={"sample.youngs_modulus": moduli}, quantities=quantities)
chosen = df.at_set_point(softer, 0.9).isel(crossing=0)

felt, deep = chosen.peak_force.values, chosen.max_indentation.values
for modulus, force_felt, depth_felt in zip(moduli, felt, deep, strict=True):
    print(f"{modulus / 1e6:6.1f} MPa: {force_felt * 1e12:6.1f} pN, {depth_felt * 1e9:.2f} nm")

# sphinx_gallery_start_ignore
# the statements of the text on numbers
assert felt[-1] / felt[0] < 10.0 and deep[0] / deep[-1] < 40.0
assert np.all(np.diff(felt) > 0.0) and np.all(np.diff(deep) < 0.0)
flat = [free_amplitudes[(force[:, np.argmin(abs(set_points - s))] < 200.0)].max() for s in (0.5, 0.9)]
assert max(flat) < 2.0 * min(flat)
ten = int(np.argmin(abs(free_amplitudes - 10e-9)))
assert force[ten, 0] < 1.7 * force[ten, 40] < 1.7 * force[ten, 0]
# sphinx_gallery_end_ignore

# %%
# A hundred times the modulus costs only several times the force: the tip goes less deep into a stiffer sample. So the softest
# spot sets the limit in depth, the stiffest spot the limit in force.
#
# The motion at the chosen point
# ------------------------------

zc = float(chosen.zc.sel(youngs_modulus=20e6, method="nearest"))
trace = df.dwell(careful, zc=zc)
df.plot.traces(trace)
plt.show()
for finding in df.summary(trace):
    if finding.name in ("peak_force", "max_indentation", "contact_fraction", "contact_time"):
        print(f"{finding.label}: {finding.text}")

# %%
# *Deflection and force over three periods. At this Q a tap is long: the tip touches for a large part of the period,
# and the deflection is not a sinusoid.*
#
# Summary: in liquid first choose a small free amplitude, then any set point. Check the stiffest and the softest spot, and drive
# the lever directly. The advice names the limits of this model. If your sample has them, add attraction
# (:doc:`dlvo </forces/dlvo>`), viscosity (:doc:`kelvin_voigt </forces/kelvin_voigt>`) or a finite thickness
# (:doc:`bottom_effect </forces/bottom_effect>`).
