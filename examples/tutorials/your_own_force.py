r"""
Your own force law
==================

*You have a force between tip and sample that dForce does not ship, such as a polymer brush that pushes the tip away long
before contact.* This tutorial takes it from a line in a case to a model that is as good as the built-in ones.

The force of a brush whose repulsion decays over the length :math:`L`, under a sphere of radius :math:`R`, is

.. math:: F = 2 \pi R\, w\, e^{-d/L}

plus van der Waals attraction and an elastic contact.
"""

# %%
# First as an expression
# ----------------------
#
# The force model :doc:`custom </forces/custom>` takes an expression in SI units. `d` is the distance, `a0` the distance at
# which contact begins, and `P1` to `P4` are your own numbers. ``max(d, a0)`` keeps the force constant in contact.

import matplotlib.pyplot as plt
import numpy as np

import dforce as df

attraction = df.forces.DMT(hamaker="4e-20 J")
brush = df.forces.Custom(law="2*pi*R*P1*exp(-max(d, a0)/P2)", P1=3e-3, P2=4e-9)

bare = df.Case(
    cantilever=df.Cantilever(f0="75 kHz", k="2.8 N/m", Q=180),
    drive=df.Drive(A0="25 nm"),
    tip=df.Tip(radius="10 nm"),
    sample=df.Sample(youngs_modulus="2 GPa"),
    forces=[attraction],
)
brushed = bare.replace("forces", [attraction, brush])

# %%
# Check the force before any motion:

force = df.force_curve(brushed, distance=np.linspace(12e-9, -0.5e-9, 400))
df.plot.force_curve(force)
plt.show()

# %%
# *The whole force against distance. The brush repels from ten nanometers on. In the last nanometer van der Waals attraction
# pulls the tip in; then the contact pushes back.*
#
# The expression is compiled like any other force, and as fast. In a case file write
#
# .. code-block:: toml
#
#    [[forces]]
#    model = "custom"
#    law = "2*pi*R*P1*exp(-max(d, a0)/P2)"
#    P1 = 3e-3
#    P2 = 4e-9
#
# The effect of the brush on an approach:

zc = np.linspace(35e-9, 12e-9, 231)
over_bare, over_brush = df.approach(bare, zc=zc), df.approach(brushed, zc=zc)

figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
axes.plot(zc * 1e9, over_bare.phase.sel(tone=1), label="bare sample")
axes.plot(zc * 1e9, over_brush.phase.sel(tone=1), "--", label="with the brush")
axes.axhline(90, color="0.6", linewidth=0.8)
axes.set(xlabel="average distance $z_c$ (nm)", ylabel="phase lag (°)")
axes.legend()
plt.show()

# %%
# *Phase against distance, approach from the right. Over the bare sample the phase rises above 90° (net attraction), then
# jumps to net repulsion. Over the brush it first dips below 90°: the tip is pushed before it is pulled. The jump comes
# several nanometers earlier.*
#
# The numbers:

for name, curve in (("bare", over_bare), ("brush", over_brush)):
    print(name, *(f"{finding.label}: {finding.text}" for finding in df.summary(curve) if finding.name == "jumps"))

# sphinx_gallery_start_ignore
assert float(over_bare.phase.sel(zc=slice(35e-9, 25e-9)).min()) > 90.0
assert float(over_brush.phase.sel(zc=slice(35e-9, 28e-9)).min()) < 89.5
jump_bare, jump_brush = (float(curve.jump_zc[0]) for curve in (over_bare, over_brush))
assert 2e-9 < jump_brush - jump_bare < 5e-9
# sphinx_gallery_end_ignore

# %%
# Then as a model
# ---------------
#
# An expression is good for a test. A model has parameters with names, units and bounds, its own page, and checks. It is one
# class in one Python file. Save this as ``brush.py``:
#
# .. literalinclude:: /../examples/tutorials/brush.py
#    :language: python
#    :caption: brush.py
#
# - `name` is its name in a case file; the docstring is its page.
# - The fields are its parameters: `param` declares one of its own, `shared` takes one from the instrument, so
#   that one tip serves all forces.
# - `law` is the force in newtons, repulsive positive: plain Python with functions of `math`. Its first three
#   arguments are always the distance, its rate and the time; the others are the fields.
# - `kinks` lists the distances at which the law is not smooth. Solvers place a step there.
#
# Check it as strictly as every built-in model, on the command line with
#
# .. code-block:: sh
#
#    dforce models check brush.py
#
# or in Python:

(Brush,) = df.load_plugin("brush.py")
df.check_force(Brush)
print(Brush.name, "passes every check")

# %%
# The checks test physics. They try the law at extreme distances and at the bounds of its parameters, and compare the
# compiled law with the plain one. They look for kinks and jumps that are not declared, and for energy from nowhere.
# Leave out the line with `kinks` to see a check fail.
#
# From here on `brush` is a model like any other. In a case file, name the Python file at the top:
#
# .. code-block:: toml
#
#    plugins = ["brush.py"]
#
#    [[forces]]
#    model = "brush"
#    energy = "3 mJ/m^2"
#    length = "4 nm"
#
# In Python, use a table with the same keys. It yields the same force as the expression:

own = {"model": "brush", "energy": "3 mJ/m^2", "length": "4 nm"}
same = df.force_curve(bare.replace("forces", [attraction, own]), distance=force.distance)
difference = float(abs(same.force - force.force).max())
print(f"largest difference: {difference:.1g} N")

# sphinx_gallery_start_ignore
assert difference < 1e-21
# sphinx_gallery_end_ignore

# %%
# As a package
# ------------
#
# To give the model to others, put ``brush.py`` into a folder ``brush-force`` beside this file:
#
# .. code-block:: toml
#    :caption: brush-force/pyproject.toml
#
#    [project]
#    name = "brush-force"
#    version = "1.0"
#    dependencies = ["dforce"]
#
#    [project.entry-points."dforce.forces"]
#    brush = "brush"
#
#    [build-system]
#    requires = ["hatchling"]
#    build-backend = "hatchling.build"
#
#    [tool.hatch.build.targets.wheel]
#    include = ["brush.py"]
#
# After ``python -m pip install ./brush-force``, ``dforce models brush`` shows its page, and a case needs no ``plugins``.
#
# Forces with memory (a relaxing sample) or with two branches (a neck that forms and breaks) are classes of the same kind.
# :class:`dforce.Force` describes their extra members; copy ``sls_simple.py`` (one state) or
# ``capillary.py`` of the shipped models.
