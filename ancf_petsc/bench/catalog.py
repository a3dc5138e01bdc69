"""The benchmarks there are, one row each.

Rows with a target are the table of docs/performance.md, the others its charts and models.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

from ancf_petsc.errors import CaseError, did_you_mean

CUBE_74K, CUBE_480K = "cube:0.0025", "cube:0.00135"
BLOCK_9K = {"name": "block", "mesh": "cube_m2", "stroke": 0.015, "steps": 10}
BLOCK_74K = {"name": "block", "mesh": CUBE_74K, "stroke": 0.010, "steps": 10}
BLOCK_480K = {"name": "block", "mesh": CUBE_480K, "stroke": 0.005, "steps": 10}
PENDULUM = {"name": "pendulum", "mesh": "pendulum_96", "duration": 1.0, "outputs": 100}
FORCE_9K = {"force": -2110.66766346, "elements": 9670}
FORCE_74K: dict[str, float] = {}
FORCE_480K: dict[str, float] = {}
ALL, SOLUTION = ("read", "setup", "solve", "output"), ("solve",)


@dataclass(frozen=True)
class Row:
    """A benchmark.

    measure, task: which measurement of `measure`, and its arguments. unit: of a sample. target: the most that is
    wanted (the least where `more` is better). allowed: how far the answer may be from the known one. part: a value
    among the facts of another row, `of`; gain: how many times faster `of` is than `gain`. small: for --quick.
    """

    name: str
    about: str
    measure: str = ""
    task: dict[str, Any] = field(default_factory=dict)
    unit: str = "s"
    target: float | None = None
    allowed: float | None = None
    ranks: int = 1
    repetitions: int = 5
    more: bool = False
    small: bool = False
    of: str = ""
    part: str = ""
    gain: str = ""


def _block(problem: dict[str, Any], known: dict[str, Any], parts: Sequence[str] = ALL) -> dict[str, Any]:
    return {"problem": problem, "known": known, "parts": parts, "warm_up": {**BLOCK_9K, "steps": 1}}


def _pendulum(known: dict[str, Any] | None = None, **dynamics: Any) -> dict[str, Any]:
    return {
        "problem": PENDULUM | dynamics,
        "known": known or {"tip": "pendulum_96"},
        "parts": SOLUTION,
    }


def _explicit(mass: str, tip_end: list[float]) -> dict[str, Any]:
    problem = {"name": "pendulum", "mesh": "pendulum:35x7x7", "duration": 0.02, "outputs": 1}
    problem |= {"integrator": "central_difference", "mass": mass, "step": 5e-5}
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
        _block(BLOCK_9K, FORCE_9K),
        target=0.24,
        allowed=1e-6,
        ranks=2,
        small=True,
    ),
    Row(
        "block_74k",
        "block of 73,606 elements, 10 %, 10 steps, 2 ranks, without imports",
        "run",
        _block(BLOCK_74K, FORCE_74K),
        target=2.5,
        allowed=1e-6,
        ranks=2,
        repetitions=3,
    ),
    Row(
        "block_480k",
        "block of 478,059 elements, 5 %, 10 steps, 2 ranks, without imports",
        "run",
        _block(BLOCK_480K, FORCE_480K),
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
        _pendulum(integrator="runge_kutta_5dp", tolerance=1e-7),
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
        _explicit("lumped", []),
        unit="ns/element",
        target=80,
        allowed=1e-6,
        small=True,
    ),
    Row(
        "pendulum_10k_consistent",
        "the same with consistent mass",
        "explicit",
        _explicit("consistent", []),
        unit="ns/element",
        target=200,
        allowed=1e-6,
        small=True,
    ),
]
RANKS = [
    Row(
        "block_74k_one",
        "the block of 73,606 elements on one rank",
        "run",
        _block(BLOCK_74K, FORCE_74K),
        allowed=1e-6,
        repetitions=3,
    ),
    Row(
        "block_480k_one",
        "the block of 478,059 elements on one rank",
        "run",
        _block(BLOCK_480K, FORCE_480K),
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
    Row("start_help", "ancf --help", "start", {"words": ["--help"]}, target=0.3, small=True),
]
TABLE = [*KERNELS, *STATICS, *DYNAMICS, *RANKS, *STARTING]


def _accuracy() -> list[Row]:
    """The PVC block's force at 25 mm over mesh sizes and elements, both laws."""
    meshes = {
        "3413": [f"pvc_block:{size}" for size in ("0.02", "0.014", "0.01", "0.007", "0.005", "0.0035")],
        "3-10-1-3": [f"pvc_block:{size}:quadratic" for size in ("0.03", "0.02", "0.014", "0.01")],
        "3813": [f"pvc_block:{bricks}:hexahedra" for bricks in ("2x4x10", "4x8x20", "8x16x40")],
        "3-20-1-3": [f"pvc_block:{bricks}:hexahedra" for bricks in ("2x4x10", "3x6x10", "4x8x20")],
        "3843": [f"pvc_block:{bricks}:hexahedra" for bricks in ("2x4x10", "3x6x10", "4x8x20")],
    }
    return [
        Row(
            f"accuracy/{law}/{element}/{mesh}",
            "force of the PVC block at 25 mm",
            "run",
            _block(
                {
                    "name": "block",
                    "mesh": mesh,
                    "stroke": 0.025,
                    "steps": 5,
                    "law": law,
                    "element": element,
                },
                {},
            ),
            repetitions=2,
        )
        for law in ("svk", "neo_hooke")
        for element, names in meshes.items()
        for mesh in names
    ]


