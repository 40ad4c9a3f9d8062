"""Lagrange's equations of the coordinates, part by part, with constraints that keep multipliers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.notation.build import display_terms
from lagrange_cli.report.contents.sentences import divisor_and_factor, multipliers_line
from lagrange_cli.report.contents.steps.writer import PLACE, SPEED, StepsWriter, Writer, sum_of
from lagrange_cli.report.inlines import (
    Label,
    Text,
    Written,
    enumerated,
    partial,
    rate,
    say,
    symbol,
    times,
    total,
)
from lagrange_cli.report.tree import Formula, Law, Part, Section, Title, formulas, section

if TYPE_CHECKING:
    from lagrange_cli.mechanics.system import Closure


def constraints(writer: StepsWriter) -> Section | None:
    """Closure equations with the derivatives by which their multipliers push."""
    system = writer.equations.system
    rows: list[Formula] = []
    for closure in writer.restricting:
        left, order = writer.constraint(closure), int(closure.kind == "velocity")
        rows.append(writer.row(left, closure.expression))
        for j, slope in entries(closure.gradient).items():
            by = writer.coordinate(system.coordinates[j], order)
            rows.append(writer.row(partial(left, by), slope))
    if not rows:
        return None
    sentences: list[Written] = []
    closures = [c for c in system.closures if c in writer.restricting]
    if closures:
        names = enumerated([writer.constraint(c) for c in closures])
        one = "Beside the equations of motion {listed} vanishes."
        many = "Beside the equations of motion {listed} vanish."
        sentences.append(say.counted(len(closures), one, many, listed=names))
    if system.contacts:
        gaps = enumerated([writer.constraint(c.closure) for c in system.contacts])
        one, many = "{listed} is the gap of a contact.", "{listed} are gaps of contacts."
        sentences.append(say.counted(len(system.contacts), one, many, listed=gaps))
    line = multipliers_line(writer.equations, writer.restricting)
    return section(
        say("Constraints with multipliers"),
        writer.paragraph(*sentences),
        formulas(rows),
        say("{text}.", text=line) if line else None,
    )


def lagrange_equations(writer: StepsWriter) -> Section | None:
    """∂L/∂v, its rate, ∂L/∂q of each coordinate, then the equation before and after division."""
    count = len(writer.equations.system.coordinates)
    if not count:
        return None
    law = Law(lagrange_law(writer, multiplier_terms(writer, writer.equations.system.pushing)))
    blocks = (block for number in range(count) for block in _coordinate(writer, number))
    return section(say("Lagrange's equations"), law, *blocks)


def lagrange_law(writer: Writer, multiplied: Iterable[Label | str]) -> Label:
    """d/dt ∂L/∂v − ∂L/∂q + ∂D/∂v = Q + Σ λ ∂φ/∂q, as far as there are such parts.

    ``multiplied``: the terms with λ.
    """
    labels, system = writer.labels, writer.equations.system
    left = rate(partial(labels["L"], SPEED)) + " - " + partial(labels["L"], PLACE)
    if system.dissipation != 0:
        left += " + " + partial(labels["D"], SPEED)
    force = symbol("Q_j") if system.forces else ""
    return left + " = " + sum_of([force, *multiplied])


def multiplier_terms(writer: StepsWriter, pushing: Sequence[Closure]) -> Iterator[Label]:
    """Return generalized forces of closures and contacts, of each kind there is."""
    taken = {closure.kind for closure in pushing}
    left = symbol(f"{writer.constraint_letter}_k")
    for kind, by in (("position", PLACE), ("velocity", SPEED)):
        if kind in taken:
            yield total("k", times(symbol("lambda_k"), partial(left, by)))


def _coordinate(writer: StepsWriter, number: int) -> Iterator[Part]:
    labels, coordinate = writer.labels, writer.equations.system.coordinates[number]
    place, speed = writer.coordinate(coordinate), writer.coordinate(coordinate, 1)
    steps = writer.steps.coordinates[number]
    momentum = partial(labels["L"], speed)
    yield Title(say("For {place}:", place=place))
    rows = [
        writer.row(momentum, steps.momentum),
        writer.row(rate(momentum), steps.momentum_rate),
        writer.row(partial(labels["L"], place), steps.slope),
    ]
    if steps.drag != 0:
        rows.append(writer.row(partial(labels["D"], speed), steps.drag))
    yield formulas(rows)
    coordinates = writer.equations.system.coordinates
    speeds, accelerations = [c.v for c in coordinates], [c.a for c in coordinates]
    force = writer.steps.generalized_force(coordinate.q)
    multipliers = [c.multiplier for c in writer.equations.system.pushing]
    terms = steps.ungathered_terms(speeds, accelerations, multipliers, force)
    if terms:
        shown = replace(writer.equations.derivation.shown[number], terms=terms)
        yield say("so that")
        yield formulas([Formula("", (display_terms(shown, writer.words),))])
    opening = say("or, with like terms collected,") if terms else say("so that")
    yield from equation(writer, number, opening)


def equation(writer: StepsWriter, number: int, opening: Text) -> Iterator[Part]:
    """Yield the equation of motion of a coordinate before a factor is divided out, and after."""
    shown = writer.equations.derivation.shown[number]
    yield opening
    divisor, factor = divisor_and_factor(shown)
    if divisor is not None or factor is not None:
        whole = replace(shown, terms=writer.steps.coordinates[number].terms)
        yield formulas([Formula("", (display_terms(whole, writer.words),))])
    if divisor is not None:
        yield say("and, divided by {factor},", factor=writer.formula(divisor))
    elif factor is not None:
        yield say("and, multiplied by {factor},", factor=writer.formula(factor))
    yield formulas([Formula("", (display_terms(shown, writer.words),))], result=True)
