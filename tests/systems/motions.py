"""Motions in closed form, typed by hand; nothing here is taken from the program's output."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation
from scipy.special import ellipj, ellipk

from tests.systems.recordings import rows

Array = NDArray[np.float64]
Names = SimpleNamespace


def _pendulum_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    k = np.sin(q0.theta / 2)
    _, cn, dn, _ = ellipj(np.sqrt(p.g / p.l) * t, k**2)
    return {"theta": 2 * np.arcsin(k * cn / dn)}


def _gear_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """A pendulum with the inertia of all wheels; the sun turns 2 (a + b)/a times as fast."""
    arm, sun, planet = p.a + p.b, 2 * (p.a + p.b) / p.a, (p.a + p.b) / p.b
    inertia = p.m * arm**2 + p.J * planet**2 + p.S * sun**2
    like = SimpleNamespace(g=p.g, l=inertia / (p.m * arm))
    theta = _pendulum_motion(like, q0, v0, t)["theta"]
    turned = theta - q0.theta
    return {"theta": theta, "psi": q0.psi - planet * turned, "alpha": q0.alpha + sun * turned}


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


def _driven_spring_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    own = np.sqrt(p.k / p.m)
    factor = p.A * own**2 / (own**2 - p.w**2)
    x = factor * (np.sin(p.w * t) - p.w / own * np.sin(own * t))
    stretch = x - p.A * np.sin(p.w * t)
    return {"x": x, "stretch": stretch, "pull": -p.k * stretch}


def _seismometer_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """From row to row by the closed form for an acceleration that is a straight line in time."""
    known = np.array(rows("oscillators/seismometer.csv", "acceleration"), dtype=float)
    decay, stiffness = p.c / p.m, p.k / p.m
    own = np.sqrt(stiffness - decay**2 / 4)
    x, v, found = q0.x, v0.x, np.full(len(t), q0.x)
    for (start, a), (end, b) in pairwise(known):
        inside = (t > start) & (t <= end)
        slope = -(b - a) / (end - start) / stiffness
        offset = (-a - decay * slope) / stiffness
        cosine, sine = x - offset, (v - slope + decay / 2 * (x - offset)) / own
        h = np.append(t[inside], end) - start
        fade, turn = np.exp(-decay / 2 * h), own * h
        free = fade * (cosine * np.cos(turn) + sine * np.sin(turn))
        found[inside] = (free + offset + slope * h)[:-1]
        rate = fade * own * (sine * np.cos(turn) - cosine * np.sin(turn)) - decay / 2 * free
        x, v = free[-1] + offset + slope * h[-1], rate[-1] + slope
    return {"x": found, "ground": np.interp(t, *known.T)}


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


def _tautochrone_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    starts = {name: SimpleNamespace(phi=getattr(q0, name)) for name in ("phi1", "phi2", "phi3")}
    return {name: _cycloid_motion(p, start, v0, t)["phi"] for name, start in starts.items()}


def _rolling_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    swing = SimpleNamespace(g=p.g, l=1.5 * (p.R - p.a))
    return {"phi": _pendulum_motion(swing, SimpleNamespace(theta=q0.phi), v0, t)["theta"]}


def _foucault_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """x + i y of a plane oscillator released at rest in turning axes."""
    turning = p.Omega * np.sin(p.latitude)
    rate = np.sqrt(p.g / p.l + turning**2)
    swing = np.cos(rate * t) + 1j * turning / rate * np.sin(rate * t)
    place = (q0.x + 1j * q0.y) * np.exp(-1j * turning * t) * swing
    return {"x": place.real, "y": place.imag}


def _penning_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """Modified cyclotron, magnetron and axial motion (Brown and Gabrielse 1986)."""
    cyclotron, axial = p.q * p.B / p.m, np.sqrt(p.q * p.V0 / p.m) / p.d
    half = np.sqrt(cyclotron**2 / 4 - axial**2 / 2)
    fast, slow = cyclotron / 2 + half, cyclotron / 2 - half
    place, velocity = q0.x + 1j * q0.y, v0.x + 1j * v0.y
    large = (1j * velocity - slow * place) / (fast - slow)
    epicycle = large * np.exp(-1j * fast * t) + (place - large) * np.exp(-1j * slow * t)
    return {"x": epicycle.real, "y": epicycle.imag, "z": q0.z * np.cos(axial * t)}


def _wilberforce_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """Normal modes of a motion from rest."""
    stiffness = np.array([[p.k, p.epsilon / 2], [p.epsilon / 2, p.delta]])
    mass = np.diag([p.m, p.I])
    squares, modes = eigh(stiffness, mass)
    amplitudes = modes.T @ mass @ np.array([q0.z, q0.theta])
    z, theta = modes @ (amplitudes[:, None] * np.cos(np.outer(np.sqrt(squares), t)))
    return {"z": z, "theta": theta}


def _calogero_moser_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """Eigenvalues of X cos wt + L/w sin wt, X the places and L the Lax matrix at the start."""
    x = np.array([q0.x1, q0.x2, q0.x3])
    gaps = x[:, None] - x + np.eye(3)
    lax = np.diag([v0.x1, v0.x2, v0.x3]) + 1j * p.c * (1 - np.eye(3)) / gaps
    matrices = [np.diag(x) * np.cos(a) + lax / p.w * np.sin(a) for a in p.w * t]
    return dict(zip(("x1", "x2", "x3"), np.linalg.eigvalsh(matrices).T, strict=True))


def _asymmetric_motion(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """Euler's equations by Jacobi's functions (Landau and Lifshitz 37.10), M along the vertical.

    The start has ω1 = 0, a quarter of a period after the origin of the book's time.
    """
    i1, i2, i3 = p.I1, p.I2, p.I3
    energy2 = p.J**2 * (np.cos(p.delta) ** 2 / i2 + np.sin(p.delta) ** 2 / i3)
    upper, lower = energy2 * i3 - p.J**2, p.J**2 - energy2 * i1
    modulus = (i2 - i1) * upper / ((i3 - i2) * lower)
    rate = np.sqrt((i3 - i2) * lower / (i1 * i2 * i3))
    sn, cn, dn, _ = ellipj(rate * t + ellipk(modulus), modulus)
    first = i1 * np.sqrt(upper / (i1 * (i3 - i1))) * cn
    second = i2 * np.sqrt(upper / (i2 * (i3 - i2))) * sn
    third = i3 * np.sqrt(lower / (i3 * (i3 - i1))) * dn
    return {"theta": np.arccos(third / p.J), "psi": np.unwrap(np.arctan2(first, second))}


def _triangle_of_lagrange(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    """The triangle keeps its shape; its side moves as a Kepler orbit about the whole mass."""
    orbit, turn = SimpleNamespace(r=p.s, phi=0.0), SimpleNamespace(phi=p.w)
    polar = _kepler_motion(SimpleNamespace(G=p.G, M=p.ma + p.mb + p.mc), orbit, turn, t)
    similarity = polar["r"] / p.s * np.exp(1j * polar["phi"])
    found = {}
    for body in "abc":
        place = complex(getattr(q0, f"x{body}"), getattr(q0, f"y{body}")) * similarity
        found |= {f"x{body}": place.real, f"y{body}": place.imag}
    return found


def _resting(p: Names, q0: Names, v0: Names, t: Array) -> dict[str, Array]:
    return {"theta": q0.theta + 0 * t}


#: Scene name → names and their exact values at times t, from the scene's initial state.
CLOSED_FORMS: Mapping[str, Callable[[Names, Names, Names, Array], dict[str, Array]]] = {
    "pendulum": _pendulum_motion,
    "bead_on_rotating_wire": _wire_motion,
    "coupled_gears": _gear_motion,
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
    "driven_spring": _driven_spring_motion,
    "seismometer": _seismometer_motion,
    "coupled_oscillators": _coupled_motion,
    "block_on_wedge": _wedge_motion,
    "trammel": _trammel_motion,
    "lever": _resting,
    "tautochrone": _tautochrone_motion,
    "rolling_cylinder": _rolling_motion,
    "foucault_pendulum": _foucault_motion,
    "penning_trap": _penning_motion,
    "wilberforce_pendulum": _wilberforce_motion,
    "calogero_moser": _calogero_moser_motion,
    "free_asymmetric_top": _asymmetric_motion,
    "lagrange_triangle": _triangle_of_lagrange,
}
