"""Members that differ in the start that a constant of integration stands for have each their own.

A wheel rolls on a line against a spring: x = x_0 + R (phi - phi_0), so that the equation of phi
holds both starts, and x(t) = x_0 cos(w t) whatever phi_0 is.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from lagrange_cli import Derivation, loads
from tests.campaign import pairs_of

WHEEL = """
parameters: {m: 2, R: 0.5, I: 0.25, k: 3}
particles: {wheel: {mass: m, position: [x, 0, 0]}}
constraints: {rolls: dot(x) = R*dot(phi)}
coordinates: [phi]
kinetic: {spin: I*dot(phi)^2/2}
potentials: {spring: k*x^2/2}
initial: {x: 1, phi: 0, dot(phi): 0}
simulate: {until: 6, samples: 61, accuracy: 1e-9}
"""

OMEGA = math.sqrt(3 / (2 + 0.25 / 0.5**2))

FORMS = {
    "eliminated": WHEEL,
    "minimal": WHEEL.replace("[phi]", "[x, phi]").replace(
        "simulate: {", "simulate: {formulation: minimal, "
    ),
    "kept": WHEEL.replace("[phi]", "[x, phi]"),
}


@cache
def derivation(form: str) -> Derivation:
    return loads(FORMS[form]).derive()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("form", "name", "reverse"), pairs_of([*FORMS], ["phi", "x"], [False, True])
)
def test_each_member_has_its_own_start(form: str, name: str, *, reverse: bool) -> None:
    values = [0.0, 0.7, -1.25, 2.0, 0.3]
    values = values[::-1] if reverse else values
    ensemble = derivation(form).ensemble({name: values})
    assert ensemble.status == ["ok"] * len(values)
    for member, value in enumerate(values):
        x0, phi0 = (value, 0.0) if name == "x" else (1.0, value)
        x = x0 * np.cos(OMEGA * ensemble.t)
        assert np.abs(ensemble.columns["x"][member] - x).max() < 1e-8
        assert np.abs(ensemble.columns["phi"][member] - phi0 - (x - x0) / 0.5).max() < 1e-8


@pytest.mark.slow
def test_members_are_single_runs() -> None:
    starts = [{"phi": 0.4, "x": 1.5}, {"phi": -2.0, "x": 1.5}, {"phi": 0.4, "x": -0.5}]
    derived = loads(WHEEL).derive()
    ensemble = derived.ensemble(starts)
    for member, start in enumerate(starts):
        alone = derived.simulate(initial=start)
        for name in ("phi", "x", "dot(phi)"):
            assert np.array_equal(ensemble.columns[name][member], alone.columns[name])
        read = WHEEL.replace("x: 1, phi: 0", f"x: {start['x']}, phi: {start['phi']}")
        again = loads(read).derive().simulate()
        assert np.abs(again.columns["phi"] - alone.columns["phi"]).max() < 1e-8
