"""Lagrange's equations of the coordinates, part by part, with constraints that keep multipliers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.notation.build import display, display_terms
from lagrange_cli.report.contents.sentences import divisor_and_factor, multipliers_line
from lagrange_cli.report.contents.steps.writer import StepsWriter, Writer, sum_of
from lagrange_cli.report.inlines import Text
from lagrange_cli.report.tree import (
    Block,
    Formula,
    Law,
    Paragraph,
    Section,
    Title,
    formulas,
    section,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import ShownEquation
    from lagrange_cli.mechanics.step_values import CoordinateSteps
    from lagrange_cli.mechanics.system import Closure, Coordinate


def constraints(writer: StepsWriter) -> Section | None:
    """Closure equations with the derivatives by which their multipliers push."""
    equations, say = writer.equations, writer.say
    rows: list[Formula] = []
    for closure in equations.system.pushing:
        left = writer.constraint(closure)
        rows.append(writer.row(left, closure.expression))
        for j, slope in entries(closure.gradient).items():
            rows.append(writer.row(_slope(writer, closure, equations.system.coordinates[j]), slope))
    if not rows:
        return None
    sentences = []
    if equations.system.closures:
        names = writer.lettered_list([writer.constraint(c) for c in equations.system.closures])
        sentences.append(
            say.counted(
                len(equations.system.closures),
                "Beside the equations of motion {listed} vanishes.",
                "Beside the equations of motion {listed} vanish.",
                listed=names,
            )
        )
    if equations.system.contacts:
        gaps = writer.lettered_list(
            [writer.constraint(c.closure) for c in equations.system.contacts]
        )
        one, many = "{listed} is the gap of a contact.", "{listed} are gaps of contacts."
        sentences.append(say.counted(len(equations.system.contacts), one, many, listed=gaps))
    line = multipliers_line(equations)
    return section(
        say("Constraints with multipliers"),
        writer.paragraph(*sentences),
        formulas(rows),
        writer.paragraph(say("{text}.", text=writer.lettering.text(line)) if line else ""),
    )


def _slope(writer: StepsWriter, closure: Closure, coordinate: Coordinate) -> str:
    order = 1 if closure.kind == "velocity" else 0
    return writer.letters.partial(
        writer.constraint(closure), writer.lettered_coordinate(coordinate, order)
    )


def lagrange_equations(writer: StepsWriter) -> Section | None:
    """∂L/∂v, its rate, ∂L/∂q of each coordinate, then the equation before and after division."""
    coordinates = writer.equations.system.coordinates
    if not coordinates:
        return None
    blocks = [
        block
        for c, steps, shown in zip(
            coordinates, writer.steps.coordinates, writer.equations.derivation.shown, strict=True
        )
        for block in _coordinate(writer, c, steps, shown)
    ]
    law = Law(lagrange_law(writer, multiplier_terms(writer)))
    return section(writer.say("Lagrange's equations"), law, *blocks)


def lagrange_law(writer: Writer, multiplied: Iterable[Text]) -> str:
    """d/dt ∂L/∂v − ∂L/∂q + ∂D/∂v = Q + Σ λ ∂φ/∂q, as far as there are such parts.

    ``multiplied``: the terms with λ.
    """
    letters, labels = writer.letters, writer.lettered_labels
    place, speed = letters.symbol("q_j"), letters.symbol("q_j", 1)
    left = f"{letters.rate(letters.partial(labels['L'], speed))}"
    left += f" - {letters.partial(labels['L'], place)}"
    if writer.equations.system.dissipation != 0:
        left += f" + {letters.partial(labels['D'], speed)}"
    force = letters.symbol("Q_j") if writer.equations.system.forces else ""
    return f"{left} = {sum_of([force, *map(writer.lettering.text, multiplied)])}"


def multiplier_terms(writer: StepsWriter) -> Iterator[str]:
    """Return generalized forces of closures and contacts, of each kind there is."""
    letters, taken = writer.letters, {closure.kind for closure in writer.equations.system.pushing}
    left, push = writer.constraint_letter, letters.symbol("lambda_k")
    for kind, order in (("position", 0), ("velocity", 1)):
        if kind in taken:
            slope = letters.partial(letters.symbol(f"{left}_k"), letters.symbol("q_j", order))
            yield letters.total("k", letters.times(push, slope))


def _coordinate(
    writer: StepsWriter, coordinate: Coordinate, steps: CoordinateSteps, shown: ShownEquation
) -> Iterator[Block]:
    letters, labels = writer.letters, writer.lettered_labels
    place, speed = writer.lettered_coordinate(coordinate), writer.lettered_coordinate(coordinate, 1)
    momentum = letters.partial(labels["L"], speed)
    yield Title(writer.say("For {place}:", place=letters.inline(place)))
    rows = [
        writer.row(momentum, steps.momentum),
        writer.row(letters.rate(momentum), steps.momentum_rate),
        writer.row(letters.partial(labels["L"], place), steps.slope),
    ]
    if steps.drag != 0:
        rows.append(writer.row(letters.partial(labels["D"], speed), steps.drag))
    yield formulas(rows)
    yield from equation(writer, steps, shown)


def equation(writer: StepsWriter, steps: CoordinateSteps, shown: ShownEquation) -> Iterator[Block]:
    """Return an equation of motion before a factor is divided out, and after."""
    yield Paragraph(writer.say("so that"))
    divisor, factor = divisor_and_factor(shown)
    done = divisor if divisor is not None else factor
    if done is not None:
        whole = replace(shown, terms=steps.terms)
        yield formulas([Formula("", (display_terms(whole, writer.words),))])
        factor_text = writer.letters.inline(writer.letters.formula(display(done, writer.words)))
        if divisor is not None:
            yield Paragraph(writer.say("and, divided by {factor},", factor=factor_text))
        else:
            yield Paragraph(writer.say("and, multiplied by {factor},", factor=factor_text))
    yield formulas([Formula("", (display_terms(shown, writer.words),))], result=True)
