"""What all pictures of a body share: window, camera, text. Works without a display, off screen."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Iterable
from typing import Any

import numpy as np
import pyvista
import vtkmodules.vtkRenderingFreeType  # noqa: F401  vtkTextRenderer has an instance from then on
from numpy.typing import NDArray
from vtkmodules.vtkCommonCore import vtkLogger
from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter
from vtkmodules.vtkRenderingCore import vtkTextRenderer

from ancf_petsc.errors import EnvironmentProblem
from ancf_petsc.post.panels import GREY

SIZE = (1500, 1100)
VIEW = np.array([1.0, -1.45, 0.75])  # from where; z is up
FILLED = 0.82  # part of the window's height or width that the body takes
DARK = "#222222"
MANY_CELLS = 30_000  # edges of more cells would paint the body black


def make_plotter(*, off_screen: bool, smooth: bool = True) -> pyvista.Plotter:
    """An empty white scene; smooth: without steps along edges, which takes most of a picture's time.

    Raises EnvironmentProblem where a window is wanted and there is no display.
    """
    if not off_screen and not has_display():
        raise EnvironmentProblem("there is no display to open a window on; use --screenshot FILE")
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)  # a missing X server is no news off screen
    renderer = vtkTextRenderer.GetInstance()
    renderer.SetDefaultBackend(renderer.FreeType)  # else two dollars make a formula, and a bar columns
    plotter = pyvista.Plotter(off_screen=off_screen, window_size=list(SIZE))
    plotter.set_background("white")
    if smooth:
        plotter.enable_anti_aliasing("ssaa" if off_screen else "msaa")
    return plotter


def has_display() -> bool:
    """Whether a window can be opened; other systems than Linux always have one."""
    return platform.system() != "Linux" or any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY")
    )


def surface(grid: pyvista.UnstructuredGrid) -> pyvista.PolyData:
    """The outside, with its fields; curved cells are drawn curved."""
    skin = vtkDataSetSurfaceFilter()  # pyvista's own way to it changes between versions
    skin.SetInputData(grid)
    skin.SetNonlinearSubdivisionLevel(3)
    skin.Update()
    return pyvista.wrap(skin.GetOutput())


def outline(skin: pyvista.PolyData) -> tuple[pyvista.PolyData, dict[str, Any]]:
    """What shows a body without hiding another, and how add_mesh draws it: its sharp edges; of a body without
    any, such as a ball, all of it, hardly there; of beams their lines.
    """
    if skin.GetNumberOfPolys() == 0:
        return skin, {"line_width": 1.2, "opacity": 0.8}
    edges = skin.extract_feature_edges(25)
    if edges.n_points:
        return edges, {"line_width": 1.2, "opacity": 0.8}
    return skin, {"opacity": 0.15, "lighting": False}


def matt(cells: int, *, lines: bool = False) -> dict[str, Any]:
    """How add_mesh draws a body: colours little changed by light, thin edges; beams as thick lines."""
    if lines:
        return {"line_width": 9, "render_lines_as_tubes": True, "ambient": 0.5, "reset_camera": False}
    return {
        "ambient": 0.42,
        "diffuse": 0.66,
        "specular": 0.0,
        "show_edges": cells <= MANY_CELLS,
        "edge_color": "#303030",
        "edge_opacity": 0.35,
        "line_width": 0.6,
        "reset_camera": False,
    }


def frame(plotter: pyvista.Plotter, positions: Iterable[NDArray[np.float64]], *, right: float = 0.0) -> None:
    """Look at all positions, arrays (n, 3), from VIEW, z up, filling the window but a part on the right."""
    towards = VIEW / np.linalg.norm(VIEW)
    across = np.cross([0.0, 0.0, 1.0], towards)
    across /= np.linalg.norm(across)
    up = np.cross(towards, across)
    axes = np.column_stack([across, up, towards])
    ends = np.array(
        [[seen.min(axis=0), seen.max(axis=0)] for seen in (points @ axes for points in positions)]
    )
    low, high = ends[:, 0].min(axis=0), ends[:, 1].max(axis=0)
    wide, tall = plotter.window_size
    aspect = wide / tall * (1 - right)
    width, height, depth = high - low
    half = max(height, width / aspect) / 2 / FILLED
    focus = axes @ ((low + high) / 2 + np.array([half * wide / tall * right, 0.0, 0.0]))
    camera = plotter.camera
    camera.focal_point = focus
    camera.position = focus + 4 * (half + depth) * towards
    camera.up = up
    camera.parallel_projection = True
    camera.parallel_scale = half
    camera.clipping_range = (0.1 * half, 8 * (half + depth))


def one_line(text: str) -> str:
    """A text of the user's for VTK as it was typed: dollars make no formula, line breaks are blanks."""
    return re.sub(r"\s*\n\s*", " ", text).replace("$", r"\$")


def write_texts(plotter: pyvista.Plotter, title: str, line: str, note: str) -> None:
    """Title and a line in the upper left corner, the note at the bottom; each replaces the one before."""
    tall = plotter.window_size[1]
    for name, text, height, size, colour in (
        ("title", title, tall - 52, 15, DARK),
        ("line", line, tall - 88, 11, GREY),
        ("note", note, 18, 8, GREY),
    ):
        if text:
            place = (26, height)
            plotter.add_text(
                one_line(text), position=place, font_size=size, color=colour, name=name, render=False
            )
