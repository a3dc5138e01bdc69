"""Compiled loops over matrices, graphs and small blocks. Nothing here knows elements, MPI or PETSc."""
