"""The campaign of narrow forces: its judge sees misses, its motions are exact, a slice is right."""

from __future__ import annotations

import importlib
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sympy import Symbol, lambdify, sympify

from tests.campaign import pairs_of

pytestmark = pytest.mark.slow

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def narrow(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("soundness_narrow")


def numbers(**changed: float) -> dict[str, float]:
    return {"A": 1.0, "w": 0.05, "c": 0.5, "k": 0.0, "h": 0.0} | changed


@pytest.mark.parametrize("along", ["time", "position"])
@pytest.mark.parametrize("kind", ["box", "triangle", "trapezoid", "ramp"])
@pytest.mark.parametrize(
    "changed", [{"A": 3.0}, {"A": -20.0}, {"A": 5.0, "k": 20.0}, {"A": -4.0, "h": 0.7}]
)
def test_exact_motions_are_those_of_fine_steps(narrow, along, kind, changed) -> None:
    """Reflected, on a spring, in gravity: SciPy at steps of a thousandth of the width."""
    strike = narrow.Strike(kind, along, numbers(**changed), 1e-6)
    times = np.linspace(0, 1, 6)
    with narrow.mp.workdps(40):
        exact = (narrow.of_position if along == "position" else narrow.of_time)(strike, times)
    pieces = [[float(x) for x in piece] for piece in narrow.pieces_of(strike)]

    def slopes(t: float, y: np.ndarray) -> list[float]:
        place = y[0] if along == "position" else t
        acts = sum(a + b * place for low, high, a, b in pieces if low <= place < high)
        return [y[1], acts - strike.numbers["k"] * y[0] - strike.numbers["h"]]

    fine = solve_ivp(slopes, (0, 1), [0, 1], "RK45", times, rtol=1e-8, atol=1e-10, max_step=1e-3)
    found = np.array([[float(x) for x in state] for state in exact]).T
    assert np.abs(found - fine.y).max() < 2e-3 * (1 + abs(strike.numbers["A"]))


@pytest.mark.parametrize(
    ("along", "kind", "strength"),
    pairs_of(
        ("time", "position"),
        ("Gauss", "Lorentz", "sech²", "tanh difference", "power"),
        (3.0, -4.0, -20.0),
    ),
)
def test_exact_motions_past_pulses_are_those_of_fine_steps(narrow, along, kind, strength) -> None:
    """Pushed on, slowed down, thrown back: SciPy with doubles of the pulse."""
    strike = narrow.Strike(kind, along, numbers(A=strength), 1e-6)
    times = np.array([0, 0.5, 1.0])
    past = narrow.past_a_place if along == "position" else narrow.past_a_moment
    with narrow.mp.workdps(40):
        exact = past(kind, strike.numbers, times)
    text = sympify(narrow.PULSES[kind], locals={"S": Symbol("S")})
    pulse = lambdify(["A", "S"], text, "math")

    def slopes(t: float, y: np.ndarray) -> list[float]:
        place = y[0] if along == "position" else t
        return [y[1], pulse(strength, (place - 0.5) / 0.05)]

    fine = solve_ivp(slopes, (0, 1), [0, 1], "DOP853", times, rtol=1e-12, atol=1e-13, max_step=1e-2)
    found = np.array([[float(x) for x in state] for state in exact]).T
    assert np.abs(found - fine.y).max() < 1e-9


def test_the_judge_sees_a_miss(narrow) -> None:
    """A run that flies on past a box that took it aside is missed."""
    strike = narrow.Strike("box", "position", numbers(A=1e3, w=1e-6), 1e-6)
    run = strike.run(narrow.SHAPES["box"][0])
    past = replace(run, columns={**run.columns, "x": run.t, "dot(x)": np.ones_like(run.t)})
    with narrow.mp.workdps(40):
        exact = narrow.of_position(strike, run.t.tolist())
        assert narrow.judged(strike, past, exact).missed
        assert not narrow.judged(strike, run, exact).missed


@pytest.mark.parametrize(("kind", "along"), [("box", "position"), ("triangle", "time")])
def test_forces_with_kinks_in_narrow_places_are_not_missed(narrow, kind, along) -> None:
    rng = np.random.default_rng(17)
    for strike in narrow.strikes([kind], 8, rng):
        found = narrow.kinked(replace(strike, along=along))
        assert not found.missed, found


def test_the_table_counts_by_decades(narrow) -> None:
    strike = narrow.Strike("box", "time", numbers(w=4e-4), 1e-6)
    results = [narrow.Result(strike, "ok", 0.5), narrow.Result(strike, "ok", 2.0)]
    assert "| box | time | 0 of 0 | 1 of 2 |" in narrow.table(results)
