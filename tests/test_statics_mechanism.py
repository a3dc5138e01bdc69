"""Pieces of a body that share edges or corners only: statics names how they can move."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from test_mesh_doubts import box, halves

from ancf_petsc import case_from_dict
from ancf_petsc.errors import CaseError
from ancf_petsc.plan.plan import make_plan


def plan(folder, bodies, constraints, *, element="3413", kind="tetra", analysis="statics", section=None):
    """The tables of a case on bodies (points, bricks or cells), whose nodes at one place are one."""
    first = np.cumsum([0, *(len(points) for points, _ in bodies)])
    points = np.concatenate([points for points, _ in bodies])
    cells = np.concatenate([cells + start for (_, cells), start in zip(bodies, first, strict=False)])
    points, which = np.unique(points.round(12), axis=0, return_inverse=True)
    cells = which.reshape(-1)[cells]
    meshio.Mesh(points, [(kind, halves(cells) if kind == "tetra" else cells)]).write(folder / "body.vtu")
    data = {
        "title": "pieces",
        "mesh": {"file": str(folder / "body.vtu"), "element": element},
        "groups": {
            "bottom": {"plane": "z", "at": "min"},
            "top": {"plane": "z", "at": "max"},
            "left": {"plane": "x", "at": "min"},
            "right": {"plane": "x", "at": "max"},
        },
        "material": {"law": "neo_hooke", "young": 5e6, "poisson": 0.4, "density": 1000.0},
        "constraint": constraints,
        analysis: {"steps": 1} if analysis == "statics" else {"duration": 0.1, "step": 1e-3},
    }
    if section:
        data["section"] = section
    return make_plan(case_from_dict(data, folder))


CLAMPED = [{"group": "bottom", "fix": ["x", "y", "z"]}]
ON_AN_EDGE = [box(1, 1, 1), box(1, 1, 1, (1, 0, 1), (2, 1, 2))]
ON_A_CORNER = [box(1, 1, 1), box(1, 1, 1, (1, 1, 1), (2, 2, 2))]
START = "2 pieces of the body are joined by edges or corners only, and the piece around"


@pytest.mark.parametrize("element", ["3413", "3-10-1-3"])
def test_a_hinge_is_named_with_its_axis(tmp_path, element):
    with pytest.raises(CaseError) as error:
        plan(tmp_path, ON_AN_EDGE, CLAMPED, element=element)
    message = str(error.value)
    assert (
        f"mesh.file: {START} (1.5, 0.5, 1.5) can move as on a hinge: rotation about the axis along y through (1, 0.5, 1)"
        in message
    )
    assert (
        "join the pieces in the mesh, add a [[constraint]] that holds the piece, or ask for [dynamics]"
        in message
    )


def test_a_hinge_of_bricks(tmp_path):
    with pytest.raises(CaseError, match=r"rotation about the axis along y through \(1, 0.5, 1\)"):
        plan(tmp_path, ON_AN_EDGE, CLAMPED, element="3813", kind="hexahedron")


def test_a_ball_joint_leaves_three_rotations(tmp_path):
    with pytest.raises(
        CaseError, match="rotation about x; rotation about y; rotation about z|(rotation about the axis.*){3}"
    ):
        plan(tmp_path, ON_A_CORNER, CLAMPED)


def test_supports_that_hold_the_piece_are_enough(tmp_path):
    """A hinge needs one component more at nodes off its axis, a ball joint three."""
    right = {"group": "right", "fix": ["z"]}
    assert len(plan(tmp_path, ON_AN_EDGE, [*CLAMPED, right]).mesh.cells) == 12
    with pytest.raises(CaseError, match=START[:20]):
        plan(tmp_path, ON_AN_EDGE, [*CLAMPED, {"group": "right", "fix": ["y"]}])
    plan(
        tmp_path,
        ON_A_CORNER,
        [*CLAMPED, {"group": "right", "fix": ["y", "z"]}, {"group": "top", "fix": ["x"]}],
    )


def test_nodes_with_slopes_carry_moments(tmp_path):
    """3443 shares slopes at nodes, not positions alone: an edge is no hinge."""
    assert len(plan(tmp_path, ON_AN_EDGE, CLAMPED, element="3443").mesh.cells) == 12


def test_two_hinges_in_parallel_hold_a_piece(tmp_path):
    """A bridge on two edges cannot turn; a chain of three pieces on parallel hinges has two motions."""
    pillars = [box(1, 1, 1), box(1, 1, 1, (3, 0, 0), (4, 1, 1))]
    bridge = box(1, 1, 1, (1, 0, 1), (3, 1, 2))
    plan(tmp_path, [*pillars, bridge], CLAMPED)
    chain = [*ON_AN_EDGE, box(1, 1, 1, (2, 0, 2), (3, 1, 3))]
    with pytest.raises(CaseError, match="3 pieces of the body are joined by edges or corners only"):
        plan(tmp_path, chain, CLAMPED)


def test_plane_bodies_hinge_on_corners(tmp_path):
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    bodies = [(square, np.array([[0, 1, 2, 3]])), (square + (1, 1, 0), np.array([[0, 1, 2, 3]]))]
    section = {"plane": "strain", "thickness": 1.0}
    held = [{"group": "left", "fix": ["x", "y"]}]
    with pytest.raises(CaseError, match=r"rotation about the axis along z through \(1, 1, 0\)"):
        plan(tmp_path, bodies, held, element="2412", kind="quad", section=section)


def test_motion_may_have_joints(tmp_path):
    built = plan(tmp_path, ON_AN_EDGE, CLAMPED, analysis="dynamics")
    assert [note for note in built.mesh.notes if "joined by edges or corners only" in note]
