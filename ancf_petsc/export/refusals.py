"""What CalculiX cannot be told, each refused with its key and the reason."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from ancf_petsc.errors import CaseError
from ancf_petsc.input.load import Case
from ancf_petsc.input.loads import GravitySpec
from ancf_petsc.input.schema import CaseSpec


class Refusal(NamedTuple):
    """key: of the case. got: its value. why, cure: for the message."""

    key: str
    got: object
    why: str
    cure: str


def refuse(case: Case, known_elements: tuple[str, ...]) -> None:
    """Raise CaseError for the first thing of a case that a deck cannot hold."""
    for found in _found(case.spec, known_elements):
        raise CaseError(found.why, file=case.file, key=found.key, got=found.got, cure=found.cure)


def _found(spec: CaseSpec, known: tuple[str, ...]) -> Iterator[Refusal]:
    if spec.mesh.element not in known:
        why = "CalculiX has no such element: it has neither slopes nor these beams"
        yield Refusal("mesh.element", spec.mesh.element, why, f"one of {', '.join(known)}")
    if spec.statics is None:
        yield Refusal("dynamics", "a motion", "motions are not exported", "replace [dynamics] by [statics]")
        return
    if spec.statics.control != "load":
        why = "CalculiX has no steps along the path"
        yield Refusal("statics.control", spec.statics.control, why, 'control = "load"')
    if spec.statics.on_bifurcation == "follow":
        why = "CalculiX does not take branches"
        yield Refusal("statics.on_bifurcation", "follow", why, 'on_bifurcation = "report"')
    yield from _materials(spec)
    for row in spec.constraint:
        if row.slopes:
            why = "CalculiX's nodes have no slopes"
            yield Refusal(f"constraint.{row.group}.slopes", row.slopes, why, "drop it")
    ramps = {row.ramp for row in spec.load if isinstance(row, GravitySpec)}
    if len(ramps) > 1:
        why = "CalculiX takes one ramp for all gravity"
        yield Refusal("load", f"gravity with {len(ramps)} ramps", why, "give the gravity loads one ramp")


def _materials(spec: CaseSpec) -> Iterator[Refusal]:
    for number, row in enumerate(spec.material):
        key = f"material.{row.group or number}" if len(spec.material) > 1 else "material"
        if row.law == "neo_hooke" and row.poisson != 0:
            why = (
                "no law of CalculiX has this volumetric term, lambda/2 (ln J)^2: its NEO HOOKE splits the deformation, "
                "with (J - 1)^2 / D, and its CIARLET_EL has lambda/4 (J^2 - 1 - 2 ln J)"
            )
            yield Refusal(
                f"{key}.law",
                row.law,
                why,
                'law = "svk"; with poisson = 0 the term vanishes and neo_hooke is exported',
            )
        if row.law not in ("svk", "neo_hooke"):
            yield Refusal(f"{key}.law", row.law, "CalculiX has no such law", 'law = "svk"')
