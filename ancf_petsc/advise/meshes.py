"""Meshes that a case can be computed on: refinements of its own, or, of the program's bodies, any size."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ancf_petsc.element.catalog import ELEMENTS, element
from ancf_petsc.input.load import Case
from ancf_petsc.mesh.bodies import BODIES
from ancf_petsc.mesh.check import statistics
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.made import Request, made_mesh
from ancf_petsc.mesh.read import read_mesh
from ancf_petsc.plan.case_mesh import mesh_of

Changes = dict[str, Any]
COARSEST = 2.0
"""Times a body's usual size: the first mesh of a ladder of sizes."""
RATIO = 1.25
"""Of the sizes of neighbouring levels."""
GRADED = 0.4
"""Times the size: edges at the rims of the coarsest graded mesh. From level to level they shrink with the square of the size."""
SCALES = (0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
"""Of a body's usual divisions, level by level."""
REMOVED = ""
BODY_KEYS = ("file", "body", "size", "rim", "divisions", "hexahedra", "flat", "refine")


@dataclass(frozen=True)
class MeshFamily:
    """Meshes of one kind from coarse to fine. fractions: levels between whole ones exist, and levels below 0 too."""

    name: str
    kind: str
    base: Changes = field(default_factory=dict)
    body: str = ""
    fractions: bool = False

    def mesh(self, level: float) -> Changes | None:
        """The keys of [mesh] at a level, None where there is no such mesh."""
        if self.name == "refined":
            whole = int(level) + self.base["mesh.refine"]
            return {**self.base, "mesh.refine": whole} if level >= 0 and whole <= 8 else None
        primitive = BODIES[self.body]
        if self.name == "bricks":
            if not 0 <= level < len(SCALES) or level != int(level):
                return None
            return {**self.base, "mesh.divisions": _divisions(self.body, SCALES[int(level)])}
        first = COARSEST * primitive.size
        size = first * RATIO**-level
        found = {**self.base, "mesh.size": _rounded(size)}
        if self.name == "graded":
            found["mesh.rim"] = _rounded(min(size, GRADED * first * (size / first) ** 2))
        return found


def families(case: Case) -> tuple[list[MeshFamily], str]:
    """The families of meshes for a case, and the program's body that its mesh is of, "" if of none. Raises CaseError."""
    mesh = mesh_of(case)
    kind = KINDS[mesh.kind].name
    body = _body_of(case)
    own = MeshFamily("refined", kind, {"mesh.refine": case.spec.mesh.refine})
    if not body or KINDS[mesh.kind].dimension != 3:
        return [own], ""
    clean = {f"mesh.{name}": REMOVED for name in BODY_KEYS if _given(case, name)} | {"mesh.body": body}
    found = [MeshFamily("uniform", "tetra", clean, body, fractions=True)]
    if BODIES[body].rims:
        found.append(MeshFamily("graded", "tetra", clean, body, fractions=True))
    found.append(MeshFamily("bricks", "hexahedron", {**clean, "mesh.hexahedra": True}, body))
    return found, body


def elements_for(case: Case, family: MeshFamily) -> Iterator[str]:
    """Codes of the catalogue's elements whose cells a family's meshes have."""
    dimension = element(case.spec.mesh.element).cell.dimension
    for code, row in ELEMENTS.items():
        if row.cell.dimension == dimension and family.kind in row.kinds:
            yield code


def _given(case: Case, name: str) -> bool:
    return name in case.spec.mesh.model_fields_set and name != "body"


def _body_of(case: Case) -> str:
    """The program's body a case's mesh is of: named so, or of the same box, volume and groups."""
    if case.spec.mesh.body:
        return case.spec.mesh.body if not case.spec.mesh.flat else ""
    mesh = mesh_of(case)
    about = statistics(mesh)
    if about.dimension != 3:
        return ""
    scale = float(np.ptp(about.box, axis=0).max())
    for name, body in BODIES.items():
        if not {*body.faces, *body.edges} <= set(about.groups):
            continue
        made = statistics(read_mesh(made_mesh(Request(name, divisions=body.divisions)), ("tetra",)))
        close = np.abs(made.box - about.box).max() < 1e-6 * scale
        if close and abs(made.volume / about.volume - 1) < 0.05:
            return name
    return ""


def _divisions(body: str, scale: float) -> tuple[int, int, int]:
    x, y, z = (max(1, round(scale * count)) for count in BODIES[body].divisions)
    return (x, y, 2 * max(2, round(z / 2))) if body == "pvc_block" else (x, y, z)


def _rounded(size: float) -> float:
    """Three digits: what a person reads and types."""
    return float(f"{size:.3g}")
