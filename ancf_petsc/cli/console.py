"""Tables and headings for the terminal, shared by the verbs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING

from ancf_petsc.log import on_terminal

if TYPE_CHECKING:
    from rich.console import Console

PIPE_WIDTH = 200


@cache
def console() -> Console:
    """The console of standard output; into a pipe or file lines are not cut at 80 columns."""
    from rich.console import Console

    seen = on_terminal()
    width = None if seen else PIPE_WIDTH
    return Console(width=width, highlight=False, emoji=False, soft_wrap=not seen, force_terminal=seen)


def show_table(columns: Sequence[str], rows: Iterable[Sequence[object]], *, title: str = "") -> None:
    """A table with a heading a column; numbers stand right, in six digits."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE_HEAD, title=title or None, title_justify="left", pad_edge=False)
    held = [list(row) for row in rows]
    for index, name in enumerate(columns):
        cells = [row[index] for row in held if row[index] is not None]
        numbers = bool(cells) and all(map(is_number, cells))
        table.add_column(Text(name), justify="right" if numbers else "left", overflow="fold")
    for row in held:
        table.add_row(*(Text(written(cell)) for cell in row))
    console().print(table)


def show_facts(facts: Iterable[tuple[str, object]], *, title: str = "") -> None:
    """Names with their values, one a line."""
    from rich.table import Table
    from rich.text import Text

    grid = Table.grid(padding=(0, 2))
    for name, value in facts:
        grid.add_row(Text(name, style="dim"), Text(written(value)))
    if title:
        console().print(Text(title, style="bold"))
    console().print(grid)


def is_number(value: object) -> bool:
    """Whether a value stands right in a table."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def written(value: object) -> str:
    """A cell: whole numbers as they are, others in six digits, nothing for None."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)
