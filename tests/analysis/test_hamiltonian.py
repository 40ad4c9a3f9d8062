"""Hamilton's form: its printed equations move as Lagrange's do, and refusals say why."""

from __future__ import annotations

import contextlib
from pathlib import Path

import pytest
import sympy as sp

from lagrange_cli import api
from lagrange_cli.analysis.forms.hamiltonian import hamiltonian_form
from lagrange_cli.cache import open_cache
from lagrange_cli.errors import InputError, InternalError
from tests.analysis.form_motions import integrated, numbers, read_back
from tests.parts import changed
from tests.systems.shipped import sliced

SYSTEMS = Path(__file__).parents[2] / "systems"


def _canonical(derivation):
    """Rates of q and p, and the momenta over velocities, as they are in the report."""
    report = derivation.report(form="hamiltonian")
    rows = report["canonical"]
    rates = {row["coordinate"]: read_back(row["velocity"]) for row in rows}
    rates |= {row["momentum"]: read_back(row["rate"]) for row in rows}
    momenta = {row["momentum"]: read_back(row["definition"]) for row in rows}
    return report, rates, momenta


def _momenta_at(momenta, values):
    known = {sp.Symbol("t"): 0} | {sp.Symbol(name): x for name, x in values.items()}
    return {name: float(e.subs(known)) for name, e in momenta.items()}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "until"),
    [
        ("pendulums/double_pendulum.yaml", 1.5),
        ("pendulums/pendulum_on_cart.yaml", 1.5),
        ("pendulums/damped_driven_pendulum.yaml", 2.0),
        ("lecture/pendulum_driven_support.yaml", 1.0),
        ("rigid/heavy_top.yaml", 0.2),
        ("fields/relativistic_particle.yaml", 4.0),
        ("fields/magnetic_dipole.yaml", 2.0),
        ("celestial/arenstorf_orbit.yaml", 0.5),
        ("lecture/masses_through_hole.yaml", 2.0),
    ],
)
def test_canonical_equations_move_as_lagranges_do(scene, until):
    derivation = api.load(SYSTEMS / scene).derive()
    _, rates, momenta = _canonical(derivation)
    values = numbers(derivation)
    values |= _momenta_at(momenta, values)
    end = integrated(rates, values, until)
    expected = derivation.simulate(until=until, accuracy=1e-10).state
    for c in derivation.equations.system.coordinates:
        assert end[c.name] == pytest.approx(expected[c.name], rel=1e-7, abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene", ["pendulums/double_pendulum.yaml", "fields/penning_trap.yaml", "rigid/heavy_top.yaml"]
)
def test_rates_are_the_gradient_of_h(scene):
    """∂H/∂p and −∂H/∂q in SymPy are the velocities and rates that are printed."""
    derivation = api.load(SYSTEMS / scene).derive()
    report, rates, _ = _canonical(derivation)
    h = read_back(report["hamiltonian"])
    symbols = sorted(h.free_symbols, key=str)
    point = {s: sp.Rational(7 * k + 3, 11 + k) for k, s in enumerate(symbols)}
    for row in report["canonical"]:
        q, p = sp.Symbol(row["coordinate"]), sp.Symbol(row["momentum"])
        for name, slope in ((row["coordinate"], h.diff(p)), (row["momentum"], -h.diff(q))):
            assert abs((rates[name] - slope).subs(point).evalf(30)) < 1e-25


def test_dissipation_and_inputs_enter_the_rates():
    text = """
name: cart
parameters: {m: 2, c: 0.5, k: 3}
particles: {cart: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
inputs: {u: sin(t)}
potentials: {spring: k*x^2/2}
dissipation: {drag: c*dot(x)^2/2}
forces: {push: {on: cart, force: [u, 0, 0]}}
initial: {x: 0, dot(x): 0}
"""
    row = api.loads(text).derive().report(form="hamiltonian")["canonical"][0]
    assert sp.simplify(read_back(row["rate"]) - read_back("u - k*x - c*p_x/m")) == 0


def test_closures_and_contacts_push_the_momenta():
    scene = SYSTEMS / "constraints" / "pendulum_in_cartesian_coordinates.yaml"
    rows = api.load(scene).derive().report(form="hamiltonian")["canonical"]
    rates = {row["coordinate"]: read_back(row["rate"]) for row in rows}
    assert rates["x"] == read_back("2*lambda_rod*x")
    assert rates["z"] == read_back("2*lambda_rod*z - m*g")


def test_nonholonomic_constraints_push_along_their_gradient():
    scene = SYSTEMS / "rolling" / "knife_edge_on_incline.yaml"
    rows = api.load(scene).derive().report(form="hamiltonian")["canonical"]
    rates = {row["coordinate"]: read_back(row["rate"]) for row in rows}
    assert rates["y"] == read_back("-lambda_edge*cos(phi)")


