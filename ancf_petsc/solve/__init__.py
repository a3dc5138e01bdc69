"""Equilibrium: linear and nonlinear solvers, the load path, stability, natural modes."""
