"""[[load]]: a table of keys for each type. What a load does is in plan/loads/."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, get_args

from pydantic import Field

from ancf_petsc.input.types import Name, RampKey, Table, Vector, key


class LoadTable(Table):
    """What other parts of the program ask of any load. needs_mass: whether materials need a density because of it."""

    needs_mass: ClassVar[bool] = False

    @property
    def vector(self) -> Vector:
        """Where it points, as far as the case alone says."""
        return (0.0, 0.0, 0.0)

    def describe(self) -> str:
        """What it is, after its type."""
        return ""


class GravitySpec(LoadTable):
    """One [[load]] of type gravity, on everything that has mass."""

    needs_mass: ClassVar[bool] = True
    type: Literal["gravity"]
    acceleration: Vector = key("three numbers; such as [0.0, 0.0, -9.81]")
    ramp: RampKey = key('a ramp; such as "cosine"', "linear")

    @property
    def vector(self) -> Vector:
        return self.acceleration

    def describe(self) -> str:
        return f"({', '.join(f'{c:g}' for c in self.acceleration)})"


class ForceSpec(LoadTable):
    """One [[load]] of type force: dead, spread over the group by the shape functions."""

    type: Literal["force"]
    group: Name = key("a group's name in quotes; of the mesh file or of [groups]")
    total: Vector = key("three numbers; the whole force on the group, such as [0.0, 0.0, -120.0]")
    ramp: RampKey = key('a ramp; such as "cosine"', "linear")

    @property
    def vector(self) -> Vector:
        return self.total

    def describe(self) -> str:
        return f"on {self.group}: ({', '.join(f'{c:g}' for c in self.total)})"


Types = GravitySpec | ForceSpec
LoadSpec = Annotated[Types, Field(discriminator="type")]
LOADS: tuple[str, ...] = tuple(get_args(spec.model_fields["type"].annotation)[0] for spec in get_args(Types))
"""The types of loads."""
