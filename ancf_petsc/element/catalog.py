"""The catalogue of elements, one row each; `Element` says what a row means.

Source: Olshevskiy et al., Nonlinear Dynamics 88 (2017) 2457, Sec. 2. The numbers of quadrature points are the
fewest with which the claims of `Element.points` hold; the tests of the catalogue check them.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cache

from ancf_petsc.element import dncm
from ancf_petsc.element.element import Element
from ancf_petsc.errors import CaseError, did_you_mean

SERENDIPITY = "P3 x3y x3z xy3 y3z xz3 yz3 x2yz xy2z xyz2 x3yz xy3z xyz3"

ELEMENTS: dict[str, Element] = {
    element.code: element
    for element in (
        Element(
            "3413",
            name="linear tetrahedron",
            cell_name="tetra",
            kinds=("tetra",),
            monomials="P1",
            complete=1,
            points={"default": 1, "exact": 1, "mass": 4},
        ),
        Element(
            "3-10-1-3",
            name="quadratic tetrahedron",
            cell_name="tetra",
            kinds=("tetra10", "tetra"),
            edge=1,
            monomials="P2",
            complete=2,
            points={"default": 14, "reduced": 4, "exact": 14, "mass": 14},
        ),
        Element(
            "3443",
            name="tetrahedron with slopes",
            cell_name="tetra",
            kinds=("tetra",),
            corner=4,
            condensed=True,
            monomials="P3",
            complete=2,
            points={"default": 14, "reduced": 10, "exact": 46, "mass": 24},
        ),
        Element(
            "3443+4",
            name="tetrahedron with slopes and face centres",
            cell_name="tetra",
            kinds=("tetra",),
            corner=4,
            face=1,
            monomials="P3",
            complete=3,
            points={"default": 24, "reduced": 10, "exact": 46, "mass": 24},
        ),
        Element(
            "3813",
            name="trilinear brick",
            cell_name="hexahedron",
            kinds=("hexahedron",),
            monomials="1 x y z xy yz xz xyz",
            complete=1,
            points={"default": 8, "exact": 27, "mass": 8},
        ),
        Element(
            "3843",
            name="brick with slopes",
            cell_name="hexahedron",
            kinds=("hexahedron",),
            corner=4,
            monomials=SERENDIPITY,
            complete=3,
            points={"default": 64, "reduced": 27, "exact": 343, "mass": 64},
        ),
        Element(
            "2312",
            name="linear triangle",
            cell_name="triangle",
            kinds=("triangle",),
            monomials="P1",
            complete=1,
            points={"default": 1, "exact": 1, "ring": 3, "mass": 6},
        ),
        Element(
            "2-6-1-2",
            name="quadratic triangle",
            cell_name="triangle",
            kinds=("triangle6", "triangle"),
            edge=1,
            monomials="P2",
            complete=2,
            points={"default": 6, "reduced": 3, "exact": 6, "mass": 7},
        ),
        Element(
            "2412",
            name="bilinear quadrilateral",
            cell_name="quad",
            kinds=("quad",),
            monomials="1 x y xy",
            complete=1,
            points={"default": 4, "exact": 9, "mass": 4},
        ),
        Element(
            "2432",
            name="quadrilateral with slopes",
            cell_name="quad",
            kinds=("quad",),
            corner=3,
            monomials="P3 x3y xy3",
            complete=3,
            points={"default": 16, "reduced": 9, "exact": 49, "mass": 16},
        ),
        Element(
            "1222",
            name="planar beam",
            cell_name="line",
            kinds=("line",),
            corner=2,
            monomials="P3",
            complete=3,
            points={"default": 5, "reduced": 3, "exact": 5, "mass": 4},
            continuity=1,
        ),
    )
}


@cache
def element(code: str) -> Element:
    """The element with this code, with dashes or without. Raises CaseError with the codes there are."""
    written = str(code)
    if written not in ELEMENTS:
        with suppress(CaseError):
            written = str(dncm.parse(written))
    if written not in ELEMENTS:
        raise CaseError(
            key="mesh.element",
            got=code,
            expected="a code of the catalogue",
            cure=did_you_mean(str(code), tuple(ELEMENTS)),
        )
    return ELEMENTS[written]


def table() -> list[dict[str, str]]:
    """The catalogue for people: column title -> text, one row per element."""
    return [
        {
            "code": row.code,
            "element": row.name,
            "cells": ", ".join(row.kinds),
            "nodes": str(len(row.nodes)),
            "monomials": row.monomials,
            "functions": str(row.functions),
            "degrees of freedom": str(row.dncm.unknowns),
            "quadrature": ", ".join(f"{name} {points}" for name, points in row.points.items()),
            "continuity": f"C{row.continuity}",
            "complete to degree": str(row.complete),
        }
        for row in ELEMENTS.values()
    ]
