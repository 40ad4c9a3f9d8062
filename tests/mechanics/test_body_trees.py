"""Random trees of bodies against SymPy's KanesMethod, and others where they are installed."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.slow
@pytest.mark.parametrize("number", range(6))
def test_mass_matrix_forcing_and_accelerations_of_trees(number, monkeypatch):
    """Hinges and slides about any axes, offset centres, full tensors of inertia."""
    monkeypatch.syspath_prepend(BENCHMARKS)
    bodies = importlib.import_module("bodies")
    result = bodies.compared(np.random.default_rng([36, number]), 1 + number % 3)
    assert "KanesMethod" in result.differences
    for peer, differences in result.differences.items():
        assert max(differences) < 1e-12, peer
