"""What Gmsh finds in a .msh file. words: "1" where physical groups shall be read as entities."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gmsh

from ancf_petsc.mesh.foreign.guard import Refused


def contents(path: Path, words: list[str]) -> dict[str, Any]:
    """Nodes, elements by entity and kind, entities of physical groups, as Gmsh gives them.

    nodes: numbers (n,), coordinates (3 n,). elements: dimension, entity, kind, its name, element numbers,
    node numbers. groups: dimension, tag, entities. Raises Refused with Gmsh's own words.
    """
    gmsh.initialize(interruptible=False, readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.SwitchElementTags", float(words[0]))
    gmsh.logger.start()
    try:
        gmsh.merge(str(path))
        return _model()
    except Exception as error:
        said = [line.partition(": ")[2] for line in gmsh.logger.get() if line.startswith("Error")]
        raise Refused(said[-1] if said else str(error)) from None


def _model() -> dict[str, Any]:
    numbers, coordinates, _ = gmsh.model.mesh.getNodes()
    elements = []
    for dimension, entity in gmsh.model.getEntities():
        for kind, cells, nodes in zip(*gmsh.model.mesh.getElements(dimension, entity), strict=True):
            name = gmsh.model.mesh.getElementProperties(kind)[0]
            elements.append((dimension, entity, int(kind), name, cells, nodes))
    groups = [
        (dimension, tag, [int(entity) for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag)])
        for dimension, tag in gmsh.model.getPhysicalGroups()
    ]
    return {"nodes": (numbers, coordinates), "elements": elements, "groups": groups}
