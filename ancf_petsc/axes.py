"""The names of the axes, in the order of components."""

AXES = ("x", "y", "z")
