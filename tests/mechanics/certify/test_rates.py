"""Equations that print as the rate of a momentum: wrong momenta are found, other equations stay."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

from lagrange_cli import api
from lagrange_cli.errors import InternalError
from lagrange_cli.mechanics import derive, derive_uncertified, reduce
from lagrange_cli.mechanics.certify.certificate import certify
from lagrange_cli.mechanics.certify.printed import certify_rates
from lagrange_cli.scene import read_file

SYSTEMS = Path(__file__).parents[3] / "systems"
SCENES = ["surfaces/particle_on_cone", "pendulums/pendulum_on_cart", "fields/magnetic_dipole"]


@pytest.mark.parametrize("name", SCENES)
def test_a_wrong_momentum_is_found(name):
    scene = read_file(str(SYSTEMS / f"{name}.yaml"))
    reduced, shown = reduce(scene), derive(scene).derivation.shown
    evidence = certify(derive_uncertified(reduced), 30, 2)
    certify_rates(evidence, reduced, shown)
    (row,) = [k for k, equation in enumerate(shown) if equation.momentum is not None]
    whole = sp.expand(shown[row].momentum)
    first, *others = sp.Add.make_args(whole)
    little = sp.Rational(1, 10**18)
    for wrong in (-whole, whole * (1 + little), sp.Add(first * (1 + little), *others)):
        changed = [*shown[:row], replace(shown[row], momentum=wrong), *shown[row + 1 :]]
        with pytest.raises(InternalError, match="has another rate"):
            certify_rates(evidence, reduced, changed)


ROTOR = """
name: rotor
parameters: {{m: 1, a: 2, c: 3}}
coordinates: [r, phi]
kinetic: {{disc: m*dot(r)^2/2 + m*r^2*dot(phi)^2/2}}
{0}
initial: {{r: 1, phi: 0}}
"""


@pytest.mark.parametrize(
    "beside",
    [
        "forces: {push: {on: phi, force: a}}",
        "dissipation: {drag: c*dot(phi)^2/2}",
        "constraints: {hold: dot(phi) = a*dot(r)*r}",
        "potentials: {spring: c*sin(phi)}",
    ],
)
def test_what_changes_a_momentum_is_written_out(beside):
    equations = api.loads(ROTOR.format(beside)).derive().equations
    assert all(equation.momentum is None for equation in equations.derivation.shown)


def test_what_reads_back_is_written_out():
    """JSON and plain text can be pasted into a scene, where there is no d/dt."""
    derivation = api.loads(ROTOR.format("")).derive()
    assert "d/dt (m r² φ̇) = 0" in derivation.text()
    written = "m*r^2*ddot(phi) + 2*m*r*dot(r)*dot(phi)"
    assert f"{written} = 0" in derivation.text(ascii=True)
    assert derivation.report()["equations"][1]["residual"] == written
