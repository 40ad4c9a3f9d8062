"""The terminal text: the lecture's page exactly, wording, widths, hostile titles."""

from dataclasses import replace
from functools import cache

import pytest
import sympy

from lagrange_cli import loads
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.findings import Conserved, ConstraintLine
from lagrange_cli.notation.layout import FACTOR_DEPTH, Piece, break_lines, columns, joined
from lagrange_cli.notation.page import USUAL_WIDTH
from lagrange_cli.notation.symbols import latex_name, text_name
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.writers.latex.document import latex_document
from lagrange_cli.scene import read_text
from tests.emit.emit_scenes import (
    HALF,
    bead_on_parabola,
    build,
    chain_pendulum,
    coordinates,
    damped_driven,
    masses_through_hole,
    parameters,
)
from tests.parts import changed

PAGE = """\
masses_through_hole: Mass on a table tied through a hole to a hanging mass

Degrees of freedom   3N = 6, K = 4, DOF = 2
  table   z1 = 0
  plumb   x2 = 0, y2 = 0
  rope    r - z2 = l
  (all)   holonomic, scleronomic
Coordinates   r, θ        x1 = r cos θ   y1 = r sin θ   z2 = r - l

T = ½ M (ṙ² + r² θ̇²) + ½ m ṙ²
V = m g (r - l)

Equations of motion
  r   (M + m) r̈ - M r θ̇² + m g = 0
  θ   M r² θ̈ + 2 M r ṙ θ̇ = 0

Conserved among cyclic momenta and energy
  p_θ = M r² θ̇     θ is cyclic
  E = T + V        L does not depend on t

Certified at 8 random states to 30 digits, largest mismatch 3e-31
"""

ASCII_PAGE = """\
bead_on_parabola: Bead sliding on a parabola

Degrees of freedom   3N = 3, K = 2, DOF = 1
  plane   y = 0
  wire    z = a*x^2
  (all)   holonomic, scleronomic
Coordinates   x        z = a*x^2

T = 1/2*m*(1 + 4*a^2*x^2)*dot(x)^2
V = m*g*a*x^2

Equations of motion
  x   (1 + 4*a^2*x^2)*ddot(x) + 4*a^2*x*dot(x)^2 + 2*a*g*x = 0   (divided by m)

Conserved among cyclic momenta and energy
  E = T + V     L does not depend on t

Certified at 8 random states to 30 digits, largest mismatch 3e-31
"""


def test_masses_through_hole():
    assert derivation_text(masses_through_hole()) == PAGE


def test_bead_in_ascii():
    text = derivation_text(bead_on_parabola(), ascii=True)
    assert text == ASCII_PAGE
    assert text.isascii()


def test_explicit_form():
    text = derivation_text(masses_through_hole(), form="explicit")
    heading = "Equations of motion, solved for the accelerations\n"
    assert heading + "  r̈ = (M r θ̇² - m g) / (M + m)\n  θ̈ = -2 ṙ θ̇ / r\n" in text


def test_more_than_two_coupled_stay_a_linear_system():
    text = derivation_text(chain_pendulum(3), form="explicit")
    assert "Equations of motion, not solved for the accelerations, as a linear system\n" in text
    assert "  m3 l1 l3 θ̈1 cos(θ1 - θ3) + m3 l2 l3 θ̈2 cos(θ2 - θ3) + m3 l3² θ̈3\n    = " in text


@cache
def derived_chain(n):
    """The package's own derivation of the n-link pendulum."""
    links = range(1, n + 1)
    lines = ["name: chain", "plane: xz", "parameters:", "  g: 9.81"]
    lines += [f"  {letter}{i}: 1.0" for letter in "ml" for i in links]
    lines += [
        "particles:",
        *(f"  b{i}: {{mass: m{i}, position: [x{i}, y{i}, z{i}]}}" for i in links),
    ]
    lines += [f"coordinates: [{', '.join(f'theta{i}' for i in links)}]", "definitions:"]
    for i in links:
        before = [f"{'xz'[k]}{i - 1} " if i > 1 else "" for k in (0, 1)]
        lines.append(f"  x{i}: {before[0] + '+ ' if i > 1 else ''}l{i}*sin(theta{i})")
        lines.append(f"  z{i}: {before[1]}-l{i}*cos(theta{i})")
    lines += ["potentials:", "  weight: {gravity: g}"]
    return derive(read_text("\n".join(lines) + "\n"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "ascii_only", "form"),
    [
        (6, False, "explicit"),
        (6, True, "lagrange"),
        (10, False, "lagrange"),
        (10, True, "explicit"),
    ],
)
def test_long_systems_keep_the_width(n, ascii_only, form):
    text = derivation_text(derived_chain(n), ascii=ascii_only, form=form)
    widths = [columns(line) for line in text.splitlines()]
    assert max(widths) <= USUAL_WIDTH
    assert len(widths) > 5 * n
    assert all(line == line.rstrip() for line in text.splitlines())


