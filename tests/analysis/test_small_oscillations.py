"""Small oscillations: against SymPy's expansions, NumPy's eigenvalues, and small motions."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import eigh

from lagrange_cli import api
from lagrange_cli.errors import InputError
from tests.analysis.form_motions import numbers, read_back
from tests.cli.terminal import lagrange
from tests.systems.shipped import SYSTEMS

SCENES = [
    "pendulums/double_pendulum",
    "pendulums/pendulum_on_cart",
    "oscillators/coupled_oscillators",
    "oscillators/wilberforce_pendulum",
    "beads/bead_on_rotating_hoop",
    "pendulums/triple_pendulum",
    "oscillators/calogero_moser",
    "constraints/four_bar_linkage",
]


@cache
def reported(scene):
    derivation = api.load(SYSTEMS / f"{scene}.yaml").derive()
    report = derivation.report(form="small-oscillations")
    return derivation, report, report["small_oscillations"]


def at_values(derivation, text):
    known = {sp.Symbol(p.name): p.value for p in derivation.equations.system.parameters}
    return read_back(text).subs(known)


def matrix(derivation, rows):
    return np.array([[float(at_values(derivation, e)) for e in row] for row in rows])


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES[:6])
def test_energies_are_taylors(scene):
    """T and −(L at rest) of the report, expanded by SymPy to second order about the equilibrium."""
    derivation, report, form = reported(scene)
    names = list(form["at"])
    small = sp.Symbol("small")
    places, moved = {}, {}
    for name, shown in zip(names, form["displacements"], strict=True):
        x, v = sp.Symbol(shown), sp.Symbol(f"dot_{shown}")
        places[sp.Symbol(name)] = at_values(derivation, form["at"][name]) + small * x
        moved[sp.Symbol(f"dot_{name}")] = small * v
    lagrangian = at_values(derivation, report["lagrangian"]).subs(moved | places, simultaneous=True)
    second = sp.diff(lagrangian, small, 2).subs(small, 0) / 2
    expected = at_values(derivation, form["kinetic"]) - at_values(derivation, form["potential"])
    difference = sp.expand(sp.nsimplify(sp.expand(second - expected), rational=False))
    coefficients = (
        sp.Poly(difference, *sorted(difference.free_symbols, key=str)).coeffs()
        if (difference.free_symbols)
        else [difference]
    )
    assert max(abs(float(c)) for c in coefficients) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_modes_diagonalize_both_matrices(scene):
    derivation, _, form = reported(scene)
    mass, stiff = (matrix(derivation, form[name]) for name in "MK")
    squares = [float(at_values(derivation, mode["square"])) for mode in form["modes"]]
    assert np.allclose(squares, eigh(stiff, mass, eigvals_only=True), atol=1e-9)
    assert np.allclose(np.sqrt(squares), [mode["frequency"] for mode in form["modes"]], atol=1e-9)
    shapes = np.array(
        [[float(at_values(derivation, x)) for x in mode["shape"]] for mode in form["modes"]]
    ).T
    scale = np.abs(mass).max()
    inner = shapes.T @ mass @ shapes
    assert np.abs(inner - np.diag(np.diag(inner))).max() < 1e-9 * scale
    for w2, shape in zip(squares, shapes.T, strict=True):
        assert np.abs((stiff - w2 * mass) @ shape).max() < 1e-9 * np.abs(stiff).max()


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_rows_are_those_of_the_matrices(scene):
    """Each printed row is M ẍ + C ẋ + K x up to a factor."""
    derivation, _, form = reported(scene)
    names = form["displacements"]
    generator = np.random.default_rng(4)
    x, v, a = generator.uniform(-1, 1, (3, len(names)))
    whole = sum(matrix(derivation, form[n]) @ y for n, y in zip("KCM", (x, v, a), strict=True))
    at = {}
    for k, name in enumerate(names):
        at |= {sp.Symbol(f"{d}{name}"): y[k] for d, y in (("", x), ("dot_", v), ("ddot_", a))}
    rows = [at_values(derivation, row["residual"]) for row in form["equations"]]
    sums = np.array([float(row.subs(at)) for row in rows])
    factors = whole / sums
    at2 = {symbol: 2 * value + 0.1 for symbol, value in at.items()}
    again = sum(
        matrix(derivation, form[n]) @ (2 * y + 0.1) for n, y in zip("KCM", (x, v, a), strict=True)
    )
    assert np.allclose(factors * [float(row.subs(at2)) for row in rows], again, rtol=1e-9)


@pytest.mark.slow
def test_a_linkage_swings_with_the_frequency_of_its_mode():
    derivation, _, form = reported("constraints/four_bar_linkage")
    (mode,) = form["modes"]
    rest = derivation.analyze("linearization").linearization.at.position
    names = [c.name for c in derivation.equations.system.coordinates]
    at = {name: float(x) for name, x in zip(names, rest, strict=True)}
    moving = derivation.analyze("linearization").linearization.state_space
    assert moving.states == ("alpha", "dot(alpha)")
    speed = 1e-4
    rates = dict.fromkeys((f"dot({name})" for name in names), 0.0)
    a, b, c = (
        next(p.value for p in derivation.equations.system.parameters if p.name == n) for n in "abc"
    )
    follow = np.linalg.solve(
        [[-b * np.sin(at["beta"]), c * np.sin(at["gamma"])],
         [b * np.cos(at["beta"]), -c * np.cos(at["gamma"])]],
        [a * np.sin(at["alpha"]) * speed, -a * np.cos(at["alpha"]) * speed],
    )  # fmt: skip
    rates |= {"dot(alpha)": speed, "dot(beta)": follow[0], "dot(gamma)": follow[1]}
    period = 2 * np.pi / mode["frequency"]
    motion = derivation.simulate(until=period, accuracy=1e-9, initial=at | rates)
    assert motion.state["dot(alpha)"] == pytest.approx(speed, rel=1e-4)


def test_damping_gives_poles_in_place_of_modes():
    _, _, form = reported("oscillators/damped_oscillator")
    assert form["modes"] == []
    ((real, imaginary),) = form["poles"]
    values = numbers(api.load(SYSTEMS / "oscillators/damped_oscillator.yaml").derive())
    roots = np.roots([values["m"], values["c"], values["k"]])
    assert real == pytest.approx(roots[0].real)
    assert imaginary == pytest.approx(abs(roots[0].imag))


@pytest.mark.slow
def test_text_and_documents():
    derivation = api.load(SYSTEMS / "oscillators/coupled_oscillators.yaml").derive()
    text = derivation.text(form="small-oscillations")
    assert "V = ½ (k + k2) x1² - k2 x1 x2 + ½ (k + k2) x2²" in text
    assert "ω_2² = (k + 2 k2) / m" in text
    assert "x2 = Q_1 - Q_2" in text
    for to in ("latex", "markdown", "typst", "html"):
        for words in ("en", "de", "fr"):
            (written,) = derivation.emit(to, form="small-oscillations", language=words).values()
            heading = {"en": "Small osc", "de": "Kleine Schw", "fr": "Petites osc"}[words]
            assert heading in written


def test_names_that_the_scene_has_are_avoided():
    text = """
