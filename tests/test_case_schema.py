"""The case format: what it takes, what it fills in, and what it says about wrong input."""

import copy
import math
import pickle
import tomllib
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ancf_petsc.errors import CaseError
from ancf_petsc.input import Case, CaseSpec, case_from_dict
from ancf_petsc.input.methods import METHODS

STATICS = {
    "title": "block",
    "mesh": {"file": "block.msh", "element": "3413"},
    "material": {"law": "svk", "young": 6.8e6, "poisson": 0.35},
    "constraint": [
        {"group": "bottom", "fix": ["x", "y", "z"]},
        {"group": "top", "fix": ["x", "y"], "move": {"z": -0.025}, "ramp": "cosine"},
    ],
    "statics": {},
    "output": {"curve": {"force": "top.z", "stroke": "top.z"}},
}
MOTION = {
    "title": "pendulum",
    "mesh": {"file": "pendulum.msh", "element": "3413"},
    "material": {"law": "svk", "young": 2e6, "poisson": 0.3, "density": 7800.0},
    "constraint": [{"group": "hinge", "fix": ["x", "y", "z"]}],
    "load": [{"type": "gravity", "acceleration": [0, 0, -9.81]}],
    "dynamics": {"duration": 1.0, "step": 1e-3},
}


GRAVITY = {"type": "gravity", "acceleration": [0, 0, -9.81]}
DRIVEN = {"group": "hinge", "move": {"z": 1.0}}
RK = {"dynamics.integrator": "runge_kutta_5dp"}


def case(tables: dict, changes: dict | None = None) -> Case:
    return case_from_dict(tables, ".").with_changes(changes or {})


def refusal(tables: dict, changes: dict) -> CaseError:
    """The error of a case with changes: always one line with a cure, always exit code 2."""
    with pytest.raises(CaseError) as caught:
        case(tables, changes)
    error = caught.value
    assert error.exit_code == 2
    assert "\n" not in str(error)
    assert error.file == "case"
    assert error.key
    assert error.cure
    assert error.expected or error.problem
    return error


# --- what the format fills in


def test_defaults_of_statics_are_the_contract_s():
    spec = case(STATICS).spec
    assert (spec.format, spec.units, spec.mesh.duplicates) == (1, "SI", "error")
    assert (spec.statics.steps, spec.statics.tolerance, spec.statics.smallest_step) == (25, 1e-10, 1e-4)
    assert spec.output.symmetry == 1
    assert (spec.load, spec.probe, spec.groups, spec.petsc) == ((), (), {}, {})


def test_in_statics_loads_and_moves_are_linear():
    move = {"constraint": [{"group": "top", "move": {"z": 1}}]}
    force = {"load": [{"type": "force", "group": "top", "total": [0, 0, 1]}]}
    spec = case(STATICS, {**move, **force, "output": None}).spec
    assert spec.constraint[0].ramp == "linear"
    assert spec.load[0].ramp == "linear"


def test_in_motion_loads_are_constant_and_moves_follow_the_cosine():
    spec = case(MOTION, {"constraint": [{"group": "hinge", "move": {"z": 1.0}}]}).spec
    assert spec.constraint[0].ramp == "cosine"
    assert spec.load[0].ramp == "constant"


def test_runge_kutta_5dp_has_the_tolerance_1e_7_unless_a_step_is_given():
    adaptive = case(MOTION, {"dynamics": {"duration": 1.0, "integrator": "runge_kutta_5dp"}}).spec.dynamics
    assert (adaptive.step, adaptive.tolerance) == (None, 1e-7)
    fixed = case(MOTION, {"dynamics.integrator": "runge_kutta_5dp"}).spec.dynamics
    assert (fixed.step, fixed.tolerance) == (1e-3, None)


@pytest.mark.parametrize("name", METHODS)
def test_every_integrator_takes_a_step(name):
    assert case(MOTION, {"dynamics.integrator": name}).spec.dynamics.integrator == name


def test_one_material_table_and_an_array_mean_the_same():
    table = case(STATICS).spec
    array = case({**STATICS, "material": [STATICS["material"]]}).spec
    assert table.material == array.material


