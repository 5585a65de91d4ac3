r"""
Free amplitudes for soft samples
================================

*Your samples are soft, from gels to polymers, and above about 100 pN they are damaged. How large may the free amplitude be
on each sample?* This tutorial computes the peak force at a set point over free amplitude and modulus, and draws the line of
100 pN. It is a map of many curves, each reduced to its state at the set point.
"""

# %%
# The experiment
# --------------
#
# The lever is soft and in water, with a low quality factor. Each curve goes from free motion down to the surface, so it reaches
# the set point at any free amplitude.

import matplotlib.pyplot as plt
import numpy as np

import dforce as df

case = df.Case(
    title="Peak force in water",
    cantilever=df.Cantilever(f0="25 kHz", k="0.05 N/m", Q=3.0),
    drive=df.Drive(A0="3 nm"),
    tip=df.Tip(radius="10 nm"),
    sample=df.Sample(youngs_modulus="50 MPa", poisson_ratio=0.5),
    forces=[df.forces.Hertz()],
    experiment=df.experiments.Approach(zc={"start": "5.5 nm", "stop": "0.1 nm", "points": 109}),
    sweep={
        "over": {
            "sample.youngs_modulus": {"start": "30 MPa", "stop": "3 GPa", "points": 13, "spacing": "log"},
            "drive.A0": {"start": "0.5 nm", "stop": "5 nm", "points": 10},
        }
    },
)

# %%
# One case file contains all settings (``print(case.to_toml())``), and ``dforce sweep CASE.toml -o map.zarr --at-set-point 0.8``
# computes it; here the same in Python. The sweep keeps only the state at a set point of 80 %.

states = df.sweep(case, quantities=["peak_force", "max_indentation", "phase"], at_set_point=0.8)
print(dict(states.sizes))

# %%
# The map
# -------
#
# Each curve reaches the set point once here, so the first state is the only state. The line is the limit of 100 pN.

first = states.isel(crossing=0)
axes = df.plot.map(first, "A0", "youngs_modulus", "peak_force", levels=[100e-12])
plt.show()

# %%
# *Peak force at a set point of 80 % over free amplitude and modulus (logarithmic). Left of and below the line the force stays
# below 100 pN.*
#
# The largest free amplitude that keeps to 100 pN, for some moduli:

for modulus in (3e7, 1e8, 3e8, 3e9):
    force = first.peak_force.sel(youngs_modulus=modulus, method="nearest")
    most = float(np.interp(100e-12, force, first.A0))
    print(f"{modulus / 1e6:6.0f} MPa: {1e9 * most:.1f} nm")

# %%
# On a stiffer sample the tap is harder and shorter, so its force rises with the modulus. A larger amplitude brings more energy
# into each impact. The map shows both effects, and the samples that need a smaller amplitude, a softer lever or a set point
# closer to 1.

# sphinx_gallery_start_ignore
assert states.sizes["crossing"] == 1
assert (first.peak_force.diff("A0") > 0.0).all() and (first.peak_force.diff("youngs_modulus") > 0.0).all()
assert float(first.peak_force[:, 0].max()) < 100e-12 < float(first.peak_force[:, -1].min())  # the line goes through
# sphinx_gallery_end_ignore
