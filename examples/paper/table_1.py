"""
Table 1: two motions, by every integrator
=========================================

Table 1 of the paper lists the parameters of two motions at zc = 4 nm, for a comparison of integrators. It prints no results.
This page prints the results, and shows the errors of the integrators of dForce at their defaults.
"""

# %%
# Amplitude modulation
# --------------------

import matplotlib.pyplot as plt
import numpy as np

import dforce as df

WAYS = {
    "periodic orbit (RK4, 256 samples)": df.SolverSettings(),
    "transient, RK4": df.SolverSettings(method="transient"),
    "transient, LSODA": df.SolverSettings(integrator="lsoda"),
    "transient, engine": df.SolverSettings(method="transient", integrator="engine"),
}
exact = df.SolverSettings(method="transient", integrator="engine", relative_tolerance=1e-12, settle_tolerance=1e-10)
am = df.example("table-1-am")
reference = df.dwell(am.replace(solver=exact))
line = "{:36s} {:>12s} {:>10s} {:>10s} {:>12s}"
print(line.format("amplitude modulation", "A (nm)", "φ (°)", "F (pN)", "δ (pm)"))
errors = {}
for name, result in [
    *((name, df.dwell(am.replace(solver=solver))) for name, solver in WAYS.items()),
    ("reference", reference),
]:
    values = [float(result[key].squeeze()) for key in ("amplitude", "phase", "peak_force", "max_indentation")]
    print(
        line.format(
            name, f"{values[0] * 1e9:.7f}", f"{values[1]:.5f}", f"{values[2] * 1e12:.4f}", f"{values[3] * 1e12:.4f}"
        )
    )
    errors[name] = abs(values[0] / float(reference.amplitude.squeeze()) - 1.0)

# %%
# The largest Floquet multiplier of the orbit shows how fast it settles. The product of both multipliers equals exp(-2π/Q), the
# damping alone, because Hertz' force dissipates no energy:

orbit = df.dwell(am.replace("solver.points_per_period", 2048))
multipliers = orbit.multiplier_modulus.values
print(f"multipliers {multipliers}, product {multipliers.prod():.8f}, exp(-2π/Q) = {np.exp(-2.0 * np.pi / 100.0):.8f}")

# %%
# Bimodal
# -------
#
# The tones at 48.9 and 282 kHz have no short common period. The motion does not repeat, so dForce measures it over a long
# window. Amplitudes and phases refer to the total deflection. Both drives and the force act on both modes.

bimodal = df.run(df.example("table-1-bimodal"))
for tone in (1, 2):
    a, lag = (float(bimodal[name].sel(tone=tone)) for name in ("amplitude", "phase"))
    print(f"tone {tone}: amplitude {a * 1e9:.4f} nm, phase {lag:.2f}°")
print(
    f"peak force {float(bimodal.peak_force) * 1e9:.4f} nN, indentation {float(bimodal.max_indentation) * 1e12:.1f} pm"
)

# %%
# One picture
# -----------

figure, axes = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
names = [name for name in errors if name != "reference"]
axes[0].barh(names, [max(errors[name], 1e-12) for name in names])
axes[0].set(xscale="log", xlabel="relative error of the amplitude", xlim=(1e-10, 1e-5))
axes[0].invert_yaxis()
window = bimodal.isel(time=slice(0, 6 * bimodal.attrs["samples_per_period"]))
axes[1].plot(window.time * 1e6, window.force * 1e9)
axes[1].set(xlabel="time (µs)", ylabel="force, bimodal (nN)")
plt.show()

# %%
# *Left: the error of each integrator at its defaults, relative to the engine with tight tolerances. All errors are far below
# the errors of an experiment. Right: the force of the bimodal motion; no two peaks are alike.*

# sphinx_gallery_start_ignore
assert abs(float(reference.amplitude.squeeze()) - 4.0553735e-9) < 1e-16
assert abs(float(reference.phase.squeeze()) - 54.20379) < 1e-5
assert max(errors.values()) < 1e-5
assert abs(multipliers[0] - 0.9691) < 5e-5
assert abs(multipliers.prod() - np.exp(-2.0 * np.pi / 100.0)) < 1e-6
assert abs(float(bimodal.amplitude[0]) - 3.2273e-9) < 3e-12
# sphinx_gallery_end_ignore
