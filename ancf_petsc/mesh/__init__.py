"""Meshes: reading, checking, choosing groups, making. Serial: the root rank alone calls these."""
