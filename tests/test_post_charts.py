"""What the charts of studies show: the right points in the right lines, labels that cover nothing, numbers as CSV."""

from __future__ import annotations

import csv
import json

import matplotlib as mpl
import numpy as np
import pytest
import study_folders

from ancf_petsc.cli import main
from ancf_petsc.errors import CaseError
from ancf_petsc.post.charts import draw, errors, maps, profile
from ancf_petsc.post.charts.curves import curve_panels
from ancf_petsc.post.charts.marks import apart
from ancf_petsc.post.charts.spec import ChartSpec
from ancf_petsc.post.charts.study_table import read_study
from ancf_petsc.post.charts.values import value_panels

mpl.use("Agg")
MAP = {
    "kind": "map", "x": "initial.spin", "y": "dynamics.step", "panels": "dynamics.integrator", "quantity": "drift",
    "factor": 0.3, "labels": {"theta": "trapezoidal"},
    "predicted": [{"label": "limit", "quantity": "limit", "factor": 0.5, "panel": "theta"}],
}  # fmt: skip


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    mpl.pyplot.close("all")


@pytest.fixture
def ladder(tmp_path):
    return read_study(study_folders.ladder(tmp_path / "ladder"))


@pytest.fixture
def motion(tmp_path):
    return read_study(study_folders.motion(tmp_path / "motion", [MAP]))


def chart(**keys):
    return ChartSpec.model_validate(keys, strict=False)


def texts(figure):
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_precision_has_a_line_an_element_and_leaves_failed_runs_to_the_margin(ladder):
    seconds, dof = errors.precision_panels(ladder, chart(kind="work_precision", quantity="force"))
    assert [line.label for line in seconds.lines] == list(study_folders.ORDERS)
    assert [len(line.shown) for line in seconds.lines] == [4, 4, 3]
    (failed,) = [p for p in seconds.lines[2].points if not p.known]
    assert (failed.outcome, failed.ended) == ("surface_fold", False)
    assert failed.x > 1.0  # its seconds are known, so it has a place above the axes
    shared = [p.x for p in seconds.lines[0].shown if not p.alone]
    assert len(shared) == 1
    assert all(
        p.alone for line in dof.lines for p in line.points
    )  # degrees of freedom do not hang on the load
    first = dof.lines[0].shown[0]
    assert first.y == pytest.approx(0.064)
    assert (first.low, first.high) == pytest.approx((0.0639, 0.0641))


def test_the_front_is_what_no_run_beats(ladder):
    panel = errors.precision_panels(ladder, chart(kind="work_precision", quantity="force"))[0]
    shown = [p for line in panel.lines for p in line.shown]
    points = [p for p in shown if p.alone]
    assert [p.best for p in shown if not p.alone] == [False]
    for p in points:
        beaten = any(o.x <= p.x and o.y <= p.y and (o.x, o.y) != (p.x, p.y) for o in points)
        assert p.best != beaten


def test_orders_of_the_study_stand_at_the_lines_and_slopes_where_there_is_none(ladder):
    (panel,) = errors.convergence_panels(ladder, chart(kind="convergence", quantity="force"))
    assert [line.more for line in panel.lines] == ["order 1.0", "slope 2.0", "(not asymptotic)"]
    assert panel.x == "edge length [m]"


def test_labels_stand_right_of_the_axes_and_apart(ladder):
    spec = chart(kind="work_precision", quantity="force")
    figure = errors.draw_precision(ladder, spec, errors.precision_panels(ladder, spec))
    figure.draw_without_rendering()
    for axes in figure.axes:
        boxes = [text.get_window_extent() for text in axes.texts]
        assert len(boxes) == 3
        edge = axes.get_window_extent().x1
        assert all(axes.transAxes.transform(text.get_position())[0] > edge for text in axes.texts)
    assert {"3413", "3-10-1-3", "3443"} == set(texts(figure))
    assert not any(axes.get_legend() for axes in figure.axes)


def test_long_titles_and_notes_stay_within_the_picture(tmp_path):
    study = read_study(
        study_folders.ladder(tmp_path / "long", title="Element, mesh and rim of the block " * 4)
    )
    spec = chart(kind="work_precision", quantity="force", cost="dof", note="Edges of 20 to 6 mm and " * 9)
    figure = errors.draw_precision(study, spec, errors.precision_panels(study, spec))
    figure.draw_without_rendering()
    assert "\n" in figure.get_suptitle()
    assert "\n" in figure.get_supxlabel()
    for text in figure.texts:
        assert text.get_window_extent().x1 < figure.bbox.width


def test_words_at_one_height_are_moved_apart_as_little_as_needed():
    found = apart([0.5, 0.5, 0.9, 0.51], [0.1] * 4)
    assert found[2] == pytest.approx(0.9)
    order = sorted(found[:2] + found[3:])
    assert np.diff(order) == pytest.approx([0.1, 0.1], abs=1e-3)
    assert np.mean(order) == pytest.approx(np.mean([0.5, 0.5, 0.51]), abs=1e-3)


