"""Potentials and kinetic terms of a scene as SymPy expressions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from lagrange_cli.mechanics.algebra.templates import Element
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced


@dataclass(frozen=True)
class RawTerms:
    """Potentials and kinetic terms before coordinates are put in.

    Attributes
    ----------
    elements
        Potentials without velocities, over raw symbols.
    velocity_dependent
        All other potentials, over q, v, t.
    kinetic
        Terms of the section ``kinetic``, over q, v, t.
    """

    elements: tuple[Element, ...]
    velocity_dependent: tuple[sp.Expr, ...]
    kinetic: tuple[sp.Expr, ...]

    @cached_property
    def positional(self) -> tuple[sp.Expr, ...]:
        """The same as expressions."""
        return tuple(element.expr for element in self.elements)


def raw_terms(reduced: Reduced) -> RawTerms:
    """Convert the potentials and kinetic terms of a scene."""
    scene = reduced.scene
    v = {c.v for c in reduced.coordinates}
    positional, dependent = [], []
    for potential in scene.potentials:
        element = reduced.element(potential.expression)
        if v.isdisjoint(element.symbols):
            positional.append(element)
        else:
            dependent.append(reduced.resolve(element.expr))
    kinetic = [reduced.resolve(reduced.convert(k.expression)) for k in scene.kinetic]
    return RawTerms(tuple(positional), tuple(dependent), tuple(kinetic))
