r"""
Phase in liquid: the effect of the drive
========================================

*In water you tune the drive, engage, and the phase goes from 90° to 99° while you tap. Does the sample attract the tip? Does it
dissipate energy?* In air, base excitation and a force on the tip yield the same curves. In liquid they differ. This tutorial
taps one elastic sample with both, and compares the usual formulas.
"""

# %%
# One sample, two drives
# ----------------------
#
# The lever is soft and in water, with a quality factor of 2.5. The sample is elastic: it dissipates no energy,
# although some formulas show a loss.

import matplotlib.pyplot as plt

import dforce as df

eV = 1.602176634e-19  # J

by_force = df.Case(
    title="A soft lever in water",
    cantilever=df.Cantilever(f0="25 kHz", k="0.1 N/m", Q=2.5),
    drive=df.Drive(A0="10 nm"),
    tip=df.Tip(radius="10 nm"),
    sample=df.Sample(youngs_modulus="50 MPa", poisson_ratio=0.5),
    forces=[df.forces.DMT(hamaker="5e-21 J")],
)
by_base = by_force.replace("drive.excitation", "base")

# %%
# `excitation = "force"` is magnetic or photothermal drive, a force on the lever itself. `"base"` is the piezo under the chip.
# Both have the same free amplitude of 10 nm. For it the base must move by
#
# .. math:: Y = \frac{A_0}{\chi \sqrt{1 + Q^2}}, \qquad \chi = 1.566,
#
# a quarter of the amplitude:

print(f"the base moves by {abs(by_base.problem.base[0]) * 1e9:.2f} nm")
# sphinx_gallery_start_ignore
assert abs(abs(by_base.problem.base[0]) * 1e9 - 2.371613) < 1e-5
# sphinx_gallery_end_ignore

# %%
# So the motion of the tip (base and deflection together) differs from the signal of the optical lever, the deflection.
#
# The curves
# ----------

zc = {"start": "13 nm", "stop": "4 nm", "points": 91}
curves = {"force": df.approach(by_force, zc), "base": df.approach(by_base, zc)}

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.5), constrained_layout=True)
for name, curve in curves.items():
    left.plot(curve.zc * 1e9, curve.amplitude[:, 0] * 1e9, label=name)
    right.plot(curve.zc * 1e9, curve.phase[:, 0], label=name)
left.set(xlabel="average distance (nm)", ylabel="amplitude (nm)")
right.set(xlabel="average distance (nm)", ylabel="phase lag (°)")
right.axhline(90.0, color="gray", linewidth=0.8)
left.legend(title="driven by")
plt.show()

# %%
# *Amplitude (left) and phase lag behind the drive (right). The amplitudes are similar; the phases differ, even in free motion.*
#
# In free motion, far from the sample, the phase under base excitation is not 90° but
#
# .. math:: 90° + \arctan\frac{1}{Q} = 111.8°,
#
# because the water at rest also drags on the moving lever.

far = curves["base"].isel(zc=0)
print(f"driven by the base, free: {far.phase.item():.1f}°")
# sphinx_gallery_start_ignore
assert abs(far.phase.item() - 111.8014) < 0.05
# sphinx_gallery_end_ignore

# %%
# At one distance
# ---------------

place = "7 nm"
states = {
    "force": df.dwell(by_force, place), "base": df.dwell(by_base, place),
    "base, 90° free": df.dwell(by_base.replace("readout.phase_reference", "free"), place),
}  # fmt: skip
for name, state in states.items():
    print(f"{name:15s} A = {state.amplitude.item() * 1e9:5.2f} nm, phase = {state.phase.item():6.2f}°")
# sphinx_gallery_start_ignore
assert abs(states["force"].phase.item() - 70.8005851) < 1e-3
assert abs(states["base"].phase.item() - 99.0085364) < 1e-3
assert abs(states["base, 90° free"].phase.item() - 77.207) < 0.05
# sphinx_gallery_end_ignore

# %%
# Sample, distance and free amplitude are equal, but the two phases differ by 28°. The third line is the phase of most
# instruments, set to 90° in free motion (`readout.phase_reference = "free"`). It is below 90° for both drives, but differs by
# 6°.
#
# The conclusion of each formula
# ------------------------------
#
# *Attractive or repulsive?* In air a phase above 90° means that the mean force times the deflection (the virial) is attractive.
# The virial itself shows the truth:

for name in ("force", "base"):
    state = states[name]
    rule = "attractive" if state.phase.item() > 90.0 else "repulsive"
    truth = "attractive" if state.virial.item() > 0.0 else "repulsive"
    print(f"{name:6s} by the phase {rule}, by the mean force {truth}")
# sphinx_gallery_start_ignore
assert states["base"].virial.item() < 0.0 and states["force"].virial.item() < 0.0
# sphinx_gallery_end_ignore

# %%
# With base excitation the rule fails: 99° looks attractive, but the tip is pushed away.
#
# *How much energy does the sample dissipate?* Cleveland's formula uses amplitude and phase,
#
# .. math:: E = \frac{\pi k A}{Q} \left( A_0 \sin\phi - A \right).
#
# dForce computes this formula as `apparent_dissipated_energy`, beside the dissipated energy:

for name, state in states.items():
    apparent, taken = (state[key].item() / eV for key in ("apparent_dissipated_energy", "total_dissipated_energy"))
    print(f"{name:15s} formula {apparent:6.2f} eV a period, taken {abs(taken):.2f} eV")
# sphinx_gallery_start_ignore
assert abs(states["base"].apparent_dissipated_energy.item() / eV - 5.6976) < 2e-3
assert abs(states["force"].apparent_dissipated_energy.item() / eV - 0.9407) < 2e-3
assert abs(states["base"].total_dissipated_energy.item() / eV) < 1e-3
# sphinx_gallery_end_ignore

# %%
# The formula yields 5.7 eV a period. A map would show dissipation on a sample that dissipates nothing. Even under a force it is
# 0.9 eV: the harmonics lose this energy in the water. The missing energy came through the base:

state = states["base"]
own, base = state.dissipated_energy.sum().item() / eV, state.base_energy.item() / eV
print(f"from the mode {own:.2f} eV, from the base {base:.2f} eV; the rest, {-(own + base):.2f} eV, are harmonics")

# %%
# Advice
# ------
#
# - Set the drive of your lever: `excitation = "base"` for a piezo. `df.advice` computes the motion of the base.

for piece in df.advice(by_base):
    if piece.name == "base_in_liquid":
        print(piece.text)

# %%
# - Compare amplitudes and phases with a simulation of the same signal, not energies from a formula: change the sample in the
#   case until both curves agree.
# - Or use a photothermal or magnetic drive. Then the phase has the same meaning as in air.
# - Find out how much of the water moves with the base. If the whole cell is shaken (`fluid_follows = 1`), the base must move
#   several times as far:

cell = by_base.replace("cantilever.added_mass", 0.8)
for share in (0.0, 0.5, 1.0):
    moved = abs(cell.replace("drive.fluid_follows", share).problem.base[0])
    print(f"fluid_follows = {share}: the base moves by {moved * 1e9:5.2f} nm")
# sphinx_gallery_start_ignore
assert abs(moved * 1e9 - 12.771526549) < 1e-6
# sphinx_gallery_end_ignore

# %%
# See :doc:`/theory/instrument` for the equations, and :doc:`/noise` for thermal motion and the noise of the detector.
