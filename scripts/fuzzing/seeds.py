"""Small valid meshes in every format the program reads, and a run's folder, made once for each campaign."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

PROJECT = Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [path for path in (str(PROJECT), str(PROJECT / "tests")) if path not in sys.path]

CUBE = np.array([(x, y, z) for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
KUHN = np.array([(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)])
FACES = np.array([(0, 1, 3), (0, 3, 2)])


class Seed(NamedTuple):
    """A valid input: files by name, of which `main` is given to the program, and the element it is meant for."""

    kind: str
    folder: Path
    main: str
    element: str

    def files(self) -> dict[str, bytes]:
        return {str(path.relative_to(self.folder)): path.read_bytes() for path in _files(self.folder)}


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


def tetrahedra(**options: Any):
    """The unit cube in six tetrahedra, its lower face as two triangles, for meshio."""
    import meshio

    return meshio.Mesh(CUBE * 0.1, [("triangle", FACES), ("tetra", KUHN)], **options)


def brick():
    """The unit cube as one brick."""
    import meshio

    return meshio.Mesh(CUBE * 0.1, [("hexahedron", np.array([(0, 1, 3, 2, 4, 5, 7, 6)]))])


SETS = {"wall": [[0, 1], []], "lower": [[], [0]], "upper": [[], [1]]}
BY_MESHIO = {
    "vtu": [
        ("zlib.vtu", {}), ("lzma.vtu", {"compression": "lzma"}), ("plain.vtu", {"compression": None}),
        ("ascii.vtu", {"binary": False}),
    ],
    "vtk": [("binary.vtk", {}), ("ascii.vtk", {"binary": False}), ("old.vtk", {"file_format": "vtk42"})],
    "xdmf": [("hdf.xdmf", {}), ("xml.xdmf", {"data_format": "XML"}), ("raw.xdmf", {"data_format": "Binary"})],
    "med": [("m.med", {})],
    "medit": [("m.mesh", {}), ("m.meshb", {})],
    "other": [
        (name, {})
        for name in (
            "m.ugrid", "m.su2", "m.avs", "m.cgns", "m.h5m", "m.dat", "m.post", "m.f3grid", "m.mdpa", "m.node", "m.vol", "m.wkt",
            "m.xml", "m.hmf", "m.stl", "m.ply", "m.off",
        )
    ],
}  # fmt: skip
"""Formats that meshio writes: file and options, by kind."""


def write_meshio(path: Path, options: dict[str, Any]) -> bool:
    """Whether meshio can write this format at all."""
    mesh = tetrahedra(cell_sets=SETS)
    if path.suffix in (".xdmf", ".vtu", ".vtk"):
        mesh.cell_sets_to_data()
    if path.suffix not in (".xdmf", ".vtu", ".vtk", ".h5m", ".mdpa"):
        mesh = tetrahedra()
    if path.suffix == ".med":
        mesh = tetrahedra(cell_data={"cell_tags": [np.array([-6, -6]), np.array([-7, -8] + 4 * [-7])]})
        mesh.cell_tags = {-6: ["wall"], -7: ["body"], -8: ["body", "upper"]}
    if path.suffix in (".node", ".xml", ".vol"):
        mesh.cells = mesh.cells[1:]
    try:
        mesh.write(path, **options)
    except Exception:
        return False
    return True


def _write_msh(folder: Path) -> list[tuple[str, str, str]]:
    """Kind, file, element of Gmsh's versions; the one it no longer writes is by hand."""
    from tiny_meshes import TWO, quadratic_bricks, write_two_bricks

    made = []
    for version in (2.2, 4.1):
        for binary in (False, True):
            name = f"v{version:g}{'b' if binary else 't'}"
            write_two_bricks(folder / f"{name}.msh", version=version, binary=binary)
            made.append(("msh_binary" if binary else "msh_text", f"{name}.msh", "3413"))
    (folder / "hand.msh").write_text(TWO)
    nodes = TWO.partition("$Nodes\n")[2].partition("$EndNodes")[0].splitlines()
    rows = ["1 4 1 1 4 10 11 20 30", "2 4 1 1 4 11 20 30 41"]
    (folder / "old.msh").write_text("\n".join(["$NOD", *nodes, "$ENDNOD", "$ELM", "2", *rows, "$ENDELM", ""]))
    quadratic = quadratic_bricks(folder)
    quadratic.rename(folder / "quadratic.msh")
    (folder / "linear.msh").unlink()
    return [*made, ("msh_text", "hand.msh", "3413"), ("msh_text", "old.msh", "3413")]


