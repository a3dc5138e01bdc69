"""Pictures made without a display, looked at by their pixels; what they cannot show is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import results_writer as run
from mpi4py import MPI
from PIL import Image

from ancf_petsc.cli import main
from ancf_petsc.errors import CaseError, EnvironmentProblem
from ancf_petsc.post import view
from ancf_petsc.post.view import Look, describe, label, scalars
from ancf_petsc.results.reader import Results, open_results


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
