"""A picture of a case before it is solved: mesh, groups, what is held, moved and loaded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import cycle
from pathlib import Path

import numpy as np
import pyvista
from numpy.typing import NDArray

from ancf_petsc.axes import AXES
from ancf_petsc.mesh.groups import surface_of
from ancf_petsc.mesh.mesh import Group, Mesh
from ancf_petsc.post.panels import COLOURS
from ancf_petsc.post.scene import DARK, MANY_CELLS, frame, make_plotter, matt, one_line, surface, write_texts
from ancf_petsc.results.xdmf import CELL_KINDS

Points = NDArray[np.float64]
GROUP_COLOURS = (COLOURS[2], COLOURS[4], COLOURS[5], COLOURS[3])  # what arrows have is left out
HELD, MOVED, LOADED = "#444444", "#D55E00", "#0072B2"


@dataclass(frozen=True)
class Marked:
    """What happens to a group: components held, displacements of components moved, a total force."""

    group: str
    fixed: Sequence[str] = ()
    moves: dict[str, float] = field(default_factory=dict)
    force: Sequence[float] = ()

    @property
    def words(self) -> str:
        parts = ["held " + " ".join(self.fixed)] if self.fixed else []
        parts += [f"{axis} moved by {amount:g}" for axis, amount in self.moves.items()]
        parts += ["force " + " ".join(f"{part:g}" for part in self.force)] if len(self.force) else []
        return ", ".join(parts)


def screenshot(mesh: Mesh, supports: Sequence[Marked], title: str, note: str, file: Path) -> None:
    """A picture of the case."""
    plotter = scene(mesh, supports, title, note, off_screen=True)
    plotter.screenshot(str(file))
    plotter.close()


def explore(mesh: Mesh, supports: Sequence[Marked], title: str, note: str) -> None:
    """A window to turn the case around."""
    scene(mesh, supports, title, note, off_screen=False).show(title=title)


def scene(
    mesh: Mesh, supports: Sequence[Marked], title: str, note: str, *, off_screen: bool
) -> pyvista.Plotter:
    """The body, translucent; its groups in colours with names; cones where it is held, arrows where moved."""
    plotter = make_plotter(off_screen=off_screen)
    plotter.enable_depth_peeling(8)
    body = surface(_grid(mesh))
    plotter.add_mesh(body, color="#e6e9ed", opacity=0.3, **matt(len(mesh.cells)) | {"show_edges": False})
    if len(mesh.cells) <= MANY_CELLS:
        edges = body.extract_all_edges()
        plotter.add_mesh(edges, color="#303030", opacity=0.3, line_width=0.7, reset_camera=False)
    words = _words(mesh, supports)
    for group, colour in zip(_shown(mesh, supports), cycle(GROUP_COLOURS), strict=False):
        plotter.add_mesh(_shape(mesh, group), color=colour, reset_camera=False, **_paint(mesh, group))
        _add_label(plotter, mesh.points[group.nodes].mean(axis=0), words[group.name], colour)
    marks = [_add_marks(plotter, mesh, support) for support in supports]
    frame(plotter, [mesh.points[mesh.used], *(reached for reached in marks if len(reached))])
    line = f"{int(mesh.used.sum())} nodes, {len(mesh.cells)} cells; cones: held, arrows: moved or pushed"
    write_texts(plotter, title, line, note)
    return plotter


def _add_label(plotter: pyvista.Plotter, place: Points, text: str, colour: str) -> None:
    pale = 0.35 * np.array(pyvista.Color(colour).float_rgb) + 0.65
    plotter.add_point_labels(
        [place],
        [one_line(text)],
        show_points=False,
        always_visible=True,
        font_size=19,
        text_color=DARK,
        shape_color=tuple(pale),
        shape_opacity=0.85,
        bold=False,
        margin=5,
        reset_camera=False,
    )


def _words(mesh: Mesh, supports: Sequence[Marked]) -> dict[str, str]:
    """Name of each group and all that happens to it."""
    said = {
        name: ", ".join(support.words for support in supports if support.group == name)
        for name in mesh.groups
    }
    return {name: f"{name}: {words}" if words else name for name, words in said.items()}


def _shown(mesh: Mesh, supports: Sequence[Marked]) -> list[Group]:
    """Groups of the case's supports first. Whole bodies are left out, and second names of the same nodes: their labels
    would lie on each other.
    """
    used = dict.fromkeys(support.group for support in supports)
    shown: dict[bytes, Group] = {}
    for name in [*used, *(name for name in mesh.groups if name not in used)]:
        group = mesh.groups[name]
        if len(group.nodes) < mesh.used.sum():
            shown.setdefault(name.encode() if name in used else group.nodes.tobytes(), group)
            shown.setdefault(group.nodes.tobytes(), group)
    return list({id(group): group for group in shown.values()}.values())


def _shape(mesh: Mesh, group: Group) -> pyvista.PolyData:
    """Faces of a surface, lines of an edge, else points."""
    faces = surface_of(mesh, group)
    lines = group.parts.get(1)
    if faces is not None and faces.shape[1] >= 3:
        corners = 3 if faces.shape[1] in (3, 6) else 4
        return pyvista.PolyData(mesh.points, faces=_counted(faces[:, :corners]))
    if lines is not None and len(lines):
        return pyvista.PolyData(mesh.points, lines=_counted(lines[:, :2]))
    return pyvista.PolyData(mesh.points[group.nodes])


def _paint(mesh: Mesh, group: Group) -> dict[str, object]:
    faces = surface_of(mesh, group)
    if faces is not None and faces.shape[1] >= 3:
        return {"opacity": 0.5, "lighting": False}
    if group.parts.get(1) is not None:
        return {"line_width": 5, "render_lines_as_tubes": True}
    return {"point_size": 13, "render_points_as_spheres": True, "style": "points"}


def _add_marks(plotter: pyvista.Plotter, mesh: Mesh, support: Marked) -> Points:
    """Cones and arrows at some of the group's nodes; the points (m, 3) they reach to."""
    size = mesh.size
    reached = [np.empty((0, 3))]
    nodes = mesh.points[_spread(mesh, mesh.groups[support.group].nodes)]
    for axis in support.fixed:
        direction = np.eye(3)[AXES.index(axis)]
        cone = pyvista.Cone(
            center=-0.5 * direction, direction=direction, height=1.0, radius=0.35, resolution=12
        )
        marks = pyvista.PolyData(nodes).glyph(geom=cone, scale=False, orient=False, factor=0.018 * size)
        plotter.add_mesh(marks, color=HELD, ambient=0.4, reset_camera=False)
    moves = np.array([support.moves.get(axis, 0.0) for axis in AXES])
    outwards = nodes.mean(axis=0) - mesh.points[mesh.used].mean(axis=0)
    for vector, colour in ((moves, MOVED), (np.asarray(support.force, float), LOADED)):
        if np.any(vector):
            direction = vector / np.linalg.norm(vector)
            start = -1.0 if direction @ outwards < 0 else 0.0  # outside the body: tips or tails on the nodes
            arrow = pyvista.Arrow(
                start=start * direction, direction=direction, tip_radius=0.09, shaft_radius=0.03
            )
            marks = pyvista.PolyData(nodes).glyph(geom=arrow, scale=False, orient=False, factor=0.09 * size)
            plotter.add_mesh(marks, color=colour, ambient=0.4, reset_camera=False)
            reached.append(marks.points)
    return np.vstack(reached)


def _spread(mesh: Mesh, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """A few of many nodes, one a box of a grid: marks stay apart on fine meshes, and small groups show several."""
    points = mesh.points[nodes]
    spacing = np.clip(np.linalg.norm(np.ptp(points, axis=0)) / 4, mesh.size / 50, mesh.size / 14)
    boxes = np.floor(points / spacing).astype(int)
    _, first = np.unique(boxes, axis=0, return_index=True)
    return nodes[first]


def _counted(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """VTK's list of parts: the number of corners before each."""
    return np.hstack([np.full((len(rows), 1), rows.shape[1]), rows]).ravel()


def _grid(mesh: Mesh) -> pyvista.UnstructuredGrid:
    kinds = np.full(len(mesh.cells), CELL_KINDS[mesh.kind].vtk)
    return pyvista.UnstructuredGrid(_counted(mesh.cells), kinds, mesh.points)
