"""Smaller models of the same scene: what is found in a case, and the smaller case that it allows."""
