"""docs/study.md is true: its example is a study, and no key, column or outcome is left out."""

import re
import tomllib
from pathlib import Path

from pydantic import BaseModel

from ancf_petsc.studies.columns import columns_of
from ancf_petsc.studies.ladders import LADDERS
from ancf_petsc.studies.spec import COMPARED, REDUCTIONS, QuantitySpec, StudySpec, check_study
from ancf_petsc.studies.table import SIZES

PAGE = (Path(__file__).parents[1] / "docs" / "study.md").read_text(encoding="utf-8")


def test_the_example_is_a_study():
    text, *_ = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    spec = check_study(tomllib.loads(text), Path("study.toml"))
    assert spec.combinations
    assert spec.reference["force"].kind == "richardson"
    assert spec.keys == ("mesh.element", "mesh.size")
    assert spec.common["mesh.file"] == ""


def test_every_key_column_and_ladder_is_described():
    tables: tuple[type[BaseModel], ...] = (StudySpec, QuantitySpec)
    words = {name for table in tables for name in table.model_fields}
    words |= {*SIZES, *LADDERS, *COMPARED, *REDUCTIONS}
    assert [word for word in sorted(words) if not re.search(rf"\b{re.escape(word)}\b", PAGE)] == []


def test_columns_are_those_that_runs_leave(tmp_path):
    """Of statics and of motion, in their order: what is refused before a run would not have been there after it."""
    import ancf_petsc as ancf

    body = {
        "title": "Columns",
        "mesh": {"body": "cantilever", "divisions": [1, 1, 1], "element": "3413"},
        "material": {"law": "svk", "young": 1e7, "poisson": 0.3, "density": 1000.0},
        "constraint": [{"group": "clamp", "fix": ["x", "y", "z"]}, {"group": "end", "move": {"z": -0.01}}],
        "output": {"curve": {"force": "end.z", "stroke": "end.z"}},
        "probe": [{"name": "tip", "group": "end"}],
    }
    for analysis in ({"statics": {"steps": 1}}, {"dynamics": {"duration": 0.01, "step": 0.01, "outputs": 1}}):
        case = ancf.case_from_dict({**body, **analysis}, tmp_path)
        run = ancf.run(case, tmp_path / next(iter(analysis)))
        assert set(columns_of(case.spec)) == {*run.curve, *run.probes}