def test_directions_split_at_the_last_dot():
    curve = case(STATICS, {"output.curve.force": "upper.face.y"}).spec.output.curve
    assert (curve.force.group, curve.force.axis, curve.force.component) == ("upper.face", "y", 1)


def test_a_single_nearest_point_is_a_list_of_one():
    spec = case(
        STATICS, {"groups": {"a": {"nearest": [1, 0, 0]}, "b": {"nearest": [[1, 0, 0], [2, 0, 0]]}}}
    ).spec
    assert spec.groups["a"].nearest == ((1, 0, 0),)
    assert spec.groups["b"].nearest == ((1, 0, 0), (2, 0, 0))


@pytest.mark.parametrize("damping", [0, 1.5, "critical", {"critical": 6}])
def test_kinds_of_damping(damping):
    taken = case(MOTION, {"dynamics.damping": damping}).spec.dynamics.damping
    assert taken == damping or taken.critical == 6


def test_a_case_travels_between_ranks_by_pickle():
    made = case(
        STATICS, {"probe": [{"name": "tip", "group": "top"}], "petsc": {"ksp_type": "cg", "ksp_rtol": 1e-8}}
    )
    assert pickle.loads(pickle.dumps(made)) == made


def test_the_text_of_a_case_reads_back_as_the_same_case():
    made = case(STATICS, {"groups": {"a b": {"box": [[0, 0, 0], [1, 1, 1]]}}, "title": 'quoted "name"\n'})
    assert case_from_dict(tomllib.loads(made.text), ".").spec == made.spec


# --- what it refuses: the key, and words of the message

