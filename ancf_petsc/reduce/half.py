"""Half and quarter of a scene that is symmetric about planes normal to axes."""

from __future__ import annotations

import numpy as np

from ancf_petsc.axes import AXES
from ancf_petsc.errors import CaseError
from ancf_petsc.mesh.kinds import KINDS, qualities
from ancf_petsc.reduce.cut import crossing_cells, cut
from ancf_petsc.reduce.remesh import remeshed
from ancf_petsc.reduce.shape import CLOSE
from ancf_petsc.reduce.symmetry import MirrorPlane, SceneModel
from ancf_petsc.reduce.tables import SmallerCase, free_name, halve, tables_and_mesh

HALVES = {f"half-{axis}": i for i, axis in enumerate(AXES)}
QUARTER = "quarter"
POOR = 0.1
"""Mean ratio of an element that is worth a note."""


def reduced_by_planes(scene: SceneModel, to: str) -> SmallerCase:
    """The part of a scene between its planes of symmetry. Raises CaseError where it is not symmetric, with the reason."""
    planes = [_plane(scene, i) for i in ([HALVES[to]] if to in HALVES else range(3))]
    why = [scene.why_not(plane) for plane in planes]
    good = [plane for plane, reason in zip(planes, why, strict=True) if not reason]
    wanted = 1 if to in HALVES else 2
    if len(good) < wanted:
        reasons = "; ".join(
            f"about {plane.describe()}: {reason}" for plane, reason in zip(planes, why, strict=True) if reason
        )
        raise CaseError(
            f"the scene is not symmetric {reasons}",
            file=scene.case.file,
            key="--to",
            got=to,
            expected="a plane of symmetry" if wanted == 1 else "two planes of symmetry normal to axes",
            cure="ancf advise lists the planes there are",
        )
    smaller = tables_and_mesh(scene.case, scene.mesh)
    _halve(scene, smaller, good[:wanted])
    smaller.data["title"] = f"{smaller.data['title']}, {'half' if wanted == 1 else 'quarter'}"
    return smaller


def _plane(scene: SceneModel, axis: int) -> MirrorPlane:
    """The plane through the middle normal to an axis, its normal to the side of the curve's group."""
    normal = np.eye(3)[axis]
    plane = MirrorPlane(scene.centre, normal)
    curve = scene.case.spec.output.curve
    for name in (curve.force.group, curve.stroke.group) if curve else ():
        height = float(plane.heights(scene.mesh.points[scene.mesh.groups[name].nodes]).mean())
        if abs(height) > CLOSE * scene.size:
            return MirrorPlane(plane.point, normal * np.sign(height))
    return plane


def _halve(scene: SceneModel, smaller: SmallerCase, planes: list[MirrorPlane]) -> None:
    """Cut along faces of elements where all planes consist of such; else make a new mesh of what they leave."""
    named = [(plane, free_name(scene.mesh, f"symmetry_{AXES[plane.axis or 0]}")) for plane in planes]
    crossed = sum(crossing_cells(scene.mesh, plane) for plane in planes)
    if crossed:
        smaller.notes.append(
            f"{crossed} elements lie across the plane: the part is meshed anew from its boundary"
        )
    whole = smaller.mesh
    for k, (plane, name) in enumerate(named):
        before = smaller.mesh
        smaller.mesh = (
            remeshed(whole, named[: k + 1], scene.case.file) if crossed else cut(before, plane, name)
        )
        halve(smaller, before, plane, name, {"fix": [AXES[plane.axis or 0]]})
    worst = float(qualities(smaller.mesh.points, smaller.mesh.cells, KINDS[smaller.mesh.kind]).min())
    if crossed and worst < POOR:
        smaller.notes.append(
            f"its worst element has a quality of {worst:.2g}: a finer mesh, or one of two halves, gives better ones"
        )
