"""The benchmarks without a target: iterations, alternatives and the model of scaling in docs/performance.md."""

from __future__ import annotations

from ancf_petsc.bench.alternatives import LINEAR_SOLVERS, MASS_SOLVERS
from ancf_petsc.bench.row import BLOCK_74K, BLOCK_480K, CUBE_74K, FORCE_74K, FORCE_480K, SOLUTION, Row, press
from ancf_petsc.bench.table import PENDULUM
from ancf_petsc.element.catalog import ELEMENTS


def _scaling() -> list[Row]:
    """Weak scaling: half the elements on one rank. What travels: counted to 16 ranks, timed between 2."""
    weak = {"37k": ("cube:0.0032", 1, 0.010), "240k": ("cube:0.0017", 1, 0.005)}
    rows = [
        Row(
            f"scaling/weak/{name}",
            f"block of about {name} elements on one rank, half of what two ranks have",
            "run",
            press({"name": "block", "mesh": mesh, "stroke": stroke, "steps": 10}, {}),
            ranks=ranks,
            repetitions=3,
        )
        for name, (mesh, ranks, stroke) in weak.items()
    ]
    multigrid = {"ksp_type": "cg", "pc_type": "gamg"}
    rows.append(
        Row(
            "scaling/multigrid/480k",
            "the block of 478,059 elements with multigrid",
            "run",
            press(BLOCK_480K | {"petsc": multigrid}, FORCE_480K),
            allowed=1e-6,
            ranks=2,
            repetitions=1,
        )
    )
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


SOLVED = {
    "3413": {"12k": "pendulum:40x9x9", "36k": "pendulum:60x13x13"},
    "3813": {"12k": "pendulum:40x9x9:hexahedra", "36k": "pendulum:60x13x13:hexahedra"},
    "3-10-1-3": {"12k": "pendulum:16x5x5", "36k": "pendulum:26x7x7"},
    "3443": {"12k": "pendulum:20x6x6", "36k": "pendulum:30x9x9"},
    "3443+4": {"12k": "pendulum:12x4x4", "36k": "pendulum:20x6x6"},
    "3843": {"12k": "pendulum:20x6x6:hexahedra", "36k": "pendulum:30x9x9:hexahedra"},
}


def _iterations() -> list[Row]:
    """Multigrid with the rigid motions of the bent body, and the default beside it."""
    return [
        Row(
            f"iterations/{solver}/{element}/{size}",
            f"iterations to eight digits, bent beam of about {size} degrees of freedom",
            "iterations",
            {"mesh": mesh, "element": element, "solver": solver},
            unit="iterations",
            allowed=1e-7,
            repetitions=1,
        )
        for solver in ("gamg", "two_level")
        for element, meshes in SOLVED.items()
        for size, mesh in meshes.items()
    ]


def _points() -> list[Row]:
    """What a quadrature point of every element costs; beams have a law of their own."""
    return [
        Row(
            f"points/{law}/{code}/{kernel}",
            f"{kernel} of {code}, {row.points['default']} points a cell, one core",
            "points",
            {"code": code, "kernel": kernel, "law": law},
            unit="ns/point",
            allowed=1e-6 if kernel == "residual" else 1e-11,
            repetitions=20,
            small=True,
        )
        for law in ("svk", "neo_hooke")
        for code, row in ELEMENTS.items()
        if law == "svk" or not row.is_beam
        for kernel in ("residual", "tangent")
    ]


def _alternatives() -> list[Row]:
    """Parts of this program beside those of PETSc, SciPy and Gmsh that could stand in their place."""
    solvers = [
        Row(
            f"alternatives/solver/{name}",
            f"solution of the block of 73,606 elements, 2 ranks, conjugate gradients with {name}",
            "run",
            press(BLOCK_74K | {"petsc": options}, FORCE_74K, SOLUTION),
            allowed=1e-6,
            ranks=2,
            repetitions=2,
        )
        for name, options in LINEAR_SOLVERS.items()
    ]
    masses = [
        Row(
            f"alternatives/mass/{name}",
            "accelerations of the pendulum of 10,290 elements from forces, one core",
            "mass_solver",
            {"mesh": "pendulum:35x7x7", "solver": name},
            unit="us",
            allowed=1e-9,
        )
        for name in MASS_SOLVERS
    ]
    integrators = {
        "runge_kutta_5dp": {"integrator": "runge_kutta_5dp", "tolerance": 3e-8},
        "generalized_alpha": {"integrator": "generalized_alpha", "step": 1 / 800},
    }
    motions = [
        Row(
            f"alternatives/motion/{integrator}/{loops}",
            f"pendulum of 96 elements, 1 s, {integrator}, steps in {words}",
            "run",
            {
                "problem": PENDULUM | keys | {"petsc": petsc},
                "known": {"tip": "pendulum_96"},
                "parts": SOLUTION,
            },
            allowed=1.5e-4,
            repetitions=3,
        )
        for integrator, keys in integrators.items()
        for loops, words, petsc in (
            ("compiled", "one compiled loop", {}),
            ("ts", "PETSc's TS", {"ts_max_reject": 10}),
        )
    ]
    readers = [
        Row(
            f"alternatives/reader/{name}",
            "reading the mesh of 73,606 elements from Gmsh's text file, checks included",
            "reader",
            {"mesh": CUBE_74K, "reader": name},
            allowed=1e-12,
            repetitions=3,
        )
        for name in ("text", "gmsh")
    ]
    return [*solvers, *_either_solver(), *masses, *motions, *readers]


def _either_solver() -> list[Row]:
    """Factoring and iterating on both sides of the size from which this program iterates."""
    meshes = {
        "3413": [f"cube:{size}" for size in ("0.025", "0.0166", "0.0125", "0.01")],
        "3-10-1-3": [f"cube:{size}:quadratic" for size in ("0.0166", "0.0125", "0.01", "0.008")],
    }
    return [
        Row(
            f"alternatives/{solver}/{element}/{mesh}",
            "solution of a small block, 4 %, 2 steps, one core",
            "either_solver",
            {
                "solver": solver,
                "problem": {"name": "block", "mesh": mesh, "element": element, "stroke": 0.004, "steps": 2},
                "parts": SOLUTION,
            },
            repetitions=3,
        )
        for element, names in meshes.items()
        for mesh in names
        for solver in ("direct", "iterative")
    ]


SEARCHES = ("program", "bt", "cp", "l2", "energy")
SEARCHED = (
    *("column/1222", "column/3843", "column/3-10-1-3", "arch/3-10-1-3"),
    *("block/3413", "block/3-10-1-3", "pad_0.499/3-10-1-3", "pad_0.499/3413"),
)


def _line_searches() -> list[Row]:
    """What the program does, whole steps and then bt, and PETSc's line searches beside it."""
    return [
        Row(
            f"line_search/{problem}/{search}",
            f"Newton iterations of a load path by {search}, failed steps included",
            "line_search",
            {"problem": problem, "search": search},
            unit="iterations",
            repetitions=1,
        )
        for problem in SEARCHED
        for search in SEARCHES
    ]


SWEEPS = [
    *_points(),
    *_iterations(),
    *_line_searches(),
    *_scaling(),
    *_alternatives(),
]
