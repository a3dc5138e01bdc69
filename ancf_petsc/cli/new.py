"""`ancf new`: a folder with a commented case and its mesh, which runs as it is."""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path
from shlex import quote
from typing import NamedTuple

HELP = "write a commented case and its mesh to start from"
DEFAULT_KIND = "compression"

HEAD = """\
# Run it:        ancf run {folder}              (in parallel: mpiexec -n 2 ancf run {folder})
# Check it:      ancf check {folder}            Look at it: ancf view {folder}
# Change a value for one run: ancf run {folder} --set material.law=neo_hooke
# Every key is described in docs/case-format.md. Any consistent units will do; nothing is converted.

title = "{title}"
units = "SI"                  # a label for plots

[mesh]
file = "{mesh}"{space}# from this file's folder; .msh of Gmsh, .inp, .bdf, .exo, .vtu, ...
element = "3413"              # linear tetrahedra

# Groups of nodes come by name from the mesh file. More can be chosen by geometry:
# [groups]
# end  = {{ plane = "x", at = "max" }}                  # an axis or a normal; a number, "min" or "max"
# slab = {{ box = [[0, 0, 0], [1, 1, 0.1]] }}           # two opposite corners
# tips = {{ nearest = [0.5, 0.0, 0.1] }}                # the node nearest to a point, or to each of several
# both = {{ union = ["end", "slab"] }}
"""

COMPRESSION = """
[material]
law = "svk"                   # St Venant-Kirchhoff; or "neo_hooke", which goes further in compression
young = 6.8e6
poisson = 0.35
# density = 1350.0            # needed with gravity and in motion

# A quarter of the block: the planes of symmetry hold what cannot leave them.
[[constraint]]
group = "symmetry_x"
fix = ["x"]

[[constraint]]
group = "symmetry_y"
fix = ["y"]

[[constraint]]
group = "bottom"
fix = ["x", "y", "z"]

[[constraint]]
group = "top"
fix = ["x", "y"]              # bonded; fix = [] lets the top slide
move = { z = -0.010 }         # at the end of the ramp
ramp = "cosine"               # linear | cosine | constant | [[0, 0], [0.5, 1], [1, 0]]: load and unload

[statics]                     # pseudo-time s runs from 0 to 1
steps = 10                    # outputs; or times = [0.5, 1.0]; or strokes = [0.005, 0.010]

[output]
symmetry = 4                  # forces and energies of the whole block, four quarters
curve = { force = "top.z", stroke = "top.z" }

[[probe]]
name = "top"
group = "top"

# [petsc]                     # any PETSc option; on the command line: ancf run {folder} -- -ksp_type cg
# ksp_type = "cg"
"""

BENDING = """
[material]
law = "svk"                   # St Venant-Kirchhoff; or "neo_hooke"
young = 1.0e7
poisson = 0.3
density = 1000.0              # for gravity

[[constraint]]
group = "clamp"
fix = ["x", "y", "z"]

[[load]]
type = "force"                # dead: keeps its direction
group = "end"                 # spread over the group's faces
total = [0.0, 0.0, -50.0]     # of the whole group
ramp = "linear"               # linear | cosine | constant | [[0, 0], [0.5, 1], [1, 0]]

[[load]]
type = "gravity"
acceleration = [0.0, 0.0, -9.81]

[statics]                     # pseudo-time s runs from 0 to 1, loads with it
steps = 10                    # outputs; or times = [0.5, 1.0]

[output]
curve = { force = "clamp.z", stroke = "end.z" }   # GROUP.AXIS: force is what the support exerts on the body

[[probe]]
name = "end"
group = "end"
mean = "area"                 # or "nodes"
"""

DYNAMICS = """
[material]
law = "svk"                   # St Venant-Kirchhoff; or "neo_hooke"
young = 2.0e6
poisson = 0.3
density = 7800.0              # motion needs it

[[constraint]]
group = "hinge"               # an edge: the body turns about it
fix = ["x", "y", "z"]

[[load]]
type = "gravity"              # in motion loads act at once, unless there is a ramp
acceleration = [0.0, 0.0, -9.81]

[dynamics]
duration = 0.5
integrator = "runge_kutta_5dp"
tolerance = 1e-7              # it adapts its step; or step = 1e-4
# integrator = "generalized_alpha"   # implicit, takes long steps: step = 1e-3, spectral_radius = 0.8
damping = 0.0                 # alpha in 1/s; or "critical"
outputs = 50                  # equal intervals

# [initial]
# velocity = [0.0, 0.0, 0.0]
# spin = [0.0, 3.0, 0.0]      # rad/s about centre = "mass" or a point

[[probe]]
name = "tip"
group = "tip"
"""


class Template(NamedTuple):
    """A sort of case: what it shows, which of the project's meshes it takes, its tables."""

    about: str
    mesh: str
    divisions: tuple[int, int, int]
    tables: str


KINDS = {
    "compression": Template("a quarter block, compressed", "cube", (4, 4, 8), COMPRESSION),
    "bending": Template("a cantilever under a force and its own weight", "cantilever", (20, 2, 2), BENDING),
    "dynamics": Template("a falling pendulum", "pendulum", (4, 2, 2), DYNAMICS),
}
EPILOG = "kinds:\n" + "\n".join(f"  {name:<13}{kind.about}" for name, kind in KINDS.items())


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME", type=Path, help="the folder to make")
    parser.add_argument("--kind", metavar="KIND", default=DEFAULT_KIND, help=f"default {DEFAULT_KIND}")


def execute(arguments: argparse.Namespace) -> int:
    from ancf_petsc.cli import rank

    if rank() == 0:
        file = write_case(arguments.name, arguments.kind)
        print(f"wrote {file} and its mesh; next: ancf run {quote(str(arguments.name))}")
    return 0


def write_case(folder: Path, kind: str = DEFAULT_KIND) -> Path:
    """Make `folder` with case.toml and a mesh; the case file. Raises CaseError where there is something."""
    from ancf_petsc.errors import CaseError, did_you_mean, writing
    from ancf_petsc.input.load import CASE_FILE
    from ancf_petsc.mesh.generate import make_mesh

    if kind not in KINDS:
        raise CaseError(
            key="--kind", got=kind, expected="a kind of case", cure=did_you_mean(kind, tuple(KINDS))
        )
    if not str(folder).isprintable():
        raise CaseError(got=str(folder), expected="a name of one line", cure="choose another name")
    if folder.exists() or folder.is_symlink():
        raise CaseError("already there", file=folder, expected="a new name", cure="choose another name")
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise CaseError(
            f"cannot create the folder: {error.strerror}",
            file=folder,
            cure="choose a folder you can write to",
        ) from None
    chosen = KINDS[kind]
    mesh = f"{chosen.mesh}.msh"
    try:
        make_mesh(chosen.mesh, folder / mesh, divisions=chosen.divisions)
        with writing(folder / CASE_FILE):
            (folder / CASE_FILE).write_text(case_text(folder, kind), encoding="utf-8")
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    return folder / CASE_FILE


def case_text(folder: Path, kind: str) -> str:
    """The text of a case file of `kind` that lives in `folder`."""
    chosen = KINDS[kind]
    mesh = f"{chosen.mesh}.msh"
    head = HEAD.format(
        folder=quote(str(folder)),
        title=chosen.about.capitalize(),
        mesh=mesh,
        space=" " * max(1, 21 - len(mesh)),
    )
    return head + chosen.tables.replace("{folder}", quote(str(folder)))