def _write_decks(folder: Path) -> list[tuple[str, str, str]]:
    from random import Random

    from decks import Style, abaqus, bar
    from test_mesh_exodus import write as exodus
    from test_mesh_nastran import deck, free, large

    tetra, bricks = bar(), bar(tetrahedra=False)
    (folder / "plain.inp").write_text(abaqus(tetra))
    (folder / "bricks.inp").write_text(abaqus(bricks, "C3D8"))
    (folder / "styled").mkdir()
    (folder / "styled" / "styled.inp").write_text(Style(Random(1), folder / "styled").text(tetra))
    (folder / "parts.inp").write_text(ASSEMBLY)
    for name, writer in (("large", large), ("free", free)):
        (folder / f"{name}.bdf").write_text(deck(tetra, writer))
    (folder / "small.bdf").write_text(deck(bricks, name="CHEXA") + "\n")
    (folder / "systems.bdf").write_text(SYSTEMS)
    exodus(folder / "four.e", tetra)
    exodus(folder / "three.exo", bricks, "HEX8", form="NETCDF3_CLASSIC")
    exodus(folder / "offset.ex2", tetra, form="NETCDF3_64BIT_OFFSET")
    return [
        *(("inp", f"{name}.inp", "3413") for name in ("plain", "styled/styled", "parts")),
        ("inp", "bricks.inp", "3813"),
        *(("bdf", f"{name}.bdf", "3413") for name in ("large", "free", "systems")),
        ("bdf", "small.bdf", "3813"),
        ("exodus", "four.e", "3413"), ("exodus", "three.exo", "3813"), ("exodus", "offset.ex2", "3413"),
    ]  # fmt: skip


ASSEMBLY = """*HEADING
*PART, NAME=block
*NODE, NSET=all
1, 0, 0, 0
2, 1, 0, 0
3, 0, 1, 0
4, 0, 0, 1
*NGEN
1, 2, 1
*ELEMENT, TYPE=C3D4, ELSET=body
1, 1, 2, 3, 4
*NSET, NSET=ends, GENERATE
1, 3, 2
*SURFACE, NAME=face
body, S1
*END PART
*ASSEMBLY, NAME=whole
*INSTANCE, NAME=first, PART=block
*END INSTANCE
*INSTANCE, NAME=second, PART=block
5, 0, 0
5, 0, 0, 5, 0, 1, 90
*END INSTANCE
*NSET, NSET=held, INSTANCE=first
1, 2, 3
*END ASSEMBLY
*MATERIAL, NAME=rubber
*STEP
*END STEP
"""
SYSTEMS = """CEND
BEGIN BULK
CORD2C,1,0,0.,0.,0.,0.,0.,1.
,1.,0.,0.
CORD2R,2,1,0.,0.,0.,0.,0.,1.
,1.,0.,0.
GRID,1,,0.,0.,0.
GRID,2,1,1.,0.,0.
GRID,3,1,1.,90.,0.
GRID,4,2,0.,0.,1.
CTETRA,1,7,1,2,3,4
SET1,5,1,THRU,3
SET3,6,ELEM,1
RBE2,9,1,123456,2
ENDDATA
"""


def write_seeds(folder: Path) -> list[Seed]:
    """Write all seeds, each in a folder of its own, and the list of them, which `read_seeds` gives back."""
    loose = folder / "loose"
    loose.mkdir(parents=True)
    made = _write_msh(loose) + _write_decks(loose)
    seeds = []
    for kind, name, element in made:
        place = folder / kind / name.replace("/", "_")
        place.mkdir(parents=True)
        if "/" in name:
            for file in _files((loose / name).parent):
                file.rename(place / file.name)
        else:
            (loose / name).rename(place / name)
        seeds.append(Seed(kind, place, Path(name).name, element))
    for kind, wanted in BY_MESHIO.items():
        for name, options in wanted:
            place = folder / kind / name
            place.mkdir(parents=True)
            if write_meshio(place / name, options):
                seeds.append(Seed(kind, place, name, "3413"))
    seeds.append(_run_folder(folder / "results" / "run"))
    listed = [[seed.kind, str(seed.folder.relative_to(folder)), seed.main, seed.element] for seed in seeds]
    (folder / "seeds.json").write_text(json.dumps(listed))
    return seeds


def read_seeds(folder: Path) -> list[Seed]:
    listed = json.loads((folder / "seeds.json").read_text())
    return [Seed(kind, folder / place, main, element) for kind, place, main, element in listed]


def _run_folder(place: Path) -> Seed:
    """A run of a cube pressed in two steps, with a probe."""
    from ancf_petsc import case_from_dict, run

    place.parent.mkdir(parents=True, exist_ok=True)
    tetrahedra().write(place.parent / "cube.vtu")
    case = case_from_dict(CASE | {"mesh": {"file": "cube.vtu", "element": "3413"}}, place.parent)
    run(case, place)
    return Seed("results", place, "results.h5", "3413")


CASE: dict[str, Any] = {
    "title": "Cube",
    "groups": {"low": {"plane": "x", "at": "min"}, "high": {"plane": "x", "at": "max"}},
    "material": {"law": "neo_hooke", "young": 1e6, "poisson": 0.3},
    "constraint": [
        {"group": "low", "fix": ["x", "y", "z"]},
        {"group": "high", "fix": ["y", "z"], "move": {"x": -0.01}},
    ],
    "statics": {"steps": 2},
    "output": {"curve": {"force": "high.x", "stroke": "high.x"}},
    "probe": [{"name": "end", "group": "high"}],
}
