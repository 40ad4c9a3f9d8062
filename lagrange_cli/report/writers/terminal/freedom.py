"""Sections on parameters, the account of degrees of freedom, constraints and coordinates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

from lagrange_cli.emit.initial_state import exact_value
from lagrange_cli.errors import escape_controls
from lagrange_cli.notation.build import display
from lagrange_cli.notation.layout import Piece, suffixed
from lagrange_cli.notation.page import Block, Row, formula, words
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.report.contents.families import account_lines, coordinates_by_ranges, sizes_line
from lagrange_cli.report.contents.sentences import (
    choice_line,
    common_kind,
    counting,
    implied_line,
    telling_definitions,
)
from lagrange_cli.report.ranges import text_ranges
from lagrange_cli.report.statements import statement_of
from lagrange_cli.report.writers.terminal.writer import (
    TextWriter,
    equation_pieces,
    heading_row,
    leads_after,
    remark_pieces,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.system import CartesianName, Parameter


def parameters(writer: TextWriter) -> list[Row]:
    """Return parameters with value, unit and meaning, in columns."""
    literals = dict(writer.equations.presentation.literals)
    rows = []
    for p in writer.equations.system.parameters:
        value, exact = "", exact_value(p)
        if exact is not None:
            value = writer.printer.inline(display(exact, writer.words))
        elif p.value is not None:
            value = literals.get(Fraction(repr(p.value)), repr(p.value))
        value_text = f"{value.removesuffix('.0')} {escape_controls(p.unit or '')}".strip()
        rows.append((writer.printer.symbol(p.name), f" = {value_text}" if value_text else ""))
    meanings = [_meaning(writer, p) for p in writer.equations.system.parameters]
    heading = writer.say("Parameters")
    if rows and not any((*meanings, *(value_text for _, value_text in rows))):
        return [Row(heading, "   ", words(", ".join(name for name, _ in rows)), "heading")]
    leads = leads_after([name + value_text for name, value_text in rows])
    lines = [
        Row(f"  {name}", value_text + lead, words(meaning), "name")
        for (name, value_text), lead, meaning in zip(rows, leads, meanings, strict=True)
    ]
    return [heading_row(heading), *lines] if lines else []


def _meaning(writer: TextWriter, parameter: Parameter) -> str:
    if parameter.start_of is None:
        return escape_controls(parameter.description or "")
    symbol = writer.printer.symbol(parameter.start_of)
    return writer.say("{coordinate} at the start", coordinate=symbol)


def account(writer: TextWriter, *, positions: bool = True) -> list[Row | Block]:
    """Count the degrees of freedom; name constraints and coordinates, with ``positions``."""
    listed = list(constraints(writer)) if "constraints" in writer.parts else []
    if "account" not in writer.parts:
        none = Row("", "  ", words(writer.say("none")))
        return [heading_row(writer.say("Constraints")), *(listed or [none])]
    counts = [writer.text(count) for count in counting(writer.equations)]
    items = [*(f"{count}," for count in counts[:-1]), *counts[-1:]]
    chosen = choice_line(writer.equations)
    formulation = Row(writer.say("Formulation"), "   ", writer.prose(chosen), "heading")
    return [
        Row(writer.say("Degrees of freedom"), "   ", words(items), "heading"),
        *listed,
        coordinates(writer, telling_definitions(writer.equations) if positions else ()),
        *([formulation] if chosen else []),
        *singular(writer),
    ]


def singular(writer: TextWriter) -> Iterator[Row]:
    """List the places at which the coordinates are singular."""
    for place in writer.equations.derivation.singular:
        names = ", ".join(writer.printer.symbol(name) for name in place.coordinates)
        zero = suffixed(writer.pieces(place.where), " = 0", 4)
        lead = f"      {writer.say('{names} where', names=names)} "
        yield formula(writer.say("Singular"), lead, zero, "heading")


def constraints(writer: TextWriter) -> Iterator[Row]:
    rows = []
    for name, equations, remark in account_lines(writer.equations, writer.families):
        ends = [*("," for _ in equations[1:]), ""]
        pieces: list[Piece] = []
        for (text, ranges), end in zip(equations, ends, strict=True):
            mark = "," if ranges else end
            first, *others = suffixed(_statement(writer, text), mark, len(mark))
            pieces += [replace(first, separator=" ", width=first.width + 1), *others]
            if ranges:
                span = writer.range_piece(ranges)
                pieces.append(replace(span, lead="  ", text=span.text + end))
        pieces[0] = replace(pieces[0], separator="")
        rows.append((name, (*pieces, *remark_pieces(writer.text(remark or "")))))
    implied, kind = implied_line(writer.equations), common_kind(writer.equations)
    rows += [(writer.say("(implied)"), writer.prose(implied))] if implied else []
    rows += [(writer.say("(all)"), writer.prose(kind))] if kind else []
    width = max((len(name) for name, _ in rows), default=0)
    for name, shown in rows:
        yield Row(f"  {name}", " " * (width - len(name) + 3), shown, "name")


def _statement(writer: TextWriter, text: str) -> list[Piece]:
    """Return an equation or inequality of the scene as a formula; in ASCII as it is written."""
    equations, printer = writer.equations, writer.printer
    is_ascii = isinstance(printer, ScenePrinter)
    statement = None if is_ascii else statement_of(text, equations, writer.words)
    if statement is None:
        return list(equation_pieces(escape_controls(text)))
    left, right = printer.pieces(statement.left), printer.pieces(statement.right)
    sign = _SIGNS[statement.relation]
    head = replace(
        right[0], separator=f" {sign} ", lead=f"  {sign} ", width=right[0].width + 3, depth=0
    )
    return [*left, head, *right[1:]]


_SIGNS = {"=": "=", "<=": "≤", ">=": "≥"}


def coordinates(writer: TextWriter, positions: Sequence[CartesianName]) -> Block:
    items = coordinate_items(writer)
    if writer.equations.derivation.account.chosen_automatically:
        items += ["", "", *writer.say("(chosen automatically)").split(" ")]
    head = Row(writer.say("Coordinates"), "   ", words(items), "heading")
    listed = [(c.name, c.position) for c in positions]
    formulas = {writer.printer.symbol(name): body for name, body in writer.listed(listed)}
    for row in () if writer.families is None else writer.families.beyond:
        assert writer.over_letters is not None
        body = writer.tree(writer.over_letters.whole(row))
        formulas[writer.printer.symbol(row.name)] = writer.ranged(body, row)
    rows = (formula(f"  {name}", " = ", body, "") for name, body in formulas.items())
    return Block((head, *rows), "packed")


def coordinate_items(writer: TextWriter) -> list[str]:
    """Return names of coordinates; those of a family as one, with the range of its indices."""
    families = writer.families
    if families is None:
        symbols = ((writer.printer.symbol(c.name), c) for c in writer.equations.system.coordinates)
        names = [f"{q} > 0" if c.is_positive else q for q, c in symbols] or ["none"]
        return [f"{name}," for name in names[:-1]] + names[-1:]
    ascii_only = isinstance(writer.printer, ScenePrinter)
    items: list[str] = []
    for named, ranges in coordinates_by_ranges(families, writer.equations):
        for name, coordinate in named:
            sign = " > 0" if coordinate.is_positive else ""
            items.append(f"{writer.printer.symbol(name)}{sign},")
        items += [f"{text_ranges(ranges, ascii=ascii_only)},"] if ranges else []
    items[-1] = items[-1].removesuffix(",")
    sizes = sizes_line(families)
    return [*items, "", "", f"({sizes})"] if sizes else items
