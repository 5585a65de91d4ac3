r"""
The map of regimes
==================

*When does the tip tap in net attraction, when in net repulsion, and when does it depend on the approach?* Published simulations
answer with curves. A step from one regime to the other always follows from two states at the same settings, and large free
amplitudes lead to repulsion without a step (R. García, A. San Paulo, Phys. Rev. B 60, 4961 (1999)). This tutorial draws the map
behind such curves, with computed boundaries.

The lever and the sample are from figure 3 of H. V. Guzman, P. D. Garcia and R. Garcia (Beilstein J. Nanotechnol. 6, 369 (2015),
table 3), in air, a case with two states. No paper has this map.
"""

# %%
# The map
# -------
#
# At each set point the steady states are followed along the free amplitude. At a boundary a state ends, attraction and
# repulsion balance, or the tip just touches.

import matplotlib.pyplot as plt

import dforce as df

case = df.example("figure-3-air")
found = df.regimes(
    case,
    over={"drive.A0": {"start": "2 nm", "stop": "24 nm", "points": 23}},
    set_points={"start": 0.5, "stop": 0.95, "points": 10},
)
axes = df.plot.map(found, "A0", "set_point", "regime")
plt.show()

# %%
# *Regimes over free amplitude and set point. Left of the full line both states are stable, right of it only the repulsive
# state. Left of the dotted line the attractive state does not even touch the sample.*
#
# Between the lines the state depends on the history: an approach from afar stays in the attractive state. Right of the full
# line only one state exists. At a set point of 80 % (the nearest computed value is printed) the attractive state ends here:

share = float(found.set_point.sel(set_point=0.8, method="nearest"))
for kind, amplitude, at in zip(found.edge_kind.values, found.edge_A0.values, found.edge_set_point.values, strict=True):
    if at == share and kind in ("contact", "end"):
        print(f"set point {at:.2f}: {kind} at A0 = {1e9 * amplitude:.2f} nm")

# %%
# An approach at the two sides of the full line shows the difference:

for A0 in ("10 nm", "18 nm"):
    over = {"of": "drive.A0", "start": 1.4, "stop": 0.4, "points": 81}
    curve = df.run(case.replace("drive.A0", A0).replace(experiment=df.experiments.Approach(zc=over)))
    state = df.at_set_point(curve, 0.8)
    print(f"A0 = {A0}: {', '.join(state.regime.values.tolist())}")

# sphinx_gallery_start_ignore
import numpy as np

words = found.regime.attrs["flag_meanings"].split()
named = np.array(words)[found.regime.values]
assert df.at_set_point(curve, 0.8).regime.values.tolist() == ["repulsive"]
assert set(named[found.A0.values < 11e-9].ravel()) == {"both"}  # at 10 nm, as in the paper
assert set(named[found.A0.values > 20e-9].ravel()) == {"repulsive"}
stable = found.line_stable.values & (found.line_A0.values < 11e-9)
phases = found.line_phase.values[stable]
assert phases.min() < 90.0 < phases.max()
ends = found.edge_A0.values[(found.edge_kind == "end") & (found.edge_set_point == share)]
assert len(ends) == 1 and 13e-9 < ends[0] < 14e-9
# sphinx_gallery_end_ignore

# %%
# Comparison with the literature
# ------------------------------
#
# - At 10 nm, the free amplitude of the 2015 paper, the map has two states at every set point. The attractive state has a phase
#   above 90°, the repulsive state below. Figure 3 of the paper shows both.
# - At small free amplitudes the map has two states, at large free amplitudes only the repulsive state. So the paper of 1999
#   has a step at small amplitudes and none at large ones. In Á. San Paulo and R. García (Phys. Rev. B, July 2002) a larger
#   drive inhibits the state of low amplitude.
# - The 2015 paper has its step at 9.3 nm on approach at 10 nm. In the map the attractive state does not end there: the step
#   comes from sudden steps of the distance (``dforce examples figure-3-air-jump``).
# - The paper of 1999 also varies the sample, and finds compliant samples with attraction throughout; this map has one sample.
#   Two paths in ``over`` make a map over both.