BAD_STATICS = [
    ({"material.poisson": 0.5}, "material.poisson", "found 0.5, expected a number in (-1, 0.5)"),
    ({"material.poisson": -1}, "material.poisson", "found -1, expected a number in (-1, 0.5)"),
    ({"material.poisson": math.nan}, "material.poisson", "found nan"),
    ({"material.young": -6.8e6}, "material.young", "expected a number > 0"),
    ({"material.young": 0}, "material.young", "found 0"),
    ({"material.young": math.inf}, "material.young", "found inf"),
    ({"material.young": True}, "material.young", "found True"),
    ({"material.young": "6.8e6"}, "material.young", "found '6.8e6'"),
    ({"material.young": 10**400}, "material.young", "expected a number > 0"),
    ({"material.poison": 0.3}, "material.poison", "did you mean 'poisson'"),
    ({"material.poisson": None, "material.poison": 0.3}, "material.poison", "did you mean 'poisson'"),
    ({"material.law": "neo_hook"}, "material.law", "did you mean 'neo_hooke'"),
    ({"material": None}, "material", "missing"),
    ({"material": []}, "material", "missing"),
    ({"material": 3}, "material", "expected a table [material]"),
    ({"material.density": 0.0}, "material.density", "expected a number > 0"),
    ({"load": [GRAVITY]}, "material.density", "because of gravity"),
    ({"load": [{**GRAVITY, "acceleration": [0, 0]}]}, "load.0.acceleration", "expected three numbers"),
    ({"load": [{"type": "gravty"}]}, "load.0.type", "did you mean 'gravity'"),
    ({"load": [{"group": "top"}]}, "load.top.type", "missing"),
    ({"load": {"type": "gravity"}}, "load", "write [[load]]"),
    ({"load": [{"type": "force", "group": "top", "totl": [0]}]}, "load.top.totl", "did you mean 'total'"),
    ({"title": None}, "title", "missing"),
    ({"titel": "x"}, "titel", "did you mean 'title'"),
    ({"format": 2}, "format", "this program reads format 1"),
    ({"mesh": {"element": "3413"}}, "mesh.file", "missing"),
    ({"mesh.body": "cube"}, "mesh.body", "file and body given"),
    ({"mesh.size": 0.01}, "mesh.size", "body = ... with it"),
    ({"mesh": {"element": "3413", "body": "cube", "size": 0.0}}, "mesh.size", "a number > 0"),
    ({"mesh": {"element": "3413", "body": "cube", "divisions": [2, 2]}}, "mesh.divisions", "three whole numbers"),
    ({"mesh": {"element": "3413", "body": "cube", "divisions": [2, 2, 0]}}, "mesh.divisions", "three whole numbers"),
    ({"mesh.refine": -1}, "mesh.refine", "from 0 to 8"),
    ({"mesh.refine": 1.5}, "mesh.refine", "a whole number"),
    ({"mesh.element": 3413}, "mesh.element", "in quotes"),
    ({"mesh.element": "tetra"}, "mesh.element", "a code of the catalogue"),
    ({"mesh.duplicates": "mrege"}, "mesh.duplicates", "did you mean 'merge'"),
    ({"mesh.rule": "redced"}, "mesh.rule", "did you mean 'reduced'"),
    ({"groups": {"end": {"plane": "x"}}}, "groups.end.at", "plane and at together"),
    ({"groups": {"end": {}}}, "groups.end", "exactly one of plane, box, nearest, union"),
    ({"groups": {"end": {"plane": "x", "at": 0, "union": ["top"]}}}, "groups.end", "plane and union given"),
    ({"groups": {"end": {"plane": "w", "at": 0}}}, "groups.end.plane", 'an axis "x", "y", "z" or a normal'),
    ({"groups": {"end": {"plane": [0, 0, 0], "at": 0}}}, "groups.end.plane", "a normal with a length"),
    ({"groups": {"end": {"plane": "x", "at": "top"}}}, "groups.end.at", "found 'top'"),
    ({"groups": {"end": {"box": [[0, 0, 0], [1, 1]]}}}, "groups.end.box", "two corners"),
    ({"groups": {"end": {"nearest": []}}}, "groups.end.nearest", "a list of points"),
    ({"groups": {"end": {"union": ["top", "end"]}}}, "groups.end.union", "the group contains itself"),
    ({"groups": {"at": {"plain": "x"}}}, "groups.at.plain", "did you mean 'plane'"),
    ({"constraint.bottom.fix": []}, "constraint.bottom", "neither fix nor move nor slopes"),
    ({"constraint.bottom.slopes": ["z"]}, "constraint.bottom.slopes", "element 3413 has no slopes"),
    ({"constraint.bottom.fix": ["w"]}, "constraint.bottom.fix", "found ['w']"),
    ({"constraint.bottom.fix": ["x", "x"]}, "constraint.bottom.fix", "'x' twice"),
    ({"constraint.bottom.fix": "x"}, "constraint.bottom.fix", 'such as ["x", "y"]'),
    ({"constraint.top.fix": ["z"]}, "constraint.top.move", "z is fixed and moved"),
    ({"constraint.top.move": {"w": 1.0}}, "constraint.top.move.w", "one of x, y, z"),
    ({"constraint.top.move": {"z": "far"}}, "constraint.top.move.z", "found 'far'"),
    ({"constraint.top.ramp": "cosin"}, "constraint.top.ramp", "did you mean 'cosine'"),
    ({"constraint.top.ramp": [[0, 0]]}, "constraint.top.ramp", "at least two rows"),
    ({"constraint.top.ramp": [[0, 0], [0.5, 1], [0.5, 0]]}, "constraint.top.ramp", "found [0, 0.5, 0.5]"),
    ({"constraint.top.ramp": [[0, 0], [2, 1]]}, "constraint.top.ramp", "within [0, 1]"),
    ({"constraint.top.ramp": [[0, 0], [1, math.nan]]}, "constraint.top.ramp", "nan"),
    ({"statics": None}, "statics", "neither [statics] nor [dynamics] given"),
    ({"dynamics": {"duration": 1.0, "step": 0.1}}, "dynamics", "exactly one of them"),
    ({"statics.steps": 0}, "statics.steps", "a whole number >= 1"),
    ({"statics.steps": 2.5}, "statics.steps", "found 2.5"),
    ({"statics": {"steps": 2, "times": [1.0]}}, "statics.times", "steps and times given"),
    ({"statics": {"times": [0.5, 1.5]}}, "statics.times", "numbers in (0, 1]"),
    ({"statics": {"times": [0.5, 0.5]}}, "statics.times", "numbers that rise"),
    ({"statics": {"strokes": [0.01, -0.02]}}, "statics.strokes", "numbers > 0"),
    ({"statics": {"strokes": [0.01, 0.03]}}, "statics.strokes", "at most 0.025"),
    ({"statics": {"strokes": [0.01]}, "output": None}, "output.curve", "missing"),
    ({"statics": {"strokes": [1]}, "output.curve.stroke": "top.x"}, "statics.strokes", "moves 'top' in x"),
    ({"statics.tolerance": 0}, "statics.tolerance", "a number in (0, 1)"),
    ({"initial": {"velocity": [1, 0, 0]}}, "initial", "[initial] without [dynamics]"),
    ({"output.curve.force": "top"}, "output.curve.force", '"group.axis"'),
    ({"output.curve.force": None}, "output.curve.force", "missing"),
    ({"output.symmetry": 0}, "output.symmetry", "a number > 0"),
    ({"output.symetry": 4}, "output.symetry", "did you mean 'symmetry'"),
    ({"probe": [{"name": "a", "group": "top"}] * 2}, "probe.1.name", "a second probe of this name"),
    ({"petsc": {"ksp_type": ["cg"]}}, "petsc.ksp_type", "an option with its value"),
    ({"petsc": {"-ksp_type": "cg"}}, "petsc.-ksp_type", "write ksp_type"),
    ({"section": {"thickness": 0.1}}, "section.thickness", "no [section] for element 3413"),
    ({"mesh.element": "2412"}, "section.thickness", "missing"),
]  # fmt: skip

