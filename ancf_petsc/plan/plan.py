"""From a case and its mesh to tables over nodes and cells: the root rank's part of building a model."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.element.catalog import element
from ancf_petsc.element.element import Element
from ancf_petsc.errors import CaseError
from ancf_petsc.input.load import Case
from ancf_petsc.input.schema import CaseSpec, ForceSpec
from ancf_petsc.mesh.check import connected_pieces
from ancf_petsc.mesh.complete import complete
from ancf_petsc.mesh.groups import (
    cells_of,
    choose_groups,
    find_group,
    measure,
    parts_for_load,
    parts_for_support,
    surface_of,
)
from ancf_petsc.mesh.mesh import Group, Mesh
from ancf_petsc.mesh.read import read_mesh
from ancf_petsc.model.constraint import ConstraintTable, Drive, Support, tabulate
from ancf_petsc.model.measures import AXES, CurveChoice
from ancf_petsc.model.ramp import make_ramp
from ancf_petsc.plan.free_motion import free_motions
from ancf_petsc.plan.slopes import prescribed_slopes, slopes_at
from ancf_petsc.plan.space import Space

STROKE = "stroke"


@dataclass
class Plan:
    """Tables over all nodal vectors (v) and all cells (e), in file order.

    space: nodes, nodal vectors and cells. shares: force load number -> (v,) share of each nodal vector in the total.
    members: group -> (v,) bool, positions of its nodes. means: name -> (v,) weights of a mean position.
    material (e,): index into the case's materials.
    """

    mesh: Mesh
    element: Element
    space: Space
    constraints: ConstraintTable
    material: NDArray[np.int8]
    curve: CurveChoice | None
    shares: dict[int, NDArray] = field(default_factory=dict)
    members: dict[str, NDArray] = field(default_factory=dict)
    means: dict[str, NDArray] = field(default_factory=dict)


def make_plan(case: Case) -> Plan:
    """Read the mesh and enter everything the case says into tables. Raises CaseError."""
    spec = case.spec
    try:
        row = element(spec.mesh.element)
        mesh = read_mesh(case.mesh_file, row.kinds, duplicates=spec.mesh.duplicates, element=row.code)
        return plan_on(case, mesh)
    except CaseError as error:
        error.file = error.file or case.file
        raise


def plan_on(case: Case, mesh: Mesh) -> Plan:
    """The tables of a case on a mesh that was read for it. Raises CaseError."""
    spec, row = case.spec, element(case.spec.mesh.element)
    try:
        row.rule(spec.mesh.rule)
    except CaseError as error:
        error.file = case.file
        raise
    complete(mesh, row)
    chosen = {name: group.model_dump(exclude_none=True) for name, group in spec.groups.items()}
    mesh.groups |= choose_groups(mesh, chosen, file=case.file)
    planner = _Planner(case, mesh, row)
    constraints = planner.constraints()
    if spec.statics is not None:
        planner.refuse_free_motions(constraints)
    return Plan(
        mesh=mesh,
        element=row,
        space=planner.space,
        constraints=constraints,
        material=planner.materials(),
        curve=planner.curve(),
        shares=planner.shares(),
        members=planner.members(),
        means=planner.means(),
    )


class _Planner:
    """Fills the tables of a plan, one method a table."""

    def __init__(self, case: Case, mesh: Mesh, row: Element) -> None:
        self.file = case.file
        self.spec: CaseSpec = case.spec
        self.mesh = mesh
        self.element = row
        self.space = Space(mesh, row)
        self.normal = self._normal()

    def _normal(self) -> int | None:
        """The axis a plane body does not move along; that of a straight beam is one the case does not speak of."""
        if self.element.components == 3:
            return None
        flat = [i for i in range(3) if np.abs(self.space.axes[i]).max() < 1e-9]
        if not flat:
            raise CaseError(
                "the beam lies along no plane of the axes",
                file=self.file,
                key="mesh.file",
                expected="a line in a plane x-y, y-z or z-x",
                cure="turn the mesh",
            )
        spoken = [load.total if isinstance(load, ForceSpec) else load.acceleration for load in self.spec.load]
        spoken += [self.spec.initial.velocity] if self.spec.initial else []
        used = {i for vector in spoken for i in range(3) if vector[i]}
        used |= {AXES.index(axis) for spec in self.spec.constraint for axis in (*spec.move, *spec.slopes)}
        return next((i for i in reversed(flat) if i not in used), flat[-1])

    def positions(self, group: Group) -> NDArray[np.int64]:
        """The nodal vectors that are positions of a group's nodes."""
        return self.space.first[self.space.compact[group.nodes]]

    def group(self, name: str, key: str) -> Group:
        return find_group(self.mesh, name, key, self.file)

    def constraints(self) -> ConstraintTable:
        supports, tangents, held = [], [], []
        for spec in self.spec.constraint:
            group = self.group(spec.group, f"constraint.{spec.group}.group")
            ramp = make_ramp(spec.ramp, "linear")
            drives = {AXES.index(axis): Drive(0.0, ramp) for axis in spec.fix}
            drives |= {AXES.index(axis): Drive(amount, ramp) for axis, amount in spec.move.items()}
            supports.append(Support(spec.group, self.positions(group), drives))
            if self.element.has_slopes:
                tangents.append((set(drives), parts_for_support(self.mesh, group)))
            held += [(slopes_at(self.space, group.nodes), AXES.index(axis)) for axis in spec.slopes]
        numbers = self.mesh.node_numbers[self.space.nodes][self.space.node_of()]
        try:
            table = tabulate(supports, self.space.vectors, numbers)
        except CaseError as error:
            error.file = self.file
            raise
        if self.element.has_slopes:
            self._hold_slopes(table, tangents)
        for vectors, axis in held:
            table.hold(vectors, axis)
        if self.normal is not None:
            table.hold(np.arange(self.space.vectors), self.normal)
        return table

    def _hold_slopes(self, table: ConstraintTable, tangents: list) -> None:
        """What is prescribed along surfaces and lines holds the slopes along them."""
        held, odd = prescribed_slopes(self.space, tangents)
        for axis in range(3):
            table.hold(np.flatnonzero(held[:, axis]), axis)
        if odd:
            self.mesh.notes.append(
                f"at {odd} nodes surfaces at odd angles hold different components: all slopes of these components are held"
            )

    def refuse_free_motions(self, constraints: ConstraintTable) -> None:
        """Raise CaseError if a connected piece of the body can move without deforming."""
        space = self.space
        pieces, label = connected_pieces(space.cells, len(space.nodes))
        points, driven, nodes = space.points, constraints.drive >= 0, space.node_of()
        free = free_motions(
            space.reference(), driven, label[nodes], pieces, slopes=space.slots() > 0, normal=self.normal
        )
        if not free:
            return
        piece, names = next(iter(free.items()))
        where = ""
        if pieces > 1:
            centre = ", ".join(f"{c:.6g}" for c in points[label == piece].mean(axis=0))
            where = f" of the piece around ({centre}), {len(free)} of {pieces} pieces,"
        raise CaseError(
            f"the supports{where} leave rigid motions free: {'; '.join(names)}",
            file=self.file,
            key="constraint",
            expected="statics to have none",
            cure="add a [[constraint]] that holds them, or ask for [dynamics]",
        )

    def materials(self) -> NDArray[np.int8]:
        """The material of each cell; the one without a group takes what is left."""
        material = np.full(len(self.mesh.cells), -1, np.int8)
        for number, spec in enumerate(self.spec.material):
            if spec.group is None:
                continue
            cells = cells_of(self.mesh, self.group(spec.group, f"material.{spec.group}.group"))
            if not len(cells):
                raise CaseError(
                    "the group holds no elements",
                    file=self.file,
                    key=f"material.{spec.group}.group",
                    got=spec.group,
                    expected="a group of volume, or of all nodes of some elements",
                )
            twice = cells[material[cells] >= 0]
            if len(twice):
                other = self.spec.material[material[twice[0]]].group
                raise CaseError(
                    f"{len(twice)} elements are in {other!r} as well, "
                    f"the first is element {self.mesh.cell_numbers[twice[0]]}",
                    file=self.file,
                    key=f"material.{spec.group}.group",
                    expected="one material an element",
                    cure="take the shared elements out of one group",
                )
            material[cells] = number
        rest = next((i for i, spec in enumerate(self.spec.material) if spec.group is None), None)
        left = np.flatnonzero(material < 0)
        if len(left) and rest is None:
            first = self.mesh.cell_numbers[left[0]]
            raise CaseError(
                f"{len(left)} elements have no material, the first is element {first}",
                file=self.file,
                key="material",
                expected="a material for every element",
                cure="add a [[material]] without group: it takes the rest",
            )
        material[left] = rest if rest is not None else 0
        return material

    def shares(self) -> dict[int, NDArray]:
        """Shares of the nodes in each force load."""
        shares = {}
        for number, spec in enumerate(self.spec.load):
            if isinstance(spec, ForceSpec):
                group = self.group(spec.group, f"load.{number}.group")
                shares[number] = self.space.shares(*parts_for_load(self.mesh, group))
        return shares

    def curve(self) -> CurveChoice | None:
        chosen = self.spec.output.curve
        if chosen is None:
            return None
        group = self.group(chosen.force.group, "output.curve.force")
        self.group(chosen.stroke.group, "output.curve.stroke")
        return CurveChoice(
            chosen.force.group,
            chosen.force.component,
            chosen.stroke.group,
            chosen.stroke.component,
            self._area(group),
        )

    def _area(self, group: Group) -> float | None:
        """Undeformed area of a group that is a surface; of a plane body the length of its sides times the thickness."""
        d = self.element.cell.dimension
        faces = surface_of(self.mesh, group) if d > 1 else None
        if faces is None:
            return None
        section = self.spec.section
        return measure(self.mesh, d - 1, faces) * (
            section.thickness if section and section.thickness else 1.0
        )

    def members(self) -> dict[str, NDArray]:
        """Groups whose reactions are wanted: the constrained ones and the curve's."""
        names = [spec.group for spec in self.spec.constraint]
        if self.spec.output.curve:
            names.append(self.spec.output.curve.force.group)
        members = {}
        for name in dict.fromkeys(names):
            members[name] = np.zeros(self.space.vectors, bool)
            members[name][self.positions(self.mesh.groups[name])] = True
        return members

    def means(self) -> dict[str, NDArray]:
        """Weights of the stroke and of the probes."""
        means = {}
        if self.spec.output.curve:
            group = self.mesh.groups[self.spec.output.curve.stroke.group]
            means[STROKE] = self._node_mean(group)
        for probe in self.spec.probe:
            group = self.group(probe.group, f"probe.{probe.name}.group")
            mean = self._area_mean(group, probe.name) if probe.mean == "area" else self._node_mean(group)
            means[f"probe {probe.name}"] = mean
        return means

    def _node_mean(self, group: Group) -> NDArray:
        weights = np.zeros(self.space.vectors)
        weights[self.positions(group)] = 1.0 / len(group.nodes)
        return weights

    def _area_mean(self, group: Group, name: str) -> NDArray:
        faces = surface_of(self.mesh, group)
        if faces is None:
            raise CaseError(
                'mean = "area" needs a surface',
                file=self.file,
                key=f"probe.{name}.mean",
                got=group.name,
                expected="a group of boundary faces",
                cure='mean = "nodes" takes any group',
            )
        return self.space.shares(self.element.cell.dimension - 1, faces)


