"""Tables in HTML, as notebooks show them; no text acts as markup or as mathematics."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from itertools import islice

#: Rows of a table that are shown.
_MOST_ROWS = 24


def html_text(text: str) -> str:
    """Escape text; dollars are set apart, so that no formula begins with them."""
    return escape(text).replace("$", "<span>$</span>")


def html_formula(latex: str) -> str:
    """Return a formula in LaTeX, which the notebook typesets."""
    return f"${escape(latex)}$"


def html_table(
    caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]], count: int
) -> str:
    """Return a table of cells in HTML; of many rows the first ones, and how many others there are.

    Parameters
    ----------
    caption
        HTML above the table.
    heads
        Texts of its first line; without any it has none.
    rows
        HTML of the cells of each row.
    count
        Number of rows.
    """
    lines = [f"<table><caption>{caption}</caption>"]
    if heads:
        lines.append(f"<thead><tr>{_cells('th', map(html_text, heads))}</tr></thead>")
    lines.append("<tbody>")
    shown = list(islice(rows, _MOST_ROWS))
    lines += [f"<tr>{_cells('td', row)}</tr>" for row in shown]
    if count > len(shown):
        width = len(shown[0])
        lines.append(f'<tr><td colspan="{width}">and {count - len(shown)} more</td></tr>')
    return "\n".join([*lines, "</tbody></table>"])


def _cells(tag: str, cells: Iterable[str]) -> str:
    return "".join(f"<{tag}>{cell}</{tag}>" for cell in cells)
