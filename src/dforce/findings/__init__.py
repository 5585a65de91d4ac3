"""Findings in a finished result: a summary, its jumps, states at a set point, the motion at a point, a report."""
