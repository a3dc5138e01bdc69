"""The walks of CONTRIBUTING.md: what a newcomer would add is added as it stands there, and computes."""

import inspect
import sys
from itertools import product
from types import ModuleType
from typing import Annotated

import numba
import numpy as np
import pytest
import test_element_rank
import test_element_shape
import test_family_dynamics
import test_family_orders
import test_kernel_generic
from element_cells import SHAPES
from mpi4py import MPI
from pydantic import Field, create_model
from tiny_meshes import quadratic_bricks

import ancf_petsc
from ancf_petsc import case_from_dict, cli, load_case, run
from ancf_petsc.analysis.build import build
from ancf_petsc.element import catalog
from ancf_petsc.element.element import Element
from ancf_petsc.errors import CaseError
from ancf_petsc.input import analysis, load, loads, methods, schema
from ancf_petsc.material import models
from ancf_petsc.mesh.generate import make_mesh
from ancf_petsc.plan import loads as plan_loads
from ancf_petsc.plan import supports


def code_of(project, heading, block=0):
    """A Python block under a heading of CONTRIBUTING.md."""
    text = (project / "CONTRIBUTING.md").read_text(encoding="utf-8")
    section = text.split(f"## {heading}\n")[1].split("\n## ")[0]
    return section.split("```python\n")[1 + block].split("```")[0]


@pytest.fixture
def new_element(project, monkeypatch):
    """The row of the guide, in the catalogue; its code."""
    row = eval(code_of(project, "Add an element"), {"Element": Element})
    monkeypatch.setitem(catalog.ELEMENTS, row.code, row)
    monkeypatch.setitem(test_family_orders.LADDERS, row.code, (2, 4, 2 * row.complete))
    catalog.element.cache_clear()
    yield row.code
    catalog.element.cache_clear()


HOMES = (test_element_shape, test_element_rank, test_kernel_generic, test_family_orders, test_family_dynamics)
RULES = ("default", "exact")
CHOICES = {
    "shape": SHAPES,
    "law": tuple(models.LAWS.values()),
    "name": RULES,
    "quadrature": RULES,
    "rule": RULES,
}


def property_tests():
    """The tests of other files that take the code of an element, and beside it what CHOICES has."""
    for home in HOMES:
        for name, function in inspect.getmembers(home, inspect.isfunction):
            taken = set(inspect.signature(function).parameters)
            if name.startswith("test_") and "code" in taken and taken <= {"code", "tmp_path", *CHOICES}:
                yield pytest.param(function, id=f"{home.__name__}::{name}")


@pytest.mark.parametrize("function", list(property_tests()))
def test_all_that_elements_must_do_the_new_one_does(function, new_element, tmp_path):
    """Whatever the tests of the catalogue ask, with every cell, law and quadrature they ask it for."""
    taken = inspect.signature(function).parameters
    keys = [key for key in CHOICES if key in taken]
    by_name = function is test_family_dynamics.test_energy_and_momenta_of_a_free_body_stay
    for number, chosen in enumerate(product(*(CHOICES[key] for key in keys))):
        values = dict(zip(keys, chosen, strict=True))
        if by_name:
            values["law"] = values["law"].name
        if "tmp_path" in taken:
            values["tmp_path"] = tmp_path / str(number)
            values["tmp_path"].mkdir()
        function(code=new_element, **values)


def test_the_properties_are_found():
    """A renamed parameter would leave a test out."""
    assert {param.values[0].__module__ for param in property_tests()} == {home.__name__ for home in HOMES}
    assert len(list(property_tests())) >= 15


def test_the_new_element_runs_in_the_program(new_element, tmp_path):
    """A beam under its own weight: reactions carry it, it sags as Euler and Bernoulli say, mid-nodes made or read."""
    linear = make_mesh("cantilever", tmp_path / "bar.msh", divisions=(8, 1, 1), hexahedra=True)
    ends = []
    for mesh in (linear, quadratic_bricks(tmp_path, body="cantilever", divisions=(8, 1, 1))):
        data = {
            "title": "Bar",
            "mesh": {"file": str(mesh), "element": new_element},
            "material": {"law": "svk", "young": 1e7, "poisson": 0.3, "density": 1000.0},
            "constraint": [{"group": "clamp", "fix": ["x", "y", "z"]}],
            "load": [{"type": "gravity", "acceleration": [0.0, 0.0, -1.0]}],
            "statics": {"steps": 1},
            "probe": [{"name": "end", "group": "end", "mean": "area"}],
        }
        results = run(case_from_dict(data, tmp_path), tmp_path / f"run of {mesh.stem}")
        assert results.curve["clamp.rz"][-1] == pytest.approx(10.0, rel=1e-9)
        assert results.kind == "hexahedron20"
        ends.append(results.probes["end.uz"][-1])
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)
    # Euler and Bernoulli: q L^4 / (8 E I); shear adds 1 %, coarse cells and the clamp take some.
    assert ends[0] == pytest.approx(-10 / (8 * 1e7 * 0.1**4 / 12), rel=0.05)


