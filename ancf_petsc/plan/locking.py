"""Elements that are too stiff where a material hardly changes its volume, and what to take in their place."""

from __future__ import annotations

from ancf_petsc.input.schema import CaseSpec

FROM = 0.45
"""Poisson's ratio from which linear elements are warned of: docs/stability.md has what they err by."""
INSTEAD = {
    "3413": 'element = "3-10-1-3" on the same mesh',
    "3813": 'element = "3843" where cells are parallelepipeds, else tetrahedra with "3-10-1-3"',
    "2312": 'element = "2-6-1-2" on the same mesh',
    "2412": 'element = "2432"',
}


def locking_notes(spec: CaseSpec) -> list[str]:
    """A warning for each material near nu = 0.5 on an element that cannot keep its volume and deform freely.

    In plane stress the thickness follows, whatever nu.
    """
    code, section = spec.mesh.element, spec.section
    if code not in INSTEAD or (section and section.plane == "stress"):
        return []
    return [
        f"element {code} with poisson = {material.poisson:g} is too stiff, by factors the closer to 0.5 "
        f"(docs/stability.md, Near nu = 0.5): take {INSTEAD[code]}"
        for material in spec.material
        if material.poisson >= FROM
    ]
