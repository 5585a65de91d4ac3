r"""
The map of regimes
==================

*When does the tip tap in net attraction, when in net repulsion, and when does it depend on how you came there?* Published
simulations answered this with curves: a step from one regime to the other is always a consequence of two states at the same
settings, and large free amplitudes lead to repulsion without one (R. García, A. San Paulo, Phys. Rev. B 60, 4961 (1999)). This
tutorial draws the map behind such curves, with boundaries that are solved and not read from pixels.

The lever and the sample are those of figure 3 of H. V. Guzman, P. D. Garcia and R. Garcia, Beilstein J. Nanotechnol. 6, 369
(2015), table 3, in air, a case in which they found two states. The map itself is not in a paper.
"""

# %%
# The map
# -------
#
# At each set point the steady states are followed along the free amplitude. A boundary is where a state ends, where attraction
# and repulsion balance, or where the tip just touches.

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
# What agrees with the literature, and what differs
# -------------------------------------------------
#
# - At 10 nm, the free amplitude of the 2015 paper, two states are there at every set point of the map, the attractive one with
#   a phase above 90°, the repulsive one below: its figure 3 shows both.
# - Two states at small free amplitudes, and only the repulsive one at large ones: so the paper of 1999 has a step at the former
#   and none at the latter. Á. San Paulo and R. García (Phys. Rev. B, July 2002) say it of the drive: more of it inhibits the
#   state of low amplitude.
# - The 2015 paper has its step at 9.3 nm on approach at 10 nm. In the map the attractive state does not end there: that comes
#   from sudden steps of the distance (``dforce examples figure-3-air-jump``).
# - The paper of 1999 varies the sample, too, and finds compliant ones on which attraction rules throughout; this map has one
#   sample. Two paths in ``over`` make a map over both.
