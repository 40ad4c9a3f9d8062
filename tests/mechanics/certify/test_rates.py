"""Equations that print as the rate of a momentum: what is wrong is found, other equations stay."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

from lagrange_cli import api
from lagrange_cli.check.check import check_text
from lagrange_cli.errors import InternalError
from lagrange_cli.mechanics import derive, derive_uncertified, reduce
from lagrange_cli.mechanics.certify.certificate import certify
from lagrange_cli.mechanics.certify.printed import certify_rates
from lagrange_cli.mechanics.equations import RateForm
from lagrange_cli.notation.build import display_row
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.vocabulary import vocabulary
from lagrange_cli.scene import read_file, read_text

SYSTEMS = Path(__file__).parents[3] / "systems"
SCENES = ["surfaces/particle_on_cone", "pendulums/pendulum_on_cart", "fields/magnetic_dipole"]


@pytest.mark.parametrize("name", SCENES)
def test_a_wrong_momentum_is_found(name):
    scene = read_file(str(SYSTEMS / f"{name}.yaml"))
    reduced, shown = reduce(scene), derive(scene).derivation.shown
    evidence = certify(derive_uncertified(reduced), 30, 2)
    certify_rates(evidence, reduced, shown)
    (row,) = [k for k, equation in enumerate(shown) if equation.rate_form is not None]
    whole = sp.expand(shown[row].rate_form.momentum)
    first, *others = sp.Add.make_args(whole)
    little = sp.Rational(1, 10**18)
    for wrong in (-whole, whole * (1 + little), sp.Add(first * (1 + little), *others)):
        changed = [
            *shown[:row],
            replace(shown[row], rate_form=RateForm(wrong)),
            *shown[row + 1 :],
        ]
        with pytest.raises(InternalError, match="has another rate"):
            certify_rates(evidence, reduced, changed)


RELATIVISTIC = """
name: relativistic_kepler
parameters: {m: {value: 1, positive: true}, c: {value: 10, positive: true}, k: 1}
coordinates: {r: {positive: true}, phi: {}}
kinetic: {particle: -m*c^2*sqrt(1 - (dot(r)^2 + r^2*dot(phi)^2)/c^2)}
potentials: {centre: -k/r}
initial: {r: 1, phi: 0}
"""


def test_a_wrong_remainder_is_found():
    scene = read_text(RELATIVISTIC)
    reduced, shown = reduce(scene), derive(scene).derivation.shown
    evidence = certify(derive_uncertified(reduced), 30, 2)
    certify_rates(evidence, reduced, shown)
    form = shown[0].rate_form
    (first, factor), *others = form.remainder
    assert others
    little = sp.Rational(1, 10**18)
    for wrong in (
        (),
        others,
        [(-first, factor), *others],
        [(first * (1 + little), factor), *others],
    ):
        changed = replace(shown[0], rate_form=replace(form, remainder=tuple(wrong)))
        with pytest.raises(InternalError, match="shown for 'r' has another rate"):
            certify_rates(evidence, reduced, [changed, shown[1]])


def test_a_remainder_beside_a_rate_is_the_equation_less_the_rate():
    """SymPy differentiates the momentum by another way than the certificate."""
    equations = api.loads(RELATIVISTIC).derive().equations
    along = [(c.q, c.v) for c in equations.system.coordinates]
    along += [(c.v, c.a) for c in equations.system.coordinates]
    point = {s: sp.Rational(k + 3, 17) for k, (s, _) in enumerate(along)}
    point |= {c.a: sp.Rational(k + 2, 7) for k, c in enumerate(equations.system.coordinates)}
    point |= {p.symbol: sp.Rational(k + 5, 3) for k, p in enumerate(equations.system.parameters)}
    for shown in equations.derivation.shown:
        form = shown.rate_form
        rate = sp.Add(*(sp.diff(form.momentum, s) * ds for s, ds in along))
        assert shown.divided_by == 1
        assert sp.simplify((rate + form.remainder_sum - shown.residual).xreplace(point)) == 0


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
    assert all(equation.rate_form is None for equation in equations.derivation.shown)


def test_what_reads_back_is_written_out():
    """JSON and plain text can be pasted into a scene, where there is no d/dt."""
    derivation = api.loads(ROTOR.format("")).derive()
    assert "d/dt (m r² φ̇) = 0" in derivation.text()
    written = "m*r^2*ddot(phi) + 2*m*r*dot(r)*dot(phi)"
    assert f"{written} = 0" in derivation.text(ascii=True)
    assert derivation.report()["equations"][1]["residual"] == written


def test_equations_with_a_remainder_read_back_written_out_and_as_rates():
    derivation = api.loads(RELATIVISTIC).derive()
    equations = derivation.equations
    rows, words = equations.derivation.shown, vocabulary(equations)
    written_out = [e["residual"] for e in derivation.report()["equations"]]
    rates = [ScenePrinter().inline(display_row(shown, words)) for shown in rows]
    assert rates[1].startswith("dot(m*r^2*dot(phi)/")
    for form in (written_out, rates):
        expected = [f"{left} = 0" for left in form]
        scene = f"{RELATIVISTIC}expect: {{equations: {json.dumps(expected)}}}\n"
        assert check_text("scene.yaml", scene.encode()).outcome == "pass"
        scene = scene.replace("k/r^2", "2*k/r^2")
        assert check_text("scene.yaml", scene.encode()).outcome == "fail"
