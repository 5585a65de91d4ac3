"""The order of the tutorials, and the state at the start of each."""

from __future__ import annotations

import warnings
from typing import Any

import matplotlib as mpl

from ran_page import forget_own_models

TUTORIALS = (
    "from_my_lever_to_a_peak_force.py",
    "dissipation_and_adhesion.py",
    "a_viscoelastic_sample.py",
    "what_a_curve_tells.py",
    "plan_gentle_settings.py",
    "your_own_force.py",
    "why_the_phase_jumps.py",
    "bimodal_contrast.py",
    "from_a_shift_to_a_modulus.py",
    "soft_sample_in_liquid.py",
    "phase_in_liquid.py",
    "gentle_on_soft_samples.py",
    "regime_map.py",
    "maps_of_samples.py",
    "law_to_curve_to_law.py",
)


class Order:
    """Sorts the tutorials as a reader takes them; any other script comes after them, by name."""

    def __init__(self, folder: str) -> None:
        self.folder = folder

    def __call__(self, name: str) -> tuple[int, str]:
        """Return the sort key of a script."""
        return (TUTORIALS.index(name) if name in TUTORIALS else len(TUTORIALS), name)


def start_afresh(gallery_conf: dict[str, Any], name: str) -> None:
    """Begin every page with plain pictures and the shipped models, independent of the page before it.

    A warning in a script ends the build.
    """
    for category in (RuntimeWarning, UserWarning):
        warnings.filterwarnings("error", category=category)
    warnings.filterwarnings("ignore", message="FigureCanvasAgg is non-interactive")  # of plt.show
    forget_own_models()
    mpl.rcdefaults()
    mpl.use("agg")
