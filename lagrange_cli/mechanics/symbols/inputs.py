"""Inputs of a system, and their symbols put into its equations."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.free_symbols import unknown_slope
from lagrange_cli.mechanics.sparse import ExpressionRow, entries
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.system import Input

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Closure, System

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


def with_symbols_of_inputs(equations: Equations) -> Equations:
    """Write inputs with rates, which are functions of t, as symbols that do not hang on it."""
    places = {u.symbol: sp.Symbol(u.name, real=True) for u in equations.system.inputs}
    if all(u.is_Symbol for u in places):
        return equations
    system = rewritten(equations.system, lambda e: e.xreplace(places))
    inputs = tuple(replace(u, symbol=places[u.symbol]) for u in system.inputs)
    return replace(equations, system=replace(system, inputs=inputs))


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
        states=tuple(replace(s, rate=put(s.rate)) for s in system.states),
        closures=tuple(map(closure, system.closures)),
        contacts=tuple(replace(c, closure=closure(c.closure)) for c in system.contacts),
        outputs=tuple((name, put(e)) for name, e in system.outputs),
        positive=tuple((name, put(e)) for name, e in system.positive),
    )
