"""Boundary faces, which are free, and where stresses are singular: on bodies whose answer is known, on two and three ranks too."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from bodies import assembly_of
from slender_bodies import grid
from surface_on_ranks import found_in

from ancf_petsc.mesh.kinds import KUHN


def step_case(folder: Path, kind: str) -> dict[str, Any]:
    """An L of three cubes along x and y: bonded at x = 0, its inner edge at x = y = 1 along z; lubricated at y = 0."""
    points, cells = grid((2, 2, 1), (2.0, 2.0, 1.0))
    points -= points.min(axis=0)
    centre = points[cells].mean(axis=1)
    cells = cells[~((centre[:, 0] > 1) & (centre[:, 1] > 1))]
    used, cells = np.unique(cells, return_inverse=True)
    cells = cells.reshape(-1, 8)
    mesh = ("tetra", cells[:, np.array(KUHN)].reshape(-1, 4)) if kind == "3413" else ("hexahedron", cells)
    path = folder / f"step_{kind}.vtu"
    meshio.Mesh(points[used], [mesh]).write(path)
    return {
        "title": "Step",
        "mesh": {"file": str(path), "element": kind},
        "groups": {"foot": {"plane": "x", "at": "min"}, "floor": {"plane": "y", "at": "min"}},
        "material": {"law": "svk", "young": 1.0, "poisson": 0.3},
        "constraint": [{"group": "foot", "fix": ["x", "y", "z"]}, {"group": "floor", "fix": ["y"]}],
        "statics": {},
    }


@pytest.mark.parametrize("kind", ["3413", "3813"])
def test_free_faces_and_singular_edges_of_a_step(kind, tmp_path):
    """14 squares less 2 + 2 held ones are free; singular are the inner edge and the rim of the bonded face, no lubricated one."""
    found = found_in(assembly_of(step_case(tmp_path, kind), tmp_path))
    per_square = 2 if kind == "3413" else 1
    assert found["faces"] == 14 * per_square
    assert found["free"] == 10 * per_square
    inner = [[1.0, 1.0, z] for z in (0.0, 1.0)]
    rim = [[0.0, y, z] for y in (0.0, 1.0, 2.0) for z in (0.0, 1.0)]
    assert found["singular"] == sorted(inner + rim)


def test_two_and_three_ranks_find_the_same(on_three_ranks, tmp_path):
    (tmp_path / "case.json").write_text(json.dumps(step_case(tmp_path, "3413")))
    said = on_three_ranks(Path(__file__).with_name("surface_on_ranks.py"), tmp_path / "case.json")
    found = json.loads(said.stdout.partition("FOUND")[2])
    assert found[0]["singular"] == found[1]["singular"]
    assert found[1]["singular"] == found[2]["singular"]
    assert len(found[0]["singular"]) == 8
    assert (
        found[0]["area"]
        == pytest.approx(found[1]["area"], rel=1e-12)
        == pytest.approx(found[2]["area"], rel=1e-12)
    )
    assert found[0]["area"] == pytest.approx(10.0, rel=1e-12)
