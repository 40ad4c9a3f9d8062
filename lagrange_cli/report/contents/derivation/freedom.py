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
from lagrange_cli.report.statements import statement_of
from lagrange_cli.report.tree import (
    Block,
    Bullets,
    Law,
    Paragraph,
    Section,
    formulas,
    section,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.families.forms import Range
    from lagrange_cli.mechanics.system import Coordinate


def freedom(
    writer: DocumentWriter, parts: Collection[str], *, positions: bool = True
) -> Section | None:
    """Count the degrees of freedom; name constraints and coordinates, with ``positions``.

    ``parts``: ``account``, ``constraints`` or both.
    """
    say, counted = writer.say, "account" in parts
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
    counts = counting(writer.equations, writer.say)
    if not any(" = " in count for count in counts):
        # In words alone they are too long for a line.
        return Paragraph(writer.say("There are {listed}.", listed=", ".join(counts)))
    return Law(writer.letters.comma.join(_counted(writer, count) for count in counts))


def _counted(writer: DocumentWriter, phrase: str) -> str:
    """Return a count in math mode; its words in upright letters."""
    label, equals, number = phrase.partition(" = ")
    if not equals:
        return writer.letters.upright(phrase)
    if label in ("3N", "K"):
        return phrase
    digits, blank, counted = number.partition(" ")
    unit = writer.letters.upright(blank + counted) if counted else ""
    return f"{writer.letters.upright(label)} = {digits}{unit}"


def _constraints(writer: DocumentWriter, *, alone: bool) -> Iterator[Block]:
    """Return the constraints as the scene writes them, with what is to be said of each."""
    say, letters, account = writer.say, writer.letters, writer.equations.derivation.account
    implied, kind = implied_line(writer.equations, say), common_kind(writer.equations, say)
    if not account.lines:
        if implied or alone:
            yield Paragraph(say("There are {listed}.", listed=implied) if implied else say("None."))
        return
    items = []
    for name, equations, status in account_lines(writer.equations, writer.families, say):
        written = ", ".join(_statement(writer, text, ranges) for text, ranges in equations)
        remark = letters.words(status)
        item = say("{name}: {value}", name=letters.words(name), value=written)
        items.append(f"{item} ({remark})" if remark else item)
    if not alone:
        yield Paragraph(say("Constraints:"))
    items += [implied] if implied else []
    items += [say("{name}: {value}", name=say("all"), value=kind)] if kind else []
    yield Bullets(tuple(items))


def _statement(writer: DocumentWriter, text: str, ranges: Sequence[Range]) -> str:
    """Return an equation or inequality of the scene, with the values of its indices."""
    letters = writer.letters
    statement = statement_of(text, writer.equations, writer.words)
    if statement is None:
        shown = letters.words(text)
    else:
        signs = {"=": "=", "<=": letters.at_most_sign, ">=": letters.at_least_sign}
        left, right = letters.formula(statement.left), letters.formula(statement.right)
        shown = letters.inline(f"{left} {signs[statement.relation]} {right}")
    return f"{shown}, {writer.letters.inline(writer.letters.ranges(ranges))}" if ranges else shown


def _coordinates(writer: DocumentWriter, *, positions: bool) -> Iterator[Block]:
    say, equations, letters = writer.say, writer.equations, writer.letters
    coordinates = equations.system.coordinates
    if not coordinates:
        yield Paragraph(say("No coordinate is left: nothing can move."))
        return
    names = ", ".join(_listed(writer))
    if equations.derivation.account.chosen_automatically:
        one = "Generalized coordinate (chosen automatically): {listed}."
        yield Paragraph(say.counted(len(coordinates), one, _CHOSEN, listed=names))
    else:
        one, many = "Generalized coordinate: {listed}.", "Generalized coordinates: {listed}."
        yield Paragraph(say.counted(len(coordinates), one, many, listed=names))
    definitions = telling_definitions(equations) if positions else ()
    named = [(c.name, letters.symbol(c.name, 0, c.latex), c.position) for c in definitions]
    if named:
        yield Paragraph(say("The positions are"))
        yield formulas(writer.definitions(named))
    beyond = () if writer.families is None else writer.families.beyond
    if beyond:
        yield Paragraph(say("Before the first elements and after the last"))
        yield formulas(writer.family_row(letters.symbol(row.name), row) for row in beyond)


_CHOSEN = "Generalized coordinates (chosen automatically): {listed}."


def _listed(writer: DocumentWriter) -> Iterator[str]:
    """Return the coordinates; those of families with letters, and with the values of these."""
    families, letters = writer.families, writer.letters
    if families is None:
        yield from (_described(writer, c) for c in writer.equations.system.coordinates)
        return
    for named, ranges in coordinates_by_ranges(families, writer.equations):
        *names, last = (
            _described(writer, c if c.name == name else replace(c, name=name, latex=None))
            for name, c in named
        )
        range_text = letters.inline(letters.ranges(ranges)) if ranges else ""
        yield from names
        yield writer.say("{names} for {ranges}", names=last, ranges=range_text) if ranges else last


def _described(writer: DocumentWriter, coordinate: Coordinate) -> str:
    letters = writer.letters
    domain = " > 0" if coordinate.is_positive else ""
    text = letters.inline(f"{writer.lettered_coordinate(coordinate)}{domain}")
    descriptions = [letters.prose(coordinate.description)] if coordinate.description else []
    if coordinate.unit:
        descriptions.append(letters.unit(coordinate.unit))
    return f"{text} ({', '.join(descriptions)})" if descriptions else text


def _singular(writer: DocumentWriter) -> Iterator[Block]:
    """Say where the coordinates have no meaning, a sentence each."""
    letters = writer.letters
    named = {c.name: writer.lettered_coordinate(c) for c in writer.equations.system.coordinates}
    for place in writer.equations.derivation.singular:
        zero = f"{letters.formula(writer.tree(place.where))} = 0"
        yield Paragraph(
            writer.say(
                "The motion of {names} is singular where {zero}.",
                names=writer.lettered_list([named[name] for name in place.coordinates]),
                zero=letters.inline(zero),
            )
        )