def output_times(spec: CaseSpec, file: Path | None = None) -> list[float]:
    """Pseudo-times of the outputs of a static case, ascending, the last is 1."""
    statics = spec.statics
    assert statics is not None
    if statics.times:
        return sorted({*statics.times, 1.0})
    if statics.strokes:
        return sorted({*_stroke_times(spec, statics.strokes, file), 1.0})
    assert statics.steps
    return [k / statics.steps for k in range(1, statics.steps + 1)]


def _stroke_times(spec: CaseSpec, strokes: tuple[float, ...], file: Path | None) -> list[float]:
    """When the ramp of the driven group first reaches each stroke."""
    curve = spec.output.curve
    assert curve is not None
    axis: Any = curve.stroke.axis
    driver = next(c for c in spec.constraint if c.group == curve.stroke.group and axis in c.move)
    amplitude = abs(driver.move[axis])
    ramp = make_ramp(driver.ramp, "linear")
    times = []
    for stroke in strokes:
        s = ramp.first_time(
            min(stroke / amplitude, 1.0) if stroke <= amplitude * (1 + 1e-12) else stroke / amplitude
        )
        if s is None:
            raise CaseError(
                file=file,
                key="statics.strokes",
                got=stroke,
                expected=f"a stroke that the motion of {driver.group!r} reaches",
                cure=f"it moves by {amplitude:g} at most",
            )
        times.append(s)
    return [s for s in times if s > 0.0]
