"""Gravity pulls in the direction that a scene gives, as its language page says."""

from __future__ import annotations

import math
import re
from pathlib import Path

import mpmath
import pytest
from sympy import Symbol

from tests.mechanics.mechanics_support import derived, number

PAGE = (Path(__file__).parents[3] / "docs" / "scene-language.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "direction", ["[0, 0, -1]", "[0, 0, 1]", "[3, 0, -4]", "[1, -2, 2]", "[-1, 0, 0]"]
)
def test_a_free_particle_falls_in_the_direction(direction: str) -> None:
    e = derived(
        "parameters: {g: 9.5}\nparticles: {p: {mass: 2, position: [x, y, z]}}\n"
        f"potentials: {{weight: {{gravity: g, direction: {direction}}}}}\n"
    )
    d = [float(x) for x in re.findall(r"-?\d+", direction)]
    for k, pull in enumerate(d):
        found = number(e.system.forcing[k], {e.system.parameters[0].symbol: mpmath.mpf("9.5")})
        assert float(found) == pytest.approx(2 * 9.5 * pull / math.hypot(*d))


def test_the_example_of_the_page() -> None:
    """The block on a slope slides down along it: g sin α, which the example expects."""
    (example,) = (x for x in re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL) if "direction:" in x)
    e = derived(example)
    assert len(e.system.coordinates) == 1
    values = {p.symbol: p.value for p in e.system.parameters}
    at_rest = {**values, Symbol("t", real=True): 0}
    pull = number(e.system.forcing[0], at_rest) / number(e.system.mass_matrix[0][0], at_rest)
    assert float(pull) == pytest.approx(9.81 * math.sin(0.5))
    assert "expect:\n  equations: [ddot(x) = g*sin(alpha)]" in example
