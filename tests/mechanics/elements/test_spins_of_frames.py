"""Angular velocities in expressions over derived equations."""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli.errors import InputError, Mark
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.interpretation import interpret
from lagrange_cli.scene import read_text
from lagrange_cli.scene.language.grammar import parse_expression

ARM = """
parameters: {m: 2}
frames: {turntable: {turn: {z: a}}}
bodies: {rod: {on: turntable, turn: {x: b}, mass: m, inertia: {rod: 1}}}
coordinates: [a, b]
definitions: {w: omega_z(turntable)}
"""


@pytest.fixture(scope="module")
def equations() -> Equations:
    return derive(read_text(ARM))


def _value(equations: Equations, text: str) -> sp.Expr:
    return interpret(equations, parse_expression(text, Mark("scene", 1, 1)))


def test_those_of_bodies_and_of_named_frames_are_known(equations: Equations) -> None:
    a, b = equations.system.coordinates
    assert _value(equations, "omega_1(rod)") == b.v
    assert _value(equations, "w") == a.v


def test_that_of_a_frame_without_mass_is_refused_with_a_way_out(equations: Equations) -> None:
    with pytest.raises(InputError) as caught:
        _value(equations, "1 + omega_z(turntable)")
    (problem,) = caught.value.problems
    assert "'omega_z(turntable)' is not known in the equations" in problem.message
    assert "definitions: {w: omega_z(turntable)}" in problem.hint
    assert problem.mark is not None
    assert problem.mark.column == 5
