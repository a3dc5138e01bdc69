"""A case from its file to its results: what is set up, run, watched and recorded."""
