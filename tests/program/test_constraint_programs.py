"""Multipliers that come from a right-hand side are those of a program of their own."""

from __future__ import annotations

from pathlib import Path

import pytest

from lagrange_cli.mechanics.derivation import derive
from lagrange_cli.program.emitted_functions import multipliers_beside
from lagrange_cli.program.program import build_program
from lagrange_cli.program.systems.constraint_systems import CLOSURE_OUTPUTS
from lagrange_cli.program.systems.contact_systems import with_contact_flags
from lagrange_cli.scene import read_file, read_text
from tests.emit import emit_closures as closures

SYSTEMS = Path(__file__).parents[2] / "systems"


def derived(scene):
    equations = derive(read_file(SYSTEMS / scene))
    return with_contact_flags(equations) if equations.system.contacts else equations


CLOSED = ["chains/chain_of_rods", "constraints/slider_crank", "rolling/chaplygin_sleigh"]


@pytest.mark.parametrize("scene", CLOSED)
def test_one_system_gives_accelerations_and_multipliers(scene):
    equations = derived(f"{scene}.yaml")
    shared = multipliers_beside(build_program(equations, ("acceleration",)))
    assert shared == build_program(equations, ("multipliers",))


def test_those_of_contacts_do_as_well():
    equations = derived("contact/ladder_leaving_wall.yaml")
    shared = multipliers_beside(build_program(equations, ("contact_acceleration",)))
    assert shared == build_program(equations, ("contact_multipliers",))


def test_multipliers_in_loops_or_none_are_not_shared():
    for equations in (closures.chain(12), derived("pendulums/double_pendulum.yaml")):
        assert multipliers_beside(build_program(equations, ("acceleration",))) is None


def test_squares_of_gradients_are_those_of_the_kinetic_energy():
    """Of masses 4 and 9 and x² + 3 y² = 4: (2 x)²/4 + (6 y)²/9."""
    equations = derive(
        read_text(
            "name: two\ncoordinates: [x, y]\nkinetic: {T: 2*dot(x)^2 + 9/2*dot(y)^2}\n"
            "constraints: {curve: x^2 + 3*y^2 = 4}\n"
        )
    )
    (square,) = CLOSURE_OUTPUTS["closure_gradient_squares"](equations)
    x, y = (c.q for c in equations.system.coordinates)
    assert square.equals(x**2 + 4 * y**2)
