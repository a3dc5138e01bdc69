"""Every element at rest and in motion on 1, 2 and 3 ranks: the same tables, fields and drawings."""

import json

import numpy as np
import pytest
from family import SECTION, cantilever, mesh_of, motion
from rings import disc
from test_normal_support import eighth, turn_of

from ancf_petsc import open_results

RUNNER = """
import json, sys
from pathlib import Path
from ancf_petsc import case_from_dict, run
for name, data in json.loads(Path(sys.argv[1]).read_text()).items():
    run(case_from_dict(data, Path(".")), Path(sys.argv[2]) / name)
"""
BEAM = {"area": 0.01, "inertia": 1e-5}


def at_rest(code, law, folder):
    """A clamped beam bent by a traction and its weight; its outer half is twice as stiff."""
    data = cantilever(mesh_of("cantilever", code, (6, 1, 1), folder), code)
    data["load"].append({"type": "gravity", "acceleration": [0.0, 0.0, -1.0]})
    data["groups"] = {"outer": {"box": [[0.5, 0.0, 0.0], [1.0, 0.1, 0.1]]}}
    whole = data["material"] | {"law": law}
    data["material"] = [whole, whole | {"group": "outer", "young": 2e7}]
    return data


def in_motion(code, law, folder, **dynamics):
    """The pendulum of six cells, falling for a twentieth of a second."""
    data = motion(mesh_of("pendulum", code, (6, 1, 1), folder), code, 0.05, **dynamics)
    data["material"]["law"] = law
    data["dynamics"]["outputs"] = 2
    if code[0] == "2":
        data["section"] = SECTION | {"plane": "strain" if law == "neo_hooke" else "stress"}
        data["constraint"][0]["fix"] = ["x", "z"]
    if code[0] == "1":
        data["section"] = BEAM
        data["groups"] = {"hinge": {"plane": "x", "at": "min"}}
        data["constraint"][0] = {"group": "hinge", "fix": ["x", "z"], "slopes": ["z"]}
    return data


def cases(folder):
    mean = {"integrator": "energy_momentum", "step": 0.005}
    alpha = {"integrator": "generalized_alpha", "step": 0.005}
    dynamics = {"duration": 0.1, "outputs": 2, "integrator": "generalized_alpha", "step": 0.05}
    explicit = {"integrator": "runge_kutta_4", "step": 2e-4}
    return {
        "3-10-1-3 at rest": at_rest("3-10-1-3", "svk", folder),
        "3813 at rest": at_rest("3813", "neo_hooke", folder),
        "3443 at rest": at_rest("3443", "neo_hooke", folder),
        "3443+4 at rest": at_rest("3443+4", "svk", folder),
        "3843 at rest": at_rest("3843", "neo_hooke", folder),
        "3843 in motion": in_motion("3843", "neo_hooke", folder, **mean),
        "3443+4 in motion": in_motion("3443+4", "svk", folder, **mean),
        "3443 in motion": in_motion("3443", "svk", folder, **alpha, mass="lumped"),
        "3813 in motion": in_motion("3813", "svk", folder, **explicit),
        "3-10-1-3 in motion": in_motion("3-10-1-3", "neo_hooke", folder, **alpha, damping=1.0),
        "2-6-1-2 in motion": in_motion("2-6-1-2", "svk", folder, **alpha),
        "2412 in motion": in_motion("2412", "neo_hooke", folder, **mean),
        "on oblique planes, pressed": eighth("3-10-1-3", turn_of(1), folder),
        "on oblique planes, in motion": eighth("3413", turn_of(2), folder, dynamics=dynamics),
        "ring of 2-6-1-2 pressed": disc("2-6-1-2", "neo_hooke", folder),
        "ring of 2432 pressed": disc("2432", "svk", folder),
        "ring of 2-6-1-2 in motion": disc("2-6-1-2", "neo_hooke", folder, **mean),
        "ring of 2412 in motion": disc("2412", "svk", folder, integrator="central_difference", step=0.01),
        "ring of 2312 in motion": disc("2312", "svk", folder, **alpha, mass="lumped"),
        "2432 in motion": in_motion("2432", "svk", folder, **mean),
        "1222 in motion": in_motion("1222", "svk", folder, **mean),
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("family")


@pytest.fixture(scope="module")
def names(folder):
    """The case file of all runs; returns their names."""
    every = cases(folder)
    (folder / "cases.json").write_text(json.dumps(every))
    (folder / "runner.py").write_text(RUNNER)
    return list(every)


def test_one_two_and_three_ranks_give_the_same_numbers(names, folder, mpirun):
    for ranks in (1, 2, 3):
        mpirun(ranks, [folder / "runner.py", folder / "cases.json", folder / f"on{ranks}"], timeout=300)
    for name in names:
        one, *others = (open_results(folder / f"on{ranks}" / name) for ranks in (1, 2, 3))
        for other in others:
            assert_same(one, other, name)
        if "at rest" in name:
            # The weight of 10 kg under 1 m/s2 and the load.
            assert one.curve["clamp.rz"][-1] == pytest.approx(110.0, rel=1e-9)


def assert_same(one, other, name):
    """To the tolerance of Newton's method, 1e-10 of the forces; drawn middles of edges are among the points."""
    assert other.kind == one.kind
    np.testing.assert_array_equal(other.cells, one.cells)
    np.testing.assert_allclose(other.points, one.points, rtol=0, atol=1e-15)
    for column in one.curve:
        if not column.endswith(("iterations", "steps")):
            size = max(np.abs(one.curve[like]).max() for like in one.curve if kin(like) == kin(column))
            np.testing.assert_allclose(
                other.curve[column], one.curve[column], rtol=0, atol=1e-8 * size, err_msg=f"{name} {column}"
            )
    for fields in (one.node_fields, one.cell_fields):
        for field in fields:
            found, wanted = other.field(field), one.field(field)
            size = np.abs(wanted).max()
            np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-8 * size, err_msg=f"{name} {field}")


def kin(column):
    """Columns of one kind, whose rounding is that of the largest: components of a vector, energies and works."""
    return "energy" if column.endswith(("energy", "work", "drift")) else column.rpartition(".")[0] or column