def test_account_wording():
    masses = masses_through_hole()
    account = replace(
        masses.derivation.account,
        extra=1,
        implied=2,
        chosen_automatically=True,
        lines=(
            ConstraintLine("rod", ("x^2 + z^2 = l^2",), "satisfied"),
            ConstraintLine("again", ("z1 = 0",), "redundant", ("table", "rope")),
            ConstraintLine("drive", ("x = A*cos(t)",), "independent", (), True),
        ),
    )
    text = derivation_text(changed(masses, account=account))
    assert "Degrees of freedom   3N = 6, 1 further coordinate, K = 4, DOF = 2\n" in text
    assert "Coordinates   r, θ   (chosen automatically)" in text
    text = " ".join(text.split())
    assert "rod x² + z² = l² (satisfied by the definitions; holonomic, scleronomic)" in text
    assert "again z1 = 0 (redundant, implied by table, rope; holonomic, scleronomic)" in text
    assert "drive x = A cos t (holonomic, rheonomic)" in text
    assert "(implied) 2 constraints built into the positions; holonomic, scleronomic" in text


def test_forces_and_dissipation():
    text = derivation_text(damped_driven())
    assert "D = ½ c ẋ²\n" in text
    assert "Generalized forces\n  Q_x = A t     push on x\n" in text
    assert "Conserved   No cyclic momentum is conserved, and neither is the energy.\n" in text


def test_generalized_potential_is_called_u():
    given = parameters(m=1.0, q=1.0, B=1.0)
    m, charge, field = (p.symbol for p in given)
    chosen = coordinates("x", "y")
    x, y = chosen
    kinetic = HALF * m * (x.v**2 + y.v**2)
    particle = build("charge", given, chosen, kinetic, charge * field * y.q * x.v)
    energy = Conserved("energy", "energy", kinetic, "L does not depend on t")
    text = derivation_text(changed(particle, conserved=(energy,)))
    assert "U = q B y ẋ\n" in text
    assert "  E = ½ m (ẋ² + ẏ²)     L does not depend on t\n" in text


def test_jacobi_integral_is_called_h():
    masses = masses_through_hole()
    r = masses.system.coordinates[0]
    h = Conserved("jacobi", "jacobi", r.v**2 - r.q**2, "L does not depend on t")
    assert "  h = ṙ² - r²     L does" in derivation_text(changed(masses, conserved=(h,)))


def test_quantities_make_way_for_the_scenes_own_letters():
    given = parameters(T=1.0, V=2.0, E=3.0)
    tension, volume, e = (p.symbol for p in given)
    chosen = coordinates("x")
    own = build("own", given, chosen, HALF * tension * chosen[0].v ** 2, volume * e * chosen[0].q)
    text = derivation_text(own)
    assert "T_kin = ½ T ẋ²\nV_pot = V E x\n" in text
    assert "E_tot = T_kin + V_pot" in text


def test_nothing_left_to_move():
    fixed = build("fixed", (), (), sympy.Integer(0), sympy.Integer(0))
    text = derivation_text(fixed)
    assert "  No coordinate is left: nothing can move.\n" in text
    assert "Equations of motion\n  There are none.\n" in text
    assert derivation_text(fixed, form="explicit").count("There are none.") == 1


@pytest.mark.parametrize("ascii_only", [False, True])
def test_hostile_text_is_escaped(ascii_only):
    hostile = changed(
        bead_on_parabola(),
        title="a\x1b[31mred\nnew \u202e line é",
        account=replace(
            bead_on_parabola().derivation.account,
            lines=(ConstraintLine("p", ("x = \x1b]0;own\x07",)),),
        ),
    )
    text = derivation_text(hostile, ascii=ascii_only)
    assert "\x1b" not in text
    assert "\u202e" not in text
    assert "\\x1b[31mred\\x0anew" in text
    assert text.isascii() == ascii_only


