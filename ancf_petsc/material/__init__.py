"""Laws of hyperelasticity: a law is its energy, its stress and its tangent."""

from ancf_petsc.material.models import LAWS, Law, law_named

__all__ = ["LAWS", "Law", "law_named"]
