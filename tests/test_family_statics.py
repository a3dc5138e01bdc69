"""Every solid element in the whole program: known displacements, supports, ranks, drawings."""

import csv
import shutil

import meshio
import numpy as np
import pytest
from family import cantilever, mesh_of, unit_cube

from ancf_petsc import MeshError, case_from_dict, run
from ancf_petsc.element.catalog import ELEMENTS
from ancf_petsc.element.shape import cartesian_values
from ancf_petsc.mesh.read import read_mesh


def bend(code, divisions, folder, **keys):
    return run(
        case_from_dict(cantilever(mesh_of("cantilever", code, divisions, folder), code, **keys), folder),
        folder / "run",
    )


def known(name):
    """Rows of tests/reference/cantilever.csv of one element."""
    from pathlib import Path

    with open(Path(__file__).parent / "reference" / "cantilever.csv", newline="") as file:
        return {
            (int(r["cells_x"]), int(r["cells_yz"])): r
            for r in csv.DictReader(file)
            if f"({name})" in r["element"]
        }


@pytest.mark.parametrize(
    ("code", "mesh"),
    [("3413", (10, 2)), ("3413", (20, 2)), ("3413", (40, 4)), ("3-10-1-3", (10, 2)), ("3-10-1-3", (20, 2))],
)
def test_cantilever_as_another_code_computed_it(code, mesh, tmp_path):
    """dolfinx on the same tetrahedra, to 1e-6."""
    results, row = bend(code, (mesh[0], mesh[1], mesh[1]), tmp_path), known(code)[mesh]
    assert results.summary["dof"] == int(row["dof"])
    assert results.probes["end.ux"][-1] == pytest.approx(float(row["mean_end_ux_m"]), rel=1e-6)
    assert results.probes["end.uz"][-1] == pytest.approx(float(row["mean_end_uz_m"]), rel=1e-6)
    assert results.curve["strain_energy"][-1] == pytest.approx(float(row["strain_energy_J"]), rel=1e-6)


@pytest.mark.parametrize(
    ("code", "divisions", "rule", "answer"),
    [
        ("3813", (20, 2, 2), "default", -0.314760),
        ("3813", (20, 2, 2), "exact", -0.314752),
        ("3443", (10, 1, 1), "default", -0.3449803),
        ("3443", (10, 1, 1), "reduced", -0.345002),
        ("3443+4", (10, 1, 1), "default", -0.3479045),
        ("3843", (8, 1, 1), "default", -0.3459002),
        ("3843", (8, 1, 1), "reduced", -0.346001),
    ],
)
def test_clamped_faces_hold_tangent_slopes(code, divisions, rule, answer, tmp_path):
    """What an independent numpy code finds with r and both tangent slopes held; r alone would give 7 to 12 % more."""
    found = bend(code, divisions, tmp_path, rule=rule).probes["end.uz"][-1]
    # The answers are known to the digits written.
    assert found == pytest.approx(answer, abs=1.5e-6)


def test_all_slopes_of_a_clamp_can_be_held(tmp_path):
    """What the same code finds with r and all slopes held on 8 bricks; the clamp is too stiff then."""
    data = cantilever(mesh_of("cantilever", "3843", (8, 1, 1), tmp_path), "3843")
    data["constraint"][0]["slopes"] = ["x", "y", "z"]
    results = run(case_from_dict(data, tmp_path), tmp_path / "run")
    assert results.probes["end.uz"][-1] == pytest.approx(-0.333837, abs=1.5e-6)


def turned(mesh, path, turn):
    """A mesh of bricks or tetrahedra in another frame, without groups."""
    read = meshio.read(mesh)
    kind = next(k for k in ("tetra", "hexahedron") if k in read.cells_dict)
    meshio.Mesh(read.points @ turn.T, [(kind, read.cells_dict[kind])]).write(path)
    return path


