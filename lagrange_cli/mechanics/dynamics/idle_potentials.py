"""Warnings of potentials that no motion changes, as of gravity across the plane of the motion."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import sympy as sp

from lagrange_cli.errors import Mark, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.proofs.refutation import depends
from lagrange_cli.mechanics.proofs.zero_test import does_not_depend
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.quoting import written
from lagrange_cli.scene.model import Term

_AXES = ("x", "y", "z")

#: Potentials of a scene up to which one that holds coordinates is examined for being constant.
_FEW = 16


def idle_potential_warnings(reduced: Reduced) -> Iterator[Problem]:
    """Yield a warning for each potential that is constant over all coordinates and velocities.

    Of a family all members have to be.
    """
    if not reduced.coordinates:
        return
    members: dict[Mark, list[Term]] = {}
    for term in reduced.scene.potentials:
        members.setdefault(term.mark, []).append(term)
    moving = [s for c in reduced.coordinates for s in (c.q, c.v)]
    examined = moving if len(reduced.scene.potentials) <= _FEW else []
    for mark, terms in members.items():
        if all(_is_idle(reduced, term, moving, examined) for term in terms):
            name = terms[0].name if len(terms) == 1 else terms[0].name.partition("[")[0]
            yield Problem(
                f"no motion changes potential '{name}'",
                mark,
                hint=_hint(reduced, terms[0]),
                rule="idle-potential",
                severity="warning",
            )


def _is_idle(
    reduced: Reduced, term: Term, moving: list[sp.Symbol], examined: list[sp.Symbol]
) -> bool:
    """Tell whether a potential is proven to hold no coordinate and no velocity that matters."""
    resolved = reduced.resolve(reduced.convert(term.expression))
    present = symbols_in(resolved).intersection(moving)
    if not present:
        return True
    if not present <= set(examined):
        return False
    # A symbol of few terms shows soonest that it matters: the last joint of a chain, say.
    uses = Counter(s for t in sp.Add.make_args(resolved) for s in symbols_in(t))
    if any(depends(resolved, s) for s in sorted(present, key=lambda s: (uses[s], s.name))):
        return False
    return all(does_not_depend(resolved, s) for s in present)


@dataclass(frozen=True)
class Weights:
    """The weight of some particles, V = Σ m γ z.

    Attributes
    ----------
    axis, strength
        ``x``, ``y`` or ``z``, and γ over the parameters.
    particles
        Names of the particles.
    """

    axis: str
    strength: sp.Expr
    particles: frozenset[str]


def weights_of(reduced: Reduced, term: Term) -> Weights | None:
    """Return the weights that a potential is, up to a constant; None if it is something else."""
    raw, constants = reduced.convert(term.expression), {*reduced.names.parameters.values()}
    bodies = zip(
        reduced.scene.particles, reduced.names.particle_symbols, reduced.masses, strict=True
    )
    places = {
        s: (body.name, axis, mass)
        for body, symbols, mass in bodies
        for axis, s in zip(_AXES, symbols, strict=True)
    }
    components = symbols_in(raw) - constants
    if not components or not components <= places.keys():
        return None
    pulls = {(places[s][1], sp.cancel(derivative(raw, s) / places[s][2])) for s in components}
    axis, strength = pulls.pop()
    if pulls or strength == 0 or not symbols_in(strength) <= constants:
        return None
    return Weights(axis, strength, frozenset(places[s][0] for s in components))


def _hint(reduced: Reduced, term: Term) -> str:
    """Name the axes that the potential acts along, and those along which something moves."""
    moving, bodies = {c.q for c in reduced.coordinates}, reduced.names.body_symbols
    components = symbols_in(reduced.convert(term.expression))
    across = [axis for k, axis in enumerate(_AXES) if any(body[k] in components for body in bodies)]
    free = [
        axis
        for k, axis in enumerate(_AXES)
        if any(moving & symbols_in(reduced.resolved[body[k]]) for body in bodies)
    ]
    if not across or not free:
        return "it holds neither a coordinate nor a velocity"
    if set(across) <= set(free):
        return "it has the same value at all positions"
    hint = f"it acts along {_listed(across)}; the particles move along {_listed(free)}"
    weights = weights_of(reduced, term)
    if weights is None or weights.axis in free:
        return hint
    down = ", ".join("-1" if axis == free[-1] else "0" for axis in _AXES)
    strength = written(weights.strength).removeprefix("-")
    helper = f"{term.name}: {{gravity: {strength}, direction: [{down}]}}"
    return f"{hint}; gravity along -{free[-1]} is\n{helper}"


def _listed(axes: list[str]) -> str:
    return " and ".join([", ".join(axes[:-1]), axes[-1]] if len(axes) > 1 else axes)
