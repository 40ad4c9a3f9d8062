"""States with two values: relays with hysteresis against motions whose events are exact.

The exact motion is made of pieces, each the exponential of a matrix; a piece ends where the present
condition is met, found by halving intervals of its closed form.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from lagrange_cli.simulate import Trajectory, simulate
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.functions import interpreted

_RELAY = """
name: relay
parameters: {k: 4, c: 0.2, F: 3, up: 0.5, down: -0.3}
coordinates: [x]
kinetic: {block: dot(x)^2/2}
potentials: {spring: k*x^2/2}
states: {r: {on: x <= down, off: up <= x}}
forces: {push: {on: x, force: F*r - c*dot(x)}}
initial: {x: 0, dot(x): 1, r: 0}
simulate: {until: 8, accuracy: 1e-9, samples: 41}
"""


def model(text: str = _RELAY, initial: Mapping[str, str] | None = None) -> Model:
    return model_of(derive(read_text(text, initial=initial)))


def exact(
    numbers: Mapping[str, float], start: Array, r: float, times: Array
) -> tuple[Array, Array, list[float]]:
    """Return z = (x, ẋ) and r at times, and the times of changes."""
    flow = np.zeros((3, 3))
    flow[0, 1], flow[1, :2] = 1, (-numbers["k"], -numbers["c"])
    t, z, changes, states, relays = 0.0, np.array([*start, 1.0]), [], [], []
    fine = 2e-3
    for goal in times:
        while True:
            flow[1, 2] = numbers["F"] * r + numbers.get("u", 0)
            sign, at = (1, numbers["up"]) if r else (-1, numbers["down"])

            def beyond(s: float, z: Array = z, sign: int = sign, at: float = at) -> float:
                return float(sign * ((expm(flow * s) @ z)[0] - at))

            low, met = 0.0, None
            step = expm(flow * fine)
            ahead = z.copy()
            while t + low < goal:
                ahead, high = step @ ahead, low + fine
                if sign * (ahead[0] - at) >= 0:
                    met = _halved(beyond, low, high)
                    break
                low = high
            if met is None or t + met > goal:
                break
            t, z, r = t + met, expm(flow * met) @ z, 1 - r
            changes.append(t)
        states.append(expm(flow * (goal - t)) @ z)
        relays.append(r)
    return np.array(states)[:, :2], np.array(relays), changes


def _halved(beyond, low: float, high: float) -> float:  # type: ignore[no-untyped-def]
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if beyond(middle) >= 0 else (middle, high)
    return high


def errors(run: Trajectory, states: Array) -> float:
    scales = [run.scales["x"], run.scales["dot(x)"]]
    own = np.stack([run.columns["x"], run.columns["dot(x)"]], axis=1)
    return float((np.abs(own - states) / scales).max())


@pytest.mark.parametrize("case", range(4))
def test_relays_with_hysteresis_change_where_their_conditions_are_met(case: int) -> None:
    draw = np.random.default_rng(case)
    numbers = {
        "k": draw.uniform(0.5, 6),
        "c": draw.uniform(-0.3, -0.1),
        "F": draw.uniform(1, 5),
        "up": draw.uniform(0, 0.8),
        "down": draw.uniform(-0.8, 0),
    }
    start = draw.uniform(-0.2, 0.2), draw.uniform(-3, -2)
    made = model(initial={"x": repr(start[0]), "dot(x)": repr(start[1])})
    made = replace(
        made,
        parameters=tuple(replace(p, value=numbers[p.name], decimal="") for p in made.parameters),
    )
    run = simulate(made)
    states, relays, changes = exact(numbers, np.array(start), 0.0, run.t)
    assert run.status == "ok"
    assert changes
    assert errors(run, states) <= 1e-9
    assert (run.columns["r"] == relays).all()


def test_a_change_at_a_sample_is_outside_of_the_promise_and_no_other() -> None:
    # The relay reverses a constant force, so that changes fall on even numbers.
    text = """
    parameters: {F: 2}
    coordinates: [x]
    kinetic: {block: dot(x)^2/2}
    states: {r: {on: dot(x) <= -1, off: dot(x) >= 1}}
    forces: {push: {on: x, force: 2*F*r - F}}
    initial: {x: 0, dot(x): -1, r: 0}
    simulate: {until: 5.5, accuracy: 1e-9, samples: 56}
    """
    run = simulate(model(text))
    assert run.status == "ok"
    assert set(np.round(run.exempt, 12)) <= {0.0, 1.0, 2.0, 3.0, 4.0, 5.0}
    between = ~np.isin(run.t, run.exempt)
    assert run.columns["r"][between].tolist() == [
        float(math.floor(t) % 2 == 0) for t in run.t[between]
    ]
    saw = 2 * np.abs((run.t + 1) % 2 - 1) - 1
    assert run.columns["dot(x)"] == pytest.approx(saw, abs=2e-9)


def test_interpreted_functions_give_what_machine_code_does() -> None:
    made = model()
    run = simulate(made, until=5)
    other = simulate(made, until=5, functions=interpreted(made, "of a test"))
    assert other.status == "ok"
    assert other.columns["x"] == pytest.approx(run.columns["x"], abs=1e-8)
    assert (other.columns["r"] == run.columns["r"]).all()


@pytest.mark.parametrize("method", ["Radau", "BDF", "LSODA", "RK45", "Gauss16"])
def test_methods_with_an_interpolant_find_the_changes(method: str) -> None:
    made = model()
    run = simulate(made, until=5, method=method, rtol=1e-8, atol=1e-10)
    numbers = {p.name: float(p.value or 0) for p in made.parameters}
    states, relays, _ = exact(numbers, np.array([0.0, 1.0]), 0.0, run.t)
    assert errors(run, states) < 1e-4
    assert (run.columns["r"] == relays).all()
    assert run.steps < 1000


@pytest.mark.parametrize("method", ["RK4", "Gauss4"])
def test_methods_without_an_interpolant_are_refused(method: str) -> None:
    with pytest.raises(InputError, match="has no interpolant on which to find where 'r' changes"):
        simulate(model(), method=method, step=1e-3)


def test_a_condition_that_holds_at_the_start_counts() -> None:
    text = _RELAY.replace("x: 0, dot(x): 1, r: 0", "x: -0.3, dot(x): 1, r: 0")
    run = simulate(model(text), until=0.1)
    assert run.columns["r"][1:].tolist() == [1.0] * (len(run.t) - 1)


def test_conditions_that_hold_together_end_the_motion() -> None:
    run = simulate(model(_RELAY.replace("off: up <= x", "off: dot(x) <= 10")))
    assert run.status != "ok"
    assert "both conditions of a state with two values hold" in str(run.reason)


def test_one_threshold_for_both_conditions_is_no_relay() -> None:
    text = _RELAY.replace("on: x <= down, off: up <= x", "on: dot(x) <= 0.5, off: dot(x) >= 0.5")
    run = simulate(model(text.replace("F: 3", "F: 30")))
    assert run.status != "ok"
    assert "changes back and forth without end" in str(run.reason)


def test_members_of_an_ensemble_switch_each_at_its_times() -> None:
    forces = (2.0, 3.0, 4.0)
    members = loads(_RELAY).derive().ensemble({"F": forces}, until=5)
    for place, force in zip(members.columns["x"], forces, strict=True):
        alone = loads(_RELAY, parameters={"F": force}).derive().simulate(until=5)
        assert place == pytest.approx(alone.columns["x"], abs=1e-8)


def test_relays_change_between_impacts_and_at_them() -> None:
    # Thrown back by the wall with half its speed, the block is pulled from x = 1 to x = 1/4; it
    # comes there with the speed at which it is thrown back with 1, on and on, every 21/8.
    text = """
    particles: {block: {mass: 1, position: [x, 0, 0]}}
    coordinates: [x]
    states:
      pulled: {on: x >= 1, off: x <= 1/4}
      away: {on: dot(x) >= 1/2, off: dot(x) <= -1/2}
    forces: {pull: {on: x, force: -2*pulled}}
    constraints: {wall: {unilateral: x >= 0, restitution: 1/2}}
    initial: {x: 1/2, dot(x): 1, pulled: 0, away: 1}
    simulate: {until: 8, accuracy: 1e-9, samples: 401}
    """
    run = simulate(model(text))
    assert run.status == "ok"
    since = (run.t + 0.5) % 2.625
    pull, fall = since - 1, since - 2.5
    place = np.where(pull < 0, since, np.where(fall < 0, 1 + pull - pull**2, 0.25 - 2 * fall))
    assert run.columns["x"] == pytest.approx(place, abs=1e-8)
    between = ~np.isin(run.t, run.exempt)
    assert between.sum() > 380
    assert (run.columns["pulled"] == ((pull >= 0) & (fall < 0)))[between].all()
    assert (run.columns["away"] == (pull < 0.75))[between].all()


def test_a_relay_changes_between_the_samples_of_a_controller() -> None:
    every = 0.3
    text = _RELAY.replace("F*r", "F*r + u") + (
        "inputs: [u]\ncontrollers: {every: 0.3, hold: {u: dot(x)/2 + r}}"
    )
    run = simulate(model(text))
    numbers = {"k": 4.0, "c": 0.2, "F": 3.0, "up": 0.5, "down": -0.3}
    state, r, times, states, relays, changed = np.array([0.0, 1.0]), 0.0, run.t, [], [], 0
    for sample in range(math.ceil(8 / every)):
        start, end = sample * every, (sample + 1) * every
        numbers["u"] = r + state[1] / 2
        inside = times[(start <= times) & (times < end)]
        rows, values, changes = exact(numbers, state, r, np.array([*(inside - start), every]))
        states += rows[:-1].tolist()
        relays += values[:-1].tolist()
        state, r, changed = rows[-1], values[-1], changed + len(changes)
    assert run.status == "ok"
    assert changed >= 2
    assert errors(run, np.array(states)) <= 1e-9
    assert run.columns["r"].tolist() == relays


def test_dry_friction_holds_a_body_until_a_relay_pushes_harder() -> None:
    text = """
    coordinates: [x]
    kinetic: {block: dot(x)^2/2}
    states: {r: {on: (t - 1)*(1.5 - t) >= 0, off: t >= 2}}
    forces: {push: {on: x, force: 3*r - sign(dot(x))}}
    initial: {x: 0, dot(x): 0, r: 0}
    simulate: {until: 4, accuracy: 1e-9, samples: 401}
    """
    run = simulate(model(text))
    assert run.status == "ok"
    assert not run.columns["x"][run.t <= 1].any()
    pushed = (run.t > 1) & (run.t < 2)
    assert run.columns["x"][pushed] == pytest.approx((run.t[pushed] - 1) ** 2, abs=1e-9)
    # From x = 1 on it slows down with 1, from the speed 2: it rests at x = 3, at t = 4.
    assert float(run.columns["x"][-1]) == pytest.approx(3, abs=1e-8)
