"""Inputs of a scene as a simulation knows them: functions of time, numbers of pieces, or driven."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from dataclasses import replace
from typing import TYPE_CHECKING

from sympy import Symbol

from lagrange_cli.errors import InputError, NotRealError, Problem, nearest
from lagrange_cli.files.interpolation import COEFFICIENTS
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.substitution import with_numbers
from lagrange_cli.mechanics.symbols.inputs import controllers_with, rewritten
from lagrange_cli.mechanics.system import Input
from lagrange_cli.simulate.model.expressions import calls_and_powers
from lagrange_cli.simulate.model.sharp_functions import steep_arguments
from lagrange_cli.simulate.model.switching_surfaces import one_sided

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations


def with_driven_inputs(equations: Equations, names: Set[str]) -> Equations:
    """Leave the values of some inputs to whoever simulates.

    Raises
    ------
    InputError
        There is no such input, or its rate would be needed: a force has a kink where an
        expression with the input vanishes.
    """
    if not names:
        return equations
    known = [u.name for u in equations.system.inputs]
    for name in sorted(names - set(known)):
        hint = nearest(name, known) or "inputs: [F] declares one"
        raise _refused(f"the scene has no input '{name}'", hint)
    bases = {u.base for u in equations.system.inputs if u.order}
    touched = {u.base for u in equations.system.inputs if u.name in names}
    for name in sorted(touched & bases):
        missing = sorted({name, f"dot({name})", f"ddot({name})"} - names)
        if missing:
            said = f"the input '{name}' stands where its rates are needed"
            raise _refused(said, f"functions for {' and '.join(missing)} give the others")
    inputs = tuple(
        replace(u, expression=None, recording=None) if u.name in names else u
        for u in equations.system.inputs
    )
    driven = replace(equations, system=replace(equations.system, inputs=inputs))
    _require_smooth(driven)
    return driven


def _require_smooth(equations: Equations) -> None:
    """Refuse driven inputs in what is followed by its rate."""
    driven = {u.symbol: u.name for u in equations.system.inputs if u.driven}
    substituted = substitute_inputs(equations)
    parts = calls_and_powers(substituted)
    one_side = one_sided(substituted, parts)
    followed = (*(one_side.surfaces if one_side else ()), *steep_arguments(substituted, parts))
    for expression in followed:
        for symbol in sorted(expression.free_symbols & driven.keys(), key=str):
            raise _refused(
                f"a force has a kink, a jump or an infinite slope that depends on the input"
                f" '{driven[symbol]}', whose rate a Python function does not tell",
                "record the input in a file, or give it as an expression in t",
            )


def _refused(message: str, hint: str) -> InputError:
    return InputError(Problem(message, hint=hint, rule="inputs"))


def substitute_inputs(equations: Equations) -> Equations:
    """Put the scene's functions of time in place of its inputs.

    Those from files become polynomials whose coefficients are inputs; driven ones stay, behind
    these.

    Raises
    ------
    InputError
        They make an expression that is no finite real number, as 1/u with u = 0.
    """
    if not equations.system.inputs:
        return equations
    replacements, inputs = {}, list[Input]()
    for u in equations.system.inputs:
        if u.driven:
            continue
        value = u.expression
        if u.recording is not None:
            numbers = tuple(_numbers(u))
            value = _polynomial(numbers, equations.system.t)
            # Rates are those of the polynomial before them, whose numbers they have.
            inputs += numbers if u.order == 0 else ()
            for _ in range(u.order):
                value = derivative(value, equations.system.t)
        replacements[u.symbol] = value

    def put(expression: Expr) -> Expr:
        substituted = with_numbers(expression, replacements)
        if substituted is None:
            names = ", ".join(f"'{u.name}'" for u in equations.system.inputs)
            raise NotRealError(
                Problem(
                    f"with the values of {names} a force or an energy is no finite real number",
                    hint="look at what stands below fractions and under roots",
                    rule="not-real",
                )
            )
        return substituted

    driven = tuple(u for u in equations.system.inputs if u.driven)
    system = replace(equations.system, inputs=(*inputs, *driven))
    if any(u.order for u in equations.system.inputs):
        return replace(equations, system=rewritten(system, put))
    return replace(
        equations,
        system=replace(
            system,
            forcing=tuple(map(put, system.forcing)),
            states=tuple(s.rewritten(put) for s in system.states),
            controllers=controllers_with(system.controllers, put),
            energy=put(system.energy),
            kinetic=put(system.kinetic),
            potential=put(system.potential),
            lagrangian=put(system.lagrangian),
            outputs=tuple((name, put(e)) for name, e in system.outputs),
        ),
    )


def _numbers(recorded: Input) -> Iterator[Input]:
    """Make the inputs that stand for a recorded one: the numbers of a piece; none otherwise."""
    if recorded.recording is None:
        return
    coefficients = COEFFICIENTS[recorded.recording.interpolation]
    for k in range(coefficients + (coefficients > 1)):
        name = f"{recorded.base}|{k}"
        yield Input(name, Symbol(name, real=True), None)


def _polynomial(numbers: Sequence[Input], t: Symbol) -> Expr:
    """Write a polynomial in the time since the first number, in Horner's form; or a number."""
    first, *coefficients = (u.symbol for u in numbers)
    if not coefficients:
        return first
    value = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        value = coefficient + (t - first) * value
    return value
