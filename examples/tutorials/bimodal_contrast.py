r"""
Bimodal contrast between two materials
======================================

*Two materials differ in their attraction to the tip, and your phase image shows nothing. Would a second mode show the
difference? How should you drive it?* This tutorial computes the contrast in both phases before the measurement.
"""

# %%
# Why one mode is blind
# ---------------------
#
# Without energy loss, the energy balance of the first mode fixes its phase: :math:`\sin\phi_1 = A_1/A_{01}`
# (see :doc:`/theory/identities`). The feedback keeps :math:`A_1` constant, so the phase is equal on every material. No feedback
# controls the second mode: its amplitude and phase follow the sample.
#
# The experiment
# --------------
#
# The case has two modes, a tone on each, and two materials with different Hamaker constants. The second frequency is 6.25
# times the first, so the whole motion repeats every four periods and is a periodic orbit.

import matplotlib.pyplot as plt
import numpy as np

import dforce as df
from dforce.core.units import show

case = df.Case(
    title="Bimodal, attractive regime",
    cantilever=df.Cantilever(
        modes=[{"f0": "70 kHz", "k": "2 N/m", "Q": 180}, {"f0": "437.5 kHz", "k": "78 N/m", "Q": 450}]
    ),
    drive=df.Drive(tones=[{"A0": "12 nm"}, {"A0": "0.4 nm"}]),
    tip=df.Tip(radius="10 nm"),
    sample=df.Sample(youngs_modulus="2 GPa"),
    forces=[df.forces.DMT(hamaker="4e-20 J")],
)
materials = {"A: H = 4e-20 J": "4e-20 J", "B: H = 8e-20 J": "8e-20 J"}
zc = np.linspace(17e-9, 4e-9, 66)
curves = {name: df.approach(case.replace("forces.dmt.hamaker", H), zc=zc) for name, H in materials.items()}

# %%
# An image is taken at a set point, not at a distance. So draw both phases against the amplitude of the first mode.

figure, panels = plt.subplots(1, 2, figsize=(9, 4), layout="constrained", sharex=True)
for (name, curve), line in zip(curves.items(), ("-", "--"), strict=True):
    ratio = curve.amplitude.sel(tone=1) / 12e-9
    for panel, tone in zip(panels, (1, 2), strict=True):
        panel.plot(ratio, curve.phase.sel(tone=tone), line, label=name)
        panel.set(xlabel="set point $A_1/A_{01}$", ylabel=f"phase lag of tone {tone} (°)")
panels[0].legend()
plt.show()

# %%
# *Phase of the first tone (left) and the second (right) against the set point, for the two materials. On the left the two
# curves coincide; on the right they are several degrees apart.*
#
# The contrast at some set points:

set_points = np.array([0.95, 0.9, 0.8, 0.7, 0.6])


def at_set_points(curve, tone):
    states = (df.at_set_point(curve, set_point, ["phase"]).isel(crossing=0) for set_point in set_points)
    return np.array([float(state.phase[tone - 1]) for state in states])


def contrast(pair, tone):
    first, second = (at_set_points(curve, tone) for curve in pair)
    return first - second


print("set point   phase 1   phase 2   (A minus B, degrees)")
for ratio, one, two in zip(set_points, contrast(curves.values(), 1), contrast(curves.values(), 2), strict=True):
    print(f"{ratio:9.0%}   {one:7.1f}   {two:7.1f}")

# sphinx_gallery_start_ignore
assert np.all(abs(contrast(curves.values(), 1)) < 1.0)
assert np.all(abs(contrast(curves.values(), 2)) > 4.0)
# sphinx_gallery_end_ignore

# %%
# The material with the *weaker* attraction shows the larger lag, because of the set point. To lose the same amplitude the tip
# must come closer to this material. There the force changes faster with the distance, and the second mode feels this gradient.
#
# How large should the second amplitude be?
# -----------------------------------------

amplitudes = (0.1e-9, 0.2e-9, 0.4e-9, 0.8e-9)
gained = []
for A02 in amplitudes:
    driven = case.replace("drive.tones.2.A0", A02)
    pair = [df.approach(driven.replace("forces.dmt.hamaker", H), zc=zc) for H in materials.values()]
    gained.append(contrast(pair, 2))

figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
for column, ratio in list(enumerate(set_points))[1:4]:
    axes.plot(np.array(amplitudes) * 1e9, [row[column] for row in gained], "o-", label=f"set point {ratio:.0%}")
axes.set(xlabel="free amplitude of tone 2 (nm)", ylabel="contrast in phase 2 (°)", ylim=(0, None))
axes.legend()
plt.show()

# %%
# *Contrast in the second phase against the free amplitude of the second tone. The smaller the second
# amplitude, the larger the contrast, until it levels off.*
#
# A small second amplitude is a gentle probe with a large phase shift, but it must stay above the noise. The thermal motion of
# the second mode is :math:`\sqrt{k_B T/k_2}`:

thermal = np.sqrt(1.380649e-23 * 298.15 / 78.0)
print(f"{thermal * 1e12:.1f} pm over the whole bandwidth; a lock-in passes only a part of it")

# sphinx_gallery_start_ignore
table = np.array(gained)
assert np.all(np.diff(table[:, 1:4], axis=0) < 0.5)
assert np.all(table[0, 1:4] > table[-1, 1:4])
# sphinx_gallery_end_ignore

# %%
# Is it gentle?
# -------------

for name, curve in curves.items():
    one = df.at_set_point(curve, 0.8).isel(crossing=0)
    force, depth = show(float(one.min_force), "N", 3), show(float(one.max_indentation), "m", 2)
    print(f"{name}: lowest force {force}, indentation {depth}")

# sphinx_gallery_start_ignore
assert all(float(curve.max_indentation.max()) < 0.05e-9 for curve in curves.values())
assert all(float(curve.phase.sel(tone=1).min()) > 90.0 for curve in curves.values())
# sphinx_gallery_end_ignore

# %%
# The first phase stays above 90° throughout: the whole experiment is in the attractive regime, and the tip hardly touches. At a
# larger first amplitude it would jump (:doc:`why_the_phase_jumps`), and both phases would show the jump instead of the
# material. The first phase also shows a difference in dissipation. To see it, add a viscous contact
# (:doc:`kelvin_voigt </forces/kelvin_voigt>`) and a drive that taps, and compare the two phases again.
