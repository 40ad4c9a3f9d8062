"""Shipped scenes with one-sided constraints against another route and closed forms."""

from __future__ import annotations

import math
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp

from lagrange_cli.analysis.contacts.loss import contact_losses
from tests.systems import lagranges_method
from tests.systems.contact_reference import ContactReference
from tests.systems.lagranges_method import Constrained
from tests.systems.shipped import CONTACTS, derived, parameter_values, simulated, start
from tests.systems.textbook_contacts import GAPS, IN_FLIGHT, RESTITUTIONS

pytestmark = pytest.mark.slow

every_contact_scene = pytest.mark.parametrize("name", CONTACTS)


def given(name: str) -> SimpleNamespace:
    return SimpleNamespace(**{p.name: p.value for p in derived(name).system.parameters})


@cache
def typed(name: str) -> Constrained:
    e = derived(name)
    names = [c.name for c in e.system.coordinates], [p.name for p in e.system.parameters]
    free = lagranges_method.from_typed(IN_FLIGHT[name], None, *names)
    return lagranges_method.constrained(free, GAPS[name], None, *names)


@cache
def reference(name: str) -> tuple[np.ndarray, ContactReference]:
    e, trajectory = derived(name), simulated(name)
    restitutions = RESTITUTIONS.get(name, lambda p: [0.0] * len(e.system.contacts))(given(name))
    route = ContactReference(typed(name), parameter_values(e), restitutions)
    scale = np.array(list(trajectory.scales.values()))
    return route.run(start(e), trajectory.t[::10], scale), route


def test_every_contact_scene_is_typed() -> None:
    assert set(CONTACTS) == set(GAPS) == set(IN_FLIGHT)
    assert len(CONTACTS) >= 8


@every_contact_scene
def test_gaps_are_those_of_the_book(name: str) -> None:
    """Gradients, rates and second derivatives at random states."""
    e, dynamics, random = derived(name), typed(name), np.random.default_rng(3)
    p = parameter_values(e)
    arguments = [
        e.system.t,
        [c.q for c in e.system.coordinates],
        [c.v for c in e.system.coordinates],
        [x.symbol for x in e.system.parameters],
    ]
    closures = [contact.closure for contact in e.system.contacts]
    own = [
        sp.lambdify(arguments, sp.Matrix(parts))
        for parts in (
            [c.expression for c in closures],
            [list(c.gradient) for c in closures],
            [c.rate for c in closures],
            [c.bias for c in closures],
        )
    ]
    theirs = [dynamics.closures, dynamics.jacobian, dynamics.rate, dynamics.bias]
    for _ in range(10):
        state = (random.uniform(0.1, 1), *random.uniform(-1, 1, (2, len(e.system.coordinates))), p)
        for found, expected in zip(own, theirs, strict=True):
            a, b = (np.asarray(f(*state), dtype=float) for f in (found, expected))
            assert a.reshape(b.shape) == pytest.approx(b, rel=1e-13, abs=1e-13)


@every_contact_scene
def test_motion_keeps_its_promise(name: str) -> None:
    """Every coordinate, velocity and event against SciPy's events and Gauss' principle."""
    e, trajectory = derived(name), simulated(name)
    assert trajectory.status == "ok", trajectory.reason
    exact, route = reference(name)
    assert trajectory.requested is not None
    names = [c.name for c in e.system.coordinates]
    for column, expected in zip([*names, *(f"dot({c})" for c in names)], exact.T, strict=True):
        found = trajectory.columns[column][::10]
        # The other route locates events to 1e-12 or so.
        allowed = trajectory.requested * trajectory.scales[column] + 1e-10
        assert np.abs(found - expected).max() <= allowed, column
    happened = [(x.contact, "contact" if x.closes else "release") for x in route.happened]
    ours = [tuple(event.name.split(":")) for event in trajectory.events]
    contacts = [contact.name for contact in e.system.contacts]
    assert ours == [(kind, contacts[k]) for k, kind in happened]
    assert [event.t for event in trajectory.events] == pytest.approx(
        [x.t for x in route.happened], abs=1e-9
    )


