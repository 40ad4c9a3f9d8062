"""Impulses of energies that jump are told; energies that only have kinks raise no warning."""

from __future__ import annotations

import pytest

from lagrange_cli import loads

SCENE = """
parameters: {{k: 2, c: 0.3}}
particles: {{b: {{mass: 1, position: [x, y, 0]}}}}
coordinates: [x, y]
{section}: {{e: "{term}"}}
initial: {{x: 0, y: 0}}
"""


def rules(section: str, term: str) -> list[str]:
    derivation = loads(SCENE.format(section=section, term=term)).derive()
    return [p.rule for p in derivation.equations.derivation.warnings]


@pytest.mark.parametrize(
    ("section", "term"),
    [
        ("potentials", "sign(x)"),
        ("potentials", "k*sign(x - c)*y"),
        ("potentials", "sign(x)*cos(x)"),
        ("potentials", "abs(dot(x))*x"),
        ("kinetic", "(2 + sign(x))*dot(x)^2"),
        ("kinetic", "abs(dot(x))"),
        ("kinetic", "max(0, dot(x) - 1)"),
    ],
)
def test_an_impulse_is_told(section: str, term: str) -> None:
    assert "impulse" in rules(section, term)


@pytest.mark.parametrize(
    ("section", "term"),
    [
        ("potentials", "abs(x)"),
        ("potentials", "k*max(0, x - c)^2"),
        ("potentials", "x*sign(x)"),
        ("potentials", "sign(x - c)*(x - c)^2*y"),
        ("potentials", "sign(x)*sin(x)"),
        ("potentials", "min(x, y)"),
        ("kinetic", "max(1, x)*dot(x)^2"),
        ("kinetic", "abs(dot(x))*dot(x)"),
        ("kinetic", "max(0, dot(x))^2"),
    ],
)
def test_a_kink_is_no_impulse(section: str, term: str) -> None:
    assert "impulse" not in rules(section, term)
