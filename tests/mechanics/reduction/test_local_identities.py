"""Constraints with branches that definitions satisfy around the start, and not everywhere."""

from __future__ import annotations

import math
import re

import pytest
import yaml
from hypothesis import assume, given
from hypothesis import strategies as st

from lagrange_cli.errors import Problem
from lagrange_cli.mechanics.equations import Equations
from tests.mechanics.mechanics_support import derived, few, refusal

CYCLOID = """
parameters: {{m: 1, a: 0.5, g: 9.81}}
particles: {{p: {{mass: m}}}}
coordinates: [theta]
definitions: {{x_p: a*(theta - sin(theta)), y_p: a*(1 + cos(theta)), z_p: 0}}
{constraints}
potentials: {{v: m*g*y_p}}
initial: {{{start}}}
"""
WIRE = "constraints: {wire: 'x_p - a*acos(y_p/a - 1) + sqrt(y_p*(2*a - y_p)) = 0'}"
BEAD = """
particles: {{p: {{mass: 1, position: [x, y, z]}}}}
plane: xy
coordinates: [x]
definitions: {{y: {curve}}}
constraints: {{c: "{equation}"}}
initial: {{x: {start}}}
"""


def the_warning(e: Equations) -> Problem:
    (warning,) = (w for w in e.derivation.warnings if w.rule == "on-a-part")
    return warning


def place(message: str) -> float:
    return float(re.findall(r"= (-?[\d.]+)", message)[-1])


def wire(theta: float) -> float:
    """The constraint of the cycloid in ordinary arithmetic."""
    x, y = 0.5 * (theta - math.sin(theta)), 0.5 * (1 + math.cos(theta))
    return x - 0.5 * math.acos(y / 0.5 - 1) + math.sqrt(max(y * (1 - y), 0.0))


@pytest.mark.parametrize("start", [0.05, 0.6, 1.5, 2.5, 3.1])
def test_the_cycloid_goes_on_beyond_the_branch(start: float) -> None:
    """On (0, π) it is the wire, wherever the motion starts there; beyond π it is not."""
    e = derived(CYCLOID.format(constraints=WIRE, start=f"theta: {start}"))
    (line,) = e.derivation.account.lines
    assert (line.status, line.on_a_part, e.derivation.account.dof) == ("satisfied", True, 1)
    free = derived(CYCLOID.format(constraints="", start=f"theta: {start}"))
    assert [s.residual for s in e.derivation.shown] == [s.residual for s in free.derivation.shown]
    warning = the_warning(e)
    assert "'wire' is satisfied by the definitions on a part" in warning.message
    assert abs(wire(place(warning.message))) > 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("start", ["theta: 4", "theta: 6", "theta: 0", "theta: -1", ""])
def test_a_start_elsewhere_is_told_one_that_holds(start: str) -> None:
    text = CYCLOID.format(constraints=WIRE, start=start)
    problem = refusal(text)
    assert problem.rule == "singular"
    theta = place(problem.message)
    assert 0 < theta < math.pi
    tree = yaml.safe_load(text)
    tree.update(yaml.safe_load(problem.hint.splitlines()[-1]))
    accepted = derived(yaml.safe_dump(tree))
    assert accepted.derivation.account.lines[0].on_a_part


@pytest.mark.parametrize(
    ("curve", "equation", "start"),
    [
        ("x", "y = sqrt(x^2)", 2),
        ("-x", "y = sqrt(x^2)", -2),
        ("x^2", "sqrt(y) = x", 0.5),
        ("sin(x)", "asin(y) = x", 0.3),
        ("sin(x)", "asin(y) + x = pi", 2.5),
        ("tan(x)", "atan(y) = x", -0.7),
        ("-x^2", "y = x*sqrt(x^2)", -1),
        ("cosh(x)", "acosh(y) = x", 1),
        ("x", "atan2(y, x) = pi/4", 0.4),
    ],
)
def test_other_branches(curve: str, equation: str, start: float) -> None:
    e = derived(BEAD.format(curve=curve, equation=equation, start=start))
    assert e.derivation.account.dof == 1
    assert e.derivation.account.lines[-1].on_a_part
    x = place(the_warning(e).message)
    y = float(eval_curve(curve, x))
    left, right = equation.replace("^", "**").split("=")
    names = {**vars(math), "norm": math.hypot, "x": x, "y": y}
    assert abs(eval(left, names) - eval(right, names)) > 1e-3


