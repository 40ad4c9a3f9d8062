"""Routh's form: reduced motions with the ignored coordinates recovered are the whole motion."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
import sympy as sp

from lagrange_cli import api
from lagrange_cli.analysis.forms.routhian import routhian_form
from lagrange_cli.cache import open_cache
from lagrange_cli.errors import InputError, InternalError
from tests.analysis.form_motions import integrated, numbers, read_back
from tests.parts import changed
from tests.systems.shipped import sliced

SYSTEMS = Path(__file__).parents[2] / "systems"

#: A bead on a hoop that turns freely about its vertical diameter.
FREE_HOOP = """
name: free_hoop
parameters:
  m: {value: 1, positive: true}
  R: {value: 1, positive: true}
  I: {value: 0.5, positive: true}
  g: 9.81
particles:
  bead: {mass: m, position: [R*sin(theta)*cos(phi), R*sin(theta)*sin(phi), -R*cos(theta)]}
coordinates: [theta, phi]
kinetic: {hoop: I*dot(phi)^2/2}
potentials: {weight: {gravity: g}}
initial: {theta: 1, phi: 0, dot(theta): 0, dot(phi): 2}
"""


def _reduced(derivation):
    """First-order rates of the coordinates that are left, then those of the ignored ones."""
    report = derivation.report(form="routhian")
    left = report["coordinates"]
    accelerations = [sp.Symbol(f"ddot_{name}") for name in left]
    residuals = [read_back(row["residual"]) for row in report["equations"]]
    solved = sp.solve(residuals, accelerations, dict=True)[0] if left else {}
    rates = {name: sp.Symbol(f"dot_{name}") for name in left}
    rates |= {f"dot_{name}": solved[a] for name, a in zip(left, accelerations, strict=True)}
    rates |= {row["coordinate"]: read_back(row["velocity"]) for row in report["recovered"]}
    return report, rates


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "until"),
    [
        ("lecture/masses_through_hole.yaml", 2.0),
        ("pendulums/spherical_pendulum.yaml", 1.0),
        ("pendulums/pendulum_on_cart.yaml", 1.5),
        ("fields/magnetic_dipole.yaml", 2.0),
        ("rigid/heavy_top.yaml", 0.2),
        (FREE_HOOP, 1.5),
    ],
    ids=lambda value: str(value).split("\n")[-1] if "\n" in str(value) else str(value),
)
def test_reduced_motion_is_the_whole_motion(scene, until):
    derivation = (api.loads(scene) if "\n" in scene else api.load(SYSTEMS / scene)).derive()
    report, rates = _reduced(derivation)
    values = numbers(derivation)
    values |= {row["momentum"]: row["start"] for row in report["recovered"]}
    end = integrated(rates, values, until)
    expected = derivation.simulate(until=until, accuracy=1e-10).state
    for c in derivation.equations.system.coordinates:
        assert end[c.name] == pytest.approx(expected[c.name], rel=1e-7, abs=1e-8)


def test_hole_in_the_table_reduces_to_r():
    """θ̇ = R² ω₀/r² of a puck that starts at r = R with ω₀."""
    derivation = api.load(SYSTEMS / "lecture" / "masses_through_hole.yaml").derive()
    report = derivation.report(form="routhian")
    assert (report["coordinates"], report["ignored"]) == (["r"], ["theta"])
    assert (report["momenta"], report["dof"]) == (["p_theta"], 2)
    (row,) = report["recovered"]
    recovered = read_back(row["velocity"]).subs("p_theta", read_back("M*R^2*omega0"))
    assert sp.simplify(recovered - read_back("R^2*omega0/r^2")) == 0
    assert row["start"] == pytest.approx(2.0 * 1.0**2 * 3.0)
    effective = read_back(report["effective_potential"])
    assert sp.simplify(effective - read_back("p_theta^2/(2*M*r^2) + m*g*(r - l)")) == 0


def test_effective_potential_of_the_heavy_top():
    """Landau and Lifshitz, Mechanics, section 35, problem 1, with p_psi²/(2 I3) kept."""
    report = api.load(SYSTEMS / "rigid" / "heavy_top.yaml").derive().report(form="routhian")
    expected = read_back(
        "(p_phi - p_psi*cos(theta))^2/(2*I1*sin(theta)^2) + p_psi^2/(2*I3) + M*g*l*cos(theta)"
    )
    assert sp.simplify(read_back(report["effective_potential"]) - expected) == 0
    assert report["gyroscopic"] == "0"


def test_free_hoop():
    report = api.loads(FREE_HOOP).derive().report(form="routhian")
    expected = read_back("p_phi^2/(2*(I + m*R^2*sin(theta)^2)) - m*g*R*cos(theta)")
    assert sp.simplify(read_back(report["effective_potential"]) - expected) == 0


def test_linear_terms_are_kept_apart():
    report = api.load(SYSTEMS / "pendulums" / "pendulum_on_cart.yaml").derive()
    report = report.report(form="routhian")
    linear = read_back("m2*l*p_x*dot(phi)*cos(phi)/(m1 + m2)")
    assert sp.simplify(read_back(report["gyroscopic"]) - linear) == 0
    assert "dot" not in report["effective_potential"]
    whole = read_back(report["routhian"]) + read_back(report["effective_potential"]) - linear
    assert sp.degree(sp.expand(whole), sp.Symbol("dot_phi")) == 2


def test_all_coordinates_may_be_ignored():
    text = """
