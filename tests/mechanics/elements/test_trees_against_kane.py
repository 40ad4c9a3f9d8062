"""Mass matrices and forcing of random trees of bodies, against SymPy's KanesMethod.

Kane's equations have partial velocities and a formalism of vectors and frames of their own; with
q̇ as generalized speeds they have the same M and f.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from tests.mechanics.elements.random_trees import by_kane, random_tree

#: Trees that are tried in every run; SymPy takes seconds for the others.
FEW = (1, 2, 5, 8)


@pytest.mark.parametrize(
    ("seed", "number"),
    [pytest.param(s, 1 + s % 3, marks=() if s in FEW else pytest.mark.campaign) for s in range(24)],
)
def test_mass_matrix_and_forcing_are_those_of_kane(seed: int, number: int) -> None:
    tree = random_tree(seed, number)
    system = derive(read_text(tree.scene())).system
    assert tuple(c.name for c in system.coordinates) == tree.coordinates
    assert len(system.coordinates) >= number
    expected_mass, expected_forcing, symbols = by_kane(tree)
    n = len(tree.coordinates)
    state = np.random.default_rng(seed).uniform(-1, 1, 2 * n)
    expected = sp.lambdify([symbols], [*expected_mass, *expected_forcing], cse=True)(state)
    own = [*(c.q for c in system.coordinates), *(c.v for c in system.coordinates)]
    entries = [row[k] for row in system.mass_matrix for k in range(n)]
    found = sp.lambdify([own], [*entries, *system.forcing], cse=True)(state)
    scale = max(1.0, float(np.abs(expected).max()))
    assert np.abs(np.array(found) - np.array(expected)).max() <= 1e-12 * scale
