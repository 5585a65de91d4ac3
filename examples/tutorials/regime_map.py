r"""
The map of regimes
==================

*When does the tip tap in net attraction, when in net repulsion, and when does it depend on how you came there?* R. García and
A. San Paulo answered with simulations (Phys. Rev. B 60, 4961 (1999)): a step from one regime to the other is always a
consequence of two states at the same settings; with large free amplitudes the repulsive regime is reached without one. This
tutorial draws such a map, with boundaries that are solved and not read from pixels, for a polymer in air. The parameters are
ours, not those of the paper.
"""

# %%
# The map
# -------
#
# At each set point the steady states are followed along the free amplitude. A boundary is where a state ends, where attraction
# and repulsion balance, or where the tip just touches.

import matplotlib.pyplot as plt

import dforce as df

case = df.Case(
    title="Regimes on a polymer in air",
    cantilever=df.Cantilever(f0="70 kHz", k="2.7 N/m", Q=180.0),
    drive=df.Drive(A0="30 nm"),
    tip=df.Tip(radius="8 nm"),
    sample=df.Sample(youngs_modulus="2 GPa", poisson_ratio=0.3),
    forces=[df.forces.DMT(hamaker="6e-20 J"), df.forces.KelvinVoigt(viscosity="20 Pa s")],
)
found = df.regimes(
    case,
    over={"drive.A0": {"start": "15 nm", "stop": "40 nm", "points": 26}},
    set_points={"start": 0.5, "stop": 0.95, "points": 10},
)
axes = df.plot.map(found, "A0", "set_point", "regime")
plt.show()

# %%
# *Regimes over free amplitude and set point. Left of the full line both states are stable, right of it only the repulsive one;
# left of the dotted line the attractive state does not even touch the sample.*
#
# Between the lines the history decides: an approach from afar stays in the attractive state. Right of the full line there is
# nothing to choose. At a set point of 0.8 (the nearest computed is printed) the attractive state ends here:

share = float(found.set_point.sel(set_point=0.8, method="nearest"))
for kind, amplitude, at in zip(found.edge_kind.values, found.edge_A0.values, found.edge_set_point.values, strict=True):
    if at == share and kind in ("contact", "end"):
        print(f"set point {at:.2f}: {kind} at A0 = {1e9 * amplitude:.2f} nm")

# %%
# An approach at the two sides of the full line shows the difference: a jump from attraction to repulsion, or none.

for A0 in ("25 nm", "38 nm"):
    curve = df.approach(case.replace("drive.A0", A0), zc={"start": "44 nm", "stop": "10 nm", "points": 171})
    state = df.at_set_point(curve, 0.8)
    print(f"A0 = {A0}: {', '.join(state.regime.values.tolist())}")

# sphinx_gallery_start_ignore
import numpy as np

words = found.regime.attrs["flag_meanings"].split()
ends = found.edge_A0.values[(found.edge_kind == "end") & (found.edge_set_point == share)]
assert len(ends) == 1 and 30e-9 < ends[0] < 31.5e-9
low = np.array(words)[found.regime.sel(set_point=share).values]
assert set(low[found.A0.values < ends[0]]) == {"both"} and set(low[found.A0.values > ends[0]]) == {"repulsive"}
assert df.at_set_point(curve, 0.8).regime.values.tolist() == ["repulsive"]
# sphinx_gallery_end_ignore