name: s
parameters: {omega_1: 3, Q_1: 2, eta_x: 1}
coordinates: [x]
kinetic: {T: Q_1*dot(x)^2/2}
potentials: {V: Q_1*omega_1^2*(x - eta_x)^2/2}
initial: {x: 0.5, dot(x): 0}
"""
    derivation = api.loads(text).derive()
    shown = derivation.text(form="small-oscillations")
    assert "x = η_x + ξ_x" in shown
    assert "Ω_1² = ω_1²" in shown
    assert "ξ_x = ζ_1" in shown


FREE = """
name: s
particles: {ball: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {V: -x^2}
initial: {x: 0.5, dot(x): 0}
"""


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (FREE, "no equilibrium that was found is stable"),
        (FREE.replace("-x^2", "x"), "equilibri"),
        (FREE.replace("-x^2", "x*t"), "depend on t"),
    ],
)
def test_without_a_stable_equilibrium_it_is_refused(text, message, tmp_path):
    with pytest.raises(InputError, match=message):
        api.loads(text).derive().report(form="small-oscillations")
    scene = tmp_path / "s.yaml"
    scene.write_text(text)
    done = lagrange("derive", str(scene), "--form", "small-oscillations")
    assert done.returncode == 2
    assert message in done.stderr
    assert "s.yaml:" in done.stderr


@pytest.mark.slow
def test_json_from_the_command_line():
    scene = str(SYSTEMS / "pendulums" / "double_pendulum.yaml")
    done = lagrange("derive", scene, "--form", "small-oscillations", "--json")
    assert json.loads(done.stdout)["small_oscillations"]["displacements"] == ["theta1", "theta2"]


def test_inertia_may_vary_along_a_line_of_equilibria():
    """Closed forms hold the coordinate, and are compared with numbers at the start."""
    *_, form = reported("sliding/trammel")
    assert form["at"] == {"x": "x"}
    assert form["M"] == [["-m*l^2/((x - l)*(l + x))"]]
    assert form["modes"][0]["square"] == "0"
