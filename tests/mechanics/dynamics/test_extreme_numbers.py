"""Numbers and expressions at the ends of every range: an answer, or a refusal at its place."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal, localcontext
from fractions import Fraction

import mpmath
import pytest
import sympy as sp
from mpmath import mpf

from lagrange_cli import loads
from lagrange_cli.api.emitters import emitter
from lagrange_cli.errors import InputError, InternalError, Mark, Problem
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.certify import printed
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.mechanics.numerics.elementary import (
    ELEMENTARY_FUNCTIONS,
    DomainError,
    decimal_context,
)
from lagrange_cli.mechanics.reactions import constraint_forces as forces
from lagrange_cli.mechanics.symbols.convert import LONGEST_ROOT, has_long_root, total_derivative
from lagrange_cli.scene import read_text
from lagrange_cli.scene.language.bounds import require_bounded
from lagrange_cli.scene.language.grammar import parse_expression
from lagrange_cli.scene.language.tokens import ExpressionError
from lagrange_cli.simulate.model.build import model_of

PLANE = """\
name: plane
parameters: {{g: 9.81, l: 0.5, k: 2, huge: 1e300}}
plane: xz
particles: {{b: {{mass: 1, position: [x, 0, z]}}}}
coordinates: [x, z]
points: {{o: [0, 0, 0]}}
{}
initial: {{x: 0.3, z: 0.2, dot(x): 0.1, dot(z): -0.2}}
"""


def derived(section: str, **options):
    return derive(read_text(PLANE.format(section)), **options)


def refusal(section: str, **options) -> Problem:
    with pytest.raises(InputError) as caught:
        derived(section, **options)
    problem = caught.value.problems[0]
    assert problem.mark is not None
    return problem


# Roots.

P, Q = 10**57 + 7, 10**57 + 9
CLOSE = Fraction("1.00000000000000001"), Fraction("1.00000000000000003")


@pytest.mark.parametrize(
    ("text", "base", "degree"),
    [
        (f"({P}*{Q})^(1/3)", P * Q, 3),
        (f"sqrt({P}*{Q})", P * Q, 2),
        (f"norm(sqrt({P}*{Q} - 4), 2)", P * Q, 2),
        ("sqrt(1.00000000000000001*1.00000000000000003)", CLOSE[0] * CLOSE[1], 2),
        ("(10^40 + 1)^(1/7)", 10**40 + 1, 7),
        ("sqrt(4.9e-324)", Fraction("4.9e-324"), 2),
        ("sqrt(1e300)", 10**300, 2),
    ],
)
def test_roots_of_long_numbers_are_exact(text, base, degree):
    """SymPy takes products of close numbers apart by Fermat's method, and refused its factors."""
    slope = derived(f"potentials: {{v: '{text}*x'}}").system.potential.coeff(
        sp.Symbol("x", real=True)
    )
    slope = slope if slope else derived(f"potentials: {{v: '{text}*x'}}").system.potential
    number = slope.subs(dict.fromkeys(slope.free_symbols, 1))
    with mpmath.workdps(60):
        expected = mpmath.root(mpf(Fraction(base).numerator) / Fraction(base).denominator, degree)
        assert abs(mpf(number.evalf(60)) / expected - 1) < mpf(10) ** -50


def test_roots_of_numbers_of_a_thousand_digits_are_refused_at_once():
    digits = "0." + "7" * (LONGEST_ROOT + 10)
    problem = refusal(f"potentials: {{v: 'sqrt({digits})*x'}}")
    assert str(LONGEST_ROOT) in problem.message
    assert (
        problem.mark.column == PLANE.format("potentials: {v: 'sqrt").splitlines()[6].index("sq") + 1
    )


def test_powers_of_ten_and_whole_powers_are_no_long_roots():
    assert not has_long_root(sp.Integer(10) ** 5000, sp.Rational(1, 2))
    assert not has_long_root(sp.Rational(49, 10**3000), sp.Rational(1, 2))
    assert not has_long_root(sp.Integer(7) ** 5000, sp.Integer(2))
    assert has_long_root(sp.Integer(7) ** 5000, sp.Rational(1, 2))
    assert has_long_root(sp.Rational("2.89725420644"), sp.Rational("2.89725420644"))
    assert has_long_root(sp.Integer(12), sp.Rational("0.123456789"))
    assert not has_long_root(sp.Integer(1000), sp.Rational("0.123456789"))
    assert not has_long_root(sp.Rational("9.81"), sp.Rational("1.2345"))


