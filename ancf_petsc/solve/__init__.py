"""Moving a model along its load path or through time, with PETSc's solvers."""
