"""Solvers that others might write, each as one would: a file with a function ``solve``.

``lightloc validate --method validation.solvers.grid:solve`` judges one. They are in a room of
their own so that they use no more of the project than its public names.
"""
