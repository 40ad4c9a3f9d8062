"""The account of degrees of freedom: what is counted, constraints, coordinates."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.contents.families import (
    account_lines,
    coordinates_by_ranges,
    sizes_line,
)
from lagrange_cli.report.contents.joints import joint_statement
from lagrange_cli.report.contents.sentences import (
    choice_line,
    common_kind,
    counting,
    implied_line,
    telling_definitions,
)
from lagrange_cli.report.inlines import (
    AT_LEAST,
    AT_MOST,
    COMMA,
    Expression,
    Inline,
    Label,
    Listed,
    Plain,
    Prose,
    Text,
    Unit,
    Written,
    enumerated,
    in_parentheses,
    joined,
    ranges,
    say,
    symbol,
    upright,
)
from lagrange_cli.report.statements import statement_of
from lagrange_cli.report.tree import (
    Block,
    Bullets,
    Labelled,
    Law,
    Packed,
    Paragraph,
    Section,
    StatementRow,
    Statements,
    formulas,
    section,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.system import Coordinate


def freedom(
    writer: DocumentWriter, parts: Collection[str], *, positions: bool = True
) -> Section | None:
    """Count the degrees of freedom; name constraints and coordinates, with ``positions``.

    ``parts``: ``account``, ``constraints`` or both.
    """
    counted = "account" in parts
    listed = list(_constraints(writer, alone=not counted)) if "constraints" in parts else []
    if not counted:
        return section(say("Constraints"), *listed)
    counts = counting(writer.equations)
    return section(
        say("Degrees of freedom"),
        _counts(counts),
        *listed,
        *_coordinates(writer, positions=positions),
        *_formulation(writer),
        *_singular(writer),
        lead=tuple(counts),
    )


def stated(writer: DocumentWriter) -> Section | None:
    """Return the constraints and the coordinates of a scene, without a count of freedom.

    Coordinates that the program chose are left to be chosen.
    """
    items = tuple(replace(row, remark="").item for row in _statement_rows(writer))
    chosen = writer.equations.derivation.account.chosen_automatically
    coordinates = () if chosen else _coordinates(writer, positions=True)
    heading = say("Constraints") if items else say("Coordinates")
    return section(heading, Bullets(items) if items else None, *coordinates)


def _formulation(writer: DocumentWriter) -> Iterator[Block]:
    """Say which formulation was taken, to readers who can choose another one."""
    choice = choice_line(writer.equations)
    if choice is not None:
        yield Labelled(((say("Formulation"), choice),), only="terminal")


def _counts(counts: Sequence[Written]) -> Block:
    if not any(isinstance(count, Label) for count in counts):
        # In words alone they are too long for a line.
        listed = Listed(tuple(counts))
        return Paragraph(say("There are {listed}.", listed=listed), only="document")
    shown = (c if isinstance(c, Label) else upright(c) for c in counts)
    return Law(joined(COMMA, shown), only="document")


def _constraints(writer: DocumentWriter, *, alone: bool) -> Iterator[Block]:
    """Return the constraints as the scene writes them, with what is to be said of each."""
    account = writer.equations.derivation.account
    implied, kind = implied_line(writer.equations), common_kind(writer.equations)
    rows = list(_statement_rows(writer))
    further = [] if implied is None else [StatementRow(say("(implied)"), ((implied, ""),))]
    further += [] if kind is None else [StatementRow(say("(all)"), ((kind, ""),))]
    if rows or further:
        yield Statements((*rows, *further), only="terminal")
    if not account.lines:
        if implied is not None:
            yield Paragraph(say("There are {listed}.", listed=implied), only="document")
        elif alone:
            yield Paragraph(say("None."))
        return
    if not alone:
        yield Paragraph(say("Constraints:"), only="document")
    items: list[Text] = [row.item for row in rows]
    items += [] if implied is None else [implied]
    items += [] if kind is None else [say("{name}: {value}", name=say("all"), value=kind)]
    yield Bullets(tuple(items), only="document")


def _statement_rows(writer: DocumentWriter) -> Iterator[StatementRow]:
    for line in account_lines(writer.equations, writer.families):
        shown = tuple(
            (
                joint_statement(text.split("\t")) if line.is_joint else _statement(writer, text),
                Inline(ranges(spans)) if spans else "",
            )
            for text, spans in line.equations
        )
        yield StatementRow(Plain(line.name), shown, line.remark or "")


_SIGNS: dict[str, Label | str] = {"=": "=", "<=": AT_MOST, ">=": AT_LEAST}


def _statement(writer: DocumentWriter, text: str) -> Written:
    """Return an equation or inequality of the scene."""
    statement = statement_of(text, writer.equations, writer.words)
    if statement is None:
        return Plain(text)
    left = Expression(statement.left) + " " + _SIGNS[statement.relation] + " "
    return Inline(left + Expression(statement.right))


def _coordinates(writer: DocumentWriter, *, positions: bool) -> Iterator[Block]:
    equations = writer.equations
    coordinates = equations.system.coordinates
    if not coordinates:
        yield Paragraph(say("No coordinate is left: nothing can move."))
        return
    names = Listed(tuple(_listed(writer)))
    one, many = "Generalized coordinate: {listed}.", "Generalized coordinates: {listed}."
    sentence = say.counted(len(coordinates), one, many, listed=names)
    if equations.derivation.account.chosen_automatically:
        one = "Generalized coordinate (chosen automatically): {listed}."
        many = "Generalized coordinates (chosen automatically): {listed}."
        sentence = say.counted(len(coordinates), one, many, listed=names)
    yield Paragraph(sentence, only="document")
    definitions = telling_definitions(equations) if positions else ()
    named = [(c.name, symbol(c.name, 0, c.latex), c.position) for c in definitions]
    places = tuple(writer.definitions(named))
    beyond = () if writer.families is None else writer.families.beyond
    outside = tuple(writer.family_row(symbol(row.name), row) for row in beyond)
    if places:
        yield Paragraph(say("The positions are"), only="document")
        yield formulas(places, only="document")
    if outside:
        yield Paragraph(say("Before the first elements and after the last"), only="document")
        yield formulas(outside, only="document")
    items = tuple(_short_items(writer))
    yield Packed(say("Coordinates"), items, (*places, *outside), only="terminal")


def _short_items(writer: DocumentWriter) -> Iterator[Text]:
    """Return the letters of coordinates, with the values of indices and what is to be said."""
    families, account = writer.families, writer.equations.derivation.account
    items: list[Text] = []
    if families is None:
        items += [_letter(c.name, c) for c in writer.equations.system.coordinates]
    else:
        for pairs, spans in coordinates_by_ranges(families, writer.equations):
            items += [_letter(name, c) for name, c in pairs]
            items += [ranges(spans)] if spans else []
    *before, last = items
    yield from before
    sizes = "" if families is None else sizes_line(families)
    remarks = [f"({sizes})"] if sizes else []
    chosen = [say("(chosen automatically)")] if account.chosen_automatically else []
    yield Listed((last, *remarks, *chosen), between="   ")


def _letter(name: str, coordinate: Coordinate) -> Label:
    letter = symbol(name, 0, coordinate.latex if name == coordinate.name else None)
    return letter + " > 0" if coordinate.is_positive else letter


def _listed(writer: DocumentWriter) -> Iterator[Written]:
    """Return the coordinates; those of families with letters, and with the values of these."""
    families = writer.families
    if families is None:
        yield from (_described(writer, c) for c in writer.equations.system.coordinates)
        return
    for named, spans in coordinates_by_ranges(families, writer.equations):
        *names, last = (
            _described(writer, c if c.name == name else replace(c, name=name, latex=None))
            for name, c in named
        )
        yield from names
        if spans:
            yield say("{names} for {ranges}", names=last, ranges=Inline(ranges(spans)))
        else:
            yield last


def _described(writer: DocumentWriter, coordinate: Coordinate) -> Written:
    letter = writer.coordinate(coordinate)
    text = Inline(letter + " > 0" if coordinate.is_positive else letter)
    remarks: list[Text] = [Prose(coordinate.description)] if coordinate.description else []
    remarks += [Unit(coordinate.unit)] if coordinate.unit else []
    return in_parentheses(text, *remarks) if remarks else text


def _singular(writer: DocumentWriter) -> Iterator[Block]:
    """Say where the coordinates have no meaning, a sentence each."""
    named = {c.name: writer.coordinate(c) for c in writer.equations.system.coordinates}
    for place in writer.equations.derivation.singular:
        yield Paragraph(
            say(
                "The motion of {names} is singular where {zero}.",
                names=enumerated([named[name] for name in place.coordinates]),
                zero=Inline(Expression(writer.tree(place.where)) + " = 0"),
            )
        )
