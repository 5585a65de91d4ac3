r"""
Which force made this curve?
============================

*You have a tapping curve, amplitude and phase against height, with its noise. What does it tell of the force, without a model?*
This tutorial makes such a curve from a law, hides the law, reconstructs the force, and tells the truth at the end.
"""

# %%
# The curve
# ---------
#
# Air, a free amplitude of 20 nm, and the noise of a good instrument: 4 pm and 0.05 degrees a point. The approach jumps from
# attraction to repulsion, as most curves do.

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

import dforce as df

case = df.example("figure-3-air").replace("drive.A0", "20 nm")
curve = df.approach(case, zc=np.linspace(28e-9, 4e-9, 241), direction="approach")
generator = np.random.default_rng(5)
size = curve.sizes["zc"]
measured = xr.Dataset(
    {
        "height": ("point", curve.zc.values),
        "amplitude": ("point", curve.amplitude.values[:, 0] + 4e-12 * generator.standard_normal(size)),
        "phase": ("point", curve.phase.values[:, 0] + 0.05 * generator.standard_normal(size)),
    },
    attrs={
        "k": 0.9, "f0": 48.9e3, "Q": 255.0, "free_amplitude": 20e-9,
        "amplitude_error": 4e-12, "phase_error": 0.05,
    },
)  # fmt: skip

# %%
# The force
# ---------
#
# The instrument is in the attributes, so the curve is all that is needed.

found = df.reconstruct(measured)
print(found.attrs["notes"])

# %%
# The gray stretch is what the jump hides: no motion turned there, so the curve does not tell the force, and nothing is drawn
# through it. Below the gap the force is known with a larger error, for each tap goes through the gap.

# %%
# The truth
# ---------
#
# The law was DMT. Put beside the reconstruction:

truth = df.force_curve(case, distance=found.distance.values[::-1]).force.sel(direction="approach")
found["law_force"] = ("distance", truth.values[::-1])
axes = df.plot.reconstruction(found)
plt.show()

# %%
# *Force against distance: the law (gray), the reconstruction with a band of two errors (blue), and the gap of the jump.*
#
# How far is it off, in its own errors?

off = (abs(found.force - found.law_force) / found.force_error).dropna("distance")
print(f"within one error: {100 * float((off < 1).mean()):.0f} %, within two: {100 * float((off < 2).mean()):.0f} %")

# sphinx_gallery_start_ignore
assert found.sizes["gap"] >= 1
assert float((off < 3).mean()) > 0.9
# sphinx_gallery_end_ignore
