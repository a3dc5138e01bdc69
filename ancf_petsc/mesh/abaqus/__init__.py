"""Input files of Abaqus and CalculiX (.inp): what they say about the mesh."""

from ancf_petsc.mesh.abaqus.file import read_abaqus

__all__ = ["read_abaqus"]
