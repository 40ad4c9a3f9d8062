"""Code that is derived on the value graph, beside code of the collected equations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from mpmath import mpf

from lagrange_cli import load
from lagrange_cli.program.program import build_program

KEPLER = Path(__file__).parents[2] / "systems" / "celestial" / "kepler.yaml"


@pytest.fixture(scope="module")
def equations():
    """Equations of which nothing tells how long they are: the graph's are taken if they agree."""
    equations = load(KEPLER).derive().equations
    return replace(equations, sources=replace(equations.sources, collected_terms=None))


def accelerations(equations, **changes):
    """Statements of the accelerations, with some fields of the sources replaced."""
    sources = equations.sources and replace(equations.sources, **changes)
    return build_program(replace(equations, sources=sources), ["acceleration"])


def test_sources_that_agree_are_taken(equations):
    assert accelerations(equations) != accelerations(replace(equations, sources=None))


def test_sources_that_do_not_agree_are_left(equations):
    collected = accelerations(replace(equations, sources=None))
    sources = equations.sources
    (first, size), second = sources.residuals
    off = ((first + size * mpf("1e-9"), size), second)
    assert accelerations(equations, residuals=off) == collected
    assert accelerations(equations, other_lagrangian=2 * sources.other_lagrangian) == collected


def test_a_state_at_which_the_graph_divides_by_zero_does_not_agree(equations):
    r = next(c.q for c in equations.coordinates if c.name == "r")
    collected = accelerations(replace(equations, sources=None))
    assert accelerations(equations, state={**equations.sources.state, r: mpf(0)}) == collected
