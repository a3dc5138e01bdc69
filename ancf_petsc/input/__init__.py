"""Cases: TOML files, checked before anything is computed."""

from ancf_petsc.input.load import Case, case_from_dict, load_case
from ancf_petsc.input.schema import CaseSpec

__all__ = ["Case", "CaseSpec", "case_from_dict", "load_case"]
