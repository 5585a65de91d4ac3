"""A page for each force model, with a drawn curve, and the gallery that leads to them; all from the classes."""

from __future__ import annotations

import inspect
import re
import shutil
import textwrap
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from sphinx.application import Sphinx

import dforce as df
from dforce_docs.declared import instrument_meaning, list_table, parameter_table, plain
from ran_page import forget_own_models

FOLDER = "forces"
TAPPING_SPEED = "1 mm/s"
STEEP = 20.0  # repulsion over attraction beyond which the attraction could not be seen any more
SAMPLE = "a tip of 10 nm radius and a sample of 1 GPa"


def example_case(model: type[df.Force]) -> df.Case:
    """Return a typical experiment with the example values that a model gives."""
    return df.Case(
        cantilever=df.Cantilever(f0="50 kHz", k="1 N/m", Q=100),
        drive=df.Drive(A0="10 nm"),
        tip=df.Tip(radius="10 nm", half_angle="20 deg"),
        sample=df.Sample(youngs_modulus="1 GPa", thickness="500 nm", radius="50 nm"),
        medium=df.Medium(name="water"),
        forces=[model(**model.example)],
    )


def loop(curve: xr.Dataset) -> float:
    """Return the largest difference between approach and retract, as a share of the largest force."""
    approach, retract = curve["force"].values
    return float(np.nanmax(np.abs(approach - retract)) / np.nanmax(np.abs(curve["force"].values)))


def drawn_curve(case: df.Case) -> tuple[xr.Dataset, str]:
    """Return the slow force curve, or the fast curve where the slow one shows no dissipation; and the speed."""
    slow = df.force_curve(case)
    if any(type(force).dissipative for force in case.forces) and loop(slow) < 0.02:
        fast = df.force_curve(case, distance=slow["distance"], speed=TAPPING_SPEED)
        if loop(fast) > 0.02:
            return fast, f"{TAPPING_SPEED}, a speed of tapping"
    return slow, "10 nm/s, slowly"


def draw(case: df.Case, name: str, folder: Path) -> str:
    """Draw a model's curve and its thumbnail, and return the caption."""
    curve, speed = drawn_curve(case)
    figure = plt.figure(figsize=(6.0, 4.0), layout="constrained")
    axes = df.plot.force_curve(curve, figure)
    _clip(axes, curve)
    axes.set_title("")
    figure.savefig(folder / f"{name}.png", dpi=160)
    figure.set_size_inches(3.0, 1.8)
    axes.get_legend().remove()
    axes.set(xlabel="", ylabel="", xticks=[], yticks=[])
    figure.savefig(folder / f"{name}-small.png", dpi=160)
    plt.close(figure)
    seen = (
        "The shaded loop is the energy that the sample dissipates in a cycle."
        if loop(curve) > 1e-6
        else "Approach and retract coincide: the sample dissipates nothing."
    )
    return f"Force of ``{name}`` against distance at {speed}, for {SAMPLE}. {seen}"


def _clip(axes: plt.Axes, curve: xr.Dataset) -> None:
    low, high = float(curve["force"].min()), float(curve["force"].max())
    if low < 0.0 < STEEP * -low < high:
        unit = axes.dataLim.height / (high - low)  # of the picture, per newton
        axes.set_ylim(1.3 * low * unit, -2.0 * low * unit)


def first_sentence(model: type[df.Force]) -> str:
    """Return the first paragraph of a model's docstring."""
    return inspect.cleandoc(model.__doc__ or "").split("\n\n")[0].replace("\n", " ")


def example_toml(case: df.Case) -> str:
    """Return the lines of a case file that add the force."""
    text = case.to_toml()
    found = re.search(r"^\[\[forces\]\]\n(?:.+\n?)*", text, re.MULTILINE)
    if found is None:
        raise ValueError("a case with a force has no [[forces]] in its file")
    return found[0].strip()


