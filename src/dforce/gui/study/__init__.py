"""Results over parameters: maps, plans, sweeps and states against one parameter."""
