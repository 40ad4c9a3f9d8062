"""Elements of families are converted, and get positions put in, as each one by itself would.

The route beside it reads the text of each element as an expression of its own.
"""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli.mechanics.dynamics.lagrange import derive_uncertified
from lagrange_cli.mechanics.dynamics.potential_forces import raw_terms
from lagrange_cli.mechanics.reduction.reduce import reduce
from lagrange_cli.mechanics.symbols.convert import to_sympy
from lagrange_cli.scene import read_text

NET = """
sizes: {n: 11}
parameters: {m: 1, k: 2, l: {value: 1, positive: true}, "c[i=0..n]": 3}
particles:
  p[i=1..n, j=1..2]: {mass: m, position: [l*i, "u[i,j]", "w[i,j]"]}
points:
  p[0, j=1..2]: [0, 0, 0.1*sin(t)]
definitions:
  w[i=1..n, 1]: 0
coordinates: {"u[i=1..n-1,j=1..2]": {}, "u[n,1]": {}, "u[n,2]": {positive: true}, "w[i=1..n,2]": {}}
potentials:
  along[i=0..n-1, j=1..2]: {spring: ["p[i,j]", "p[i+1,j]"], stiffness: STIFFNESS, length: l}
  across[i=1..n]: {spring: ["p[i,1]", "p[i,2]"], stiffness: "k*pi"}
  own[i=1..n]: "k*abs(u[i,1] - u[1,2])^3 + sin(u[i,2] - w[i,2])"
  drive[i=1..n]: "k*t*w[i,2]"
"""


def raw(expr: sp.Basic) -> object:
    return (expr.func, *map(raw, expr.args)) if expr.args else expr


@pytest.fixture(scope="module", params=["k", '"c[i]"'])
def reduced(request):
    return reduce(read_text(NET.replace("STIFFNESS", request.param)))


def test_elements_are_what_their_own_trees_say(reduced):
    elements = raw_terms(reduced).elements
    assert len({element.shape for element in elements}) < len(elements) / 2
    for potential, element in zip(reduced.scene.potentials, elements, strict=True):
        alone = to_sympy(potential.expression, reduced.names.lookup)
        assert raw(element.expr) == raw(alone)
        resolved = reduced.resolved_element(element)
        assert raw(resolved.expr) == raw(reduced.drawn(alone.xreplace(dict(reduced.resolved))))


@pytest.mark.slow
def test_forces_are_slopes_of_the_potential(reduced):
    derivation = derive_uncertified(reduced)
    for c, force in zip(reduced.coordinates, derivation.forcing_sums, strict=True):
        assert sp.expand(force + sp.diff(derivation.potential, c.q)) == 0
