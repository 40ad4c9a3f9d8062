"""Inputs of a system, their symbols put into its equations, and controllers that hold them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import sympy as sp

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.free_symbols import unknown_slope
from lagrange_cli.mechanics.sparse import ExpressionRow, entries
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.system import Controller, Input, State

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Closure, System
    from lagrange_cli.scene.language.expression import Expression
    from lagrange_cli.scene.model import Scene

_Put = Callable[["Expr"], "Expr"]


def inputs_of(names: Names) -> Iterator[Input]:
    """Yield the inputs; behind one that positions hold, its rates."""
    for declared in names.scene.inputs:
        symbol, expression = names.inputs[declared.name], None
        if declared.expression is not None:
            expression = names.convert(declared.expression)
        yield Input(declared.name, symbol, expression, declared.recording)
        for order, word in enumerate(("dot", "ddot") if not symbol.is_Symbol else (), 1):
            symbol = unknown_slope(symbol)
            expression = None if expression is None else derivative(expression, names.t)
            name = f"{word}({declared.name})"
            yield Input(name, symbol, expression, declared.recording, order)


def controllers_of(
    scene: Scene,
    number: Callable[[Expression], Expr | None],
    convert: Callable[[Expression], Expr],
) -> Iterator[Controller]:
    """Yield the controllers; ``convert`` writes an expression of the scene over (q, v, t), and
    ``number`` evaluates one in parameters, None if one of them has no value.

    Raises
    ------
    InputError
        Located: the time between samples is not positive.
    """
    for declared in scene.controllers:
        every = number(declared.every)
        if every is not None and not every > 0:
            message = f"the time between samples must be positive, found {declared.every.text}"
            raise InputError(Problem(message, declared.every.mark(), rule="controllers"))
        yield Controller(
            declared.name,
            convert(declared.every),
            tuple((value.name, convert(value.expression)) for value in declared.held_inputs),
            tuple((value.name, convert(value.expression)) for value in declared.memory),
        )


def closed_loop(equations: Equations) -> Equations:
    """Return the equations with inputs that controllers hold as states of rate 0, the last ones.

    They start at 0, until the sample at the start sets them.
    """
    system = equations.system
    sampled = {name for controller in system.controllers for name, _ in controller.held_inputs}
    if not sampled:
        return equations
    states = tuple(State(u.name, u.symbol, sp.S.Zero) for u in system.inputs if u.name in sampled)
    initial = system.initial
    if initial is not None:
        initial = replace(
            initial,
            states=(*initial.states, *(0.0 for _ in states)),
            decimals=(*initial.decimals, *("0" for _ in states)) if initial.decimals else (),
        )
    closed = replace(
        system,
        inputs=tuple(u for u in system.inputs if u.name not in sampled),
        states=(*system.states, *states),
        initial=initial,
    )
    return replace(equations, system=closed)


def with_symbols_of_inputs(equations: Equations) -> Equations:
    """Write inputs with rates, which are functions of t, as symbols that do not hang on it."""
    places = {u.symbol: sp.Symbol(u.name, real=True) for u in equations.system.inputs}
    if all(u.is_Symbol for u in places):
        return equations
    system = rewritten(equations.system, lambda e: e.xreplace(places))
    inputs = tuple(replace(u, symbol=places[u.symbol]) for u in system.inputs)
    return replace(equations, system=replace(system, inputs=inputs))


def controllers_with(controllers: tuple[Controller, ...], put: _Put) -> tuple[Controller, ...]:
    """Apply a function to what controllers set."""

    def each(values: tuple[tuple[str, Expr], ...]) -> tuple[tuple[str, Expr], ...]:
        return tuple((name, put(e)) for name, e in values)

    return tuple(
        replace(c, held_inputs=each(c.held_inputs), memory=each(c.memory)) for c in controllers
    )


def rewritten(system: System, put: _Put) -> System:
    """Apply a function to all expressions over the state; those of inputs stay."""

    def each(expressions: tuple[Expr, ...]) -> tuple[Expr, ...]:
        return tuple(map(put, expressions))

    def row(expressions: Sequence[Expr]) -> Sequence[Expr]:
        if isinstance(expressions, ExpressionRow):
            changed = {j: put(e) for j, e in entries(expressions).items()}
            return ExpressionRow(len(expressions), changed)
        return tuple(map(put, expressions))

    def closure(constraint: Closure) -> Closure:
        return replace(
            constraint,
            expression=put(constraint.expression),
            gradient=row(constraint.gradient),
            rate=put(constraint.rate),
            bias=put(constraint.bias),
        )

    chart = system.chart
    if chart is not None:
        moved = [
            replace(c, position=put(c.position), velocity=put(c.velocity)) for c in chart.places
        ]
        chart = replace(chart, places=tuple(moved))
    return replace(
        system,
        chart=chart,
        particles=tuple(p.rewritten(put) for p in system.particles),
        cartesian_names=tuple(
            replace(c, position=put(c.position), velocity=put(c.velocity))
            for c in system.cartesian_names
        ),
        kinetic=put(system.kinetic),
        potential=put(system.potential),
        lagrangian=put(system.lagrangian),
        dissipation=put(system.dissipation),
        forces=tuple(
            replace(f, components=each(f.components), generalized=each(f.generalized))
            for f in system.forces
        ),
        mass_matrix=tuple(row(r) for r in system.mass_matrix),
        forcing=each(system.forcing),
        energy=put(system.energy),
        states=tuple(s.rewritten(put) for s in system.states),
        controllers=controllers_with(system.controllers, put),
        closures=tuple(map(closure, system.closures)),
        contacts=tuple(replace(c, closure=closure(c.closure)) for c in system.contacts),
        outputs=tuple((name, put(e)) for name, e in system.outputs),
        positive=tuple((name, put(e)) for name, e in system.positive),
    )
