"""Cases: TOML files, checked before anything is computed."""

from ancf_petsc.case.load import Case, case_from_dict, load_case
from ancf_petsc.case.schema import CaseSpec

__all__ = ["Case", "CaseSpec", "case_from_dict", "load_case"]
