"""What happens at an event: impacts and closed contacts against results by hand."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import sympy as sp

from tests.campaign import slice_of
from tests.emit import contact_systems as contacts

pytestmark = [pytest.mark.compiler, pytest.mark.slow]

START = -1


@pytest.fixture(params=["machine code", "Python"])
def code_of(request, tmp_path):
    """Equations → functions of their code, in one of both languages."""
    if request.param == "Python":
        return contacts.Interpreted
    return lambda equations: contacts.Machine(equations, tmp_path)


def test_a_ball_bounces(code_of):
    equations = contacts.bouncing_ball()
    code, p = code_of(equations), contacts.defaults(equations)
    for speed, bounce, after in ((-3.0, 1.0, 2.4), (-3.0, 0.0, 0.0), (-1e-150, 1.0, 8e-151)):
        y, flags = code.reset(1.5, [1.0, -1e-17, 0.5, speed], p, [0], 0, bounce)
        assert y == pytest.approx([1.0, -1e-17, 0.5, after], rel=1e-15, abs=0)
        # Without restitution it stays.
        assert list(flags) == [float(bounce == 0)]


def test_restitutions_are_between_0_and_1(code_of):
    code = code_of(contacts.bouncing_ball())
    for e, found in ((-1e-3, False), (0.0, True), (1.0, True), (1.001, False)):
        after = code.reset(1.5, [1.0, 0.0, 0.5, -3.0], [2.0, 9.81, e], [0], 0)
        assert (after is not None) == found


def test_what_does_not_pull_is_not_closed(code_of):
    equations = contacts.bouncing_ball()
    code, p = code_of(equations), contacts.defaults(equations)
    for state, event, closed in (
        ([0, 0, 1, 0], START, 1),  # at rest on the floor
        ([0, 0, 1, 0.1], START, 0),  # leaving it
        ([0, 1, 1, -0.1], START, 0),  # above it
        ([0, 1e-17, 1, 0], 0, 1),  # what has the event is closed
    ):
        y, flags = code.reset(0.0, state, p, [0], event)
        assert (y == state).all()
        assert list(flags) == [closed]
    upwards = p * [1, -1, 1]
    y, flags = code.reset(0.0, [0, 0, 1, 0], upwards, [0], START)
    assert list(flags) == [0]
    # What is closed stays so where rounding has moved it, and is released at its event.
    y, flags = code.reset(0.0, [0, 1e-15, 1, 1e-16], p, [1], START)
    assert list(flags) == [1]
    y, flags = code.reset(0.0, [0, 1e-15, 1, 1e-16], p, [1], 0)
    assert list(flags) == [0]


def test_balls_in_a_row(code_of):
    equations = contacts.balls(3)
    code, p = code_of(equations), contacts.defaults(equations)
    # Newton's law by Moreau: the two at rest move off together.
    y, flags = code.reset(0.0, [0, 0.5, 1.0, 1, 0, 0], p, [0, 0], 0)
    assert y[3:] == pytest.approx([-1 / 3, 2 / 3, 2 / 3], rel=1e-14)
    assert list(flags) == [0, 0]
    # One after the other, they exchange velocities.
    y, flags = code.reset(0.0, [0, 0.5, 1.1, 1, 0, 0], p, [0, 0], 0)
    assert y[3:] == pytest.approx([0, 1, 0], abs=1e-15)
    # Both close at once, from both sides.
    y, _ = code.reset(0.0, [0, 0.5, 1.0, 1, 0, -1], p, [0, 0], 1)
    assert y[3:] == pytest.approx([-1, 0, 1], abs=1e-15)
    # Inelastic: all move on as one, touching, without a force between them.
    y, flags = code.reset(0.0, [0, 0.5, 1.0, 1, 0, 0], p, [0, 0], 0, 0.0)
    assert y[3:] == pytest.approx([1 / 3] * 3, rel=1e-14)
    assert list(flags) == [0, 0]


def test_light_balls_between_heavy_ones(code_of):
    code = code_of(contacts.balls(3))
    state = [0, 0.5, 1.0, 1, 0, 0]
    for mass in (1e-4, 1e-8, 1e-12):
        y, _ = code.reset(0.0, state, [1, mass, 1, 0.5, 1], [0, 0], 0, 0.0)
        assert y[3:] == pytest.approx([1 / (2 + mass)] * 3, rel=1e-14)
    # Two pushes that double arithmetic cannot tell apart.
    assert code.reset(0.0, state, [1, 1e-14, 1, 0.5, 1], [0, 0], 0, 0.0) is None


@pytest.mark.parametrize("restitution", [0.0, 0.3, 1.0])
def test_random_balls(restitution, tmp_path):
    """Moreau's law for balls of very different masses: impulses follow from their momenta."""
    n = 6
    code = contacts.Machine(contacts.balls(n), tmp_path)
    generator = np.random.default_rng(4)
    for _ in range(100):
        masses = 10 ** generator.uniform(-4, 4, n)
        v = np.sort(generator.normal(size=n))[::-1]
        touching = generator.random(n - 1) < 0.7
        x = np.concatenate([[0], np.cumsum(np.where(touching, 0.5, 0.9))])
        y, _ = code.reset(0.0, [*x, *v], [*masses, 0.5, restitution], [0] * (n - 1), START)
        change = masses * (v - y[n:])
        impulses, noise = np.cumsum(change)[:-1], 1e-12 * masses.max()
        w = np.diff(y[n:]) + restitution * np.diff(v)
        assert abs(change.sum()) < noise
        assert np.abs(impulses[~touching]).max(initial=0) < noise
        assert impulses.min() > -noise
        assert w[touching].min(initial=0) > -1e-12
        assert np.abs(w * impulses)[touching].max(initial=0) < noise
        assert masses @ y[n:] ** 2 <= masses @ v**2 * (1 + 1e-12)


