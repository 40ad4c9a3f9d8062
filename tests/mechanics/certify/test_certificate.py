"""A wrong derivation never passes its certificate, whatever is wrong with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import product
from types import SimpleNamespace

import pytest
import sympy as sp

from lagrange_cli import loads
from lagrange_cli.errors import InputError, InternalError
from lagrange_cli.mechanics import derive, derive_uncertified, reduce
from lagrange_cli.mechanics.certify.certificate import certify
from lagrange_cli.mechanics.certify.printed import certify_shown
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.dynamics.textbook_form import shown_equations
from lagrange_cli.scene import read_text
from tests.campaign import slice_of
from tests.mechanics.mechanics_support import DOUBLE_PENDULUM, derived

FORCED = (
    DOUBLE_PENDULUM + "forces:\n  wind: {on: lower, force: [3, 0, 1]}\n"
    "  motor: {on: theta1, force: sin(theta2)}\n"
    "dissipation: {hinge: dot(theta1)^2 + dot(theta2)^2}\n"
    "kinetic: {wheel: 0.5*(dot(theta1) - dot(theta2))^2}\n"
)

MAGNETIC = """
parameters: {m: 1, b: 2, k: 1}
plane: xy
particles: {ion: {mass: m, position: [x, y, z]}}
potentials:
  field: b*(y*dot(x) - x*dot(y))/2
  trap: k*(x^4 + y^2)
