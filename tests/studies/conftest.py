"""The oscillator whose costs and errors several files look at; measured once a run."""

from __future__ import annotations

import gc
import os
import pickle

import pytest

from lagrange_cli.simulate.model.model import Model
from lagrange_cli.studies.tradeoff.measure import trade
from lagrange_cli.studies.tradeoff.result import Trade
from tests.studies.trade_systems import OSCILLATOR, model


@pytest.fixture(scope="session")
def oscillator() -> Model:
    return model(OSCILLATOR)


@pytest.fixture(scope="session")
def traded(oscillator: Model, tmp_path_factory: pytest.TempPathFactory) -> Trade:
    """The measurement of the first process of a run that needs it."""
    base = tmp_path_factory.getbasetemp()
    workers = "PYTEST_XDIST_WORKER" in os.environ
    path = (base.parent if workers else base) / "traded.pickle"
    if path.exists():
        found: Trade = pickle.loads(path.read_bytes())
        return found
    gc.freeze()  # before each timed run garbage is collected
    found = trade(oscillator, repeat=2, budget=0.3)
    own = path.with_suffix(f".{os.getpid()}")
    own.write_bytes(pickle.dumps(found))
    own.replace(path)
    return found
