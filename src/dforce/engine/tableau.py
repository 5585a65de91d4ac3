"""The Runge–Kutta method of order 8 with embedded orders 5 and 3.

Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, Springer (1993), section II.10.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import DOP853

ORDER = 8
STAGES = 12
A = np.ascontiguousarray(DOP853.A[:STAGES, :STAGES])
B = np.ascontiguousarray(DOP853.B)
C = np.ascontiguousarray(DOP853.C[:STAGES])
FIFTH = np.ascontiguousarray(DOP853.E5[:STAGES])  # weights of the differences to the embedded methods
THIRD = np.ascontiguousarray(DOP853.E3[:STAGES])
