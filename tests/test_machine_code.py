"""Machine code in the cache serves the law, element and scheme that it was made for, and no other.

The suite's cache was filled by two processes that knew one law each (`conftest.machine_code`); here processes load both laws.
"""

from __future__ import annotations

import ast
import os
import pickle
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import llvmlite.binding as llvm
import numpy as np
import pytest

from ancf_petsc.element.catalog import element
from ancf_petsc.jit import composed, digest, kernel
from ancf_petsc.kernel import samples, selfcheck
from ancf_petsc.kernel.motion import march
from ancf_petsc.material.models import LAWS

PACKAGE = Path(__file__).resolve().parent.parent / "ancf_petsc"
MANGLED_LOCALS = "_3clocals_3e"  # numba's spelling of <locals> in a symbol
MANGLED_DIGEST = re.compile(r"_2d[0-9a-f]{12}")  # -digest


def test_laws_elements_and_schemes_in_any_order_have_their_own_code(project, environment, machine_code):
    done = subprocess.run(
        [sys.executable, project / "scripts" / "verify_machine_code", "--quick"],
        env=environment | {"ANCF_CACHE_DIR": str(machine_code)},
        capture_output=True,
        text=True,
        timeout=400,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_symbol_of_two_files_is_the_same_code(machine_code):
    bodies = defaultdict(set)
    for file in machine_code.rglob("*.nbc"):
        for name, body in symbols(file):
            bodies[name].add(body)
    assert not [name for name in bodies if MANGLED_LOCALS in name], "nested functions without a digest"
    composed_ones = [name for name in bodies if MANGLED_DIGEST.search(name)]
    assert len(composed_ones) > 20
    assert not [name for name in composed_ones if len(bodies[name]) > 1]


def symbols(file: Path):
    """Names and code of the project's functions that a file of numba's cache defines."""
    library = pickle.loads(file.read_bytes())[0]
    for function in llvm.parse_bitcode(library[2][1]).functions:
        if not function.is_declaration and "ancf_petsc" in function.name:
            yield function.name, re.sub(r"[#!]\d+|@\.const\.[^ ,)]*", "", str(function))


def test_nested_functions_are_compiled_by_the_one_mechanism_that_names_them():
    plain = {"register_jitable", "inlined", "njit", "jit"}
    found = []
    for file in PACKAGE.rglob("*.py"):
        for outer in ast.walk(ast.parse(file.read_text())):
            if not isinstance(outer, ast.FunctionDef):
                continue
            for inner in ast.walk(outer):
                if isinstance(inner, ast.FunctionDef) and inner is not outer:
                    used = {
                        name.id
                        for d in inner.decorator_list
                        for name in ast.walk(d)
                        if isinstance(name, ast.Name)
                    }
                    used |= {
                        a.attr
                        for d in inner.decorator_list
                        for a in ast.walk(d)
                        if isinstance(a, ast.Attribute)
                    }
                    found += [f"{file.name}:{inner.lineno} {inner.name}"] if used & plain else []
    assert found == [], "use `composed` or `kernel` of ancf_petsc/jit.py"


def scaled(factor):
    @composed
    def times(x):
        return factor * x

    return times


def summed(function):
    @kernel
    def total(values):
        result = 0.0
        for k in range(values.size):
            result += function(values[k])
        return result

    return total


def test_functions_of_one_factory_differ_in_name_as_in_what_they_are_made_from():
    double, triple, again = scaled(2.0), scaled(3.0), scaled(2.0)
    assert double.__qualname__ != triple.__qualname__
    assert double is again
    assert summed(double).py_func.__qualname__.startswith("total-")
    assert summed(double)(np.ones(4)) == 8.0
    assert summed(triple)(np.ones(4)) == 12.0


def helper(x):
    return x + 1.0


def calls_helper(x):
    return helper(x)


def test_the_digest_follows_code_that_is_called(monkeypatch):
    before = digest(calls_helper)
    monkeypatch.setitem(globals(), "helper", lambda x: x + 2.0)
    assert digest(calls_helper) != before


def test_the_digest_is_the_same_for_code_just_compiled_and_code_from_a_file(project, tmp_path):
    program = (
        "from ancf_petsc.jit import digest\nfrom ancf_petsc.kernel.choice import kernel_set\n"
        "from ancf_petsc.element.catalog import element\nfrom ancf_petsc.material.models import LAWS\n"
        "from numba.core.serialize import dumps\nimport hashlib\n"
        "for k in kernel_set(element('3843')).kernels(LAWS['svk']):\n"
        "    cells = tuple(c.cell_contents for c in k.loop.py_func.__closure__)\n"
        "    print(k.loop.py_func.__qualname__, hashlib.sha256(dumps(cells)).hexdigest())\n"
    )
    command = [sys.executable, "-X", f"pycache_prefix={tmp_path}", "-c", program]
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": ""}
    said = {
        subprocess.run(command, cwd=project, env=environment, capture_output=True, check=True).stdout
        for _ in range(2)
    }
    assert len(said) == 1
    assert any(tmp_path.iterdir())


def test_a_closure_over_anything_else_is_refused():
    with pytest.raises(TypeError, match="may not be made from a dict"):
        scaled({})


@pytest.mark.parametrize(
    ("code", "flags"),
    [("3413", {}), ("3-10-1-3", {}), ("1222", {}), ("2-6-1-2", {"axisymmetric": True})],
)
def test_the_check_of_info_finds_machine_code_of_another_law(code, flags, monkeypatch, machine_code):
    laws = list(LAWS.values())
    assert selfcheck.wrong_kernels(element(code), laws, mean=True, moving=True, **flags) == []
    if code == "3413":
        assert len(march.signatures) == 1  # compiled once, for all laws
    if element(code).is_beam:
        return  # linear whatever the law
    true_calls = samples.law_calls

    def with_code_of_the_other_law(row, law, **flags):
        other = next(iter(true_calls(row, laws[0], **flags)))
        for number, call in enumerate(true_calls(row, law, **flags)):
            swapped = number == 0 and law is laws[1]
            yield call._replace(kernel=Impostor(call.kernel, other.kernel)) if swapped else call

    monkeypatch.setattr(selfcheck, "law_calls", with_code_of_the_other_law)
    wrong = selfcheck.wrong_kernels(element(code), laws, **flags)
    assert wrong[0].startswith("force_at[neo_hooke_stress]")


class Impostor:
    """The source of one kernel and the machine code of another."""

    def __init__(self, source, code):
        self.py_func, self.code = source.py_func, code

    def __call__(self, *arguments):
        return self.code(*arguments)