def test_into_a_corner(code_of):
    floor_and_wall = contacts.corner(lambda x, z, t: z, lambda x, z, t: 2 - x, restitution=1)
    code, p = code_of(floor_and_wall), contacts.defaults(floor_and_wall)
    y, flags = code.reset(0.0, [2, 0, 3, -4], p, [0, 0], 1)
    assert y[2:] == pytest.approx([-1.5, 2], rel=1e-15)
    assert list(flags) == [0, 0]
    y, flags = code.reset(0.0, [2, 0, 3, -4], p, [0, 0], 1, 0.0)
    assert y[2:] == pytest.approx([0, 0], abs=1e-15)
    # Gravity holds it on the floor; the wall does not push.
    assert list(flags) == [1, 0]


def test_along_the_floor_into_a_wall(code_of):
    slope = contacts.corner(lambda x, z, t: z, lambda x, z, t: z - (x - 2), restitution=1)
    code, p = code_of(slope), contacts.defaults(slope)
    # It slides on the floor, which stays closed if it pushes on through the impact; the slope
    # throws it up: u2 = v_z - v_x = -3 becomes 1.5, the impulse is along (-1, 1).
    y, flags = code.reset(0.0, [2, 0, 3, 0], p, [1, 0], 1)
    assert y[2:] == pytest.approx([0.75, 2.25], rel=1e-15)
    assert list(flags) == [0, 0]
    overhang = contacts.corner(lambda x, z, t: z, lambda x, z, t: 2 - x - z, restitution=1)
    # The other way it would be pressed into the floor, which holds it: only v_x changes.
    code = code_of(overhang)
    y, flags = code.reset(0.0, [2, 0, 3, 0], p, [1, 0], 1)
    assert y[2:] == pytest.approx([-1.5, 0], abs=1e-15)
    assert list(flags) == [1, 0]


