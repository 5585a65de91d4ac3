"""Pictures of results: functions of a Dataset that draw with matplotlib and return axes.

Each takes an optional `figure`: give ``matplotlib.pyplot.figure()`` to see the picture in a window or a
notebook, or a subfigure to place it beside others. Without one, a figure of its own is made that no window
holds on to; :func:`save` writes it.

>>> import dforce as df
>>> axes = df.plot.overview(df.run(df.example("figure-3-air")))  # doctest: +SKIP
>>> df.plot.save(axes, "figure-3.png")  # doctest: +SKIP
"""

from dforce.plot._style import FORMATS, check_width, save
from dforce.plot.basins import basins
from dforce.plot.branches import branches, resonance
from dforce.plot.costs import cost_of_accuracy
from dforce.plot.distances import amplitude_phase, curve
from dforce.plot.forces import force_curve, force_distance
from dforce.plot.motion import phase_portrait, spectrum, traces
from dforce.plot.overview import overview
from dforce.plot.pictures import draw

__all__ = [
    "FORMATS",
    "amplitude_phase",
    "basins",
    "branches",
    "check_width",
    "cost_of_accuracy",
    "curve",
    "draw",
    "force_curve",
    "force_distance",
    "overview",
    "phase_portrait",
    "resonance",
    "save",
    "spectrum",
    "traces",
]
