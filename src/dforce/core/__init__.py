"""What everything else stands on: errors, units, parameters and quantities, files, progress and the log."""
