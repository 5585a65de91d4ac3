"""Random numbers by counting: Philox 4x32-10, and normal ones from it by Box and Muller.

The numbers are a function of key and counter alone. A run repeats, and goes on from any point, to the last bit, and lanes do
not depend on each other.

Sources: J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, Proc. SC'11 (2011), doi:10.1145/2063384.2063405; G. E. P. Box,
M. E. Muller, Ann. Math. Stat. 29, 610 (1958).
"""

from __future__ import annotations

import math
from typing import Any

WORD = 0xFFFFFFFF
ROUNDS = 10
M0, M1 = 0xD2511F53, 0xCD9E8D57
W0, W1 = 0x9E3779B9, 0xBB67AE85
STEP = 2.0**-32  # uniform numbers lie in the middle of so many intervals, so that none is 0


def philox(c0: int, c1: int, c2: int, c3: int, k0: int, k1: int) -> Any:
    """Return four words of 32 bits for a counter of four words and a key of two."""
    for _ in range(ROUNDS):
        p0, p1 = M0 * c0, M1 * c2
        # the products fill 64 bits: shifted as signed numbers, and masked, they equal unsigned products
        c0, c1, c2, c3 = ((p1 >> 32) & WORD) ^ c1 ^ k0, p1 & WORD, ((p0 >> 32) & WORD) ^ c3 ^ k1, p0 & WORD
        k0, k1 = (k0 + W0) & WORD, (k1 + W1) & WORD
    return c0, c1, c2, c3


def normals(step: int, k0: int, k1: int, out: Any) -> None:
    """Write normal random numbers of a step, up to 6.7 standard deviations."""
    for first in range(0, out.shape[0], 4):
        a, b, c, d = philox(step & WORD, (step >> 32) & WORD, first, 0, k0, k1)
        radius, angle = math.sqrt(-2.0 * math.log((a + 0.5) * STEP)), 2.0 * math.pi * ((b + 0.5) * STEP)
        out[first], out[first + 1] = radius * math.cos(angle), radius * math.sin(angle)
        if first + 2 < out.shape[0]:
            radius, angle = math.sqrt(-2.0 * math.log((c + 0.5) * STEP)), 2.0 * math.pi * ((d + 0.5) * STEP)
            out[first + 2], out[first + 3] = radius * math.cos(angle), radius * math.sin(angle)
