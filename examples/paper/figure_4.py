"""
Figure 4: a hard and a soft sample
==================================

The same lever (k = 10 N/m, Q = 100, A0 = 10 nm) taps on samples of 50 GPa and 50 MPa, without attraction. The paper makes
three statements. The slope of the amplitude is nearly 1 on the hard sample, and about 0.7 on the soft sample. The phase falls
faster on the hard sample. Harmonics are higher on the hard sample.
"""

# %%
# Both curves
# -----------

import matplotlib.pyplot as plt
import numpy as np

import dforce as df

curves = {name: df.run(df.example(f"figure-4-{name}")).squeeze("tone") for name in ("hard", "soft")}


def mean_slope(curve, low, high):
    """Return the mean slope of the amplitude between two distances (nm)."""
    part = curve.sel(zc=slice(high * 1e-9, low * 1e-9))
    return float(np.polyfit(part.zc, part.amplitude, 1)[0])


local = curves["soft"].amplitude.differentiate("zc")
slopes = {zc: float(local.sel(zc=zc * 1e-9, method="nearest")) for zc in (1.5, 2.5, 5.0)}
print("hard, printed nearly 1:", f"{mean_slope(curves['hard'], 2.0, 9.0):.3f} over 2 to 9 nm")
print("soft, printed about 0.7:", ", ".join(f"{slope:.3f} at {zc:g} nm" for zc, slope in slopes.items()))
for low, high in ((1.0, 5.0), (2.0, 9.0)):
    print(f"soft, mean over {low:g} to {high:g} nm: {mean_slope(curves['soft'], low, high):.3f}")

# %%
# The slope on the soft sample depends on the distance: it is 0.7 near 1.5 nm, and smaller farther away.

spectra = {name: df.dwell(df.example(f"figure-4-{name}"), "5 nm").harmonic_amplitude for name in curves}
for name, harmonics in spectra.items():
    print(f"{name}: second harmonic at 5 nm {float(harmonics.sel(harmonic=2)) * 1e12:.1f} pm")

# %%
# One picture
# -----------

figure, axes = plt.subplots(1, 3, figsize=(12, 4), layout="constrained")
for name, curve in curves.items():
    axes[0].plot(curve.zc * 1e9, curve.amplitude * 1e9, label=f"{name} sample")
    axes[1].plot(curve.zc * 1e9, curve.phase, label=f"{name} sample")
    axes[2].semilogy(spectra[name].harmonic, spectra[name] * 1e9, "o-", label=f"{name} sample")
for at, slope in (
    ((5.0, 5.0), 1.0),
    ((1.5, float(curves["soft"].amplitude.sel(zc=1.5e-9, method="nearest")) * 1e9), 0.7),
):
    x = np.array([at[0] - 1.2, at[0] + 1.2])
    axes[0].plot(x, at[1] + slope * (x - at[0]), "--", color="C3", label=f"printed slope {slope:g}")
axes[0].set(xlabel="average distance (nm)", ylabel="amplitude (nm)")
axes[1].set(xlabel="average distance (nm)", ylabel="phase lag (°)")
axes[2].set(xlabel="harmonic", ylabel="amplitude at 5 nm (nm)")
axes[0].legend(fontsize="x-small")
plt.show()

# %%
# *Amplitude and phase against distance, and the harmonics at 5 nm. All three statements of the paper follow from its
# parameters. The slope is 0.7 where the dashed line touches the curve.*

# sphinx_gallery_start_ignore
assert abs(mean_slope(curves["hard"], 2.0, 9.0) - 0.998) < 2e-3
assert np.allclose([slopes[1.5], slopes[2.5]], [0.715, 0.625], atol=5e-3)
assert abs(float(spectra["hard"].sel(harmonic=2)) * 1e12 - 28.3) < 0.1
assert abs(float(spectra["soft"].sel(harmonic=2)) * 1e12 - 8.8) < 0.1
# sphinx_gallery_end_ignore
