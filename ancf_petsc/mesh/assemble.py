"""From what a file says to a mesh that can be computed with."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ancf_petsc.errors import MeshError
from ancf_petsc.mesh.coincident import TOLERANCE, coincident_pairs, representatives
from ancf_petsc.mesh.doubts import doubts
from ancf_petsc.mesh.kinds import KINDS, Kind, determinants, edge_lengths, part_kind
from ancf_petsc.mesh.mesh import Floats, Group, Integers, Mesh
from ancf_petsc.mesh.parts import row_keys, unique_rows
from ancf_petsc.mesh.raw import Block, RawMesh, mesh_error

FLAT = 1e-12
"""Cells whose determinant is smaller than this times (longest edge)^dimension are flat."""

LARGEST = 1e100
"""Coordinates must be smaller than this for volumes to be finite."""

ASK_FOR = {
    "tetra": 'ask for mesh.element = "3413"',
    "tetra10": 'ask for mesh.element = "3-10-1-3", or mesh with linear tetrahedra',
    "hexahedron20": "mesh with linear bricks: Mesh.ElementOrder = 1 in Gmsh",
    "hexahedron27": "mesh with linear bricks: Mesh.ElementOrder = 1 in Gmsh",
    "hexahedron": 'ask for mesh.element = "3813", or mesh with tetrahedra',
}


class NodeNumbers:
    """Where the nodes of a file stand in the points of the mesh."""

    def __init__(self, numbers: Integers, path: Path) -> None:
        self.numbers = numbers
        self.rows = np.arange(len(numbers))
        self.path = path

    def find(self, numbers: Integers) -> Integers:
        """Indices of points, same shape as `numbers`; -1 where the file has no such node."""
        place = np.minimum(np.searchsorted(self.numbers, numbers), len(self.numbers) - 1)
        return np.where(self.numbers[place] == numbers, self.rows[place], -1)

    def of(self, block: Block) -> Integers:
        """Indices (m, k) of points of a block's cells. Raises MeshError where the file lacks one."""
        nodes = self.find(block.nodes)
        if nodes.size and nodes.min() < 0:
            row, column = np.argwhere(nodes < 0)[0]
            raise mesh_error(self.path)(
                f"{block.kind} {block.numbers[row]} refers to node {block.nodes[row, column]}, "
                "which the file does not hold",
                cure="write the mesh again with all its nodes",
            )
        return nodes


def assemble(raw: RawMesh, path: Path, kinds: tuple[str, ...], duplicates: str, element: str) -> Mesh:
    """The mesh of cells of one of `kinds`, in file order, positively oriented, with its groups.

    Raises MeshError where the file does not hold such a mesh or part of it cannot be computed with.
    """
    numbers, points = _sorted_nodes(raw, path)
    bodies, others = _body_blocks(raw.blocks, kinds, element, path)
    kind = KINDS[bodies[0].kind]
    numbering = NodeNumbers(numbers, path)
    cell_numbers, cells, membership = _cells(bodies, numbering)
    used = np.zeros(len(points), dtype=bool)
    used[cells] = True
    mesh = Mesh(points, kind.name, cells, {}, numbers, cell_numbers, used, list(raw.notes), source=str(path))
    _settle_duplicates(mesh, numbering, duplicates)
    _orient(mesh, kind, path)
    _build_groups(mesh, raw, others, membership, numbering)
    mesh.refused |= raw.refused
    mesh.notes += doubts(mesh, raw.boundary_only)
    unused = len(mesh.points) - np.count_nonzero(mesh.used)
    if unused:
        mesh.notes.append(f"{unused} of {len(mesh.points)} nodes belong to no element: kept, in no group")
    return mesh


def _sorted_nodes(raw: RawMesh, path: Path) -> tuple[Integers, Floats]:
    wrong = mesh_error(path)
    if not len(raw.node_numbers):
        raise wrong("the file holds no nodes", cure="mesh the body and write the file again")
    order = np.argsort(raw.node_numbers, kind="stable")
    numbers, points = raw.node_numbers[order], np.ascontiguousarray(raw.points[order])
    bad = np.flatnonzero(~(np.abs(points) < LARGEST).all(axis=1))
    if len(bad):
        place = _place(points[bad[0]])
        raise wrong(
            f"{len(bad)} nodes have coordinates that are not finite, first node {numbers[bad[0]]} at {place}",
            cure="mend the mesh",
        )
    return numbers, points


def _place(point: Floats) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in point) + ")"


def _body_blocks(
    blocks: list[Block], kinds: tuple[str, ...], element: str, path: Path
) -> tuple[list[Block], list[Block]]:
    """Blocks of the body's cells, which must all be of one kind in `kinds`, and the blocks of parts."""
    dimension = KINDS[kinds[0]].dimension
    blocks = [block for block in blocks if len(block.numbers)]
    unknown = [block for block in blocks if block.kind not in KINDS]
    known = [block for block in blocks if block.kind in KINDS]
    counts = _counts(unknown + [block for block in known if KINDS[block.kind].dimension >= dimension])
    if len(counts) == 1 and set(counts) <= set(kinds):
        bodies = [block for block in known if block.kind in counts]
        return bodies, [block for block in known if KINDS[block.kind].dimension < dimension]
    raise _wrong_cells(counts, known, kinds, element, path)


