"""Pictures of results: functions of a Dataset that draw with matplotlib and return axes.

Each function draws on a new figure of pyplot. A notebook shows this figure below the cell, a script with
``matplotlib.pyplot.show()``. The option `figure` draws elsewhere: on your own figure, on a part of a figure
(``figure.subfigures()``) beside other pictures, or on a :class:`Sheet` for a file alone. The function :func:`save` writes the
picture with the axes to a file.

>>> import dforce as df
>>> axes = df.plot.overview(df.run(df.example("figure-3-air")))  # doctest: +SKIP
>>> df.plot.save(axes, "figure-3.png")  # doctest: +SKIP
"""

from dforce.plot._style import FORMATS, Sheet, check_width, save
from dforce.plot.basins import basins
from dforce.plot.branches import branches, resonance
from dforce.plot.distances import amplitude_phase, curve
from dforce.plot.fits import fit, fit_errors
from dforce.plot.forces import force_curve, force_distance
from dforce.plot.maps import map
from dforce.plot.measured import measured
from dforce.plot.motion import phase_portrait, spectrum, traces
from dforce.plot.overview import overview
from dforce.plot.pictures import draw
from dforce.plot.plans import plan
from dforce.plot.reconstruction import reconstruction
from dforce.plot.thermal import thermal_spectrum

__all__ = [
    "FORMATS",
    "Sheet",
    "amplitude_phase",
    "basins",
    "branches",
    "check_width",
    "curve",
    "draw",
    "fit",
    "fit_errors",
    "force_curve",
    "force_distance",
    "map",
    "measured",
    "overview",
    "phase_portrait",
    "plan",
    "reconstruction",
    "resonance",
    "save",
    "spectrum",
    "thermal_spectrum",
    "traces",
]
