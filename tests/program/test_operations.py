"""Operations of programs, by count."""

from __future__ import annotations

from pathlib import Path

import pytest

from lagrange_cli import load
from lagrange_cli.program.operations import count_operations
from lagrange_cli.program.program import build_jacobian, build_program

SYSTEMS = Path(__file__).parents[2] / "systems"


@pytest.mark.parametrize(
    "name",
    [
        "celestial/arenstorf_orbit",
        "celestial/trojan_asteroid",
        "fields/magnetic_dipole",
        "lecture/masses_through_hole",
        "pendulums/triple_pendulum",
        "rigid/heavy_top",
    ],
)
def test_derivatives_take_at_most_n_plus_3_right_hand_sides(name):
    """Of scenes whose systems are solved in statements: loops that solve are not counted."""
    equations = load(SYSTEMS / f"{name}.yaml").derive().equations
    once = count_operations(build_program(equations, ["acceleration"])).total
    derivatives = count_operations(build_jacobian(equations, "state")).total
    assert derivatives > 0
    assert once + derivatives <= (len(equations.system.coordinates) + 3) * once


def test_the_mass_matrix_of_a_chain_takes_few_multiplications():
    """The product m l² of the last particle is formed once, for all slopes of that particle."""
    equations = load(SYSTEMS / "chains/pendulum_chain.yaml", parameters={"n": 6}).derive().equations
    assert count_operations(build_program(equations, ["acceleration"])).multiplications <= 121
