"""Reading cases from files, changing them by --set, and writing them back."""

import subprocess
import sys
import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ancf_petsc.errors import CaseError
from ancf_petsc.input import load_case, toml
from ancf_petsc.input.overrides import petsc_table
from ancf_petsc.plan.case_mesh import mesh_file

TEXT = """\
title = "block"

[mesh]
file = "../meshes/block.msh"
element = "3413"

[material]
law = "svk"
young = 6.8e6
poisson = 0.35

[[constraint]]
group = "bottom"
fix = ["x", "y", "z"]

[[constraint]]
group = "top"
fix = ["x", "y"]
move = { z = -0.025 }

[[probe]]
name = "tip"
group = "top"

[statics]
steps = 4
"""


@pytest.fixture
def folder(tmp_path):
    home = tmp_path / "cases" / "block"
    home.mkdir(parents=True)
    (home / "case.toml").write_text(TEXT)
    return home


def refusal(*arguments, **keywords) -> CaseError:
    with pytest.raises(CaseError) as caught:
        load_case(*arguments, **keywords)
    assert "\n" not in str(caught.value)
    return caught.value


def test_folder_and_file_are_the_same_case(folder):
    assert load_case(folder) == load_case(folder / "case.toml")


def test_name_folder_and_mesh_file(folder):
    case = load_case(folder)
    assert case.name == "block"
    assert case.folder == folder
    assert mesh_file(case) == folder.parent / "meshes" / "block.msh"
    (folder / "soft.toml").write_text(TEXT)
    assert load_case(folder / "soft.toml").name == "soft"


def test_a_missing_case_names_the_nearest_one(folder):
    error = refusal(folder.parent / "blok")
    assert error.file == folder.parent / "blok"
    assert f"did you mean {str(folder)!r}" in str(error)


def test_a_folder_without_a_case_lists_its_toml_files(folder):
    (folder / "case.toml").rename(folder / "soft.toml")
    error = refusal(folder)
    assert "no case.toml in this folder" in str(error)
    assert "soft.toml" in error.cure


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ("title = \n", "line 1, column 9", "invalid value"),
        ("title = 'a'\ntitle = 'b'\n", "line 2", "overwrite"),
        ("[mesh\n", "line 1", "expected ']'"),
    ],
)
def test_broken_toml_is_told_with_line_and_column(folder, text, where, what):
    (folder / "case.toml").write_text(text)
    error = refusal(folder)
    assert str(error.file) == str(folder / "case.toml")
    assert error.key.startswith(where)
    assert what in str(error)


def test_binary_and_unreadable_files_are_told(folder):
    (folder / "case.toml").write_bytes(b"\xff\xfe\x00")
    assert "not UTF-8" in str(refusal(folder))


def test_deeply_nested_brackets_are_told(folder):
    (folder / "case.toml").write_text("a = " + "[" * 5000)
    assert "not valid TOML" in str(refusal(folder))


@pytest.mark.parametrize(
    ("setting", "read", "value"),
    [
        ("material.law=neo_hooke", lambda s: s.material[0].law, "neo_hooke"),
        ('material.law="neo_hooke"', lambda s: s.material[0].law, "neo_hooke"),
        ("constraint.bottom.fix=['z']", lambda s: s.constraint[0].fix, ("z",)),
        ("constraint.top.fix=[]", lambda s: s.constraint[1].fix, ()),
        ("constraint.1.move={ z = 0.5 }", lambda s: s.constraint[1].move, {"z": 0.5}),
        ("constraint.top.move.z = 0.5", lambda s: s.constraint[1].move["z"], 0.5),
        ("probe.tip.mean=area", lambda s: s.probe[0].mean, "area"),
        ("statics.tolerance=1e-8", lambda s: s.statics.tolerance, 1e-8),
        ("petsc.ksp_type=cg", lambda s: s.petsc["ksp_type"], "cg"),
        ("output.symmetry=4", lambda s: s.output.symmetry, 4),
        ("mesh.element=3813", lambda s: s.mesh.element, "3813"),
        ("mesh.element=3-10-1-3", lambda s: s.mesh.element, "3-10-1-3"),
        ("mesh.file=../a b=c.msh", lambda s: s.mesh.file, "../a b=c.msh"),
        ('groups."a b".plane=x', lambda s: s.groups["a b"].plane, "x"),
        ("title=2026", lambda s: s.title, "2026"),
    ],
)
def test_set_changes_one_value(folder, setting, read, value):
    settings = [setting]
    if "groups" in setting:
        settings.append('groups."a b".at=min')
    case = load_case(folder, settings)
    assert read(case.spec) == value
    assert tomllib.loads(case.text) != tomllib.loads(TEXT)


