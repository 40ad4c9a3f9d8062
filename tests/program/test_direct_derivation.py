"""Code that is derived on the value graph, beside code of the collected equations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from mpmath import mpf

from lagrange_cli import load, loads
from lagrange_cli.program.graph.value_graph import ValueGraph
from lagrange_cli.program.program import build_program
from lagrange_cli.program.systems.direct_derivation import DirectDerivation
from tests.parts import changed

KEPLER = Path(__file__).parents[2] / "systems" / "celestial" / "kepler.yaml"


@pytest.fixture(scope="module")
def equations():
    """Equations of which nothing tells how long they are: the graph's are taken if they agree."""
    equations = load(KEPLER).derive().equations
    return changed(equations, sources=replace(equations.derivation.sources, collected_terms=None))


def accelerations(equations, **changes):
    """Statements of the accelerations, with some fields of the sources replaced."""
    sources = equations.derivation.sources and replace(equations.derivation.sources, **changes)
    return build_program(changed(equations, sources=sources), ["acceleration"])


def test_sources_that_agree_are_taken(equations):
    assert accelerations(equations) != accelerations(changed(equations, sources=None))


def test_sources_that_do_not_agree_are_left(equations):
    collected = accelerations(changed(equations, sources=None))
    sources = equations.derivation.sources
    (first, size), second = sources.residuals
    off = ((first + size * mpf("1e-9"), size), second)
    assert accelerations(equations, residuals=off) == collected
    assert accelerations(equations, other_lagrangian=2 * sources.other_lagrangian) == collected


def test_a_state_at_which_the_graph_divides_by_zero_does_not_agree(equations):
    r = next(c.q for c in equations.system.coordinates if c.name == "r")
    collected = accelerations(changed(equations, sources=None))
    assert (
        accelerations(equations, state={**equations.derivation.sources.state, r: mpf(0)})
        == collected
    )


def test_operations_are_those_that_would_be_written():
    """Forces -2 x - 3 y and -3 x - 1/2: two sums, and three products; a number alone is none."""
    equations = (
        loads(
            "name: two\ncoordinates: [x, y]\nkinetic: {T: (dot(x)^2 + dot(y)^2)/2}\n"
            "potentials: {V: x^2 + 3*x*y + y/2}\n"
        )
        .derive()
        .equations
    )
    system = equations.system
    inputs = [(system.t, "t", 2)]
    inputs += [(c.q, f"q{k}", 3) for k, c in enumerate(system.coordinates)]
    inputs += [(c.v, f"v{k}", 4) for k, c in enumerate(system.coordinates)]
    assert DirectDerivation(ValueGraph(inputs), equations).operations == 5
