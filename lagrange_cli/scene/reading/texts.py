"""Texts for readers in the entries of a scene: units, descriptions, LaTeX."""

from __future__ import annotations

from collections.abc import Mapping

from lagrange_cli.latex_allowlist import between_dollars, check_latex
from lagrange_cli.scene.reading.entries import Reading, is_indexed
from lagrange_cli.scene.reading.source import SourceNode


def read_text_field(
    fields: Mapping[str, SourceNode], key: str, what: str, reading: Reading
) -> str | None:
    """Read the text at a key; None without it."""
    return reading.text(fields[key], f"'{key}' of {what}") if key in fields else None


def read_prose(node: SourceNode, what: str, reading: Reading) -> str | None:
    """Read a text that may hold formulas between dollars; warn of those that are not allowed."""
    text = reading.text(node, what)
    for found in between_dollars(text or ""):
        refused = check_latex(found[1])
        if refused and "\\" in found[1]:
            reading.problems.warn(
                f"'{found[0]}' in {what} prints as it stands here: as a formula it {refused}",
                node.mark,
                hint="formulas in texts take what 'latex' keys take",
                rule="latex",
            )
    return text


def read_latex(
    fields: Mapping[str, SourceNode], what: str, reading: Reading, key: str = "latex"
) -> str | None:
    """Read a symbol in LaTeX at a key, of the macros that are allowed; None without it."""
    text = read_text_field(fields, key, what, reading)
    refused = check_latex(text) if text is not None else None
    if refused:
        reading.problems.add(
            f"'{key}' of {what} {refused}",
            fields[key].mark,
            hint="it takes letters, digits, sub- and superscripts and macros of mathematics",
            rule="latex",
        )
        return None
    return text


def with_indices(latex: str | None, name: str, *, below: bool = False) -> str | None:
    """Give LaTeX that all elements of a family share the indices of one of them, if it is one.

    ``below``: it stands below a letter itself.
    """
    if latex is None or not is_indexed(name):
        return latex
    indices = name.partition("[")[2].rstrip("]")
    return f"{latex},{indices}" if below else f"{{{latex}}}_{{{indices}}}"