@pytest.mark.parametrize(
    ("setting", "key", "words"),
    [
        ("matrial.law=svk", "matrial", "did you mean 'material'"),
        ("material.lw=svk", "material.lw", "did you mean 'law'"),
        ("constraint.tpo.fix=[]", "constraint.tpo", "did you mean 'top'"),
        ("constraint.7.fix=[]", "constraint.7", "index from 0 to 1"),
        ("load.top.total=[0,0,1]", "load", "the case has none"),
        ("title.a=1", "title", "is no table"),
        ("material.poisson=0.5", "material.poisson", "found 0.5"),
        ("constraint.top.fix=[", "constraint.top.fix", "a TOML value"),
        ("material.yuong=", "material.yuong", "did you mean 'young'"),
        ("constraint.tpo=", "constraint.tpo", "did you mean 'top'"),
        ("title.a=", "title.a", "nothing to remove"),
        ("material.density=", "material.density", "nothing to remove: the case has no such key"),
        ("material.young=", "material.young", "missing"),
    ],
)
def test_set_refuses(folder, setting, key, words):
    error = refusal(folder, [setting])
    assert error.key == key
    assert words in str(error)
    assert "--set" in str(error)


def test_set_without_a_value_removes(folder):
    """Keys, tables and entries of arrays: so one integrator replaces another that has other keys."""
    spec = load_case(
        folder, ["statics.steps=7", "constraint.bottom.fix=", "constraint.bottom.move={z=0}"]
    ).spec
    assert spec.constraint[0].fix == ()
    spec = load_case(folder, ["constraint.top="]).spec
    assert [one.group for one in spec.constraint] == ["bottom"]
    motion = ["statics=", "material.density=1", "dynamics={duration=1, integrator='bdf', step=0.1, order=2}"]
    spec = load_case(
        folder, [*motion, "dynamics.integrator=runge_kutta_5dp", "dynamics.step=", "dynamics.order="]
    ).spec
    assert spec.statics is None
    assert (spec.dynamics.integrator, spec.dynamics.step) == ("runge_kutta_5dp", None)
    assert load_case(folder, ["note=''", "note="]).spec.note == ""


def test_nul_characters_are_refused_wherever_they_stand(folder):
    for change in (
        'title="a\\u0000b"',
        'mesh.file="a\\u0000.msh"',
        'groups={ "a\\u0000" = { plane = "z", at = 0 } }',
    ):
        error = refusal(folder, [change])
        assert "a NUL character" in str(error)
        assert error.key.startswith(change[:4])
    with pytest.raises(CaseError, match="a NUL character in a path"):
        load_case("a\0b")


@pytest.mark.parametrize("setting", ["material.law", "=3", "", ".law=svk", "material.=svk"])
def test_a_setting_without_key_or_value_is_told(folder, setting):
    assert "--set" in str(refusal(folder, [setting]))


def test_entries_that_share_a_group_want_the_index(folder):
    more = '\n[[constraint]]\ngroup = "top"\nfix = ["x"]\n'
    (folder / "case.toml").write_text(TEXT + more)
    error = refusal(folder, ["constraint.top.fix=[]"])
    assert error.key == "constraint.top"
    assert error.cure == "use the index: 1 or 2"
    assert load_case(folder, ["constraint.2.fix=['y']"]).spec.constraint[2].fix == ("y",)


def test_the_key_of_a_message_is_what_set_takes(folder):
    more = '\n[[constraint]]\ngroup = "upper.face"\nfix = ["w"]\n'
    (folder / "case.toml").write_text(TEXT + more)
    key = refusal(folder).key
    assert key == 'constraint."upper.face".fix'
    assert load_case(folder, [f"{key}=['x']"]).spec.constraint[2].fix == ("x",)


def test_options_of_the_command_line_are_stronger_than_the_file(folder):
    (folder / "case.toml").write_text(TEXT + '\n[petsc]\nksp_type = "cg"\nksp_rtol = 1e-8\n')
    spec = load_case(folder, petsc_options=["-ksp_type", "preonly", "-snes_monitor"]).spec
    assert spec.petsc == {"ksp_type": "preonly", "ksp_rtol": 1e-8, "snes_monitor": True}


def test_negative_numbers_are_values_of_options():
    assert petsc_table(["-a", "-1.5", "-b", "-.5", "-c"]) == {"a": "-1.5", "b": "-.5", "c": True}
    with pytest.raises(CaseError, match="expected PETSc options"):
        petsc_table(["cg"])


def test_changes_by_a_script_make_a_new_case(folder):
    case = load_case(folder)
    changed = case.with_changes({"material.law": "neo_hooke", "statics.steps": None})
    assert (changed.spec.material[0].law, changed.spec.statics.steps) == ("neo_hooke", 25)
    assert case.spec.material[0].law == "svk"
    assert changed.name == case.name


scalars = st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False) | st.text(max_size=8)
nested = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=3),
    max_leaves=8,
)


@settings(max_examples=200, deadline=None)
@given(st.dictionaries(st.text(max_size=6), nested, max_size=5))
def test_what_is_written_reads_back_the_same(tables):
    assert tomllib.loads(toml.write(tables)) == tables


def test_reading_a_case_imports_no_numerics():
    heavy = "{'numpy', 'numba', 'mpi4py', 'petsc4py', 'gmsh', 'rich'} & set(sys.modules)"
    code = f"import sys, ancf_petsc.input.load, ancf_petsc.log, ancf_petsc.cli; print({heavy} or 'none')"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "none"
    )