@every_contact_scene
def test_no_gap_is_violated(name: str) -> None:
    e, trajectory = derived(name), simulated(name)
    p, names = parameter_values(e), [c.name for c in e.system.coordinates]
    for k, t in enumerate(trajectory.t.tolist()):
        q = [float(trajectory.columns[c][k]) for c in names]
        assert typed(name).closures(t, q, q, p).min() >= -1e-12


@pytest.mark.parametrize("name", ["particle_leaving_sphere", "ladder_leaving_wall", "slack_rope"])
def test_a_contact_is_left_where_its_force_vanishes_in_symbols(name: str) -> None:
    event = simulated(name).events[0]
    (loss,) = (
        x for x in contact_losses(derived(name)).contacts if f"release:{x.name}" == event.name
    )
    assert loss.at_start is not None
    assert loss.at_start > 0

    def at_event(left: sp.Expr) -> float:
        return float(left.xreplace({s: sp.Float(event.state[s.name]) for s in left.free_symbols}))

    assert any(at_event(zero.left) == pytest.approx(zero.number, abs=1e-8) for zero in loss.zeros)


def test_the_sphere_is_left_at_two_thirds() -> None:
    p, (event,) = given("particle_leaving_sphere"), simulated("particle_leaving_sphere").events
    assert event.name == "release:sphere"
    cosine = event.state["z"] / p.R
    assert abs(cosine - 2 / 3 * math.cos(p.theta0)) <= 1e-9
    assert abs(math.cos(event.state["theta"]) - 2 / 3 * math.cos(p.theta0)) <= 1e-9


def test_the_wall_is_left_at_two_thirds() -> None:
    p, (event,) = given("ladder_leaving_wall"), simulated("ladder_leaving_wall").events
    assert event.name == "release:wall"
    assert abs(math.cos(event.state["theta"]) - 2 / 3 * math.cos(p.theta0)) <= 1e-9


def test_the_rope_goes_slack_where_the_book_says() -> None:
    p, trajectory = given("slack_rope"), simulated("slack_rope")
    first = trajectory.events[0]
    assert first.name == "release:rope"
    height = (p.v0**2 - 2 * p.g * p.l) / (3 * p.g)
    assert abs(first.state["z"] - height) <= 1e-9
    caught = trajectory.events[1]
    assert caught.name == "contact:rope"
    # The parabola meets the circle again at -3 times the angle (of textbook exercises).
    angle = math.atan2(first.state["z"], first.state["x"])
    assert math.atan2(caught.state["z"], caught.state["x"]) == pytest.approx(
        -3 * angle
        + 2
        * math.pi
        * round((3 * angle + math.atan2(caught.state["z"], caught.state["x"])) / (2 * math.pi)),
        abs=1e-8,
    )
    along = caught.state["x"] * caught.state["dot(x)"] + caught.state["z"] * caught.state["dot(z)"]
    assert abs(along) <= 1e-12


def test_the_block_leaves_where_the_wedge_falls_as_fast() -> None:
    p, (event,) = given("block_leaving_wedge"), simulated("block_leaving_wedge").events
    assert abs(event.t - p.g / math.tan(p.alpha) / p.j) <= 1e-9


def test_the_rod_takes_the_impulse_of_the_book() -> None:
    p, trajectory = given("dropped_rod"), simulated("dropped_rod")
    first = trajectory.events[0]
    assert first.before is not None
    speed = -first.before["dot(z)"]
    impulse = p.m * (first.state["dot(z)"] + speed)
    assert impulse == pytest.approx((1 + p.e) * p.m * speed / (1 + 3 * math.cos(0.1) ** 2))


def test_the_blocks_count_the_digits_of_pi() -> None:
    assert len(simulated("galperin_billiard").events) == 31
