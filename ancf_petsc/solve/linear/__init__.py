"""The linear solver of tangents and its preconditioner."""
