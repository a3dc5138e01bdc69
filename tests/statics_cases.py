"""Static cases that several tests run, made in Python as a script would make them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

MESHES = Path(__file__).resolve().parent.parent / "meshes"
BLOCK = {
    "bottom": {"fix": ["x", "y", "z"]},
    "symmetry_x": {"fix": ["x"]},
    "symmetry_y": {"fix": ["y"]},
}


def block(mesh: str, stroke: float, **statics: Any) -> dict[str, Any]:
    """A quarter block with bonded ends, its top moved down by `stroke`."""
    return {
        "title": "Quarter block, ends bonded",
        "mesh": {"file": str(MESHES / mesh), "element": "3413"},
        "material": {"law": "svk", "young": 6.8e6, "poisson": 0.35},
        "constraint": [
            *({"group": name, **what} for name, what in BLOCK.items()),
            {"group": "top", "fix": ["x", "y"], "move": {"z": -stroke}, "ramp": "cosine"},
        ],
        "statics": statics or {"steps": 10},
        "output": {"curve": {"force": "top.z", "stroke": "top.z"}},
    }


def bar(mesh: str, *, gravity: bool) -> dict[str, Any]:
    """The bar of section 5.1: 120 N along the edges of its lower face, with or without its own weight."""
    force = {"type": "force", "group": "bottom_edges", "total": [0.0, 0.0, -120.0]}
    weight = {"type": "gravity", "acceleration": [0.0, 0.0, -9.81]}
    middle = [[x, y, -0.25] for x in (0.0, 0.1) for y in (0.0, 0.1)]
    end = [[x, y, -0.5] for x in (0.0, 0.1) for y in (0.0, 0.1)]
    return {
        "title": "Bar in tension",
        "mesh": {"file": str(MESHES / mesh), "element": "3413"},
        "groups": {"middle": {"nearest": middle}, "end": {"nearest": end}},
        "material": {"law": "svk", "young": 2e5, "poisson": 0.3, "density": 7800.0},
        "constraint": [{"group": "top", "fix": ["x", "y", "z"]}],
        "load": [force, weight] if gravity else [force],
        "statics": {"steps": 2},
        "probe": [{"name": "middle", "group": "middle"}, {"name": "end", "group": "end"}],
    }
