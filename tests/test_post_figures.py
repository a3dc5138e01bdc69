"""What the figures show: the tables' numbers, words and units on the axes, notes below."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import results_writer as run
from mpi4py import MPI

from ancf_petsc.cli import main
from ancf_petsc.post import figures
from ancf_petsc.post.reference import read_level, read_reference
from ancf_petsc.results.reader import open_results
from ancf_petsc.results.tables import CsvTable

mpl.use("Agg")


@pytest.fixture
def block(tmp_path: Path):
    run.write(tmp_path / "block", MPI.COMM_SELF)
    return open_results(tmp_path / "block")


@pytest.fixture
def motion(tmp_path: Path):
    """A body on a spring, without damping: energy is kept, the momentum swings."""
    folder = tmp_path / "motion"
    run.write(folder, MPI.COMM_SELF)
    time = np.linspace(0, 6, 101)
    columns = {
        "time": time,
        "kinetic_energy": np.sin(time) ** 2,
        "strain_energy": np.cos(time) ** 2 + 1e-3 * time,
        "external_work": 0 * time,
        "momentum.x": np.sin(time),
        "momentum.y": 0 * time,
        "momentum.z": 0 * time,
        **{f"angular_momentum.{axis}": 0 * time for axis in "xyz"},
    }
    _write(folder / "curve.csv", columns)
    swing = np.cos(time)
    moved = {"tip.x": 2 + swing, "tip.y": 0 * time, "tip.z": 0 * time}
    _write(
        folder / "probes.csv",
        {"time": time, **moved, "tip.ux": swing, "tip.uy": 0 * time, "tip.uz": 0 * time},
    )
    return open_results(folder)


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    mpl.pyplot.close("all")


def _write(path, columns):
    with CsvTable(path, list(columns)) as table:
        for row in zip(*columns.values(), strict=True):
            table.append(row)


def lines(axes):
    """Points of the lines that stand for tables."""
    return [line.get_xydata() for line in axes.lines if len(line.get_xdata()) > 2]


def words(figure):
    """What stands in the legend and below."""
    legend = [text.get_text() for text in figure.legends[0].get_texts()] if figure.legends else []
    return legend, figure.get_supxlabel()


def test_compression_is_drawn_upwards_with_units_and_note(block):
    figure = figures.force_stroke([block])
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("compression [mm]", "compressive force [N]")
    np.testing.assert_array_equal(
        lines(axes)[0], -np.column_stack([block.curve["stroke"], block.curve["force"]])
    )
    assert axes.get_title(loc="left") == run.TITLE
    assert words(figure) == (["sum of internal forces"], run.NOTE)


@pytest.mark.parametrize(
    "title", ["5$ and 7$", "A $_$ B, 5 &", r"cost $^$ \frac{", "_hidden", "two\nlines", r"5\$"]
)
def test_titles_notes_and_names_are_drawn_as_typed(title, block, tmp_path, recwarn):
    """Dollars make no formula, an underscore at the start no legend without the run."""
    block.title = block.note = title
    other = tmp_path / title.replace("/", "")
    run.write(other, MPI.COMM_SELF)
    second = open_results(other)
    second.title, second.note = "another", title
    figure = figures.force_stroke([block, second])
    figures.save({"a": figure, "b": figures.force_stroke([block])}, tmp_path, "png")
    assert not [one for one in recwarn if "label" in str(one.message)]
    texts = [figure.legends[0].get_texts()[0], figure._supxlabel]
    assert [text._preprocess_math(text.get_text()) for text in texts] == [(as_drawn(title), False)] * 2


def as_drawn(title):
    return f" {title}" if title.startswith("_") else title


def test_a_line_break_in_a_name_comes_through_table_and_figure(block, tmp_path):
    name = "tip, 1\n(upper) $x$"
    _write(
        block.folder / "probes.csv",
        {"pseudo_time": [0.0, 1.0], f"{name}.z": [1.0, 2.0], f"{name}.uz": [0.0, 1.0]},
    )
    table = open_results(block.folder).probes
    assert table[f"{name}.uz"].tolist() == [0.0, 1.0]
    probes = ["--probe", f"{name}.z", "--probe", f"{name}.uz"]
    assert main(["plot", str(block.folder), *probes, "--out", str(tmp_path / "p")]) == 0
    assert main(["plot", str(block.folder), "--out", str(tmp_path / "p")]) == 0
    (path,) = (tmp_path / "p").glob("tip*")
    assert path.name == "tip_1_upper_x_.z_tip_1_upper_x_.uz.png"


def test_explicit_motion_has_no_panel_of_iterations(block):
    """It never iterates: a column of zeros is no picture."""
    block.curve["newton_iterations"] *= 0
    (axes,) = figures.steps([block]).axes
    assert axes.get_ylabel() == "smallest det F"


def test_runs_share_axes_and_are_named(block, tmp_path):
    run.write(tmp_path / "other", MPI.COMM_SELF)
    figure = figures.force_stroke([block, open_results(tmp_path / "other")])
    assert len(lines(figure.axes[0])) == 2
    assert words(figure)[0] == ["block", "other"]  # the titles are the same


def test_pulling_is_drawn_as_stroke_and_force(block):
    block.curve["force"] *= -1
    (axes,) = figures.force_stroke([block]).axes
    assert axes.get_ylabel() == "force [N]"
    assert lines(axes)[0][-1].tolist() == [-0.1, 20.0]


def test_a_statics_run_has_its_figures(block):
    assert list(figures.figures_of([block])) == ["force_stroke", "energy", "probes", "steps"]


def test_a_motion_has_its_figures(motion):
    made = figures.figures_of([motion])
    assert list(made) == ["energy", "probes", "momentum"]
    assert made["momentum"].axes[-1].get_xlabel() == "time"


def test_the_drift_is_what_the_balance_gains(motion):
    """Kinetic + strain grow by 0.001 t of the largest part, 1.0051 at most."""
    drift = figures.energy_drift(motion.curve)
    largest = motion.curve["strain_energy"].max()
    np.testing.assert_allclose(drift, 1e-3 * motion.curve["time"] / largest, atol=1e-15)


def test_work_that_is_stored_or_lost_is_no_drift():
    """Work of 8 becomes 1 of motion, 4 of strain and 2.6 of loss: the balance falls by 0.4, a twentieth of the largest part."""
    curve = {"kinetic_energy": 1.0, "strain_energy": 4.0, "dissipated_energy": 2.6, "external_work": 8.0}
    drift = figures.energy_drift({name: value * np.array([0.0, 0.5, 1.0]) for name, value in curve.items()})
    np.testing.assert_allclose(drift, [0.0, -0.025, -0.05], atol=1e-15)


def test_probes_are_drawn_where_they_move(motion, block):
    (axes,) = figures.probes([motion]).axes
    assert axes.get_ylabel() == "x position [mm]"
    np.testing.assert_array_equal(lines(axes)[0][:, 1], motion.probes["tip.x"])
    (axes,) = figures.probes([block]).axes
    assert axes.get_ylabel() == "z displacement [mm]"


def test_no_figure_without_columns(motion):
    assert figures.force_stroke([motion]) is None
    assert figures.steps([motion]) is None


def test_plot_writes_the_pictures(block, tmp_path, capsys):
    assert main(["plot", str(block.folder), "--out", str(tmp_path / "pictures")]) == 0
    said = capsys.readouterr().out.split()
    assert sorted(map(Path, said)) == sorted((tmp_path / "pictures").iterdir())
    assert all(Path(name).read_bytes().startswith(b"\x89PNG") for name in said)


@pytest.mark.parametrize(("suffix", "start"), [("pdf", b"%PDF"), ("svg", b"<?xml")])
def test_pictures_may_be_drawn_as_lines(suffix, start, block, tmp_path):
    (path,) = figures.save({"force": figures.force_stroke([block])}, tmp_path, suffix)
    assert path.read_bytes().startswith(start)


def test_plot_tells_what_is_no_run(tmp_path, capsys):
    assert main(["plot", str(tmp_path)]) == 2
    assert "no results here" in capsys.readouterr().err


def test_the_script_compares_runs(block, mpirun, project, tmp_path):
    script = project / "scripts" / "compare_runs.py"
    said = mpirun(1, [script, block.folder, block.folder, "--out", tmp_path / "both.png"]).stdout
    # force 200 times the stroke of 0.1: 20 at most, half of 20 times 0.1 put in and kept
    assert said.count("-20                 1                 1               200               200") == 2
    assert said.count(f"\n{block.folder.name} ") == 2  # by folder: changed runs of a case share its title
    assert (tmp_path / "both.png").read_bytes().startswith(b"\x89PNG")


def test_one_component_of_several_runs_with_what_is_known(block, motion, tmp_path):
    """Runs and a reference in one axis, named in the legend; a level across it with its words and value."""
    known = tmp_path / "other_code.csv"
    _write(known, {"time": np.linspace(0, 6, 4), "tip.x": np.linspace(3, 2, 4)})
    drawn = [motion, read_reference(known, motion)]
    (axes,) = figures.components(drawn, ["tip.x"], [read_level("Abaqus, a=b=2.5")]).axes
    assert axes.get_ylabel() == "tip: x position [mm]"
    np.testing.assert_array_equal(lines(axes)[1][:, 1], np.linspace(3, 2, 4))
    assert words(axes.figure)[0] == [run.TITLE, "other_code"]
    assert [text.get_text() for text in axes.texts] == ["Abaqus, a=b: 2.5"]
    assert axes.lines[-1].get_ydata() == [2.5, 2.5]


def test_a_reference_is_drawn_where_its_columns_are(block, tmp_path):
    known = tmp_path / "measured.csv"
    _write(known, {"stroke": np.linspace(0, -0.1, 3), "force": np.linspace(0, -25, 3)})
    made = figures.figures_of([block, read_reference(known, block)])
    assert [len(made[name].axes[0].lines) for name in ("force_stroke", "energy")] == [3, 2]
    assert lines(made["force_stroke"].axes[0])[1][-1].tolist() == [0.1, 25.0]


def test_plot_draws_components_one_above_the_other(motion, tmp_path, capsys):
    out = ["--out", str(tmp_path / "plots")]
    arguments = ["plot", str(motion.folder), "--probe", "tip.x", "--probe", "tip.ux", "--level", "rest=0"]
    assert main([*arguments, *out]) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "plots" / "tip.x_tip.ux.png")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--probe", "top.w"], "--probe: no such component of a probe: found 'top.w'; did you mean 'top."),
        (["--level", "a=1"], "--level: needs a probe component; such as --probe tip.z"),
        (["--probe", "top.z", "--level", "0.1"], "--level: found '0.1', expected LABEL=NUMBER"),
        (["--reference", "FILE"], "no curve to lay over the run: found 'columns t, z', expected time or"),
    ],
)
def test_what_cannot_be_laid_over_is_told(block, arguments, message, tmp_path, capsys):
    _write(tmp_path / "FILE", {"t": np.arange(3.0), "z": np.arange(3.0)})
    named = [str(tmp_path / word) if word == "FILE" else word for word in arguments]
    assert main(["plot", str(block.folder), *named]) == 2
    assert message in capsys.readouterr().err


def test_the_end_and_the_cuts_of_a_run_are_marked_on_its_curves(block):
    """A cross with the event at the last row, in all figures over it; ticks where steps were cut."""
    end = {"kind": "surface_fold", "message": "the free surface folds"}
    cuts = [{"action": "halved", "pseudo_time": s, "reason": "no convergence"} for s in (0.2, 0.2, 0.7)]
    block.__dict__["summary"] = {**block.summary, "end": end, "step_control": cuts}
    (axes,) = figures.force_stroke([block]).axes
    (text,) = [text for text in axes.texts if text.get_text() == "surface fold"]
    assert text.xy == pytest.approx((-block.curve["stroke"][-1], -block.curve["force"][-1]))
    marked = figures.steps([block]).axes
    ticks = [line for line in marked[0].lines if line.get_marker() == "|"]
    assert [line.get_xdata().tolist() for line in ticks] == [[0.2, 0.7]]
    block.__dict__["summary"] = {**block.summary, "end": {"kind": "reached"}, "step_control": []}
    (axes,) = figures.force_stroke([block]).axes
    assert not axes.texts