def page(model: type[df.Force], folder: Path) -> str:
    """Return a model's page in reStructuredText; draws its pictures."""
    case = example_case(model)
    caption = draw(case, model.name, folder)
    shared = list(model.shared_fields().values())
    parts = [
        f"{model.name}\n{'=' * len(model.name)}",
        inspect.cleandoc(model.__doc__ or ""),
        f".. figure:: {model.name}.png\n   :alt: force against distance\n   :class: force-figure\n   :width: 36em\n\n"
        f"   {caption}",
        ".. rubric:: Parameters",
        parameter_table(model, model.keys()) if model.keys() else "None of its own.",
    ]
    if shared:
        rows = [(f"``{path}``", instrument_meaning(path)) for path in shared]
        parts += [".. rubric:: Taken from the instrument", list_table(("key", "meaning"), rows)]
    parts += [
        ".. rubric:: In a case file",
        ".. code-block:: toml\n\n" + textwrap.indent(example_toml(case), "   "),
        f"In Python: ``df.forces.{model.__name__}(...)`` with the same keys.",
        *([f"Also found as: {', '.join(model.also_called)}."] if model.also_called else []),
        ".. rubric:: Interactions",
        f"{', '.join(model.contains)}. A second force with the same interaction is refused."
        if model.contains
        else "Unknown to dForce: make sure that no other force contains the same interaction.",
        f"The sample {'dissipates energy' if model.dissipative else 'dissipates nothing'}.",
        ".. rubric:: Source",
        plain(f"{model.source}."),
    ]
    return "\n\n".join(parts) + "\n"


def index(models: list[type[df.Force]]) -> str:
    """Return the gallery: a card for each model, under the headings."""
    lines = [
        "Force models",
        "============",
        "",
        "Each card shows the force on the tip against the distance, repulsive up; a shaded loop is dissipated energy.",
        "Its page has equation, range, parameters and source, as ``dforce models NAME`` in a terminal. Forces add up; two with",
        "the same interaction are refused. :doc:`Which model should I use? </which-model>` helps to choose.",
        ":doc:`Your own force law </tutorials/your_own_force>` adds one.",
        "",
    ]
    for title, members in df.forces.grouped(models).items():
        lines += [title, "-" * len(title), "", ".. grid:: 1 2 3 3", "   :gutter: 3", ""]
        for model in members:
            lines += [
                f"   .. grid-item-card:: {model.name}",
                f"      :img-top: {model.name}-small.png",
                f"      :img-alt: force curve of {model.name}",
                f"      :link: {model.name}",
                "      :link-type: doc",
                "",
                f"      {first_sentence(model)}",
                "",
            ]
    pages = ["Which model should I use? </which-model>", *(model.name for model in models)]
    lines += [".. toctree::", "   :hidden:", "", *(f"   {page}" for page in pages), ""]
    return "\n".join(lines)


def draw_gallery(models: list[type[df.Force]], folder: Path) -> None:
    """Draw the small curves side by side, for the card on the start page."""
    figure, boxes = plt.subplots(3, 4, figsize=(8, 4.8), layout="constrained")
    for axes, model in zip(boxes.flat, models, strict=False):
        axes.imshow(plt.imread(folder / f"{model.name}-small.png"))
        axes.set_axis_off()
    figure.savefig(folder / "gallery.png", dpi=130)
    plt.close(figure)


def write_pages(app: Sphinx) -> None:
    """Write all of it into the folder of generated pages."""
    folder = Path(app.srcdir) / FOLDER
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    forget_own_models()
    models = list(df.forces.REGISTRY.values())
    for model in models:
        (folder / f"{model.name}.rst").write_text(page(model, folder), encoding="utf-8")
    (folder / "index.rst").write_text(index(models), encoding="utf-8")
    draw_gallery(models, folder)


def setup(app: Sphinx) -> None:
    """Write the pages before any page is read."""
    app.connect("builder-inited", write_pages)