def test_a_map_has_a_cell_a_run_coloured_by_its_end(motion):
    panels = maps.map_panels(motion, motion.charts[0])
    assert [panel.title for panel in panels] == ["energy momentum", "trapezoidal"]
    ends = {(p.x, p.y): p.outcome for line in panels[1].lines for p in line.points}
    steps, spins = study_folders.STEPS, study_folders.SPINS
    for (x, y), outcome in ends.items():
        grown = steps[y] * spins[x]
        assert outcome == ("diverged" if grown > 0.5 else "energy_grown" if grown > 0.3 else "reached")
    assert len(ends) == len(steps) * len(spins)
    (line,) = panels[1].predicted
    assert [p.x for p in line.shown] == [5, 10, 20]
    assert [p.y for p in line.shown] == pytest.approx([0.1, 0.05, 0.025])
    assert not panels[0].predicted


def test_a_key_that_is_taken_away_is_a_value_of_a_map(tmp_path):
    keys = {"petsc.search": ["", "bt"], "size": [1, 2]}
    rows = [
        {"petsc.search": search, "size": size, "run": f"{search}{size}"}
        for search in ("", "bt")
        for size in (1, 2)
    ]
    spec = chart(kind="map", x="size", y="petsc.search")
    study = read_study(study_folders.write(tmp_path / "searches", keys=keys, quantities={}, rows=rows))
    (panel,) = maps.map_panels(study, spec)
    assert sorted((p.x, p.y) for p in panel.lines[0].points) == [(0, 0), (0, 1), (1, 0), (1, 1)]
    figure = maps.draw_map(study, spec, [panel])
    assert [tick.get_text() for tick in figure.axes[0].get_yticklabels()] == ["default", "bt"]


def test_predicted_lines_of_a_map_lie_between_the_cells_of_their_values(motion):
    panels = maps.map_panels(motion, motion.charts[0])
    figure = maps.draw_map(motion, motion.charts[0], panels)
    dashed = [line for line in figure.axes[1].lines if line.get_linestyle() == "--"]
    x, y = dashed[0].get_data()
    assert list(x) == pytest.approx([0, 1, 2])
    # 0.05 between 0.04 and 0.08, 0.025 between 0.02 and 0.04, by their logarithms; 0.1 beyond the last, at most half a cell.
    assert list(y) == pytest.approx([3 + np.log2(1.25), 2 + np.log2(1.25), 1 + np.log2(1.25)], abs=1e-9)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "reached",
        "energy grown",
        "diverged",
    ]


def test_values_have_lines_predictions_and_relative_heights(motion):
    spec = chart(
        kind="values", x="dynamics.step", quantity="drift", lines="initial.spin", panels="dynamics.integrator",
        predicted=[{"label": "one", "value": 0.5}, {"label": "two", "points": [[0.01, 1], [0.08, 2]]}],
    )  # fmt: skip
    _, theta = value_panels(motion, spec)
    assert [line.label for line in theta.lines] == ["spin 5", "spin 10", "spin 20"]
    assert [p.y for p in theta.lines[2].shown] == pytest.approx([0.2, 0.4, 0.8, 1.6])
    assert [p.y for p in theta.predicted[1].shown] == [1, 2]
    _, relative = value_panels(motion, spec.model_copy(update={"relative": True}))
    assert [p.y for p in relative.lines[2].shown] == pytest.approx([1, 2, 4, 8])


def test_values_may_stand_at_equal_distances_and_predictions_between_them(motion):
    spec = chart(
        kind="values", x="dynamics.step", quantity="drift", lines="initial.spin", panels="dynamics.integrator",
        x_scale="even", predicted=[{"label": "theory", "points": [[0.01, 1], [0.03, 2], [0.08, 3]]}],
    )  # fmt: skip
    _, theta = value_panels(motion, spec)
    assert [p.x for p in theta.lines[0].shown] == [0, 1, 2, 3]
    assert [p.x for p in theta.predicted[0].shown] == [0, 1.5, 3]


def test_curves_are_sums_of_columns_over_their_start(motion):
    spec = chart(
        kind="curves", y="kinetic_energy + strain_energy", relative=True,
        only={"initial.spin": 20.0, "dynamics.step": [0.01, 0.08]}, lines=["dynamics.integrator", "dynamics.step"],
    )  # fmt: skip
    (panel,) = curve_panels(motion, spec)
    assert [line.label for line in panel.lines][-1] == "theta, time step 0.08 s"
    last = panel.lines[-1].points
    assert last[10].y == pytest.approx((2 + 1.6 * 0.5 + np.sin(10) ** 2) / 2, abs=1e-12)
    assert (last[-1].ended, last[-1].outcome) == (False, "diverged")
    with pytest.raises(CaseError, match=r"no such column: found 'kinetic'; did you mean 'kinetic_energy'"):
        curve_panels(motion, spec.model_copy(update={"y": ("kinetic",)}))


