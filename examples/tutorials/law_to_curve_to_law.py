r"""
Which force made this curve?
============================

*You have a tapping curve, amplitude and phase against height, with its noise. Which force made it?* This tutorial computes such
a curve from a law, hides the law, reconstructs the force without a model, and compares both at the end.
"""

# %%
# The curve
# ---------
#
# The curve is in air, with a free amplitude of 20 nm and the noise of a good instrument: 4 pm and 0.05 degrees per point. The
# approach jumps from attraction to repulsion, as on most curves.

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
# The attributes of the curve describe the instrument, so no case is needed.

found = df.reconstruct(measured)
print(found.attrs["notes"])

# %%
# The gray stretch in the picture below is the gap of the jump. No motion has a turning point there, so the force is unknown and
# not drawn. Nearer to the sample the error of the force is larger, because each tap goes through the gap.

# %%
# The truth
# ---------
#
# The law was DMT. The picture compares it with the reconstruction:

truth = df.force_curve(case, distance=found.distance.values[::-1]).force.sel(direction="approach")
found["law_force"] = ("distance", truth.values[::-1])
axes = df.plot.reconstruction(found)
plt.show()

# %%
# *Force against distance: the law (gray), the reconstruction with a band of two errors (blue), and the gap of the jump.*
#
# The deviation, relative to the estimated error:

off = (abs(found.force - found.law_force) / found.force_error).dropna("distance")
print(f"within one error: {100 * float((off < 1).mean()):.0f} %, within two: {100 * float((off < 2).mean()):.0f} %")

# sphinx_gallery_start_ignore
assert found.sizes["gap"] >= 1
assert float((off < 3).mean()) > 0.9
# sphinx_gallery_end_ignore
