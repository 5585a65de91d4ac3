"""
Table 2: LSODA against RK4, then and now
========================================

The paper finds LSODA 2.8 to 11.1 times faster than RK4, and the more so the more points a period has. Both were
written over Python functions then. dForce compiles the whole right-hand side, and the answer turns around.
"""

# %%
# Both, both ways
# ---------------
#
# ``dforce benchmark`` times one period of the motions of table 1 with LSODA and RK4, over a function in Python as
# then, and compiled as now. This is its quick part, at 128 points a period.

import matplotlib.pyplot as plt

from dforce.checks.benchmark import benchmark

PRINTED = {"Hertz": 2.8, "Hertz, bimodal": 4.5}  # table 2, m = 128
rows = {row["name"]: row["seconds"] for row in benchmark(quick=True)["rows"]}


def period(method, way, motion):
    """Return the time (s) of one period of a motion."""
    return next(
        seconds
        for name, seconds in rows.items()
        if name in (f"{method} {way}, {motion}", f"{method} {way}, {motion}, m = 128")
    )


print(f"{'how many times faster LSODA is':32s} {'printed':>8s} {'Python':>8s} {'compiled':>9s}")
ratios = {}
for motion, printed in PRINTED.items():
    ratios[motion] = [period("RK4", way, motion) / period("LSODA", way, motion) for way in ("over Python", "compiled")]
    print(
        f"{'AM' if motion == 'Hertz' else 'bimodal':32s} {printed:8.1f} {ratios[motion][0]:8.2f} {ratios[motion][1]:9.3f}"
    )
for motion in PRINTED:
    gain = period("LSODA", "over Python", motion) / period("RK4", "compiled", motion)
    print(f"{motion}: a period by compiled RK4 takes {gain:.0f} times less than one by LSODA over Python")

# %%
# One picture
# -----------

figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
width = 0.2
ways = [(method, way) for way in ("over Python", "compiled") for method in ("LSODA", "RK4")]
for i, (method, way) in enumerate(ways):
    times = [period(method, way, motion) * 1e6 for motion in PRINTED]
    axes.bar([place + (i - 1.5) * width for place in range(len(PRINTED))], times, width, label=f"{method} {way}")
axes.set(yscale="log", ylabel="time of a period (µs)")
axes.set_xticks(range(len(PRINTED)), ["AM", "bimodal"])
axes.legend(fontsize="small")
plt.show()

# %%
# *Time of one period of the first tone, on a logarithmic axis. Where each call of the right-hand side costs
# microseconds, LSODA wins because it makes fewer calls; where it costs nanoseconds, LSODA's own bookkeeping
# dominates and RK4 wins. How much LSODA wins over Python depends on its tolerance, which the paper does not give.*

# sphinx_gallery_start_ignore
assert ratios["Hertz"][0] > 1.0
assert all(compiled < 1.0 for _, compiled in ratios.values())
# sphinx_gallery_end_ignore