def _strokes() -> list[Row]:
    """How far each law lets the cube and the PVC block be pressed, against mesh size."""
    meshes = {
        "cube": ("0.02", "0.0125", "0.008", "0.005", "0.0035", "0.0025"),
        "pvc_block": ("0.02", "0.014", "0.01", "0.007", "0.005"),
    }
    return [
        Row(
            f"stroke/{law}/{body}:{size}",
            "stroke at which no equilibrium is found further on",
            "stroke",
            {
                "problem": {
                    "name": "block",
                    "mesh": f"{body}:{size}",
                    "stroke": 0.08,
                    "steps": 80,
                    "law": law,
                    "smallest_step": 1e-5,
                }
            },
            unit="m",
            repetitions=1,
        )
        for law in ("svk", "neo_hooke")
        for body, sizes in meshes.items()
        for size in sizes
    ]


def _scaling() -> list[Row]:
    """Weak scaling: half the elements on one rank. What travels: counted on up to 16 ranks, timed between 2."""
    weak = {"37k": ("cube:0.0032", 1, 0.010), "240k": ("cube:0.0017", 1, 0.005)}
    rows = [
        Row(
            f"scaling/weak/{name}",
            f"block of about {name} elements on one rank, half of what two ranks have",
            "run",
            _block({"name": "block", "mesh": mesh, "stroke": stroke, "steps": 10}, {}),
            ranks=ranks,
            repetitions=3,
        )
        for name, (mesh, ranks, stroke) in weak.items()
    ]
    rows += [
        Row(
            f"scaling/messages/{ranks}",
            f"ghosts and neighbours where 73,606 elements are divided among {ranks} ranks",
            "messages",
            {"mesh": CUBE_74K},
            unit="ghosts",
            ranks=ranks,
            repetitions=1,
        )
        for ranks in (2, 4, 8, 16)
    ]
    return [*rows, Row("scaling/exchange", "a small message", "exchange_cost", unit="us", ranks=2)]


SWEEPS = [*_accuracy(), *_strokes(), *_scaling()]
ROWS = {row.name: row for row in [*TABLE, *SWEEPS]}


def choose(names: Sequence[str], *, quick: bool) -> list[Row]:
    """The rows with these names, beginnings (accuracy, stroke, scaling/messages) or patterns; else all of the table.

    Derived rows bring what they are derived from. Raises CaseError for a name that fits none.
    """
    chosen = [row for row in TABLE if row.small or not quick] if not names else []
    for name in names:
        found = [
            row for row in ROWS.values() if row.name.startswith(f"{name}/") or fnmatchcase(row.name, name)
        ]
        if not found:
            cure = did_you_mean(name, list(ROWS)) or "ancf bench --list"
            raise CaseError("no such benchmark", key="NAME", got=name, cure=cure)
        chosen += [row for row in found if row.small or not quick]
    needed = [ROWS[name] for row in chosen for name in (row.of, row.gain) if name]
    wanted = {row.name for row in [*needed, *chosen]}
    return [row for row in ROWS.values() if row.name in wanted]
