"""The first page's questions: a question with its shipped example, and the case for a lever, a medium and a sample."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from typing import Any

import dforce as df
from dforce.experiments import EXPERIMENTS


@dataclass(frozen=True)
class Question:
    """A question, the example that answers it, and the tab that comes first; its picture has the same key."""

    key: str
    title: str
    sentence: str
    example: str
    tab: str = ""


QUESTIONS = (
    Question("curve", "Explain my curve", "Modulus and adhesion from a measured curve", "hysteresis", "Fit"),
    Question("safe", "Safe settings", "The amplitude that my sample tolerates", "figure-4-soft", "Against"),
    Question("states", "Two states and jumps", "Jumps of the motion, and their reason", "hysteresis"),
    Question("bimodal", "Bimodal contrast", "Phase of the second mode", "figure-6"),
    Question("thermal", "Thermal tune of a lever", "f0, k and Q from thermal motion", "figure-3-air"),
    Question("class", "Teach a class", "One window for all students", "hysteresis"),
)
ONE_MODE = "Bimodal needs a lever with two modes. Leave the lever empty, then type the modes of yours"


def lever_labels() -> dict[str, str]:
    """Return the levers of the library by name, as a list shows them."""
    return {
        name: f"{name}: {df.show(probe.f0, 'Hz', 3)}, {df.show(probe.k, 'N/m', 3)}"
        for name, probe in df.cantilevers().items()
    }


def sample_labels() -> dict[str, str]:
    """Return the samples of the library by name, as a list shows them."""
    return {
        name: f"{name.replace('_', ' ')}: {df.show(material.youngs_modulus, 'Pa', 3)}"
        for name, material in df.materials().items()
    }


def asks_for_q(lever: str, medium: str) -> bool:
    """Return whether nothing gives the quality factor of a lever in a medium."""
    probe = df.cantilevers().get(lever)
    return probe is not None and probe.Q is None and (probe.width is None or medium not in ("air", "water"))


def case_for(question: Question, lever: str = "", Q: str = "", medium: str = "", sample: str = "") -> df.Case:
    """Return the case of a question; what is empty stays as in its example.

    Raises
    ------
    ParameterError
        When lever, medium and sample make no case.
    """
    table: dict[str, Any] = tomllib.loads(df.example(question.example).to_toml())
    if question.key == "thermal":
        table["experiment"] = {"kind": "thermal_spectrum"}
    elif not (lever or medium or sample):
        return df.example(question.example)
    table.pop("about", None)
    table["title"] = question.title
    if lever:
        probe = df.cantilevers()[lever]
        if len(table["cantilever"].get("modes", ())) > 1:
            raise df.ParameterError(ONE_MODE)
        table["cantilever"] = {"name": lever, **({"Q": Q} if Q else {})}
        table["drive"] = {"A0": table["drive"]["A0"]}
        if probe.tip_radius is not None:
            table["tip"] = {**table.get("tip", {}), "radius": df.show(probe.tip_radius, "m")}
    if medium:
        table["medium"] = {"name": medium}
    if sample:
        material = df.materials()[sample]
        table["sample"] = {"youngs_modulus": df.show(material.youngs_modulus, "Pa")}
        if material.poisson_ratio is not None:
            table["sample"]["poisson_ratio"] = material.poisson_ratio
    kind = table.pop("experiment")["kind"]
    table["experiment"] = {"kind": kind, **EXPERIMENTS[kind].suggested(df.Case(**table).problem)}
    return df.Case(**table)
