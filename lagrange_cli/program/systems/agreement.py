"""Comparison of what code computes with the certificate, at one of its states."""

from __future__ import annotations

from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal, localcontext
from fractions import Fraction
from itertools import chain, islice
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import mpmath
from mpmath import mpf

from lagrange_cli.mechanics.numerics.bounded_functions import BOUNDED_FUNCTIONS
from lagrange_cli.program.graph.evaluation import Arithmetic, Evaluation
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.graph.value_graph import ONE, ScaledNode, ValueGraph
from lagrange_cli.program.solvers.articulated_bodies import solve_tree
from lagrange_cli.program.solvers.composite_bodies import (
    ChainColumns,
    chain_columns,
    is_chain,
    upper_triangle,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from sympy import Expr

    from lagrange_cli.mechanics.elements.tree import BodyTree
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.findings import DerivationSources
    from lagrange_cli.program.solvers.blocks import MassMatrixSystem

#: Digits in which both derivations are compared.
DIGITS = 50

#: The arithmetic of many digits: sums and products take far less time than those of mpmath.
DECIMALS = Context(prec=DIGITS, Emin=MIN_EMIN, Emax=MAX_EMAX)


def at_certificate(
    values: ValueGraph, wanted: Sequence[ScaledNode], equations: Equations, *, digits: bool = True
) -> list[Any]:
    """Evaluate values at the certificate's state; all are NaN if an operation has no real value."""
    sources, system = equations.derivation.sources, equations.system
    assert sources is not None
    names, state = ("t", *system.layout.variables), (system.t, *system.state_symbols)
    symbols: dict[str, Expr] = dict(zip(names, state, strict=True))
    symbols |= {f"p{k}": p.symbol for k, p in enumerate(system.parameters)}
    symbols |= {f"u{k}": u.symbol for k, u in enumerate(system.inputs)}
    symbols |= {f"a{k}": c.a for k, c in enumerate(system.coordinates)}
    symbols |= {f"l{k}": closure.multiplier for k, closure in enumerate(equations.system.pushing)}
    number, functions = (_decimal, _IN_DECIMALS) if digits else (float, _IN_DOUBLES)
    with mpmath.workdps(DIGITS), localcontext(DECIMALS):
        try:
            inputs = {name: number(sources.state.get(s, mpf(0))) for name, s in symbols.items()}
            arithmetic = Arithmetic(functions, lambda x: number(x.numerator) / x.denominator)
            return Evaluation(values, wanted).at(inputs, arithmetic)
        except (ArithmeticError, ValueError):
            return [mpmath.nan] * len(wanted)


def _decimal(x: Any) -> Decimal:
    """Round a number to a decimal; an arithmetic error if it is complex or infinite."""
    rounded = Decimal(x if isinstance(x, int) else mpmath.nstr(x, DIGITS))
    if not rounded.is_finite():
        raise ArithmeticError
    return rounded


def _of_decimals(function: Callable[..., Any]) -> Callable[..., Decimal]:
    """Wrap a function of mpmath for decimals."""
    return lambda *numbers: _decimal(function(*(mpf(str(x)) for x in numbers)))


def _of_doubles(function: Callable[..., Any]) -> Callable[..., float]:
    """Wrap a function of mpmath's doubles so that a complex result is an arithmetic error."""

    def real(*numbers: float) -> float:
        value = function(*numbers)
        if isinstance(value, complex):
            raise ArithmeticError
        return float(value)

    return real


#: Functions that Python has for numbers of any type.
_OTHERS: dict[str, Callable[..., Any]] = {"abs": abs, "min": min, "max": max}


def _functions(
    arithmetic: Any, wrapped: Callable[[Callable[..., Any]], Callable[..., Any]]
) -> dict[str, Callable[..., Any]]:
    """Gather the functions of a program for numbers of one of mpmath's arithmetics."""
    named = {
        name: "power" if name == "pow" else name for name in PROGRAM_FUNCTIONS.keys() - _OTHERS
    }
    of_mpmath = {
        name: wrapped(getattr(arithmetic, known, getattr(mpmath, known)))
        for name, known in named.items()
    }
    return of_mpmath | _OTHERS


_IN_DOUBLES = _functions(mpmath.fp, _of_doubles)
_IN_DECIMALS = _functions(mpmath.mp, _of_decimals)
_IN_DECIMALS |= {name: _of_decimals(function) for name, function in BOUNDED_FUNCTIONS.items()}


# Articulated bodies.

#: Fewest coordinates of a tree that articulated bodies solve in fewer operations than its mass
#: matrix and elimination take: 7990 beside 7920 for a chain of 16, 12400 beside 16300 for one of 24
#: (``benchmarks/body_chains.py``).
FEWEST_ARTICULATED = 20

#: Difference of accelerations, relative to the largest, that counts as rounding of the certificate.
_SAME = 1e-12

#: Whether articulated bodies give the accelerations of the certificate, by sources.
_ARTICULATED: WeakKeyDictionary[DerivationSources, bool] = WeakKeyDictionary()

#: Whether composite bodies give the inertia of the certificate, by sources.
_COMPOSITE: WeakKeyDictionary[DerivationSources, bool] = WeakKeyDictionary()


def articulated_tree(
    values: ValueGraph, equations: Equations, system: MassMatrixSystem
) -> BodyTree | None:
    """Return the tree of bodies that articulated bodies solve in fewer operations, if any."""
    sources, n = equations.derivation.sources, len(equations.system.mass_matrix)
    tree = None if sources is None else sources.tree
    if sources is None or tree is None or n < FEWEST_ARTICULATED or system.closures:
        return None
    is_current = sources.forcing is equations.system.forcing
    is_definite = equations.derivation.facts.positive_definite_mass_matrix
    if not (is_current and is_definite and tree.has_own_coordinates):
        return None
    if sources not in _ARTICULATED:
        is_whole = set(tree.coordinates) == set(range(n))
        _ARTICULATED[sources] = is_whole and _accelerates(values.copy(), equations, sources, tree)
    return tree if _ARTICULATED[sources] else None


def composite_chain(
    values: ValueGraph, equations: Equations, system: MassMatrixSystem
) -> ChainColumns | None:
    """Return what the columns of M follow from, of a chain that articulated bodies solve."""
    tree, sources = articulated_tree(values, equations, system), equations.derivation.sources
    if tree is None or sources is None or not is_chain(tree):
        return None
    columns = chain_columns(values, tree)
    if sources not in _COMPOSITE:
        _COMPOSITE[sources] = _carries(values, equations, sources, columns)
    return columns if _COMPOSITE[sources] else None


def _carries(
    values: ValueGraph, equations: Equations, sources: DerivationSources, columns: ChainColumns
) -> bool:
    """Tell whether M a − f is what the certificate has for it, with M by its columns."""
    forcing = [values.convert(f) for f in equations.system.forcing]
    numbers = iter(at_certificate(values, [*chain(*columns), *forcing], equations))
    in_digits = ChainColumns(*(list(islice(numbers, len(part))) for part in columns))
    motion = [_decimal(sources.state[c.a]) for c in equations.system.coordinates]
    with localcontext(DECIMALS):
        sums = [-f for f in numbers]
        sizes = list(map(abs, sums))
        for row, column, entry in upper_triangle(in_digits):
            for i, j in {(row, column), (column, row)}:
                sums[i] += entry * motion[j]
                sizes[i] += abs(entry * motion[j])
    rows = zip(sums, sizes, sources.residuals, strict=True)
    return all(
        abs(float(total) - float(residual)) <= _SAME * float(size)
        for total, size, (residual, _) in rows
    )


def _accelerates(
    values: ValueGraph, equations: Equations, sources: DerivationSources, tree: BodyTree
) -> bool:
    """Tell whether x with M x = f + (M a − f) is a, at the state of the certificate."""
    right = [
        values.add([values.convert(f), (Fraction(mpmath.nstr(residual, DIGITS)), ONE)])
        for f, (residual, _) in zip(equations.system.forcing, sources.residuals, strict=True)
    ]
    solution = solve_tree(values, tree, right).solution
    numbers = at_certificate(values, [solution[k] for k in range(len(right))], equations)
    expected = [float(sources.state[c.a]) for c in equations.system.coordinates]
    scale = max(map(abs, expected))
    pairs = zip(numbers, expected, strict=True)
    return all(abs(float(x) - a) <= _SAME * scale for x, a in pairs)
