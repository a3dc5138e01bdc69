"""A deck that CalculiX solves as it is: `ccx -i NAME`.

Its *ELASTIC with NLGEOM is St Venant-Kirchhoff; its user material CIARLET_EL is our neo_hooke where Poisson's ratio is 0. Reals
stand in its fields of 20 characters. Forces it prints for a set (RF) are internal ones: reactions and loads of the set's nodes
together.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from io import StringIO
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.axes import AXES
from ancf_petsc.element.catalog import element
from ancf_petsc.export import applied
from ancf_petsc.export.amplitudes import Amplitudes, grouped
from ancf_petsc.export.names import deck_names
from ancf_petsc.export.planes import axes_held, equations, plane_normals
from ancf_petsc.export.refusals import refuse
from ancf_petsc.input.load import Case
from ancf_petsc.input.loads import GravitySpec
from ancf_petsc.mesh.groups import cells_of
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.plan.outputs import output_times
from ancf_petsc.plan.plan import Plan
from ancf_petsc.plan.ramps import Ramps
from ancf_petsc.plan.revolution import on_axis

REAL = "%.12e"
"""Thirteen digits in at most 20 characters, which is what CalculiX reads of a field."""
PER_LINE = 8
RESIDUAL, CORRECTION = 1e-9, 1e-7
"""Of CalculiX's iterations, relative to its mean force and largest displacement: forces are then right to the digits it prints."""
ZERO_FORCE, SMALL_FORCE, SMALL_STRAIN = 1e-6, 1.0, 1e-3
"""CalculiX's threshold for a residual, in any unit; forces should be a million times larger, at strains such as the third."""
FIRST, SMALLEST, MOST_INCREMENTS = 0.1, 1e-6, 100000
EVERY_NODE, WHOLE_BODY = "EVERY_NODE", "WHOLE_BODY"


class Type(NamedTuple):
    """name: CalculiX's element. points: with how many it integrates. differs: in what it is another element than ours, if it is.

    within: part of the largest force by which both may differ: half a unit in the last of seven digits, more for other elements.
    """

    name: str
    points: int
    differs: str = ""
    within: float = 5e-7


THICK = "CalculiX gives the nodes of plane stress elements thicknesses of their own: forces agree only as the mesh is refined"
SECTOR = 2.0
"""Degrees of the ring that CalculiX computes, and of which it prints forces; forces it is given are those of all of it."""
RING = (
    f"CalculiX computes a sector of {SECTOR:g} degrees of the ring, of bricks and wedges: forces it prints are the sector's, "
    "and those along the radius have no counterpart here"
)
TYPES: dict[tuple[str, str | None], Type] = {
    ("3413", None): Type("C3D4", 1),
    ("3-10-1-3", None): Type("C3D10", 4),
    ("3813", None): Type("C3D8", 8),
    ("2312", "strain"): Type("CPE3", 1),
    ("2312", "stress"): Type("CPS3", 1, THICK, 1e-2),
    ("2312", "axisymmetric"): Type("CAX3", 1, RING, 1e-2),
    ("2-6-1-2", "strain"): Type("CPE6", 3),
    ("2-6-1-2", "stress"): Type("CPS6", 3, THICK, 1e-2),
    ("2-6-1-2", "axisymmetric"): Type("CAX6", 3, RING, 1e-5),
    ("2412", "strain"): Type("CPE4", 4),
    ("2412", "stress"): Type("CPS4", 4, THICK, 1e-2),
    ("2412", "axisymmetric"): Type("CAX4", 4, RING, 1e-3),
}
"""CalculiX's element for ours and its plane state."""


def write(case: Case, plan: Plan) -> tuple[str, list[str]]:
    """The deck of a static case, and notes of what CalculiX computes differently. Raises CaseError for what it cannot be told."""
    refuse(case, tuple(dict.fromkeys(code for code, _ in TYPES)))
    file = StringIO()
    deck = _CalculixDeck(case, plan, file)
    deck.write()
    return file.getvalue(), deck.notes


