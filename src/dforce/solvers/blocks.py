"""Which block solves problems: that of the integrator that the settings ask for."""

from __future__ import annotations

from dforce.solvers.block import Block
from dforce.solvers.settings import SolverSettings


def block_type(settings: SolverSettings) -> type[Block]:
    """Return the kind of block that solves with these settings."""
    if settings.integrator != "engine" or settings.method != "periodic":
        return Block
    from dforce.solvers.engine_block import EngineBlock  # loads the compiler

    return EngineBlock
