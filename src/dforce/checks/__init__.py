"""Checks: the battery that every force runs through, the validation, and the benchmark."""
