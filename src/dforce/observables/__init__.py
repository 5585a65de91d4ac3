"""Measurements on the motion: over each period, from its samples."""
