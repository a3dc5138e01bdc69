"""The benchmarks with a target: the table of docs/performance.md."""

from __future__ import annotations

from typing import Any

from ancf_petsc.bench.row import (
    BLOCK_9K,
    BLOCK_74K,
    BLOCK_480K,
    CUBE_74K,
    FORCE_9K,
    FORCE_74K,
    FORCE_480K,
    SOLUTION,
    Row,
    press,
)

PENDULUM = {"name": "pendulum", "mesh": "pendulum_96", "duration": 1.0, "outputs": 100}


def _pendulum(known: dict[str, Any] | None = None, **dynamics: Any) -> dict[str, Any]:
    return {
        "problem": PENDULUM | dynamics,
        "known": known or {"tip": "pendulum_96"},
        "parts": SOLUTION,
    }


def _explicit(mass: str, tip_end: list[float]) -> dict[str, Any]:
    problem = {"name": "pendulum", "mesh": "pendulum:35x7x7", "duration": 0.2, "outputs": 1}
    problem |= {"integrator": "central_difference", "mass": mass, "step": 2e-4}
    return {"problem": problem, "known": {"tip_end": tip_end}}


KERNELS = [
    Row(
        "residual_74k",
        "residual of 3413, 73,606 elements, one core",
        "residual",
        {"mesh": CUBE_74K},
        unit="ns/element",
        target=40,
        allowed=1e-11,
        small=True,
    ),
    Row(
        "tangent_74k",
        "tangent of 3413 into PETSc's matrix, supports included, one core",
        "tangent",
        {"mesh": CUBE_74K},
        unit="ns/element",
        target=350,
        allowed=1e-11,
        small=True,
    ),
    Row(
        "compile_catalogue",
        "compiling all kernels of all elements, both laws, into an empty folder",
        "compile_catalogue",
        target=90,
        repetitions=1,
    ),
    Row(
        "setup_480k",
        "mesh file to first assembled tangent, 478,059 elements, 2 ranks",
        "set_up",
        {"problem": BLOCK_480K},
        target=12,
        allowed=1e-12,
        ranks=2,
        repetitions=3,
    ),
]
STATICS = [
    Row(
        "cube_m2",
        "block of 9,670 elements, 15 %, 10 steps, 2 ranks, without imports",
        "run",
        press(BLOCK_9K, FORCE_9K),
        target=0.24,
        allowed=1e-6,
        ranks=2,
        small=True,
    ),
    Row(
        "block_74k",
        "block of 73,606 elements, 10 %, 10 steps, 2 ranks, without imports",
        "run",
        press(BLOCK_74K, FORCE_74K),
        target=2.5,
        allowed=1e-6,
        ranks=2,
        repetitions=3,
    ),
    Row(
        "block_480k",
        "block of 478,059 elements, 5 %, 10 steps, 2 ranks, without imports",
        "run",
        press(BLOCK_480K, FORCE_480K),
        target=21,
        allowed=1e-6,
        ranks=2,
        repetitions=3,
    ),
    Row(
        "memory_480k",
        "the same: memory beyond that before the mesh is read, all ranks",
        unit="B/element",
        target=1500,
        of="block_480k",
        part="memory_bytes_an_element",
    ),
    Row(
        "pvc_block",
        "PVC block of 234 nodes, 25 mm, 25 outputs, solution alone",
        "run",
        {
            "problem": {
                "name": "block",
                "mesh": "pvc_block_234",
                "stroke": 0.025,
                "steps": 25,
                "ramp": "cosine",
                "tolerance": 1e-10,
            },
            "known": {"force": "pvc_block_234"},
            "parts": SOLUTION,
        },
        target=0.15,
        allowed=1e-8,
        small=True,
    ),
]
DYNAMICS = [
    Row(
        "pendulum_1e-4",
        "pendulum of 96 elements, 1 s, tip within 1e-4 m, solution alone",
        "run",
        _pendulum(integrator="central_difference", step=1 / 1100),
        target=0.02,
        allowed=1e-4,
        small=True,
    ),
    Row(
        "pendulum_1e-7",
        "the same within 1e-7 m, Runge-Kutta 5dp",
        "run",
        _pendulum(integrator="runge_kutta_5dp", tolerance=3e-8),
        target=0.15,
        allowed=1e-7,
        small=True,
    ),
    Row(
        "pendulum_alpha",
        "the same by generalised alpha, 800 steps",
        "run",
        _pendulum(integrator="generalized_alpha", step=1 / 800),
        target=0.1,
        allowed=1.5e-4,
        small=True,
    ),
    Row(
        "pendulum_10k_lumped",
        "pendulum of 10,290 elements, explicit, lumped mass, per force evaluation, one core",
        "explicit",
        _explicit("lumped", [0.41200046426, 0.04997603112, -0.21336190260]),
        unit="ns/element",
        target=80,
        allowed=5e-5,
        small=True,
    ),
    Row(
        "pendulum_10k_consistent",
        "the same with consistent mass",
        "explicit",
        _explicit("consistent", [0.41189412815, 0.04996934429, -0.21361442613]),
        unit="ns/element",
        target=200,
        allowed=5e-5,
        small=True,
    ),
]
RANKS = [
    Row(
        "block_74k_one",
        "the block of 73,606 elements on one rank",
        "run",
        press(BLOCK_74K, FORCE_74K),
        allowed=1e-6,
        repetitions=3,
    ),
    Row(
        "block_480k_one",
        "the block of 478,059 elements on one rank",
        "run",
        press(BLOCK_480K, FORCE_480K),
        allowed=1e-6,
        repetitions=2,
    ),
    Row(
        "gain_74k",
        "two ranks against one, 73,606 elements",
        unit="times",
        target=1.6,
        more=True,
        of="block_74k",
        gain="block_74k_one",
    ),
    Row(
        "gain_480k",
        "two ranks against one, 478,059 elements",
        unit="times",
        target=1.6,
        more=True,
        of="block_480k",
        gain="block_480k_one",
    ),
]
STARTING = [
    Row(
        "start_run",
        "ancf run of the small block, from the command to the solver",
        "start",
        {"words": ["run", "cases/pvc_block"], "until": "solver:"},
        target=1.3,
        small=True,
    ),
    Row(
        "start_help",
        "ancf --help",
        "start",
        {"words": ["--help"], "until": "ANCF_TRACEBACK"},
        target=0.3,
        small=True,
    ),
]
TABLE = [*KERNELS, *STATICS, *DYNAMICS, *RANKS, *STARTING]
