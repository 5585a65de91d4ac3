"""The base of everything else: errors, units, parameters and quantities, files, progress and the log."""
