"""Equations that fill pages: closed forms of them would take hours, and are not sought."""

from __future__ import annotations

from itertools import pairwise

import pytest
import sympy as sp

from lagrange_cli import loads
from lagrange_cli.analysis.forms.hamiltonian import hamiltonian_form
from lagrange_cli.analysis.forms.legendre import inverse_form
from lagrange_cli.mechanics.algebra.polynomials import has_more_nodes
from lagrange_cli.mechanics.dynamics.accelerations import explicit_form

#: A rod from a bob on a circle to one whose x is not along the rod: z_b is a root of 15 terms.
RODS = """\
name: rods
parameters: {l: 1, g: 9.81}
plane: xz
particles: {a: {mass: 1}, b: {mass: 2}}
points: {o: [0, 0, 0]}
constraints:
  u: {distance: [o, a], equals: l}
  v: {distance: [a, b], equals: l*(1 + sin(t)/10)}
coordinates: [p, q]
definitions: {x_a: l*sin(p), z_a: -l*cos(p), x_b: q + l*(1 + sin(t)/10)*sin(q)}
near: {z_b: -1.5}
potentials: {w: {gravity: g}}
initial: {p: 0.5, q: 0.3}
"""


@pytest.mark.slow
def test_long_equations_stay_linear_equations():
    equations = loads(RODS).derive(forces=True).equations
    assert explicit_form(equations).accelerations == (None, None)
    assert equations.derivation.constraint_forces.form == "accelerations"
    assert hamiltonian_form(equations).coupled == (0, 1)


def test_inverses_of_long_matrices_are_not_sought():
    x = sp.symbols("x:60", real=True)
    long = sp.Add(*(a * b for a, b in pairwise(x))) ** 2
    long = sp.Add(*(sp.sin(long * k) for k in range(1, 8)))
    assert has_more_nodes(long, 1_000)
    rows = [{0: long, 1: x[0]}, {0: x[0], 1: long}]
    assert inverse_form(rows, (x[1], x[2]), frozenset(x)) is None
    products = sp.prod(sp.Add(*x[k : k + 9]) for k in range(4))
    rows = [{0: products, 1: x[0]}, {0: x[0], 1: x[1]}]
    assert inverse_form(rows, (x[1], x[2]), frozenset(x)) is None


def test_nodes_are_counted_no_further_than_asked():
    x = sp.Symbol("x")
    assert has_more_nodes(x + 1, 2)
    assert not has_more_nodes(x + 1, 3)
