"""The wrong changes of scripts/mutate still apply to the sources, so that the list does not rot."""

from __future__ import annotations

from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader

import pytest


@pytest.fixture(scope="module")
def mutate(project):
    loader = SourceFileLoader("mutate", str(project / "scripts" / "mutate"))
    module = module_from_spec(spec_from_loader("mutate", loader))
    loader.exec_module(module)
    return module


def test_every_change_applies_exactly_once(mutate):
    """A change whose text is gone: edit scripts/mutations.toml so that it breaks the same thing again."""
    assert mutate.Plan().problems() == []


def test_there_are_enough_changes_of_every_folder(mutate):
    plan = mutate.Plan()
    names = [change["name"] for change in plan.changes]
    assert len(names) == len(set(names)) >= 60
    folders = {
        "kernel",
        "algebra",
        "material",
        "model",
        "plan",
        "solve",
        "motion",
        "analysis",
        "results",
        "post",
    }
    assert folders <= {plan.folder(change) for change in plan.changes}


def test_a_text_that_is_gone_or_twice_there_is_told(mutate, project, tmp_path):
    text = """
[files]
a = "ancf_petsc/errors.py"
b = "ancf_petsc/none.py"
[wider]
[[change]]
name = "gone"
file = "a"
old = "no such text"
new = ""
breaks = "nothing"
tests = ["no_such_file"]
[[change]]
name = "twice"
file = "a"
old = "exit_code = 1"
new = ""
breaks = "nothing"
tests = ["cases"]
[[change]]
name = "no file"
file = "b"
old = "x"
new = ""
breaks = "nothing"
tests = ["cases"]
"""
    (tmp_path / "changes.toml").write_text(text)
    found = mutate.Plan(tmp_path / "changes.toml", project).problems()
    assert [problem.partition(" ")[0] for problem in found] == ["1", "1", "2", "3"]
    assert "occurs 0 times" in found[0]
    assert "no such test file: no_such_file" in found[1]
    assert "occurs 2 times" in found[2]
    assert "no such file" in found[3]


def test_machine_code_made_of_a_changed_file_is_left_out_of_the_copied_cache(mutate, project):
    """What `envelope` changes, motions inline and generic kernels do not; what `tensor` changes, all inline."""
    found = mutate._dependents(project, "ancf_petsc/algebra/envelope.py")
    assert {"envelope", "motion", "implicit"} <= found
    assert "point_solid" not in found
    found = mutate._dependents(project, "ancf_petsc/material/tensor.py")
    assert {"point_solid", "tet3413", "models", "motion", "blocks"} <= found