# Towers, and constants that parameters make.


@pytest.mark.parametrize(
    ("function", "depth"), [("exp", 5), ("exp", 12), ("cosh", 8), ("cosh", 12)]
)
def test_towers_without_a_value_take_no_memory(function, depth):
    tower = f"{function}(" * depth + "x" + ")" * depth
    assert "not finite" in refusal(f"potentials: {{v: '{tower}'}}").message


@pytest.mark.parametrize(
    ("function", "depth"), [("exp", 3), ("cosh", 3), ("sinh", 12), ("sin", 12)]
)
def test_towers_with_a_value_are_derived(function, depth):
    tower = f"{function}(" * depth + "x" + ")" * depth
    assert derived(f"potentials: {{v: '{tower}'}}").system.coordinates


def evaluated(function, x: Decimal) -> tuple[Decimal, Decimal, Decimal]:
    with mpmath.workdps(30), localcontext(decimal_context(35)):
        return ELEMENTARY_FUNCTIONS[function](x)


@pytest.mark.parametrize("function", [sp.exp, sp.sinh, sp.cosh, sp.sin, sp.cos, sp.tan])
def test_functions_refuse_what_would_take_all_memory(function):
    with pytest.raises(DomainError):
        evaluated(function, Decimal("1e1000000"))


def test_an_exponential_far_below_zero_is_nothing():
    assert evaluated(sp.exp, Decimal("-1e30")) == (0, 0, 0)
    assert evaluated(sp.exp, Decimal("-1e16"))[0] > 0


@pytest.mark.parametrize(
    "text",
    [
        "x*exp(huge)",
        "x*2^huge",
        "x^2*exp(exp(huge))",
        "x*cosh(-huge)",
        "(huge^2)^k*x",
        "x*huge^huge",
    ],
)
def test_constants_that_parameters_make_too_large_are_refused_at_their_place(text):
    problem = refusal(f"potentials: {{v: '{text}'}}")
    assert problem.rule == "limit"
    assert problem.mark.line == 7


@pytest.mark.parametrize("text", ["x*sqrt(1 - k)^0*k", "x*exp(-huge)", "x^2/huge", "x*sin(huge)"])
def test_constants_that_parameters_make_are_left_where_they_are_small(text):
    assert derived(f"potentials: {{v: '{text}'}}").system.coordinates


def test_bounds_with_values_ask_only_for_size():
    mark = Mark("scene", 1, 1)
    steep = parse_expression("x^p + log(q) + 1/(p - p)", mark).node
    require_bounded(steep, {"p": Fraction(150), "q": Fraction(-1)})
    with pytest.raises(ExpressionError):
        require_bounded(parse_expression("2^p", mark).node, {"p": Fraction(10**6)})


# Places of forces, restitutions, directions.


@pytest.mark.parametrize("term", ["min(x, 1/2)", "x^2", "max(x, z, 1)*x", "abs(x)*t"])
def test_kinetic_terms_of_positions_have_forces(term):
    equations = derived(f"kinetic: {{f: '{term}'}}", forces=True)
    assert equations.derivation.constraint_forces is not None


@pytest.mark.slow
@pytest.mark.parametrize(
    "length",
    ["max(-dot(x), l/x)", "min(dot(z), l)", "abs(dot(x))", "l + sign(dot(x))", "norm(dot(x), l)"],
)
def test_springs_of_velocities_with_kinks_have_forces(length):
    section = f"potentials: {{c: {{spring: [o, b], stiffness: 3, length: '{length}'}}}}"
    assert derived(section, forces=True).derivation.constraint_forces is not None


@pytest.mark.parametrize("function", [sp.Max, sp.Min])
def test_rates_of_kinks_stay_within_the_language(function):
    x, v, t = sp.symbols("x v t", real=True)
    rate = total_derivative(function(x**2, sp.Abs(v)), t, [(x, v), (v, sp.Symbol("a", real=True))])
    assert not rate.has(sp.Heaviside, sp.DiracDelta, sp.Derivative)
    for at in ({x: 2, v: 3}, {x: 1, v: 3}, {x: 1, v: -3}):
        first = at[x] ** 2 > abs(at[v])
        chosen = first if function is sp.Max else not first
        expected = 2 * at[x] * at[v] if chosen else 5 * (1 if at[v] > 0 else -1)
        assert rate.subs({**at, sp.Symbol("a", real=True): 5}) == expected


