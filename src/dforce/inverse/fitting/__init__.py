"""Parameters of a case from measured curves, with errors; and the parameters that a curve constrains."""
