"""What [section] must hold for an element: thickness and plane state, a body of revolution, or the section of a beam."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic_core import PydanticCustomError

from ancf_petsc.input.schema import CaseSpec, laws
from ancf_petsc.input.types import problem

Problems = Iterator[PydanticCustomError]


def section(spec: CaseSpec) -> Problems:
    """Solids have no section; plane elements need a plane state, and a thickness unless it is axisymmetric, beams their own."""
    yield from _keys(spec)
    given, condensing = spec.section, " or ".join(name for name, law in laws().items() if law.condenses)
    others = [material.law for material in spec.material if not laws()[material.law].condenses]
    if spec.mesh.element[0] == "2" and given and given.plane == "stress" and others:
        yield problem(
            at=["section", "plane"],
            got="stress",
            expected=f"plane strain for {others[0]}",
            cure=f"use {condensing} or plane strain",
        )
    if spec.mesh.element[0] == "1" and others:
        yield problem(
            "beams are linearly elastic",
            at=["material", 0, "law"],
            got=others[0],
            expected=f"{condensing} for beams",
            cure=f'law = "{condensing}": young is all a beam reads of it',
        )


def _keys(spec: CaseSpec) -> Problems:
    """Keys that are not read, and those that are missing."""
    who = f"element {spec.mesh.element}"
    needed: tuple[str, ...] = {"1": ("area", "inertia"), "2": ("thickness", "plane")}.get(
        spec.mesh.element[0], ()
    )
    read = needed
    if spec.mesh.element[0] == "2" and spec.is_axisymmetric:
        who, needed, read = "a body of revolution", ("plane",), ("plane", "axis", "angle")
    names = list(type(spec.section).model_fields) if spec.section else []
    given = [name for name in names if getattr(spec.section, name) is not None]
    for name in given:
        if name not in read:
            yield problem(
                f"{who} does not read it",
                at=["section", name],
                got=getattr(spec.section, name),
                expected=f"{' and '.join(read) or 'no [section]'} for {who}",
                cure="drop it",
            )
    for name in needed:
        if name not in given:
            yield problem(
                "missing",
                at=["section", name],
                expected=f"{' and '.join(needed)} for {who}",
                cure="add it to [section]",
            )
