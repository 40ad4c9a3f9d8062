"""Shipped scenes whose bodies have joints that close loops, or roll: published and closed forms."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

from lagrange_cli import Derivation, load
from lagrange_cli.cache import open_cache
from tests.campaign import slice_of
from tests.systems.shipped import JOINTS

#: Table 2 of Meijaard and others: eigenvalues of the upright bicycle, by its speed in m/s.
PUBLISHED: dict[int, tuple[complex, ...]] = {
    0: (-5.53094371765393, -3.13164324790656, 3.13164324790656, 5.53094371765393),
    5: (
        -14.07838969279822,
        -0.77534188219585 - 4.46486771378823j,
        -0.77534188219585 + 4.46486771378823j,
        -0.32286642900409,
    ),
}
#: Digits of a difference, and its step: the square of the step is below the published digits.
DIGITS, STEP = 40, mp.mpf(10) ** -12


def derivation(name: str) -> Derivation:
    return load(JOINTS[name]).derive(cache=open_cache())


class UprightBicycle:
    """Lean and steer of the bicycle near a straight ride, with what follows from them."""

    def __init__(self) -> None:
        system = derivation("benchmark_bicycle").equations.system
        self.names = [c.name for c in system.coordinates]
        self.closures = len(system.closures)
        values = {p.symbol: p.exact for p in system.parameters}
        self.numbers = [mp.mpf(sp.N(x, DIGITS)) for x in values.values()]
        self.radius = next(mp.mpf(sp.N(x, DIGITS)) for p, x in values.items() if p.name == "rR")
        own = [*(c.q for c in system.coordinates), *(c.v for c in system.coordinates)]
        parts = [e for row in system.mass_matrix for e in row]
        parts += [*system.forcing, *(e for c in system.closures for e in c.gradient)]
        parts += [c.bias for c in system.closures] + [system.closures[0].expression]
        self.function = sp.lambdify([own, list(values)], parts, "mpmath", cse=True)

    def parts(
        self, q: list[mp.mpf], v: list[mp.mpf]
    ) -> tuple[mp.matrix, list[mp.mpf], mp.matrix, list[mp.mpf], mp.mpf]:
        n, m = len(self.names), self.closures
        values = self.function([*q, *v], self.numbers)
        mass = mp.matrix([values[k * n : (k + 1) * n] for k in range(n)])
        forcing, values = values[n * n : n * n + n], values[n * n + n :]
        slopes = mp.matrix([values[k * n : (k + 1) * n] for k in range(m)])
        return mass, forcing, slopes, values[m * n : m * n + m], values[-1]

    def accelerations(self, state: list[mp.mpf], speed: int) -> list[mp.mpf]:
        """Of lean and steer, from these and their rates."""
        n, m = len(self.names), self.closures
        lean, steer, pitch, wheel = map(self.names.index, ("phi", "delta", "theta", "alpha"))
        q, v = [mp.mpf(0)] * n, [mp.mpf(0)] * n
        q[lean], q[steer], v[lean], v[steer] = state
        v[wheel] = -speed / self.radius
        for _ in range(5):
            *_, slopes, _, missed = self.parts(q, v)
            q[pitch] -= missed / slopes[0, pitch]
        slopes = self.parts(q, v)[2]
        follow = [j for j in range(n) if j not in (lean, steer, wheel)]
        matrix = mp.matrix([[slopes[i, j] for j in follow] for i in range(m)])
        right = [-mp.fsum(slopes[i, j] * v[j] for j in (lean, steer, wheel)) for i in range(m)]
        for j, rate in zip(follow, mp.lu_solve(matrix, mp.matrix(right)), strict=True):
            v[j] = rate
        mass, forcing, slopes, bias, _ = self.parts(q, v)
        whole = mp.zeros(n + m)
        for i in range(n):
            for j in range(n):
                whole[i, j] = mass[i, j]
            for k in range(m):
                whole[i, n + k], whole[n + k, i] = -slopes[k, i], slopes[k, i]
        solution = mp.lu_solve(whole, mp.matrix([*forcing, *(-b for b in bias)]))
        return [solution[lean], solution[steer]]


@pytest.mark.slow
@pytest.mark.parametrize("speed", slice_of([*PUBLISHED], 1))
def test_the_bicycle_has_the_published_eigenvalues_to_all_digits(speed: int) -> None:
    bicycle = UprightBicycle()
    with mp.workdps(DIGITS):
        matrix = mp.zeros(4)
        matrix[0, 2] = matrix[1, 3] = 1
        for k in range(4):
            ahead, behind = (
                bicycle.accelerations([s * STEP * (j == k) for j in range(4)], speed)
                for s in (1, -1)
            )
            for i in range(2):
                matrix[2 + i, k] = (ahead[i] - behind[i]) / (2 * STEP)
        found = [complex(x) for x in mp.eig(matrix)[0]]
    for exact in PUBLISHED[speed]:
        assert min(abs(x - exact) for x in found) < 1e-14 * max(1, abs(exact))


def test_bricards_linkage_moves_with_six_hinges() -> None:
    (warning,) = derivation("bricards_linkage").equations.derivation.warnings
    assert "1 of the 2 equations of constraint 'hinge' is redundant" in warning.message
    assert derivation("bricards_linkage").equations.derivation.account.dof == 1


@pytest.mark.slow
def test_windows_of_four_bars_fall_as_one_through_the_line_of_their_rods() -> None:
    """The pendulum of (4N + 1)/3 m l² θ̇²/2 and (3N + 1)/2 m g l cos θ, which turns over."""
    run = derivation("n_four_bars").simulate()
    speeding = 4 * 1.5 * 7 / 9 * 9.81  # 4 g/l · 3 (3N + 1)/(2 (4N + 1)), N = 2
    top = math.sqrt(1 + speeding)
    modulus = speeding / top**2
    sn, cn, dn, _ = ellipj(ellipk(modulus) - top * run.t / 2, modulus)
    for j in range(3):
        theta, rate = run.columns[f"theta[{j}]"], run.columns[f"dot(theta[{j}])"]
        assert np.cos(theta) == pytest.approx(sn**2 - cn**2, abs=1e-12)
        assert np.sin(theta) == pytest.approx(2 * sn * cn, abs=1e-12)
        assert rate == pytest.approx(top * dn, abs=1e-12)
    assert run.events == ()
    assert run.columns["phi[2]"] == pytest.approx(0, abs=1e-12)


@pytest.mark.slow
def test_a_slider_crank_moves_as_its_energy_says() -> None:
    """T = ½ J(φ) φ̇² of the mechanism by hand: J φ̈ + ½ J′ φ̇² + V′ = 0, J′ by differences."""
    made = derivation("crank_and_slider")
    p = {x.name: x.value for x in made.equations.system.parameters}
    m, big, b, r, length, g = (p[name] for name in ("m", "M", "b", "r", "l", "g"))

    def inertia(phi: float) -> float:
        psi = -math.asin(r / length * math.sin(phi))
        rate = -r * math.cos(phi) / (length * math.cos(psi))
        x = -r * math.sin(phi) - length / 2 * math.sin(psi) * rate
        z = r * math.cos(phi) + length / 2 * math.cos(psi) * rate
        slide = -r * math.sin(phi) - length * math.sin(psi) * rate
        turning = big * length**2 / 12 * rate**2
        return m * r**2 / 3 + big * (x * x + z * z) + turning + b * slide**2

    def acceleration(phi: float, rate: float) -> float:
        h = 1e-4
        points = (inertia(phi + k * h) for k in (-2, -1, 1, 2))
        a, c, d, e = points
        slope = (a - 8 * c + 8 * d - e) / (12 * h)
        # The centres are r/2 sin φ and r/2 sin φ high, as the rod ends on the line.
        weight = (m + big) * g * r / 2 * math.cos(phi)
        return -(slope * rate**2 / 2 + weight) / inertia(phi)

    reference = solve_ivp(
        lambda t, y: (y[1], acceleration(*y)), (0, 2), (1, 10), "DOP853", rtol=1e-12, atol=1e-12
    )
    run = made.simulate()
    assert run.status == "ok"
    assert run.state["phi"] == pytest.approx(reference.y[0, -1], abs=1e-7)


def test_rods_on_wires_turn_slowly() -> None:
    analysis = derivation("rod_on_two_wires").analyze()
    found = sorted(mode.frequency for mode in analysis.modes)
    assert found == pytest.approx(sorted([math.sqrt(9.81 / 0.8)] * 2 + [math.sqrt(3 * 9.81 / 0.8)]))


def test_a_stewart_platform_on_edges_of_a_cube_has_the_published_stiffness() -> None:
    """At rest K = diag(2k, 2k, 2k, ½ k l², ½ k l², 2 k l²), by differences of the forces."""
    system = derivation("stewart_platform").equations.system
    values = {p.name: float(p.exact) for p in system.parameters}
    arguments = [[c.q for c in system.coordinates], [p.symbol for p in system.parameters]]
    at_rest = {c.v: 0 for c in system.coordinates}
    forcing = sp.lambdify(arguments, [f.xreplace(at_rest) for f in system.forcing], cse=True)
    step = 1e-5
    columns = [
        (np.array(forcing(-x, values.values())) - forcing(x, values.values())) / (2 * step)
        for x in step * np.eye(6)
    ]
    k, square = values["k"], values["l"] ** 2
    expected = np.diag([2 * k] * 3 + [k * square / 2] * 2 + [2 * k * square])
    assert np.array(columns) == pytest.approx(expected, abs=1e-5)


def reactions(name: str) -> dict[str, tuple[sp.Expr, tuple[str, ...]]]:
    """Multipliers with what they are of a joint, in the letters of the scene."""
    equations = load(JOINTS[name]).derive(forces=True, cache=open_cache()).equations
    forces = equations.derivation.constraint_forces
    assert forces is not None
    letters = {s: sp.Symbol(c.name) for c in equations.system.coordinates for s in (c.q,)}
    letters |= {c.v: sp.Symbol(f"d{c.name}") for c in equations.system.coordinates}
    letters |= {c.a: sp.Symbol(f"a{c.name}") for c in equations.system.coordinates}
    letters |= {p.symbol: sp.Symbol(p.name) for p in equations.system.parameters}
    return {r.name: (r.multiplier.xreplace(letters), r.role) for r in forces.reactions}


def test_the_string_of_a_yo_yo_pulls_less_than_its_weight() -> None:
    m, g, r, moment = sp.symbols("m g r I")
    found = reactions("yo_yo")
    assert sp.simplify(found["string_2"][0] - m * g * moment / (moment + m * r**2)) == 0
    assert found["string_1"] == (0, ("normal", "yo_yo", "plane"))
    assert found["string_2"][1] == ("friction", "yo_yo", "plane")


def test_a_ladder_leaves_the_wall_at_two_thirds_of_its_height() -> None:
    """From the angle a the wall pushes with ¾ m g sin θ (3 cos θ − 2 cos a)."""
    m, g, length, theta, rate, start = sp.symbols("m g l theta dtheta a")
    (wall, _), (floor, _) = (reactions("sliding_ladder")[name] for name in ("wall", "floor"))
    energy = {rate: sp.sqrt(3 * g / length * (sp.cos(start) - sp.cos(theta)))}
    pushed = sp.Rational(3, 4) * m * g * sp.sin(theta) * (3 * sp.cos(theta) - 2 * sp.cos(start))
    assert sp.simplify(wall.subs(energy) - pushed) == 0
    carried = m * g - m * length / 2 * (
        rate**2 * sp.cos(theta) + sp.Rational(3, 2) * g / length * sp.sin(theta) ** 2
    )
    assert sp.simplify(floor - carried) == 0


def test_the_pin_of_a_slider_crank_pushes_the_block() -> None:
    """The block alone: its mass times its acceleration is what the pin does against the rod."""
    found = reactions("crank_and_slider")
    assert found["loop_1"][1] == ("force", "end", "block", "x")
    m, r, length = sp.symbols("b r l")
    t = sp.Symbol("t")
    phi, psi = (sp.Function(name)(t) for name in ("phi", "psi"))
    moved = -m * sp.diff(r * sp.cos(phi) + length * sp.cos(psi), t, 2)
    letters = [(sp.diff(phi, t, 2), "aphi"), (sp.diff(psi, t, 2), "apsi")]
    letters += [(sp.diff(phi, t), "dphi"), (sp.diff(psi, t), "dpsi"), (phi, "phi"), (psi, "psi")]
    for part, letter in letters:
        moved = moved.subs(part, sp.Symbol(letter))
    assert sp.simplify(found["loop_1"][0] - moved) == 0


@pytest.mark.slow
def test_a_golf_ball_comes_up_again_and_its_wall_carries_it() -> None:
    """Gualtieri and others 2006: up and down with √(2/7) Ω, held by friction alone."""
    run = derivation("ball_in_hole").simulate()
    assert run.status == "ok"
    rate, g = 30.0, 9.81
    exact = -5 * g / (2 * rate**2) * (1 - math.cos(math.sqrt(2 / 7) * rate * 0.3))
    assert run.state["z"] == pytest.approx(exact, abs=1e-9)
    found = reactions("ball_in_hole")
    assert {role for _, role in found.values()} == {("friction", "ball", "cylinder")}


def test_a_marble_in_a_bowl_has_parts_of_one_force() -> None:
    found = reactions("marble_in_bowl")
    assert {role for _, role in found.values()} == {("part", "ball", "sphere")}


@pytest.mark.slow
def test_two_wheels_on_an_axle_have_three_redundant_equations() -> None:
    """Each touches the floor by its place, and one keeps the other from slipping sideways."""
    equations = derivation("segway").equations
    account = equations.derivation.account
    lines = {line.name: line for line in account.lines}
    assert (lines["left"].idle, lines["right"].idle) == (1, 2)
    assert account.nonholonomic == 3
    said = [warning.hint or "" for warning in equations.derivation.warnings]
    assert any("right does not slip along direction 2 of the plane" in hint for hint in said)


@pytest.mark.slow
def test_a_vehicle_on_two_wheels_stands_or_hangs() -> None:
    """Its angles count up to turns, though SymPy writes ½ (a + b sin² θ) anew a turn later."""
    equilibria = derivation("segway").analyze().equilibria
    assert equilibria is not None
    assert equilibria.complete
    tilt = [c.name for c in derivation("segway").equations.system.coordinates].index("theta")
    angles = [float(point.position[tilt]) for point in equilibria.points if point.position]
    assert sorted(angles) == pytest.approx([0, math.pi])
