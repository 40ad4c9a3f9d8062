"""Equations built by hand with plain SymPy, independently of the mechanics room."""

from __future__ import annotations

from fractions import Fraction
from functools import cache

import sympy as sp

from lagrange_cli.mechanics.elements.motion import ElementMotion
from lagrange_cli.mechanics.equations import TextbookForm
from lagrange_cli.mechanics.findings import Account, Certificate, Facts
from lagrange_cli.mechanics.system import (
    CartesianName,
    Coordinate,
    InitialState,
    Parameter,
)
from lagrange_cli.scene.conditions import SimulationDefaults
from tests.parts import assembled, changed

T = sp.Symbol("t", real=True)


def coordinate(name, **more):
    return Coordinate(
        name,
        sp.Symbol(name, real=True),
        sp.Symbol(f"dot({name})", real=True),
        sp.Symbol(f"ddot({name})", real=True),
        **more,
    )


def parameter(name, value=None, **more):
    symbol = sp.Symbol(name, positive=True) if more.get("positive") else sp.Symbol(name, real=True)
    return Parameter(name, symbol, value, **more)


def rate(expression, coordinates):
    """Total time derivative of a function of q and t."""
    return sp.Add(sp.diff(expression, T), *(sp.diff(expression, c.q) * c.v for c in coordinates))


def build(
    name,
    parameters,
    coordinates,
    particles,
    potential,
    *,
    kinetic=0,
    forces=(),
    initial=None,
    title=None,
    description=None,
    definite=True,
    diagonal=False,
    until=None,
):
    """Equations of particles [(name, mass, (x, y, z))], V or U, and generalized forces."""
    q, v = [c.q for c in coordinates], [c.v for c in coordinates]
    motions, names = [], []
    kinetic = sp.sympify(kinetic)
    for particle, mass, position in particles:
        position = tuple(map(sp.sympify, position))
        velocity = tuple(rate(r, coordinates) for r in position)
        components = tuple(f"{axis}_{particle}" for axis in "xyz")
        motions.append(ElementMotion(particle, mass, components, position, velocity))
        names += [CartesianName(*row) for row in zip(components, position, velocity, strict=True)]
        kinetic += sp.Rational(1, 2) * mass * sp.Add(*(u**2 for u in velocity))
    lagrangian = kinetic - potential
    momenta = [sp.diff(lagrangian, u) for u in v]
    matrix = tuple(tuple(sp.expand(sp.diff(p, u)) for u in v) for p in momenta)
    rest = [
        sp.diff(lagrangian, q[i])
        - sp.diff(momenta[i], T)
        - sp.Add(*(sp.diff(momenta[i], q[k]) * v[k] for k in range(len(q))))
        + (forces[i] if forces else 0)
        for i in range(len(q))
    ]
    energy = sp.Add(*(u * p for u, p in zip(v, momenta, strict=True))) - lagrangian
    return assembled(
        name=name,
        title=title,
        description=description,
        file=f"{name}.yaml",
        digest="ab" * 32,
        t=T,
        parameters=tuple(parameters),
        coordinates=tuple(coordinates),
        account=Account(3 * len(particles), 0, 3 * len(particles) - len(q), len(q), 0, ()),
        particles=tuple(motions),
        cartesian_names=tuple(names),
        kinetic=kinetic,
        potential=sp.sympify(potential),
        lagrangian=lagrangian,
        dissipation=sp.Integer(0),
        forces=(),
        mass_matrix=matrix,
        forcing=tuple(map(sp.expand, rest)),
        textbook=lambda: TextbookForm(()),
        energy=energy,
        cyclic=(),
        conserved=(),
        facts=Facts(
            constant_mass_matrix=False,
            diagonal_mass_matrix=diagonal,
            separable=False,
            autonomous=True,
            rheonomic=False,
            planar=False,
            positive_definite_mass_matrix=definite,
        ),
        certificate=Certificate(8, 30, 0.0),
        initial=initial,
        simulate=SimulationDefaults(until=until),
        literals=((Fraction(981, 100), "9.81"),),
    )


@cache
def bead_on_parabola():
    m, a, g = (parameter(n, v, positive=True) for n, v in (("m", 1.0), ("a", 0.5), ("g", 9.81)))
    x = coordinate("x", unit="m")
    z = a.symbol * x.q**2
    return build(
        "bead_on_parabola",
        [m, a, g],
        [x],
        [("bead", m.symbol, (x.q, 0, z))],
        m.symbol * g.symbol * z,
        initial=InitialState((1.0,), (0.0,)),
        title="Bead sliding on a parabola",
        until=10.0,
    )


@cache
def masses_through_hole():
    big, m, g, length = (
        parameter(n, v, positive=True) for n, v in (("M", 2.0), ("m", 1.0), ("g", 9.81), ("l", 2.0))
    )
    r, theta = coordinate("r"), coordinate("theta", is_angle=True)
    z = r.q - length.symbol
    return build(
        "masses_through_hole",
        [big, m, g, length],
        [r, theta],
        [
            ("puck", big.symbol, (r.q * sp.cos(theta.q), r.q * sp.sin(theta.q), 0)),
            ("weight", m.symbol, (0, 0, z)),
        ],
        m.symbol * g.symbol * z,
        initial=InitialState((1.0, 0.0), (0.0, 3.0)),
        until=10.0,
    )


def simplified(equations):
    """The same system with its mass matrix simplified (so that zeros are seen)."""

    matrix = tuple(tuple(sp.simplify(m) for m in row) for row in equations.system.mass_matrix)
    return changed(equations, mass_matrix=matrix)


