"""Groups of linear parts, and sets of nodes, on elements that have more nodes or slopes."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from decks import FORCE, abaqus, bar, pulled

from ancf_petsc import case_from_dict
from ancf_petsc.element.catalog import element
from ancf_petsc.mesh.complete import complete
from ancf_petsc.mesh.kinds import KINDS
from ancf_petsc.mesh.parts import outer_sides
from ancf_petsc.mesh.read import read_mesh
from ancf_petsc.plan.plan import make_plan

BAR = bar()
PLANES = {"bottom": (2, 0.0), "top": (2, 0.2), "left": (0, 0.0), "front": (1, 0.0)}


def quadratic():
    """Points, 10-node tetrahedra and the corners' count of the bar with mid-nodes of its own."""
    cells = np.searchsorted(BAR.numbers, BAR.nodes)
    edges = np.array(KINDS["tetra"].edges)
    pairs, which = np.unique(np.sort(cells[:, edges].reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    points = np.vstack([BAR.points, BAR.points[pairs].mean(axis=1)])
    return points, np.hstack([cells, len(BAR.points) + which.reshape(len(cells), 6)]), len(BAR.points)


def write(path, way: str):
    """Groups of the bar's planes: as 3-node faces, as sets of corners, as sets of all nodes, or as points."""
    points, cells, corners = quadratic()
    faces = outer_sides("tetra", cells[:, :4], len(points))
    blocks, sets, point_sets = [("tetra10", cells)], {}, {}
    for name, (axis, at) in PLANES.items():
        on = points[:, axis] == at
        if way == "faces":
            blocks.append(("triangle", faces[on[faces].all(axis=1)]))
        elif way == "points":
            blocks.append(("vertex", np.flatnonzero(on[:corners])[:, None]))
        else:
            point_sets[name] = np.flatnonzero(on[:corners] if way == "corners" else on)
    if len(blocks) > 1:
        rows = range(1, len(blocks))
        sets = {
            name: [np.arange(len(blocks[k][1])) if k == row else [] for k in range(len(blocks))]
            for row, name in zip(rows, PLANES, strict=True)
        }
    mesh = meshio.Mesh(points, blocks, cell_sets=sets, point_sets=point_sets)
    if point_sets:
        mesh.point_sets_to_data()
    mesh.write(path)
    return path


@pytest.mark.parametrize("way", ["faces", "corners", "all", "points"])
def test_groups_of_a_quadratic_body_get_the_nodes_between_corners(tmp_path, way):
    if way == "corners" or way == "all":
        lines = abaqus_quadratic(all_nodes=way == "all")
        (tmp_path / "bar.inp").write_text(lines)
        mesh = read_mesh(tmp_path / "bar.inp", ("tetra10",))
    else:
        mesh = read_mesh(write(tmp_path / "bar.vtu", way), ("tetra10",))
    complete(mesh, element("3-10-1-3"))
    for name, (axis, at) in PLANES.items():
        on = np.flatnonzero(mesh.points[:, axis] == at)
        assert mesh.groups[name].nodes.tolist() == on.tolist(), name
    said = [note for note in mesh.notes if "are completed" in note]
    counts = "bottom by 5, top by 5, left by 9, front by 9 nodes"
    assert said == (
        [] if way == "all" else [f"groups that lack the nodes between their corners are completed: {counts}"]
    )


def abaqus_quadratic(*, all_nodes: bool) -> str:
    points, cells, corners = quadratic()
    lines = [
        "*NODE",
        *(f"{k + 1}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(points.tolist())),
        "*ELEMENT, TYPE=C3D10",
    ]
    lines += [", ".join(map(str, (k + 1, *(row + 1)))) for k, row in enumerate(cells)]
    for name, (axis, at) in PLANES.items():
        on = np.flatnonzero(points[:, axis] == at) + 1
        lines += [f"*NSET, NSET={name}", *map(str, on if all_nodes else on[on <= corners])]
    return "\n".join(lines) + "\n"


def test_a_set_that_names_nodes_between_corners_stays_as_it_is(tmp_path):
    """The top and bottom of a body of one layer hold all its corners; the nodes half way up are not meant."""
    points, cells, corners = quadratic()
    lines = abaqus_quadratic(all_nodes=True).replace("NSET=top", "NSET=bottom")
    (tmp_path / "bar.inp").write_text(lines)
    mesh = read_mesh(tmp_path / "bar.inp", ("tetra10",))
    complete(mesh, element("3-10-1-3"))
    ends = (points[:, 2] == 0) | (points[:, 2] == 0.2)
    assert mesh.groups["bottom"].nodes.tolist() == np.flatnonzero(ends).tolist()


@pytest.mark.parametrize("code", ["3-10-1-3", "3443", "3443+4"])
def test_sets_of_nodes_are_the_faces_they_cover(tmp_path, code):
    """Of a linear mesh on elements with more: supports hold what faces hold, and the log says so."""
    (tmp_path / "bar.inp").write_text(abaqus(BAR))
    data = {
        "title": "bar",
        "mesh": {"file": str(tmp_path / "bar.inp"), "element": code},
        "material": {"law": "neo_hooke", "young": 5e6, "poisson": 0.4},
        "constraint": [{"group": "bottom", "fix": ["x", "y", "z"]}],
        "statics": {"steps": 1},
    }
    plan = make_plan(case_from_dict(data, tmp_path))
    assert "bottom: a set of nodes, taken as the 2 faces it covers" in plan.mesh.notes


def test_nodes_that_cover_nothing_are_counted(tmp_path):
    """Two corners of a face across its diagonal that is no edge, and a third far away."""
    numbers = BAR.numbers
    text = (
        abaqus(BAR)
        + f"*NSET, NSET=loose\n{numbers[1]}, {numbers[6]}\n*NSET, NSET=edge\n{numbers[0]}, {numbers[1]}, {numbers[-1]}\n"
    )
    (tmp_path / "bar.inp").write_text(text)
    data = {
        "title": "bar",
        "mesh": {"file": str(tmp_path / "bar.inp"), "element": "3443"},
        "material": {"law": "neo_hooke", "young": 5e6, "poisson": 0.4},
        "constraint": [{"group": name, "fix": ["x", "y", "z"]} for name in ("bottom", "loose", "edge")],
        "statics": {"steps": 1},
    }
    notes = make_plan(case_from_dict(data, tmp_path)).mesh.notes
    assert (
        "loose: a set of nodes; 2 of its 2 nodes belong to no whole face or edge in it: held as points"
        in notes
    )
    assert (
        "edge: a set of nodes, taken as the 1 edge it covers; "
        "1 of its 3 nodes belong to no whole face or edge in it: held as points" in notes
    )


@pytest.mark.parametrize("way", ["faces", "points"])
def test_the_force_on_the_bar_is_the_one_in_closed_form(tmp_path, way):
    """Without the nodes between corners it would be 7 to 27 % too small."""
    write(tmp_path / "bar.vtu", way)
    assert pulled(tmp_path, tmp_path / "bar.vtu", element="3-10-1-3") == pytest.approx(FORCE, rel=1e-9)


def test_the_force_with_slopes_and_physical_points(tmp_path):
    """3443 with groups that are points: supports hold the slopes along the faces these cover."""
    points, tens, corners = quadratic()
    blocks = [("tetra", tens[:, :4])]
    blocks += [
        ("vertex", np.flatnonzero(points[:corners, axis] == at)[:, None]) for axis, at in PLANES.values()
    ]
    sets = {
        name: [np.arange(len(blocks[k][1])) if k == row else [] for k in range(len(blocks))]
        for row, name in enumerate(PLANES, 1)
    }
    meshio.Mesh(points[:corners], blocks, cell_sets=sets).write(tmp_path / "bar.vtu")
    assert pulled(tmp_path, tmp_path / "bar.vtu", element="3443") == pytest.approx(FORCE, rel=1e-9)