BAD_MOTION = [
    ({"material.density": None}, "material.density", "missing"),
    ({"dynamics.step": -1e-3}, "dynamics.step", "found -0.001, expected a number > 0"),
    ({"dynamics.duration": -1.0}, "dynamics.duration", "found -1.0"),
    ({"dynamics.duration": None}, "dynamics.duration", "missing"),
    ({"dynamics.integrator": "bfd"}, "dynamics.integrator", "did you mean 'bdf'"),
    ({"dynamics.integrator": "newmark"}, "dynamics.integrator", ", ".join(METHODS)),
    ({**RK, "dynamics.tolerance": 1e-7}, "dynamics.tolerance", "step and tolerance given"),
    ({"dynamics.step": None}, "dynamics.step", "a step for generalized_alpha"),
    ({"dynamics.step": None, "dynamics.tolerance": 0.1}, "dynamics.tolerance", "does not adapt it"),
    ({"dynamics.integrator": "bdf", "dynamics.order": 3}, "dynamics.order", "above 2 are unstable"),
    ({"dynamics.order": 1}, "dynamics.order", 'integrator = "bdf"'),
    ({"dynamics.spectral_radius": 1.1}, "dynamics.spectral_radius", "a number in [0, 1]"),
    ({"dynamics.integrator": "theta", "dynamics.theta": 0.4}, "dynamics.theta", "a number in [0.5, 1]"),
    ({"dynamics.outputs": 0}, "dynamics.outputs", "a whole number >= 1"),
    ({"dynamics.mass": "lumpd"}, "dynamics.mass", "did you mean 'lumped'"),
    ({"dynamics.damping": -1}, "dynamics.damping", "found -1"),
    ({"dynamics.damping": "much"}, "dynamics.damping", '"critical" or { critical = n }'),
    ({"dynamics.damping": {"critical": 0}}, "dynamics.damping", "found {'critical': 0}"),
    ({"initial": {"centre": "middle"}}, "initial.centre", '"mass" or a point'),
    ({"initial": {"spin": 3.0}}, "initial.spin", "three numbers"),
    ({"constraint": [{**DRIVEN, "ramp": "constant"}]}, "constraint.hinge.ramp", "infinite acceleration"),
    ({"constraint": [{**DRIVEN, "ramp": [[0, 1], [1, 1]]}]}, "constraint.hinge.ramp", "a jump at t = 0"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "key", "words"), BAD_STATICS, ids=lambda value: str(value)[:60])
