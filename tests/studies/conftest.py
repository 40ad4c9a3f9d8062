"""The oscillator whose costs and errors several files look at; measured once a process."""

from __future__ import annotations

import pytest

from lagrange_cli.simulate.model.model import Model
from lagrange_cli.studies.tradeoff.measure import trade
from lagrange_cli.studies.tradeoff.result import Trade
from tests.studies.trade_systems import OSCILLATOR, model


@pytest.fixture(scope="session")
def oscillator() -> Model:
    return model(OSCILLATOR)


@pytest.fixture(scope="session")
def traded(oscillator: Model) -> Trade:
    return trade(oscillator, repeat=2, budget=0.3)
