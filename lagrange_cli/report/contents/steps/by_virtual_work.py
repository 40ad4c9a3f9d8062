"""The principle of virtual work: the coefficient of each δq at rest, and its equilibria."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.analysis.equilibria.laws import laws_of_equilibrium
from lagrange_cli.analysis.equilibria.rest_system import rest_system
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.report.contents.steps.by_dalembert import (
    coefficient_law,
    effective_force,
    independent,
    names_in_coordinates,
    total_work,
)
from lagrange_cli.report.contents.steps.writer import StepsWriter
from lagrange_cli.report.document_options import MOST_LISTED
from lagrange_cli.report.tree import (
    Block,
    Formula,
    Formulas,
    Law,
    Paragraph,
    Section,
    Title,
    formulas,
    section,
)

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.analysis.values import Equilibrium, Existence
    from lagrange_cli.mechanics.system import Coordinate


def principle(writer: StepsWriter) -> Section | None:
    """Return the coefficient of each δq, which vanishes in equilibrium."""
    coordinates = writer.equations.system.coordinates
    letters, say = writer.letters, writer.say
    balances = writer.steps.balances
    names = writer.steps.in_coordinates
    if all(_at_rest(writer, parts.coordinates) == 0 for parts in balances):
        names = ()
    if any(_at_rest(writer, parts.inertia) != 0 for parts in balances):
        law, total = total_work(writer, effective_force(writer), names), ""
        text = say(
            "Coordinates stay constant while the constraints move if the applied forces, less"
            " masses times accelerations, do no work in the virtual displacements that the"
            " constraints allow; constraint forces do none:"
        )
    else:
        total = letters.symbol("Q_j")
        law = total_work(writer, letters.vector(writer.force_letter), names)
        if not names:
            displaced = letters.virtual(letters.symbol("q_j"))
            law += f" = {letters.total('j', letters.times(total, displaced))}"
        text = say(
            "A system stays at rest if the applied forces do no work in the virtual"
            " displacements that the constraints allow; constraint forces do none:"
        )
    return section(
        say("Principle of virtual work"),
        *names_in_coordinates(writer, names),
        Paragraph(text),
        Law(f"{law} = 0"),
        Paragraph(independent(writer)),
        *coefficient_law(writer, names, total),
        *(
            block
            for number, c in enumerate(coordinates)
            for block in _coefficient(writer, number, c)
        ),
    )


def _at_rest(writer: StepsWriter, expression: Expr) -> Expr:
    """Put velocities and accelerations to zero."""
    moving = (s for c in writer.equations.system.coordinates for s in (c.v, c.a))
    return expression.xreplace(dict.fromkeys(moving, sympy.S.Zero))


def _coefficient(writer: StepsWriter, number: int, coordinate: Coordinate) -> Iterator[Block]:
    letters, parts = writer.letters, writer.steps.balances[number]
    place = writer.lettered_coordinate(coordinate)
    yield Title(writer.say("For {place}:", place=letters.inline(letters.virtual(place))))
    slope = f"{letters.dot_product}{letters.partial(letters.vector('r'), place)}"
    inertia = letters.times(letters.symbol("m_i"), letters.vector("r", 2))
    force = letters.vector(writer.force_letter)
    work, moved, further = (
        _at_rest(writer, e) for e in (parts.work, parts.inertia, parts.coordinates)
    )
    row = writer.row(letters.below("Q", place), work)
    row = replace(row, middle=letters.total("i", f"{force}{slope}"))
    pushes = [
        closure.multiplier * gradient[number]
        for closure in writer.equations.system.closures
        if number in (gradient := entries(closure.gradient))
    ]
    if not pushes and moved == further == 0:
        zero = () if work == 0 else (writer.tree(sympy.S.Zero),)
        yield formulas([replace(row, chain=(*row.chain, *zero))], result=True)
        return
    rows = [writer.row(letters.total("i", f"{inertia}{slope}"), moved)] if moved != 0 else []
    rows.append(row)
    if further != 0:
        rows.append(writer.row(letters.below(writer.inertia_letter, place), further))
    yield formulas(rows)
    yield Paragraph(writer.say("so that"))
    balance = sympy.Add(work, -moved, -further, *pushes)
    yield formulas([Formula("", (writer.tree(balance),))], result=True)


def equilibrium(writer: StepsWriter) -> Section | None:
    """Return the equilibria in closed form, for all values of the parameters.

    Raises
    ------
    InputError
        Nothing can stay at rest: see :func:`.rest_system.rest_system`.
    """
    forms = laws_of_equilibrium(rest_system(writer.equations, {}))
    say = writer.say
    points = forms.points[:MOST_LISTED] if forms else ()
    if forms is None or not (points or forms.complete):
        text = say("These equations have no solution in closed form that was found.")
        return section(say("Equilibrium"), Paragraph(text))
    if not points:
        text = say("No configuration satisfies these equations: the forces cannot balance.")
    elif forms.complete and len(points) == len(forms.points):
        text = say("These equations are satisfied exactly by")
    else:
        text = say("These equations are satisfied, among others perhaps, by")
    blocks = _solutions(writer, points)
    names = writer.lettered_list([letter_of(writer, name) for name in forms.nonzero])
    exception = ""
    if forms.complete and names:
        one, many = "Here {names} is not 0.", "Here {names} are not 0."
        exception = say.counted(len(forms.nonzero), one, many, names=names)
    return section(say("Equilibrium"), Paragraph(text), *blocks, writer.paragraph(exception))


def _solutions(writer: StepsWriter, points: Sequence[Equilibrium]) -> Iterator[Block]:
    """Write equilibria with *or* between them; values of one coordinate alone stand together."""
    pending: list[Formula] = []
    for number, point in enumerate(points):
        blocks = list(_solution(writer, point))
        rows = [row for block in blocks if isinstance(block, Formulas) for row in block.rows]
        if len(blocks) == len(rows) == 1:
            if number and not pending:
                yield Paragraph(writer.say("or"))
            pending += rows
            continue
        if pending:
            yield formulas(pending, result=True)
        if number:
            yield Paragraph(writer.say("or"))
        yield from blocks
        pending = []
    if pending:
        yield formulas(pending, result=True)


def letter_of(writer: StepsWriter, name: str) -> str:
    """Return a parameter in the letters of the format."""
    latex = {p.name: p.latex for p in writer.equations.system.parameters}
    return writer.letters.symbol(name, 0, latex.get(name))


def _solution(writer: StepsWriter, point: Equilibrium) -> Iterator[Block]:
    """Write one equilibrium: values of coordinates, and the law under which others are any."""
    say, coordinates = writer.say, writer.equations.system.coordinates
    pairs = list(zip(coordinates, point.exact or (), strict=True))
    free = [writer.lettered_coordinate(c) for c, _ in pairs if c.name in point.free]
    laws = [c for c in point.conditions if c.relation == "="]
    rows = [
        writer.row(writer.lettered_coordinate(c), e) for c, e in pairs if c.name not in point.free
    ]
    law_rows = [_law(writer, law) for law in laws]
    if free:
        names = writer.lettered_list(free)
        any_of = say("any {names}", names=names)
        yield Title(say("any {names} where", names=names) if rows or laws else any_of)
        yield formulas([*rows, *law_rows], result=True)
    else:
        yield formulas(rows, result=True)
        if law_rows:
            yield Paragraph(say("where"))
            yield formulas(law_rows, result=True)
    bounds = [c for c in point.conditions if c.relation != "="]
    if bounds:
        yield Paragraph(say("provided that"))
        yield from (Law(_bound(writer, c)) for c in bounds)


def _law(writer: StepsWriter, law: Existence) -> Formula:
    return writer.row(writer.letters.formula(writer.tree(law.smaller)), law.larger)


def _bound(writer: StepsWriter, bound: Existence) -> str:
    sides = (writer.letters.formula(writer.tree(e)) for e in (bound.smaller, bound.larger))
    return f" {writer.letters.at_most_sign} ".join(sides)
