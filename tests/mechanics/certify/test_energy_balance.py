"""The rate of an energy that is not conserved, against formulas worked out by hand."""

from __future__ import annotations

import pytest
import sympy as sp

from lagrange_cli import loads
from lagrange_cli.errors import InternalError
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.report.writers.latex.document import latex_document
from tests.parts import changed

MASS = "name: s\nplane: xz\nparameters: {m: 2, k: 3, c: 0.5, A: 1, w: 2}\n"
BOB = MASS + "particles: {bob: {mass: m, position: [x, y, z]}}\n"
FREE = BOB + "coordinates: [x, z]\npotentials: {spring: k*(x^2 + z^2)/2}\n"

#: Scene → kind and rate of its energy, over coordinates, velocities, parameters and t.
RATES = {
    "Rayleigh": (FREE + "dissipation: {drag: c*dot(x)^2/2}\n", "energy", "-c*x_**2"),
    "Rayleigh beside a force": (
        FREE + "dissipation: {drag: c*dot(x)^2/2}\n"
        "forces: {push: {on: bob, force: [A*cos(w*t), 0, 0]}}\n",
        "energy",
        "A*cos(w*t)*x_ - c*x_**2",
    ),
    "cubic drag": (FREE + "dissipation: {drag: c*abs(dot(x))^3/3}\n", "energy", "-c*Abs(x_)**3"),
    "potential in t": (
        BOB + "coordinates: [x, z]\npotentials: {spring: k*(x - A*sin(w*t))^2/2}\n",
        "energy",
        "-k*(x - A*sin(w*t))*A*w*cos(w*t)",
    ),
    "support that moves": (
        BOB
        + "coordinates: [u]\ndefinitions: {x: u + A*t^2, z: 0}\npotentials: {spring: k*u^2/2}\n",
        "jacobi",
        "-2*m*A*u_ - 4*m*A**2*t",
    ),
    "closure that moves": (
        BOB + "constraints: {rod: (x - A*t^2)^2 + z^2 = 1}\n",
        "energy",
        "2*(x - A*t**2)*2*A*t*lambda_rod",
    ),
    "wheel of 1e114 metres, which turns by 1e-114 of what it rolls": (
        "name: s\nplane: xy\nparameters: {m: 2, l: 1e114, F: 3}\n"
        "particles: {b: {mass: m, position: [x, x/2, 0]}}\nkinetic: {turn: m*l^2*dot(a)^2/4}\n"
        "coordinates: [x, a]\nconstraints: {roll: dot(x) = l*dot(a)}\n"
        "forces: {push: {on: b, force: [F*x, 0, 0]}, wind: {on: a, force: F}}\n",
        "energy",
        "F*x*x_ + F*a_",
    ),
    "sines of an angle of 1e100, which few digits do not tell apart": (
        MASS + "particles:\n"
        "  b1: {mass: m, position: [sin(q1), 0, -cos(q1)]}\n"
        "  b2: {mass: m, position: [sin(q1) + sin(q2), 0, -cos(q1) - cos(q2)]}\n"
        "coordinates: [q1, q2]\npotentials: {wave: sin(k*q2)}\ninitial: {q1: 0.3, q2: 1e100}\n"
        "forces: {push: {on: q1, force: q1}}\n",
        "energy",
        "q1*q1_",
    ),
    "contact that moves": (
        BOB + "constraints: {floor: z >= A*t}\n",
        "energy",
        "A*lambda_floor",
    ),
}


def formula(equations, text: str) -> sp.Expr:
    names = {p.name: p.symbol for p in equations.system.parameters} | {"t": equations.system.t}
    for c in equations.system.coordinates:
        names |= {c.name: c.q, f"{c.name}_": c.v}
    names |= {k.multiplier.name: k.multiplier for k in equations.system.pushing}
    return sp.sympify(text, names)


@pytest.mark.parametrize("name", RATES)
def test_rates(name: str) -> None:
    scene, kind, rate = RATES[name]
    equations = loads(scene).derive().equations
    assert equations.derivation.balance is not None
    assert equations.derivation.balance.kind == kind
    assert equations.derivation.balance.is_dissipation == (name == "Rayleigh")
    assert sp.simplify(equations.derivation.balance.rate - formula(equations, rate)) == 0
    report = derivation_report(equations)
    assert "energy" not in [c["name"] for c in report["conserved"]]
    assert report["energy_balance"]["name"] == kind
    text = derivation_text(equations)
    assert ("dE/dt = -2 D\n" in text) == (name == "Rayleigh")
    assert "d" + ("E" if kind == "energy" else "h") + "/dt = " in text
    assert ("Energy between impacts\n" in text) == ("contact" in name)
    (document,) = loads(scene).derive().emit("latex").values()
    assert ("= -2 D" in document) == (name == "Rayleigh")
    assert r"\section*{Energy}" in document


@pytest.mark.parametrize(
    "scene",
    [
        FREE,
        FREE + "inputs: {u: 2}\nforces: {push: {on: bob, force: [0, u, 0]}}\n",
        BOB + "coordinates: [x, z]\ninputs: {u: sin(t)}\npotentials: {spring: k*(x - u)^2/2}\n",
    ],
    ids=["conserved", "without work", "rate of an input"],
)
def test_no_rate(scene: str) -> None:
    assert loads(scene).derive().equations.derivation.balance is None


def test_a_wrong_rate_is_a_defect(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, _, _ = RATES["Rayleigh beside a force"]
    slightly_wrong = sp.Rational(10**20 + 1, 10**20)
    monkeypatch.setattr(
        "lagrange_cli.mechanics.energy_balance.shortened", lambda rate: rate * slightly_wrong
    )
    with pytest.raises(InternalError, match="rate of the energy"):
        loads(scene).derive().equations.derivation.textbook()


def test_what_was_not_searched_is_not_denied() -> None:
    """The angular momentum of a plane oscillator is conserved, and is no cyclic momentum here."""
    equations = loads(FREE + "dissipation: {drag: c*dot(x)^2/2}\n").derive().equations
    assert (
        "Conserved   No cyclic momentum is conserved, and neither is the energy.\n"
        in derivation_text(equations)
    )
    assert "Conserved among cyclic momenta and energy\n  E = " in derivation_text(
        loads(FREE).derive().equations
    )
    doubtful = changed(equations, open_questions=("x", "p_x", "energy"))
    assert "\n  Of p_x, E this is not decided.\n" in derivation_text(doubtful)
    assert derivation_report(doubtful)["undecided"] == ["p_x", "energy"]
    assert "Of $p_{x}$, $E$ this is not decided." in latex_document(doubtful)
    (document,) = loads(FREE).derive().emit("latex").values()
    assert "Among cyclic momenta and energy: $L$ does not depend on $t$" in document