def test_in_a_wedge(code_of):
    wedge = contacts.corner(lambda x, z, t: z - x, lambda x, z, t: z + x)
    code, p = code_of(wedge), contacts.defaults(wedge)
    for velocity in ([0, -1], [0.3, -1], [5, -5.5], [0, 0]):
        y, flags = code.reset(0.0, [0, 0, *velocity], p, [0, 0], START)
        assert y == pytest.approx([0] * 4, abs=1e-15)
        assert list(flags) == [1, 1]
    # Along one side: it moves on, lying on it.
    y, flags = code.reset(0.0, [0, 0, 1, 1], p, [0, 0], START)
    assert (y == [0, 0, 1, 1]).all()
    assert list(flags) == [1, 0]
    # Down one side into the corner it stops: the other is at a right angle.
    y, flags = code.reset(0.0, [0, 0, 3, -3], p, [0, 1], 0)
    assert y[2:] == pytest.approx([0, 0], abs=1e-15)
    assert list(flags) == [1, 1]


def test_down_a_slope_on_to_the_floor(code_of):
    floor = contacts.corner(lambda x, z, t: z, lambda x, z, t: z + x)
    code, p = code_of(floor), contacts.defaults(floor)
    y, flags = code.reset(0.0, [0, 0, 3, -3], p, [0, 1], 0)
    assert y[2:] == pytest.approx([3, 0], abs=1e-15)
    assert list(flags) == [1, 0]
    # What is said to be closed may open.
    y, flags = code.reset(0.0, [0, 0, 3, -1], p, [0, 1], 0)
    assert y[2:] == pytest.approx([3, 0], abs=1e-15)
    assert list(flags) == [1, 0]


def test_contacts_that_depend_on_each_other(code_of):
    twice = contacts.corner(lambda x, z, t: z, lambda x, z, t: 3 * z, lambda x, z, t: z - x + 7)
    code, p = code_of(twice), contacts.defaults(twice)
    y, flags = code.reset(0.0, [1, 0, 1, -2], p, [0, 0, 0], 1)
    assert y == pytest.approx([1, 0, 1, 0], abs=1e-15)
    assert sum(flags[:2]) == 1
    multipliers = code("contact_multipliers", 0.0, y, p, flags, size=3)
    assert multipliers @ [1, 3, 0] == pytest.approx(2 * 9.81)
    # The same wall twice, one of which gives more back.
    wall = contacts.corner(lambda x, z, t: z, lambda x, z, t: 2 * z, restitution=1)
    y, flags = code_of(wall).reset(0.0, [1, 0, 1, -2], p, [0, 0], 0)
    assert y[3] == pytest.approx(1)
    assert list(flags) == [0, 0]


def test_three_feet_in_a_line(code_of):
    """A beam on three supports: two of them carry it, whichever hold its centre."""
    m, inertia, g, b = contacts.closures.positive(m=2.0, J=0.5, g=9.81, b=0.0)
    z, theta = (contacts.systems.coordinate(name) for name in ("z", "theta"))
    weight = m.symbol * g.symbol * (z.q + b.symbol * theta.q)
    free = contacts.systems.build(
        "beam",
        [m, inertia, g, b],
        [z, theta],
        [("beam", m.symbol, (0, 0, z.q))],
        weight,
        kinetic=inertia.symbol * theta.v**2 / 2,
        diagonal=True,
    )
    feet = [contacts.contact(f"foot{k}", z.q + k * theta.q, [z, theta]) for k in (-1, 0, 1)]
    equations = contacts.with_contacts(free, *feet)
    code = code_of(equations)
    for load, held in ((0.5, 2), (-0.5, 2), (0.0, 1), (0.3, 2)):
        p = [2.0, 0.5, 9.81, load]
        for flags in product((0.0, 1.0), repeat=3):
            if sum(flags) == 3:
                continue
            y, closed = code.reset(0.0, [0, 0, 0, 0], p, flags, START)
            assert (y == 0).all()
            multipliers = code("contact_multipliers", 0.0, y, p, closed, size=3)
            assert multipliers.min() >= 0
            assert multipliers.sum() == pytest.approx(2 * 9.81)
            assert multipliers @ [-1, 0, 1] == pytest.approx(2 * 9.81 * load, abs=1e-13)
            assert sum(closed) in (held, 2)
    # Off the supports it tips over the last one: that alone stays closed.
    y, closed = code.reset(0.0, [0, 0, 0, 0], [2.0, 0.5, 9.81, 1.5], [1, 0, 1], START)
    assert list(closed) == [0, 0, 1]
    # A hard landing on all three.
    y, closed = code.reset(0.0, [0, 0, -3, 0.2], [2.0, 0.5, 9.81, 0.5], [0, 0, 0], 1)
    assert y[2:] == pytest.approx([0, 0], abs=1e-15)


