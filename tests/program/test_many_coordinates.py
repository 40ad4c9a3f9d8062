"""Programs of systems of many coordinates, written from positions."""

from __future__ import annotations

from functools import cache

import mpmath
import numpy as np
import pytest
import sympy as sp

from lagrange_cli.mechanics.derivation import derive
from lagrange_cli.program.operations import count_operations
from lagrange_cli.program.program import build_program
from lagrange_cli.scene import read_text
from lagrange_cli.simulate.native.rounding_model import perturb
from lagrange_cli.simulate.native.sources import library_source
from tests.program.interpreted import interpreted
from tests.program.test_program import run


def chain_text(links, support="0"):
    """A chain of links, with absolute angles, whose upper end is at x = ``support``."""
    bobs = range(1, links + 1)
    lines = ["name: chain", "plane: xz", "parameters:", "  g: 9.81", "  A: 0.3", "particles:"]
    lines[4:4] = [f"  m{k}: {1 + k / 10}\n  l{k}: {2 - k / 20}" for k in bobs]
    lines += [f"  p{k}: {{mass: m{k}, position: [x{k}, y{k}, z{k}]}}" for k in bobs]
    lines += [f"coordinates: [{', '.join(f'a{k}' for k in bobs)}]", "definitions:"]
    lines += [f"  x0: {support}", "  z0: 0"]
    lines += [f"  x{k}: x{k - 1} + l{k}*sin(a{k})\n  z{k}: z{k - 1} - l{k}*cos(a{k})" for k in bobs]
    return "\n".join([*lines, "potentials:", "  weight: {gravity: g}"])


@cache
def chain(links, support="0"):
    return derive(read_text(chain_text(links, support)))


def a_state(equations, seed):
    generator = np.random.default_rng(seed)
    return generator.uniform(-2, 2, 2 * len(equations.system.coordinates))


def values_of(equations):
    return [p.value for p in equations.system.parameters]


def assert_energy_is_that_shown(equations, program, seed):
    """At a random state, with 30 digits."""
    n, t = len(equations.system.coordinates), 0.7
    y, p = a_state(equations, seed), values_of(equations)
    numbers = {equations.system.t: t}
    numbers |= {x.symbol: value for x, value in zip(equations.system.parameters, p, strict=True)}
    numbers |= {c.q: x for c, x in zip(equations.system.coordinates, y, strict=False)}
    numbers |= {c.v: x for c, x in zip(equations.system.coordinates, y[n:], strict=True)}
    with mpmath.workdps(30):
        ((energy,),) = run(program, t, y, p).values()
        known = map(mpmath.mpf, numbers.values())
        shown = sp.lambdify(list(numbers), equations.system.energy, "mpmath")(*known)
        assert abs(energy - shown) < 1e-20 * abs(shown)


@pytest.mark.slow
@pytest.mark.parametrize("support", ["0", "A*sin(3*t)"])
def test_the_energy_of_many_links_is_that_shown_and_grows_as_they_do(support):
    equations = chain(20, support)
    program = build_program(equations, ["energy"])
    assert_energy_is_that_shown(equations, program, 1)
    assert count_operations(program).total <= 25 * 20


@pytest.mark.slow
def test_a_right_hand_side_of_many_links_is_that_of_newton():
    """M of links is what their endings have in common: Σ m l l cos(a − a)."""
    equations = chain(20)
    program = build_program(equations, ["mass_matrix"])
    y, p = a_state(equations, 2), values_of(equations)
    of = {x.name: x.value for x in equations.system.parameters}
    (entries,) = run(program, 0.0, y, p).values()
    pairs = [(i, j) for i in range(20) for j in range(i, 20)]
    for (i, j), entry in zip(pairs, entries, strict=True):
        mass = sum(of[f"m{k}"] for k in range(j + 1, 21))
        expected = mass * of[f"l{i + 1}"] * of[f"l{j + 1}"] * np.cos(y[i] - y[j])
        assert abs(entry - expected) < 1e-12


def test_the_perturbed_right_hand_side_differs_by_its_factors_alone():
    equations = chain(20)
    program = build_program(equations, ["acceleration"])
    off = perturb(program)
    namespace = interpreted({"rhs": program, "disturbed": off})
    y, p = a_state(equations, 3), values_of(equations)
    factors = off.parameters - program.parameters
    assert factors > count_operations(program).total
    rhs = namespace["rhs"](0.0, y, p)
    assert (namespace["disturbed"](0.0, y, [*p, *[1.0] * factors]) == rhs).all()
    ulps = 1 + 2.0**-52 * np.random.default_rng(0).choice([-1, 1], factors)
    moved = namespace["disturbed"](0.0, y, [*p, *ulps])
    assert 0 < np.abs(moved - rhs).max() < 1e-10 * np.abs(rhs).max()


#: Equal links: the masses below each are whole numbers times m.
EQUAL = """
sizes: {{n: {links}}}
parameters: {{m: 1, g: 9.81, l: 1}}
particles:
  "p[i=1..n]": {{mass: m, position: ["sum(l*sin(q[j]), j=1..i)", 0, "-sum(l*cos(q[j]), j=1..i)"]}}
coordinates: ["q[i=1..n]"]
potentials: {{w: {{gravity: g}}}}
"""


@pytest.mark.slow
@pytest.mark.parametrize("text", [chain_text, lambda links: EQUAL.format(links=links)])
def test_code_of_many_links_does_not_grow_with_them(text):
    def lines(links):
        program = build_program(derive(read_text(text(links))), ["acceleration"])
        return library_source({"rhs": program, "disturbed": perturb(program)}).count("\n")

    assert lines(32) < lines(24) + 10


#: The potential is -k cos(q1) but for a constant; its exponential is below the smallest double.
UNDERFLOWING = """
sizes: {n: 17}
parameters: {m: 1, g: 9.81, l: 1, k: 3000}
particles:
  "p[i=1..n]": {mass: m, position: ["sum(l*sin(q[j]), j=1..i)", 0, "-sum(l*cos(q[j]), j=1..i)"]}
coordinates: ["q[i=1..n]"]
potentials: {w: {gravity: g}, v: "log(2*exp(-k*(2 + cos(q[1]))))"}
initial: {"q[i=1..n]": 0.3}
"""


@pytest.mark.slow
def test_an_energy_that_doubles_do_not_hold_is_that_shown():
    """The logarithm of 0 is no number of doubles: there the two energies cannot be compared."""
    equations = derive(read_text(UNDERFLOWING))
    assert_energy_is_that_shown(equations, build_program(equations, ["energy"]), 3)
    assert build_program(equations, ["acceleration"]).assignments
