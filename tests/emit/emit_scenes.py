"""Equations made by hand, by Euler and Lagrange's formula, for tests of output.

Independent of the package's own derivation: T and V are given over the
coordinates, and d/dt ∂L/∂v − ∂L/∂q is taken symbol by symbol.
"""

from fractions import Fraction
from functools import cache

import sympy
from sympy import Rational, Symbol, cos, sin

from lagrange_cli.mechanics.elements.motion import ElementMotion
from lagrange_cli.mechanics.equations import ShownEquation, TextbookForm
from lagrange_cli.mechanics.findings import Account, Certificate, Conserved, ConstraintLine, Facts
from lagrange_cli.mechanics.system import (
    BodyForce,
    CartesianName,
    Coordinate,
    Parameter,
)
from lagrange_cli.scene.conditions import SimulationDefaults
from tests.parts import assembled, changed

HALF = Rational(1, 2)


def parameters(**values):
    return tuple(
        Parameter(name, Symbol(name, real=True, positive=True), value, positive=True)
        for name, value in values.items()
    )


def coordinates(*names):
    return tuple(
        Coordinate(
            name,
            Symbol(name, real=True),
            Symbol(f"dot({name})", real=True),
            Symbol(f"ddot({name})", real=True),
        )
        for name in names
    )


def product(*factors):
    """A product whose number is not multiplied into a sum."""
    return sympy.Mul(*factors, evaluate=False)


T_SYMBOL = Symbol("t", real=True)


def total(expression, chosen):
    """The total time derivative of an expression in q, v, t."""
    return sympy.diff(expression, T_SYMBOL) + sum(
        sympy.diff(expression, c.q) * c.v + sympy.diff(expression, c.v) * c.a for c in chosen
    )


def _monomials(expression, symbols):
    """(coefficient, monomial) of an expanded polynomial in symbols, squares first."""
    gathered = {}
    for term in sympy.Add.make_args(expression):
        coefficient, monomial = term.as_independent(*symbols, as_Add=False)
        gathered.setdefault(monomial, []).append(coefficient)
    order = sorted(gathered, key=lambda m: [-m.as_powers_dict().get(s, 0) for s in symbols])
    return [(sympy.factor_terms(sympy.Add(*gathered[m])), m) for m in order]


def _shown(residual, coordinate, chosen, divide):
    residual = sympy.expand(residual / divide)
    groups = _monomials(residual, [c.a for c in chosen] + [c.v for c in chosen])
    terms = [(c, m) for c, m in groups if m != 1]
    moving = {s for c in chosen for s in (c.v, c.a)}
    still = [t for t in sympy.Add.make_args(residual) if not t.free_symbols & moving]
    terms.extend((part, sympy.Integer(1)) for part in still if part != 0)
    return ShownEquation(coordinate.name, tuple(terms), sympy.sympify(divide))


def _with_signs(expression):
    """Steps as derivations have them."""
    return expression.replace(sympy.Heaviside, lambda x, *_: (1 + sympy.sign(x)) / 2)


def build(
    name, given, chosen, kinetic, potential, *, divide=None, cartesian=6, lines=(), **changes
):
    """Equations for T and V over ``chosen`` coordinates."""
    lagrangian = kinetic - potential
    residuals = [
        _with_signs(total(sympy.diff(lagrangian, c.v), chosen) - sympy.diff(lagrangian, c.q))
        for c in chosen
    ]
    mass = tuple(tuple(sympy.diff(lagrangian, a.v, b.v) for b in chosen) for a in chosen)
    forcing = tuple(-r.subs({c.a: 0 for c in chosen}) for r in residuals)
    divide = divide or [1] * len(chosen)
    energy = kinetic + potential
    cyclic = tuple(c.name for c in chosen if sympy.diff(lagrangian, c.q) == 0)
    momenta = tuple(
        Conserved(
            f"p_{c.name}",
            "momentum",
            sympy.factor_terms(sympy.diff(lagrangian, c.v)),
            f"{c.name} is cyclic",
            c.name,
        )
        for c in chosen
        if c.name in cyclic
    )
    autonomous = sympy.diff(lagrangian, T_SYMBOL) == 0
    conserved = (
        *momenta,
        *([Conserved("energy", "energy", energy, "L does not depend on t")] if autonomous else []),
    )
    k = sum(len(line.equations) for line in lines if line.status != "redundant")
    shown = tuple(
        _shown(r, c, chosen, d) for r, c, d in zip(residuals, chosen, divide, strict=True)
    )
    equations = assembled(
        name=name,
        title=None,
        description=None,
        file=f"{name}.yaml",
        digest="0" * 64,
        t=T_SYMBOL,
        parameters=given,
        coordinates=chosen,
        account=Account(cartesian, 0, k, len(chosen), 0, tuple(lines)),
        particles=(),
        cartesian_names=(),
        kinetic=kinetic,
        potential=potential,
        lagrangian=lagrangian,
        dissipation=sympy.Integer(0),
        forces=(),
        mass_matrix=mass,
        forcing=forcing,
        textbook=lambda: TextbookForm(shown),
        energy=energy,
        cyclic=cyclic,
        conserved=conserved,
        facts=Facts(False, False, False, autonomous, False, False, True),
        certificate=Certificate(8, 30, 3e-31),
        initial=None,
        simulate=SimulationDefaults(),
    )
    return changed(equations, **changes)


