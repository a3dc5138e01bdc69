"""Pictures made without a display, looked at by their pixels; what they cannot show is told."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import pyvista
import results_writer as run
from mpi4py import MPI
from PIL import Image
from vtkmodules.vtkRenderingCore import vtkTextRenderer

from ancf_petsc.cli import main
from ancf_petsc.errors import CaseError, EnvironmentProblem
from ancf_petsc.mesh.mesh import Group
from ancf_petsc.post import view
from ancf_petsc.post.case_view import Marked, _shown, _spread
from ancf_petsc.post.scene import one_line
from ancf_petsc.post.view import Look, describe, label, scalars
from ancf_petsc.results.reader import Results, open_results
from ancf_petsc.results.store import ResultStore
from ancf_petsc.results.tables import CsvTable
from ancf_petsc.results.xdmf import field_name, link_name


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Results:
    folder = tmp_path_factory.mktemp("run")
    run.write(folder, MPI.COMM_SELF)
    return open_results(folder)


@pytest.fixture(autouse=True)
def _no_display(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)


def pixels(file: Path) -> np.ndarray:
    """(height, width, 3) between 0 and 1."""
    return np.asarray(Image.open(file).convert("RGB")) / 255.0


def test_components_are_what_they_say(results):
    displacement = run.node_fields(1.0)["displacement"]
    stress = run.cell_fields(1.0)["cauchy"]
    np.testing.assert_array_equal(scalars(results, Look("displacement", "z"), -1), displacement[:, 2])
    np.testing.assert_allclose(
        scalars(results, Look("displacement"), -1), np.sqrt((displacement**2).sum(axis=1)), rtol=1e-15
    )
    np.testing.assert_array_equal(scalars(results, Look("cauchy", "yz"), -1), stress[:, 1, 2])
    largest = [np.linalg.eigvalsh(one)[-1] for one in stress]
    np.testing.assert_allclose(scalars(results, Look("cauchy"), -1), largest, rtol=1e-13)
    np.testing.assert_array_equal(scalars(results, Look("det_F"), 1), run.cell_fields(0.1)["det_F"])


def test_bars_are_named_with_unit(results):
    assert label(results, Look("displacement")) == "displacement [mm]"
    assert label(results, Look("cauchy", "zz")) == "Cauchy stress, zz [MPa]"
    assert label(results, Look("cauchy")) == "Cauchy stress, largest principal [MPa]"
    assert label(results, Look("det_F")) == "det F"


def test_time_stroke_and_scale_are_told(results):
    assert describe(results, Look(), 1) == "pseudo-time 0.1   stroke -0.01 mm"
    assert describe(results, Look(scale=5.0), 3).endswith("displacements x 5")


def test_a_few_peaks_do_not_take_the_colours_from_the_rest():
    values = np.concatenate([np.linspace(1.0, 2.0, 999), [500.0]])
    (low, high), told = view._limits([values])
    assert (low, high) == pytest.approx((1.01, 1.99), abs=1e-3)
    assert told == "(values 1 to 500)"
    assert view._limits([np.linspace(-1.0, 3.0, 50)]) == ((-3.0, 3.0), "")
    assert view._limits([np.zeros(5)]) == ((-0.5, 0.5), "")


def test_a_picture_needs_no_display(results, tmp_path):
    """White corners, and a body coloured by viridis, whose ends are violet and yellow."""
    view.screenshot(results, Look("displacement", "magnitude", undeformed=False), -1, tmp_path / "run.png")
    picture = pixels(tmp_path / "run.png")
    assert (picture[[0, 0, -1, -1], [0, -1, 0, -1]] == 1.0).all()
    body = picture[200:900, 300:1100].reshape(-1, 3)
    coloured = np.ptp(body, axis=1) > 0.2
    assert 0.2 < coloured.mean() < 0.95
    red, green, blue = body[coloured].T
    assert (green > 1.8 * blue).any()
    assert (blue > 1.3 * green).any()


def picture_of(tmp_path, points, kind, cells, **extra) -> np.ndarray:
    """The first of two steps of a body that moves by its size along z; extra: attributes of the steps."""
    tmp_path.mkdir(exist_ok=True)
    store = ResultStore(tmp_path, MPI.COMM_SELF, "body", "SI")
    store.write_mesh(points, kind, cells, np.arange(len(points)), np.arange(len(cells)))
    moved = np.array([0.0, 0.0, 1.0]) * (1.0 + points[:, :1])
    for step in (1, 2):
        store.write_step(float(step), {"displacement": step * moved}, {}, extra)
    with CsvTable(tmp_path / "curve.csv", ["time"]) as table:
        table.append([1.0])
    assert main(["view", str(tmp_path), "--screenshot", str(tmp_path / "a.png"), "--step", "0"]) == 0
    return pixels(tmp_path / "a.png")[150:]


def test_a_body_without_sharp_edges_is_drawn(tmp_path):
    """A ball; its undeformed shape, which has no outline either, stands pale behind it."""
    skin = pyvista.Icosphere(radius=1.0, nsub=3)
    points = np.vstack([np.asarray(skin.points, float), np.zeros(3)])
    faces = skin.faces.reshape(-1, 4)[:, 1:]
    cells = np.column_stack([np.full(len(faces), len(points) - 1), faces])
    picture = picture_of(tmp_path, points, "tetra", cells)
    coloured = (np.ptp(picture, axis=2) > 0.2).mean()
    pale = ((np.ptp(picture, axis=2) < 0.02) & (picture[..., 0] < 0.95) & (picture[..., 0] > 0.7)).mean()
    assert coloured > 0.1
    assert pale > 0.03


@pytest.mark.parametrize(("kind", "cells"), [("line", [[0, 1], [1, 2]]), ("line3", [[0, 2, 1]])])
def test_beams_are_drawn_as_lines(kind, cells, tmp_path):
    points = np.array([[0.0, 0, 0], [0.5, 0, 0], [1.0, 0, 0]])
    picture = picture_of(tmp_path, points, kind, np.array(cells))
    beam = np.ptp(picture[:, :1200], axis=2) > 0.15
    assert 1500 < beam.sum() < 30_000
    assert (
        beam.any(axis=0).sum() + beam.any(axis=1).sum() > 600
    )  # columns and rows of pixels: from end to end


def test_modes_are_named_by_number_and_frequency(tmp_path):
    points, cells = run.mesh()
    picture = picture_of(tmp_path, points, "tetra", cells, frequency=12.5)
    assert picture.std() > 0.05
    modes = open_results(tmp_path)
    assert describe(modes, Look(), 1) == "mode 2   frequency 12.5 Hz"
    assert label(modes, Look()) == "displacement, scaled"
    modes.extras[1]["growth_rate"] = 3.0
    assert describe(modes, Look(), 1) == "mode 2   unstable, grows by exp(3 t)"


def test_a_folder_of_modes_has_no_curves(tmp_path, capsys):
    points, cells = run.mesh()
    picture_of(tmp_path / "a b", points, "tetra", cells, frequency=12.5)
    assert main(["plot", str(tmp_path / "a b")]) == 2
    assert (
        f"modes have no curves; modes.csv has the frequencies, ancf view '{tmp_path}/a b' the"
        in capsys.readouterr().err
    )


ODD = (".", "..", "a\nb", "$x_", "a|b", "100 %", "_", "ß/ä")


def test_groups_of_any_name_are_kept_and_drawn(project, tmp_path):
    """A dot is no link of HDF5, a slash leads to another."""
    store = ResultStore(tmp_path, MPI.COMM_SELF, ODD[0], "SI")
    groups = {name: np.array([number]) for number, name in enumerate(ODD)}
    store.write_mesh(run.mesh()[0], "tetra", run.mesh()[1], np.arange(8), np.arange(6), groups)
    assert {name: rows.tolist() for name, rows in open_results(tmp_path).groups.items()} == {
        name: [number] for number, name in enumerate(ODD)
    }
    chosen = ['"." = { plane = "z", at = "min" }']
    chosen += [f"{json.dumps(name)} = {{ nearest = [0.0, 0.0, 0.0] }}" for name in ODD[1:]]
    words = ["--set", f"groups={{ {', '.join(chosen)} }}", "constraint.bottom.group=."]
    case = project / "cases/pvc_block"
    assert main(["view", str(case), *words, "--screenshot", str(tmp_path / "a.png")]) == 0


def test_texts_in_pictures_are_as_typed(tmp_path):
    """VTK makes formulas of what stands between dollars, and columns of bars, unless it is kept from it."""
    assert one_line("a | $x$\n  b   c") == r"a | \$x\$ b   c"
    points, cells = run.mesh()
    picture_of(tmp_path, points, "tetra", cells)
    renderer = vtkTextRenderer.GetInstance()
    assert renderer.GetDefaultBackend() == renderer.FreeType


def test_of_two_groups_of_the_same_nodes_one_is_labelled():
    points, cells = run.mesh()
    names = {
        "held": [0, 1],
        "again": [0, 1],
        "end": [2],
        "same end": [2],
        "also held": [0, 1],
        "all": range(8),
    }
    groups = {name: Group(name, np.array(nodes), {}) for name, nodes in names.items()}
    mesh = SimpleNamespace(groups=groups, used=np.ones(len(points), bool))
    supports = [Marked("held", ("x",)), Marked("also held", ("y",))]
    assert [group.name for group in _shown(mesh, supports)] == ["held", "also held", "end"]


def test_links_of_all_names_differ():
    names = ["", "%", "%25", ".", "%2E", "/", "a", "a\0", "\x01", "..."]
    assert [field_name(link_name(name)) for name in names] == names
    assert len({link_name(name) for name in names}) == len(names)


def test_a_window_needs_a_display(results):
    with pytest.raises(EnvironmentProblem, match="no display to open a window on; use --screenshot FILE"):
        view.explore(results, Look(), -1)


def test_a_movie_has_a_frame_a_step(results, tmp_path):
    view.movie(results, Look(), tmp_path / "run.gif")
    movie = Image.open(tmp_path / "run.gif")
    assert movie.n_frames == len(run.TIMES)
    frames = []
    for index in range(movie.n_frames):
        movie.seek(index)
        frames.append(np.asarray(movie.convert("RGB"), float))
    assert all(np.abs(one - other).max() > 50 for one, other in zip(frames, frames[1:], strict=False))


@pytest.mark.parametrize(
    ("look", "message"),
    [
        (Look("vonmises"), "no such field: found 'vonmises'"),
        (Look("displacement", "w"), "no such component: found 'w'; there are: magnitude, x, y, z"),
        (Look("det_F", "x"), "this field has no components: found 'x'"),
    ],
)
def test_what_cannot_be_shown_is_told(results, look, message):
    with pytest.raises(CaseError, match=message):
        scalars(results, look, -1)


def test_view_of_a_run(results, ancf, tmp_path):
    ancf("view", results.folder, "--screenshot", tmp_path / "a.png", "--field", "det_F", "--time", "0.3")
    assert pixels(tmp_path / "a.png").std() > 0.05  # more than a white sheet


def test_view_of_a_case_before_it_is_solved(project, tmp_path):
    """The block: translucent body, coloured groups, orange arrows where the top is moved."""
    picture = tmp_path / "case.png"
    assert main(["view", str(project / "cases" / "pvc_block"), "--screenshot", str(picture)]) == 0
    red, green, blue = np.moveaxis(pixels(picture), -1, 0)
    orange = (red > 0.7) & (green < 0.55) & (blue < 0.2)
    assert 500 < orange.sum() < 50_000


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ([], 4, "there is no display to open a window on; use --screenshot FILE"),
        (["--screenshot", "a.gif"], 2, "--screenshot: found 'a.gif', expected a file name that ends in .png"),
        (["--screenshot", "none/a.png"], 2, "--screenshot: no such folder: found 'none'"),
        (["--movie", "a.mp4"], 2, "--movie: found 'a.mp4', expected a file name that ends in .gif"),
        (["--set", "a=1"], 2, "--set: applies to cases; this is a finished run"),
    ],
)
def test_wrong_words_are_told(results, capsys, arguments, code, message):
    assert main(["view", str(results.folder), *arguments]) == code
    assert message in capsys.readouterr().err


def test_small_groups_of_slender_bodies_have_a_mark_at_each_corner():
    """A single arrow at a corner of a column's head would look like an eccentric force."""
    points = np.array([[0, 0, 2], [0.1, 0, 2], [0.1, 0.1, 2], [0, 0.1, 2], [0, 0, 0], [0.1, 0, 0]], float)
    mesh = SimpleNamespace(points=points, size=2.005)
    assert sorted(_spread(mesh, np.arange(4))) == [0, 1, 2, 3]
    assert len(_spread(mesh, np.arange(1))) == 1
