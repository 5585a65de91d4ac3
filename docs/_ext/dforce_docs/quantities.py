"""The directive `quantities`: the table of the quantities named in it, from dForce's own list.

Every quantity that a result may hold must stand in a table of some page: one that is missing ends the build.
"""

from __future__ import annotations

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

from dforce.core.quantities import (
    DRIFTING,
    JUMPS,
    MATERIAL,
    NOISES,
    OBSERVABLES,
    RECONSTRUCTED,
    TRACES,
    Observable,
    Quantity,
)
from dforce.inverse.quantities import FITS, MEASURED
from dforce_docs.declared import list_table

KNOWN = {**OBSERVABLES, **DRIFTING, **TRACES, **NOISES, **JUMPS, **RECONSTRUCTED, **MEASURED, **FITS, **MATERIAL}
HEADER = ("name in the Dataset", "symbol", "stored in", "over", "meaning", "scale of its error")


def _row(quantity: Quantity) -> tuple[str, ...]:
    symbol = f":math:`{quantity.symbol}`" if quantity.symbol else ""
    unit = "–" if quantity.unit in ("1", "") else quantity.unit
    scale = quantity.scale.value if isinstance(quantity, Observable) else "–"
    return f"``{quantity.name}``", symbol, unit, ", ".join(quantity.dims), quantity.doc, scale


class Quantities(SphinxDirective):
    """A table of the quantities whose names are its content."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        names = " ".join(self.content).split()
        unknown = [name for name in names if name not in KNOWN]
        if unknown:
            raise ExtensionError(f"{self.get_location()}: no result holds {', '.join(unknown)}")
        here = self.env.metadata[self.env.docname]
        here["quantities"] = " ".join([here.get("quantities", ""), *names])
        rows, widths = [_row(KNOWN[name]) for name in names], "16 9 9 10 40 16"
        if not any(isinstance(KNOWN[name], Observable) for name in names):  # nothing in the last column
            rows, widths = [row[:-1] for row in rows], "16 9 9 10 56"
        table = list_table(HEADER[: len(rows[0])], rows, widths)
        return self.parse_text_to_nodes(f"```{{eval-rst}}\n{table}\n```")


def check_all_shown(app: Sphinx, env: BuildEnvironment) -> None:
    """End the build where a quantity stands in no table."""
    shown = {name for page in env.metadata.values() for name in page.get("quantities", "").split()}
    missing = KNOWN.keys() - shown
    if missing:
        raise ExtensionError(f"no page explains these quantities: {', '.join(sorted(missing))}")


def setup(app: Sphinx) -> None:
    """Register the directive and the check."""
    app.add_directive("quantities", Quantities)
    app.connect("env-check-consistency", check_all_shown)
