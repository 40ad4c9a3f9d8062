"""Documents of analyses: matrices read back out of them, and modes that solve what they say."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli import InputError, load, loads
from tests.emit.test_documents import log_of, sticking_out
from tests.notation.formula_readers import TypstReader

SYSTEMS = Path(__file__).resolve().parents[2] / "systems"


def analysis(name, *parts, **given):
    return load(SYSTEMS / f"{name}.yaml").derive().analyze(*parts, **given)


def numbers(text):
    """A matrix of numbers, or None if it holds anything else."""
    rows = [row.split(" & ") for row in re.split(r" \\\\(?:\[0.5em\])? ", text.strip())]
    try:
        return np.array([[float(cell) for cell in row] for row in rows])
    except ValueError:
        return None


def matrices(latex, letter):
    """The matrices that LaTeX equates a bold letter to, in numbers where they are."""
    lines = latex.partition(rf"\mathbf{{{letter}}} & =")[2].partition("label")[0]
    found = re.findall(r"\\begin\{pmatrix\}(.*?)\\end\{pmatrix\}", lines, re.S)
    return [numbers(body) for body in found]


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"width": "column"}, {"style": "beamer"}])
def test_matrices_of_latex_are_those_of_the_analysis(options):
    found = analysis("pendulums/double_pendulum")
    (text,) = found.emit("latex", **options).values()
    linear = found.linearization
    for letter, expected in (("M", linear.mass), ("K", linear.stiffness)):
        closed, numeric = matrices(text, letter)
        assert closed is None
        assert numeric == pytest.approx(expected, rel=1e-5)
    assert r"\mathbf{C} & = \mathbf{0}" in text


def typst_rows(text, letter):
    """The cells of the first matrix that Typst equates a bold letter to."""
    body = text.partition(f"upright(bold({letter})) & = mat(")[2]
    depth, end = 1, 0
    while depth:
        depth += {"(": 1, ")": -1}.get(body[end], 0)
        end += 1
    return [row.split(", ") for row in body[: end - 1].split("; ")]


def test_closed_forms_of_typst_have_the_values_of_the_analysis():
    found = analysis("pendulums/double_pendulum", "linearization")
    (text,) = found.emit("typst").values()
    values = {"m_1": 1.0, "m_2": 1.0, "l_1": 1.0, "l_2": 1.0, "g": 9.81}
    linear = found.linearization
    for letter, expected in (("M", linear.mass), ("K", linear.stiffness)):
        cells = typst_rows(text, letter)
        read = [[TypstReader(cell, values).read() for cell in row] for row in cells]
        assert np.array(read) == pytest.approx(expected)


def test_columns_of_modes_solve_the_equations_beside_them():
    (text,) = analysis("pendulums/double_pendulum").emit("latex").values()
    mass, stiffness = (matrices(text, letter)[-1] for letter in "MK")
    shapes = numbers(re.search(r"boldsymbol\{\\Phi\} = \\begin\{pmatrix\}(.*?)\\end", text)[1])
    frequencies = [float(x) for x in re.findall(r"\\omega_\{\d\} & = ([\d.]+) ", text)]
    assert len(frequencies) == 2
    for shape, frequency in zip(shapes.T, frequencies, strict=True):
        assert stiffness @ shape == pytest.approx(frequency**2 * mass @ shape, rel=1e-4)
        assert max(abs(shape)) == 1


def test_a_matrix_of_one_entry_is_a_number():
    (text,) = analysis("beads/bead_on_rotating_hoop").emit("latex").values()
    assert r"\mathbf{M} & = m R^{2} = 0.0045" in text
    # The scene's rate is the letter that frequencies usually have.
    value = re.search(r"\\Omega_\{1\} = (.*?) = ([\d.]+)", text)
    assert float(value[2]) == pytest.approx(6.87694, rel=1e-5)


def test_poles_are_complex():
    (text,) = analysis("oscillators/damped_oscillator").emit("latex").values()
    assert r"s_{1} = -0.6 + 6.29603 \, \mathrm{i}" in text
    (text,) = analysis("oscillators/damped_oscillator").emit("typst").values()
    assert "s_1 & = -0.6 + 6.29603 thin upright(i)" in text


def test_a_vector_of_one_component_has_both_parentheses():
    (text,) = analysis("oscillators/seismometer", "linearization").emit("latex").values()
    assert r"\mathbf{u} & = (a) \\" in text


@pytest.mark.slow
def test_conditions_and_conserved_quantities_are_said():
    (text,) = analysis("beads/bead_on_rotating_hoop").emit("markdown").values()
    assert r"where $\left| g \right| \le R \omega^{2}$: stable ($\mathbf{K}$ is positive" in text
    (text,) = analysis("celestial/two_bodies").emit("markdown").values()
    assert "rotation around $z$, so $L_{z}$ is conserved" in text
    assert r"P_{x} & = m_{1} \dot{x}_{1} + m_{2} \dot{x}_{2}" in text


def test_rates_of_inputs_have_dots() -> None:
    (text,) = analysis("pendulums/hoist", "linearization").emit("latex").values()
    assert r"(l, \dot{l}, \ddot{l})" in text


def test_steady_motions_have_rates_or_momenta():
    found = analysis("lecture/masses_through_hole", at={"dot(theta)": 3}, steady=True)
    (text,) = found.emit("markdown").values()
    assert "## Steady motions\n\nMotions are steady where:\n" in text
    assert r"M r \dot{\theta}^{2} - m g & = 0" in text
    assert "\nWith $\\dot{\\theta} = 3$:" in text
    assert r"$p_{\theta} = \frac{m^{2} g^{2}}{M \dot{\theta}^{3}} = 1.78215$: stable" in text
    assert r"\mathbf{K} & = 3 M \dot{\theta}^{2} = 54" in text


ROW_OF_SPRINGS = """
    sizes: {n: 12}
    parameters: {m: 1, k: 2}
    coordinates: ["u[i=1..n]"]
    definitions: {"u[0]": 0, "u[n+1]": 0}
    kinetic: {masses: "sum(m*dot(u[i])^2/2, i=1..n)"}
    potentials: {springs: "sum(k*(u[i+1] - u[i])^2/2, i=0..n)"}
