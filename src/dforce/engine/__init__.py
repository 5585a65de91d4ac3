"""Motions in time: one compiled function, :func:`dforce.engine.advance.advance`, for all forces, modes and tones."""
