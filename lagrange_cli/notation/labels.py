"""Labels of quantities, which are letters that no name of the scene is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.system import tagged
from lagrange_cli.notation.symbols import multiplier_name, multiplier_symbol, split_name
from lagrange_cli.notation.vocabulary import latex_overrides

if TYPE_CHECKING:
    from collections.abc import Collection

    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.equations import Equations

#: Letters of quantities → their labels if the scene uses the letter.
_LABELS = {"T": "T_kin", "V": "V_pot", "U": "U_pot", "L": "Lagrangian", "D": "D_diss", "E": "E_tot"}
_LABELS |= {"h": "h_Jac", "H": "H_fun", "R": "Routhian", "V_eff": "V_eff_red"}

#: Labels of the part of L without potential where that is no kinetic energy.
_FREE_LAGRANGIAN = ("L0", "L_free")


def quantity_labels(equations: Equations) -> dict[str, str]:
    """Return labels of ``T, V, U, L, D, E, h, H, R, V_eff`` that no name of the scene is.

    That of T is L0 where T is no kinetic energy.
    """
    taken = names_shown(equations)
    labels = {short: long if short in taken else short for short, long in _LABELS.items()}
    if not has_kinetic_energy(equations):
        short, long = _FREE_LAGRANGIAN
        labels["T"] = long if short in taken else short
    return labels


def has_kinetic_energy(equations: Equations) -> bool:
    """Tell whether T is quadratic in velocities; else it is a Lagrangian's part without potential.

    Of a relativistic particle it is −m c²/γ, and the kinetic energy m c² (γ − 1).
    """
    velocities = frozenset(c.v for c in equations.system.coordinates)
    return _degree(equations.system.kinetic, velocities) <= 2


def _degree(expression: Expr, symbols: frozenset[Symbol]) -> float:
    """Bound the degree of an expression as a polynomial in symbols; infinite if it is none."""
    if symbols.isdisjoint(symbols_in(expression)):
        return 0
    if expression.is_Symbol:
        return 1
    degrees = [_degree(e, symbols) for e in expression.args]
    if expression.is_Add:
        return max(degrees)
    if expression.is_Mul:
        return sum(degrees)
    is_power = expression.is_Pow and expression.exp.is_Integer and expression.exp > 0
    return int(expression.exp) * degrees[0] if is_power else math.inf


def multiplier_label(equations: Equations, constraint: str) -> str:
    """Name the multiplier of a constraint; underscores tell it from a scene's ``lambda_NAME``."""
    taken = names_shown(equations)
    while f"lambda_{constraint}" in taken:
        constraint = tagged(constraint, "_")
    return multiplier_name(constraint)


def multiplier_column(equations: Equations, constraint: str) -> str:
    """Name the multiplier of a constraint in data, as in equations: ``lambda_rod``."""
    return multiplier_symbol(multiplier_label(equations, constraint))


def free_letter(equations: Equations, letters: tuple[str, ...]) -> str:
    """Return the first of some letters that no name of the scene is, alone or with a word below.

    If all of them are, the last one.
    """
    taken = {name.split("_")[0] for name in names_shown(equations)}
    return next((letter for letter in letters if letter not in taken), letters[-1])


def free_base(equations: Equations, letters: tuple[str, ...], same: Collection[str] = ()) -> str:
    """Return the first of some letters that stands in no name of the scene, indices left out.

    If all of them do, the last one. A letter with numbers below it is no name of the scene then.
    ``same``: names that do not count.
    """
    taken = {split_name(name).base for name in names_shown(equations) - {*same}}
    return next((letter for letter in letters if letter not in taken), letters[-1])


def names_shown(equations: Equations) -> set[str]:
    """List the names of the scene that are printed."""
    names = {p.name for p in equations.system.parameters}
    names |= {c.name for c in equations.system.coordinates}
    names |= {*latex_overrides(equations).values()}
    names |= {c.name for c in equations.system.cartesian_names}
    names |= {
        name for name, _ in (*equations.presentation.abbreviations, *equations.system.outputs)
    }
    # Those that are given stand in their place, and are not printed.
    names |= {
        function.name for function in equations.system.functions if function.expression is None
    }
    return names | {source.name for source in equations.system.inputs}
