r"""
Dissipation: adhesion or viscosity?
===================================

*My sample dissipates energy. Is it adhesion hysteresis or viscosity?* One phase image cannot separate the two. The dissipated
energy along an approach can: each process leaves another shape.
"""

# %%
# Two samples
# -----------
#
# Both samples have the same lever and modulus. The first dissipates by :doc:`adhesion hysteresis
# </forces/adhesion_hysteresis>`: more surface energy on retract than on approach. The second dissipates by
# :doc:`viscosity </forces/kelvin_voigt>` of the contact.

import matplotlib.pyplot as plt
import numpy as np

import dforce as df

case = df.Case(
    cantilever=df.Cantilever(f0="300 kHz", k="30 N/m", Q=400),
    drive=df.Drive(A0="30 nm"),
    tip=df.Tip(radius="10 nm"),
    sample=df.Sample(youngs_modulus="2 GPa", poisson_ratio=0.35),
    forces=[df.forces.Hertz()],
)
samples = {
    "adhesion hysteresis": case.replace(
        "forces",
        [df.forces.Hertz(), df.forces.AdhesionHysteresis(approach_energy="20 mJ/m^2", retract_energy="40 mJ/m^2")],
    ),
    "viscosity": case.replace(
        "forces", [df.forces.DMT(hamaker="4e-20 J"), df.forces.KelvinVoigt(viscosity="100 Pa s")]
    ),
}

# %%
# The forces in one tap
# ---------------------

figure, axes = plt.subplots(1, 2, figsize=(9, 3.5), layout="constrained", sharey=True)
for axis, (name, sample) in zip(axes, samples.items(), strict=True):
    tap = df.dwell(sample.replace("solver.points_per_period", 2048), zc="22 nm")
    inside = tap.distance < 2e-9
    axis.plot(tap.distance.where(inside) * 1e9, tap.force * 1e9)
    axis.set(title=name, xlabel="tip–sample distance (nm)")
axes[0].set_ylabel("force (nN)")
plt.show()

# %%
# *Force against distance in a tap. The area of the loop is the dissipated energy. Hysteresis shifts the whole retract
# down. Viscosity opens the loop in contact only, and more the faster and deeper the tip moves.*
#
# The energy along the approach
# -----------------------------

zc = np.linspace(34e-9, 5e-9, 146)
curves = {name: df.approach(sample, zc=zc) for name, sample in samples.items()}
eV = 1.602176634e-19

figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
for name, curve in curves.items():
    energy = curve.total_dissipated_energy / eV
    axis.plot(curve.amplitude_ratio, energy / energy.max(), label=name)
axis.set(xlabel="set point $A/A_0$", ylabel="dissipated energy / its maximum")
axis.legend()
plt.show()

# %%
# *Dissipated energy against the set point, each divided by its maximum. Read from right to left, as on approach. Hysteresis
# rises steeply at the first contact and is almost flat afterwards. Viscosity rises slowly to a maximum.*
#
# The energy that you measure
# ---------------------------
#
# Amplitude and phase alone give the same energy (Cleveland 1998), so this curve can be measured:

for name, curve in curves.items():
    here = df.at_set_point(curve, 0.7, ["total_dissipated_energy", "apparent_dissipated_energy", "phase"]).isel(
        crossing=-1
    )
    true, seen = float(here.total_dissipated_energy) / eV, float(here.apparent_dissipated_energy.squeeze()) / eV
    print(
        f"{name}: {true:.1f} eV dissipated, {seen:.1f} eV from amplitude and phase, phase {float(here.phase.squeeze()):.1f}°"
    )

# sphinx_gallery_start_ignore
low = {}
for name, curve in curves.items():
    energy = curve.total_dissipated_energy
    low[name] = float(
        df.at_set_point(curve, 0.3, ["total_dissipated_energy"]).total_dissipated_energy[-1] / energy.max()
    )
assert low["adhesion hysteresis"] > 0.9 and low["viscosity"] < 0.65
assert abs(true / seen - 1.0) < 0.02
# sphinx_gallery_end_ignore

# %%
# The two agree because the lever is driven by a force at resonance, in air. Over a driven base in liquid this formula
# fails: :doc:`phase in liquid <phase_in_liquid>`.
#
# The method is from R. García and others, *Phys. Rev. Lett.* **97**, 016103 (2006). To find the size of the loss in
# your own curve, :doc:`fit both models and compare <what_a_curve_tells>`.
