"""One-sided constraints that cannot work, each refused with its place and a way out."""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from tests.mechanics.mechanics_support import derived, refusal

CIRCLE = """
parameters: {m: 1, R: 2}
plane: xz
particles: {p: {mass: m, position: [x, y, z]}}
"""

REFUSED = {
    "defined": (
        "coordinates: [q]\ndefinitions: {x: R*sin(q), z: R*cos(q)}\n"
        "constraints: {ball: x^2 + z^2 >= R^2}\n",
        "closed at every configuration",
        "take x, z as coordinates",
    ),
    "constrained": (
        "constraints: {hoop: x^2 + z^2 = R^2, ball: x^2 + z^2 >= R^2}\n",
        "closed at every configuration",
        "'hoop'",
    ),
    "never": (
        "constraints: {hoop: x^2 + z^2 = R^2, ball: x^2 + z^2 <= 4*R^2}\n",
        "never closed",
        "'hoop'",
    ),
    "always": (
        "constraints: {hoop: x^2 + z^2 = R^2, ball: x^2 + z^2 >= 4*R^2}\n",
        "violated at every configuration",
        "'hoop'",
    ),
    "eliminated": ("constraints: {ball: y >= -1}\n", "never closed", "'plane'"),
    "in time": ("constraints: {ball: y >= t}\n", "changed by no motion", "'plane'"),
    "square": ("constraints: {ball: x^2 + 1 >= 0}\n", "cannot be violated", "leave it out"),
    "touching": ("constraints: {ball: x^2 + z^2 >= 0}\n", "cannot be violated", "leave it out"),
    "negative": ("constraints: {ball: x^2 + R <= 0}\n", "leaves no room", "turn it round"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_gaps_that_do_not_work_are_refused(case: str) -> None:
    section, says, hint = REFUSED[case]
    problem = refusal(CIRCLE + section)
    assert problem.message.startswith("the one-sided constraint 'ball' ")
    assert says in problem.message
    assert hint in problem.hint
    assert problem.mark is not None
    assert problem.mark.text[problem.mark.column - 1 :].startswith(("x^2", "y >="))


SAME = [
    "y >= (sin(x)^2 + cos(x)^2)*y",
    "exp(2*z) >= exp(z)^2",
    "(x + y)^3 >= x^3 + 3*x^2*y + 3*x*y^2 + y^3",
    "log(exp(z)^2) <= 2*z",
    "exp(z*(x + y)) >= exp(z*x)*exp(z*y)",
]
STEEP = ["z^100 >= 1", "z^100 >= 1e300", "tan(z) >= 1e300", "1e-300*z >= 0", "z >= 1e12 + 1e-9*x"]
FREE = "particles: {p: {mass: 1, position: [x, y, z]}}\nconstraints: {it: 'THIS'}\n"


@pytest.mark.parametrize("gap", SAME)
def test_what_is_the_same_everywhere_is_seen(gap: str) -> None:
    assert "closed at every configuration" in refusal(FREE.replace("THIS", gap)).message


@pytest.mark.slow
@pytest.mark.parametrize("gap", STEEP)
def test_what_changes_little_changes(gap: str) -> None:
    assert derived(FREE.replace("THIS", gap)).derivation.account.unilateral == 1


def test_no_configuration_in_the_domain_of_a_gap() -> None:
    problem = refusal(FREE.replace("THIS", "z >= log(-1 - z^2)"))
    assert problem.mark is not None


@pytest.mark.parametrize("value", ["-0.1", "1.1", "1e-3 - 1"])
def test_restitution_outside_its_range(value: str) -> None:
    text = "parameters: {m: 1, e: VALUE}\nparticles: {p: {mass: m}}\nconstraints:\n"
    text = text.replace("VALUE", value) + "  floor: {unilateral: z_p >= 0, restitution: e}\n"
    problem = refusal(text)
    assert "from 0 to 1, found e = " in problem.message
    assert (problem.mark.line, problem.mark.length) == (5, 1)
    derive(read_text(text, parameters={"e": "0.5"}))


def test_restitution_without_a_value_stays_open() -> None:
    text = "parameters: {e: {}}\nparticles: {p: {mass: 1}}\nconstraints:\n"
    text += "  floor: {unilateral: z_p >= 0, restitution: e^2}\n"
    (contact,) = derive(read_text(text)).system.contacts
    assert contact.restitution == sp.Symbol("e", real=True) ** 2
