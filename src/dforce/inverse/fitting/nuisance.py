"""The unknowns that a fit varies beside the parameters asked for, as no measurement contains them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dforce.case import Case, Fit
from dforce.inverse.fitting.points import FROM_FREE, MeasuredPoints
from dforce.inverse.fitting.unknowns import Unknown

FREE_POINTS = 5  # used points of free motion: then they constrain A0 and the phase offset themselves


def usual_nuisance(case: Case, settings: Fit, read: MeasuredPoints) -> tuple[str, ...]:
    """Return the nuisance parameters: the usual ones of each tone, without an amplitude that the case sets at each distance."""
    if settings.nuisance != Fit().nuisance:
        return settings.nuisance
    if case.cantilever.drift is not None and case.cantilever.drift.A0:
        return tuple(name for name in settings.nuisance if name != "A0")
    if read.tones == 1:
        return settings.nuisance
    return (*settings.nuisance, "A0_2", "phase_offset_2")


def with_free_part(unknowns: list[Unknown], data: MeasuredPoints, given: set[str]) -> list[Unknown]:
    """Return unknowns with priors from the free part, unless its points are in the fit."""
    free = data.attrs.get("free_amplitude")
    if free is None:
        return unknowns
    points = np.flatnonzero(data.used)
    is_free = np.abs(data.amplitude[points, 0] - float(free)) < 3.0 * data.amplitude_error[0]
    if (is_free & (data.branch[points] == FROM_FREE)).sum() >= FREE_POINTS:
        return unknowns
    out = []
    for one in unknowns:
        known = {
            "A0": (float(free), data.attrs.get("free_amplitude_error")),
            "phase_offset": (0.0, data.attrs.get("phase_offset_error")),
        }.get(one.name)
        if known is not None and known[1] and one.name not in given:
            one = replace(one, prior=(known[0], float(known[1])), start=known[0])
        out.append(one)
    return out
