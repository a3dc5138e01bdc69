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

from ancf_petsc.jit import address_of, composed, kernel
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


def loop(gather: Gather, action: Action) -> Callable:
    """The loop of one kernel, to be compiled into others."""
    states_of, enter, points, place = gather
    point, sums_of, close, _, start = action

    @composed
    def visit(fields, cells, parameters, span, out):
        seen = start
        states, sums = states_of(fields, cells), sums_of(cells, out)
        for e in range(span.first, span.last):
            frame = enter(e, fields, cells, states)
            for q in range(points(cells)):
                seen = point(place(frame, cells, q), states, parameters, sums, seen)
            close(frame, cells, parameters, sums, out)
        return seen

    return visit


def compiled(gather: Gather, action: Action, named_cells: Callable) -> Kernel:
    """The compiled loop of one kernel; see `interface` for its arguments.

    Plain tuples cross the border to compiled code: checking named ones there takes microseconds a call.
    """
    visit, named_out = loop(gather, action), action.named

    def of_plain_tuples(fields, cells, parameters, span, out):
        return visit(fields, named_cells(cells), parameters, Span(*span), named_out(out))

    of_plain_tuples.__name__ = action.point.__name__  # which names the machine code
    return _taking_named_tuples(kernel(of_plain_tuples))


def force_of_all(gather: Gather, action: Action, named_cells: Callable, cells: tuple) -> int:
    """Address of a loop over all cells, force_of_all(x, cells, parameters, out), for cells of these types; see `jit.call_at`."""
    visit = loop(gather, action)

    def force_of_all(x, cells, parameters, out):
        named = named_cells(cells)
        return visit((x,), named, parameters, Span(0, named.volumes.size), out)

    vector, field = types.Array(types.float64, 1, "C"), types.Array(types.float64, 2, "C")
    return address_of(force_of_all, types.float64(field, typeof(tuple(cells)), vector, field))


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
