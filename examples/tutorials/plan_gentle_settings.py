r"""
Plan the gentlest settings
==========================

*A protein tolerates 100 pN and an indentation of a fifth of its height. Which free amplitude and set point do you choose in
liquid, and how far may they drift?* This tutorial states the limits, lets dForce plan, and checks the answer with the motion.
"""

# %%
# The instrument and the sample
# -----------------------------
#
# The lever is soft and in liquid; the sample is a protein of 5 nm on a support.

import matplotlib.pyplot as plt

import dforce as df

case = df.Case(
    title="A soft protein in liquid",
    cantilever=df.Cantilever(f0="20 kHz", k="0.1 N/m", Q=3.0),
    drive=df.Drive(A0="2 nm"),
    tip=df.Tip(radius="5 nm"),
    sample=df.Sample(youngs_modulus="50 MPa", poisson_ratio=0.3, thickness="5 nm"),
    forces=[df.forces.DMT(hamaker="1e-21 J"), df.forces.KelvinVoigt(viscosity="5 Pa s")],
)

# %%
# The limits
# ----------
#
# The force and the indentation are limited. No other state may exist at the same distance: a jump would hit the protein. A set
# point drifts, and a free amplitude has an error of some percent, so the limits must hold within margins.

plan = df.plan(
    case,
    vary={"drive.A0": {"start": "0.9 nm", "stop": "2.4 nm", "points": 11}},
    set_points={"start": 0.7, "stop": 0.94, "points": 7},
    limits={
        "peak_force": "< 100 pN",
        "max_indentation": "< 20 % of sample.thickness",
        "states": "one",
        "margin": {"set_point": 0.03, "drive.A0": "5 %"},
    },
    goal={"minimize": "peak_force"},
)
axes = df.plot.plan(plan)
plt.show()

# %%
# *Free amplitude and set point. All limits hold in the green part. Elsewhere the color shows the limit that fails. Dots are the
# boundary as it was located. The red dot has the most room around it, the dashed box is its margins, and the star has the
# lowest force of all.*
#
# The star lies at the edge of the search: the smaller the amplitude, the lower the force. The red dot is for an experiment that
# drifts.


def told(mark: str) -> str:
    """Return a marked point of the plan as text."""
    point = plan.where(plan[mark], drop=True).squeeze()
    force, depth = 1e12 * float(point.peak_force), 1e9 * float(point.max_indentation)
    return (
        f"A0 = {1e9 * float(point.A0):.2f} nm, set point {float(point.set_point):.2f}: {force:.0f} pN, {depth:.2f} nm"
    )


for mark in ("recommended", "best"):
    print(f"{mark}: {told(mark)}")

# %%
# How large may the amplitude be at most?
# ---------------------------------------
#
# The plan locates the boundary of 100 pN between its values:

for share, amplitude in sorted(zip(plan.edge_set_point.values, plan.edge_A0.values, strict=True)):
    print(f"set point {share:.3f}: {1e9 * amplitude:.3f} nm")

# %%
# The motion there
# ----------------
#
# The plan contains the motion at its recommended point, and the case for a dwell there.

dwell = df.run(df.Case.from_toml(plan.attrs["recommended_case"]))
df.plot.traces(dwell, periods=2)
plt.show()

# %%
# *Two periods at the recommended point: deflection, velocity, distance and force. The force stays below 100 pN.*

# sphinx_gallery_start_ignore
import numpy as np

marked = plan.peak_force.where(plan.recommended).max()
assert int(plan.recommended.sum()) == 1 and int(plan.best.sum()) == 1
assert float(marked) < 100e-12 and float(dwell.force.max()) < 100e-12
assert np.isclose(float(dwell.peak_force), float(marked), rtol=1e-3)
assert float(plan.A0.where(plan.best.any(["set_point", "state"]), drop=True)[0]) == float(plan.A0[0])
assert set(plan.edge_kind.values.tolist()) <= {"peak_force", "max_indentation"}
# sphinx_gallery_end_ignore
