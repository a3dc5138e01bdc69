"""Bulk data of Nastran and OptiStruct (.bdf, .nas, .fem): what they say about the mesh."""

from ancf_petsc.mesh.nastran.file import read_nastran

__all__ = ["read_nastran"]
