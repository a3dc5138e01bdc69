"""CSV tables: every number comes back exactly, every line is whole."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ancf_petsc.errors import CaseError
from ancf_petsc.results.tables import CsvTable, read_table


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=1, max_size=20))
def test_floats_come_back_bit_for_bit(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("table") / "t.csv"
    with CsvTable(path, ["value", "row"]) as table:
        for row, value in enumerate(values):
            table.append([value, row])
    read = read_table(path)
    np.testing.assert_array_equal(read["value"], values)
    known = ~np.isnan(values)  # the sign of "not a number" has no meaning
    np.testing.assert_array_equal(np.signbit(read["value"])[known], np.signbit(values)[known])
    np.testing.assert_array_equal(read["row"], np.arange(len(values)))


def test_a_row_is_on_disk_when_append_returns(tmp_path):
    path = tmp_path / "t.csv"
    table = CsvTable(path, ["time", "force"])
    assert path.read_text() == "time,force\n"
    table.append({"force": np.float64(-0.1), "time": np.int64(2)})
    assert path.read_text() == "time,force\n2,-0.1\n"
    table.close()


def test_odd_names_of_groups_survive(tmp_path):
    names = ['end, "left".rx', "größe.z"]
    with CsvTable(tmp_path / "t.csv", names) as table:
        table.append([1.0, 2.0])
    assert {name: column.tolist() for name, column in read_table(tmp_path / "t.csv").items()} == {
        names[0]: [1.0],
        names[1]: [2.0],
    }


def test_a_line_cut_short_is_left_out(tmp_path):
    (tmp_path / "t.csv").write_text("a,b\n1,2\n3,4\n5,")
    assert read_table(tmp_path / "t.csv")["b"].tolist() == [2.0, 4.0]


def test_a_table_without_rows_has_empty_columns(tmp_path):
    CsvTable(tmp_path / "t.csv", ["a", "b"]).close()
    assert {name: column.size for name, column in read_table(tmp_path / "t.csv").items()} == {"a": 0, "b": 0}


@pytest.mark.parametrize(
    ("row", "message"),
    [([1.0], "1 values for 2 columns"), ({"a": 1.0, "c": 2.0}, r"columns \['b', 'c'\] do not match")],
)
def test_a_row_that_does_not_fit_is_refused(tmp_path, row, message):
    with CsvTable(tmp_path / "t.csv", ["a", "b"]) as table, pytest.raises(ValueError, match=message):
        table.append(row)


@pytest.mark.parametrize(
    ("text", "message"),
    [("a,b\n1,x\n", "no table of numbers"), ("a\n1,2\n", "found '2 columns', expected 1")],
)
def test_what_is_no_table_is_told(tmp_path, text, message):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(CaseError, match=message):
        read_table(tmp_path / "t.csv")


def test_a_missing_table_is_told(tmp_path):
    with pytest.raises(CaseError, match=r"t\.csv: cannot be read: No such file"):
        read_table(tmp_path / "t.csv")
