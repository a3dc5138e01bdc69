"""`ancf mesh`: makes the project's meshes at a size you ask for."""

from __future__ import annotations

import argparse
from pathlib import Path

HELP = "make one of the project's meshes at a size you ask for"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", nargs="?", help="which body; --list shows them")
    parser.add_argument("--size", type=float, metavar="H", help="length of edges in metres, meshed by Gmsh")
    parser.add_argument(
        "--rim",
        type=float,
        metavar="H",
        help="finer edges at the rims of bonded faces, growing away from them",
    )
    parser.add_argument(
        "--divisions",
        type=int,
        nargs=3,
        metavar=("NX", "NY", "NZ"),
        help="bricks of six tetrahedra along x, y, z",
    )
    parser.add_argument("--hexahedra", action="store_true", help="leave the bricks whole")
    parser.add_argument(
        "--flat",
        choices=("triangle", "quad", "line"),
        default="",
        help="triangle, quad: the section half way along y, of a ring in x-z; line: the axis along x",
    )
    parser.add_argument(
        "--order", type=int, default=1, metavar="1|2", help="2: quadratic tetrahedra (default 1)"
    )
    parser.add_argument(
        "--format", default="2.2", metavar="2.2|4.1", help="version of the .msh file (default 2.2)"
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="the file to write (default NAME.msh)")
    parser.add_argument("--list", action="store_true", help="list the bodies and stop")


def execute(arguments: argparse.Namespace) -> int:
    from ancf_petsc.errors import CaseError
    from ancf_petsc.mesh.bodies import BODIES
    from ancf_petsc.mesh.generate import make_mesh

    if arguments.list:
        _print_bodies()
        return 0
    if arguments.name is None:
        raise CaseError(
            "missing", key="NAME", expected=f"one of {', '.join(BODIES)}", cure="ancf mesh --list"
        )
    path = arguments.out or Path(f"{arguments.name}.msh")
    replaced = path.is_file()
    make_mesh(
        arguments.name,
        path,
        size=arguments.size,
        rim=arguments.rim,
        divisions=arguments.divisions,
        order=arguments.order,
        hexahedra=arguments.hexahedra,
        flat=arguments.flat,
        version=arguments.format,
    )
    _print_mesh(path, (arguments.flat,) if arguments.flat else ("tetra", "tetra10", "hexahedron"))
    print(f"{'replaced' if replaced else 'wrote'} {path}")
    return 0


def _print_bodies() -> None:
    from ancf_petsc.mesh.bodies import BODIES

    for name, body in BODIES.items():
        divisions = " ".join(map(str, body.divisions))
        print(f"{name}: {body.about}")
        print(f"  groups {', '.join([*body.faces, *body.edges, 'solid'])}")
        print(f"  --size {body.size:g} (default), or --divisions, as in {divisions}")


def _print_mesh(path: Path, kinds: tuple[str, ...]) -> None:
    from rich.console import Console
    from rich.table import Table

    from ancf_petsc.mesh.check import MEASURES, statistics
    from ancf_petsc.mesh.read import read_mesh

    found = statistics(read_mesh(path, kinds))
    console = Console(highlight=False)
    console.print(
        f"{found.nodes} nodes, {found.cells} {found.kind} cells, {found.measure} {found.volume:.6g}"
    )
    worst = f"worst {found.worst_quality:.3f} in cell {found.worst_cell}"
    if found.dimension > 1:
        console.print(f"quality (mean ratio): {worst}, mean {found.mean_quality:.3f}")
    console.print(f"edges {found.shortest_edge:.4g} to {found.longest_edge:.4g}")
    parts = [*("lines", "faces")[: found.dimension - 1], "cells"]
    dimensions = range(1, found.dimension + 1)
    table = Table("group", "nodes", *parts, *(MEASURES[d] for d in dimensions), box=None)
    for name, group in found.groups.items():
        counts = [str(group.parts.get(d, "")) for d in dimensions]
        sizes = [f"{group.measures[d]:.6g}" if d in group.measures else "" for d in dimensions]
        table.add_row(name, str(group.nodes), *counts, *sizes)
    console.print(table)