def type_of(case: Case) -> Type | None:
    """CalculiX's element for that of a case; None where it has none."""
    return TYPES.get((case.spec.mesh.element, case.spec.section.plane if case.spec.section else None))


def same_quadrature(case: Case) -> str | None:
    """The mesh.rule with which our element has as many points as CalculiX's; None where none has, or CalculiX no such element."""
    type_ = type_of(case)
    row = element(case.spec.mesh.element)
    return next(
        (name for name in row.points if name != "mass" and type_ and row.points[name] == type_.points), None
    )


class _CalculixDeck:
    """Writes the parts of a deck in their order.

    turn (3,): the axes of the case that are CalculiX's 1, 2 and 3, which takes plane bodies in its plane 1-2.
    """

    def __init__(self, case: Case, plan: Plan, file: StringIO) -> None:
        self.case, self.plan, self.file = case, plan, file
        self.spec, self.mesh = case.spec, plan.mesh
        assert case.spec.statics
        found = type_of(case)
        assert found
        self.type = found
        self.names = deck_names(plan.mesh.groups, (EVERY_NODE, WHOLE_BODY))
        self.turn = axes_of_deck(plan)
        self.normals = plane_normals(plan, case.spec)
        self.times = output_times(case.spec, case.file)
        self.ramps = Ramps(case.spec, case.file)
        self.amplitudes = Amplitudes(self.times)
        self.notes = list(self._notes())

    def write(self) -> None:
        """All of it."""
        step = [
            *self._moves(),
            *self._forces(),
            *self._gravity(),
        ]  # collects the amplitudes, which stand before
        self._lines(self._heading())
        self._mesh()
        self._materials()
        self._lines(self._supports())
        for name, rows in self.amplitudes.tables.items():
            self._lines([f"*AMPLITUDE, NAME={name}"])
            self._table(rows, REAL)
        self._lines(["*TIME POINTS, NAME=OUTPUTS"])
        self._table(np.array(self.times)[:, None], REAL)
        self._lines(self._step())
        self._lines(step)
        self._lines(self._prints())
        self._lines(["*END STEP"])

    def _lines(self, lines: Iterable[str]) -> None:
        self.file.writelines(f"{line}\n" for line in lines)

    def _table(self, rows: NDArray, form: str | Sequence[str]) -> None:
        np.savetxt(self.file, rows, fmt=form, delimiter=", ")

    def _notes(self) -> Iterator[str]:
        ours = len(self.plan.element.rule(self.spec.mesh.rule))
        force = min(row.young for row in self.spec.material) * self.mesh.size**2
        if force * SMALL_STRAIN < SMALL_FORCE:
            yield (
                f"CalculiX takes forces below {ZERO_FORCE:g} for none, and Young's modulus times the square of the body's size is "
                f"{force:.3g}: write lengths and moduli in units that make forces larger"
            )
        if self.type.differs:
            yield self.type.differs
        if ours != self.type.points:
            same = same_quadrature(self.case)
            cure = f'; mesh.rule = "{same}" makes both the same' if same else ""
            yield f"CalculiX integrates {self.type.name} with {self.type.points} points, this case with {ours}{cure}"

    def _heading(self) -> Iterator[str]:
        yield "*HEADING"
        yield " ".join(self.spec.title.split())
        yield "** Written by ancf_petsc. Numbers of nodes and elements are those of the mesh file."
        if self.turn != [0, 1, 2]:
            said = ", ".join(f"{k + 1} is {AXES[axis]}" for k, axis in enumerate(self.turn))
            yield f"** Axes: {said}."
        if self.spec.output.symmetry != 1:
            yield f"** Forces are those of the part that is meshed; the case multiplies them by {self.spec.output.symmetry:g}."
        if self.spec.load:
            yield "** RF of a set has the loads on its nodes in it: the support's force is RF less these loads."
        for note in self.notes:
            yield f"** {note}."
        for name, word in self.names.items():
            if name.upper() != word:
                yield f"** {word} is the group {' '.join(name.split())}"

    def _mesh(self) -> None:
        mesh, used = self.mesh, self.mesh.used
        self._lines([f"*NODE, NSET={EVERY_NODE}"])
        points = mesh.points[used][:, self.turn]
        if self.plan.element.cell.dimension == 2:
            points = np.column_stack((points[:, :2], np.zeros(len(points))))
        self._table(np.column_stack((mesh.node_numbers[used], points)), ["%d", REAL, REAL, REAL])
        self._lines([f"*ELEMENT, TYPE={self.type.name}, ELSET={WHOLE_BODY}"])
        self._table(np.column_stack((mesh.cell_numbers, mesh.node_numbers[self._cells()])), "%d")
        for name, group in mesh.groups.items():
            nodes = group.nodes[used[group.nodes]]
            if len(nodes):
                self._set(f"*NSET, NSET={self.names[name]}", mesh.node_numbers[nodes])
            if self.plan.element.cell.dimension in group.parts or group.cells is not None:
                self._set(f"*ELSET, ELSET={self.names[name]}", mesh.cell_numbers[cells_of(mesh, group)])

    def _cells(self) -> NDArray:
        """Nodes (e, k) of the cells, counterclockwise in CalculiX's plane 1-2."""
        cells, kind = self.mesh.cells, KINDS[self.mesh.kind]
        if kind.dimension == 2 and (self.turn[1] - self.turn[0]) % 3 != 1:
            quadratic = next(
                (k for k in KINDS.values() if k.linear == kind.name and k.nodes == cells.shape[1]), kind
            )
            return cells[:, quadratic.mirrored]
        return cells

    def _set(self, card: str, numbers: NDArray) -> None:
        words = [str(number) for number in numbers]
        rows = (", ".join(words[k : k + PER_LINE]) + "," for k in range(0, len(words), PER_LINE))
        self._lines([card, *rows])

    def _materials(self) -> None:
        """The materials with their elements, none that has no elements."""
        numbers = np.flatnonzero(np.bincount(self.plan.material, minlength=len(self.spec.material)))
        for number in numbers:
            row = self.spec.material[number]
            user = row.law == "neo_hooke"
            name = f"CIARLET_EL_{number + 1}" if user else f"SVK_{number + 1}"
            own = f"OF_{name}"
            self._set(f"*ELSET, ELSET={own}", self.mesh.cell_numbers[self.plan.material == number])
            lines = [f"*MATERIAL, NAME={name}", "*USER MATERIAL, CONSTANTS=2" if user else "*ELASTIC"]
            lines.append(f"{REAL % row.young}, {REAL % row.poisson}")
            if row.density is not None:
                lines += ["*DENSITY", REAL % row.density]
            lines.append(f"*SOLID SECTION, ELSET={own}, MATERIAL={name}")
            section = self.spec.section
            if section and section.thickness:
                lines.append(REAL % section.thickness)
            self._lines(lines)

    def _supports(self) -> Iterator[str]:
        for row in self.spec.constraint:
            still = [axis for axis, amount in row.move.items() if amount == 0.0]
            for k in self._places((*axes_held(row, self.normals), *still)):
                yield from ("*BOUNDARY", f"{self.names[row.group]}, {k}, {k}")
        if self.plan.revolution:
            for node in self.mesh.node_numbers[on_axis(self.plan.space, self.plan.revolution)]:
                yield from ("*BOUNDARY", f"{node}, 1, 1")
        for point, terms in equations(self.plan, self.spec, self.normals):
            node = self.mesh.node_numbers[point]
            yield from ("*EQUATION", str(len(terms)))
            yield ", ".join(f"{node}, {self.turn.index(axis) + 1}, {REAL % factor}" for axis, factor in terms)

    def _places(self, axes: Iterable[str]) -> list[int]:
        """CalculiX's numbers of axes of the case; of plane bodies those in the plane."""
        places = [self.turn.index(AXES.index(axis)) + 1 for axis in axes]
        return [k for k in places if k <= self.plan.element.cell.dimension]

    def _step(self) -> Iterator[str]:
        first = min(FIRST, self.times[0])
        yield f"*STEP, NLGEOM, INC={MOST_INCREMENTS}"
        yield "*STATIC"
        yield f"{first:.9g}, 1., {min(SMALLEST, first):.9g}, 1."
        yield "*CONTROLS, PARAMETERS=FIELD"
        yield f"{RESIDUAL:g}, {CORRECTION:g}"

    def _moves(self) -> Iterator[str]:
        for row in self.spec.constraint:
            for axis, amount in row.move.items():
                for k in self._places((axis,)) if amount else ():
                    ramp = self.ramps.of_support(row.ramp)
                    yield f"*BOUNDARY, AMPLITUDE={self.amplitudes.name(ramp)}"
                    yield f"{self.names[row.group]}, {k}, {k}, {REAL % amount}"

    def _forces(self) -> Iterator[str]:
        forces, ramps = applied.forces(self.case, self.plan)
        forces = forces * forces_given(self.plan)
        numbers = self.mesh.node_numbers[self.plan.space.nodes]
        for shares, nodes, components, amounts in grouped(forces[:, self.turn]):
            yield f"*CLOAD, AMPLITUDE={self.amplitudes.name_of_sum(ramps, shares)}"
            for node, component, amount in zip(nodes, components, amounts, strict=True):
                yield f"{numbers[node]}, {component + 1}, {REAL % amount}"

    def _gravity(self) -> Iterator[str]:
        loads = [load for load in self.spec.load if isinstance(load, GravitySpec)]
        total = np.sum([load.acceleration for load in loads], axis=0) if loads else np.zeros(3)
        size = float(np.linalg.norm(total))
        if size == 0:
            return
        direction = ", ".join(REAL % value for value in (total / size)[self.turn])
        ramp = self.ramps.of_load(loads[0].ramp)
        yield f"*DLOAD, AMPLITUDE={self.amplitudes.name(ramp)}"
        yield f"{WHOLE_BODY}, GRAV, {REAL % size}, {direction}"

    def _prints(self) -> Iterator[str]:
        """Forces of all groups whose reactions we report, displacements of those whose means we follow, fields for viewers."""
        for name in self.plan.members:
            yield from (f"*NODE PRINT, NSET={self.names[name]}, TOTALS=ONLY, TIME POINTS=OUTPUTS", "RF")
        curve = self.spec.output.curve
        followed = [curve.stroke.group] if curve else []
        for name in dict.fromkeys([*followed, *(probe.group for probe in self.spec.probe)]):
            yield from (f"*NODE PRINT, NSET={self.names[name]}, TIME POINTS=OUTPUTS", "U")
        yield from ("*NODE FILE, TIME POINTS=OUTPUTS", "U, RF", "*EL FILE, TIME POINTS=OUTPUTS", "S, E")


def axes_of_deck(plan: Plan) -> list[int]:
    """The axes of the case that are CalculiX's 1, 2 and 3; of bodies of revolution 1 is the radius and 2 the axis."""
    if plan.revolution:
        return [plan.revolution.radial, plan.revolution.axis, plan.revolution.normal]
    if plan.element.cell.dimension == 3:
        return [0, 1, 2]
    first, second = (int(np.abs(plan.space.axes[:, k]).argmax()) for k in range(2))
    return [first, second, 3 - first - second]


def forces_given(plan: Plan) -> float:
    """What forces of the case are multiplied by for CalculiX: of bodies of revolution it takes those all around the axis."""
    return 2.0 * np.pi / plan.revolution.angle if plan.revolution else 1.0


def forces_printed(plan: Plan) -> float:
    """What forces that CalculiX prints are multiplied by: of bodies of revolution they are those of its sector."""
    return plan.revolution.angle / np.radians(SECTOR) if plan.revolution else 1.0
