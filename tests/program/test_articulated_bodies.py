"""Long chains and trees of bodies are solved by articulated bodies, without their mass matrix."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.dynamics import body_recursion
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.program.operations import count_operations
from lagrange_cli.program.program import build_program
from lagrange_cli.program.systems import agreement
from lagrange_cli.scene import read_text
from tests.mechanics.elements.random_trees import random_tree
from tests.mechanics.elements.test_long_chains import chain_of_bodies
from tests.program.test_many_coordinates import values_of
from tests.program.test_program import run

#: Three turns of one body, a displacement that is a function of a coordinate, a rotor.
GIMBALS = """
parameters: {A: {value: 0.3, positive: true}, m: 1.2, g: 9.81, J: {value: 0.05, positive: true}}
bodies:
  a: {at: [s, 0, 0.1], turn: [z: p, x: q, {axis: [1, 2, 2], angle: 2*r}],
      centre: [0.1, 0.2, 0], mass: m, inertia: [A, A, 2*A]}
  b: {on: a, at: [0.3, u^3 + u, 0], turn: [y: w], centre: [0, 0.1, 0.3], mass: 2*m,
      inertia: [[0.5, 0.1, 0], [0.1, 0.4, 0.05], [0, 0.05, 0.3]]}
kinetic: {rotor: J*dot(w)^2/2}
coordinates: [u, s, p, q, r, w]
potentials: {weight: {gravity: g}}
"""


@pytest.fixture
def every_tree(monkeypatch: pytest.MonkeyPatch) -> None:
    """Solve short trees by recursion and by articulated bodies too."""
    monkeypatch.setattr(body_recursion, "CHAIN_TERMS", 0)
    monkeypatch.setattr(agreement, "FEWEST_ARTICULATED", 1)


def _differences(equations: Equations) -> tuple[np.ndarray, np.ndarray]:
    """M a − f and f at a random state, with a of articulated bodies."""
    n = len(equations.system.coordinates)
    y, p = np.random.default_rng(n).uniform(-1, 1, 2 * n), values_of(equations)
    solved = build_program(equations, ["acceleration"])
    (block,) = solved.blocks
    assert block.unrolled
    numbers = run(solved, 0.0, y, p)
    wanted = run(build_program(equations, ["mass_matrix", "forcing"]), 0.0, y, p)
    upper = np.zeros((n, n))
    upper[np.triu_indices(n)] = wanted["mass_matrix"]
    mass = upper + np.triu(upper, 1).T
    pivots = np.array(numbers["pivots"])
    assert np.prod(pivots) == pytest.approx(np.linalg.det(mass), rel=1e-10)
    assert (pivots <= np.array(numbers["scales"]) * (1 + 1e-12)).all()
    forcing = np.array(wanted["forcing"])
    return mass @ np.array(numbers["acceleration"]) - forcing, forcing


@pytest.mark.usefixtures("every_tree")
@pytest.mark.parametrize("seed", [2, 5])
def test_accelerations_of_random_trees_solve_their_equations(seed: int) -> None:
    equations = derive(read_text(random_tree(seed, 1 + seed).scene()))
    difference, forcing = _differences(equations)
    assert abs(difference).max() < 1e-12 * max(1.0, abs(forcing).max())


@pytest.mark.usefixtures("every_tree")
def test_gimbals_slides_and_rotors_are_articulated_too() -> None:
    difference, forcing = _differences(derive(read_text(GIMBALS)))
    assert abs(difference).max() < 1e-12 * abs(forcing).max()


@pytest.mark.usefixtures("every_tree")
@pytest.mark.parametrize("angle", ["p + q", "p*q"])
def test_a_coordinate_of_two_motions_is_eliminated_from_the_mass_matrix(angle: str) -> None:
    text = GIMBALS.replace("y: w", f"y: w + {angle}")
    (block,) = build_program(derive(read_text(text)), ["acceleration"]).blocks
    assert not block.unrolled


@pytest.mark.usefixtures("every_tree")
def test_accelerations_that_are_not_those_of_the_certificate_are_not_used(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = agreement.solve_tree

    def wrong(values, tree, forcing):
        return right(values, tree, [forcing[1], forcing[0], *forcing[2:]])

    monkeypatch.setattr(agreement, "solve_tree", wrong)
    (block,) = build_program(derive(read_text(GIMBALS)), ["acceleration"]).blocks
    assert not block.unrolled


def test_operations_of_a_long_chain_grow_with_its_length() -> None:
    counts = [
        count_operations(build_program(derive(read_text(chain_of_bodies(n))), ["acceleration"]))
        for n in (20, 24)
    ]
    each = [count.total / n for count, n in zip(counts, (20, 24), strict=True)]
    assert each[1] < 1.05 * each[0]
    assert counts[1].divisions == 24