"""


@cache
def derivation(text: str = FORCED) -> Uncertified:
    return derive_uncertified(reduce(read_text("name: tested\n" + text)))


def require_caught(wrong: Uncertified, digits: int = 30) -> None:
    with pytest.raises(InternalError) as caught:
        certify(wrong, digits, 3)
    assert caught.value.exit_code == 3


@pytest.mark.parametrize("text", [FORCED, MAGNETIC, DOUBLE_PENDULUM])
@pytest.mark.parametrize("digits", [15, 30, 50, 100])
def test_what_is_right_passes_at_any_precision(text: str, digits: int) -> None:
    certificate = certify(derivation(text), digits, 4).certificate
    assert (certificate.points, certificate.digits) == (4, digits)
    assert certificate.mismatch < 10.0 ** -(digits - 1)


def test_digits_reach_the_certificate_that_is_reported() -> None:
    found = derive(
        read_text("name: s\n" + DOUBLE_PENDULUM), digits=50, points=3
    ).derivation.certificate
    assert (found.digits, found.points) == (50, 3)
    assert found.mismatch < 1e-49


def test_more_digits_find_a_smaller_error() -> None:
    """A relative error of 1e-35 passes at 30 digits and is caught at 50."""
    right = derivation(DOUBLE_PENDULUM)
    first = tuple(e * (1 + sp.Rational(1, 10**35)) for e in right.forcing[0])
    wrong = replace(right, forcing=(first, *right.forcing[1:]))
    certify(wrong, 30, 2)
    require_caught(wrong, 50)


def entries(text: str) -> list[tuple[int, int]]:
    """(row, number of the term) of every forcing term."""
    return [(j, k) for j, row in enumerate(derivation(text).forcing) for k in range(len(row))]


#: Changes larger than slight ones, in the longer of two scenes.
COARSE = {(FORCED, "dropped"), (FORCED, "doubled")}

CHANGES: dict[str, Callable[[sp.Expr], sp.Expr]] = {
    "sign": lambda e: -e,
    "dropped": lambda e: sp.Integer(0),
    "doubled": lambda e: 2 * e,
    "slightly": lambda e: e * (1 + sp.Rational(1, 10**15)),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "change"),
    slice_of(list(product([FORCED, MAGNETIC], CHANGES)), 0, lambda case: case not in COARSE),
)
def test_every_term_of_the_forcing_counts(text: str, change: str) -> None:
    right = derivation(text)
    assert entries(text)
    for j, k in entries(text):
        rows = [list(row) for row in right.forcing]
        rows[j][k] = CHANGES[change](rows[j][k])
        require_caught(replace(right, forcing=tuple(map(tuple, rows))))


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize(("j", "k"), [(0, 0), (0, 1), (1, 1)])
def test_every_entry_of_the_mass_matrix_counts(j: int, k: int, change: str) -> None:
    right = derivation()
    rows = [dict(row) for row in right.mass]
    first, *others = rows[j][k]
    rows[j][k] = rows[k][j] = (CHANGES[change](first), *others)
    require_caught(replace(right, inertia=replace(right.inertia, terms=rows)))


def test_an_asymmetric_mass_matrix_is_caught() -> None:
    right = derivation()
    rows = [dict(row) for row in right.mass]
    rows[1][0] = tuple(2 * e for e in rows[1][0])
    require_caught(replace(right, inertia=replace(right.inertia, terms=rows)))


def with_energy(right: Uncertified, part: str, energy: sp.Expr) -> Uncertified:
    """The derivation with another T or V."""
    shown = {"kinetic": right.kinetic, "potential": right.potential, part: energy}
    return replace(right, energies=SimpleNamespace(**shown))


@pytest.mark.slow
@pytest.mark.parametrize("text", [FORCED, MAGNETIC])
@pytest.mark.parametrize("part", ["kinetic", "potential"])
@pytest.mark.parametrize("change", CHANGES)
def test_the_energies_shown_are_those_derived_from(text: str, part: str, change: str) -> None:
    right = derivation(text)
    whole = getattr(right, part)
    for term in sp.Add.make_args(whole):
        wrong = whole - term + CHANGES[change](term)
        require_caught(with_energy(right, part, wrong))


@pytest.mark.parametrize("part", ["kinetic", "potential"])
def test_energies_that_give_the_same_equations_are_still_wrong(part: str) -> None:
    """A total time derivative or a constant changes no equation, but it is no energy either."""
    right = derivation()
    rate = right.reduced.coordinates[0].v
    for gauge in (rate, sp.Integer(5)):
        require_caught(with_energy(right, part, getattr(right, part) + gauge))


def test_a_wrong_generalized_force_is_caught() -> None:
    """Also where only what is shown is wrong, and the equations are right."""
    right = derivation()
    for number, force in enumerate(right.forces):
        for j, q_j in enumerate(force.generalized):
            shown = list(force.generalized)
            shown[j] = q_j + 1
            forces = list(right.forces)
            forces[number] = replace(force, generalized=tuple(shown))
            require_caught(replace(right, forces=tuple(forces)))


def test_wrong_force_components_are_caught() -> None:
    right = derivation()
    force = right.forces[0]
    wrong = replace(force, components=(-force.components[0], *force.components[1:]))
    require_caught(replace(right, forces=(wrong, *right.forces[1:])))


@pytest.mark.parametrize("factor", [2, -1, 0])
def test_a_wrong_dissipation_function_is_caught(factor: int) -> None:
    right = derivation()
    require_caught(replace(right, dissipation=factor * right.dissipation))


def test_a_wrong_extra_part_is_caught() -> None:
    right = derivation(MAGNETIC)
    require_caught(replace(right, extra=-right.extra))


def test_a_wrong_velocity_is_caught() -> None:
    """The velocities that every trajectory and document reports."""
    right = derivation()
    symbol = next(s for s, e in right.velocity.items() if e != 0)
    require_caught(replace(right, velocity={**right.velocity, symbol: -right.velocity[symbol]}))


@pytest.mark.slow
@pytest.mark.parametrize("text", [FORCED, MAGNETIC, DOUBLE_PENDULUM])
def test_what_is_shown_is_what_was_derived(text: str) -> None:
    right = derivation(text)
    evidence = certify(right, 30, 2)
    n = len(right.reduced.coordinates)
    shown = shown_equations(right, [False] * n, None)
    certify_shown(evidence, shown)
    for row, equation in enumerate(shown):
        wrong = [replace(equation, divided_by=2 * equation.divided_by)]
        for k, (coefficient, factor) in enumerate(equation.terms):
            for changed in (-coefficient, coefficient * (1 + sp.Rational(1, 10**12))):
                terms = list(equation.terms)
                terms[k] = (changed, factor)
                wrong.append(replace(equation, terms=tuple(terms)))
            wrong.append(replace(equation, terms=equation.terms[:k] + equation.terms[k + 1 :]))
        for candidate in wrong:
            with pytest.raises(InternalError):
                certify_shown(evidence, [*shown[:row], candidate, *shown[row + 1 :]])


def test_small_terms_beside_large_ones_are_looked_at() -> None:
    """A force of 1e-20 beside one of 1e20 is not lost in the tolerance of the larger one."""
    text = (
        "plane: xz\nparticles: {bead: {mass: 1, position: [x, y, z]}}\n"
        "potentials: {big: 1e20*x, small: 1e-20*x^2, other: z}"
    )
    right = derivation(text)
    row = next(j for j, r in enumerate(right.forcing) if len(r) == 2)
    for k in range(2):
        rows = [list(r) for r in right.forcing]
        rows[row][k] = -rows[row][k]
        require_caught(replace(right, forcing=tuple(map(tuple, rows))), digits=60)


@pytest.mark.slow
@pytest.mark.parametrize(("coordinates", "points"), [(24, 8), (25, 2), (64, 2), (65, 1)])
def test_fewer_points_for_many_coordinates(coordinates: int, points: int) -> None:
    names = ", ".join(f"q{k}" for k in range(coordinates))
    terms = " + ".join(f"dot(q{k})^2/2" for k in range(coordinates))
    springs = " + ".join(f"(q{k} - q{k + 1})^2" for k in range(coordinates - 1))
    text = f'coordinates: [{names}]\nkinetic: {{T: "{terms}"}}\npotentials: {{V: "{springs}"}}'
    found = derived(text).derivation.certificate
    assert (found.points, found.digits) == (points, 30)


def test_what_is_below_all_decimals_is_no_mismatch() -> None:
    """Away from s = 0, e^(-s^2/c^2) is below 10^(-10^17), and its square is 0 in decimals."""
    text = (
        "particles: {b: {mass: 1, position: [exp(-s^2/1e-18), 0, z]}}\n"
        "coordinates: [s, z]\ninitial: {s: 0, z: 1}"
    )
    for end in ("", "\npotentials: {w: z}", "\npotentials: {w: z^2}"):
        with pytest.raises(InputError, match=r"is below 1e-307|at the configurations looked at"):
            derived(text + end)


def test_a_force_whose_terms_cancel_altogether_is_certified():
    """What is left of it is rounding, which has no digits to agree in."""
    force = "3*(abs(x + 5.9) - max(x + 5.9, -(x + 5.9)))"
    scene = "particles: {b: {mass: 1, position: [x, 0, 0]}}\ncoordinates: [x]\n"
    equations = loads(f'{scene}forces: {{f: {{on: x, force: "{force}"}}}}\n').derive().equations
    assert equations.derivation.certificate.mismatch < 1e-25
    assert "energy" in {c.name for c in equations.derivation.conserved}


def test_a_rod_that_turns_about_itself_is_refused_and_not_called_a_defect() -> None:
    """Gyroscopic terms about its axis cancel altogether, and leave nothing but rounding."""
    text = """
