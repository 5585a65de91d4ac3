"""The Runge–Kutta method of order 8 with embedded orders 5 and 3.

Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, Springer (1993), section II.10.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import DOP853

STAGES = 12
WIDTH = 16  # of a row with a number for each stage and the end of a step: whole vectors of the processor
FIFTH, THIRD = STAGES + 1, STAGES + 2  # rows of A with the weights of the differences to the embedded methods
A = np.zeros((WIDTH, WIDTH))  # a row for each stage, then one for the end of the step
A[:STAGES, :STAGES], A[STAGES, :STAGES] = DOP853.A[:STAGES, :STAGES], DOP853.B
A[FIFTH, :STAGES], A[THIRD, :STAGES] = DOP853.E5[:STAGES], DOP853.E3[:STAGES]
WEIGHTS = np.ascontiguousarray(A.T)  # of a stage in all that follow it
C = np.append(DOP853.C[:STAGES], np.ones(WIDTH - STAGES))
PLAIN, LEAVING, ARRIVING = 0, 1, 2  # how a step counts its time
SHARE = np.array([C, C**2, 2.0 * C - C**2])  # time at each stage, in steps, for each way to count it
PACE = np.array([np.ones(WIDTH), 2.0 * C, 2.0 - 2.0 * C])  # and its derivative
