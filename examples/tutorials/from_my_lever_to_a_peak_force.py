r"""
From my lever to a peak force
=============================

*I tap on polystyrene in air with a PPP-NCHR, a free amplitude of 20 nm and a set point of 80 %. How large is the peak
force?* The instrument never shows this force. This tutorial computes it from the lever, the tip and the sample.
"""

# %%
# The lever and the sample
# ------------------------
#
# dForce has the nominal f0 and k of common levers (``dforce cantilevers``). Q comes from your tune. Measured values replace the
# nominal ones: ``df.Cantilever(name="PPP-NCHR", f0="312 kHz", k="38 N/m", Q=420)``. ``dforce materials`` lists samples, each
# with its range and source.

import matplotlib.pyplot as plt

import dforce as df

case = df.Case(
    title="PPP-NCHR on polystyrene in air",
    cantilever=df.Cantilever(name="PPP-NCHR", Q=450),
    drive=df.Drive(A0="20 nm"),
    tip=df.Tip(radius="7 nm"),
    sample=df.Sample(name="polystyrene"),
    forces=[df.forces.DMT(hamaker="6.5e-20 J")],
)

# %%
# :doc:`dmt </forces/dmt>` is van der Waals attraction outside contact and an elastic contact inside.
# :doc:`Which model should I use? </which-model>` helps with other samples.
#
# The curve
# ---------

curve = df.approach(case, zc={"start": 1.25, "stop": 0.5, "of": "drive.A0"})
df.plot.curve(curve, ["amplitude", "peak_force"])
plt.show()

# %%
# *Amplitude and peak force against the average distance. The tip first feels attraction, then taps: the force rises.*
#
# The answer
# ----------

state = df.at_set_point(curve, 0.8, ["peak_force", "max_indentation", "phase"]).squeeze()
print("peak force ", df.show(float(state.peak_force), "N", 3))
print("indentation", df.show(float(state.max_indentation), "m", 3))
print(f"phase       {float(state.phase):.1f}°")

# %%
# A phase below 90° means net repulsion: the tip taps on the sample. If one set point has two states, the dataset contains
# both, along ``crossing``; then ask :doc:`why the phase jumps <why_the_phase_jumps>`.
#
# Read the advice
# ---------------
#
# dForce compares the result with the range of its models:

for piece in df.advice(curve):
    print(f"{piece.name}: {piece.text}\n")

# %%
# Which value matters most?
# -------------------------
#
# Radius and modulus are known poorly, the free amplitude to some percent. Halve and double each:

ratio = {}
grid = {"start": 1.25, "stop": 0.5, "of": "drive.A0"}
for path, values in {
    "tip.radius": ["3.5 nm", "7 nm", "14 nm"],
    "sample.youngs_modulus": ["1.5 GPa", "3 GPa", "6 GPa"],
    "drive.A0": ["10 nm", "20 nm", "40 nm"],
}.items():
    curves = df.sweep(case.replace("experiment", {"kind": "approach", "zc": grid}), over={path: values})
    forces = df.at_set_point(curves, 0.8, ["peak_force"]).peak_force.max("crossing").values
    ratio[path] = forces[-1] / forces[0]
    print(f"{path:22s}", *(df.show(force, "N", 3) for force in forces), f"largest over smallest: {ratio[path]:.2f}")

# sphinx_gallery_start_ignore
# the statements of the text on numbers
assert state.peak_force.ndim == 0 and float(state.phase) < 90.0
assert max(ratio, key=lambda path: ratio[path]) == "drive.A0"
# sphinx_gallery_end_ignore

# %%
# The free amplitude matters most. Reduce it first when the force is too large, then raise the set point.
# :doc:`Plan the gentlest settings <plan_gentle_settings>` searches both at once.
#
# The same on the command line
# ----------------------------
#
# Save the case as ``tap.toml``, and run it. A case without an experiment is an approach and a retract:
#
# .. code-block:: toml
#
#    cantilever = { name = "PPP-NCHR", Q = 450 }
#    drive = { A0 = "20 nm" }
#    tip = { radius = "7 nm" }
#    sample = "polystyrene"
#    forces = [{ model = "dmt", hamaker = "6.5e-20 J" }]
#
# .. code-block:: sh
#
#    dforce run tap.toml --at-set-point 0.8 --plot tap.png
