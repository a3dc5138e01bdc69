"""Tables of docs/motion.md from studies: how far models of one body are apart."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from study_list import KEPT

from ancf_petsc.post.charts.study_table import StudyRow, read_study, written


def models(name: str) -> Iterator[str]:
    """Distances of the models of one study from its reference."""
    yield "| model | elements | largest distance of the tip's height | height after 1 s, m |"
    yield "|---|---|---|---|"
    for row in read_study(KEPT / name).rows:
        yield f"| {model(row)} | {row.text('elements')} | {100 * row.number('apart'):.2g} % | {row.number('tip'):.5f} |"


def model(row: StudyRow) -> str:
    """Element and mesh."""
    size = row.number("mesh.size")
    mesh = (
        f"edges of {size:g} m"
        if size == size
        else " x ".join(written(row.text("mesh.divisions")).strip("[]").split(","))
    )
    return f"{row.text('mesh.element')}, {mesh}"


BLOCKS = {name: partial(models, name) for name in ("pendulum_models", "pendulum_models_damped")}
