"""The same motion on 1, 2 and 3 ranks."""

from __future__ import annotations

import json

import numpy as np
import pytest

PROGRAM = """
import json, sys
from mpi4py import MPI
sys.path.insert(0, sys.argv[1])
from motion_cases import Followed, pendulum
comm, found = MPI.COMM_WORLD, {}
for name, step in json.loads(sys.argv[2]).items():
    how = {"duration": 10 * step, "outputs": 2, "integrator": name, "step": step, "damping": 0.5}
    data = pendulum(how, constraint=[{"group": "hinge", "fix": ["x", "y"], "move": {"z": 0.02}}])
    followed = Followed(data, comm=comm)
    model = followed.motion.assembly.model
    numbers = model.numbering.file_nodes[: model.owned].tolist()
    parts = comm.gather((numbers, followed.positions.tolist(), followed.velocities.tolist()))
    if comm.rank == 0:
        rows = sorted((n, *x, *v) for part in parts for n, x, v in zip(*part))
        found[name] = [row[1:] for row in rows]
if comm.rank == 0:
    print("FOUND" + json.dumps(found))
"""
STEPS = {
    "generalized_alpha": 0.01,
    "energy_momentum": 0.01,
    "theta": 0.01,
    "rosenbrock": 0.01,
    "runge_kutta_5dp": 4e-4,
    "runge_kutta_4": 1e-3,
    "central_difference": 5e-4,
}
EXPLICIT = ("runge_kutta_5dp", "runge_kutta_4", "central_difference")
TOLERANCES = dict.fromkeys(STEPS, 1e-8) | dict.fromkeys(EXPLICIT, 1e-10)


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    path = tmp_path_factory.mktemp("ranks") / "program.py"
    path.write_text(PROGRAM)
    return path


def test_same_numbers_on_one_two_and_three_ranks(mpirun, programs, project):
    """Positions and velocities of all nodes in file order; 1e-8 for implicit methods, 1e-10 for explicit
    fixed steps.
    """
    found = []
    for ranks in (1, 2, 3):
        said = mpirun(ranks, [programs, project / "tests", json.dumps(STEPS)]).stdout
        found.append(json.loads(said.partition("FOUND")[2]))
    for name, tolerance in TOLERANCES.items():
        one = np.array(found[0][name])
        for others in found[1:]:
            np.testing.assert_allclose(others[name], one, atol=tolerance * np.abs(one).max(), err_msg=name)
