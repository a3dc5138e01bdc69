"""The bodies that are timed, as cases, and the answers that other programs gave for them.

The PVC block and the cubes: dolfinx 0.5.2 on the same meshes; the pendulum: scipy's DOP853 (tests/reference).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ancf_petsc.bench.meshes import mesh_path, project_file

YOUNG, POISSON, HEIGHT, SIDE = 6.8e6, 0.35, 0.1, 0.05
GRAVITY = [0.0, 0.0, -9.81]


def block(
    mesh: str,
    stroke: float,
    steps: int,
    *,
    law: str = "svk",
    element: str = "3413",
    tolerance: float = 1e-8,
    ramp: str = "linear",
    smallest_step: float = 1e-4,
    petsc: dict[str, object] | None = None,
) -> dict[str, Any]:
    """A quarter block between bonded plates, pressed by `stroke`; forces are those of the quarter."""
    return {
        "title": f"block {mesh}",
        "mesh": {"file": str(mesh_path(mesh)), "element": element},
        "material": {"law": law, "young": YOUNG, "poisson": POISSON},
        "constraint": [
            {"group": "bottom", "fix": ["x", "y", "z"]},
            {"group": "top", "fix": ["x", "y"], "move": {"z": -stroke}, "ramp": ramp},
            {"group": "symmetry_x", "fix": ["x"]},
            {"group": "symmetry_y", "fix": ["y"]},
        ],
        "statics": {"steps": steps, "tolerance": tolerance, "smallest_step": smallest_step},
        "output": {"curve": {"force": "top.z", "stroke": "top.z"}},
        "petsc": petsc or {},
    }


def pendulum(
    mesh: str, duration: float, outputs: int, *, petsc: dict[str, object] | None = None, **dynamics: Any
) -> dict[str, Any]:
    """The pendulum of 0.5 x 0.1 x 0.1 m, let go from the horizontal."""
    tip = [[0.5, 0, 0], [0.5, 0.1, 0], [0.5, 0, 0.1], [0.5, 0.1, 0.1]]
    return {
        "title": f"pendulum {mesh}",
        "mesh": {"file": str(mesh_path(mesh)), "element": "3413"},
        "groups": {"corners": {"nearest": tip}},
        "material": {"law": "svk", "young": 2e6, "poisson": 0.3, "density": 7800.0},
        "constraint": [{"group": "hinge", "fix": ["x", "y", "z"]}],
        "load": [{"type": "gravity", "acceleration": GRAVITY}],
        "dynamics": {"duration": duration, "outputs": outputs, **dynamics},
        "probe": [{"name": "tip", "group": "corners"}],
        "petsc": petsc or {},
    }


def beam(mesh: str, element: str) -> dict[str, Any]:
    """A beam along x, clamped at x = 0, with a force across its end."""
    return {
        "title": f"beam {mesh}",
        "mesh": {"file": str(mesh_path(mesh)), "element": element},
        "groups": {"clamp": {"plane": "x", "at": "min"}, "end": {"plane": "x", "at": "max"}},
        "material": {"law": "svk", "young": 2e6, "poisson": 0.3},
        "constraint": [{"group": "clamp", "fix": ["x", "y", "z"]}],
        "load": [{"type": "force", "group": "end", "total": [0.0, 0.0, -60.0]}],
        "statics": {"steps": 1},
    }


PROBLEMS = {"block": block, "pendulum": pendulum}


def reference_tip() -> NDArray[np.float64]:
    """Tip (101, 3) of the pendulum of 96 elements, every 0.01 s."""
    file = project_file("tests", "reference", "pendulum_96_undamped.csv")
    rows = np.genfromtxt(file, delimiter=",", names=True)
    return np.stack([rows[axis] for axis in "xyz"], axis=1)


def block_force_234() -> float:
    """Force of the quarter of the PVC block of 234 nodes at 25 mm."""
    rows = np.genfromtxt(
        project_file("tests", "reference", "pvc_block_forces.csv"), delimiter=",", names=True
    )
    return float(rows["svk_top_fixed_N"][-1] / 4)


def stretched_force(stretch: float) -> tuple[float, float]:
    """Force on the cube's top under uniaxial strain F = diag(1, 1, stretch), law svk, and its derivative."""
    lame = YOUNG * POISSON / (1 + POISSON) / (1 - 2 * POISSON)
    modulus = lame + YOUNG / (1 + POISSON)
    area = SIDE**2
    return area * modulus * (stretch**3 - stretch) / 2, area * modulus * (3 * stretch**2 - 1) / 2