@pytest.mark.parametrize(
    ("restitution", "accepted"),
    [
        ("cos(4.9e-324*l)", True),
        ("sin(1)^2 + cos(1)^2", True),
        ("1e-400", True),
        ("1.1", False),
        ("-1e-300", False),
        ("exp(1e-3)", False),
    ],
)
def test_restitutions_near_their_bounds(restitution, accepted):
    section = f"constraints: {{c: {{unilateral: z >= -3, restitution: '{restitution}'}}}}"
    if accepted:
        assert derived(section).system.contacts
    else:
        assert refusal(section).rule == "restitution"


@pytest.mark.parametrize("component", ["0.5 + 1e309", "1e350*2*pi", "-1e309/3.5*pi", "1e309 + 0.1"])
def test_directions_beyond_doubles_are_refused(component):
    section = f"potentials: {{c: {{gravity: g, direction: ['{component}', 0, 1]}}}}"
    assert refusal(section).mark.line == 7


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("samples", "1e150"),
        ("samples", "1"),
        ("samples", "2.5"),
        ("accuracy", "2"),
        ("accuracy", "0"),
        ("rtol", "-1"),
        ("atol", "0"),
        ("step", "-1e-300"),
    ],
)
def test_numbers_of_a_run_are_refused_at_their_place(key, value):
    problem = refusal(f"simulate: {{until: 1, {key}: {value}}}")
    assert problem.mark.line == 7
    assert problem.mark.text[problem.mark.column - 1 :].startswith(value)


def test_velocity_constraints_without_a_value_at_the_start_are_refused():
    problem = refusal("constraints: {c: 'dot(x) = acosh(t)'}")
    assert "finite real" in problem.message


# The certificate looks again with more digits where rounding may be what differs.

RING = """\
coordinates: [x, y]
kinetic: {{k: (dot(x)^2 + dot(y)^2)/2}}
potentials: {{v: exp(x - y) + exp(y - x)}}
initial: {{x: {0}, y: -{0}, dot(x): 1}}
"""


@pytest.mark.parametrize("size", ["1e-20", "1e-60", "1e-150", "1e-300"])
def test_motions_that_are_tiny_beside_their_terms_are_certified(size):
    equations = derive(read_text(RING.format(size)))
    x, y = (c.q for c in equations.system.coordinates)
    assert sp.simplify(equations.system.forcing[0] - (sp.exp(y - x) - sp.exp(x - y))) == 0


def test_a_wrong_equation_stays_wrong_with_more_digits(monkeypatch):
    """An equation that is off by a part that only more digits show beside others is refused."""
    original = printed.certify_shown

    def changed(evidence, shown):

        (first, *others) = shown
        (coefficient, factor), *terms = first.terms
        wrong = replace(
            first, terms=((coefficient * sp.Rational(1 + 10**12, 10**12), factor), *terms)
        )
        original(evidence, (wrong, *others))

    monkeypatch.setattr("lagrange_cli.mechanics.assembly.certify_shown", changed)
    for size in ("0.1", "1e-60"):
        with pytest.raises(InternalError):
            derive(read_text(RING.format(size))).derivation.textbook()


def test_values_of_nothing_real_are_a_domain_error():
    x = sp.Symbol("x", real=True)
    with pytest.raises(DomainError), mpmath.workdps(30):
        evaluate([sp.exp(sp.exp(sp.exp(sp.exp(sp.exp(x)))))], {x: mpf(10)})


# Forces that vanish, and starts that are nothing.

FREE_ON_RING = """\
parameters: {{m: {}}}
particles: {{p: {{mass: m, position: [x, y, 2]}}}}
constraints: {{torus: (sqrt(x^2 + y^2) - 2)^2 + z^2 = 1}}
coordinates: [theta, phi]
definitions: {{rho: 2 + cos(theta), x: rho*cos(phi), y: rho*sin(phi), z: sin(theta)}}
initial: {{theta: 0.5, phi: 0, dot(theta): 1, dot(phi): 0.1}}
"""


PENDULUM = """\
particles: {bob: {mass: 1, position: [sin(theta), 0, -cos(theta)]}}
coordinates: [theta]
potentials: {weight: 9.81*z_bob}
initial: {theta: 1}
"""


