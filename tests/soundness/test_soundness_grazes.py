"""Grazes: contacts that are only just met, or only just missed, are right or end the promise."""

from __future__ import annotations

import importlib
import math
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf

from lagrange_cli import loads
from lagrange_cli.simulate import Trajectory, simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import interpreted

pytestmark = pytest.mark.slow

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"

EXACT = """
name: g
parameters: {m: 1, g: 10, e: 1}
plane: xz
particles: {b: {mass: m, position: [x, y, z]}}
constraints: {f: {unilateral: z <= 1, restitution: e}}
potentials: {w: {gravity: g}}
initial: {x: 0, z: 0, dot(x): 0, dot(z): 4.47213595499958}
simulate: {until: 0.8, accuracy: 1e-9, samples: 101}
"""

UP = 4.47213595499958


@pytest.mark.parametrize("kind", ["ceiling", "wall", "spring", "sphere", "pendulum"])
def test_grazes_are_right_or_end_the_promise(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    """None is wrong, and many that can be told from what they are next to are held."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    grazes = importlib.import_module("soundness_grazes")
    found = grazes.results(kind, 14, seed=7)
    assert not [r for r in found if r.wrong]
    assert sum(r.status == "ok" for r in found) >= 2
    # Behind a graze that ends the promise nothing is kept.
    assert all(r.kept < 1 for r in found if r.status != "ok")


def thrown(speed: float, *, by_python: bool = False, **options: float) -> Trajectory:
    model = model_of(loads(EXACT, initial={"dot(z)": speed}).derive().equations)
    functions = interpreted(model, "") if by_python else None
    return simulate(model, functions=functions, **options)


def height(speed: float, t: float) -> float:
    """That of a ball thrown up to a ceiling at 1, met or not."""
    with mp.workdps(40):
        square = mpf(speed) ** 2 - 20
        met = (speed - mp.sqrt(square)) / 10 if square >= 0 else mpf(1)
        since = mpf(t) - met
        fell = 1 - mp.sqrt(abs(square)) * since - 5 * since**2
        return float(fell if since > 0 else speed * mpf(t) - 5 * mpf(t) ** 2)


def test_the_promise_ends_where_a_ball_just_reaches_the_ceiling() -> None:
    units = (0, 1, -1, 64, -64, 8192, -8192)
    for number, by_python in [*((k, False) for k in units), (0, True), (64, True)]:
        speed = UP + number * float(np.spacing(UP))
        run = thrown(speed, by_python=by_python)
        last = float(run.t[-1])
        # What is kept is right, also where it ends behind the contact.
        assert abs(height(speed, last) - run.columns["z"][-1]) <= 1e-9
        if run.status != "ok":
            assert run.status == "accuracy_not_reached"
            graze = ("'f' is met so slightly", "what happens at 'f' at t = 0.4472")
            said = graze if last < UP / 10 else ("z is off by",)
            assert any(words in run.reason for words in said)
            assert last >= 0.43


def test_where_it_does_not_matter_the_run_goes_on() -> None:
    """An impact at less than 1e-6 of the speeds changes nothing that 1e-3 of them shows."""
    speed = UP + 60 * float(np.spacing(UP))
    run = thrown(speed, accuracy=1e-3)
    assert run.status == "ok"
    assert run.state["z"] == pytest.approx(UP * 0.8 - 5 * 0.64, abs=1e-6)
    assert thrown(speed, accuracy=1e-9).status == "accuracy_not_reached"


def test_gaps_that_keep_their_distance_are_no_grazes() -> None:
    for part in (1e-3, 1e-6):
        run = thrown(UP * math.sqrt(1 - part))
        assert run.status == "ok"
        assert not run.events
        run = thrown(UP * math.sqrt(1 + part))
        assert run.status == "ok"
        assert [event.name for event in run.events] == ["contact:f"]
