"""Safe settings for the sample of a fit: which free amplitudes keep the peak force below a limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

import dforce as df
from dforce.gui.document.compute import Job

if TYPE_CHECKING:
    import xarray as xr

LIMIT = "1 nN"


@dataclass
class SafeJob(Job):
    """Safe settings under way.

    Attributes
    ----------
    limit, share
        The largest peak force as typed, and the set point.
    """

    limit: str = LIMIT
    share: float = 0.8

    def compute(self) -> xr.Dataset:
        """Return the safe settings."""
        return df.safe_settings(self.case, self.limit, self.share, progress=self._watch)

    def sentences(self) -> list[str]:
        """Return what was found, as sentences."""
        return [] if self.result is None else [str(text) for text in np.atleast_1d(self.result.attrs["findings"])]
