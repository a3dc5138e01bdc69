"""The one loop over cells and quadrature points, from which every kernel is made.

A kernel is a layout of cells with what happens at a point and at the end of a cell. All of them are compiled into the loop:

    states = gather.states(fields, cells)                        where nodal vectors of a cell are gathered
    sums = action.sums(cells, out)                                 what points add to
    for e in cells:
        frame = gather.enter(e, fields, cells, states)           gathers; what all points of the cell share
        for q in points:
            at = gather.place(frame, cells, q)                   the point
            seen = action.point(at, states, parameters, sums, seen)
        action.close(frame, cells, parameters, sums, out)          gives the sums away, leaves them zero

`seen` starts with `action.start` and is returned: an energy, the smallest det F. A mean over the cell that points need is made in
`enter`; a map from the reference cell that differs from point to point in `place`; what a cell adds once in `close`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from numba import typeof, types

from ancf_petsc.jit import address_of, kernel
from ancf_petsc.kernel.interface import Kernel, Means, Span, Target
from ancf_petsc.material.tensor import inlined


class Gather(NamedTuple):
    """How a number of nodal fields is brought to the points of a layout of cells; see the head of the module."""

    states: Callable
    enter: Callable
    points: Callable
    place: Callable


class Action(NamedTuple):
    """What a kernel does; see the head of the module. named: gives `out` its names back."""

    point: Callable
    sums: Callable
    close: Callable
    named: Callable
    start: float = 0.0


def loop(gather: Gather, action: Action, named_cells: Callable) -> Callable:
    """The loop of one kernel, to be compiled; see `interface` for its arguments.

    It takes plain tuples and gives them their names: checking named ones at the border to compiled code takes microseconds a call.
    """
    states_of, enter, points, place = gather
    point, sums_of, close, named_out, start = action

    def visit(fields, bare_cells, parameters, span, bare_out):
        cells, out, seen = named_cells(bare_cells), named_out(bare_out), start
        states, sums = states_of(fields, cells), sums_of(cells, out)
        for e in range(span[0], span[1]):
            frame = enter(e, fields, cells, states)
            for q in range(points(cells)):
                seen = point(place(frame, cells, q), states, parameters, sums, seen)
            close(frame, cells, parameters, sums, out)
        return seen

    visit.__name__ = point.__name__  # which names the machine code
    return visit


def compiled(gather: Gather, action: Action, named_cells: Callable) -> Kernel:
    """The kernel of a loop."""
    return _taking_named_tuples(kernel(loop(gather, action, named_cells)))


def force_loop(gather: Gather, action: Action, named_cells: Callable, cells: tuple) -> int:
    """Address of a loop that adds to a force, for one field and cells of these types; see `jit.call_at`."""
    vector, field = types.Array(types.float64, 1, "C"), types.Array(types.float64, 2, "C")
    span, fields = types.UniTuple(types.int64, 2), types.UniTuple(field, 1)
    signature = types.float64(fields, typeof(tuple(cells)), vector, span, field)
    return address_of(loop(gather, action, named_cells), signature)


def _taking_named_tuples(compiled_loop: Callable) -> Kernel:
    """The kernel of a loop of plain tuples. py_func: the same, run by Python; loop: what numba compiles."""

    def calling(function: Callable) -> Any:
        def call(fields: tuple, cells: tuple, parameters: Any, span: Span, out: Any = ()) -> Any:
            bare = tuple(out) if isinstance(out, tuple) else out
            return function(fields, tuple(cells), parameters, tuple(span), bare)

        call.__name__, call.__qualname__ = compiled_loop.__name__, compiled_loop.__qualname__
        return call

    call = calling(compiled_loop)
    call.py_func, call.loop = calling(getattr(compiled_loop, "py_func", compiled_loop)), compiled_loop
    return call


# --- parts of actions


@inlined
def as_given(out):
    """`out` where it is an array or nothing."""
    return out


@inlined
def named_target(out):
    return Target(*out)


@inlined
def named_means(out):
    return Means(*out)


@inlined
def sums_in_place(cells, out):
    """Points write to `out` itself."""
    return out


@inlined
def nothing_to_close(frame, cells, parameters, sums, out):
    pass
