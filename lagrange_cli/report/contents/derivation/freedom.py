"""The account of degrees of freedom: what is counted, constraints, coordinates."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.contents.families import account_lines, coordinates_by_ranges
from lagrange_cli.report.contents.sentences import (
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
from lagrange_cli.report.tree import Block, Bullets, Law, Paragraph, Section, formulas, section

if TYPE_CHECKING:
    from lagrange_cli.mechanics.families.forms import Range
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
    return section(
        say("Degrees of freedom"),
        _counts(writer),
        *listed,
        *_coordinates(writer, positions=positions),
        *_singular(writer),
    )


def _counts(writer: DocumentWriter) -> Block:
    counts = counting(writer.equations)
    if not any(isinstance(count, Label) for count in counts):
        # In words alone they are too long for a line.
        return Paragraph(say("There are {listed}.", listed=Listed(tuple(counts))))
    return Law(joined(COMMA, (c if isinstance(c, Label) else upright(c) for c in counts)))


def _constraints(writer: DocumentWriter, *, alone: bool) -> Iterator[Block]:
    """Return the constraints as the scene writes them, with what is to be said of each."""
    account = writer.equations.derivation.account
    implied, kind = implied_line(writer.equations), common_kind(writer.equations)
    if not account.lines:
        if implied is not None:
            yield Paragraph(say("There are {listed}.", listed=implied))
        elif alone:
            yield Paragraph(say("None."))
        return
    items: list[Text] = []
    for line in account_lines(writer.equations, writer.families):
        equations = [_statement(writer, text, spans) for text, spans in line.equations]
        item = say("{name}: {value}", name=Plain(line.name), value=Listed(tuple(equations)))
        items.append(item if line.remark is None else in_parentheses(item, line.remark))
    if not alone:
        yield Paragraph(say("Constraints:"))
    items += [] if implied is None else [implied]
    items += [] if kind is None else [say("{name}: {value}", name=say("all"), value=kind)]
    yield Bullets(tuple(items))


_SIGNS: dict[str, Label | str] = {"=": "=", "<=": AT_MOST, ">=": AT_LEAST}


def _statement(writer: DocumentWriter, text: str, spans: Sequence[Range]) -> Written:
    """Return an equation or inequality of the scene, with the values of its indices."""
    statement = statement_of(text, writer.equations, writer.words)
    shown: Written = Plain(text)
    if statement is not None:
        left = Expression(statement.left) + " " + _SIGNS[statement.relation] + " "
        shown = Inline(left + Expression(statement.right))
    return Listed((shown, Inline(ranges(spans)))) if spans else shown


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
    yield Paragraph(sentence)
    definitions = telling_definitions(equations) if positions else ()
    named = [(c.name, symbol(c.name, 0, c.latex), c.position) for c in definitions]
    if named:
        yield Paragraph(say("The positions are"))
        yield formulas(writer.definitions(named))
    beyond = () if writer.families is None else writer.families.beyond
    if beyond:
        yield Paragraph(say("Before the first elements and after the last"))
        yield formulas(writer.family_row(symbol(row.name), row) for row in beyond)


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
