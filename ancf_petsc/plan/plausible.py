"""What looks wrong in a case though it can be computed: units that do not fit together, moves too far, entries without effect.

Any consistent units will do, so that no number is wrong by itself: what is judged are numbers that no material has in any of the
usual systems (m, kg, s, N, Pa; mm, t, s, N, MPa; mm, kg, ms, kN, GPa), and pairs that belong to two of them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.axes import AXES
from ancf_petsc.input.load import Case
from ancf_petsc.input.loads import ForceSpec, GravitySpec
from ancf_petsc.input.schema import MaterialSpec
from ancf_petsc.plan.plan import Plan
from ancf_petsc.plan.probes import name_of

STIFFEST_IN_MPA = 1.3e6
"""Diamond's modulus: larger numbers are in Pa."""
STIFF_IN_PA = 1e9
"""Softer materials, in Pa, are rubber, foam and soft plastics: no body of LARGEST_SOFT metres is made of them."""
LARGEST_SOFT, LARGEST_STIFF = 10.0, 50.0
SLOWEST, FASTEST = 0.1, 3e7
"""Speeds of sound sqrt(E / density): those of the softest gels in m/s and of diamond in mm/s lie between."""
DENSE_IN_SI = (5.0, 3e4)
"""kg/m^3, from foam to the heaviest metals."""
LIGHT_IN_SI = 1e-3
GRAVITY, NEAR = {"m/s^2": 9.81, "mm/s^2": 9810.0}, 0.02
LONGEST_PULL = 10.0
"""Times the body's size: no rubber is stretched so far."""
HEAVY = 10.0
"""Times Young's modulus: the stress of a weight or a load that no body bears."""


def doubts_of(case: Case, plan: Plan) -> list[str]:
    """One line for each number that looks wrong: key, number, why, and what was probably meant."""
    return [*_units(case, plan), *_moves(case, plan), *_loads(case, plan), *_idle(case, plan)]


def _box(plan: Plan) -> NDArray[np.float64]:
    """Lengths (3,) of the body along the axes."""
    points = plan.mesh.points[plan.mesh.used]
    return np.ptp(points, axis=0)


def _key(material: MaterialSpec, name: str) -> str:
    return f"material.{material.group}.{name}" if material.group else f"material.{name}"


def _units(case: Case, plan: Plan) -> Iterator[str]:
    size = float(_box(plan).max())
    for material in case.spec.material:
        young, density = material.young, material.density
        in_pa = young > STIFFEST_IN_MPA
        si_density = density is not None and DENSE_IN_SI[0] < density < DENSE_IN_SI[1]
        largest = LARGEST_SOFT if young < STIFF_IN_PA else LARGEST_STIFF
        if (in_pa or si_density) and size > largest:
            yield (
                f"mesh: the body is {size:.4g} long, and {_key(material, 'young')} = {young:g} is in Pa: of metres that is very "
                f"large; a mesh in mm goes with MPa (young = {young / 1e6:g}) and t/mm^3"
            )
        if density is None:
            continue
        speed = np.sqrt(young / density)
        if speed > FASTEST or (in_pa and density < LIGHT_IN_SI):
            yield (
                f"{_key(material, 'density')} = {density:g} with young = {young:g}: sound would travel at {speed:.3g}, faster than "
                f"in any material; a modulus in Pa goes with kg/m^3 (density = {1e12 * density:g}), t/mm^3 with MPa"
            )
        elif speed < SLOWEST:
            yield (
                f"{_key(material, 'young')} = {young:g} with density = {density:g}: sound would travel at {speed:.3g}, slower "
                f"than in any solid; kg/m^3 goes with Pa (young = {1e6 * young:g}), MPa with t/mm^3"
            )