@pytest.mark.parametrize(
    ("name", "order", "text", "latex"),
    [
        ("r", 1, "ṙ", r"\dot{r}"),
        ("x", 2, "ẍ", r"\ddot{x}"),
        ("theta", 1, "θ̇", r"\dot{\theta}"),
        ("theta1", 2, "θ̈1", r"\ddot{\theta}_{1}"),
        ("theta_1", 0, "θ_1", r"\theta_{1}"),
        ("x[1]", 0, "x[1]", "x_{1}"),
        ("x[1,2]", 0, "x[1,2]", "x_{1,2}"),
        ("x_bob", 1, "ẋ_bob", r"\dot{x}_{\mathrm{bob}}"),
        ("p_theta1", 0, "p_θ1", r"p_{\theta_{1}}"),
        ("angle", 0, "angle", r"\mathrm{angle}"),
        ("angle", 1, "dot(angle)", r"\dot{\mathrm{angle}}"),
        ("lambda", 0, "λ", r"\lambda"),
        ("Omega0", 0, "Ω0", r"\Omega_{0}"),
        ("Alpha", 0, "Alpha", r"\mathrm{Alpha}"),
        ("E", 0, "E", "E"),
        ("I", 0, "I", "I"),
        ("_x", 0, "_x", r"\text{\_x}"),
        ("x__1", 0, "x__1", r"\text{x\_\_1}"),
        ("m1a", 0, "m1a", r"m_{\mathrm{1a}}"),
    ],
)
def test_names(name, order, text, latex):
    assert text_name(name, order) == text
    assert latex_name(name, order) == latex


def test_latex_override():
    assert latex_name("w", 1, r"\omega_{0}") == r"\dot{\omega}_{0}"
    assert latex_name("w", 0, r"\omega_{0}") == r"{\omega_{0}}"


def test_breaks_prefer_the_outermost_sum():
    pieces = [
        Piece("aaaa", 4),
        Piece("bbbb", 7, " + ", "+ ", 0),
        Piece("(cc", 6, " + ", "+ ", 0),
        Piece("dd)", 6, " + ", "+ ", 1),
        Piece("ee", 3, " ", "· ", FACTOR_DEPTH),
    ]
    assert joined(pieces) == "aaaa + bbbb + (cc + dd) ee"
    assert [line.text for line in break_lines(pieces, 100, 100)] == [joined(pieces)]
    assert [(line.text, line.level) for line in break_lines(pieces, 18, 18)] == [
        ("aaaa + bbbb", 0),
        ("+ (cc + dd) ee", 0),
    ]
    assert [line.text for line in break_lines(pieces, 12, 7)] == [
        "aaaa + bbbb",
        "+ (cc",
        "+ dd)",
        "· ee",
    ]
    whole = [Piece("x" * 50, 50), Piece("y", 4, " + ", "+ ", 0)]
    assert [line.text for line in break_lines(whole, 10, 10)] == ["x" * 50, "+ y"]


LETTERS = """
name: letters
parameters: {%s: 3, L: 1}
plane: xz
particles: {p: {mass: 1, position: [x, y, z]}, q: {mass: 1, position: [x2, y2, z2]}}
coordinates: [a, b, c]
definitions: {x: L*sin(a), z: -L*cos(a), x2: x + L*sin(b), z2: z - L*cos(b)}
kinetic: {coupling: (dot(a) + dot(b) + dot(c))^2}
potentials: {spring: %s*a^2}
"""


@pytest.mark.parametrize("letter", ["K", "N", "M", "f"])
def test_no_letter_has_two_meanings(letter):
    equations = loads(LETTERS % (letter, letter)).derive().equations
    text = derivation_text(equations, form="explicit", width=200)
    counts = "Degrees of freedom   3N = 6, 1 further coordinate, K = 4, DOF = 3\n"
    words = "Degrees of freedom   6 Cartesian coordinates, 1 further coordinate, 4 independent"
    assert (counts in text) == (letter in "Mf")
    assert (words in text) == (letter in "KN")
    assert "Lagrangian does not depend on t" in text
    document = latex_document(equations)
    written = "There are 6 Cartesian coordinates, 1 further coordinate, 4 independent constraints,"
    assert (written in document) == (letter in "KN")
    assert (r"\text{1 further coordinate}" in document) == (letter in "Mf")


def test_short_values_over_other_parameters_stand_as_the_scene_states_them():
    """Long ones, and values that are given on the way, stay numbers."""
    scene = """
parameters: {g: 9.81, l: {value: g/w^2, unit: m}, w: 2, c: {value: 1 + sqrt(g*l/w)/(2*w + l) + g}}
coordinates: [x]
kinetic: {T: c*dot(x)^2/2}
potentials: {V: g*l*x^2/2}
initial: {x: 1}
"""
    lines = [line.split() for line in loads(scene).derive(steps="lagrange").text().splitlines()]
    rows = {line[0]: " ".join(line[1:]) for line in lines if len(line) > 1}
    assert rows["l"] == "g / w² = 2.4525 m"
    assert any(line[:1] == ["c"] and float(line[1]) > 0 for line in lines if len(line) == 2)
    given = loads(scene, parameters={"l": 3}).derive(steps="lagrange").text()
    assert "g / w²" not in given