def test_a_material_is_a_block(project, monkeypatch):
    """As machine code: P is the derivative of the energy and A that of P; no stress at F = I. Cases may ask for it."""
    monkeypatch.setattr(models, "LAWS", dict(models.LAWS))
    exec(code_of(project, "Add a material"), {**vars(models), "LAWS": models.LAWS})
    law = models.LAWS["ciarlet"]
    load_case(project / "cases/pvc_block", ["material.law=ciarlet"])
    energy, stress, tangent = (numba.njit(f) for f in (law.energy, law.stress, law.tangent))
    p = law.parameters(1.0, 0.3)
    F = np.eye(3) + 0.2 * np.random.default_rng(7).normal(size=(3, 3))
    P = np.reshape(stress(tuple(F.ravel()), p), (3, 3))
    unit, h = np.eye(3), 1e-6
    for k, L in np.ndindex(3, 3):
        step = h * np.outer(unit[k], unit[L])
        ahead, behind = tuple((F + step).ravel()), tuple((F - step).ravel())
        # Central differences: h² of truncation and 1e-16 / h of rounding, with factors of the law below 100.
        assert P[k, L] == pytest.approx((energy(ahead, p) - energy(behind, p)) / (2 * h), abs=1e-8)
        slope = (np.array(stress(ahead, p)) - np.array(stress(behind, p))).reshape(3, 3) / (2 * h)
        for J in range(3):
            block = np.reshape(tangent(tuple(F.ravel()), tuple(unit[J]), tuple(unit[L]), p), (3, 3))
            np.testing.assert_allclose(block[:, k], slope[:, J], rtol=0, atol=1e-8)
    assert np.abs(stress(tuple(np.eye(3).ravel()), p)).max() == 0.0


def model_of(folder, element, **tables):
    """The model of a bar held at one end."""
    mesh = make_mesh("bar", folder / "bar.msh", divisions=(2, 2, 1), hexahedra=element != "3413")
    data = {
        "title": "bar",
        "mesh": {"file": mesh.name, "element": element},
        "material": {"law": "svk", "young": 1e7, "poisson": 0.3},
        "constraint": [{"group": "bottom", "fix": ["x", "y", "z"]}],
        "statics": {},
        **tables,
    }
    return build(case_from_dict(data, folder), MPI.COMM_SELF).model


def change_cases(monkeypatch, **keys):
    """Let cases have other keys than those of the schema."""
    changed = create_model("CaseSpec", __base__=schema.CaseSpec, **keys)
    monkeypatch.setattr(load, "CaseSpec", changed)


def test_a_load_is_a_table_of_keys_and_a_file(project, monkeypatch, tmp_path):
    """A traction is the force of traction times area, 0.1 x 0.1 m being its end."""
    names = dict(vars(loads))
    exec(code_of(project, "Add a load"), names)
    types = loads.Types | names["TractionSpec"]
    change_cases(monkeypatch, load=(tuple[Annotated[types, Field(discriminator="type")], ...], ()))
    module = ModuleType("traction")
    exec(code_of(project, "Add a load", 1), vars(module))
    monkeypatch.setitem(plan_loads.KINDS, "traction", module)
    for element in ("3413", "3843"):
        found, expected = (
            model_of(tmp_path, element, load=[{"group": "top", **load}]).loads[0].pattern
            for load in (
                {"type": "traction", "value": [0.0, 2.0, -3.0]},
                {"type": "force", "total": [0.0, 0.02, -0.03]},
            )
        )
        np.testing.assert_allclose(found, expected, atol=1e-15)
        assert found.any()
    tables = {"groups": {"tip": {"nearest": [0.0, 0.0, 0.5]}}}
    tables["load"] = [{"type": "traction", "group": "tip", "value": [1.0, 0.0, 0.0]}]
    with pytest.raises(CaseError, match=r"load\.0\.group: no surface: found 'tip', expected boundary faces"):
        model_of(tmp_path, "3413", **tables)