def test_no_impact_can_be_found_between_walls_that_close(code_of):
    squeezed = contacts.corner(lambda x, z, t: x - t, lambda x, z, t: -x - t / 2)
    code, p = code_of(squeezed), [2, 9.81, 0.5]
    assert code.reset(0.0, [0, 1, 0, 0], p, [0, 0], 0) is None
    assert code.leaving_none(0.0, [0, 1, 0, 0], p, [0, 0], 0) == [1, 1]


def test_what_has_no_part_in_a_deadlock_is_not_named(code_of):
    """Between a floor and a ceiling that comes down, at a wall that is struck, too."""
    code = code_of(contacts.corner(lambda x, z, t: x, lambda x, z, t: z, lambda x, z, t: -z - t))
    given = 0.0, [0, 0, -1, 0], [2, 9.81, 0.5], [0, 0, 0]
    assert code.leaving_none(*given, 2) == [0, 1, 1]


def test_a_pendulum_hits_a_wall(code_of):
    equations = contacts.pendulum_at_wall()
    code, p = code_of(equations), contacts.defaults(equations)
    depth = -np.sqrt(3.75)
    y = np.array([0.5, depth, -2 * depth, 1.0])  # along the circle, into the wall
    assert y[:2] @ y[2:] == pytest.approx(0)
    after, flags = code.reset(0.0, y, p, [0], 0)
    assert after[2:] == pytest.approx(-0.7 * y[2:], rel=1e-14)
    assert list(flags) == [0]
    after, flags = code.reset(0.0, y, p, [0], 0, 0.0)
    assert after[2:] == pytest.approx([0, 0], abs=1e-14)
    assert list(flags) == [0]  # gravity takes it back from the wall
    # From the other side it leans on the wall: here at the left of it, above the pivot.
    lean = np.array([0.5, -depth, 0.0, 0.0])
    after, flags = code.reset(0.0, lean, p, [0], START)
    assert list(flags) == [1]
    rod, wall = code("contact_multipliers", 0.0, lean, p, flags, size=2)
    # 2 λ (x, z) + μ (-1, 0) + (0, -m g) = 0
    assert 2 * rod * -depth == pytest.approx(1.3 * 9.81)
    assert wall == pytest.approx(2 * rod * 0.5)


def test_a_sleigh_keeps_its_blade(code_of):
    equations = contacts.sleigh_at_wall()
    code, p = code_of(equations), contacts.defaults(equations)
    theta = 0.4
    y = np.array([2.0, 1.0, theta, np.cos(theta), np.sin(theta), 0.7])
    after, flags = code.reset(0.5, y, p, [0, 0], 0)
    assert after[3] == pytest.approx(-y[3] / 3)
    assert after[4] * np.cos(theta) == pytest.approx(after[3] * np.sin(theta))
    assert list(flags) == [0, 0]


def test_a_moving_floor(code_of):
    lift = contacts.corner(lambda x, z, t: z - sp.sin(3 * t) / 4)
    code, p = code_of(lift), contacts.defaults(lift)
    t = 0.2
    rate, height = 0.75 * np.cos(0.6), np.sin(0.6) / 4
    y, flags = code.reset(t, [0, height, 1, -2], p, [0], 0)
    assert y[3] == pytest.approx(rate, rel=1e-15)
    assert list(flags) == [1]
    # Moving with the floor it is closed; where the floor falls faster than it, not.
    y, flags = code.reset(t, [0, height, 1, rate], p, [0], START)
    assert list(flags) == [1]
    light = [2.0, 2.25 * np.sin(0.6) * 0.9, 0.5]
    _, flags = code.reset(t, [0, height, 1, rate], light, [0], START)
    assert list(flags) == [0]