def _moves(case: Case, plan: Plan) -> Iterator[str]:
    """In statics: towards the body by more than it is long there, or away from it by many times its size."""
    if case.spec.statics is None:
        return
    box, reference = _box(plan), plan.space.reference()
    middle = plan.mesh.points[plan.mesh.used].min(axis=0) + box / 2
    for constraint in case.spec.constraint:
        place = reference[plan.members[constraint.group]].mean(axis=0) - middle
        for axis, amount in constraint.move.items():
            i = AXES.index(axis)
            inwards = amount * place[i] < 0.0 and abs(place[i]) > 0.25 * box[i]
            limit = box[i] if inwards else LONGEST_PULL * box.max()
            if abs(amount) > limit > 0.0:
                words = (
                    f"the body is {box[i]:.4g} long in {axis}" if inwards else f"its size is {box.max():.4g}"
                )
                yield f"constraint.{constraint.group}.move: {axis} = {amount:g}, but {words}; is it in the mesh's unit?"


def _loads(case: Case, plan: Plan) -> Iterator[str]:
    size = float(_box(plan).max())
    young = max(material.young for material in case.spec.material)
    densities = [material.density for material in case.spec.material if material.density]
    for number, load in enumerate(case.spec.load):
        if isinstance(load, GravitySpec) and densities:
            yield from _gravity(f"load.{number}.acceleration", load, max(densities), young, size)
        if isinstance(load, ForceSpec):
            total = float(np.linalg.norm(load.total))
            if total > HEAVY * young * size**2 and not plan.element.is_beam:
                yield (
                    f"load.{load.group}.total: {total:g} is {total / (young * size**2):.3g} times young times the square of the "
                    f"body's length, {size:.4g}: no body bears it"
                )


def _gravity(key: str, load: GravitySpec, density: float, young: float, size: float) -> Iterator[str]:
    g = float(np.linalg.norm(load.acceleration))
    in_tonnes = density < 1e-7
    in_si = DENSE_IN_SI[0] < density < DENSE_IN_SI[1] and size < LARGEST_STIFF
    if in_tonnes and abs(g / GRAVITY["m/s^2"] - 1) < NEAR:
        yield f"{key}: {g:g} is the earth's in m/s^2, but density = {density:g} is in t/mm^3: 9810 mm/s^2 goes with it"
    elif in_si and abs(g / GRAVITY["mm/s^2"] - 1) < NEAR:
        yield f"{key}: {g:g} is the earth's in mm/s^2, but density = {density:g} is in kg/m^3: 9.81 m/s^2 goes with it"
    elif density * g * size > HEAVY * young:
        yield (
            f"{key}: a column of density = {density:g} as long as the body, {size:.4g}, weighs {density * g * size:.3g} per "
            f"area under {g:g}, more than young = {young:g}: are mesh, gravity and density in one system of units?"
        )


def _idle(case: Case, plan: Plan) -> Iterator[str]:
    """Entries that change nothing."""
    spec = case.spec
    usual = "linear" if spec.statics is not None else "cosine"
    amplitudes = np.array([drive.amplitude for drive in plan.supports.drives] + [np.inf])
    held = amplitudes[plan.supports.drive] == 0.0
    for probe in spec.probe:
        at = np.flatnonzero(plan.means[name_of(probe)])
        if held[at].all():
            yield f"probe.{probe.name}: all nodes of {probe.group!r} are held: its displacements are 0 throughout"
    for constraint in spec.constraint:
        if any(constraint.move.values()):
            continue
        if constraint.move:
            yield f"constraint.{constraint.group}.move: by 0 it is held, as fix says more plainly"
        if constraint.ramp != usual:
            yield f"constraint.{constraint.group}.ramp: without effect, nothing of it moves"
    for number, load in enumerate(spec.load):
        name = "acceleration" if isinstance(load, GravitySpec) else "total"
        values = np.array(getattr(load, name, (1.0,)))
        if not values.any():
            yield f"load.{number}.{name}: without effect, it is 0"
        elif isinstance(load, ForceSpec) and number in plan.loads:
            at = np.flatnonzero(plan.loads[number])
            if held[np.ix_(at, np.flatnonzero(values))].all():
                yield f"load.{load.group}.total: without effect, its nodes are held where it pulls: supports take it all"
    initial = spec.initial
    if initial is not None and "centre" in initial.model_fields_set and not any(initial.spin):
        yield "initial.centre: without effect, there is no spin about it"
