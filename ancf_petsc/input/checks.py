"""What must hold between the tables of a case."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from pydantic import ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from ancf_petsc.element import dncm
from ancf_petsc.errors import CaseError
from ancf_petsc.input.schema import CaseSpec, ConstraintSpec
from ancf_petsc.input.section import section
from ancf_petsc.input.types import Direction, Ramp, problem

Problems = Iterator[PydanticCustomError]
JUMP = 3e-9
"""Rows of a ramp closer than this part of the interval of outputs may fall on one point of time."""


def check(spec: CaseSpec) -> None:
    """Raise ValidationError with the first of the problems, which says how many others there are."""
    found = problems(spec)
    if not found:
        return
    context = found[0].context or {}
    first = problem(**{**context, "more": len(found) - 1})
    raise ValidationError.from_exception_data("case", [InitErrorDetails(type=first, loc=(), input=None)])


def problems(spec: CaseSpec) -> list[PydanticCustomError]:
    """All that is wrong between the tables, the most basic first."""
    checks = (
        *(_one_analysis, _materials, _densities, _unions, _probes, _motion, _strokes, _arc_length, section),
        *(_held_slopes, _ramps, _options),
    )
    return [found for check in checks for found in check(spec)]


def _one_analysis(spec: CaseSpec) -> Problems:
    if spec.statics and spec.dynamics:
        yield problem(
            "[statics] and [dynamics] given", at=["dynamics"], expected="exactly one of them", cure="drop one"
        )
    if not spec.statics and not spec.dynamics:
        yield problem(
            "neither [statics] nor [dynamics] given",
            at=["statics"],
            expected="exactly one of them",
            cure="add [statics] for a load path, [dynamics] for motion",
        )


def _materials(spec: CaseSpec) -> Problems:
    if not spec.material:
        yield problem("missing", at=["material"], expected="a [material]", cure="give law, young and poisson")
    seen: set[str | None] = set()
    for index, material in enumerate(spec.material):
        if material.group in seen:
            yield problem(
                "a second material without group"
                if material.group is None
                else "a second material for this group",
                at=["material", index, "group"],
                got=material.group,
                expected="one material for a group, and one without group at most",
                cure="name another group or drop the entry",
            )
        seen.add(material.group)


def _densities(spec: CaseSpec) -> Problems:
    gravity = any(load.needs_mass for load in spec.load)
    if not gravity and not spec.dynamics:
        return
    for index, material in enumerate(spec.material):
        if material.density is None:
            yield problem(
                "missing",
                at=["material", index, "density"],
                expected=f"a number > 0, because of {'gravity' if gravity else '[dynamics]'}",
                cure="such as density = 1350.0",
            )


def _unions(spec: CaseSpec) -> Problems:
    """A union may name unions, but not, however far, itself."""
    for name in spec.groups:
        reached: set[str] = set()
        ahead = list(spec.groups[name].union or ())
        while ahead:
            member = ahead.pop()
            if member not in reached and member in spec.groups:
                ahead.extend(spec.groups[member].union or ())
            reached.add(member)
        if name in reached:
            yield problem(
                "the group contains itself",
                at=["groups", name, "union"],
                got=spec.groups[name].union,
                expected="other groups",
                cure=f"take {name!r} out",
            )


def _probes(spec: CaseSpec) -> Problems:
    names = [probe.name for probe in spec.probe]
    for index, name in enumerate(names):
        if name in names[:index]:
            yield problem(
                "a second probe of this name",
                at=["probe", index, "name"],
                got=name,
                expected="each name once",
                cure="rename one",
            )


def _motion(spec: CaseSpec) -> Problems:
    """A driven group starts where it is: a jump would be an infinite acceleration."""
    if not spec.dynamics:
        if spec.initial:
            yield problem(
                "[initial] without [dynamics]",
                at=["initial"],
                expected="[dynamics]",
                cure="drop [initial] or move on",
            )
        return
    for index, constraint in enumerate(spec.constraint):
        ramp = constraint.ramp
        if constraint.move and (ramp == "constant" or (not isinstance(ramp, str) and ramp[0][1] != 0)):
            yield problem(
                "a jump at t = 0 is an infinite acceleration",
                at=["constraint", index, "ramp"],
                got=ramp,
                expected="a ramp from 0",
                cure='such as "cosine"',
            )


def _ramps(spec: CaseSpec) -> Problems:
    """Rows of a ramp that rounding could make one would be a jump."""
    statics, dynamics = spec.statics, spec.dynamics
    outputs = dynamics.outputs if dynamics else 1
    if statics:
        outputs = statics.steps or len(statics.times or statics.strokes or (1,))
    entries = [("constraint", index, row.ramp) for index, row in enumerate(spec.constraint)]
    entries += [("load", index, row.ramp) for index, row in enumerate(spec.load)]
    for table, index, ramp in entries:
        s = () if isinstance(ramp, str) else [s for s, _ in ramp]
        close = next((pair for pair in pairwise(s) if pair[1] - pair[0] <= JUMP / outputs), None)
        if close:
            yield problem(
                f"the rows at s = {close[0]!r} and {close[1]!r} are a jump",
                at=[table, index, "ramp"],
                got=ramp,
                expected=f"rows farther apart than {JUMP:g} of an interval of outputs",
                cure="drop one of them, or let the ramp rise over a longer part",
            )


def _strokes(spec: CaseSpec) -> Problems:
    """Strokes are found by inverting the ramp of the group that is driven along output.curve.stroke."""
    if not spec.statics or not spec.statics.strokes:
        return
    if not spec.output.curve:
        yield problem(
            "missing",
            at=["output", "curve"],
            expected="the direction statics.strokes are measured in",
            cure='such as curve = { force = "top.z", stroke = "top.z" }',
        )
        return
    stroke = spec.output.curve.stroke
    driver = _driver(spec, stroke)
    if driver is None:
        yield problem(
            f"no constraint moves {stroke.group!r} in {stroke.axis}",
            at=["statics", "strokes"],
            got=spec.statics.strokes,
            expected="output.curve.stroke to be driven",
            cure="move it by a [[constraint]], or ask for steps or times",
        )
        return
    reach = abs(driver.move[stroke.axis]) * _largest(driver.ramp)  # type: ignore[index]
    if spec.statics.strokes[-1] > reach * (1 + 1e-12):
        yield problem(
            at=["statics", "strokes"],
            got=spec.statics.strokes[-1],
            expected=f"at most {reach:g}, as far as {stroke.group!r} moves",
            cure="ask for less or move it further",
        )


def _driver(spec: CaseSpec, stroke: Direction) -> ConstraintSpec | None:
    fits = (row for row in spec.constraint if row.group == stroke.group and row.move.get(stroke.axis))  # type: ignore[call-overload]
    return next(fits, None)


def _largest(ramp: Ramp) -> float:
    return 1.0 if isinstance(ramp, str) else max(abs(factor) for _, factor in ramp)


def _arc_length(spec: CaseSpec) -> Problems:
    """The load factor of a path by arc length is the pseudo-time itself, and may fall: ramps have to go on below 0."""
    if spec.statics is None or spec.statics.control != "arc_length":
        return
    if spec.statics.on_bifurcation == "follow":
        yield problem(
            "paths by arc length go straight on at bifurcations",
            at=["statics", "on_bifurcation"],
            got="follow",
            expected='"report" or "stop" with control = "arc_length"',
            cure='control = "load" follows',
        )
    driven = [("load", k, load.ramp) for k, load in enumerate(spec.load)]
    driven += [("constraint", k, row.ramp) for k, row in enumerate(spec.constraint) if row.move]
    for table, index, ramp in driven:
        if ramp not in ("linear", "constant"):
            yield problem(
                'control = "arc_length" makes the pseudo-time the load factor',
                at=[table, index, "ramp"],
                got=ramp,
                expected='"linear" or "constant"',
                cure='write ramp = "linear", or control = "load"',
            )
    if all(ramp == "constant" for *_, ramp in driven):
        yield problem(
            'control = "arc_length" without a load that grows',
            at=["statics", "control"],
            got="arc_length",
            expected='a load or move whose ramp is "linear"',
            cure='give one, or write control = "load"',
        )


def _held_slopes(spec: CaseSpec) -> Problems:
    """Only elements with slopes can hold some. What is no code at all is refused when the element is looked up."""
    code = spec.mesh.element
    try:
        if dncm.parse(code).vectors > 1:
            return
    except CaseError:
        return
    for index, constraint in enumerate(spec.constraint):
        if constraint.slopes:
            yield problem(
                f"element {code} has no slopes",
                at=["constraint", index, "slopes"],
                got=constraint.slopes,
                expected="an element with slopes",
                cure="drop it: fix holds all that a node of this element has",
            )


def _options(spec: CaseSpec) -> Problems:
    for name in spec.petsc:
        if name.startswith("-"):
            yield problem(
                "a leading dash",
                at=["petsc", name],
                expected="the name alone",
                cure=f"write {name.lstrip('-')}",
            )
