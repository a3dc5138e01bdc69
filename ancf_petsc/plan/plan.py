"""From a case and its mesh to tables over nodal vectors and cells: what is known before a model is distributed.

A kind of entry of a case is a file of this folder. It checks its entries and enters them into tables over a part of the mesh
(`Part`), all of it on the root rank today; where the model gets more from it than rows of a table, it has a function for the
share of each rank.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.element.catalog import element
from ancf_petsc.element.element import Element
from ancf_petsc.errors import CaseError
from ancf_petsc.input.load import Case
from ancf_petsc.kernel.revolution import Revolution
from ancf_petsc.mesh.complete import complete
from ancf_petsc.mesh.groups import choose_groups
from ancf_petsc.mesh.mesh import Mesh
from ancf_petsc.plan.case_mesh import mesh_of
from ancf_petsc.plan.curve import CurveChoice, choose_curve, enter_stroke
from ancf_petsc.plan.loads import enter_loads
from ancf_petsc.plan.locking import locking_notes
from ancf_petsc.plan.materials import enter_materials
from ancf_petsc.plan.part import Part
from ancf_petsc.plan.probes import enter_probes
from ancf_petsc.plan.space import Space
from ancf_petsc.plan.supports import enter_supports
from ancf_petsc.plan.supports.free import refuse_free_motions
from ancf_petsc.plan.supports.table import SupportTable


@dataclass(frozen=True)
class Plan:
    """Tables over the nodal vectors (v) and cells (e) of a part of the mesh, in file order.

    space: nodes, nodal vectors and cells. material (e,): index into the case's materials. loads: number of a load -> (v,) what it
    entered. members: group -> (v,) bool, positions of its nodes. means: name -> (v,) weights of a mean position. revolution: of a
    body whose section the mesh is.
    """

    mesh: Mesh
    element: Element
    space: Space
    supports: SupportTable
    material: NDArray[np.int8]
    curve: CurveChoice | None
    loads: dict[int, NDArray]
    members: dict[str, NDArray]
    means: dict[str, NDArray]
    revolution: Revolution | None


def make_plan(case: Case) -> Plan:
    """Read the mesh and enter everything the case says into tables. Raises CaseError."""
    try:
        return plan_on(case, mesh_of(case))
    except CaseError as error:
        error.file = error.file or case.file
        raise


def plan_on(case: Case, mesh: Mesh) -> Plan:
    """The plan of a case on a mesh that was read for it. Raises CaseError."""
    spec, row = case.spec, element(case.spec.mesh.element)
    try:
        row.rule(spec.mesh.rule)
    except CaseError as error:
        error.file = case.file
        raise
    complete(mesh, row)
    mesh.notes.extend(locking_notes(spec))
    chosen = {name: group.model_dump(exclude_none=True) for name, group in spec.groups.items()}
    mesh.groups |= choose_groups(mesh, chosen, file=case.file)
    part = Part(case, mesh, row)
    supports = enter_supports(part)
    if spec.statics is not None:
        refuse_free_motions(part, supports)
    material, curve = enter_materials(part), choose_curve(part)
    return Plan(
        mesh=mesh,
        element=row,
        space=part.space,
        supports=supports,
        material=material,
        curve=curve,
        loads=enter_loads(part),
        members=_members(part),
        means=enter_stroke(part, curve) | enter_probes(part),
        revolution=part.revolution,
    )


def _members(part: Part) -> dict[str, NDArray]:
    """Groups whose reactions are wanted: the constrained ones and the curve's."""
    names = [spec.group for spec in part.spec.constraint]
    if part.spec.output.curve:
        names.append(part.spec.output.curve.force.group)
    return {name: part.members(part.mesh.groups[name]) for name in dict.fromkeys(names)}
