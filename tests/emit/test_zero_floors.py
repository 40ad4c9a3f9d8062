"""Emitted projections where a gap is the difference of nothing: floors and walls at zero."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
import pytest

from lagrange_cli import loads
from tests.emit import contact_systems as contacts
from tests.emit import emit_closures as closures
from tests.emit.emitted_c import TYPES
from tests.emit.test_emitted_contacts import Moded, python_of
from tests.parts import changed
from tests.zero_floors import SCENES

pytestmark = [pytest.mark.compiler, pytest.mark.slow]

#: How far from the floor anywhere else, and how far off states are.
SHIFT, OFF = 10, (0.0, 1e-16, 1e-12, 1e-7)


@cache
def derived(name, shift):
    return loads(SCENES[name][0].format(shift)).derive().equations


def states(equations):
    """States a little off the closures, with every way in which contacts are closed."""
    initial, generator = equations.system.initial, np.random.default_rng(3)
    start = np.array([*initial.positions, *initial.velocities], dtype=float)
    for off in OFF:
        for mode in product((0, 1), repeat=len(equations.system.contacts)):
            yield mode, start + off * generator.uniform(-1, 1, len(start))


def kept(equations, compiled, y, mode):
    """The largest residual of positions that are kept in a mode."""
    status, out = compiled.moded(
        "constraints", 0.0, y, compiled.defaults, mode, compiled.macro("CONSTRAINTS")
    )
    assert status == 0
    of = np.array([1] * len(equations.system.closures) + list(mode))
    return np.abs(out[: len(of)] * of).max()


#: Each scene in doubles, one in every type.
IN_C = [*((name, "double") for name in SCENES), ("rod", "float"), ("rod", "long-double")]


@pytest.mark.parametrize(("name", "real"), IN_C)
def test_projection_to_a_floor_at_zero_in_c(name, real, tmp_path):
    equations = derived(name, 0)
    compiled = Moded(equations, tmp_path, real)
    (tmp_path / "lifted").mkdir()
    lifted = Moded(derived(name, SHIFT), tmp_path / "lifted", real)
    shift = np.array([SHIFT * (c.name in SCENES[name][1]) for c in equations.system.coordinates])
    shift = np.concatenate([shift, np.zeros_like(shift)])
    rounding = float(np.finfo(compiled.type).eps)
    for mode, y in states(equations):
        status, found = compiled.project(0.0, y, compiled.defaults, mode)
        assert status == 0
        assert kept(equations, compiled, found, mode) <= 64 * rounding
        status, above = lifted.project(0.0, y + shift, lifted.defaults, mode)
        assert status == 0
        assert found == pytest.approx(above - shift, abs=1e3 * SHIFT * rounding)


@pytest.mark.parametrize("name", list(SCENES))
def test_projection_to_a_floor_at_zero_in_python(name, tmp_path):
    equations = derived(name, 0)
    compiled, module = Moded(equations, tmp_path), python_of(equations)
    for mode, y in states(equations):
        status, expected = compiled.project(0.0, y, compiled.defaults, mode)
        assert status == 0
        found = module.project(0.0, y, mode=mode)
        assert found == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize("real", list(TYPES))
def test_what_no_state_obeys_is_no_rounding(real, tmp_path):
    """A floor at zero does not make a closure that cannot be met look like one that is."""
    free = closures.pendulum()
    x, z = free.system.coordinates
    nowhere = closures.closure("rod", x.q**2 + z.q**2 + 1, [x, z])
    equations = contacts.with_contacts(
        changed(free, closures=(nowhere,)), contacts.contact("floor", z.q, [x, z])
    )
    compiled = Moded(equations, tmp_path, real)
    for z_at in (0.0, 1e-20, 1e-3):
        status, _ = compiled.project(0.0, [1.0, z_at, 0.0, 0.0], compiled.defaults, (1,))
        assert status in (1, 3)
