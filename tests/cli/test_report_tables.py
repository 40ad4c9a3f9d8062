"""Tables and JSON of reports, from made-up rows."""

from __future__ import annotations

import json
import math

from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.notation.page import UNBROKEN, page
from lagrange_cli.report.tables import TableColumn, json_text, labelled, sentence_row, table

COLUMNS = (TableColumn("name"), TableColumn("value", 6, ">"), TableColumn("why"))
CELLS = st.text("abc ", max_size=8).map(str.strip)


def lines(rows, width=UNBROKEN):
    return page([rows]).text(width).splitlines()


def test_table_in_full():
    rows = [["pendulum", "1.5", "it swings"], ["top", "-12345678", ""], ["x", "3", ""]]
    assert lines(table(COLUMNS, rows)) == [
        "  name          value  why",
        "  pendulum        1.5  it swings",
        "  top       -12345678",
        "  x                 3",
    ]
    assert lines(table(COLUMNS, [])) == ["  name   value  why"]


@given(st.lists(st.tuples(CELLS, CELLS, CELLS), max_size=6))
def test_columns_begin_at_one_place(rows):
    """Cells that fit are found where their column stands, whatever the others hold."""
    rows = [(name, value[:6].strip(), why) for name, value, why in rows]
    heading, *below = lines(table(COLUMNS, rows))
    third = heading.index("why")
    for (name, value, why), line in zip(rows, below, strict=True):
        assert not line.endswith(" ")
        assert line[2 : 2 + len(name)] == name
        assert line[: third - 2].strip().endswith(value)
        assert line[third:] == why


def test_texts_stand_behind_the_widest_label():
    rows = [("Code", "C"), ("Constraints", "1e-9")]
    assert lines(labelled(*rows)) == ["Code         C", "Constraints  1e-9"]
    assert lines(labelled(*rows, indent=2)) == ["  Code         C", "  Constraints  1e-9"]


def test_last_cells_and_texts_are_broken_where_a_window_ends():
    rows = [["top", "3", "it spins longer than it swings"]]
    assert lines(table(COLUMNS, rows), 34) == [
        "  name   value  why",
        "  top        3  it spins longer",
        "                than it swings",
    ]
    assert lines(labelled(("Code", "compiled C, stepped by SciPy")), 20) == [
        "Code  compiled C,",
        "      stepped by",
        "      SciPy",
    ]
    assert lines([sentence_row("top: two runs of one")], 14) == ["top: two runs", "     of one"]


def test_json_has_null_for_what_is_no_number():
    value = {"a": [1.5, math.nan], "b": {"c": math.inf}, "d": (-math.inf, "é")}
    assert json.loads(json_text(value)) == {"a": [1.5, None], "b": {"c": None}, "d": [None, "é"]}
    assert "é" in json_text(value)
    assert "\\u00e9" in json_text(value, ascii=True)
