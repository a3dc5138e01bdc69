"""docs/case-format.md is true: its examples are cases, and no key is left out."""

import re
import tomllib
from pathlib import Path
from typing import get_args

import pytest
from pydantic import BaseModel

from ancf_petsc.input import CaseSpec, case_from_dict
from ancf_petsc.input.methods import METHODS
from ancf_petsc.material import LAWS

PAGE = (Path(__file__).parents[1] / "docs" / "case-format.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)


def tables(kind) -> set[type[BaseModel]]:
    """All tables a case is made of."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        inner = (field.annotation for field in kind.model_fields.values())
        return {kind}.union(*map(tables, inner))
    return set().union(*map(tables, get_args(kind)))


@pytest.mark.parametrize("text", EXAMPLES)
def test_examples_are_cases(text):
    assert case_from_dict(tomllib.loads(text), ".").spec.title


def test_there_is_an_example_of_each_analysis():
    specs = [case_from_dict(tomllib.loads(text), ".").spec for text in EXAMPLES]
    assert any(spec.statics for spec in specs)
    assert any(spec.dynamics for spec in specs)


def test_every_key_law_and_integrator_is_described():
    keys = {name for table in tables(CaseSpec) for name in table.model_fields}
    assert len(keys) > 40
    unsaid = [name for name in sorted({*keys, *LAWS, *METHODS}) if not re.search(rf"\b{name}\b", PAGE)]
    assert unsaid == []


def test_every_key_says_what_it_expects():
    """The words of an error message come from the key's description."""
    silent = [
        f"{table.__name__}.{name}"
        for table in tables(CaseSpec)
        for name, field in table.model_fields.items()
        if not field.description and name != "type"
    ]
    assert silent == []


def test_defaults_of_the_page_are_those_of_the_format():
    found = re.findall(r"^\| `(\w+)` \| ([^|]+?) \|", PAGE, re.MULTILINE)
    rows = dict(reversed(found))  # keys come before integrators of the same name
    for table in tables(CaseSpec):
        for name, field in table.model_fields.items():
            if name in ("tolerance", "ramp") or not isinstance(field.default, int | float | str):
                continue
            assert tomllib.loads(f"value = {rows[name].strip('`')}")["value"] == field.default, name
