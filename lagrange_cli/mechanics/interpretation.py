"""Expressions of the scene language over the symbols of certified equations."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import sympy as sp

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.symbols.convert import to_sympy, total_derivative
from lagrange_cli.scene.language.expression import ANGULAR_VELOCITIES, Expression, names_in
from lagrange_cli.scene.language.families import Budget, written_expression
from lagrange_cli.scene.language.grammar import parse_expression
from lagrange_cli.scene.language.rotations import implied_name
from lagrange_cli.scene.language.written_text import WrittenText

_SPINS = tuple(f"{stem}(" for stem in ANGULAR_VELOCITIES)


def interpret(
    equations: Equations,
    expression: Expression,
    further: Mapping[str, sp.Expr] = MappingProxyType({}),
) -> sp.Expr:
    """Convert an expression of the scene language over the symbols of ``equations``.

    Names are coordinates, parameters, inputs, states, Cartesian names, angular velocities of
    bodies, abbreviations, multipliers;
    ``dot`` and ``ddot`` are total time derivatives. ``further`` gives names of momenta.

    Raises
    ------
    InputError
        Located: an unknown name, or a value that is not a finite real number.
    """
    meanings: dict[str, sp.Expr] = {**further, "t": equations.system.t}
    meanings.update((name, expr) for name, expr in equations.presentation.abbreviations)
    for particle in equations.system.particles:
        for axis, position in zip("xyz", particle.position, strict=True):
            meanings[f"{axis}_{particle.name}"] = position
        if particle.turning is not None:
            spins = (*particle.turning.spin_in_space, *particle.turning.spin)
            names = (implied_name(stem, particle.name) for stem in ANGULAR_VELOCITIES)
            meanings.update(zip(names, spins, strict=True))
    multipliers = [c.multiplier for c in equations.system.pushing]
    meanings.update((multiplier.name, multiplier) for multiplier in multipliers)
    meanings.update((c.name, c.position) for c in equations.system.cartesian_names)
    meanings.update((p.name, p.symbol) for p in equations.system.parameters)
    meanings.update((u.name, u.symbol) for u in equations.system.inputs)
    meanings.update((s.name, s.symbol) for s in equations.system.states)
    meanings.update((c.name, c.q) for c in equations.system.coordinates)
    _require_known_spins(expression, meanings)
    chain = [(c.q, c.v) for c in equations.system.coordinates]
    chain += [(c.v, c.a) for c in equations.system.coordinates]
    chain += [(s.symbol, s.rate) for s in equations.system.states]
    return to_sympy(
        expression,
        meanings.get,
        lambda expr: total_derivative(expr, equations.system.t, chain),
        {f.name: f for f in equations.system.functions},
    )


def _require_known_spins(expression: Expression, meanings: Mapping[str, sp.Expr]) -> None:
    """Refuse angular velocities of frames without mass, of which equations keep no motion."""
    for node in names_in(expression.node):
        if node.name in meanings or not node.name.startswith(_SPINS):
            continue
        raise InputError(
            Problem(
                f"'{node.name}' is not known in the equations: they keep the angular velocities of"
                " bodies with mass",
                expression.mark(node.span),
                hint=f"give that of a frame a name in the scene: definitions: {{w: {node.name}}}",
                rule="unknown-name",
            )
        )


def expression_of(equations: Equations, written: WrittenText, start: int, end: int) -> Expression:
    """Read a part of a text as an expression of the scene language.

    Raises
    ------
    InputError
        Located: the text is no expression.
    """
    mark, functions = (
        written.mark(start, end),
        {f.name: f.arity for f in equations.system.functions},
    )
    parsed = parse_expression(written.text[start:end].strip(), mark, functions=functions)
    return written_expression(parsed, dict(equations.presentation.sizes), Budget())


def value_of(
    equations: Equations,
    written: WrittenText,
    start: int,
    end: int,
    further: Mapping[str, sp.Expr] = MappingProxyType({}),
) -> sp.Expr:
    """Read a part of a text as an expression over the symbols of the equations.

    Parameters
    ----------
    equations, written
        The equations and the text.
    start, end
        Bounds of the part.
    further
        Names that may be used beside those of the equations.

    Raises
    ------
    InputError
        Located: it is no such expression, or has accelerations or multipliers in it.
    """
    value = interpret(equations, expression_of(equations, written, start, end), further)
    unknown = {c.a for c in equations.system.coordinates} | {
        c.multiplier for c in equations.system.pushing
    }
    if not value.free_symbols.isdisjoint(unknown):
        said = "neither accelerations nor multipliers belong to a state"
        raise written.refusal(said, start, end, "write it with coordinates and their dot(...)")
    return value
