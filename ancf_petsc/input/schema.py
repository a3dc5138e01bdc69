"""The case file, format 1: every table with its keys, defaults and limits. docs/case-format.md is for users.

Each key carries its expectation in words; input/messages.py makes a user's message of it. What must hold between tables
is in input/checks.py.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, Field, model_validator

from ancf_petsc.axes import AXES
from ancf_petsc.input.analysis import (
    CriticalMode,
    DynamicsSpec,
    InitialSpec,
    StaticsSpec,
)
from ancf_petsc.input.interval import EXPECTED, checked
from ancf_petsc.input.loads import ForceSpec, GravitySpec, LoadSpec
from ancf_petsc.input.types import (
    Axes,
    Axis,
    Count,
    Direction,
    DirectionKey,
    Fixed,
    Name,
    Points,
    RampKey,
    Table,
    Vector,
    key,
    one_of,
    problem,
)

if TYPE_CHECKING:
    from ancf_petsc.material.models import Law


def laws() -> Mapping[str, Law]:
    """The laws there are; they are imported, and numba with them, when a case is checked."""
    from ancf_petsc.material.models import LAWS

    return LAWS


class MeshSpec(Table):
    """[mesh]: a file, from the case file's folder, or one of the program's bodies; and the element."""

    file: Name | None = key('a file name; relative to the case file, such as "block.msh"', None)
    body: Name | None = key('a name of `ancf mesh --list` in quotes; such as "pvc_block"', None)
    size: float | None = key("a number > 0; length of edges of `body`, in metres", None, gt=0)
    rim: float | None = key("a number > 0; length of edges at rims of bonded faces of `body`", None, gt=0)
    divisions: tuple[Count, Count, Count] | None = key(
        "three whole numbers >= 1; bricks of `body` along x, y, z, such as [4, 4, 8]", None
    )
    hexahedra: bool = key("true to leave the bricks of `divisions` whole", False)
    flat: Literal["triangle", "quad", "line"] | None = key(
        'one of "triangle", "quad", "line"; a section or an axis of `body`', None
    )
    element: str = key(
        'a code of the catalogue, in quotes; such as "3413"', pattern=r"^(\d{4}|\d-\d+-\d-\d)(\+\d+)?$"
    )
    refine: int = key("a whole number from 0 to 8; how often every element is divided", 0, ge=0, le=8)
    duplicates: Literal["error", "keep", "merge"] = key("what to do about coincident nodes", "error")
    rule: Literal["default", "reduced", "exact"] = key("a choice of quadrature", "default")

    @model_validator(mode="after")
    def _check(self) -> MeshSpec:
        if self.body is None and self.file is None:
            raise problem(
                "missing",
                at=["file"],
                expected="a mesh file",
                cure='or one of the program\'s bodies: body = "cube"',
            )
        if self.body is not None and self.file is not None:
            raise problem(
                "file and body given", at=["body"], got=self.body, expected="one of them", cure="drop one"
            )
        of_body = [name for name in ("size", "rim", "divisions", "hexahedra", "flat") if getattr(self, name)]
        if self.file is not None and of_body:
            raise problem(
                at=[of_body[0]],
                got=getattr(self, of_body[0]),
                expected="body = ... with it: a mesh file has its own size",
                cure="make a file finer by refine",
            )
        return self


class GroupSpec(Table):
    """[groups] NAME: nodes chosen by geometry. Exactly one of plane, box, nearest, union."""

    plane: Axis | Vector | None = key(
        'an axis "x", "y", "z" or a normal [nx, ny, nz]; such as plane = "x"', None
    )
    at: float | Literal["min", "max"] | None = key(
        'a number, "min" or "max"; where the plane cuts its normal', None
    )
    box: tuple[Vector, Vector] | None = key("two corners [[x, y, z], [x, y, z]]; opposite ones", None)
    nearest: Points | None = key("a point [x, y, z] or a list of points; such as [0.5, 0.0, 0.1]", None)
    union: tuple[Name, ...] | None = key('a list of group names; such as ["end", "slab"]', None, min_length=1)

    @model_validator(mode="after")
    def _check(self) -> GroupSpec:
        kinds = ("plane", "box", "nearest", "union")
        given = [kind for kind in kinds if getattr(self, kind) is not None]
        if len(given) != 1:
            raise problem(
                f"{' and '.join(given) or 'nothing'} given",
                expected="exactly one of plane, box, nearest, union",
                cure='such as { plane = "x", at = "max" }; join two choices by union',
            )
        if (self.plane is None) != (self.at is None):
            missing = "at" if self.at is None else "plane"
            raise problem(
                "missing", at=[missing], expected="plane and at together", cure='such as at = "min"'
            )
        if self.plane == (0.0, 0.0, 0.0):
            raise problem(
                at=["plane"], got=self.plane, expected="a normal with a length", cure='or an axis such as "x"'
            )
        return self


class MaterialSpec(Table):
    """[material], or one [[material]]: the one without a group takes what the others leave."""

    group: Name | None = key("a group's name in quotes; of the mesh file or of [groups]", None)
    law: Annotated[str, one_of(laws, "a law")] = key('a law; such as law = "svk"')
    young: float = key(
        "a number > 0 (1e-50 to 1e50); Young's modulus in the unit of stress, such as young = 6.8e6",
        ge=1e-100,
        le=1e100,
    )
    poisson: float = key(
        "a number in (-1, 0.5); use 0.49 with element 3-10-1-3 or 3843 for nearly incompressible material",
        gt=-1,
        lt=0.5,
    )
    density: float | None = key("a number > 0; the undeformed mass per volume", None, gt=0)


class ConstraintSpec(Table):
    """One [[constraint]]: components held (fix) and driven (move) of a group, and of its nodes' slopes held (slopes)."""

    group: Name = key("a group's name in quotes; of the mesh file or of [groups]")
    fix: Fixed = key('a list out of "x", "y", "z" and "normal"; such as ["x", "y"]', ())
    move: dict[Axis, float] = key("displacements by axis; such as { z = -0.025 }", {})
    slopes: Axes = key('a list out of "x", "y", "z"; components of the slopes to hold, such as ["z"]', ())
    ramp: RampKey = key('a ramp; such as "cosine"', "linear")

    @model_validator(mode="after")
    def _check(self) -> ConstraintSpec:
        kinds = [name for name in type(self).model_fields if name not in ("group", "ramp")]
        if not any(getattr(self, name) for name in kinds):
            raise problem(
                f"neither {' nor '.join(kinds)}",
                expected="one of them at least",
                cure='such as fix = ["x", "y", "z"]',
            )
        both = [axis for axis in AXES if axis in self.fix and axis in self.move]
        if both:
            raise problem(
                f"{both[0]} is fixed and moved",
                at=["move"],
                got=self.move,
                expected="one of both",
                cure="drop one",
            )
        return self