@cache
def pendulum_chain(n, name=None):
    """n point masses on rods, absolute angles from the downward vertical."""
    masses = [parameter(f"m{i}", 1.0 + 0.1 * i, positive=True) for i in range(1, n + 1)]
    lengths = [parameter(f"l{i}", 1.0 - 0.01 * i, positive=True) for i in range(1, n + 1)]
    g = parameter("g", 9.81, positive=True)
    angles = [coordinate(f"theta{i}", is_angle=True) for i in range(1, n + 1)]
    x = z = sp.Integer(0)
    particles, potential = [], sp.Integer(0)
    for i in range(n):
        x += lengths[i].symbol * sp.sin(angles[i].q)
        z -= lengths[i].symbol * sp.cos(angles[i].q)
        particles.append((f"bob{i + 1}", masses[i].symbol, (x, 0, z)))
        potential += masses[i].symbol * g.symbol * z
    return build(
        name or f"pendulum{n}",
        [*masses, *lengths, g],
        angles,
        particles,
        potential,
        initial=InitialState(tuple(1.5 + 0.1 * i for i in range(n)), (0.0,) * n),
        until=10.0,
    )


@cache
def collected_chain(n):
    """The n-link pendulum in the collected d'Alembert form, written down directly."""

    base = pendulum_chain(1)
    masses = [parameter(f"m{i}", 1.0, positive=True) for i in range(n)]
    lengths = [parameter(f"l{i}", 1.0, positive=True) for i in range(n)]
    g = parameter("g", 9.81, positive=True)
    angles = [coordinate(f"theta{i}", is_angle=True) for i in range(n)]
    m = [p.symbol for p in masses]
    length = [p.symbol for p in lengths]
    sin, cos = [sp.sin(c.q) for c in angles], [sp.cos(c.q) for c in angles]
    mu = [[sp.Add(*m[max(i, j) :]) for j in range(n)] for i in range(n)]

    def entry(i, j):
        if i == j:
            return mu[i][i] * length[i] ** 2
        return mu[i][j] * length[i] * length[j] * (cos[i] * cos[j] + sin[i] * sin[j])

    matrix = tuple(tuple(entry(i, j) for j in range(n)) for i in range(n))
    forcing = tuple(
        -sp.Add(
            mu[i][i] * g.symbol * length[i] * sin[i],
            *(
                mu[i][j]
                * length[i]
                * length[j]
                * (sin[i] * cos[j] - cos[i] * sin[j])
                * angles[j].v ** 2
                for j in range(n)
                if j != i
            ),
        )
        for i in range(n)
    )
    return changed(
        base,
        name=f"chain{n}",
        parameters=(*masses, *lengths, g),
        coordinates=tuple(angles),
        mass_matrix=matrix,
        forcing=forcing,
        initial=InitialState((0.5,) * n, (0.0,) * n),
    )


@cache
def driven_cart():
    """Pendulum on a cart with a driven pivot height, drag, and a force on the cart."""
    names = (("M", 2.0), ("m", 0.7), ("l", 1.3), ("g", 9.81), ("A", 0.2), ("w", 3.0), ("c", 0.1))
    big, m, length, g, amplitude, w, c = (parameter(n, v, positive=True) for n, v in names)
    x, theta = coordinate("x"), coordinate("theta", is_angle=True)
    lift = amplitude.symbol * sp.cos(w.symbol * T)
    bob = (
        x.q + length.symbol * sp.sin(theta.q),
        0,
        lift - length.symbol * sp.cos(theta.q),
    )
    return build(
        "driven_cart",
        [big, m, length, g, amplitude, w, c],
        [x, theta],
        [("cart", big.symbol, (x.q, 0, lift)), ("bob", m.symbol, bob)],
        m.symbol * g.symbol * bob[2],
        forces=[-c.symbol * x.v + sp.sin(T) * sp.exp(-T / 5), -c.symbol * theta.v**3],
    )


@cache
def charged_particle():
    """A charge in a uniform magnetic field (generalized potential) and a Coulomb field."""
    m, charge, field, k = (parameter(n, 1.5) for n in ("m", "Q", "B", "k"))
    x, y, z = coordinate("x"), coordinate("y"), coordinate("z")
    radius = sp.sqrt(x.q**2 + y.q**2 + z.q**2)
    magnetic = -charge.symbol * field.symbol / 2 * (x.q * y.v - y.q * x.v)
    return build(
        "charged_particle",
        [m, charge, field, k],
        [x, y, z],
        [("charge", m.symbol, (x.q, y.q, z.q))],
        magnetic + k.symbol / radius,
        diagonal=True,
    )


@cache
def indefinite():
    """A Lagrangian whose mass matrix is indefinite: L = a·ẋẏ + … (three coordinates)."""
    a, k = parameter("a", 1.2), parameter("k", 2.0)
    x, y, z = coordinate("x"), coordinate("y"), coordinate("z")
    kinetic = a.symbol * x.v * y.v + x.v * z.v * sp.cos(y.q) / 3 + z.v**2 / 2
    potential = k.symbol * sp.exp(x.q) * sp.cosh(y.q / 3) + z.q**4
    return build("indefinite", [a, k], [x, y, z], [], potential, kinetic=kinetic, definite=False)


ALL = [
    bead_on_parabola,
    masses_through_hole,
    driven_cart,
    charged_particle,
    indefinite,
    lambda: pendulum_chain(2),
    lambda: pendulum_chain(3),
    lambda: pendulum_chain(5),
    lambda: collected_chain(8),
]
