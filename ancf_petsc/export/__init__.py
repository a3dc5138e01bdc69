"""A case as another program's input: one module a format, named in FORMATS.

Each has write(case, plan), which returns the text and notes of what the other program computes differently, and raises CaseError,
with the key's name, for what that program cannot be told.
"""

from __future__ import annotations

from ancf_petsc.export import calculix

FORMATS = {"calculix": (calculix.write, ".inp")}
"""Name -> what writes it, and the suffix of its files."""