def test_a_ladder_comes_off_the_wall(code_of):
    equations = contacts.ladder()
    code, p = code_of(equations), contacts.defaults(equations)
    _, inertia, g, a = p
    start = 0.3
    for theta, flags in ((start, [1, 1]), (1.2, [1, 0])):
        # Slid without friction from rest: w² from the energy.
        w = np.sqrt(2 * 1.2 * g * a * (np.cos(start) - np.cos(theta)) / (1.2 * a**2 + inertia))
        s, c = a * np.sin(theta), a * np.cos(theta)
        y = [s, c, theta, c * w, -s * w, w]
        after, closed = code.reset(0.0, y, p, [1, 1], START)
        assert (after == y).all()
        assert list(closed) == flags
    released = np.arccos(2 / 3 * np.cos(start))
    w = np.sqrt(2 * 1.2 * g * a * np.cos(start) / 3 / (1.2 * a**2 + inertia))
    s, c = a * np.sin(released), a * np.cos(released)
    y = [s, c, released, c * w, -s * w, w]
    _, wall = code("events", 0.0, y, p, [1, 1], size=2)
    assert wall == pytest.approx(0, abs=1e-13)
    _, closed = code.reset(0.0, y, p, [1, 1], 1)
    assert list(closed) == [1, 0]


def test_scale_of_units_changes_nothing(code_of):
    equations = contacts.ladder()
    code = code_of(equations)
    p, state = contacts.defaults(equations), np.array([0.48, 0.64, np.arctan2(3, 4), -1, -2, 0.3])
    expected, flags = code.reset(0.0, state, p, [0, 0], START)
    assert list(flags) == [1, 1]
    for exponent in (-300, -40, 40, 300):
        length = 2.0**exponent
        units = np.array([length, length, 1.0] * 2)
        # J in kg m², g in m/s².
        given = p * [1, min(length, 2.0**100) ** 2 if exponent < 100 else length, length, length]
        if abs(exponent) > 100:
            given[0], given[1] = p[0] / length, p[1] * length
        found, closed = code.reset(0.0, state * units, given, [0, 0], START)
        assert found / units == pytest.approx(expected, rel=1e-14, abs=1e-16)
        assert list(closed) == [1, 1]


def linear(a, b):
    return lambda x, z, t: a * x + b * z


@pytest.mark.parametrize("seed", slice_of(range(6), 0, {0, 3, 5}.__contains__))
def test_random_impacts_obey_the_law(seed, tmp_path):
    """w ≥ 0, impulses push, and no energy is gained without restitution; both languages agree."""
    generator = np.random.default_rng(seed)
    count = 3 + seed
    slopes = generator.integers(-4, 5, (count, 2)) / 2
    gaps = [linear(*map(sp.Rational, slope)) for slope in slopes if slope.any()]
    equations = contacts.corner(*gaps, restitution=1)
    machine, python = contacts.Machine(equations, tmp_path), contacts.Interpreted(equations)
    rows = np.array([s for s in slopes if s.any()])
    u = len(rows)
    p = np.array([2.0, 9.81, 0.0])
    for _ in range(40):
        v = generator.normal(size=2)
        y, flags = machine.reset(0.0, [0, 0, *v], p, [0] * u, START)
        other, closed = python.reset(0.0, [0, 0, *v], p, [0] * u, START)
        assert other == pytest.approx(y, abs=1e-13)
        assert list(closed) == list(flags)
        after = rows @ y[2:]
        assert after.min() > -1e-13
        assert y[2:] @ y[2:] <= v @ v * (1 + 1e-15)
        # The smallest change that all gaps allow (Moreau): it is orthogonal to the result.
        assert (y[2:] - v) @ y[2:] == pytest.approx(0, abs=1e-13)
        multipliers = machine("contact_multipliers", 0.0, y, p, flags, size=u)
        assert multipliers.min() > -1e-12
        a = machine("contact_rhs", 0.0, y, p, flags, size=4)[2:]
        staying = np.abs(after) < 1e-12
        assert (rows[staying] @ a).min(initial=0) > -1e-12
