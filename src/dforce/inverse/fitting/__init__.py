"""Parameters of a case from measured curves, with errors; and what a curve can tell at all."""
