"""What the books say about the shipped scenes, typed by hand.

:data:`LAGRANGIANS` holds a Lagrangian for each scene, :data:`GENERALIZED_FORCES`
what is not in the Lagrangian, :data:`CLOSED_FORMS` the motions that have one.
Nothing here is taken from the program's output, and nothing imports it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk
from sympy import Expr, Rational, Symbol, cos, sin, sqrt

Array = NDArray[np.float64]
Names = SimpleNamespace

HALF = Rational(1, 2)


def _bead_on_parabola(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * v.x**2 * (1 + 4 * p.a**2 * q.x**2) - p.m * p.g * p.a * q.x**2


def _masses_through_hole(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return (
        HALF * p.M * (v.r**2 + q.r**2 * v.theta**2) + HALF * p.m * v.r**2 + p.m * p.g * (p.l - q.r)
    )


def _rigid_body(p: Names, q: Names, v: Names, mass: Expr, i1: Expr, i3: Expr) -> Expr:
    translation = HALF * mass * (v.X**2 + v.Y**2 + v.Z**2) - mass * p.g * q.Z
    transverse = HALF * i1 * (v.theta**2 + v.phi**2 * sin(q.theta) ** 2)
    return translation + transverse + HALF * i3 * (v.psi + v.phi * cos(q.theta)) ** 2


def _rigid_triangle(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return _rigid_body(p, q, v, 3 * p.m, p.m * p.c**2 / 2, p.m * p.c**2)


def _rigid_tetrahedron(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return _rigid_body(p, q, v, 4 * p.m, p.m * p.c**2, p.m * p.c**2)


def _rigid_tetrahedron_centre(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return _rigid_body(p, q, v, 4 * p.m + p.M, p.m * p.c**2, p.m * p.c**2)


def _particle_on_sphere(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m * p.a**2 * (v.theta**2 + sin(q.theta) ** 2 * v.phi**2)
    return kinetic - p.m * p.g * p.a * cos(q.theta)


def _bead_on_rotating_wire(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * (v.r**2 + p.omega**2 * q.r**2)


def _pendulum_driven_support(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    support = -p.A * p.Omega * sin(p.Omega * t)
    return HALF * p.m * (
        p.l**2 * v.theta**2 + 2 * support * p.l * v.theta * cos(q.theta)
    ) + p.m * p.g * p.l * cos(q.theta)


def _pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * p.l**2 * v.theta**2 + p.m * p.g * p.l * cos(q.theta)


def _lever(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * p.a**2 * v.theta**2 + p.m * p.g * p.a * sin(q.theta)


def _balance(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    inertia = p.J + (p.m1 + p.m2) * p.l**2
    pans = (p.m2 - p.m1) * p.g * p.l * sin(q.phi)
    return HALF * inertia * v.phi**2 + pans + p.M * p.g * p.h * cos(q.phi)


def _double_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return (
        HALF * (p.m1 + p.m2) * p.l1**2 * v.theta1**2
        + HALF * p.m2 * p.l2**2 * v.theta2**2
        + p.m2 * p.l1 * p.l2 * v.theta1 * v.theta2 * cos(q.theta1 - q.theta2)
        + (p.m1 + p.m2) * p.g * p.l1 * cos(q.theta1)
        + p.m2 * p.g * p.l2 * cos(q.theta2)
    )


def _pendulum_on_cart(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return (
        HALF * (p.m1 + p.m2) * v.x**2
        + HALF * p.m2 * (p.l**2 * v.phi**2 + 2 * p.l * v.x * v.phi * cos(q.phi))
        + p.m2 * p.g * p.l * cos(q.phi)
    )


def _spherical_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m * p.l**2 * (v.theta**2 + v.phi**2 * sin(q.theta) ** 2)
    return kinetic + p.m * p.g * p.l * cos(q.theta)


def _elastic_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    length = p.l + q.x
    kinetic = HALF * p.m * (v.x**2 + length**2 * v.theta**2)
    return kinetic + p.m * p.g * length * cos(q.theta) - HALF * p.k * q.x**2


def _swinging_spring(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    stretch = sqrt(q.x**2 + q.y**2 + q.z**2) - p.l0
    kinetic = HALF * p.m * (v.x**2 + v.y**2 + v.z**2)
    return kinetic - p.m * p.g * q.z - HALF * p.k * stretch**2


def _cycloidal_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = 2 * p.m * p.R**2 * cos(q.phi / 2) ** 2 * v.phi**2
    return kinetic - 2 * p.m * p.g * p.R * sin(q.phi / 2) ** 2


def _bead_on_rotating_hoop(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m * p.R**2 * (v.theta**2 + p.omega**2 * sin(q.theta) ** 2)
    return kinetic + p.m * p.g * p.R * cos(q.theta)


def _bead_on_helix(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    pitch = getattr(p, "lambda")
    return HALF * p.m * v.z**2 * (1 + p.R**2 / pitch**2) - p.m * p.g * q.z


def _atwood(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * (p.m1 + p.m2) * v.x**2 + p.m1 * p.g * q.x + p.m2 * p.g * (p.l - q.x)


def _double_atwood(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = p.m1 * (v.z2 + v.z3) ** 2 / 8 + HALF * p.m2 * v.z2**2 + HALF * p.m3 * v.z3**2
    return kinetic + p.m1 * p.g * (q.z2 + q.z3) / 2 - p.m2 * p.g * q.z2 - p.m3 * p.g * q.z3


def _kepler(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * (v.r**2 + q.r**2 * v.phi**2) + p.G * p.M * p.m / q.r


def _two_bodies(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    # Jacobi's split: the centre of mass, and a particle with the reduced mass.
    total = p.m1 + p.m2
    reduced = p.m1 * p.m2 / total
    centre = [(p.m1 * v.x1 + p.m2 * v.x2) / total, (p.m1 * v.y1 + p.m2 * v.y2) / total]
    relative = [v.x2 - v.x1, v.y2 - v.y1]
    kinetic = HALF * total * sum(c**2 for c in centre) + HALF * reduced * sum(
        c**2 for c in relative
    )
    distance = sqrt((q.x2 - q.x1) ** 2 + (q.y2 - q.y1) ** 2)
    return kinetic + p.G * p.m1 * p.m2 / distance


def _figure_eight(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m * (v.xa**2 + v.ya**2 + v.xb**2 + v.yb**2 + v.xc**2 + v.yc**2)
    ab = sqrt((q.xa - q.xb) ** 2 + (q.ya - q.yb) ** 2)
    bc = sqrt((q.xb - q.xc) ** 2 + (q.yb - q.yc) ** 2)
    ca = sqrt((q.xc - q.xa) ** 2 + (q.yc - q.ya) ** 2)
    return kinetic + p.G * p.m**2 * (1 / ab + 1 / bc + 1 / ca)


def _charged_particle(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    # In the symmetric gauge A = B/2 (-y, x, 0), which gives the same equations.
    free = HALF * p.m * (v.x**2 + v.y**2 + v.z**2)
    return free + p.q * p.B / 2 * (q.x * v.y - q.y * v.x)


def _relativistic_particle(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return -p.m * p.c**2 * sqrt(1 - v.x**2 / p.c**2) + p.F * q.x


def _damped_oscillator(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * v.x**2 - HALF * p.k * q.x**2


def _coupled_oscillators(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m * (v.x1**2 + v.x2**2)
    return kinetic - HALF * p.k * (q.x1**2 + q.x2**2) - HALF * p.k2 * (q.x2 - q.x1) ** 2


def _henon_heiles(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * (v.x**2 + v.y**2)
    return kinetic - HALF * (q.x**2 + q.y**2) - q.x**2 * q.y + q.y**3 / 3


def _heavy_top(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    transverse = HALF * p.I1 * (v.theta**2 + v.phi**2 * sin(q.theta) ** 2)
    axial = HALF * p.I3 * (v.psi + v.phi * cos(q.theta)) ** 2
    return transverse + axial - p.M * p.g * p.l * cos(q.theta)


def _block_on_wedge(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    block = HALF * p.m * (v.x**2 + 2 * v.x * v.s * cos(p.alpha) + v.s**2)
    return HALF * p.M * v.x**2 + block + p.m * p.g * q.s * sin(p.alpha)


def _trammel(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * v.x**2 * p.l**2 / (p.l**2 - q.x**2)


#: Scene name → L(parameters, q, v, t).
LAGRANGIANS: Mapping[str, Callable[[Names, Names, Names, Symbol], Expr]] = {
    "bead_on_parabola": _bead_on_parabola,
    "masses_through_hole": _masses_through_hole,
    "rigid_triangle": _rigid_triangle,
    "rigid_tetrahedron": _rigid_tetrahedron,
    "rigid_tetrahedron_centre": _rigid_tetrahedron_centre,
    "particle_on_sphere": _particle_on_sphere,
    "bead_on_rotating_wire": _bead_on_rotating_wire,
    "pendulum_driven_support": _pendulum_driven_support,
    "pendulum_with_force": _pendulum,
    "lever": _lever,
    "balance": _balance,
    "pendulum": _pendulum,
    "double_pendulum": _double_pendulum,
    "pendulum_on_cart": _pendulum_on_cart,
    "spherical_pendulum": _spherical_pendulum,
    "elastic_pendulum": _elastic_pendulum,
    "swinging_spring": _swinging_spring,
    "cycloidal_pendulum": _cycloidal_pendulum,
    "bead_on_rotating_hoop": _bead_on_rotating_hoop,
    "bead_on_helix": _bead_on_helix,
    "atwood": _atwood,
    "double_atwood": _double_atwood,
    "kepler": _kepler,
    "two_bodies": _two_bodies,
    "figure_eight": _figure_eight,
    "charged_particle": _charged_particle,
    "relativistic_particle": _relativistic_particle,
    "damped_oscillator": _damped_oscillator,
    "coupled_oscillators": _coupled_oscillators,
    "henon_heiles": _henon_heiles,
    "heavy_top": _heavy_top,
    "block_on_wedge": _block_on_wedge,
    "trammel": _trammel,
}

#: Scene name → generalized forces by coordinate, beside the Lagrangian.
GENERALIZED_FORCES: Mapping[str, Callable[[Names, Names, Names, Symbol], dict[str, Expr]]] = {
    "pendulum_with_force": lambda p, q, v, t: {
        "theta": p.F0 * cos(p.Omega * t) * p.l * cos(q.theta)
    },
    "lever": lambda p, q, v, t: {"theta": -p.F * p.b * cos(q.theta)},
    "damped_oscillator": lambda p, q, v, t: {"x": -p.c * v.x},
}


def _pendulum_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    k = np.sin(q0.theta / 2)
    _, cn, dn, _ = ellipj(np.sqrt(p.g / p.l) * t, k**2)
    return {"theta": 2 * np.arcsin(k * cn / dn)}


def _wire_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    r = q0.r * np.cosh(p.omega * t)
    return {"r": r, "x": r * np.cos(p.omega * t), "y": r * np.sin(p.omega * t), "z": 0 * t}


def _triangle_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """Free symmetric top with a vertical angular momentum, I3 = 2 I1."""
    return {
        "X": q0.X + v0.X * t,
        "Y": q0.Y + v0.Y * t,
        "Z": q0.Z + v0.Z * t - p.g * t**2 / 2,
        "theta": q0.theta + 0 * t,
        "phi": q0.phi + v0.phi * t,
        "psi": q0.psi - v0.phi * np.cos(q0.theta) / 2 * t,
    }


def _tetrahedron_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """Spherical top: rotation about the constant angular velocity, in space axes."""
    start = Rotation.from_euler("ZXZ", [q0.phi, q0.theta, q0.psi])
    line = np.array([np.cos(q0.phi), np.sin(q0.phi), 0.0])
    axis = start.apply([0.0, 0.0, 1.0])
    omega = v0.theta * line + v0.psi * axis + np.array([0.0, 0.0, v0.phi])
    corner = start.apply(p.c / np.sqrt(8) * np.array([1.0, 1.0, 1.0]))
    turned = Rotation.from_rotvec(np.outer(t, omega)).apply(corner)
    return {
        "x1": q0.X + v0.X * t + turned[:, 0],
        "y1": q0.Y + v0.Y * t + turned[:, 1],
        "z1": q0.Z + v0.Z * t - p.g * t**2 / 2 + turned[:, 2],
    }


def _spherical_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """Height of a spherical pendulum that starts at a turning point (Landau, section 14)."""
    u0, rate = np.cos(q0.theta), p.g / p.l
    j = v0.phi * np.sin(q0.theta) ** 2
    h2 = (v0.phi * np.sin(q0.theta)) ** 2 - 2 * rate * u0
    # u̇² = (1 − u²)(h2 + 2 rate u) − j²
    u3, u2, u1 = np.sort(np.roots([-2 * rate, -h2, 2 * rate, h2 - j**2]).real)
    modulus = (u1 - u2) / (u1 - u3)
    phase = 0.0 if abs(u0 - u1) < abs(u0 - u2) else ellipk(modulus)
    sn, _, _, _ = ellipj(np.sqrt(rate * (u1 - u3) / 2) * t + phase, modulus)
    return {"z": -p.l * (u1 - (u1 - u2) * sn**2)}


def _cycloid_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    swing = np.sin(q0.phi / 2) * np.cos(np.sqrt(p.g / (4 * p.R)) * t)
    return {"phi": 2 * np.arcsin(swing)}


def _helix_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    pitch = getattr(p, "lambda")
    z = q0.z + v0.z * t - p.g * pitch**2 / (p.R**2 + pitch**2) * t**2 / 2
    return {"z": z, "x": p.R * np.cos(z / pitch), "y": p.R * np.sin(z / pitch)}


def _atwood_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    return {"x": q0.x + v0.x * t + (p.m1 - p.m2) / (p.m1 + p.m2) * p.g * t**2 / 2}


def _double_atwood_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    # Newton: m1 feels 2 S - m1 g, m2 and m3 feel S less their weights, S the tension.
    tension = 4 * p.g / (4 / p.m1 + 1 / p.m2 + 1 / p.m3)
    fall2, fall3 = tension / p.m2 - p.g, tension / p.m3 - p.g
    return {
        "z2": q0.z2 + v0.z2 * t + fall2 * t**2 / 2,
        "z3": q0.z3 + v0.z3 * t + fall3 * t**2 / 2,
    }


def _eccentric_anomaly(mean: Array, e: float) -> Array:
    """Solve Kepler's equation u − e sin u = n t by Newton's method."""
    u = mean + e * np.sin(mean)
    for _ in range(12):
        u = u - (u - e * np.sin(u) - mean) / (1 - e * np.cos(u))
    return u


def _kepler_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """From the perihelion: r and φ by the eccentric anomaly."""
    mu = p.G * p.M
    a = 1 / (2 / q0.r - (q0.r * v0.phi) ** 2 / mu)
    e = 1 - q0.r / a
    u = _eccentric_anomaly(np.sqrt(mu / a**3) * t, e)
    phi = u + 2 * np.arctan2(e * np.sin(u), 1 + np.sqrt(1 - e**2) - e * np.cos(u))
    return {"r": a * (1 - e * np.cos(u)), "phi": q0.phi + phi}


def _two_bodies_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """Relative motion from the perihelion on the x axis, centre of mass uniform."""
    total = p.m1 + p.m2
    orbit = SimpleNamespace(r=q0.x2 - q0.x1)
    turn = SimpleNamespace(phi=(v0.y2 - v0.y1) / orbit.r)
    orbit.phi = 0.0
    polar = _kepler_motion(SimpleNamespace(G=p.G, M=total), orbit, turn, t)
    x, y = polar["r"] * np.cos(polar["phi"]), polar["r"] * np.sin(polar["phi"])
    cx = (p.m1 * (q0.x1 + v0.x1 * t) + p.m2 * (q0.x2 + v0.x2 * t)) / total
    cy = (p.m1 * (q0.y1 + v0.y1 * t) + p.m2 * (q0.y2 + v0.y2 * t)) / total
    return {
        "x1": cx - p.m2 / total * x,
        "y1": cy - p.m2 / total * y,
        "x2": cx + p.m1 / total * x,
        "y2": cy + p.m1 / total * y,
    }


def _larmor_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    rate = p.q * p.B / p.m
    return {
        "x": q0.x + v0.x / rate * np.sin(rate * t),
        "y": q0.y - v0.x / rate * (1 - np.cos(rate * t)),
        "z": q0.z + v0.z * t,
    }


def _hyperbolic_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    s = p.F * t / (p.m * p.c)
    return {"x": q0.x + p.m * p.c**2 / p.F * (np.sqrt(1 + s**2) - 1)}


def _damped_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    decay = p.c / (2 * p.m)
    rate = np.sqrt(p.k / p.m - decay**2)
    amplitude = (v0.x + decay * q0.x) / rate
    swing = q0.x * np.cos(rate * t) + amplitude * np.sin(rate * t)
    return {"x": np.exp(-decay * t) * swing}


def _coupled_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    slow = (q0.x1 + q0.x2) / 2 * np.cos(np.sqrt(p.k / p.m) * t)
    fast = (q0.x1 - q0.x2) / 2 * np.cos(np.sqrt((p.k + 2 * p.k2) / p.m) * t)
    return {"x1": slow + fast, "x2": slow - fast}


def _wedge_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    cosine, total = np.cos(p.alpha), p.M + p.m
    along = p.g * np.sin(p.alpha) / (1 - p.m * cosine**2 / total)
    return {"s": along * t**2 / 2, "x": -p.m * cosine / total * along * t**2 / 2}


def _trammel_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    start = np.arccos(q0.x / p.l)
    rate = -v0.x / (p.l * np.sin(start))
    return {"x": p.l * np.cos(start + rate * t), "y": p.l * np.sin(start + rate * t)}


def _resting(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    return {"theta": q0.theta + 0 * t}


#: Scene name → names and their exact values at times t, from the scene's initial state.
CLOSED_FORMS: Mapping[str, Callable[[Names, Names, Names, Array], dict[str, Array]]] = {
    "pendulum": _pendulum_motion,
    "bead_on_rotating_wire": _wire_motion,
    "rigid_triangle": _triangle_motion,
    "rigid_tetrahedron": _tetrahedron_motion,
    "rigid_tetrahedron_centre": _tetrahedron_motion,
    "spherical_pendulum": _spherical_motion,
    "cycloidal_pendulum": _cycloid_motion,
    "bead_on_helix": _helix_motion,
    "atwood": _atwood_motion,
    "double_atwood": _double_atwood_motion,
    "kepler": _kepler_motion,
    "two_bodies": _two_bodies_motion,
    "charged_particle": _larmor_motion,
    "relativistic_particle": _hyperbolic_motion,
    "damped_oscillator": _damped_motion,
    "coupled_oscillators": _coupled_motion,
    "block_on_wedge": _wedge_motion,
    "trammel": _trammel_motion,
    "lever": _resting,
}