def _counts(blocks: list[Block]) -> dict[str, int]:
    """Kind -> number of cells, those that are listed in several groups once."""
    numbers: dict[str, list[Integers]] = {}
    for block in blocks:
        numbers.setdefault(block.kind, []).append(block.numbers)
    return {kind: len(np.unique(np.concatenate(parts))) for kind, parts in numbers.items()}


def _wrong_cells(
    counts: dict[str, int], blocks: list[Block], kinds: tuple[str, ...], element: str, path: Path
) -> MeshError:
    wrong = mesh_error(path)
    wanted = " or ".join(kinds)
    expected = f"{wanted} cells for element {element}"
    listing = ", ".join(f"{count} {kind}" for kind, count in sorted(counts.items()))
    if len(counts) > 1:
        return wrong(
            f"mixed cells: found {listing}, expected only {expected}", cure="mesh with one kind of cell"
        )
    if counts:
        (kind,) = counts
        return wrong(
            f"found {listing}, expected {expected}", cure=ASK_FOR.get(kind, f"mesh with {wanted} cells")
        )
    lower = _counts(blocks)
    listing = ", ".join(f"{count} {kind}" for kind, count in sorted(lower.items()))
    found = f"only {listing}" if listing else "no cells"
    dimension = KINDS[kinds[0]].dimension
    cure = f"mesh the body in {dimension}D (gmsh -{dimension}) and save its cells"
    return wrong(f"found {found}, expected {expected}", cure=cure)


def _cells(blocks: list[Block], numbering: NodeNumbers) -> tuple[Integers, Integers, dict[str, Integers]]:
    """Numbers (e,) ascending, cells (e, k), group name -> its cells; a cell listed twice is one cell."""
    numbers = np.concatenate([block.numbers for block in blocks])
    nodes = np.concatenate([numbering.of(block) for block in blocks])
    order = np.argsort(numbers, kind="stable")
    _, first, same = np.unique(
        row_keys(nodes[order], len(numbering.numbers)), return_index=True, return_inverse=True
    )
    kept = np.sort(first)
    cell_of = np.empty(len(order), dtype=np.int64)
    cell_of[order] = np.searchsorted(kept, first)[same]
    members: dict[str, list[Integers]] = {}
    start = 0
    for block in blocks:
        stop = start + len(block.numbers)
        for name in block.names:
            members.setdefault(name, []).append(cell_of[start:stop])
        start = stop
    membership = {name: np.unique(np.concatenate(rows)) for name, rows in members.items()}
    return numbers[order][kept], nodes[order][kept], membership


def _settle_duplicates(mesh: Mesh, numbering: NodeNumbers, duplicates: str) -> None:
    """Coincident nodes in use: refuse, keep or merge them."""
    nodes = np.flatnonzero(mesh.used)
    pairs = nodes[coincident_pairs(mesh.points[nodes], TOLERANCE * mesh.size)]
    if not len(pairs):
        return
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    doubled = len(np.unique(pairs[:, 1]))
    if duplicates == "keep":
        mesh.notes.append(f'{doubled} coincident nodes kept separate (mesh.duplicates = "keep")')
    elif duplicates == "merge":
        _merge(mesh, numbering, pairs)
        mesh.notes.append(f"{doubled} nodes lay on others: merged")
    else:
        first, second = pairs[0]
        one, other = mesh.node_numbers[first], mesh.node_numbers[second]
        raise mesh_error(numbering.path)(
            f"{doubled} nodes coincide with others, first nodes {one} and {other} at {_place(mesh.points[first])}",
            cure='set mesh.duplicates = "merge" to join them or "keep" for a crack or separate bodies',
        )


def _merge(mesh: Mesh, numbering: NodeNumbers, pairs: Integers) -> None:
    """Nodes that coincide become the one with the lowest number, which keeps it."""
    wrong = mesh_error(numbering.path)
    target = representatives(pairs, len(mesh.points))
    kept = target == np.arange(len(target))
    index = (np.cumsum(kept) - 1)[target]
    numbering.rows = index
    mesh.cells = index[mesh.cells]
    mesh.points, mesh.node_numbers, mesh.used = mesh.points[kept], mesh.node_numbers[kept], mesh.used[kept]
    row = np.sort(mesh.cells, axis=1)
    collapsed = np.flatnonzero((row[:, 1:] == row[:, :-1]).any(axis=1))
    if len(collapsed):
        first = mesh.cell_numbers[collapsed[0]]
        raise wrong(
            f"merging nodes collapses {len(collapsed)} elements, first element {first}",
            cure="mend the mesh: it has edges of no length",
        )
    keys = row_keys(mesh.cells, len(mesh.points))
    twice = len(keys) - len(np.unique(keys))
    if twice:
        raise wrong(f"merging nodes lays {twice} elements on others", cure="mend the mesh: bodies overlap")


