"""Equilibria at multiple, asymptotic and clustered roots: only what is proven is one."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from mpmath import mpf

from lagrange_cli import Derivation, load
from lagrange_cli.analysis.interval_roots import IntervalSystem
from lagrange_cli.analysis.interval_values import IN_INTERVALS, INTERVALS, around, ends
from lagrange_cli.analysis.values import Equilibria
from lagrange_cli.api import loads
from tests.systems.shipped import SYSTEMS
from tests.test_defects import DEFECTS


def line(potential: str, coordinates: str = "x", parameters: str = "p: 0.5") -> Derivation:
    names = coordinates.split(", ")
    initial = ", ".join(f"{name}: 0.1" for name in names)
    kinetic = " + ".join(f"dot({name})^2/2" for name in names)
    return loads(f"""
name: line
parameters: {{{parameters}}}
coordinates: [{coordinates}]
kinetic: {{T: {kinetic}}}
potentials: {{V: '{potential}'}}
initial: {{{initial}}}
""").derive()


def equilibria(derivation: Derivation) -> Equilibria:
    return derivation.analyze("equilibria").equilibria


def told(found: Equilibria) -> dict[tuple[float, ...], str]:
    return {tuple(map(float, p.position or ())): p.stability.verdict for p in found.points}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        ("false_stable_double_root", {(0.0,): "unstable"}),
        ("spurious_equilibrium_tanh", {(0.0,): "stable"}),
        ("equilibrium_off_by_2e-4", {(0.0,): "unstable"}),
    ],
)
def test_scenes_that_showed_a_defect(scene: str, expected: dict[tuple[float, ...], str]) -> None:
    found = equilibria(load(DEFECTS / f"{scene}.yaml").derive())
    assert told(found) == expected
    assert all(near.position[0] > 100 for near in found.unproven)


@pytest.mark.slow
def test_a_double_root_beside_a_second_coordinate() -> None:
    found = equilibria(load(DEFECTS / "false_stable_double_root_2dof.yaml").derive())
    assert told(found)[0.0, 0.0] == "unstable"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("potential", "verdict"),
    [
        ("log(cosh(x)) - x*atan(x) + log(1 + x^2)/2", "undecided"),
        ("sinh(x) - x", "unstable"),
        ("cosh(x) - 1 - x^2/2", "stable"),
        ("x - p - sin(x - p)", "unstable"),
        ("x - pi/4 - sin(x - pi/4)", "unstable"),
        ("x^2/2 - sin(x)^2/2", "stable"),
    ],
)
def test_multiple_roots_have_their_place(potential: str, verdict: str) -> None:
    found = equilibria(line(potential))
    place = {"p": 0.5, "pi/4": math.pi / 4}.get(potential.split(" - ")[1].split(" ")[0], 0.0)
    assert [p.position[0] for p in found.points] == pytest.approx([place], abs=1e-15)
    if verdict != "undecided":
        assert found.points[0].stability.verdict == verdict


@pytest.mark.slow
@pytest.mark.parametrize(
    "potential",
    ["x^2*exp(-x^2)", "1/cosh(x)", "x/(1 + x^2)", "atan(x) - tanh(x)", "exp(-x)*cos(x)"],
)
def test_forces_that_fade_balance_nowhere_far_away(potential: str) -> None:
    slope = mpmath.diff
    values = {name: getattr(mpmath, name) for name in ("exp", "cosh", "atan", "tanh", "cos")}
    text = potential.replace("^", "**")
    for point in equilibria(line(potential)).points:
        x = point.position[0]
        with mpmath.workdps(60):
            left, right = (
                slope(lambda y: eval(text, {"x": y, **values}), x + side)
                for side in (-(mpf(10) ** -12), mpf(10) ** -12)
            )
        assert left * right < 0 or x == 0


@pytest.mark.slow
def test_a_double_root_at_no_short_number_is_told_as_not_proven() -> None:
    found = equilibria(line("x - sin(x - sqrt(2)/3)"))
    assert not found.points
    assert [float(near.position[0]) for near in found.unproven] == pytest.approx([2**0.5 / 3])
    analysis = line("x - sin(x - sqrt(2)/3)").analyze("equilibria")
    assert "numbers nearly balance near x = 0.471405" in analysis.text(width=200)
    assert [near["x"] for near in analysis.report()["near"]] == pytest.approx([2**0.5 / 3])
    for to, language in (("latex", "de"), ("typst", "fr"), ("markdown", "en")):
        (document,) = analysis.emit(to, language=language).values()
        assert "0.471405" in document


@pytest.mark.slow
@pytest.mark.parametrize("gap", ["1e-18", "1e-30"])
def test_a_root_that_is_missed_by_little_is_none(gap: str) -> None:
    found = equilibria(line(f"x - sin(x) + {gap}*x"))
    assert not found.points


def test_a_tiny_stiffness_is_not_zero() -> None:
    """V = 1e-25 x²/2 − x⁴ has a minimum at 0, which is lower by a higher order alone."""
    found = equilibria(line("1e-25*x^2/2 - x^4 + 0*sin(x)"))
    assert told(found)[(0.0,)] == "stable"


@pytest.mark.slow
def test_points_of_a_continuum_by_a_symmetry() -> None:
    (point,) = equilibria(line("cosh(x - y) - 1 + (x - y)^4", coordinates="x, y")).points
    assert not point.isolated
    assert point.position[0] == pytest.approx(point.position[1], abs=1e-30)


@pytest.mark.slow
def test_points_of_a_continuum_with_a_state_of_first_order() -> None:
    """A current is a state whose rate is, at rest, a force beside the others."""
    text = (
        "coordinates: [x, y]\nkinetic: {T: (dot(x)^2 + dot(y)^2)/2}\n"
        "potentials: {V: cosh(x - y) - 1 + (x - y)^4}\nstates: {i: {rate: -2*i}}\n"
        "forces: {f: {on: x, force: i}}\ninitial: {x: 0, y: 0, i: 0}"
    )
    (point,) = equilibria(loads(text).derive()).points
    assert not point.isolated
    assert point.position[2] == 0


def test_no_force_at_rest_is_no_internal_error() -> None:
    analysis = load(DEFECTS / "exit3_analyze_rest_division.yaml").derive().analyze()
    assert {left.part for left in analysis.left_out} == {"equilibria", "linearization", "modes"}
    assert "no value at rest" in analysis.left_out[0].reason


def test_a_blade_that_would_rest_at_an_infinite_angle_rests_nowhere() -> None:
    """The force −sech² a vanishes at infinity alone, where a blade has no direction."""
    text = """
