"""Tables and JSON of reports, from made-up rows."""

from __future__ import annotations

import json
import math

from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.cli.reports.json_text import json_text
from lagrange_cli.cli.reports.tables import TableColumn, labelled, table

COLUMNS = (TableColumn("name"), TableColumn("value", 6, ">", " "), TableColumn("why"))
CELLS = st.text("abc ", max_size=8).map(str.strip)


def test_table_in_full():
    rows = [["pendulum", "1.5", "it swings"], ["top", "-12345678"], ["x", "3", ""]]
    assert table(COLUMNS, rows) == [
        "  name      value  why",
        "  pendulum    1.5  it swings",
        "  top      -12345678",
        "  x             3",
    ]
    assert table(COLUMNS, rows[2:], heading=False) == ["  x      3"]
    assert table(COLUMNS, []) == ["  name  value  why"]


@given(st.lists(st.tuples(CELLS, CELLS, CELLS), max_size=6))
def test_columns_begin_at_one_place(rows):
    """Cells that fit are found where their column stands, whatever the others hold."""
    rows = [(name, value[:6].strip(), why) for name, value, why in rows]
    heading, *lines = table(COLUMNS, rows)
    third = heading.index("why")
    for (name, value, why), line in zip(rows, lines, strict=True):
        assert not line.endswith(" ")
        assert line[2 : 2 + len(name)] == name
        assert line[: third - 2].strip().endswith(value)
        assert line[third:] == why


def test_labels_wider_than_their_column():
    rows = [("Code", "C"), ("Constraints", "1e-9")]
    assert labelled(*rows, width=8) == ["Code      C", "Constraints  1e-9"]


def test_json_has_null_for_what_is_no_number():
    value = {"a": [1.5, math.nan], "b": {"c": math.inf}, "d": (-math.inf, "é")}
    assert json.loads(json_text(value)) == {"a": [1.5, None], "b": {"c": None}, "d": [None, "é"]}
    assert "é" in json_text(value)
    assert "\\u00e9" in json_text(value, ascii=True)