"""


@pytest.mark.slow
def test_what_does_not_fit_is_left_to_json():
    found = loads(ROW_OF_SPRINGS.replace("n: 12", "n: 8"), file="row.yaml").derive()
    (text,) = found.analyze("linearization").emit("latex", style="beamer").values()
    assert r"$\mathbf{A}$ has 16 rows and 16 columns; JSON holds it." in text
    assert "pmatrix" not in text.partition("State space")[2]


@pytest.mark.slow
@pytest.mark.latex
@pytest.mark.parametrize("options", [{}, {"width": "column"}, {"style": "beamer"}])
def test_a_matrix_of_twelve_columns_and_a_vector_of_twenty_four_fit(options, tmp_path):
    """More columns than ``pmatrix`` has, and more components than a line."""
    found = loads(ROW_OF_SPRINGS, file="row.yaml").derive().analyze("linearization")
    (text,) = found.emit("latex", **options).values()
    assert ("{cccccccccccc}" in text) == ("width" not in options)
    assert r"\mathbf{x} & = (u_{1}," in text
    assert max(sticking_out(log_of(tmp_path, text)), default=0) < 5


def test_a_wide_matrix_comes_in_groups_of_columns_in_a_terminal():
    found = loads(ROW_OF_SPRINGS.replace("n: 12", "n: 8"), file="row.yaml").derive()
    analysis = found.analyze("modes")
    text = analysis.text().partition("largest amplitude 1:\n")[2]
    lines = text.partition("\n\n")[0].rstrip().split("\n")
    assert [line.split(" = ")[0].strip() for line in lines[::8]] == ["Φ[1..8,1..6]", "Φ[1..8,7..8]"]
    assert max(map(len, lines)) <= 80
    rows = [[float(x) for x in line.partition(" = ")[2].split() or line.split()] for line in lines]
    shapes = np.hstack([rows[:8], rows[8:]])
    assert shapes == pytest.approx(np.array([m.shape for m in analysis.modes]).T, rel=1e-5)


def test_sections_are_those_that_were_asked_for():
    (text,) = analysis("pendulums/pendulum", "equilibria").emit("markdown").values()
    headings = [line[3:] for line in text.splitlines() if line.startswith("## ")]
    assert headings == ["Equilibria"]


def test_no_text_of_a_scene_is_markup():
    text = """
        title: "$\\\\input{x}$ \\\\input{a}"
        parameters: {k: {value: 4, latex: '\\kappa'}}
        particles: {p: {mass: 1, position: [x, 0, 0]}}
        coordinates: [x]
        potentials: {s: k/2*x^2}
    """
    from lagrange_cli import loads

    found = loads(text, file="it.yaml").derive().analyze()
    (shown,) = found.emit("latex").values()
    assert r"\$\textbackslash{}input\{x\}\$ \textbackslash{}input" in shown
    assert r"\mathbf{K} & = {\kappa} = 4" in shown
    assert math.isclose(found.modes[0].frequency, 2)


def test_unknown_formats_are_refused():
    found = analysis("pendulums/pendulum", "modes")
    with pytest.raises(InputError, match="an analysis has no format 'c'; there are latex, markdow"):
        found.emit("c")
