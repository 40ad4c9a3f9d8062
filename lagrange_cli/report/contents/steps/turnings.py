"""The turning of rigid bodies: rotations by their turns, angular velocities, angular momenta."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import groupby
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.elements.motion import QuaternionParts
from lagrange_cli.report.contents.steps.writer import (
    DISPLACED,
    StepsWriter,
    turning_of,
)
from lagrange_cli.report.inlines import (
    Inline,
    Label,
    Written,
    below,
    bold,
    entry,
    group,
    joined,
    named,
    rate,
    say,
    symbol,
    times,
    total,
    virtual,
)
from lagrange_cli.report.tree import (
    Formula,
    Formulas,
    Law,
    Part,
    Section,
    formulas,
    section,
)

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.elements.motion import Turning
    from lagrange_cli.mechanics.step_values import BodySteps, SpinSteps, TurningSteps


def rotations(writer: StepsWriter) -> Section | None:
    """Return R of each body by its turns, and the components of its angular velocity."""
    if not _has_turns(writer):
        return None
    return section(
        say("Angular velocities"),
        *(part for body in _spatial(writer) for part in _rotation(writer, body)),
        *_components(writer),
    )


def _has_turns(writer: StepsWriter) -> bool:
    """Say whether turns matter: at rest they do where a torque acts."""
    return bool(writer.turning) and (writer.steps.of_motion or has_torques(writer))


def _spatial(writer: StepsWriter) -> list[BodySteps]:
    return [body for body in writer.turning if turning_of(body).axes != "plane"]


def _rotation(writer: StepsWriter, body: BodySteps) -> Iterator[Part]:
    """Yield R as the product of its turns, and its entries."""
    turning = turning_of(body).turning
    if len(writer.turning) > 1:
        yield writer.title(body.name)
    if body is _spatial(writer)[0]:
        yield say(
            "The columns of {rotation} are the axes of the body along those of space.",
            rotation=Inline(bold("R")),
        )
    turns = [_turn(writer, axis, angle) for axis, angle in _axis_turns(turning)]
    if turns:
        base = [] if turning.on is None else [below(bold("R"), named(turning.on))]
        yield Law(bold("R") + " = " + joined(" ", [*base, *turns]))
    yield formulas(
        writer.row(entry(bold("R"), 1 + number // 3, 1 + number % 3), value)
        for number, value in enumerate(turning.rotation)
    )


def _axis_turns(turning: Turning) -> list[tuple[str, Expr]]:
    """Return turns about axes of coordinates; none if one of the turns is another one."""
    pairs = [turn for turn in turning.turns if not isinstance(turn, QuaternionParts)]
    named = [(axis, angle) for axis, angle in pairs if isinstance(axis, str)]
    return named if len(named) == len(turning.turns) else []


def _turn(writer: StepsWriter, axis: str, angle: Expr) -> Label:
    return below(bold("R"), symbol(axis)) + group(writer.formula(angle))


def _components(writer: StepsWriter) -> Iterator[Part]:
    """Yield the components of angular velocities, those along like axes together."""
    for sentence, bodies in groupby(writer.turning, lambda body: _axes_sentence(turning_of(body))):
        yield sentence
        yield formulas(
            writer.row(writer.spin(body, c.axis), c.spin)
            for body in bodies
            for c in turning_of(body).components
        )


def _axes_sentence(steps: TurningSteps) -> Written:
    if steps.axes == "body":
        return say("Along the axes of the body:")
    if steps.axes == "space":
        return say("Along the axes of space:")
    across = next(k for k, d in enumerate(steps.components[0].direction) if d)
    first, second = (Inline(symbol(axis)) for axis in ("yz", "xz", "xy")[across])
    return say("Counted from {first} to {second}:", first=first, second=second)


def angular_accelerations(writer: StepsWriter) -> Iterator[Part]:
    """Yield the rates of the components of angular velocities."""
    yield from _by_turning(writer, lambda body, c: writer.row(writer.spin(body, c.axis, 1), c.rate))


def displaced_quaternions(writer: StepsWriter) -> Iterator[Part]:
    """Yield δq = ½ q ∘ δφ of each quaternion: its body turns about its own axes."""
    moved: dict[Symbol, list[Expr]] = {}
    for parts in writer.steps.balances:
        one = parts.displacement
        for q, slope in one.rates if one.axis else ():
            moved.setdefault(q, []).append(2 * slope * one.symbol)
    if not moved:
        return
    yield say("A quaternion keeps its length where its body turns by small angles about its axes:")
    half = sympy.Rational(1, 2)
    yield formulas(
        writer.row(virtual(writer.variable(q)), sympy.Mul(half, sympy.Add(*terms), evaluate=False))
        for q, terms in moved.items()
    )


def virtual_turns(writer: StepsWriter) -> Iterator[Part]:
    """Yield δφ = Σ ∂ω/∂q̇ δq, the small angles about the axes of ω.

    Those of a quaternion that turns in space are displacements themselves.
    """
    if not _has_turns(writer):
        return
    small_turns = {
        (parts.displacement.name, parts.displacement.axis): parts.displacement.symbol
        for parts in writer.steps.balances
    }

    def moved(body: BodySteps, c: SpinSteps) -> Expr:
        return sympy.Add(*(slope * symbol for symbol, slope in c.slopes))

    def is_displacement(body: BodySteps, c: SpinSteps) -> bool:
        return bool(moved(body, c) == small_turns.get((body.name, c.axis)))

    def row(body: BodySteps, c: SpinSteps) -> Formula:
        small = virtual(writer.along_spin(writer.angle_letter, body.name, c.axis))
        return writer.row(small, moved(body, c))

    turns = [(body, c) for body in writer.turning for c in turning_of(body).components]
    if all(is_displacement(body, c) for body, c in turns):
        return
    yield say("Bodies turn by small angles about the axes of their angular velocities:")
    chain = times(writer.spin_slope, DISPLACED)
    yield Law(virtual(writer.small_turn) + " = " + total("j", chain))
    yield from _by_turning(writer, row)


def moments(writer: StepsWriter) -> Iterator[Formula]:
    """Yield moments of inertia about centres of mass that have a name here: those that are sums."""
    for body in writer.turning:
        for name, moment in turning_of(body).moments:
            label = writer.along_spin(writer.inertia_tensor_letter, body.name, name)
            yield writer.row(label, moment)


def torques(writer: StepsWriter) -> Iterator[Part]:
    """Yield the applied torques about centres of mass."""
    yield from _by_turning(
        writer,
        lambda body, c: writer.row(
            writer.along_spin(writer.torque_letter, body.name, c.axis), c.torque
        ),
        lambda c: c.torque != 0,
    )


def has_torques(writer: StepsWriter) -> bool:
    """Say whether a torque acts on a body."""
    return any(c.torque != 0 for body in writer.turning for c in turning_of(body).components)


def angular_momenta(writer: StepsWriter) -> Section | None:
    """Return the rates of angular momenta about centres of mass, by Euler's law."""
    if not writer.turning:
        return None
    law = writer.momentum_rate + " = " + writer.inertia_torque
    return section(
        say("Rates of angular momenta"),
        say("About the centres of mass, along the same axes:"),
        Law(law) if any(turning_of(body).axes == "body" for body in writer.turning) else None,
        formulas(moments(writer)),
        *_by_turning(
            writer,
            lambda body, c: writer.row(
                rate(writer.along_spin(writer.momentum_letter, body.name, c.axis)), c.law
            ),
        ),
    )


def _by_turning(
    writer: StepsWriter,
    row: Callable[[BodySteps, SpinSteps], Formula],
    wanted: Callable[[SpinSteps], bool] = lambda _: True,
) -> Iterator[Formulas]:
    """Yield the rows of the components of all bodies, whose labels have their names."""
    rows = tuple(
        row(body, c) for body in writer.turning for c in turning_of(body).components if wanted(c)
    )
    if rows:
        yield Formulas(rows)
