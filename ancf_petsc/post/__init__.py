"""Curves, figures and pictures of a run; none of it knows MPI or PETSc."""
