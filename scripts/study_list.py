"""The studies that docs/accuracy.md, docs/stability.md and docs/motion.md are written from."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
KEPT = DOCS / "benchmarks" / "studies"
"""Tables of the studies as the pages show them: NAME.csv and NAME.json."""
PICTURES = DOCS / "pictures" / "studies"


class ShippedStudy(NamedTuple):
    """file: below cases/, without study_ and .toml. timed: whether its seconds are shown, so that it runs alone."""

    file: str
    timed: bool = False

    @property
    def path(self) -> Path:
        folder, _, name = self.file.partition("/")
        return ROOT / "cases" / folder / f"study_{name}.toml"

    @property
    def name(self) -> str:
        return self.file.replace("/", "_")


STUDIES = (
    ShippedStudy("pvc_block/accuracy", timed=True),
    ShippedStudy("pvc_block/revolution", timed=True),
    ShippedStudy("cantilever/accuracy", timed=True),
    ShippedStudy("pendulum/accuracy", timed=True),
    ShippedStudy("stiff_pendulum/stability"),
    ShippedStudy("tumbling_block/stability"),
    ShippedStudy("cantilever/explicit_limit"),
    ShippedStudy("pvc_block/compression"),
    ShippedStudy("pvc_block/incompressible"),
    ShippedStudy("cantilever/slenderness"),
    ShippedStudy("cantilever/slivers"),
    ShippedStudy("pvc_block/load_steps"),
    ShippedStudy("pvc_block/load_steps_pad"),
    ShippedStudy("cantilever/load_steps"),
    ShippedStudy("bar_tension/load_steps"),
    ShippedStudy("tumbling_block/lumped_mass"),
    ShippedStudy("bar_tension/meshes"),
    ShippedStudy("pendulum/models"),
    ShippedStudy("pendulum/models_damped"),
    ShippedStudy("ellipsograph/models"),
    ShippedStudy("pvc_block/loading_time"),
)
