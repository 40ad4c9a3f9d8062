"""Warnings for potentials and kinetic energies that jump: impulses act there.

Equations of motion hold beside a surface on which L or its momenta jump. On the surface
an impulse acts. The derivative of ``sign`` is taken as zero, so that the equations lack it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import sympy as sp

from lagrange_cli.errors import Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.free_symbols import holds
from lagrange_cli.mechanics.kinks import BENT, JUMPING, STEPS, step_beside_surface
from lagrange_cli.mechanics.proofs.continuity import solutions
from lagrange_cli.mechanics.proofs.zero_test import vanish
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.scene.model import Term

_HINT = (
    "derived equations hold beside it and simulations end there; tanh(u/w) for sign(u) is smooth"
)


def jump_warnings(reduced: Reduced) -> Iterator[Problem]:
    """Warn of each potential and kinetic term that is not proven to be without impulses."""
    scene = reduced.scene
    for kind, terms in (("potential", scene.potentials), ("kinetic term", scene.kinetic)):
        for term in terms:
            expression = reduced.resolve(reduced.convert(term.expression))
            if holds(expression, *JUMPING) or _bends_in_velocities(expression, reduced):
                yield from _warning(kind, term, expression, reduced)


def _bends_in_velocities(expression: sp.Expr, reduced: Reduced) -> bool:
    if not holds(expression, *BENT):
        return False
    kinks = expression.atoms(*BENT)
    velocities = {c.v for c in reduced.coordinates}
    return any(not velocities.isdisjoint(kink.free_symbols) for kink in kinks)


def _warning(kind: str, term: Term, expression: sp.Expr, reduced: Reduced) -> Iterator[Problem]:
    velocities = [c.v for c in reduced.coordinates if c.v in expression.free_symbols]
    written = _by_signs(expression)
    parts = [written, *(derivative(written, v) for v in velocities)]
    if any(_jumps(part) for part in parts):
        yield Problem(
            f"{kind} '{term.name}' jumps where a sign changes: an impulse acts there,"
            " which the equations of motion do not show",
            term.expression.mark(),
            hint=_HINT,
            rule="impulse",
            severity="warning",
        )


def _by_signs(expression: sp.Expr) -> sp.Expr:
    """Write every kink as a sign times its argument."""
    replaced = expression.replace(lambda e: isinstance(e, STEPS), step_beside_surface)
    replaced = replaced.replace(sp.Max, lambda *a: _largest(a))
    replaced = replaced.replace(sp.Min, lambda *a: -_largest([-u for u in a]))
    return replaced.replace(sp.Abs, lambda u: sp.sign(u, evaluate=False) * u)


def _largest(arguments: Iterable[sp.Expr]) -> sp.Expr:
    first, *remaining = arguments
    for argument in remaining:
        first = (first + argument + sp.Abs(first - argument)) / 2
    return first


def _jumps(written: sp.Expr) -> bool:
    """Tell whether an expression is not proven to be continuous where its signs change."""
    return any(_jumps_at(written, kink) for kink in sorted(written.atoms(sp.sign), key=str))


def _jumps_at(written: sp.Expr, kink: sp.Expr) -> bool:
    surface = kink.args[0]
    jump = written.xreplace({kink: sp.Integer(1)}) - written.xreplace({kink: sp.Integer(-1)})
    return not any(vanish(jump.xreplace(there)) for there in (*solutions(surface), {}))
