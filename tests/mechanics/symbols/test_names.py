"""Definitions in place of their names: each looked at once, and none written out without end."""

from __future__ import annotations

import pytest

from tests.mechanics.mechanics_support import derived, refusal

SCENE = "coordinates: [x]\nparticles: {b: {mass: 1, position: [x, 0, 0]}}\n"


def doubled(first: str, times: int) -> str:
    """Definitions of which each names the one before it twice."""
    lines = [f"  d{k}: d{k - 1}*(1 + d{k - 1})" for k in range(1, times + 1)]
    return "\n".join(["definitions:", f"  d0: {first}", *lines, ""])


@pytest.mark.slow
@pytest.mark.parametrize("times", [12, 60, 300])
@pytest.mark.parametrize(
    "use",
    [
        "potentials: {{v: {0}}}",
        "forces: {{f: {{on: x, force: '{0}'}}}}",
        "constraints: {{c: dot(x) = {0}}}",
    ],
)
@pytest.mark.parametrize("first", ["sin(x)", "dot(x)"])
def test_what_doubles_with_each_definition_is_refused(first: str, use: str, times: int) -> None:
    if first == "dot(x)" and use.startswith("potentials"):
        first = "cos(x)"
    problem = refusal(f"{SCENE}{doubled(first, times)}{use.format(f'd{times}')}\n")
    assert problem.rule == "too-large"
    assert problem.mark is not None


def test_definitions_that_few_name_are_written_out() -> None:
    equations = derived(f"{SCENE}{doubled('x', 6)}potentials: {{v: d5 + d6}}\n")
    assert equations.derivation.certificate.mismatch < 1e-25


@pytest.mark.slow
def test_length_counts_beside_an_element_of_the_same_shape() -> None:
    """Names of positions are symbols: the shape does not tell how long their meaning is."""
    long = "+".join(["x"] * 9990)
    scene = f"""
particles: {{a: {{mass: 1, position: [x, 0, 0]}}, b: {{mass: 1, position: [y, 0, 0]}}}}
points: {{c: ["{long}", 0, 0], d: ["{long}+y", 0, 0]}}
coordinates: [x, y]
potentials: {{short: x_a*(x_a - x_b)^2, long: x_c*(x_c - x_d)^2}}
"""
    assert refusal(scene).rule == "too-large"