def place(name, position, chosen):
    """A Cartesian name with its velocity."""
    return CartesianName(name, position, total(position, chosen))


def particle(name, mass, names, position, chosen):
    velocity = tuple(total(p, chosen) for p in position)
    return ElementMotion(name, mass, names, position, velocity)


def bead_on_parabola():
    given = parameters(m=1.0, a=0.5, g=9.81)
    m, a, g = (p.symbol for p in given)
    chosen = coordinates("x")
    (x,) = chosen
    zero = sympy.Integer(0)
    return build(
        "bead_on_parabola",
        given,
        chosen,
        HALF * m * (1 + 4 * a**2 * x.q**2) * x.v**2,
        m * g * a * x.q**2,
        divide=[m],
        cartesian=3,
        lines=[
            ConstraintLine("plane", ("y = 0",)),
            ConstraintLine("wire", ("z = a*x^2",)),
        ],
        title="Bead sliding on a parabola",
        particles=(particle("bead", m, ("x", "y", "z"), (x.q, zero, a * x.q**2), chosen),),
        cartesian_names=(
            place("x", x.q, chosen),
            place("y", zero, chosen),
            place("z", a * x.q**2, chosen),
        ),
    )


def masses_through_hole():
    given = parameters(M=2.0, m=1.0, g=9.81, l=2.0)
    big, small, g, length = (p.symbol for p in given)
    chosen = coordinates("r", "theta")
    r, theta = chosen
    zero = sympy.Integer(0)
    x1, y1, z2 = r.q * cos(theta.q), r.q * sin(theta.q), r.q - length
    kinetic = product(HALF, big, r.v**2 + r.q**2 * theta.v**2) + HALF * small * r.v**2
    return build(
        "masses_through_hole",
        given,
        chosen,
        kinetic,
        small * g * (r.q - length),
        lines=[
            ConstraintLine("table", ("z1 = 0",)),
            ConstraintLine("plumb", ("x2 = 0", "y2 = 0")),
            ConstraintLine("rope", ("r - z2 = l",)),
        ],
        title="Mass on a table tied through a hole to a hanging mass",
        particles=(
            particle("puck", big, ("x1", "y1", "z1"), (x1, y1, zero), chosen),
            particle("weight", small, ("x2", "y2", "z2"), (zero, zero, z2), chosen),
        ),
        cartesian_names=tuple(
            place(n, p, chosen)
            for n, p in zip(
                ("x1", "y1", "z1", "x2", "y2", "z2"), (x1, y1, zero, zero, zero, z2), strict=True
            )
        ),
        literals=((Fraction(981, 100), "9.81"),),
    )


@cache
def chain_pendulum(n):
    """A plane pendulum of n point masses, absolute angles (n = 2: the double pendulum)."""
    given = parameters(
        **{f"m{i}": 1.0 for i in range(1, n + 1)},
        **{f"l{i}": 1.0 for i in range(1, n + 1)},
        g=9.81,
    )
    masses = [p.symbol for p in given[:n]]
    lengths = [p.symbol for p in given[n : 2 * n]]
    g = given[-1].symbol
    chosen = coordinates(*(f"theta{i}" for i in range(1, n + 1)))
    kinetic, potential = sympy.Integer(0), sympy.Integer(0)
    for i in range(n):
        tail = sympy.Add(*masses[i:])
        kinetic += product(HALF, tail, lengths[i] ** 2, chosen[i].v ** 2)
        potential -= tail * g * lengths[i] * cos(chosen[i].q)
        for j in range(i):
            angle = chosen[j].q - chosen[i].q
            kinetic += tail * lengths[i] * lengths[j] * chosen[i].v * chosen[j].v * cos(angle)
    return build(
        "double_pendulum" if n == 2 else f"pendulum_{n}",
        given,
        chosen,
        kinetic,
        potential,
        divide=lengths,
        cartesian=3 * n,
        lines=[ConstraintLine("plane", tuple(f"y{i} = 0" for i in range(1, n + 1)))],
        title="Double pendulum" if n == 2 else f"Plane pendulum of {n} links",
    )


def damped_driven():
    """One coordinate with damping, a driving force and a time-dependent support."""
    given = parameters(m=1.0, k=4.0, c=0.1, A=0.5, omega=2.0)
    m, k, c, amplitude, omega = (p.symbol for p in given)
    chosen = coordinates("x")
    (x,) = chosen
    return build(
        "damped_driven",
        given,
        chosen,
        HALF * m * x.v**2,
        product(HALF, k, (x.q - amplitude * cos(omega * T_SYMBOL)) ** 2),
        cartesian=3,
        dissipation=HALF * c * x.v**2,
        forces=(BodyForce("push", "x", (amplitude * T_SYMBOL,), (amplitude * T_SYMBOL,)),),
    )