@pytest.mark.parametrize(("code", "n"), [("3443", 4), ("3843", 3)])
def test_faces_need_not_be_parallel_to_the_axes(code, n, tmp_path):
    """A turned beam under a turned load bends the same: slopes are taken along and across the clamp."""
    turn, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    straight = bend(code, (n, 1, 1), tmp_path)
    mesh = turned(
        mesh_of("cantilever", code, (n, 1, 1), tmp_path), tmp_path / "turned.vtu", turn * np.linalg.det(turn)
    )
    turn *= np.linalg.det(turn)
    data = cantilever(mesh, code)
    normal = turn[:, 0].tolist()
    data["groups"] = {"clamp": {"plane": normal, "at": "min"}, "end": {"plane": normal, "at": "max"}}
    data["load"][0]["total"] = (turn @ [0.0, 0.0, -100.0]).tolist()
    results = run(case_from_dict(data, tmp_path), tmp_path / "turned")
    moved = np.array([results.probes[f"end.u{axis}"][-1] for axis in "xyz"])
    wanted = turn @ [straight.probes[f"end.u{axis}"][-1] for axis in "xyz"]
    np.testing.assert_allclose(moved, wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize("code", ["3443", "3843"])
def test_symmetry_plane_is_half_of_the_body(code, tmp_path):
    """A half with y held on its middle plane bends like the whole of two rows of mirrored cells.

    Not to rounding: the half leaves the shear of its plane to equilibrium, the whole has none at its nodes.
    """
    whole = meshio.read(mesh_of("cantilever", code, (4, 2, 1), tmp_path))
    kind = ELEMENTS[code].cell_name
    cells = whole.cells_dict[kind]
    half = cells[whole.points[cells][..., 1].mean(axis=1) < 0.05]
    other = half + len(whole.points)
    mirror = whole.points * [1, -1, 1] + [0, 0.1, 0]
    order = {"tetra": [0, 2, 1, 3], "hexahedron": [0, 3, 2, 1, 4, 7, 6, 5]}[kind]
    answers = []
    for name, points, body in (
        ("half", whole.points, half),
        ("whole", np.vstack((whole.points, mirror)), np.vstack((half, other[:, order]))),
    ):
        path = tmp_path / f"{name}.vtu"
        meshio.Mesh(points, [(kind, body)]).write(path)
        data = cantilever(path, code, duplicates="merge") if name == "whole" else cantilever(path, code)
        data["groups"] = {"clamp": {"plane": "x", "at": "min"}, "end": {"plane": "x", "at": "max"}}
        if name == "half":
            data["groups"]["middle"] = {"plane": "y", "at": 0.05}
            data["constraint"].append({"group": "middle", "fix": ["y"]})
            data["load"][0]["total"] = [0.0, 0.0, -50.0]
        answers.append(run(case_from_dict(data, tmp_path), tmp_path / name).probes["end.uz"][-1])
    assert answers[0] == pytest.approx(answers[1], rel=2e-3)


def test_linear_and_quadratic_meshes_give_the_same_body(tmp_path, caplog):
    """Mid-nodes the file lacks are made; those it has off their edge are moved there, and told."""
    linear = bend("3-10-1-3", (5, 1, 1), tmp_path)
    path = mesh_of("cantilever", "3-10-1-3", (5, 1, 1), tmp_path, order=2)
    mesh = meshio.read(path)
    middle = int(mesh.cells_dict["tetra10"][3, 5])
    lines = path.read_text().splitlines()
    at = lines.index("$Nodes") + 2 + middle
    number, x, y, z = lines[at].split()
    lines[at] = f"{number} {float(x) + 0.003} {y} {z}"
    path.write_text("\n".join(lines) + "\n")
    quadratic = run(case_from_dict(cantilever(path, "3-10-1-3"), tmp_path), tmp_path / "quadratic")
    assert quadratic.probes["end.uz"][-1] == pytest.approx(linear.probes["end.uz"][-1], rel=1e-9)
    assert "1 mid-nodes lay off the middle of their edge, by up to 0.003: moved onto it" in caplog.text


def test_brick_that_is_no_parallelepiped_is_named(tmp_path):
    mesh = meshio.read(unit_cube("3843", 2, tmp_path))
    mesh.points[13] += [0.01, 0.0, 0.0]
    mesh.write(tmp_path / "odd.vtu")
    data = cantilever(tmp_path / "odd.vtu", "3843")
    data["groups"] = {"clamp": {"plane": "x", "at": "min"}, "end": {"plane": "x", "at": "max"}}
    with pytest.raises(MeshError, match=r"hexahedron 1 at .* \(and 7 more\) is no parallelepiped"):
        run(case_from_dict(data, tmp_path), tmp_path / "run")


@pytest.mark.parametrize(
    ("code", "kind"),
    [
        ("3413", "tetra"),
        ("3-10-1-3", "tetra10"),
        ("3443", "tetra10"),
        ("3443+4", "tetra10"),
        ("3843", "hexahedron20"),
    ],
)
def test_curved_elements_are_drawn_curved(code, kind, tmp_path):
    """Drawn middles of edges lie where the shape functions say; the time series opens in pyvista and meshio."""
    import pyvista

    results = bend(code, (4, 1, 1), tmp_path)
    assert results.kind == kind
    row = ELEMENTS[code]
    c, cells = len(row.cell.corners), results.cells
    now = results.points + results.field("displacement")
    if row.has_slopes:
        nodes = cells[:, :c]
        slopes = results.field("slopes")[nodes].reshape(len(cells), c, 3, 3)
        vectors = np.concatenate((now[nodes][:, :, None], np.swapaxes(slopes, 2, 3)), axis=2).reshape(
            len(cells), -1, 3
        )
        xi = np.array(row.cell.corners, float)[np.array(row.cell.edges)].mean(axis=1)
        jacobian = row.geometry(results.points[nodes]).jacobian
        values = cartesian_values(row.values(xi), row.slot, jacobian)[:, :, : 4 * c]
        # Face centres have no share in edges.
        middles = np.einsum("eqa,eai->eqi", values, vectors)
        np.testing.assert_allclose(now[cells[:, c:]], middles, rtol=0, atol=1e-14)
        straight = now[nodes][:, np.array(row.cell.edges)].mean(axis=2)
        assert np.abs(middles - straight).max() > 1e-3
    reader = pyvista.get_reader(str(results.folder / "results.xdmf"))
    reader.set_active_time_value(1.0)
    grid = reader.read()
    grid = grid[0] if isinstance(grid, pyvista.MultiBlock) else grid
    assert grid.n_cells == len(cells)
    np.testing.assert_array_equal(grid.cells.reshape(len(cells), -1)[:, 1:], cells)
    np.testing.assert_allclose(np.asarray(grid["displacement"]), results.field("displacement"), atol=1e-15)
    shutil.copy(results.folder / "results.h5", tmp_path)  # meshio looks for it in the working directory
    with meshio.xdmf.TimeSeriesReader(results.folder / "results.xdmf") as series:
        points, blocks = series.read_points_cells()
    assert blocks[0].type == kind
    np.testing.assert_array_equal(blocks[0].data, cells)
    assert len(points) == len(results.points)


def test_tangents_of_surfaces_lines_and_points(tmp_path):
    """What a support on a face, on an edge and on nodes alone says of slopes; oblique faces turn the frame."""
    from ancf_petsc.mesh.complete import complete
    from ancf_petsc.plan.slopes import prescribed_slopes
    from ancf_petsc.plan.space import Space

    mesh = read_mesh(unit_cube("3843", 1, tmp_path), ("hexahedron",))
    complete(mesh, ELEMENTS["3843"])
    face, edge = mesh.cells[:, [0, 3, 7, 4]], mesh.cells[:, [0, 1]]

    def held(*supports):
        space = Space(mesh, ELEMENTS["3843"])
        mask, odd = prescribed_slopes(space, supports)
        return mask.reshape(8, 4, 3), space.frames, odd

    mask, frames, _ = held(({0, 1, 2}, {2: face}))
    assert mask[0].tolist() == [[False] * 3, [False] * 3, [True] * 3, [True] * 3]
    assert not mask[1].any()
    np.testing.assert_array_equal(frames, np.tile(np.eye(3), (8, 1, 1)))
    mask, _, _ = held(({2}, {1: edge}))
    assert mask[0].tolist() == [[False] * 3, [False, False, True], [False] * 3, [False] * 3]
    assert not held(({0, 1, 2}, {}))[0].any()
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    mesh.points = mesh.points @ turn.T
    mask, frames, odd = held(({0, 1, 2}, {2: face}))
    assert odd == 0
    slopes = frames[0][:, mask[0, 1:, 0]]
    np.testing.assert_allclose(slopes.T @ turn[:, 0], 0.0, atol=1e-12)
    assert slopes.shape == (3, 2)
    mesh.points = (mesh.points @ turn) @ np.array([[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]).T
    mask, _, odd = held(({0}, {2: face}), ({1}, {2: mesh.cells[:, [0, 1, 5, 4]]}))
    assert odd == 2
    assert mask[0, 1:, :2].all()
