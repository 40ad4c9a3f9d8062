"""Runs that end at singular configurations are told from runs that end elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli.mechanics.derivation import derive
from lagrange_cli.scene import read_text
from lagrange_cli.simulate.charts.detection import first_passage
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import right_hand_side
from tests.simulate.charts.test_charts import spherical


@pytest.fixture(scope="module")
def model():
    return model_of(derive(read_text(spherical())))


@pytest.mark.parametrize("status", ["ok", "stopped", "accuracy_not_reached"])
@pytest.mark.parametrize("last", [1e-12, 0.8])
def test_only_a_run_that_fails_beside_the_pole_ends_at_it(model, status, last):
    t = np.linspace(0, 1, 5)
    theta = np.linspace(1.2, last, 5)
    states = np.column_stack([theta, np.zeros(5), np.full(5, last - 1.2), np.zeros(5)])
    found = first_passage(model, right_hand_side(model).singular, t, states, status, 1e-6)
    if last < 0.1 and status == "accuracy_not_reached":
        assert (found.samples, found.passed) == (5, False)
    else:
        assert found is None