def test_a_profile_counts_problems_within_a_ratio_of_the_cheapest(tmp_path):
    studies = [read_study(study_folders.ladder(tmp_path / name, title=name)) for name in "ab"]
    spec = chart(kind="profile", within=[0.05, 0.001])
    costs = profile.cheapest(studies, spec.model_copy(update={"lines": ("mesh.element",)}), "dof")
    assert costs["a: force within 5 %"] == {"3413": 5859, "3-10-1-3": 732, "3443": 732}
    assert costs["a: force within 0.1 %"] == {"3413": np.inf, "3-10-1-3": 46875, "3443": 5859}
    panel = profile.profile_panels(studies, spec)[1]
    shares = {line.label: [(p.x, p.y) for p in line.shown] for line in panel.lines}
    assert shares["3443"][-1] == (1.0, 1.0)
    assert shares["3413"] == [(5859 / 732, 0.25), (5859 / 732, 0.5)]


def test_a_profile_needs_a_key_that_all_studies_vary(ladder, motion):
    with pytest.raises(CaseError, match=r"the studies share no key that all of them vary.*mesh.element"):
        draw.profile_of([ladder, motion])


def test_pictures_come_with_their_numbers(tmp_path, capsys):
    folder = study_folders.motion(tmp_path / "motion", [MAP])
    assert main(["plot", str(folder)]) == 0
    said = capsys.readouterr().out.split()
    assert [name.rpartition(".")[2] for name in said] == ["png", "svg", "csv"]
    rows = list(csv.DictReader((folder / "charts/map_drift.csv").open()))
    measured = [row for row in rows if row["kind"] == "measured"]
    assert len(measured) == 24
    (row,) = [r for r in measured if r["run"] == "runs/theta_0.08_20.0"]
    assert (row["panel"], row["dynamics.step"], row["outcome"]) == ("trapezoidal", "0.08", "diverged")
    assert float(row["drift"]) == pytest.approx(1.6)


def test_studies_beside_each_other_get_a_profile(tmp_path, capsys):
    folders = [str(study_folders.ladder(tmp_path / name, title=name)) for name in "ab"]
    assert main(["plot", *folders, "--out", str(tmp_path / "out"), "--format", "svg"]) == 0
    said = capsys.readouterr().out
    assert (tmp_path / "out/profile.svg").is_file()
    assert (tmp_path / "out/a/work_precision_force.svg").is_file()
    assert ".png" not in said


def test_a_chart_of_one_point_is_not_drawn(tmp_path, capsys):
    folder = study_folders.ladder(tmp_path / "one")
    lines = (folder / "study.csv").read_text().splitlines()
    (folder / "study.csv").write_text("\n".join(lines[:2]) + "\n")
    assert main(["plot", str(folder)]) == 2
    said = capsys.readouterr()
    assert "work_precision_force: not drawn, it would have fewer than two points" in said.out
    assert "nothing to draw: no chart has two points; study.csv has the reasons" in said.err


def test_values_are_drawn_where_no_error_is_known(tmp_path, capsys):
    folder = study_folders.ladder(tmp_path / "unclaimed")
    rows = list(csv.DictReader((folder / "study.csv").open()))
    with (folder / "study.csv").open("w", newline="") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        table.writerows({**row, "force_error": "", "force_uncertainty": ""} for row in rows)
    assert main(["plot", str(folder), "--format", "svg"]) == 0
    assert "values_force.svg" in capsys.readouterr().out
    drawn = list(csv.DictReader((folder / "charts/values_force.csv").open()))
    found = {(row["line"], row["edge length [m]"]): row["force [N]"] for row in drawn}
    assert found == {(row["mesh.element"], row["mesh.size"]): row["force"] for row in rows}


def test_runs_that_are_still_to_come_are_not_drawn(ladder):
    path = ladder.folder / "study.csv"
    path.write_text(path.read_text().replace("done,reached", "skipped,not_run", 4))
    assert len(read_study(ladder.folder).rows) == len(ladder.rows) - 4


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda facts: facts.pop("axes"), "not the facts of a study: KeyError: 'axes', expected title, axes"),
        (lambda facts: facts.update(charts=[{"kind": "pie"}]), "charts.0.kind: Input should be"),
    ],
)
def test_files_that_are_no_study_are_refused_in_one_line(ladder, capsys, change, message):
    path = ladder.folder / "study.json"
    facts = json.loads(path.read_text())
    change(facts)
    path.write_text(json.dumps(facts))
    assert main(["plot", str(ladder.folder)]) == 2
    said = capsys.readouterr().err
    assert message in " ".join(said.split()).replace(": expected", ", expected")
    assert "Traceback" not in said


def test_a_table_without_outcomes_is_refused(ladder):
    (ladder.folder / "study.csv").write_text("mesh.size,force\n0.1,2\n")
    with pytest.raises(CaseError, match=r"study.csv: no column 'status': found 'mesh.size, force'"):
        read_study(ladder.folder)


def test_studies_and_runs_are_not_drawn_together(ladder, tmp_path, capsys):
    assert main(["plot", str(ladder.folder), str(tmp_path)]) == 2
    assert "not a study, beside studies" in capsys.readouterr().err
    assert main(["plot", str(ladder.folder), "--probe", "tip.z"]) == 2
    assert "--probe: is for runs; charts of studies are [[chart]] tables" in capsys.readouterr().err
