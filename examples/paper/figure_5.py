"""
Figure 5: a viscoelastic sample
===============================

The sample is soft (50 MPa) and viscous (100 Pa s), at zc = 0.2 nm. In the paper the force pulls on withdrawal: *"an attractive
force ... due to the viscoelastic response of the material"*. The amplitude is *"slightly smaller"*. The paper prints no
numbers. Equation 20 has a wrong dimension as printed; here the viscous force is η √(R δ) dδ/dt.
"""

# %%
# With and without viscosity
# --------------------------

import matplotlib.pyplot as plt

import dforce as df

case = df.example("figure-5")
viscous = df.dwell(case)
elastic = df.dwell(case.replace(forces=[df.forces.Hertz()]))

print(f"{'':26s} {'elastic':>9s} {'viscous':>9s}")
for label, name, scale in (
    ("amplitude (nm)", "amplitude", 1e-9), ("phase lag (°)", "phase", 1.0), ("peak force (pN)", "peak_force", 1e-12),
    ("lowest force (pN)", "min_force", 1e-12), ("dissipated energy (eV)", "total_dissipated_energy", 1.602176634e-19),
):  # fmt: skip
    print(f"{label:26s} {float(elastic[name].squeeze()) / scale:9.3f} {float(viscous[name].squeeze()) / scale:9.3f}")

# %%
# One picture
# -----------

figure, axes = plt.subplots(1, 3, figsize=(12, 4), layout="constrained")
for result, label, style in ((elastic, "elastic", "--"), (viscous, "viscous", "-")):
    period = result.isel(time=slice(0, result.attrs["samples_per_period"] + 1))
    axes[0].plot(period.distance * 1e9, period.force * 1e12, style, label=label)
    two = result.isel(time=slice(0, 2 * result.attrs["samples_per_period"] + 1))
    axes[1].plot(two.time * 1e6, two.deflection * 1e9, style, label=label)
    axes[2].plot(two.time * 1e6, two.force * 1e12, style, label=label)
axes[0].set(xlabel="tip–surface distance (nm)", ylabel="force (pN)")
axes[1].set(xlabel="time (µs)", ylabel="deflection (nm)")
axes[2].set(xlabel="time (µs)", ylabel="force (pN)")
for panel in (axes[0], axes[2]):
    panel.axhline(0.0, color="0.6", linewidth=0.8)
axes[0].legend(fontsize="small")
plt.show()

# %%
# *Force against distance over one period (the area of the loop is the dissipated energy), deflection and force in time. The
# viscous contact pulls at the tip on withdrawal, although the sample has no adhesion. The amplitude is a little smaller, and
# the motion lags behind. So the statements of the paper follow from its parameters.*

# sphinx_gallery_start_ignore
assert abs(float(viscous.amplitude.squeeze()) * 1e9 - 2.3755) < 1e-3
assert abs(float(elastic.amplitude.squeeze()) * 1e9 - 2.54) < 0.01
assert float(viscous.min_force) < -30e-12 < 0.0 == float(elastic.min_force)
# sphinx_gallery_end_ignore
