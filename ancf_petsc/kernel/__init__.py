"""Compiled loops over cells: arrays in, arrays out. Nothing here knows MPI, PETSc, files or logging."""
