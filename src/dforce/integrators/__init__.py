"""Integrators: one file, one method, compiled with the forces it marches over (``rk4``, ``lsoda``).

``lanes`` marches the cases of a block side by side with the steps of ``rk4``, ``events`` finds the events of a step, and
``loops`` has the common parts of the methods.
"""
