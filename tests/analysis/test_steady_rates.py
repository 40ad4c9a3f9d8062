"""Steady motions with constraints between velocities: closed forms, and the certified equations."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
import sympy as sp
from mpmath import mpf

from lagrange_cli.api import load, loads
from lagrange_cli.errors import InputError
from tests.systems.shipped import SYSTEMS

DISK = SYSTEMS / "bodies" / "leaning_disk.yaml"


def steady(scene, *parts, at=None):
    return load(SYSTEMS / f"{scene}.yaml").derive().analyze(*parts, at=at, steady=True)


def test_circles_of_a_rolling_disk():
    """(6 s − Ω sin θ) Ω cos θ = −4 (g/R) sin θ with s = ψ̇ + Ω sin θ (Neimark and Fufaev)."""
    found = steady("bodies/leaning_disk")
    point = found.linearization.at
    assert float(point.position[1]) == pytest.approx(0.4, rel=1e-15)
    assert point.stability.verdict == "stable"
    (condition,) = found.steady.conditions
    names = {s.name: s for s in condition.free_symbols}
    theta, turning = names["theta"], names["dot(phi)"]
    spin = names["dot(psi)"] + turning * sp.sin(theta)
    book = (6 * spin - turning * sp.sin(theta)) * turning * sp.cos(theta) * names["R"]
    assert sp.simplify(condition - book - 4 * names["g"] * sp.sin(theta)) == 0
    report = found.report()
    assert report["steady"]["ignored"] == ["phi", "psi"]
    motion = min(report["equilibria"], key=lambda motion: abs(motion["at"]["theta"]))
    assert motion["at"] == {"theta": pytest.approx(0.4)}
    assert motion["rates"]["dot(phi)"] == 2.0
    assert motion["momenta"] == {}


@pytest.mark.slow
@pytest.mark.parametrize(("spin", "verdict"), [(2.5, "unstable"), (2.6, "stable")])
def test_a_disk_rolls_upright_above_a_spin(spin, verdict):
    """ψ̇² > g/(3 R); its lean swings with ω² = (4/5) (3 ψ̇² − g/R)."""
    found = steady("bodies/leaning_disk", at={"dot(phi)": "0", "dot(psi)": spin, "theta": "0"})
    point = found.linearization.at
    assert (point.stability.verdict, float(point.position[1])) == (verdict, 0.0)
    square = 0.8 * (3 * spin**2 - 9.81 / 0.5)
    poles = np.linalg.eigvals(found.linearization.state_space.a)
    assert max(abs(poles)) == pytest.approx(math.sqrt(abs(square)), rel=1e-7)


@pytest.mark.slow
def test_friction_of_the_lean_makes_circles_attract():
    text = DISK.read_text()
    text = text[: text.index("expect:")] + "dissipation: {air: 0.1*dot(theta)^2/2}\n"
    found = loads(text).derive().analyze("equilibria", steady=True)
    (point,) = (p for p in found.equilibria.points if abs(p.position[1] - 0.4) < 1e-12)
    assert point.stability.verdict == "stable"
    assert "negative real parts" in point.stability.reason


def certified_poles(derivation, found):
    """Poles of independent rates by differences of accelerations of the certified equations."""
    system, point = derivation.equations.system, found.linearization.at
    steady_system = found.steady.equations.system
    n = len(system.coordinates)
    symbols = [c.q for c in system.coordinates] + [c.v for c in system.coordinates]
    place = {p.symbol: mpf(p.decimal or p.value) for p in system.parameters}
    place |= {u.symbol: mpf(0) for u in system.inputs}
    place |= dict.fromkeys(symbols, mpf(0))
    coordinates = {c.name: c for c in system.coordinates}
    chosen = [coordinates[c.name] for c in steady_system.coordinates]
    place |= {c.q: x for c, x in zip(chosen, point.position, strict=True)}
    place |= {s: mpf(x) for s, x in found.steady.given_values}
    independent = [system.coordinates.index(c) for c in chosen]
    dependent = [j for j in range(n) if j not in independent]
    mass = sp.lambdify(list(place), [list(row) for row in system.mass_matrix], "mpmath")
    forcing = sp.lambdify(list(place), list(system.forcing), "mpmath")
    rows = sp.lambdify(list(place), [list(c.gradient) for c in system.closures], "mpmath")
    biases = sp.lambdify(list(place), [c.bias for c in system.closures], "mpmath")

    def accelerations(state):
        at = {**place, **state}
        g = mpmath.matrix(rows(*at.values()))
        rates = mpmath.matrix([at[system.coordinates[j].v] for j in independent])
        inner, outer = (
            mpmath.matrix([[g[i, j] for j in side] for i in range(g.rows)])
            for side in (dependent, independent)
        )
        follow = mpmath.lu_solve(inner, -outer * rates)
        at |= {system.coordinates[j].v: x for j, x in zip(dependent, follow, strict=True)}
        m = len(dependent)
        saddle = mpmath.zeros(n + m, n + m)
        saddle[:n, :n] = mpmath.matrix(mass(*at.values()))
        saddle[:n, n:], saddle[n:, :n] = -g.T, g
        right = [*forcing(*at.values()), *(-b for b in biases(*at.values()))]
        return [mpmath.lu_solve(saddle, mpmath.matrix(right))[j] for j in independent]

    with mpmath.workdps(40):
        step, k = mpf(10) ** -12, len(independent)
        moved = [c.q for c in chosen] + [c.v for c in chosen]
        a = np.zeros((2 * k, 2 * k))
        a[:k, k:] = np.eye(k)
        assert max(map(abs, accelerations({}))) < 1e-9  # the rates are given in doubles
        for column, s in enumerate(moved):
            ahead, behind = (accelerations({s: place[s] + h}) for h in (step, -step))
            a[k:, column] = [
                float((x - y) / (2 * step)) for x, y in zip(ahead, behind, strict=True)
            ]
    return np.linalg.eigvals(a)


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene", ["bodies/leaning_disk", "bodies/eulers_disk", "bodies/segway", "bodies/rattleback"]
)
def test_poles_are_those_of_the_certified_equations(scene):
    derivation = load(SYSTEMS / f"{scene}.yaml").derive()
    found = derivation.analyze("linearization", steady=True)
    poles = np.linalg.eigvals(found.linearization.state_space.a)
    certified = certified_poles(derivation, found)
    size = abs(certified).max()
    assert np.allclose(
        np.sort_complex(np.round(poles**2 / size**2, 7)),
        np.sort_complex(np.round(certified**2 / size**2, 7)),
        atol=2e-6,
    )


@pytest.mark.slow
def test_a_ball_circles_on_a_turntable():
    """It rests against the turn at the radius where R β̇ = Ω y, stably."""
    (point,) = steady("rolling/ball_on_turntable", "equilibria").equilibria.points
    assert str(point.exact[0]) == "R*dot(beta)/Omega"
    assert point.stability.verdict == "stable"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "at", "fragment"),
    [
        ("rolling/rolling_disk", {}, "every motion is steady"),
        ("bodies/leaning_disk", {"dot(theta)": "1"}, "only rates of phi, psi are given"),
        ("bodies/marble_in_bowl", {}, "other velocities than those of coordinates"),
        ("rolling/bicycle", {}, "between velocities"),
    ],
)
def test_refusals(scene, at, fragment):
    with pytest.raises(InputError, match=fragment):
        steady(scene, at=at)


@pytest.mark.slow
def test_a_verdict_for_all_headings_of_a_sleigh_is_not_drawn_from_one():
    """The poles change with the heading at a given rate of x."""
    (point,) = steady("rolling/chaplygin_sleigh", "equilibria").equilibria.points
    assert point.free == ("x", "theta")
    assert point.stability.verdict == "undecided"


@pytest.mark.slow
def test_a_segway_falls_wherever_it_stands_and_hangs_stably():
    """√(m g c/I) with the wheels free to roll; hanging is a minimum of the energy at rest."""
    found = load(SYSTEMS / "bodies" / "segway.yaml").derive().analyze("equilibria")
    verdicts = {round(float(p.position[3]), 6): p.stability for p in found.equilibria.points}
    assert verdicts[0.0].verdict == "unstable"
    # One wheel each side: M_eff of rolling, and the body's moment less what the axle takes.
    moment = 40 * 0.6**2 + 3 - (40 * 0.6) ** 2 / (40 + 3 * 3)
    assert f"{math.sqrt(40 * 9.81 * 0.6 / moment):.3g}" in verdicts[0.0].reason
    assert verdicts[3.141593].verdict == "stable but for drift"


def test_friction_that_changes_along_a_free_coordinate_decides_nothing():
    text = """\
particles: {ball: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
forces: {drag: {on: x, force: -cos(x)*dot(x)}}
initial: {x: 0, dot(x): 0}
"""
    found = loads(text).derive().analyze("equilibria")
    (point,) = found.equilibria.points
    assert (point.free, point.stability.verdict) == (("x",), "undecided")