@pytest.mark.slow
def test_large_blocks_keep_their_velocities():
    """H of the triple pendulum, with the velocities that the momenta determine, is T + V."""
    derivation = api.load(SYSTEMS / "pendulums" / "triple_pendulum.yaml").derive()
    report = derivation.report(form="hamiltonian")
    assert [row["velocity"] for row in report["canonical"]] == [None] * 3
    h = read_back(report["hamiltonian"])
    definitions = {
        sp.Symbol(r["momentum"]): read_back(r["definition"]) for r in report["canonical"]
    }
    energy = read_back(report["kinetic"]) + read_back(report["potential"])
    difference = h.subs(definitions) - energy
    point = {
        s: sp.Rational(5 * k + 2, 7 + k) for k, s in enumerate(sorted(h.free_symbols, key=str))
    }
    point |= {s: sp.Rational(1, 3) for s in difference.free_symbols - set(point)}
    assert abs(difference.subs(point).evalf(30)) < 1e-25
    assert "which they determine as a linear" in derivation.text(form="hamiltonian")


def test_two_relativistic_particles_have_a_root_each():
    text = """
name: two
parameters: {m: {value: 2, positive: true}, c: {value: 3, positive: true}, k: 1}
coordinates: [x, y]
kinetic:
  first: -m*c^2*sqrt(1 - dot(x)^2/c^2)
  second: -m*c^2*sqrt(1 - dot(y)^2/c^2)
potentials: {spring: k*(x - y)^2/2}
initial: {x: 0, y: 1, dot(x): 0, dot(y): 0}
"""
    h = read_back(api.loads(text).derive().report(form="hamiltonian")["hamiltonian"])
    expected = read_back("sqrt(m^2*c^4 + c^2*p_x^2) + sqrt(m^2*c^4 + c^2*p_y^2) + k*(x - y)^2/2")
    point = {s: sp.Rational(3 * k + 1, 4) for k, s in enumerate(sorted(h.free_symbols, key=str))}
    assert abs((h - expected).subs(point).evalf(30)) < 1e-25


def test_names_of_momenta_keep_clear_of_the_scenes():
    text = """
name: clash
parameters: {m: 2, p_x: 3}
particles: {ball: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {pull: p_x*x}
initial: {x: 0, dot(x): 0}
"""
    report = api.loads(text).derive().report(form="hamiltonian")
    assert report["momenta"] == ["P_x"]
    assert read_back(report["hamiltonian"]) == read_back("P_x^2/(2*m) + p_x*x")


def test_kinetic_terms_of_other_kinds_are_refused():
    text = """
name: quartic
parameters: {a: {value: 1, positive: true}}
coordinates: [x]
kinetic: {odd: a*dot(x)^2/2 + a*dot(x)^4/4}
initial: {x: 0, dot(x): 1}
"""
    equations = api.loads(text).derive().equations
    with pytest.raises(InputError, match="neither quadratic in the velocities of 'x'") as caught:
        hamiltonian_form(equations)
    assert caught.value.problems[0].mark is not None


@pytest.mark.slow
def test_singular_mass_matrices_are_refused_at_the_coordinate():
    equations = api.load(SYSTEMS / "constraints" / "four_bar_linkage.yaml").derive().equations
    with pytest.raises(InputError, match="the momenta of 'beta' do not determine") as caught:
        hamiltonian_form(equations)
    assert caught.value.problems[0].mark.line == 22


def test_equations_that_are_made_wrong_are_not_shown():
    """The rates come from L: another forcing than the certified one is noticed."""
    equations = api.load(SYSTEMS / "pendulums" / "pendulum.yaml").derive().equations
    wrong = changed(
        equations, forcing=(equations.system.forcing[0] * (1 + sp.Rational(1, 10**20)),)
    )
    with pytest.raises(InternalError, match="Hamilton's form disagrees"):
        hamiltonian_form(wrong)
    wrong = changed(
        equations, kinetic=2 * equations.system.kinetic + equations.system.coordinates[0].q
    )
    with pytest.raises(InternalError, match="Hamilton's form disagrees"):
        hamiltonian_form(wrong)


@pytest.mark.slow
@sliced(sorted(SYSTEMS.glob("*/*.yaml")), argument="path")
def test_every_scene_has_the_form_or_a_reason(path):
    form, reason = None, "no-hamiltonian"
    with contextlib.suppress(InputError):
        derivation = api.load(path).derive(cache=open_cache())
        try:
            form = hamiltonian_form(derivation.equations)
        except InputError as refusal:
            reason = refusal.problems[0].rule
    assert reason == "no-hamiltonian"
    if form is not None:
        assert form.certificate.mismatch < 1e-25
        assert derivation.text(form="hamiltonian", ascii=True)
        assert derivation.emit("markdown", form="hamiltonian")
