"""Long chains and trees of bodies are solved by articulated bodies, without their mass matrix."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.dynamics import body_recursion
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.program.operations import count_operations
from lagrange_cli.program.program import build_program
from lagrange_cli.program.solvers.composite_bodies import ChainColumns
from lagrange_cli.program.systems import agreement
from lagrange_cli.scene import read_text
from tests.emit.emitted_c import Compiled
from tests.emit.test_python import load
from tests.mechanics.elements.random_trees import random_tree
from tests.mechanics.elements.test_long_chains import chain_of_bodies
from tests.program.interpreted import interpreted
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
    mass = _symmetric(wanted["mass_matrix"], n)
    pivots = np.array(numbers["pivots"])
    assert np.prod(pivots) == pytest.approx(np.linalg.det(mass), rel=1e-10)
    assert (pivots <= np.array(numbers["scales"]) * (1 + 1e-12)).all()
    forcing = np.array(wanted["forcing"])
    return mass @ np.array(numbers["acceleration"]) - forcing, forcing


def _symmetric(entries: Sequence[float], n: int) -> np.ndarray:
    """Return the matrix whose upper triangle is given by rows."""
    upper = np.zeros((n, n))
    upper[np.triu_indices(n)] = entries
    return upper + np.triu(upper, 1).T


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


#: Turns and displacements of bodies, each on the one before it; a frame without joints between.
SLIDES = GIMBALS.replace("kinetic: {rotor: J*dot(w)^2/2}", "frames: {c: {on: a, at: [0.2, 0, 0]}}")
SLIDES = SLIDES.replace("on: a, at: [0.3", "on: c, at: [0.3").replace("[u, s, p", "[s, p")
SLIDES = SLIDES.replace("r, w]", "r, u, w]")


@pytest.mark.compiler
@pytest.mark.usefixtures("every_tree")
@pytest.mark.parametrize("text", [SLIDES, chain_of_bodies(5, "xyz")])
def test_loops_over_composite_bodies_make_the_mass_matrix_of_a_chain(
    text: str, tmp_path: Path
) -> None:
    equations = derive(read_text(text))
    n = len(equations.system.coordinates)
    y, p = np.random.default_rng(n).uniform(-1, 1, 2 * n), values_of(equations)
    program = build_program(equations, ["mass_matrix"])
    assert program.composite_numbers
    written = run(build_program(equations, ["mass_matrix", "forcing"]), 0.0, y, p)
    expected = _symmetric(written["mass_matrix"], n)
    ((_, source),) = EMITTERS["python"].emit(equations).items()
    emitted = load(source)
    status, by_c = Compiled(equations, tmp_path)("mass_matrix", 0.0, y, p, n * n)
    assert status == 0
    for matrix in (
        interpreted({"mass_matrix": program})["mass_matrix"](0.0, y, p),
        emitted["mass_matrix"](0.0, y, emitted["Parameters"](*p)),
        by_c,
    ):
        assert np.reshape(matrix, (n, n)) == pytest.approx(expected, rel=1e-13, abs=1e-13)


@pytest.mark.usefixtures("every_tree")
@pytest.mark.parametrize("text", [GIMBALS, random_tree(5, 6).scene()], ids=["rotor", "branches"])
def test_other_trees_have_their_mass_matrix_written_out(text: str) -> None:
    assert not build_program(derive(read_text(text)), ["mass_matrix"]).composite_numbers


@pytest.mark.usefixtures("every_tree")
def test_composite_bodies_that_are_not_those_of_the_certificate_are_not_used(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    right = agreement.chain_columns

    def wrong(values, tree):
        columns = right(values, tree)
        steps = [*columns.steps[3:], *columns.steps[:3]]
        return ChainColumns(columns.axes, steps, columns.momenta)

    monkeypatch.setattr(agreement, "chain_columns", wrong)
    assert not build_program(derive(read_text(SLIDES)), ["mass_matrix"]).composite_numbers


def test_statements_of_a_long_mass_matrix_grow_with_its_length() -> None:
    programs = [
        build_program(derive(read_text(chain_of_bodies(n))), ["mass_matrix"]) for n in (20, 24)
    ]
    each = [count_operations(p).total / p.coordinates for p in programs]
    assert each[1] < 1.05 * each[0]


def test_operations_of_a_long_chain_grow_with_its_length() -> None:
    counts = [
        count_operations(build_program(derive(read_text(chain_of_bodies(n))), ["acceleration"]))
        for n in (20, 24)
    ]
    each = [count.total / n for count, n in zip(counts, (20, 24), strict=True)]
    assert each[1] < 1.05 * each[0]
    assert counts[1].divisions == 24
