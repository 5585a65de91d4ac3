r"""
Maps: contrast, force, and cases by the thousand
================================================

*Which of two materials is brighter, and does this depend on their stiffness? How large may the free amplitude be before the
force breaks the sample? And if a thousand curves are not enough?* Each answer is one sweep and one picture.
"""

# %%
# Material contrast
# -----------------
#
# The sample is a polymer in air with a viscous contact, or without this loss. The sweep keeps only the states at a set point of
# 0.8. Distances are shares of the free amplitude, because it varies.

import matplotlib.pyplot as plt
import numpy as np

import dforce as df

lossy = df.Case(
    title="Polymer in air, set point 80 %",
    cantilever=df.Cantilever(f0="70 kHz", k="2.7 N/m", Q=180.0),
    drive=df.Drive(A0="40 nm"),
    tip=df.Tip(radius="8 nm"),
    sample=df.Sample(youngs_modulus="2 GPa", poisson_ratio=0.3),
    forces=[df.forces.DMT(hamaker="6e-20 J"), df.forces.KelvinVoigt(viscosity="50 Pa s")],
    experiment=df.experiments.Approach(zc={"of": "drive.A0", "start": 1.1, "stop": 0.7, "points": 17}),
)
over = {
    "sample.youngs_modulus": {"start": "0.3 GPa", "stop": "10 GPa", "points": 9, "spacing": "log"},
    "drive.A0": {"start": "34 nm", "stop": "64 nm", "points": 6},
}
kept = ["phase", "total_dissipated_energy"]
conservative = lossy.replace("forces.kelvin_voigt.viscosity", "0 Pa s")
maps = {
    "takes energy": df.sweep(lossy, over, at_set_point=0.8, quantities=kept).isel(crossing=0),
    "takes none": df.sweep(conservative, over, at_set_point=0.8, quantities=kept).isel(crossing=0),
}

axes = df.plot.map(maps["takes energy"], "A0", "youngs_modulus", "phase", levels=[54.0, 56.0, 58.0])
plt.show()

# %%
# *Phase lag of the lossy polymer over free amplitude and modulus; blue is net repulsion, red net attraction. In the red corner
# the approach is still in the attractive state at the set point.*
#
# The contrast has two causes. In the red corner a material looks bright because it is soft, with or without loss. In repulsion
# the loss is the only cause: without it :math:`\sin\phi = A/A_0`, so every modulus shows the same phase
# (:doc:`/theory/identities`).

for name, found in maps.items():
    repulsive = found.phase.isel(tone=0).where(found.regime == "repulsive")
    print(f"{name:12s}: {float(repulsive.min()):.2f} to {float(repulsive.max()):.2f} degrees in repulsion")

# sphinx_gallery_start_ignore
spans = [float(np.ptp(one.phase.values[one.regime.values == "repulsive"])) for one in maps.values()]
assert spans[0] > 4.0 and spans[1] < 0.05
attractive = (maps["takes energy"].regime == "attractive").values
assert attractive[0, 0] and not attractive[-1].any() and not attractive[:, -1].any()
# sphinx_gallery_end_ignore

# %%
# So a soft, lossy material is brighter than a stiff one, because it dissipates energy:

axes = df.plot.map(maps["takes energy"], "A0", "youngs_modulus", "total_dissipated_energy")
plt.show()

# %%
# *Energy that the sample dissipates in a period.*
#
# A limit of the force
# --------------------
#
# The sample is soft and in liquid. Left of the line of 100 pN, the tip may tap.

soft = df.Case(
    title="Soft sample in liquid, set point 80 %",
    cantilever=df.Cantilever(f0="20 kHz", k="0.1 N/m", Q=3.0),
    drive=df.Drive(A0="2 nm"),
    tip=df.Tip(radius="5 nm"),
    sample=df.Sample(youngs_modulus="50 MPa", poisson_ratio=0.3),
    forces=[df.forces.DMT(hamaker="1e-21 J"), df.forces.KelvinVoigt(viscosity="5 Pa s")],
    experiment=df.experiments.Approach(zc={"of": "drive.A0", "start": 1.4, "stop": 0.05, "points": 14}),
)
found = df.sweep(
    soft,
    over={
        "sample.youngs_modulus": {"start": "50 MPa", "stop": "5 GPa", "points": 9, "spacing": "log"},
        "drive.A0": {"start": "0.8 nm", "stop": "2.4 nm", "points": 5},
    },
    at_set_point=0.8,
    quantities=["peak_force"],
).isel(crossing=0)
axes = df.plot.map(found, "A0", "youngs_modulus", "peak_force", levels=[100e-12, 200e-12, 400e-12])
plt.show()

# %%
# *Peak force at a set point of 80 %, with lines of 100, 200 and 400 pN. The stiffer the sample, the smaller its largest free
# amplitude.*
#
# :doc:`plan_gentle_settings` finds such settings with margins.

# sphinx_gallery_start_ignore
force = found.peak_force.values
assert np.isfinite(force).all() and (np.diff(force, axis=0) > 0).all() and (np.diff(force, axis=1) > 0).all()
assert force.min() < 100e-12 and force.max() > 400e-12
# sphinx_gallery_end_ignore

# %%
# Cases by the thousand
# ---------------------
#
# A network that learns curves needs random samples and their curves. The case contains the seed and the random values, so the
# file does, too. The parameters lie along `case`, as the curves do.

count, seed = 60, 16  # a million: count = 1_000_000
draw = np.random.default_rng(seed)
rows = {
    "sample.youngs_modulus": np.exp(draw.uniform(np.log(0.3e9), np.log(10e9), count)),
    "forces.dmt.hamaker": draw.uniform(1e-20, 8e-20, count),
    "drive.A0": draw.uniform(10e-9, 60e-9, count),
}
case = lossy.replace(
    title=f"{count} random polymers: modulus by its logarithm, H and A0 evenly, numpy.random.default_rng({seed})",
    forces=[df.forces.DMT(hamaker="6e-20 J")],
)
df.sweep(case, rows=rows, quantities=["amplitude_ratio", "phase"], store="polymers.zarr")

# %%
# The store has one chunk for each block of cases, read on use. Every column has a name and a unit:

table = df.read("polymers.zarr")
print(table.attrs["title"])
for column_name, column in table.variables.items():
    words = column.attrs.get("long_name", "; ".join(str(column.attrs.get("flag_meanings", "")).split()))
    print(f"{column_name} {column.dims}: {words} ({column.attrs.get('units', '-')})")

# %%
# Points without a motion are NaN, and `status` has the reason. `table.to_dataframe().to_parquet("polymers.parquet")` makes a
# table, if pyarrow is installed. A million cases need the same lines: memory contains only the blocks in work, and after a
# stop `resume=True` continues (:doc:`/batch`).

# sphinx_gallery_start_ignore
assert table.sizes["case"] == count and (table.status == df.Status.OK).all()
np.testing.assert_array_equal(table["youngs_modulus"], rows["sample.youngs_modulus"])
assert all(column.attrs.get("long_name") or "status" in str(name) for name, column in table.data_vars.items())
import shutil

shutil.rmtree("polymers.zarr")
# sphinx_gallery_end_ignore