def test_a_support_is_a_key_and_a_file(project, monkeypatch, tmp_path):
    """A clamp is what `fix` and `slopes` of all axes hold together."""
    names = {"key": schema.key, "ConstraintSpec": schema.ConstraintSpec}
    line = code_of(project, "Add a support")
    exec("class Clamped(ConstraintSpec):\n    " + line, names)
    clamped = names["Clamped"]
    change_cases(monkeypatch, constraint=(tuple[clamped, ...], ()))
    module = ModuleType("clamp")
    exec(code_of(project, "Add a support", 1), vars(module))
    monkeypatch.setattr(supports, "KINDS", [*supports.KINDS, module.enter])
    axes = ["x", "y", "z"]
    for element in ("3413", "3843"):
        by_keys = {"group": "bottom", "fix": axes, **({"slopes": axes} if element == "3843" else {})}
        found, expected = (
            model_of(tmp_path, element, constraint=[row]).drive
            for row in ({"group": "bottom", "clamp": True}, by_keys)
        )
        np.testing.assert_array_equal(found, expected)
        assert (found >= 0).any()


def test_an_integrator_is_a_file_and_a_line(project, monkeypatch, tmp_path):
    """Twice the steps, a quarter of the error, for a pendulum whose weight comes smoothly."""
    module = ModuleType(f"{methods.HOME}.midpoint")
    exec(code_of(project, "Add an integrator"), vars(module))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setitem(methods.METHODS, "midpoint", methods.Method("midpoint", "midpoint.Midpoint"))
    pendulum, heights = load_case(project / "cases/pendulum"), []
    for steps in (50, 100, 200):
        motion = {"integrator": "midpoint", "duration": 0.5, "step": 0.5 / steps, "outputs": 1}
        case = pendulum.with_changes({"dynamics": motion, "load.0.ramp": "cosine"})
        heights.append(run(case, tmp_path / str(steps)).probes["tip.z"][-1])
    first, second = np.diff(heights)
    assert first / second == pytest.approx(4.0, rel=0.1)


def test_a_key_of_an_integrator_s_own_is_in_its_line(project, monkeypatch):
    option = methods.Option("blend", "a number in [0, 1]; such as 0.5", 0.5, 0, 1)
    row = methods.Method("midpoint", "midpoint.Midpoint", option=option)
    monkeypatch.setitem(methods.METHODS, "midpoint", row)
    dynamics = create_model("Dynamics", __base__=schema.DynamicsSpec, **analysis.own_keys())
    change_cases(monkeypatch, dynamics=(dynamics, None))
    case = load_case(project / "cases/pendulum")
    asked = {"integrator": "midpoint", "duration": 0.5, "step": 0.01}
    assert case.with_changes({"dynamics": asked}).spec.dynamics.option == 0.5
    assert case.with_changes({"dynamics": {**asked, "blend": 0.75}}).spec.dynamics.option == 0.75
    with pytest.raises(
        CaseError, match=r"dynamics\.blend: found 2.0, expected a number in \[0, 1\]; such as"
    ):
        case.with_changes({"dynamics": {**asked, "blend": 2.0}})
    with pytest.raises(CaseError, match='blend: theta does not read it.*integrator = "midpoint" with it'):
        case.with_changes({"dynamics": {**asked, "integrator": "theta", "blend": 0.75}})


def test_a_verb_is_a_file_and_a_line(project, monkeypatch, capsys):
    module = ModuleType("ancf_petsc.cli.volume")
    exec(code_of(project, "Add a verb"), vars(module))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.setitem(cli.VERBS, "volume", (module.__name__, module.HELP))
    assert cli.main(["volume", str(project / "meshes" / "bar_2x2x10.msh")]) == 0
    # The bar of 0.5 x 0.1 x 0.1 m; rounding of 240 volumes.
    assert float(capsys.readouterr().out) == pytest.approx(0.005, rel=1e-13)


def test_a_study_is_a_file(project, tmp_path):
    text = (project / "CONTRIBUTING.md").read_text(encoding="utf-8")
    study = text.split("## Add a study\n")[1].split("```toml\n")[1].split("```")[0]
    assert study.count('case = "statics.toml"') == 1
    base = (project / "cases/bar_tension/statics.toml").as_posix()
    (tmp_path / "study_poisson.toml").write_text(study.replace("statics.toml", base))
    outcome = ancf_petsc.study(tmp_path / "study_poisson.toml", tmp_path / "out", jobs=1)
    # Without lateral strain the clamped face holds less: nu = 0.3 is stiffer, by less than its confined modulus, 1.35.
    soft, stiff = outcome.table["end"]
    assert soft < stiff < soft / 1.35
    assert (tmp_path / "out/charts/values_end.png").is_file()