def _orient(mesh: Mesh, kind: Kind, path: Path) -> None:
    """Turn cells that are all negative; refuse a mesh where some are, or some are flat."""
    size = edge_lengths(mesh.points, mesh.cells, kind)[1] ** kind.dimension
    relative = determinants(mesh.points, mesh.cells, kind) / np.where(size > 0, size, 1)[:, None]
    worst, best = relative.min(axis=1), relative.max(axis=1)
    if (worst > FLAT).all():
        return
    if (best < -FLAT).all():
        mesh.cells = mesh.cells[:, kind.mirrored]
        mesh.notes.append(f"all {len(mesh.cells)} elements were inverted: order of their nodes reversed")
        return
    negative = best < -FLAT
    if 2 * np.count_nonzero(negative) > len(negative):
        negative = worst > FLAT
    flat = (worst <= FLAT) & (best >= -FLAT)
    first = np.flatnonzero(negative | flat)[0]
    centroid = _place(mesh.points[mesh.cells[first, : kind.corners]].mean(axis=0))
    which = f"first element {mesh.cell_numbers[first]} with centroid {centroid}"
    counts = [(np.count_nonzero(negative), "inverted"), (np.count_nonzero(flat), "flat or twisted")]
    listing = " and ".join(f"{count} {what}" for count, what in counts if count)
    raise mesh_error(path)(
        f"{listing} of {len(negative)} elements, {which}",
        cure="mend the mesh: all elements must have the same orientation and a volume",
    )


def _build_groups(
    mesh: Mesh, raw: RawMesh, blocks: list[Block], membership: dict[str, Integers], numbering: NodeNumbers
) -> None:
    """Groups of the parts and cells that have the name; parts with nodes no cell uses are left out."""
    kind = KINDS[mesh.kind]
    rows: dict[str, list[Integers]] = {name: [] for name in raw.names}
    parts: dict[str, dict[int, list[Integers]]] = {name: {} for name in raw.names}
    dropped: dict[str, int] = {}
    for block in blocks:
        if not block.names:
            continue
        nodes = numbering.of(block)
        corners = _corners_of_parts(nodes, block.kind, kind, numbering.path)
        there = mesh.used[corners].all(axis=1)
        own = nodes[there].ravel()
        for name in block.names:
            rows[name].append(own[mesh.used[own]])
            parts[name].setdefault(KINDS[block.kind].dimension, []).append(corners[there])
            if not there.all():
                dropped[name] = dropped.get(name, 0) + np.count_nonzero(~there)
    if dropped:
        listing = ", ".join(f"{count} of {name}" for name, count in dropped.items())
        mesh.notes.append(f"parts of groups whose corners belong to no element are left out: {listing}")
    for name, numbers in raw.node_sets.items():
        nodes = numbering.find(numbers)
        rows[name].append(nodes[(nodes >= 0) & mesh.used[nodes]])
    apart: dict[str, Integers] = {}
    for name, cells in membership.items():
        nodes = np.unique(mesh.cells[cells])
        if (
            name in raw.materials
            and rows[name]
            and not np.array_equal(np.unique(np.concatenate(rows[name])), nodes)
        ):
            apart[name] = cells
            continue
        rows[name].append(nodes)
        parts[name][kind.dimension] = [mesh.cells[cells, : kind.corners]]
    if apart:
        mesh.notes.append(
            f"{', '.join(apart)}: sets of nodes or faces, and sets of other elements, of one name: materials take the elements"
        )
    bound = len(mesh.points)
    for name in raw.names:
        nodes = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *rows[name]]))
        own = {d: unique_rows(np.concatenate(found), bound) for d, found in sorted(parts[name].items())}
        own = {dimension: found for dimension, found in own.items() if len(found)}
        if set(own) == {0} and len(nodes) > 1:  # several points are a set of nodes, which may cover faces
            own = {}
        mesh.groups[name] = Group(name, nodes, own, apart.get(name))


def _corners_of_parts(nodes: Integers, name: str, kind: Kind, path: Path) -> Integers:
    """Corners (m, c) of parts (m, k), which must be such as cells of `kind` have."""
    part = KINDS[name]
    corners = nodes[:, : part.corners]
    side = part_kind(kind.dimension - 1, len(kind.sides[0]))
    if len(nodes) and part.dimension == side.dimension and part.corners != side.corners:
        raise mesh_error(path)(
            f"found {len(nodes)} {name} parts in groups, expected {side.name} parts on {kind.name} cells",
            cure="mesh surfaces and body together",
        )
    return corners