def eval_curve(curve: str, x: float) -> float:
    return eval(curve.replace("^", "**"), {**vars(math), "x": x})


@pytest.mark.parametrize(
    ("curve", "equation", "start"),
    [
        ("x^2", "sqrt(y^2) = x^2", 2),
        ("x", "norm(x, y) = sqrt(2)*norm(x)", 1),
        ("x^2 + 1", "sqrt(y - 1)^2 = x^2", 0.5),
        ("sqrt(4 - x^2)", "norm(x, y) = 2", 0.5),
        ("sin(x)", "sin(asin(y)) = y", 0.3),
        ("x", "(x - y)*sqrt(x^2 + 1) = 0", 1),
    ],
)
def test_what_holds_everywhere_is_said_so(curve: str, equation: str, start: float) -> None:
    e = derived(BEAD.format(curve=curve, equation=equation, start=start))
    assert [line.on_a_part for line in e.derivation.account.lines] == [False, False]
    assert not [w for w in e.derivation.warnings if w.rule == "on-a-part"]


def test_a_solution_that_holds_on_a_part() -> None:
    """√y = x is solved for y = x², which violates it for negative x."""
    e = derived(
        "particles: {p: {mass: 1, position: [x, y, 0]}}\ncoordinates: [x]\n"
        "constraints: {c: sqrt(y) = x}\ninitial: {x: 0.2}\n"
    )
    warning = the_warning(e)
    assert "'c' holds on a part of the configurations only as it was solved" in warning.message
    assert place(warning.message) < 0
    assert e.derivation.account.lines[0].status == "independent"


def test_a_gap_that_keeps_the_motion_on_the_part() -> None:
    """Where a one-sided constraint forbids the rest, nothing is to be said of it."""
    text = BEAD.format(curve="x", equation="y = sqrt(x^2)", start=2)
    e = derived(text.replace("constraints: {", "constraints: {wall: x >= 0, "))
    assert not [w for w in e.derivation.warnings if w.rule == "on-a-part"]


@pytest.mark.slow
@few
@given(st.floats(-3, 3), st.floats(-9, 9))
def test_an_angle_within_half_a_turn(shift: float, start: float) -> None:
    """acos(cos u) = u for 0 ≤ u ≤ π alone: decided at the start, a hundredth from the ends."""
    equation = f"acos(cos(x + {shift:.3f})) = x + {shift:.3f}"
    u = round(start, 3) + round(shift, 3)
    assume(min(abs(u), abs(u - math.pi)) > 0.01)
    text = BEAD.format(curve="0", equation=equation, start=f"{start:.3f}")
    if 0 < u < math.pi:
        e = derived(text)
        assert e.derivation.account.lines[-1].on_a_part
        wrong = place(the_warning(e).message) + round(shift, 3)
        assert not 0 <= wrong <= math.pi
    else:
        assert refusal(text).rule in ("singular", "inconsistent", "too-many-coordinates")


@pytest.mark.parametrize(
    ("equation", "start"),
    [("acos(cos(x)) = x", "0"), ("acos(cos(x)) = x", "pi"), ("sqrt(x^2) = x", "0")],
)
@pytest.mark.parametrize("comment", ["", "# of another digest\n"])
def test_at_the_end_of_a_part_a_side_has_to_be_chosen(equation, start, comment) -> None:
    problem = refusal(comment + BEAD.format(curve="0", equation=equation, start=start))
    assert "on a part of the configurations only" in problem.message
    assert "not around the initial configuration" in problem.message


def test_what_others_imply_on_a_part() -> None:
    """The upper half of a circle that the definitions go all around: one warning, and true."""
    e = derived(
        "particles: {p: {mass: 1, position: [2*sin(u), 0, 2*cos(u)]}}\ncoordinates: [u]\n"
        "constraints: {ring: x_p^2 + z_p^2 = 4, up: z_p = sqrt(4 - x_p^2)}\ninitial: {u: 0.3}\n"
    )
    (warning,) = e.derivation.warnings
    said = "'up' is redundant, implied by 'ring', on a part of the configurations only: not at u ="
    assert said in warning.message
    assert math.cos(place(warning.message)) < 0
    assert [(line.status, line.on_a_part) for line in e.derivation.account.lines] == [
        ("satisfied", False),
        ("redundant", True),
    ]
