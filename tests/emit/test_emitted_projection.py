"""Emitted projections on to closures: met, smallest, and given up where there are none."""

from __future__ import annotations

import numpy as np
import pytest

from tests.emit import emit_closures as closures
from tests.emit.closed_code import (
    CASES,
    TOLERANCE,
    Closed,
)
from tests.emit.emitted_c import in_types
from tests.parts import changed

pytestmark = [pytest.mark.compiler, pytest.mark.slow]


@pytest.mark.parametrize(("name", "real"), in_types(CASES))
def test_projection_meets_the_closures(name, real, tmp_path):
    equations = CASES[name]()
    compiled = Closed(equations, tmp_path, real)
    p, n = compiled.defaults, len(equations.system.coordinates)
    generator = np.random.default_rng(5)
    if name.startswith("chain"):
        links = n // 2
        start = closures.chain_state(
            links, generator.uniform(-1, 1, links), generator.uniform(-1, 1, links), p[links:-1]
        )
    else:
        start = np.array(
            {
                "pendulum": [1.2, -1.6, 1.6, 1.2],
                "sleigh": [1.0, 2.0, 0.4, np.cos(0.4), np.sin(0.4), 0.3],
                "moving_circle": [1.2, 0.0, 3.0, 0.0, 2.5 / 3, 1.0],
            }[name]
        )
    off = start + generator.uniform(-1, 1, 2 * n) * 1e-3
    status, y = compiled.project(0.0, off, p)
    assert status == 0
    size = compiled.macro("CONSTRAINTS")
    status, out = compiled("constraints", 0.0, y, p, size)
    assert status == 0
    assert np.abs(out).max() < TOLERANCE[real]
    assert np.abs(y - off).max() < 5e-3
    status, again = compiled.project(0.0, y, p)
    assert status == 0
    assert np.abs(again - y).max() <= 4 * np.finfo(compiled.type).eps * np.abs(y).max()
    if name == "moving_circle":
        assert y[2] == compiled.type(off[2])
        assert y[5] == compiled.type(off[5])


def test_projection_is_the_smallest_change_in_the_kinetic_metric(tmp_path):
    """The change of v is M-orthogonal to every velocity that obeys the closures."""
    equations = closures.chain(2)
    compiled = Closed(equations, tmp_path)
    p = compiled.defaults
    p[1] = 50.0
    y = closures.chain_state(2, np.array([0.3, 1.0]), np.array([1.0, 2.0]), p[2:4])
    off = y.copy()
    off[4:] += [0.3, -0.2, 0.5, 0.1]
    status, found = compiled.project(0.0, off, p)
    assert status == 0
    assert (found[:4] == y[:4]).all()
    change = np.repeat(p[:2], 2) * (found[4:] - off[4:])
    for rates in ([1.0, 0.0], [0.0, 1.0]):
        allowed = closures.chain_state(2, np.array([0.3, 1.0]), np.array(rates), p[2:4])[4:]
        assert abs(change @ allowed) < 1e-13


def test_projection_gives_up_where_nothing_obeys_the_closures(tmp_path):
    equations = closures.pendulum()
    x, z = equations.system.coordinates
    nowhere = closures.closure("rod", x.q**2 + z.q**2 + 1, [x, z])
    compiled = Closed(changed(equations, closures=(nowhere,)), tmp_path)
    assert compiled.project(0.0, np.array([1.0, 0.3, 0.0, 0.0]), compiled.defaults)[0] == 3


def test_projection_from_afar_and_of_tiny_and_huge_systems(tmp_path):
    compiled = Closed(closures.pendulum(), tmp_path)
    for unit in (1e-100, 1e-12, 1.0, 1e16, 1e100):
        p = np.array([1.3, 9.81, 2.0]) * [1.0, unit, unit]
        y = np.array([30.0, 40.0, 1.0, 1.0]) * unit
        status, y = compiled.project(0.0, y, p)
        assert status == 0
        assert y / unit == pytest.approx([1.2, 1.6, 0.16, -0.12], rel=1e-14)