def test_refuses_in_statics(changes, key, words):
    error = refusal(STATICS, changes)
    assert error.key == key
    assert words in str(error)


@pytest.mark.parametrize(("changes", "key", "words"), BAD_MOTION, ids=lambda value: str(value)[:60])
def test_refuses_in_motion(changes, key, words):
    error = refusal(MOTION, changes)
    assert error.key == key
    assert words in str(error)


def test_materials_name_the_one_that_lacks_a_density():
    steel = {"group": "steel", "law": "svk", "young": 2e11, "poisson": 0.3}
    rest = {**MOTION["material"]}
    assert refusal({**MOTION, "material": [rest, steel]}, {}).key == "material.steel.density"


def test_only_one_material_may_be_without_a_group():
    error = refusal({**STATICS, "material": [STATICS["material"]] * 2}, {})
    assert error.key == "material.1.group"
    assert "a second material without group" in str(error)


def test_entries_that_share_a_group_are_named_by_their_index():
    twice = [{"group": "top", "fix": ["x"]}, {"group": "top", "fix": ["w"]}]
    assert refusal(STATICS, {"constraint": twice}).key == "constraint.1.fix"


def test_further_problems_are_counted():
    error = refusal(STATICS, {"material.young": -1.0, "material.poisson": 0.7, "statics.steps": 0})
    assert error.key == "material.young"
    assert str(error).endswith("(and 2 more)")


def test_values_too_long_for_a_line_are_cut():
    assert len(str(refusal(STATICS, {"material.law": "x" * 10_000}))) < 500


# --- nothing but a case or a CaseError comes out

values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.sampled_from(["x", "svk", "top"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
words = st.sampled_from(
    ["", ".x", ".0", ".top", ".top.move", ".top.ramp", ".plane", ".type", ".curve", ".file"]
)


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(sorted(CaseSpec.model_fields)), words, values)
def test_any_value_anywhere_gives_a_case_or_a_case_error(table, inner, value):
    tables = {**copy.deepcopy(STATICS), "load": [{"type": "force", "group": "top", "total": [0, 0, 1]}]}
    with suppress(CaseError):
        case(tables, {table + inner: value})


# --- control and bifurcations of statics


FORCED = {**STATICS, "load": [{"type": "force", "group": "top", "total": [0, 0, -1]}], "output": {}}
FORCED["constraint"] = STATICS["constraint"][:1]


def test_paths_by_load_report_bifurcations_unless_asked():
    assert (case(STATICS).spec.statics.control, case(STATICS).spec.statics.on_bifurcation) == (
        "load",
        "report",
    )
    spec = case(FORCED, {"statics.control": "arc_length", "statics.on_bifurcation": "stop"}).spec
    assert (spec.statics.control, spec.statics.on_bifurcation) == ("arc_length", "stop")


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"statics.control": "arclength"}, "statics.control", "did you mean 'arc_length'"),
        ({"statics.on_bifurcation": "folow"}, "statics.on_bifurcation", "did you mean 'follow'"),
        ({"statics.on_bifurcation": True}, "statics.on_bifurcation", "report"),
        ({"statics.on_bifurcatoin": "stop"}, "statics.on_bifurcatoin", "did you mean 'on_bifurcation'"),
        (
            {"statics.control": "arc_length", "statics.on_bifurcation": "follow"},
            "statics.on_bifurcation",
            'control = "load" follows',
        ),
        (
            {"statics.control": "arc_length", "load.0.ramp": "cosine"},
            "load.top.ramp",
            '"linear" or "constant"',
        ),
        (
            {"statics.control": "arc_length", "load.0.ramp": ((0, 0), (1, 1))},
            "load.top.ramp",
            'ramp = "linear"',
        ),
        ({"statics.control": "arc_length", "load.0.ramp": "constant"}, "statics.control", "linear"),
        ({"statics.control": "arc_length", "load": ()}, "statics.control", "linear"),
    ],
)
def test_wrong_controls_of_statics_are_refused(changes, key, words):
    error = refusal(FORCED, changes)
    assert error.key == key
    assert words in str(error)
