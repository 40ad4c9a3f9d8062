"""Conserved quantities as columns of a motion, with the terms that they are sums of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import count

import sympy as sp

from lagrange_cli.analysis.energies import energy_sum
from lagrange_cli.analysis.symmetries import linear_symmetries
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.findings import FollowedQuantity

#: Terms that a quantity is multiplied out to; a longer one is compared with its own size.
_TERM_BUDGET = 200

#: Column of T + V, where Jacobi's integral is another function.
ENERGY_SUM = "T + V"


def with_constants_of_motion(equations: Equations) -> Equations:
    """Follow all that :func:`.analyze.analyze` finds conserved; the energy is followed anyway.

    Momenta of cyclic coordinates, those of linear symmetries, and T + V where that is conserved
    and is not the energy function h.
    """
    outputs, followed = dict(equations.outputs), list[FollowedQuantity]()
    taken = {s.name for c in equations.coordinates for s in (c.q,)} | {"t", "energy", "jacobi"}
    taken |= {c.name for c in equations.cartesian_names}
    for quantity in _quantities(equations):
        name = _free_name(quantity, taken, outputs)
        outputs[name] = quantity.expression
        followed.append(replace(quantity, name=name))
        taken.add(name)
    return replace(equations, outputs=tuple(outputs.items()), followed=tuple(followed))


def _quantities(equations: Equations) -> Iterator[FollowedQuantity]:
    for known in equations.conserved:
        if known.kind == "momentum":
            yield _of_terms(known.name, known.expression)
    for symmetry in linear_symmetries(equations).found:
        yield _of_terms(symmetry.name, symmetry.expression)
    found = energy_sum(equations)
    # At impacts it changes as h does, which is told by itself.
    if found is not None and found.conserved and not equations.contacts:
        whole = sp.Add(equations.energy, found.difference)
        yield FollowedQuantity(ENERGY_SUM, whole, (equations.kinetic,))


def _of_terms(name: str, expression: sp.Expr) -> FollowedQuantity:
    """Multiply a quantity out, so that no term is a difference that may vanish by itself."""
    terms = expand_terms(expression, _TERM_BUDGET) or sp.Add.make_args(expression)
    return FollowedQuantity(name, expression, tuple(terms))


def _free_name(quantity: FollowedQuantity, taken: set[str], outputs: dict[str, sp.Expr]) -> str:
    """Return the name, numbered where the scene has another quantity of that name."""
    for k in count(1):
        name = quantity.name if k == 1 else f"{quantity.name}_{k}"
        if name not in taken and outputs.get(name, quantity.expression) == quantity.expression:
            return name
    raise AssertionError
