"""[[probe]]: weights of mean positions."""

from __future__ import annotations

from ancf_petsc.errors import CaseError
from ancf_petsc.input.schema import ProbeSpec
from ancf_petsc.mesh.groups import surface_of
from ancf_petsc.mesh.mesh import Group
from ancf_petsc.plan.part import Floats, Part


def name_of(probe: ProbeSpec) -> str:
    """What the mean of a probe is called in the model."""
    return f"probe {probe.name}"


def enter_probes(part: Part) -> dict[str, Floats]:
    """Weights (v,) of the mean position of each probe."""
    means = {}
    for probe in part.spec.probe:
        group = part.group(probe.group, f"probe.{probe.name}.group")
        mean = _area_mean(part, group, probe) if probe.mean == "area" else part.node_mean(group)
        means[name_of(probe)] = mean
    return means


def _area_mean(part: Part, group: Group, probe: ProbeSpec) -> Floats:
    faces = surface_of(part.mesh, group)
    if faces is None:
        raise CaseError(
            'mean = "area" needs a surface',
            file=part.file,
            key=f"probe.{probe.name}.mean",
            got=group.name,
            expected="a group of boundary faces",
            cure='mean = "nodes" takes any group',
        )
    return part.space.shares(part.element.cell.dimension - 1, faces)
