"""L is shown without constants and functions of time alone; energies and reports keep them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

from lagrange_cli import api
from lagrange_cli.errors import InternalError
from lagrange_cli.mechanics import derive_uncertified, reduce
from lagrange_cli.mechanics.certify.certificate import certify
from lagrange_cli.mechanics.certify.printed import certify_lagrangian
from lagrange_cli.mechanics.structure import short_lagrangian
from lagrange_cli.scene import read_file

SYSTEMS = Path(__file__).parents[2] / "systems"

#: A bead on a line with a potential to be put in.
BEAD = """
name: bead
parameters: {{m: 2, k: 3, l0: 1, g: 9.81, w: 2}}
particles: {{bead: {{mass: m, position: [s, 0, 0]}}}}
coordinates: [s]
potentials: {{pull: "{0}"}}
initial: {{s: 0.3, dot(s): 0.1}}
"""


def _shown(potential):
    derivation = api.loads(BEAD.format(potential)).derive()
    rows = [line for line in derivation.text().splitlines() if line.startswith("L = ")]
    return derivation, " ".join(rows)


@pytest.mark.parametrize(
    ("potential", "expected"),
    [
        ("m*g*(s - l0)", "L = ½ m ṡ² - m g s   (without constants)"),
        ("g*s*cos(t) + k*t", "L = ½ m ṡ² - g s cos t   (without functions of t alone)"),
        (
            "k*(s*cos(t) - sin(w*t)) - g",
            "L = ½ m ṡ² - k s cos t   (without constants and functions of t alone)",
        ),
        ("k*(s - l0)^2/2", ""),
        ("k*s^2/2", ""),
    ],
)
def test_what_is_left_out(potential, expected):
    assert _shown(potential)[1] == expected


def test_what_alone_depends_on_time_stays():
    """T + V is not conserved then, which a reader of L without that term would not see."""
    derivation, row = _shown("m*g*(s - l0) + k*cos(t)")
    assert row == ""
    assert "No cyclic momentum is conserved, and neither is the energy." in derivation.text()


def test_reports_and_energies_are_whole():
    derivation, _ = _shown("m*g*(s - l0)")
    report = derivation.report()
    assert report["lagrangian"] == "1/2*m*dot(s)^2 - m*g*(s - l0)"
    assert report["potential"] == "m*g*(s - l0)"
    (energy,) = report["conserved"]
    assert energy["expression"] == "1/2*m*dot(s)^2 + m*g*(s - l0)"


@pytest.mark.parametrize("name", ["pendulums/kapitza_pendulum", "pulleys/atwood"])
def test_a_wrong_lagrangian_is_found(name):
    derivation = derive_uncertified(reduce(read_file(str(SYSTEMS / f"{name}.yaml"))))
    evidence = certify(derivation, 30, 2)
    short = short_lagrangian(derivation)
    certify_lagrangian(evidence, derivation, short)
    whole = sp.expand(short.expression)
    first, *others = sp.Add.make_args(whole)
    little = 1 + sp.Rational(1, 10**18)
    speed = derivation.reduced.coordinates[0].v
    for wrong in (
        replace(short, expression=whole * little),
        replace(short, expression=sp.Add(first * little, *others)),
        replace(short, left_out=short.left_out * little),
        replace(short, expression=whole - speed, left_out=short.left_out + speed),
    ):
        with pytest.raises(InternalError, match="the Lagrangian shown is not that derived"):
            certify_lagrangian(evidence, derivation, wrong)
