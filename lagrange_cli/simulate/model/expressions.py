"""Expressions over a state: what moves it, rates along a motion, and programs for some of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.mechanics.system import Parameter
from lagrange_cli.program.emitted_functions import program_of

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.program.program import Program


def forces_and_inertias(equations: Equations) -> Iterator[Expr]:
    """Yield forces, rates of states, then the entries of the mass matrix that are not zero."""
    yield from equations.system.forcing
    yield from (state.rate for state in equations.system.states)
    for row in equations.system.mass_matrix:
        yield from entries(row).values()


def distinct_parts(expressions: Iterable[Expr]) -> Iterator[Expr]:
    """Yield the parts of expressions from the whole down, each once where trees share it.

    Equal parts that were built apart are yielded apart.
    """
    wholes = list(expressions)
    seen: set[int] = set()
    for whole in wholes:
        stack = [whole]
        while stack:
            part = stack.pop()
            if id(part) not in seen:  # alive, as the whole is
                seen.add(id(part))
                yield part
                stack.extend(reversed(part.args))


def calls_and_powers(equations: Equations) -> list[Expr]:
    """List the parts of forces and inertias that are no sums, products, symbols or numbers."""
    parts = distinct_parts(forces_and_inertias(equations))
    return [part for part in parts if part.args and not (part.is_Add or part.is_Mul)]


def outputs_program(equations: Equations, expressions: Iterable[Expr]) -> Program:
    """Make the program that evaluates some expressions, in place of the scene's outputs."""
    outputs = tuple((f"output({k})", e) for k, e in enumerate(expressions))
    return program_of(
        replace(equations, system=replace(equations.system, outputs=outputs)), "outputs"
    )


def with_accelerations(equations: Equations) -> Equations:
    """Add the accelerations as further parameters."""
    accelerations = (Parameter(c.a.name, c.a) for c in equations.system.coordinates)
    return replace(
        equations,
        system=replace(equations.system, parameters=(*equations.system.parameters, *accelerations)),
    )


def rates(
    expressions: Sequence[Expr], equations: Equations, in_time: Callable[[Expr, Symbol], Expr]
) -> tuple[list[Expr], list[Expr]]:
    """Differentiate expressions with respect to time, once and twice.

    A second rate is 0 where the expression depends on velocities or states. ``in_time`` is the
    partial derivative with respect to the time.
    """
    velocities = {c.v for c in equations.system.coordinates}
    velocities |= {state.symbol for state in equations.system.states}
    first = [_rate(e, equations, in_time) for e in expressions]
    second = [
        sympy.Integer(0) if e.free_symbols & velocities else _rate(rate, equations, in_time)
        for e, rate in zip(expressions, first, strict=True)
    ]
    return first, second


def _rate(expression: Expr, equations: Equations, in_time: Callable[[Expr, Symbol], Expr]) -> Expr:
    terms = [in_time(expression, equations.system.t)]
    for c in equations.system.coordinates:
        terms.append(derivative(expression, c.q) * c.v)
        if c.v in expression.free_symbols:
            terms.append(derivative(expression, c.v) * c.a)
    for state in equations.system.states:
        if state.symbol in expression.free_symbols:
            terms.append(derivative(expression, state.symbol) * state.rate)
    return sympy.Add(*terms)