name: free
parameters: {m: 2}
particles: {ball: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
initial: {x: 0, y: 0, dot(x): 1, dot(y): 2}
"""
    derivation = api.loads(text).derive()
    report = derivation.report(form="routhian")
    assert (report["coordinates"], report["equations"]) == ([], [])
    assert read_back(report["routhian"]) == read_back("-p_x^2/(2*m) - p_y^2/(2*m)")
    assert "R = -V_eff" in derivation.text(form="routhian")


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        ("pendulums/pendulum.yaml", "no coordinate is cyclic"),
        ("pendulums/inverted_pendulum_on_cart.yaml", "the coordinate 'p' is cyclic, but forces"),
    ],
)
def test_scenes_without_conserved_momenta_are_refused(scene, reason):
    equations = api.load(SYSTEMS / scene).derive().equations
    with pytest.raises(InputError, match=reason):
        routhian_form(equations)


def test_roots_of_velocities_are_refused():
    text = """
name: fast
parameters: {m: {value: 2, positive: true}, c: {value: 3, positive: true}}
coordinates: [x]
kinetic: {particle: -m*c^2*sqrt(1 - dot(x)^2/c^2)}
initial: {x: 0, dot(x): 1}
"""
    with pytest.raises(InputError, match="not quadratic in the velocities"):
        routhian_form(api.loads(text).derive().equations)


def test_equations_that_are_made_wrong_are_not_shown():
    equations = api.load(SYSTEMS / "lecture" / "masses_through_hole.yaml").derive().equations
    forcing = (
        equations.system.forcing[0] * (1 + sp.Rational(1, 10**20)),
        equations.system.forcing[1],
    )
    with pytest.raises(InternalError, match="Routh's form disagrees"):
        routhian_form(changed(equations, forcing=forcing))


@pytest.mark.slow
@sliced(sorted(SYSTEMS.glob("*/*.yaml")), argument="path")
def test_every_scene_has_the_form_or_a_reason(path):
    form, reason = None, "no-routhian"
    with contextlib.suppress(InputError):
        derivation = api.load(path).derive(cache=open_cache())
        try:
            form = routhian_form(derivation.equations)
        except InputError as refusal:
            reason = refusal.problems[0].rule
    assert reason == "no-routhian"
    if form is not None:
        assert form.certificate.mismatch < 1e-25
        assert derivation.text(form="routhian", ascii=True)
        assert derivation.emit("markdown", form="routhian")
