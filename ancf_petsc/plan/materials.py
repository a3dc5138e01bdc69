"""[[material]]: which cells are of which material, and the regions of one law each that they make."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.element.element import Element
from ancf_petsc.errors import CaseError
from ancf_petsc.input.schema import CaseSpec, MaterialSpec
from ancf_petsc.kernel.choice import kernel_set
from ancf_petsc.material import Law, law_named
from ancf_petsc.material.models import plane_stress
from ancf_petsc.mesh.groups import cells_of
from ancf_petsc.model.body import Region
from ancf_petsc.plan.part import Part


def enter_materials(part: Part) -> NDArray[np.int8]:
    """The material (e,) of each cell, as index into the case's; the one without a group takes what is left."""
    mesh, specs = part.mesh, part.spec.material
    material = np.full(len(mesh.cells), -1, np.int8)
    for number, spec in enumerate(specs):
        if spec.group is None:
            continue
        key = f"material.{spec.group}.group"
        cells = cells_of(mesh, part.group(spec.group, key))
        if not part.total(len(cells)):
            raise CaseError(
                "the group holds no elements",
                file=part.file,
                key=key,
                got=spec.group,
                expected="a group of volume, or of all nodes of some elements",
            )
        twice = cells[material[cells] >= 0]
        if len(twice):
            other = specs[material[twice[0]]].group
            raise CaseError(
                f"{len(twice)} elements are in {other!r} as well, the first is element {mesh.cell_numbers[twice[0]]}",
                file=part.file,
                key=key,
                expected="one material an element",
                cure="take the shared elements out of one group",
            )
        material[cells] = number
    return _with_rest(part, material)


def _with_rest(part: Part, material: NDArray[np.int8]) -> NDArray[np.int8]:
    rest = next((i for i, spec in enumerate(part.spec.material) if spec.group is None), None)
    left = np.flatnonzero(material < 0)
    if len(left) and rest is None:
        raise CaseError(
            f"{len(left)} elements have no material, the first is element {part.mesh.cell_numbers[left[0]]}",
            file=part.file,
            key="material",
            expected="a material for every element",
            cure="add a [[material]] without group: it takes the rest",
        )
    material[left] = rest if rest is not None else 0
    return material


def regions(
    spec: CaseSpec, element: Element, material: NDArray[np.int64], own: NDArray[np.bool_]
) -> tuple[Region, ...]:
    """The regions of this rank's cells, which are sorted by material (e,) and, within one, own ones first: own (e,)."""
    found, kernels = [], kernel_set(element, axisymmetric=spec.is_axisymmetric)
    for number, given in enumerate(spec.material):
        first, last = np.searchsorted(material, (number, number + 1))
        law = law_named(given.law)
        found.append(
            Region(
                law=law,
                kernels=kernels.kernels(law),
                parameters=_parameters(element, law, given, spec),
                density=given.density,
                first=int(first),
                own_last=int(first + own[first:last].sum()),
                last=int(last),
            )
        )
    return tuple(found)


def _parameters(element: Element, law: Law, material: MaterialSpec, spec: CaseSpec) -> NDArray[np.float64]:
    """Of the law in the body's state: in space, in plane strain or stress, in a beam."""
    section = spec.section
    if element.is_beam and section:
        assert section.inertia
        assert section.area
        return material.young * np.array([1.0, section.inertia / section.area])
    parameters = law.parameters(material.young, material.poisson)
    return plane_stress(parameters) if section and section.plane == "stress" else parameters
