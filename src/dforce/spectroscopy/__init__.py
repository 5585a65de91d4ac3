"""The forces of a case over a motion that is prescribed: no cantilever, only tip and sample.

Memory, latches and viscosity are included, so that the answer depends on the path and on its speed.
"""

from dforce.spectroscopy.evaluate import Answer, follow
from dforce.spectroscopy.force_law import force_along, force_curve
from dforce.spectroscopy.parts import force_parts

__all__ = ["Answer", "follow", "force_along", "force_curve", "force_parts"]
