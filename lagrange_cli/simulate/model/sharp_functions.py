"""Sharp and steep functions in the equations: a peak may be short, a slope may be unbounded.

``exp(−((t − c)/w)²)``, ``1/(w² + x²)``, ``tanh(x/w)`` and ``cos(x)^1000`` are smooth, and yet may
do all that they do between two evaluations of a step. Their exponents change slowly beside them:
the peak of an exponent shows on a step's interpolant, however narrow the force is.

A force as sqrt(x) is not Lipschitz at x = 0, and more than one motion may begin there. Programs
for the arguments of such functions, and for their rates along a motion, are made here;
:mod:`.verification.uniqueness` evaluates them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.simulate.model.expressions import (
    outputs_program,
    rates,
    with_accelerations,
)

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.program.program import Program

#: Exponents that are watched; systems with more of them have none that is.
_MOST_EXPONENTS = 32

#: The least exponent of a power that is sharp at its largest.
_LEAST_SHARP_POWER = 8

#: Functions that go from one value to another within a few units of their argument.
_STEPS = (sympy.tanh, sympy.atan)


def peak_exponents(equations: Equations, parts: Iterable[Expr]) -> tuple[Expr, ...]:
    """Find the exponents of sharp functions in the equations, over q, v, t, parameters.

    A function has a peak, or its step, where its exponent has a peak. Empty where there are
    more than can be watched. ``parts`` are those of :func:`.expressions.calls_and_powers`.
    """
    moving = {equations.system.t, *equations.system.state_symbols}
    every: dict[Expr, None] = {}
    for part in parts:
        for exponent in _exponents(part):
            if not moving.isdisjoint(exponent.free_symbols):
                every[exponent] = None
    return tuple(every) if len(every) <= _MOST_EXPONENTS else ()


def _exponents(e: Expr) -> Iterator[Expr]:
    if isinstance(e, sympy.exp):
        yield e.args[0]
        yield -sympy.Abs(e.args[0])
    elif isinstance(e, _STEPS):
        yield -sympy.Abs(e.args[0])
    elif e.is_Pow and e.exp.is_number and (e.exp.is_negative or e.exp >= _LEAST_SHARP_POWER):
        if isinstance(e.base, sympy.cosh):
            # As good as its logarithm, and never too large.
            yield e.exp * sympy.Abs(e.base.args[0])
        else:
            yield e.exp * sympy.log(sympy.Abs(e.base))


#: Arguments that are followed. Chosen so that no scene has more and each sample evaluates few
#: expressions; not tuned.
_MOST_ARGUMENTS = 16

#: Operations of the largest argument that is followed. Chosen so that its two rates, which have
#: some ten times as many, are derived in a fraction of a second; not tuned.
_LARGEST_ARGUMENT = 200


def steep_arguments(equations: Equations, parts: Iterable[Expr]) -> tuple[Expr, ...]:
    """Find expressions that vanish where a force or an inertia has an unbounded slope.

    These are the bases of powers with exponents between 0 and 1 (the argument of an absolute
    value), and 1 − g² for asin(g) and acos(g), g − 1 for acosh(g), whose slopes are not bounded
    either. Of more than ``_MOST_ARGUMENTS`` the first are taken. ``parts`` are those of
    :func:`.expressions.calls_and_powers`.
    """
    moving = set(equations.system.state_symbols)
    numbers = {
        p.symbol: sympy.Float(p.value) for p in equations.system.parameters if p.value is not None
    }
    arguments: dict[Expr, None] = {}
    for argument in _steep(parts, numbers):
        short = argument.count_ops() <= _LARGEST_ARGUMENT
        if short and not argument.free_symbols.isdisjoint(moving):
            arguments[argument] = None
    return tuple(arguments)[:_MOST_ARGUMENTS]


def _steep(parts: Iterable[Expr], numbers: Mapping[Expr, Expr]) -> Iterator[Expr]:
    """Find the arguments in parts of expressions, in their order."""
    for part in parts:
        exponent = part.exp.xreplace(numbers) if part.is_Pow else sympy.Integer(0)
        if exponent.is_Number and 0 < exponent < 1:
            yield part.base.args[0] if isinstance(part.base, sympy.Abs) else part.base
        elif isinstance(part, (sympy.asin, sympy.acos)):
            yield 1 - part.args[0] ** 2
        elif isinstance(part, sympy.acosh):
            yield part.args[0] - 1


def steep_places(equations: Equations, arguments: Sequence[Expr]) -> tuple[str, ...]:
    """Write the places where arguments vanish as equations in words of the scene."""
    if not arguments:
        return ()
    from lagrange_cli.notation.scene_language import to_scene_language  # imports all of notation

    return tuple(f"{to_scene_language(g, equations)} = 0" for g in arguments)


def steep_program(equations: Equations, arguments: Sequence[Expr]) -> Program | None:
    """Make the program that evaluates the arguments and their rates; None without arguments.

    It gives all arguments, then their first and their second rates; a second rate is 0 if the
    argument depends on velocities. It reads accelerations behind the parameters.
    """
    if not arguments:
        return None
    first, second = rates(arguments, equations, derivative)
    every = [*arguments, *first, *second]
    return outputs_program(with_accelerations(equations), every)
