"""The system of first order: its printed rates move as Lagrange's equations do."""

from __future__ import annotations

import pytest
import sympy as sp
from scipy.interpolate import CubicSpline

from lagrange_cli import api
from tests.analysis.form_motions import integrated, numbers, read_back
from tests.systems.shipped import SYSTEMS


@pytest.mark.parametrize(
    "scene",
    ["pendulums/double_pendulum", "pendulums/furuta_pendulum", "lecture/masses_through_hole"],
)
def test_rates_move_as_lagranges_equations_do(scene):
    derivation = api.load(SYSTEMS / f"{scene}.yaml").derive()
    form = derivation.report(form="first-order")["first_order"]
    assert form["coupled"] == []
    rates = {row["state"]: read_back(row["rate"]) for row in form["rates"]}
    values = numbers(derivation)
    values |= {v: values[f"dot_{name}"] for name, v in form["velocities"].items()}
    end = integrated(rates, values, 1.0)
    expected = derivation.simulate(until=1.0, accuracy=1e-10).state
    for name, velocity in form["velocities"].items():
        assert end[name] == pytest.approx(expected[name], rel=1e-7, abs=1e-8)
        assert end[velocity] == pytest.approx(expected[f"dot({name})"], rel=1e-6, abs=1e-7)


@pytest.mark.slow
def test_rows_that_are_not_solved_hold_along_the_motion():
    """With accelerations and multipliers of a simulation they vanish."""
    derivation = api.load(SYSTEMS / "constraints/four_bar_linkage.yaml").derive()
    form = derivation.report(form="first-order")["first_order"]
    assert [row["rate"] for row in form["rates"][3:]] == [None] * 3
    assert len(form["coupled"]) == 5
    motion = derivation.simulate(until=1.0, accuracy=1e-10, samples=2001)
    k = 700
    at = {sp.Symbol(n): x for n, x in numbers(derivation).items() if not n.startswith("dot_")}
    for name, velocity in form["velocities"].items():
        rate = CubicSpline(motion.t, motion.columns[f"dot({name})"]).derivative()(motion.t)
        at[sp.Symbol(name)] = motion.columns[name][k]
        at[sp.Symbol(velocity)] = motion.columns[f"dot({name})"][k]
        at[sp.Symbol(f"dot_{velocity}")] = rate[k]
    for name, values in motion.multipliers.items():
        at[sp.Symbol(motion.symbols[name])] = values[k]
    for row in form["coupled"]:
        terms = sp.Add.make_args(sp.expand(read_back(row)))
        size = sum(abs(float(term.subs(at))) for term in terms)
        assert abs(float(read_back(row).subs(at))) < 1e-6 * size


def test_multipliers_in_closed_form_are_among_them():
    derivation = api.load(SYSTEMS / "lecture/masses_through_hole.yaml").derive(
        formulation="multiplier"
    )
    form = derivation.report(form="first-order")["first_order"]
    assert [m["name"] for m in form["multipliers"]] == [
        closure.multiplier.name for closure in derivation.equations.system.closures
    ]
    assert "v_" in derivation.text(form="first-order")


def test_names_of_the_scene_are_avoided():
    text = """
name: s
parameters: {v_x: 3}
coordinates: [x]
kinetic: {T: dot(x)^2/2}
potentials: {V: v_x*x}
initial: {x: 0.5, dot(x): 0}
"""
    derivation = api.loads(text).derive()
    assert derivation.report(form="first-order")["first_order"]["velocities"] == {"x": "w_x"}
    assert "ẇ_x = -v_x" in derivation.text(form="first-order")


@pytest.mark.parametrize(("words", "heading"), [("de", "erster Ordnung"), ("fr", "premier ordre")])
def test_documents_in_other_languages(words, heading):
    derivation = api.load(SYSTEMS / "pendulums/pendulum.yaml").derive()
    for to in ("latex", "markdown", "typst", "html"):
        (written,) = derivation.emit(to, form="first-order", language=words).values()
        assert heading in written
