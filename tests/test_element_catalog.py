"""Codes, rows and messages of the catalogue."""

import numpy as np
import pytest

from ancf_petsc.element import dncm
from ancf_petsc.element.catalog import ELEMENTS, element, table
from ancf_petsc.element.cell import CELLS, cell_geometry
from ancf_petsc.element.element import Element
from ancf_petsc.errors import CaseError, MeshError


@pytest.mark.parametrize(
    ("written", "printed", "functions", "unknowns"),
    [
        ("3413", "3413", 4, 12),
        ("3-4-1-3", "3413", 4, 12),
        ("3-10-1-3", "3-10-1-3", 10, 30),
        ("3443+4", "3443+4", 20, 60),
        ("3843", "3843", 32, 96),
        ("2432", "2432", 12, 24),
        ("1222", "1222", 4, 8),
        ("3-27-4-3", "3-27-4-3", 108, 324),
    ],
)
def test_codes_are_read_and_printed(written, printed, functions, unknowns):
    code = dncm.parse(written)
    assert (str(code), code.functions, code.unknowns) == (printed, functions, unknowns)
    assert dncm.parse(str(code)) == code


def test_a_code_in_words():
    assert dncm.parse("3443+4").meaning == (
        "solid of 4 nodes with position and 3 slopes, 4 more nodes with position, "
        "3 components: 60 degrees of freedom"
    )


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("3x13", "four digits dncm"),
        ("31013", "four digits dncm"),
        ("4413", "a dimension d of 1, 2 or 3"),
        ("3313", "at least 4 nodes n"),
        ("3423", "c = 1 (position) or c = 4"),
        ("3412", "m from 3 to 3"),
    ],
)
def test_codes_that_are_none(written, expected):
    with pytest.raises(CaseError) as caught:
        dncm.parse(written)
    assert expected in str(caught.value)
    assert f"mesh.element: found '{written}'" in str(caught.value)


def test_unknown_element_says_which_there_are():
    with pytest.raises(CaseError) as caught:
        element("3431")
    line = str(caught.value)
    assert line.startswith("mesh.element: found '3431', expected a code of the catalogue; did you mean '3")
    assert all(code in line for code in ELEMENTS)


def test_an_element_is_found_however_it_is_written():
    assert element("3-4-1-3") is ELEMENTS["3413"]


def test_unknown_quadrature():
    with pytest.raises(
        CaseError, match="found 'reduce', expected a quadrature of element 3843; did you mean 'reduced'"
    ):
        element("3843").rule("reduce")


def test_the_table_has_a_row_per_element():
    rows = {row["code"]: row for row in table()}
    assert list(rows) == list(ELEMENTS)
    assert rows["3843"]["degrees of freedom"] == "96"
    assert rows["3443"]["quadrature"] == "default 14, reduced 10, exact 46, mass 24"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"monomials": "P2"}, "element 3413: 10 monomials, expected 4"),
        ({"edge": 1}, "element 3413: its nodes carry 10 vectors in dimension 3, its code says 4"),
        ({"cell_name": "quad"}, "element 3413: its nodes carry 4 vectors in dimension 2"),
    ],
)
def test_a_row_that_contradicts_itself_is_refused(change, message):
    row = {
        "name": "",
        "cell_name": "tetra",
        "kinds": ("tetra",),
        "monomials": "P1",
        "complete": 1,
        "points": {},
    }
    with pytest.raises(ValueError, match=message):
        Element("3413", **(row | change))


def test_functionals_that_do_not_determine_the_monomials_are_refused():
    """x² y² does not belong to a trilinear brick: its corners cannot tell it from a constant."""
    brick = Element("3813", "", "hexahedron", ("hexahedron",), "1 x y z xy yz xz x2y2", 1, {})
    with pytest.raises(ValueError, match="element 3813: .* W is singular"):
        brick.coefficients  # noqa: B018


def test_linear_tetrahedron_is_the_volume_coordinates():
    """Eq. (6) of the paper."""
    points = np.random.default_rng(0).random((5, 3))
    np.testing.assert_array_equal(ELEMENTS["3413"].values(points)[:, 1:], points)
    np.testing.assert_allclose(ELEMENTS["3413"].values(points)[:, 0], 1 - points.sum(axis=1), atol=1e-15)


def cube():
    return np.array(CELLS["hexahedron"].corners, dtype=float)[None] + 0.5


@pytest.mark.parametrize(
    ("name", "points", "message"),
    [
        ("tetra", np.eye(4, 3)[None], "tetra 17 at (0.25, 0.25, 0.25) is inside out or flat"),
        ("tetra", np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]]]), "is inside out or flat"),
        (
            "tetra",
            np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1e-9]]]),
            "is too flat for its shape functions",
        ),
        (
            "hexahedron",
            cube() + 1e-6 * np.eye(8, 3),
            "element 3843: hexahedron 17 at (0.5, 0.5, 0.5) is no parallelepiped",
        ),
    ],
)
def test_cells_that_cannot_be_computed_with(name, points, message):
    with pytest.raises(MeshError) as caught:
        cell_geometry(CELLS[name], points, element="3843", numbers=[17])
    assert message in str(caught.value)
    assert "expected" in str(caught.value)


def test_a_parallelepiped_may_be_off_by_rounding_and_far_away():
    """Coordinates 1e7 sizes from the origin are rounded to 2e-9 of the size: that is no fault of the mesh."""
    assert cell_geometry(CELLS["hexahedron"], cube() + 1e7 / 3).determinant == pytest.approx(1, rel=1e-7)
    assert cell_geometry(CELLS["hexahedron"], cube() + 1e-10 * np.eye(8, 3)).determinant == pytest.approx(1)
