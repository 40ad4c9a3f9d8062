"""Simulated motions of shipped scenes against closed forms and first integrals from the books."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from lagrange_cli.mechanics.equations import Equations
from tests.systems.integrals import FIRST_INTEGRALS
from tests.systems.motions import CLOSED_FORMS
from tests.systems.shipped import derived, simulated

pytestmark = pytest.mark.slow


def named_parameters(e: Equations) -> SimpleNamespace:
    return SimpleNamespace(**{p.name: p.value for p in e.system.parameters})


@pytest.mark.parametrize("name", sorted(CLOSED_FORMS))
def test_simulation_follows_the_closed_form(name: str) -> None:
    e, trajectory = derived(name), simulated(name)
    assert e.system.initial is not None
    names = [c.name for c in e.system.coordinates]
    exact = CLOSED_FORMS[name](
        named_parameters(e),
        SimpleNamespace(**dict(zip(names, e.system.initial.positions, strict=True))),
        SimpleNamespace(**dict(zip(names, e.system.initial.velocities, strict=True))),
        trajectory.t,
    )
    for column, expected in exact.items():
        found = trajectory.columns[column]
        # Cartesian names turn faster than the angles they are made of.
        assert np.abs(found - expected).max() <= 1e-8 * max(
            1e-300, np.ptp(expected), abs(expected[0])
        )


@pytest.mark.parametrize("name", sorted(FIRST_INTEGRALS))
def test_first_integral_is_kept(name: str) -> None:
    e, trajectory = derived(name), simulated(name)
    names = [c.name for c in e.system.coordinates]
    values = FIRST_INTEGRALS[name](
        named_parameters(e),
        SimpleNamespace(**{c: trajectory.columns[c] for c in names}),
        SimpleNamespace(**{c: trajectory.columns[f"dot({c})"] for c in names}),
    )
    assert np.abs(values[0]) > 0.1
    assert np.ptp(values) <= 1e-7 * np.abs(values[0])
