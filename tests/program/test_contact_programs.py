"""Programs with contacts: each set of closed contacts against dense solutions by NumPy."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import sympy as sp

from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.program.lowered.stored import StoredFunctions
from tests.emit import contact_systems as contacts


@pytest.fixture(scope="module", params=list(contacts.CASES))
def system(request, tmp_path_factory):
    """Equations, and their code in machine code and in Python."""
    equations = contacts.CASES[request.param]()
    machine = contacts.Machine(equations, tmp_path_factory.mktemp(request.param))
    return equations, machine, contacts.Interpreted(equations)


def reference(equations):
    """Matrix, forcing and rows of closures and contacts as one function of (t, y, p)."""
    e = equations
    arguments = [
        e.system.t,
        *(c.q for c in e.system.coordinates),
        *(c.v for c in e.system.coordinates),
    ]
    arguments += [p.symbol for p in e.system.parameters]
    of = [*e.system.closures, *(k.closure for k in e.system.contacts)]
    rows = [x for k in of for x in (*k.gradient, k.rate, k.bias, k.expression)]
    mass = [m for row in e.system.mass_matrix for m in row]
    evaluate = sp.lambdify(arguments, [mass, list(e.system.forcing), rows], dummify=True)
    n = len(e.system.coordinates)

    def values(t, y, p):
        mass, forcing, rows = (np.array(x, dtype=float) for x in evaluate(t, *y, *p))
        return mass.reshape(n, n), forcing, rows.reshape(len(of), n + 3)

    return values


def states(equations, count=2):
    generator = np.random.default_rng(7)
    for _ in range(count):
        y = generator.uniform(-1.5, 1.5, 2 * len(equations.system.coordinates))
        yield (
            generator.uniform(0, 2),
            y,
            generator.uniform(0.5, 2, len(equations.system.parameters)),
        )


def masks(equations):
    every = list(product((0.0, 1.0), repeat=len(equations.system.contacts)))
    return [np.array(mask) for mask in (every if len(every) <= 8 else [*every[:3], *every[-3:]])]


def solution(mass, right, rows, biases):
    """[a; λ] of M a = f + Φᵀ λ, Φ a + b = 0."""
    m = len(rows)
    matrix = np.block([[mass, -rows.T], [rows, np.zeros((m, m))]])
    return np.linalg.solve(matrix, np.concatenate([right, -biases]))


def solvable(rows, closed):
    held = rows[closed]
    # NumPy 1.26 refuses the rank of nothing.
    return not len(held) or np.linalg.matrix_rank(held) == len(held)


@pytest.mark.slow
@pytest.mark.compiler
def test_each_set_of_contacts(system):
    equations, *codes = system
    values = reference(equations)
    n, m = len(equations.system.coordinates), len(equations.system.closures)
    size = m + len(equations.system.contacts)
    checked = 0
    for t, y, p in states(equations):
        mass, forcing, rows = values(t, y, p)
        gradient, rate, bias, phi = rows[:, :n], rows[:, n], rows[:, n + 1], rows[:, n + 2]
        for flags in masks(equations):
            closed = np.array([True] * m + [f > 0 for f in flags])
            if not solvable(gradient, closed):
                continue
            checked += 1
            found = solution(mass, forcing, gradient[closed], bias[closed])
            multipliers = np.zeros(size)
            multipliers[closed] = found[n:]
            events = np.where(flags > 0, multipliers[m:], phi[m:])
            kinds = [k.kind == "position" for k in equations.system.closures]
            positions = [*(phi[:m][kinds] if m else []), *(flags * phi[m:])]
            rates = (gradient @ y[n:] + rate) * closed
            targets = np.linspace(-1, 2, size - m)
            aims = np.concatenate([np.zeros(m), -targets])
            hit = solution(mass, np.zeros(n), gradient[closed], aims[closed])[:n]
            expected = {
                "contact_rhs": np.concatenate([y[n:], found[:n]]),
                "contact_multipliers": multipliers,
                "contact_constraints": np.array([*positions, *rates]),
                "events": events,
                "impulse": hit,
            }
            for function, value in expected.items():
                for code in codes:
                    got = code(function, t, y, p, flags, targets, size=len(value))
                    scale = np.abs(value).max(initial=1e-300) + np.abs(found).max() * 1e-3
                    assert got == pytest.approx(value, rel=1e-9, abs=1e-10 * scale), function
    assert checked >= 2


@pytest.mark.slow
@pytest.mark.compiler
def test_gaps_and_their_terms(system):
    equations, *codes = system
    values = reference(equations)
    n, m, u = (
        len(equations.system.coordinates),
        len(equations.system.closures),
        len(equations.system.contacts),
    )
    names = [p.symbol for p in equations.system.parameters]
    for t, y, p in states(equations):
        _, _, rows = values(t, y, p)
        restitution = [
            float(k.restitution.subs(dict(zip(names, p, strict=True))))
            for k in equations.system.contacts
        ]
        expected = [*rows[m:, :n].ravel(), *rows[m:, n], *rows[m:, n + 1], *restitution]
        flags = np.ones(u)
        for code in codes:
            terms = code("gap_terms", t, y, p, flags, size=u * (n + 3))
            assert terms == pytest.approx(expected, rel=1e-13, abs=1e-13)
            gaps = code("gaps", t, y, p, flags, size=2 * u)
            assert gaps[:u] == pytest.approx(rows[m:, n + 2], rel=1e-13, abs=1e-13)
            assert (gaps[u:] >= np.abs(gaps[:u])).all()


@pytest.mark.slow
@pytest.mark.compiler
def test_machine_code_and_python_agree(system):
    equations, machine, python = system
    n, u = len(equations.system.coordinates), len(equations.system.contacts)
    for t, y, p in states(equations, 4):
        for flags in masks(equations):
            for function, size in {"contact_rhs": 2 * n, "events": u}.items():
                a = machine(function, t, y, p, flags, size=size)
                b = python(function, t, y, p, flags)
                assert a == pytest.approx(b, rel=1e-12, abs=1e-13 * np.abs(b).max())


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("name", ["particle_on_sphere", "pendulum_at_wall", "ladder"])
def test_projection_meets_closed_contacts_alone(name, tmp_path):
    equations = contacts.CASES[name]()
    p, u = contacts.defaults(equations), len(equations.system.contacts)
    n = len(equations.system.coordinates)
    start = {
        "particle_on_sphere": [0.9, 1.2, 0.8, -0.6],
        "pendulum_at_wall": [0.5, -np.sqrt(3.75), 0.0, 0.0],
        "ladder": [0.48, 0.64, np.arctan2(3, 4), 0.64, -0.48, 1.0],
    }[name]
    off = np.array(start) + np.random.default_rng(2).uniform(-1, 1, 2 * n) * 1e-3
    for code in (contacts.Machine(equations, tmp_path), contacts.Interpreted(equations)):
        for flags in masks(equations):
            y = code.project(0.0, off, p, flags)
            count = sum(1 + (k.kind == "position") for k in equations.system.closures) + 2 * u
            constraints = code("contact_constraints", 0.0, y, p, flags, size=count)
            assert np.abs(constraints).max() < 1e-14
            if not flags.any() and not equations.system.closures:
                assert (y == off).all()


def test_flags_and_factors_leave_the_value_alone():
    equations = contacts.ladder()
    programs = contacts.simulation_programs(equations)
    python = contacts.Interpreted(equations)
    factors = programs["contact_disturbed"].parameters - programs["contact_rhs"].parameters
    assert factors > 10
    y = [0.48, 0.64, np.arctan2(3, 4), 0.64, -0.48, 1.0]
    for flags in ([0.0, 0.0], [1.0, 0.0], [1.0, 1.0]):
        p = [*contacts.defaults(equations), *flags, 0.0, 0.0]
        exact = python.functions["contact_rhs"](0.0, y, p)
        assert (
            python.functions["contact_disturbed"](0.0, y, [*p, *[1.0] * factors]) == exact
        ).all()
        # Others read the same parameters, with factors behind them or without.
        assert (python.functions["contact_rhs"](0.0, y, [*p, *[2.0] * factors]) == exact).all()
        off = python.functions["contact_disturbed"](0.0, y, [*p, *[1 + 1e-10] * factors])
        assert 0 < np.abs(off - exact).max() < 1e-7


def test_names_of_the_scene_are_not_in_the_code():
    equations = contacts.ladder()
    programs = contacts.simulation_programs(equations)
    functions = {name: lowered(program, name) for name, program in programs.items()}
    text = contacts.library_source(programs) + StoredFunctions.from_functions(functions).text
    assert "ladder" not in text
    assert "floor" not in text.replace("floor(", "")
    assert "flag(" not in text