class CurveSpec(Table):
    """output.curve: what the columns force and stroke mean."""

    force: DirectionKey = key('"group.axis"; such as "top.z"')
    stroke: DirectionKey = key('"group.axis"; such as "top.z"')


class OutputSpec(Table):
    """[output]."""

    symmetry: float = key("a number > 0; 4 for a quarter of the body", 1.0, gt=0)
    curve: CurveSpec | None = key('a table; such as { force = "top.z", stroke = "top.z" }', None)
    checkpoint: Annotated[str, AfterValidator(checked)] = key(f'{EXPECTED}; such as "10 min"', "10 min")


class ProbeSpec(Table):
    """One [[probe]]: the mean position of a group."""

    name: Name = key("a name in quotes; it heads the columns of probes.csv")
    group: Name = key("a group's name in quotes; of the mesh file or of [groups]")
    mean: Literal["nodes", "area"] = key("a kind of mean", "nodes")


class SectionSpec(Table):
    """[section], for plane elements and beams."""

    thickness: float | None = key("a number > 0", None, gt=0)
    plane: Literal["stress", "strain", "axisymmetric"] | None = key("a kind of plane state", None)
    axis: Axis | None = key(
        'an axis "x", "y" or "z" in the plane of the mesh; the axis of revolution, through the origin', None
    )
    angle: float | None = key(
        "a number in (0, 360]; degrees of the ring that forces and energies are of", None, gt=0, le=360
    )
    area: float | None = key("a number > 0", None, gt=0)
    inertia: float | None = key("a number > 0; the second moment of area", None, gt=0)


class CaseSpec(Table):
    """A whole case file."""

    format: Literal[1] = key("1; this program reads format 1", 1)
    title: str = key('a title in quotes; such as title = "Block under compression"')
    units: str = key("a label in quotes; for plots, nothing is converted", "SI")
    note: str = key("a remark in quotes; it stands under every picture", "")
    mesh: MeshSpec = key("a table [mesh]; with file and element")
    groups: dict[Name, GroupSpec] = key("a table [groups]; of choices by geometry", {})
    material: tuple[MaterialSpec, ...] = key("a table [material]; or several [[material]]")
    constraint: tuple[ConstraintSpec, ...] = key("tables; write [[constraint]]", ())
    load: tuple[LoadSpec, ...] = key("tables; write [[load]]", ())
    statics: StaticsSpec | None = key("a table [statics]", None)
    dynamics: DynamicsSpec | None = key("a table [dynamics]", None)
    initial: InitialSpec | None = key("a table [initial]", None)
    output: OutputSpec = Field(default_factory=OutputSpec, description="a table [output]")
    probe: tuple[ProbeSpec, ...] = key("tables; write [[probe]]", ())
    petsc: dict[Name, str | int | float | bool] = key(
        'an option with its value, without the leading dash; such as ksp_type = "cg"', {}
    )
    section: SectionSpec | None = key("a table [section]", None)

    @property
    def is_axisymmetric(self) -> bool:
        """Whether the body is one of revolution, of which the mesh is the section."""
        return self.section is not None and self.section.plane == "axisymmetric"

    @model_validator(mode="before")
    @classmethod
    def _motion_ramps(cls, data: Any) -> Any:
        """In motion loads act from the start and moves begin and end at rest, unless the case says more."""
        if not (isinstance(data, dict) and "dynamics" in data):
            return data
        defaults = {"constraint": "cosine", "load": "constant"}
        filled = {
            name: tuple({"ramp": ramp, **row} if isinstance(row, dict) else row for row in data[name])
            for name, ramp in defaults.items()
            if isinstance(data.get(name), tuple)
        }
        return {**data, **filled}


__all__ = [
    "CaseSpec",
    "ConstraintSpec",
    "CriticalMode",
    "CurveSpec",
    "Direction",
    "DynamicsSpec",
    "ForceSpec",
    "GravitySpec",
    "GroupSpec",
    "InitialSpec",
    "LoadSpec",
    "MaterialSpec",
    "MeshSpec",
    "OutputSpec",
    "ProbeSpec",
    "SectionSpec",
    "StaticsSpec",
]
