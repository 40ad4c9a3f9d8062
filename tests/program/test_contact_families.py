"""Many contacts: loops in place of statements, a sparse solution, and pushes that are guessed."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli.program import program as programs
from lagrange_cli.program.emitted_functions import contact_programs
from lagrange_cli.program.operations import count_operations, elimination_operations
from lagrange_cli.program.systems.contact_systems import with_contact_flags
from lagrange_cli.simulate.native.sources import library_source
from tests.emit import contact_systems as contacts
from tests.emit import emit_closures as closures

pytestmark = pytest.mark.slow


def chain_over_floors(n: int):
    """A chain of rods with a floor below each mass, some of them steep."""
    equations = closures.chain(n)
    of = equations.system.coordinates
    floors = [
        contacts.contact(f"floor{i}", of[2 * i + 1].q + of[2 * i].q / (2 + i % 2) + 3, of)
        for i in range(n)
    ]
    return contacts.with_contacts(equations, *floors, name="chain_over_floors")


def statements(equations, monkeypatch):
    """Code of the same equations without loops."""
    with monkeypatch.context() as patched:
        patched.setattr(programs, "is_large_system", lambda equations: False)
        return contacts.Interpreted(equations)


@pytest.fixture(scope="module")
def chain():
    return chain_over_floors(12)


def states(equations, count=6):
    generator = np.random.default_rng(11)
    u = len(equations.system.contacts)
    for k in range(count):
        y = generator.uniform(-1, 1, 2 * len(equations.system.coordinates))
        p = generator.uniform(0.5, 2, len(equations.system.parameters))
        flags = generator.integers(0, 2, u).astype(float) * (k > 0)
        yield generator.uniform(0, 2), y, p, flags, generator.normal(size=u)


@pytest.mark.compiler
@pytest.mark.parametrize("language", [contacts.Machine, contacts.Interpreted])
def test_loops_compute_what_statements_do(chain, language, monkeypatch, tmp_path):
    plain = statements(chain, monkeypatch)
    code = language(chain, tmp_path) if language is contacts.Machine else language(chain)
    n, m, u = len(chain.system.coordinates), len(chain.system.closures), len(chain.system.contacts)
    sizes = {
        "contact_rhs": 2 * n,
        "contact_multipliers": m + u,
        "contact_constraints": 2 * (m + u),
        "contact_position_error": 2 * (m + u),
        "contact_position_reach": m + u,
        "contact_position_change": n,
        "contact_velocity_error": 2 * (m + u),
        "contact_velocity_change": n,
        "gaps": 2 * u,
        "gap_terms": u * (n + 3),
        "impulse": n,
    }
    assert set(sizes) == set(contact_programs(with_contact_flags(chain)))
    apart = [name for name in sizes if name.endswith(("_error", "_reach", "_change"))]
    if language is contacts.Machine:
        # Others alone call these.
        sizes = {name: size for name, size in sizes.items() if name not in apart}
    for t, y, p, flags, targets in states(chain):
        for function, size in sizes.items():
            expected = plain(function, t, y, p, flags, targets, size)
            found = code(function, t, y, p, flags, targets, size)
            assert (found is None) == (expected is None), function
            if found is not None:
                scale = np.abs(expected).max()
                assert np.abs(found - expected).max() <= 1e-9 * scale, function


@pytest.mark.compiler
def test_many_that_land_at_once(tmp_path):
    """All masses of a chain come down on one floor, at random speeds; then what rests on it."""
    equations = closures.chain(12)
    of = equations.system.coordinates
    floors = [contacts.contact(f"floor{i}", of[2 * i + 1].q + 3, of) for i in range(12)]
    equations = contacts.with_contacts(equations, *floors, name="landing")
    machine, python = contacts.Machine(equations, tmp_path), contacts.Interpreted(equations)
    p, generator = contacts.defaults(equations), np.random.default_rng(5)
    length = p[1]
    x = length * np.arange(1, 13)
    for _ in range(6):
        y = np.zeros(48)
        y[0:24:2], y[1:24:2] = x, -3.0
        y[25::2] = generator.normal(size=12)
        found = [code.reset(0.0, y, p, np.zeros(12), 3) for code in (machine, python)]
        (state, closed), (expected, flags) = found
        assert list(closed) == list(flags)
        assert state == pytest.approx(expected, abs=1e-9)
        # Nothing goes through the floor.
        assert state[25::2].min() >= -1e-12


def test_text_and_operations_of_many_contacts():
    texts, costs = [], []
    for n in (20, 40):
        equations = with_contact_flags(chain_over_floors(n))
        of = contact_programs(equations)
        of["rhs"] = programs.build_program(equations, ["acceleration"])
        texts.append(len(library_source(of)))
        costs.append(
            count_operations(of["contact_rhs"]).total + elimination_operations(of["contact_rhs"])
        )
    assert texts[1] < 1.1 * texts[0]
    assert costs[1] < 2.1 * costs[0]