parameters: {m: 1.5, l: 0.7}
bodies:
  A: {turn: [z: a, x: b], mass: m, centre: [0, 0, -l/2], inertia: {rod: l}}
  B: {on: A, at: [0, 0, -l], turn: {z: d}, mass: 1, inertia: {rod: l}}
coordinates: [a, b, d]
"""
    with pytest.raises(InputError, match="coordinate 'd' has no inertia of its own"):
        loads(text).derive()


@pytest.mark.slow
def test_closures_are_looked_at_with_more_digits_too() -> None:
    """A support at 1e46 turns a second leaves few of fifty digits; a root hides |y - 3|."""
    fast = loads(
        """
        name: fast_support
        parameters: {l: 1, A: 0.02, Omega: 200}
        points: {support: [0, A*cos((Omega + 1)^20*t), 0]}
        particles: {bob: {mass: 1, position: [x, y, 0]}}
        constraints: {rod: {distance: [support, bob], equals: l}}
        coordinates: [theta]
        definitions: {x: l*sin(theta), y: A*cos(Omega*t) - l*cos(theta)}
        initial: {theta: 1}
        """
    )
    with pytest.raises(InputError, match="violate constraint 'rod'"):
        fast.derive()
    hidden = loads(
        """
        name: hidden_kink
        coordinates: [x, y, z]
        particles: {b: {mass: 1, position: [x, y, z]}}
        constraints: {c: dot(x) = sqrt(y^2 - 6*y + 9)*dot(z) - (3 - y)*dot(z)}
        initial: {x: 0, y: 1, z: 0, dot(y): 1, dot(z): 1}
        """
    )
    assert hidden.derive().equations.derivation.certificate.mismatch < 1e-25
