"""The principle of virtual work: the coefficient of each δq at rest, and its equilibria."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.analysis.equilibria.laws import laws_of_equilibrium
from lagrange_cli.analysis.equilibria.rest_system import no_value_at_rest, rest_system
from lagrange_cli.mechanics.algebra.substitution import at_rest
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.mechanics.step_values import rate_symbol, spin_symbol
from lagrange_cli.report.contents.steps.by_dalembert import (
    applied_work,
    coefficient_law,
    independent,
    names_in_coordinates,
    total_work,
    work_with_inertia,
)
from lagrange_cli.report.contents.steps.writer import (
    INERTIA,
    POSITION,
    StepsWriter,
    turning_of,
    work,
    work_in_coordinates,
)
from lagrange_cli.report.document_options import MOST_LISTED
from lagrange_cli.report.inlines import (
    AT_MOST,
    NOTHING,
    below,
    enumerated,
    partial,
    say,
    symbol,
    virtual,
)
from lagrange_cli.report.tree import Formula, Formulas, Law, Part, Section, Title, formulas, section

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.analysis.values import Equilibrium
    from lagrange_cli.mechanics.step_values import VirtualWork
    from lagrange_cli.mechanics.system import Coordinate


def principle(writer: StepsWriter) -> Section | None:
    """Return the coefficient of each δq, which vanishes in equilibrium."""
    balances, names = writer.steps.balances, writer.steps.in_coordinates
    if all(_at_rest(writer, parts.coordinates, parts) == 0 for parts in balances):
        names = ()
    if any(_at_rest(writer, parts.inertia + parts.turning, parts) != 0 for parts in balances):
        whole = work_with_inertia(writer, *writer.displaced)
        law, force = total_work(writer, whole, names), NOTHING
        text = say(
            "Coordinates stay constant while the constraints move if the applied forces, less"
            " masses times accelerations, do no work in the virtual displacements that the"
            " constraints allow; constraint forces do none:"
        )
    else:
        whole = applied_work(writer, *writer.displaced)
        law, force = total_work(writer, whole, names), symbol("Q_j")
        if not names:
            law += " = " + work_in_coordinates(force)
        text = say(
            "A system stays at rest if the applied forces do no work in the virtual"
            " displacements that the constraints allow; constraint forces do none:"
        )
    return section(
        say("Principle of virtual work"),
        names_in_coordinates(writer, names),
        text,
        Law(law + " = 0"),
        independent(writer),
        *coefficient_law(writer, names, force),
        *(block for parts in balances for block in _coefficient(writer, parts)),
    )


def _at_rest(writer: StepsWriter, expression: Expr, parts: VirtualWork) -> Expr:
    """Put velocities and accelerations to zero in an expression of a displacement.

    Raises
    ------
    InputError
        The expression has no value there.
    """
    coordinates = writer.equations.system.coordinates
    spins = [
        spin_symbol(body.name, c.axis)
        for body in writer.turning
        for c in turning_of(body).components
    ]
    moving = [*(s for c in coordinates for s in (c.v, c.a)), *spins]
    still = at_rest(expression, [*moving, *(rate_symbol(s.name) for s in spins)])
    if still is None:
        moved = {q for q, _ in parts.displacement.rates}
        raise no_value_at_rest(next(c.mark for c in coordinates if c.q in moved))
    return still


def _coefficient(writer: StepsWriter, parts: VirtualWork) -> Iterator[Part]:
    place = writer.displaced_place(parts.displacement)
    yield Title(say("For {place}:", place=virtual(place)))
    slope = partial(POSITION, place)
    worked, moved, turned, further = (
        _at_rest(writer, e, parts)
        for e in (parts.work + parts.torques, parts.inertia, parts.turning, parts.coordinates)
    )
    applied = applied_work(writer, slope, writer.spin_along(parts.displacement))
    row = replace(writer.row(below("Q", place), worked), middle=applied)
    pushes = _pushes(writer, parts)
    if not pushes and moved == turned == further == 0:
        zero = () if worked == 0 else (writer.tree(sympy.S.Zero),)
        yield formulas([replace(row, chain=(*row.chain, *zero))], result=True)
        return
    rows = [writer.row(work(INERTIA, slope), moved)] if moved != 0 else []
    if turned != 0:
        turn = writer.spin_along(parts.displacement)
        rows.append(writer.row(work(writer.momentum_rate, turn), turned))
    rows.append(row)
    if further != 0:
        rows.append(writer.row(below(writer.inertia_letter, place), further))
    yield formulas(rows)
    yield say("so that")
    balance = sympy.Add(worked, -moved, -turned, -further, *pushes)
    yield formulas([Formula("", (writer.tree(balance),))], result=True)


def _pushes(writer: StepsWriter, parts: VirtualWork) -> list[Expr]:
    """Return the forces of multipliers along a displacement."""
    system = writer.equations.system
    if parts.displacement.axis:
        multipliers = {closure.multiplier for closure in system.closures}
        return [-slope * factor for slope, factor in parts.terms if factor in multipliers]
    number = next(k for k, c in enumerate(system.coordinates) if c.name == parts.displacement.name)
    return [
        closure.multiplier * gradient[number]
        for closure in system.closures
        if number in (gradient := entries(closure.gradient))
    ]


def equilibrium(writer: StepsWriter) -> Section | None:
    """Return the equilibria in closed form, for all values of the parameters.

    Raises
    ------
    InputError
        Nothing can stay at rest: see :func:`.rest_system.rest_system`.
    """
    system = rest_system(writer.equations, {})
    forms = laws_of_equilibrium(system)
    points = forms.points[:MOST_LISTED] if forms else ()
    if forms is None or not (points or forms.complete):
        text = say("These equations have no solution in closed form that was found.")
        return section(say("Equilibrium"), text)
    if not points:
        text = say("No configuration satisfies these equations: the forces cannot balance.")
    elif forms.complete and len(points) == len(forms.points):
        text = say("These equations are satisfied exactly by")
    else:
        text = say("These equations are satisfied, among others perhaps, by")
    # States of first order stand behind the coordinates.
    coordinates = system.equations.system.coordinates
    solutions = [_solution(writer, coordinates, point) for point in points]
    exception = None
    if forms.complete and forms.nonzero:
        latex = {p.name: p.latex for p in writer.equations.system.parameters}
        names = enumerated([symbol(name, 0, latex.get(name)) for name in forms.nonzero])
        one, many = "Here {names} is not 0.", "Here {names} are not 0."
        exception = say.counted(len(forms.nonzero), one, many, names=names)
    return section(say("Equilibrium"), text, *_alternatives(solutions), exception)


def _alternatives(solutions: Sequence[list[Part]]) -> Iterator[Part]:
    """Write equilibria with *or* between them; values of one coordinate alone stand together."""
    alternatives: list[list[Part]] = []
    for is_value, alike in groupby(solutions, _is_value):
        if is_value:
            blocks = (block for solution in alike for block in solution)
            rows = [row for block in blocks if isinstance(block, Formulas) for row in block.rows]
            alternatives.append([formulas(rows, result=True)])
        else:
            alternatives += alike
    for number, solution in enumerate(alternatives):
        if number:
            yield say("or")
        yield from solution


def _is_value(solution: Sequence[Part]) -> bool:
    """Say whether an equilibrium is the value of one coordinate."""
    block, *others = solution
    return not others and isinstance(block, Formulas) and len(block.rows) == 1


def _solution(
    writer: StepsWriter, coordinates: Sequence[Coordinate], point: Equilibrium
) -> list[Part]:
    """Write one equilibrium: values of coordinates, and the law under which others are any."""
    pairs = list(zip(coordinates, point.exact or (), strict=True))
    free = [writer.coordinate(c) for c, _ in pairs if c.name in point.free]
    rows = [writer.row(writer.coordinate(c), e) for c, e in pairs if c.name not in point.free]
    laws: list[Formula] = []
    bounds: list[Part] = []
    for condition in point.conditions:
        smaller, larger = writer.formula(condition.smaller), writer.formula(condition.larger)
        if condition.relation == "=":
            laws.append(writer.row(smaller, condition.larger))
        else:
            bounds.append(Law(smaller + " " + AT_MOST + " " + larger))
    blocks: list[Part] = [formulas(rows, result=True)]
    if free:
        names = enumerated(free)
        any_of = say("any {names}", names=names)
        heading = Title(say("any {names} where", names=names) if rows or laws else any_of)
        blocks = [heading, formulas([*rows, *laws], result=True)]
    elif laws:
        blocks += [say("where"), formulas(laws, result=True)]
    return [*blocks, say("provided that"), *bounds] if bounds else blocks
