"""Equations with closures built by hand, beside the same systems in angles."""

from __future__ import annotations

from dataclasses import replace

import sympy as sp

from lagrange_cli.mechanics.equations import ShownEquation, TextbookForm
from lagrange_cli.mechanics.system import Closure, InitialState
from tests.emit import emit_systems as systems
from tests.parts import changed


def closure(name, expression, coordinates, text="", kind="position"):
    """φ(q, t), or ψ(q, v, t) linear in v, with its derivatives by SymPy."""
    by = [c.q if kind == "position" else c.v for c in coordinates]
    gradient = tuple(sp.diff(expression, x) for x in by)
    if kind == "position":
        constant = sp.diff(expression, systems.T)
    else:
        constant = sp.expand(expression - sum(g * x for g, x in zip(gradient, by, strict=True)))
    rate = constant + sum(g * c.v for g, c in zip(gradient, coordinates, strict=True))
    bias = sp.diff(rate, systems.T) + sum(sp.diff(rate, c.q) * c.v for c in coordinates)
    multiplier = sp.Symbol(f"lambda_{name}", real=True)
    return Closure(name, name, kind, expression, gradient, constant, bias, multiplier, text)


def closed(equations, closures, name, initial=None):
    """The equations with closures, and shown equations with their multipliers."""
    accelerations = [c.a for c in equations.system.coordinates]
    shown = []
    for i, c in enumerate(equations.system.coordinates):
        terms = [
            (m, a)
            for m, a in zip(equations.system.mass_matrix[i], accelerations, strict=True)
            if m != 0
        ]
        if equations.system.forcing[i] != 0:
            terms.append((-equations.system.forcing[i], sp.Integer(1)))
        terms += [(-k.gradient[i], k.multiplier) for k in closures if k.gradient[i] != 0]
        shown.append(ShownEquation(c.name, tuple(terms), sp.Integer(1)))
    positions = sum(k.kind == "position" for k in closures)
    dof = len(equations.system.coordinates) - positions
    account = replace(
        equations.derivation.account,
        dof=dof,
        constraints=equations.derivation.account.cartesian - dof,
        nonholonomic=len(closures) - positions,
    )
    return changed(
        equations,
        name=name,
        closures=tuple(closures),
        textbook=lambda: TextbookForm(tuple(shown)),
        account=account,
        initial=initial,
    )


def positive(**values):
    return [systems.parameter(name, value, positive=True) for name, value in values.items()]


def pendulum():
    """A particle in a plane on a circle x² + z² = l²."""
    m, g, length = positive(m=1.3, g=9.81, l=2.0)
    x, z = systems.coordinate("x"), systems.coordinate("z")
    free = systems.build(
        "plane",
        [m, g, length],
        [x, z],
        [("bob", m.symbol, (x.q, 0, z.q))],
        m.symbol * g.symbol * z.q,
        diagonal=True,
        title="Pendulum in Cartesian coordinates",
        until=10.0,
    )
    rod = closure("rod", x.q**2 + z.q**2 - length.symbol**2, [x, z], "x^2 + z^2 = l^2")
    return closed(free, [rod], "pendulum_xz", InitialState((2.0, 0.0), (0.0, 0.0)))


def chain(n, name=None):
    """n point masses on rods in 2n Cartesian coordinates; parameters as in pendulum_chain."""
    masses = [systems.parameter(f"m{i}", 1.0 + 0.1 * i, positive=True) for i in range(1, n + 1)]
    lengths = [systems.parameter(f"l{i}", 1.0 - 0.01 * i, positive=True) for i in range(1, n + 1)]
    g = systems.parameter("g", 9.81, positive=True)
    coordinates, particles, closures = [], [], []
    previous = (sp.Integer(0), sp.Integer(0))
    potential = sp.Integer(0)
    for i in range(n):
        x, z = systems.coordinate(f"x{i + 1}"), systems.coordinate(f"z{i + 1}")
        coordinates += [x, z]
        particles.append((f"bob{i + 1}", masses[i].symbol, (x.q, 0, z.q)))
        potential += masses[i].symbol * g.symbol * z.q
        dx, dz = x.q - previous[0], z.q - previous[1]
        closures.append((f"rod{i + 1}", dx**2 + dz**2 - lengths[i].symbol ** 2))
        previous = (x.q, z.q)
    free = systems.build(
        "free", [*masses, *lengths, g], coordinates, particles, potential, diagonal=True, until=10.0
    )
    found = [closure(rod, phi, coordinates, f"{phi} = 0") for rod, phi in closures]
    return closed(free, found, name or f"cartesian_chain{n}")


def chain_state(n, angles, rates, lengths):
    """[q, v] in Cartesian coordinates of a chain given by angles from the downward vertical."""
    import numpy as np

    x = np.cumsum(lengths * np.sin(angles))
    z = -np.cumsum(lengths * np.cos(angles))
    u = np.cumsum(lengths * np.cos(angles) * rates)
    w = np.cumsum(lengths * np.sin(angles) * rates)
    return np.concatenate([np.stack([x, z], 1).ravel(), np.stack([u, w], 1).ravel()])


def sleigh():
    """Chaplygin's sleigh: its blade at (x, y) moves along its heading, mass ahead by a."""
    m, inertia, a = positive(m=1.0, J=0.5, a=0.3)
    x, y, theta = (systems.coordinate(name) for name in ("x", "y", "theta"))
    centre = (x.q + a.symbol * sp.cos(theta.q), y.q + a.symbol * sp.sin(theta.q), 0)
    free = systems.build(
        "sled",
        [m, inertia, a],
        [x, y, theta],
        [("body", m.symbol, centre)],
        0,
        kinetic=inertia.symbol * theta.v**2 / 2,
    )
    blade = -x.v * sp.sin(theta.q) + y.v * sp.cos(theta.q)
    knife = closure("blade", blade, [x, y, theta], "-dot(x)*sin(theta) + ... = 0", "velocity")
    return closed(free, [knife], "sleigh", InitialState((0.0, 0.0, 0.0), (1.0, 0.0, 0.7)))


def moving_circle():
    """A particle on a circle whose centre moves, beside a free particle."""
    m, g, r, w = positive(m=0.7, g=9.81, r=1.2, w=2.5)
    x, z, s = (systems.coordinate(name) for name in "xzs")
    free = systems.build(
        "two",
        [m, g, r, w],
        [x, z, s],
        [("bead", m.symbol, (x.q, 0, z.q)), ("other", m.symbol, (0, s.q, 0))],
        m.symbol * g.symbol * z.q + s.q**2,
        diagonal=True,
    )
    lift = sp.sin(w.symbol * systems.T) / 3
    phi = x.q**2 + (z.q - lift) ** 2 - r.symbol**2
    return closed(free, [closure("circle", phi, [x, z, s])], "moving_circle")
