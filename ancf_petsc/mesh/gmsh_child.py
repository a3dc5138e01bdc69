"""A program of its own that reads one .msh file with Gmsh and pickles what it holds to standard output.

A damaged file can take the process down that has Gmsh read it; this one may die, and its memory goes with it.
Arguments: the file, and 1 where physical groups shall be read as entities.
"""

from __future__ import annotations

import os
import pickle
import sys

REFUSED = 3
"""Gmsh said why it cannot read the file: the reason is on standard output."""
NO_GMSH = 4
"""The gmsh module cannot be loaded: the reason is on standard output."""


def main(path: str, *, swapped: bool) -> tuple[int, bytes]:
    """Exit code and what goes to standard output."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        return NO_GMSH, str(error).encode()
    gmsh.initialize(interruptible=False, readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("Mesh.SwitchElementTags", float(swapped))
    gmsh.logger.start()
    try:
        gmsh.merge(path)
        return 0, pickle.dumps(contents(gmsh), protocol=pickle.HIGHEST_PROTOCOL)
    except Exception as error:
        said = [line.partition(": ")[2] for line in gmsh.logger.get() if line.startswith("Error")]
        return REFUSED, (said[-1] if said else str(error)).encode()


def contents(gmsh) -> dict:
    """Nodes, elements by entity and kind, entities of physical groups, as Gmsh gives them.

    nodes: numbers (n,), coordinates (3 n,). elements: dimension, entity, kind, its name, element numbers,
    node numbers. groups: dimension, tag, entities.
    """
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


if __name__ == "__main__":
    # What Gmsh itself prints goes to standard error.
    with os.fdopen(os.dup(1), "wb") as out:
        os.dup2(2, 1)
        code, answer = main(sys.argv[1], swapped=sys.argv[2] == "1")
        out.write(answer)
    # Without taking Gmsh down: its memory goes with the process.
    os._exit(code)