@pytest.mark.slow
@pytest.mark.parametrize("mass", ["1", "1e-27", "1e20"])
def test_forces_that_vanish_are_no_mismatch(mass):
    """The particle moves freely in a plane, in coordinates of a torus: no force acts on it."""
    found = derive(read_text(FREE_ON_RING.format(mass)), forces=True).derivation.constraint_forces
    assert found is not None
    assert [reaction.multiplier for reaction in found.reactions] == [0]


def test_forces_that_are_wrong_by_a_small_part_are_refused(monkeypatch):
    shortened = forces.shortened
    off = sp.Rational(10**15 + 1, 10**15)
    monkeypatch.setattr(forces, "shortened", lambda force: off * shortened(force))
    with pytest.raises(InternalError):
        derive(read_text(PENDULUM), forces=True)


@pytest.mark.parametrize("start", ["exp(-1e18)", "sin(exp(-(3)^2/1e-18))"])
def test_starts_below_every_number_are_nothing(start):
    equations = derive(read_text(RING.format(f"({start})")))
    assert equations.system.initial is not None
    assert equations.system.initial.positions == (0.0, 0.0)


def test_equations_that_doubles_cannot_hold_are_refused_at_the_scene():
    equations = derived("potentials: {v: 1e308*x^2}\nforces: {f: {on: x, force: -9e307*x}}")
    for use in (model_of, emitter("c").emit, emitter("python").emit):
        with pytest.raises(InputError) as caught:
            use(equations)
        assert caught.value.problems[0].mark is not None


@pytest.mark.slow
@pytest.mark.parametrize("depth", [400, 2000])
def test_names_within_names_are_refused_beyond_what_can_be_walked(depth):
    names = ", ".join(f"d{k}: sin(d{k - 1})" for k in range(1, depth))
    text = f"coordinates: [x]\ndefinitions: {{d0: x, {names}}}\nkinetic: {{k: dot(x)^2/2}}\n"
    with pytest.raises(InputError, match="nest too deeply") as caught:
        derive(read_text(f"{text}potentials: {{v: d{depth - 1}}}\n"))
    assert caught.value.problems[0].mark.line == 2


def test_forces_without_a_value_anywhere_are_refused_at_their_term() -> None:
    """A weight of exp(−1e20) is next to nothing, and doubles hold none of what follows."""
    scene = """
parameters: {g: 9.81}
plane: xz
particles: {upper: {mass: 1, position: [x1, y1, z1]}, lower: {mass: 1, position: [x2, y2, z2]}}
coordinates: [a, b]
definitions: {x1: sin(a), z1: -cos(a), x2: x1 + sin(b), z2: z1 - cos(b)}
potentials: {weight: {gravity: "exp(-(g)^2/1e-18)"}}
initial: {a: 1.5, b: 2.0}
"""
    with pytest.raises(InputError) as refusal:
        loads(scene).derive(forces=True)
    (problem,) = refusal.value.problems
    assert "constraint forces" in problem.message
    assert problem.mark is not None


def test_a_gradient_beyond_doubles_is_refused_where_it_comes_from():
    scene = (
        "parameters: {l: 0.5}\ncoordinates: [x, theta]\nparticles: {b: {mass: 1, position:"
        " [(l + x)*sin(theta), 1e400, -(l + x)*cos(theta)]}}\n"
        "initial: {x: 0.1, theta: 0.8, dot(x): 0, dot(theta): 0}\n"
        "potentials: {w: {gravity: 9.81}, s: 15*x^2}\n"
    )
    with pytest.raises(InputError, match="overflow") as caught:
        derive(read_text(scene), formulation="multiplier")
    assert caught.value.problems[0].mark is not None


@pytest.mark.slow
def test_velocities_that_only_rates_of_1e150_would_give_are_refused():
    scene = (
        "coordinates: [h, p]\nparticles: {b: {mass: 1, position: [x, y, z]}}\n"
        "definitions: {x: sin(1e-150*h)*cos(p), y: sin(h)*sin(p), z: -cos(h)}\n"
        "initial: {x: 0, y: 0, z: -1, dot(x): 6.4, dot(y): 4.8}\n"
    )
    with pytest.raises(InputError, match="violates the constraints") as caught:
        derive(read_text(scene), forces=True)
    assert caught.value.problems[0].mark is not None