particles: {b: {mass: 1, position: [x, y, 0]}}
plane: xy
kinetic: {turn: dot(a)^2/4}
constraints: {blade: dot(x)*sin(a) = dot(y)*cos(a)}
coordinates: [x, y, a]
potentials: {twist: tanh(a)}
initial: {x: 0, y: 0.3, a: 0.6}
"""
    assert equilibria(loads(text).derive()).points == ()


# Intervals.


@pytest.mark.parametrize("name", sorted(IN_INTERVALS))
def test_intervals_hold_the_values_of_functions(name: str) -> None:
    random = np.random.default_rng(1)
    two = name in ("atan2", "pow", "min", "max")
    for _ in range(20):
        middle = (
            random.uniform(1.1, 3.0, 2) if name in ("acosh", "pow") else random.uniform(0, 0.9, 2)
        )
        radius = random.choice([1e-3, 1e-12, 1e-40])
        with mpmath.workprec(200):
            boxes = [around(mpf(x), mpf(radius)) for x in middle[: 1 + two]]
            low, high = ends(IN_INTERVALS[name](*boxes))
            for part in (-1, 0, 0.7, 1):
                point = [mpf(x) + part * mpf(radius) for x in middle[: 1 + two]]
                function = {"abs": abs, "pow": mpmath.power, "min": min, "max": max}.get(name)
                value = (function or getattr(mpmath, name))(*point)
                assert low <= value <= high
            assert high - low <= mpf(radius) * 300 + mpf(10) ** -55


def test_one_root_is_proven_and_none_where_there_is_none() -> None:
    def system(constant: str) -> IntervalSystem:
        number = INTERVALS.mpf(constant)
        return IntervalSystem(lambda z: [z[0] ** 2 + number], lambda z: {(0, 0): 2 * z[0]}, 1)

    with mpmath.workdps(17):
        root = mpmath.sqrt(2)
    (radius,) = system("-2").root_radii([root])
    assert radius < 1e-14
    with mpmath.workdps(40):
        assert abs(root - mpmath.sqrt(2)) <= radius
    assert system("-2").root_radii([mpf("1.41")]) is None
    assert system("0").root_radii([mpf(0)]) is None
    assert system("1e-40").root_radii([mpf(10) ** -20]) is None


RHOMBUS = """
coordinates: [xa, za, xb, zb, xc, zc, xd, zd]
parameters: {g: 10}
particles:
  a: {mass: 1, position: [xa, 0, za]}
  b: {mass: 1, position: [xb, 0, zb]}
  c: {mass: 1, position: [xc, 0, zc]}
  d: {mass: 1, position: [xd, 0, zd]}
constraints:
  left: xa^2 + za^2 = 1
  right: xc^2 + zc^2 = 1
  below_left: (xb - xa)^2 + (zb - za)^2 = 1
  below_right: (xb - xc)^2 + (zb - zc)^2 = 1
  load: (xd - xb)^2 + (zd - zb)^2 = 1
potentials: {weights: g*(za + zb + zc + zd)}
initial: {xa: 0.6, za: -0.8, xc: -0.6, zc: -0.8, xb: 0, zb: -1.6, xd: 0, zd: -2.6}
"""


def test_folded_linkages_of_many_coordinates_are_proven_by_exact_values():
    """Folded, the gradients of the constraints are dependent: no small motions are told of it."""
    found = loads(RHOMBUS).derive().analyze("equilibria").equilibria
    places = {tuple(round(float(x), 9) for x in p.position): p for p in found.points}
    folded = places[0, -1, 0, -2, 0, -1, 0, -3]
    assert folded.exact is not None
    assert folded.stability.verdict == "undecided"
    assert folded.stability.reason == "the constraints are not independent there"


def test_where_no_force_of_a_constraint_acts_all_it_allows_is_one_continuum():
    """Crank and piston rest anywhere: points with θ = 0, too, are none of their own."""
    crank = load(SYSTEMS / "constraints" / "slider_crank.yaml").derive()
    (point,) = crank.analyze("equilibria").equilibria.points
    assert not point.isolated
