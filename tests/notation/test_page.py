"""Pages of text, laid out at any width."""

from __future__ import annotations

import json
import re

from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.notation.layout import Piece, columns
from lagrange_cli.notation.page import UNBROKEN, Block, Page, Row, formula, page, words

SUM = [Piece("aaaa", 4), *(Piece(8 * c, 11, " + ", "+ ", 0) for c in "bcdef")]

PAGE = page(
    [
        [Row("Sum", role="heading"), formula("  s", " = ", SUM, aside="of letters")],
        [],
        [Row("long", "  ", words("a text of words that is broken between two of them"), "name")],
    ]
)


def test_rows_are_broken_under_their_beginning():
    assert PAGE.text(40) == (
        "Sum\n"
        "  s = aaaa + bbbbbbbb + cccccccc\n"
        "        + dddddddd + eeeeeeee\n"
        "        + ffffffff   of letters\n"
        "\n"
        "long  a text of words that is broken\n"
        "      between two of them\n"
    )
    assert PAGE.text(28).splitlines()[3:5] == ["        + dddddddd", "        + eeeeeeee"]
    assert PAGE.text(UNBROKEN).splitlines()[1].endswith("ffffffff   of letters")


def test_names_are_painted_and_count_for_nothing():
    painted = PAGE.text(40, lambda text, role: f"<{role}>{text}</>" if role else text)
    assert painted.splitlines()[:2] == [
        "<heading>Sum</>",
        "<name>  s</> = aaaa + bbbbbbbb + cccccccc",
    ]
    assert re.sub("<.*?>", "", painted) == PAGE.text(40)


def test_asides_of_short_rows_stand_below_each_other():
    rows = (Row("  E = T", aside="one"), Row("  p", aside="another"))
    assert page([[Block(rows, "asides")]]).text() == "  E = T     one\n  p         another\n"


def test_packed_rows():
    head = Row("Names", "  ", words("x, y"))
    rows = (Row(f"  {name}", " = ", words("1234")) for name in "xyz")
    packed = page([[Block((head, *rows), "packed")]])
    assert packed.text(80) == "Names  x, y        x = 1234   y = 1234   z = 1234\n"
    assert packed.text(24) == "Names  x, y\n  x = 1234   y = 1234\n  z = 1234\n"


def test_escapes_of_ascii():
    assert page([[Row("θ", " ", words("é"))]], ascii=True).text() == "\\u03b8 \\xe9\n"


@given(st.text("ab \n\té", max_size=60), st.integers(1, 40))
def test_no_word_is_lost(text, width):
    shown = page([[Row("  n", " ", words(text), "name")]])
    assert shown.text(width).split() == ["n", *text.split()]
    assert Page.from_json(json.loads(json.dumps(shown.to_json()))) == shown
    lines = shown.text(width).splitlines()
    indent = 5 + len(text) - len(text.lstrip())
    longest = max(map(len, ["", *text.split()]))
    assert all(columns(line) <= max(width, indent + longest) for line in lines) or "\t" in text
