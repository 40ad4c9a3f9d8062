"""What the books say about the shipped scenes, typed by hand.

:data:`LAGRANGIANS` holds a Lagrangian for each scene, :data:`GENERALIZED_FORCES`
what is not in the Lagrangian. Nothing here is taken from the program's output.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace

from sympy import Expr, Rational, Symbol, cos, exp, sin, sqrt

from tests.systems.recordings import linear
from tests.systems.textbook_bodies import BODIES, BODIES_FORCES
from tests.systems.textbook_celestial import CELESTIAL
from tests.systems.textbook_chains import CHAINS
from tests.systems.textbook_constraints import CONSTRAINED, CONSTRAINED_FORCES
from tests.systems.textbook_contacts import IN_FLIGHT

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


def _thrown_ball(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * (v.x**2 + v.z**2) - p.m * p.g * q.z


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


def _two_blocks_on_wedge(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    fall = p.m1 * sin(p.alpha) - p.m2 * sin(p.beta)
    return HALF * (p.m1 + p.m2) * v.s1**2 + fall * p.g * q.s1


def _ladder_held_by_rope(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return p.m * p.l**2 * v.theta**2 / 6 - HALF * p.m * p.g * p.l * sin(q.theta)


def _toggle_press(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * (p.m + 4 * p.M * sin(q.theta) ** 2) * p.l**2 * v.theta**2


def _compound_pulley(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * (p.M + 16 * p.m) * v.s**2 + (4 * p.m - p.M) * p.g * q.s


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


def _hoist(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * (p.l0 - p.s * t) ** 2 * v.theta**2 + p.m * p.g * (p.l0 - p.s * t) * cos(
        q.theta
    )


def _pumped_swing(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    length = p.l0 + p.a * sin(2 * sqrt(p.g / p.l0) * t)
    return HALF * p.m * length**2 * v.theta**2 + p.m * p.g * length * cos(q.theta)


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


def _charged_particle(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    # In the symmetric gauge A = B/2 (-y, x, 0), which gives the same equations.
    free = HALF * p.m * (v.x**2 + v.y**2 + v.z**2)
    return free + p.q * p.B / 2 * (q.x * v.y - q.y * v.x)


def _relativistic_particle(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return -p.m * p.c**2 * sqrt(1 - v.x**2 / p.c**2) + p.F * q.x


def _damped_oscillator(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * v.x**2 - HALF * p.k * q.x**2


def _seismometer(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * v.x**2 - HALF * p.k * q.x**2


def _seismometer_forces(p: Names, q: Names, v: Names, t: Symbol) -> dict[str, Expr]:
    ground = linear("oscillators/seismometer.csv", "acceleration", t)
    return {"x": -p.c * v.x - p.m * ground}


def _driven_spring(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * v.x**2 - HALF * p.k * (q.x - p.A * sin(p.w * t)) ** 2


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


def _swinging_atwood(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * (p.M + p.m) * v.r**2 + HALF * p.m * q.r**2 * v.theta**2
    return kinetic - p.g * q.r * (p.M - p.m * cos(q.theta))


def _driven_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * p.l**2 * v.phi**2 + p.m * p.g * p.l * cos(q.phi)


def _kapitza_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    # The vibrating support adds its acceleration to that of gravity.
    weight = p.g - p.A * p.Omega**2 * cos(p.Omega * t)
    return HALF * p.m * p.l**2 * v.theta**2 + p.m * weight * p.l * cos(q.theta)


def _zieglers_column(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    inertia = p.m * p.l**2
    across = inertia * v.theta1 * v.theta2 * cos(q.theta1 - q.theta2)
    kinetic = HALF * inertia * (3 * v.theta1**2 + v.theta2**2) + across
    return kinetic - HALF * p.k * (q.theta1**2 + (q.theta2 - q.theta1) ** 2)


def _follower_force(p: Names, q: Names, v: Names, t: Symbol) -> dict[str, Expr]:
    # The force of the tip's link turns the lower one by its arm, and not the upper one.
    bending = v.theta2 - v.theta1
    return {
        "theta1": p.P * p.l * sin(q.theta1 - q.theta2) - p.c * v.theta1 + p.c * bending,
        "theta2": -p.c * bending,
    }


def _support_on_circle(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    # Landau and Lifshitz, section 5, problem 3a, in our sense of rotation.
    support = p.m * p.l * p.a * p.Omega**2 * sin(q.phi - p.Omega * t)
    return _driven_pendulum(p, q, v, t) + support


def _coupled_pendulums(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    across = p.d + p.l * (sin(q.theta2) - sin(q.theta1))
    upwards = p.l * (cos(q.theta1) - cos(q.theta2))
    stretch = sqrt(across**2 + upwards**2) - p.d
    kinetic = HALF * p.m * p.l**2 * (v.theta1**2 + v.theta2**2)
    weight = p.m * p.g * p.l * (cos(q.theta1) + cos(q.theta2))
    return kinetic + weight - HALF * p.k * stretch**2


def _foucault_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    # In polar coordinates by hand: m Ω_z r² φ̇ is the Coriolis term.
    turning = p.Omega * sin(p.latitude) * (q.x * v.y - q.y * v.x)
    swing = HALF * (v.x**2 + v.y**2) - p.g / p.l * HALF * (q.x**2 + q.y**2)
    return p.m * (swing + turning)


def _triple_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    angles, rates = (q.theta1, q.theta2, q.theta3), (v.theta1, v.theta2, v.theta3)
    hung = (3, 2, 1)
    own = sum(n * HALF * w**2 for n, w in zip(hung, rates, strict=True))
    mixed = sum(
        hung[j] * rates[i] * rates[j] * cos(angles[i] - angles[j])
        for i, j in ((0, 1), (0, 2), (1, 2))
    )
    weight = sum(n * cos(a) for n, a in zip(hung, angles, strict=True))
    return p.m * p.l**2 * (own + mixed) + p.m * p.g * p.l * weight


def _furuta_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    arm = HALF * (p.J + p.m * p.r**2 + p.m * p.l**2 * sin(q.theta) ** 2) * v.phi**2
    mixed = p.m * p.r * p.l * cos(q.theta) * v.phi * v.theta
    return arm + mixed + HALF * p.m * p.l**2 * v.theta**2 - p.m * p.g * p.l * cos(q.theta)


def _inverted_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * (p.M + p.m) * v.p**2 + HALF * (p.J + p.m * p.l**2) * v.theta**2
    mixed = p.m * p.l * cos(q.theta) * v.p * v.theta
    return kinetic - mixed - p.m * p.g * p.l * cos(q.theta)


def _tautochrone(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    beads = ((q.phi1, v.phi1), (q.phi2, v.phi2), (q.phi3, v.phi3))
    return sum(
        2 * p.m * p.R * (p.R * cos(a / 2) ** 2 * w**2 - p.g * sin(a / 2) ** 2) for a, w in beads
    )


def _particle_on_cone(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m * (v.r**2 + q.r**2 * sin(p.alpha) ** 2 * v.phi**2)
    return kinetic - p.m * p.g * q.r * cos(p.alpha)


def _particle_on_torus(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * p.m * (p.a**2 * v.theta**2 + (p.R + p.a * cos(q.theta)) ** 2 * v.phi**2)


def _duffing_oscillator(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * v.x**2 + HALF * q.x**2 - q.x**4 / 4


def _van_der_pol_oscillator(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return HALF * (v.x**2 - q.x**2)


def _toda_lattice(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * (v.q1**2 + v.q2**2 + v.q3**2)
    return kinetic - exp(q.q1 - q.q2) - exp(q.q2 - q.q3) - exp(q.q3 - q.q1)


def _calogero_moser(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    well = sum(HALF * (w**2 - p.w**2 * x**2) for x, w in _pairs(q, v, "x1", "x2", "x3"))
    gaps = (q.x2 - q.x1, q.x3 - q.x2, q.x3 - q.x1)
    return well - p.c**2 * sum(gap**-2 for gap in gaps)


def _pairs(q: Names, v: Names, *names: str) -> list[tuple[Symbol, Symbol]]:
    return [(getattr(q, name), getattr(v, name)) for name in names]


def _wilberforce_pendulum(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * p.m * v.z**2 + HALF * p.I * v.theta**2
    springs = p.k * q.z**2 + p.delta * q.theta**2 + p.epsilon * q.z * q.theta
    return kinetic - HALF * springs


def _relativistic_oscillator(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    return -p.m * p.c**2 * sqrt(1 - v.x**2 / p.c**2) - HALF * p.k * q.x**2


def _free_asymmetric_top(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    # Angular velocity in body axes, Landau and Lifshitz (35.1).
    first = v.phi * sin(q.theta) * sin(q.psi) + v.theta * cos(q.psi)
    second = v.phi * sin(q.theta) * cos(q.psi) - v.theta * sin(q.psi)
    third = v.phi * cos(q.theta) + v.psi
    return HALF * (p.I1 * first**2 + p.I2 * second**2 + p.I3 * third**2)


def _rolling_cylinder(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    radius = p.R - p.a
    return 3 * p.m * radius**2 * v.phi**2 / 4 + p.m * p.g * radius * cos(q.phi)


def _penning_trap(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    # In the gauge A = B (-y, 0, 0), which gives the same equations.
    kinetic = HALF * p.m * (v.x**2 + v.y**2 + v.z**2)
    quadrupole = p.q * p.V0 / (4 * p.d**2) * (2 * q.z**2 - q.x**2 - q.y**2)
    return kinetic - p.q * p.B * q.y * v.x - quadrupole


def _magnetic_dipole(p: Names, q: Names, v: Names, t: Symbol) -> Expr:
    kinetic = HALF * (v.rho**2 + q.rho**2 * v.phi**2 + v.z**2)
    return kinetic + q.rho**2 * v.phi / sqrt(q.rho**2 + q.z**2) ** 3


#: Scene name → L(parameters, q, v, t).
LAGRANGIANS: Mapping[str, Callable[[Names, Names, Names, Symbol], Expr]] = {
    "bead_on_parabola": _bead_on_parabola,
    "masses_through_hole": _masses_through_hole,
    "rigid_triangle": _rigid_triangle,
    "rigid_tetrahedron": _rigid_tetrahedron,
    "rigid_tetrahedron_centre": _rigid_tetrahedron_centre,
    "particle_on_sphere": _particle_on_sphere,
    "bead_on_rotating_wire": _bead_on_rotating_wire,
    "thrown_ball": _thrown_ball,
    "pendulum_driven_support": _pendulum_driven_support,
    "pendulum_with_force": _pendulum,
    "lever": _lever,
    "balance": _balance,
    "two_blocks_on_wedge": _two_blocks_on_wedge,
    "ladder_held_by_rope": _ladder_held_by_rope,
    "toggle_press": _toggle_press,
    "compound_pulley": _compound_pulley,
    "pendulum": _pendulum,
    "double_pendulum": _double_pendulum,
    "pendulum_on_cart": _pendulum_on_cart,
    "hoist": _hoist,
    "pumped_swing": _pumped_swing,
    "spherical_pendulum": _spherical_pendulum,
    "elastic_pendulum": _elastic_pendulum,
    "swinging_spring": _swinging_spring,
    "cycloidal_pendulum": _cycloidal_pendulum,
    "bead_on_rotating_hoop": _bead_on_rotating_hoop,
    "bead_on_helix": _bead_on_helix,
    "atwood": _atwood,
    "double_atwood": _double_atwood,
    "charged_particle": _charged_particle,
    "relativistic_particle": _relativistic_particle,
    "damped_oscillator": _damped_oscillator,
    "driven_spring": _driven_spring,
    "seismometer": _seismometer,
    "coupled_oscillators": _coupled_oscillators,
    "henon_heiles": _henon_heiles,
    "heavy_top": _heavy_top,
    "block_on_wedge": _block_on_wedge,
    "trammel": _trammel,
    "swinging_atwood": _swinging_atwood,
    "damped_driven_pendulum": _driven_pendulum,
    "kapitza_pendulum": _kapitza_pendulum,
    "zieglers_column": _zieglers_column,
    "pendulum_support_on_circle": _support_on_circle,
    "coupled_pendulums": _coupled_pendulums,
    "foucault_pendulum": _foucault_pendulum,
    "triple_pendulum": _triple_pendulum,
    "furuta_pendulum": _furuta_pendulum,
    "inverted_pendulum_on_cart": _inverted_pendulum,
    "tautochrone": _tautochrone,
    "particle_on_cone": _particle_on_cone,
    "particle_on_torus": _particle_on_torus,
    "duffing_oscillator": _duffing_oscillator,
    "van_der_pol_oscillator": _van_der_pol_oscillator,
    "toda_lattice": _toda_lattice,
    "calogero_moser": _calogero_moser,
    "wilberforce_pendulum": _wilberforce_pendulum,
    "relativistic_oscillator": _relativistic_oscillator,
    "free_asymmetric_top": _free_asymmetric_top,
    "rolling_cylinder": _rolling_cylinder,
    "penning_trap": _penning_trap,
    "magnetic_dipole": _magnetic_dipole,
    **BODIES,
    **CELESTIAL,
    **CHAINS,
    **CONSTRAINED,
    **IN_FLIGHT,
}

#: Scene name → generalized forces by coordinate, beside the Lagrangian.
GENERALIZED_FORCES: Mapping[str, Callable[[Names, Names, Names, Symbol], dict[str, Expr]]] = {
    "pendulum_with_force": lambda p, q, v, t: {
        "theta": p.F0 * cos(p.Omega * t) * p.l * cos(q.theta)
    },
    **CONSTRAINED_FORCES,
    **BODIES_FORCES,
    "zieglers_column": _follower_force,
    "lever": lambda p, q, v, t: {"theta": -p.F * p.b * cos(q.theta)},
    "ladder_held_by_rope": lambda p, q, v, t: {"theta": p.F * p.l * sin(q.theta)},
    "toggle_press": lambda p, q, v, t: {
        "theta": p.l * (2 * p.R * sin(q.theta) - p.P * cos(q.theta))
    },
    "damped_oscillator": lambda p, q, v, t: {"x": -p.c * v.x},
    "seismometer": _seismometer_forces,
    "damped_driven_pendulum": lambda p, q, v, t: {
        "phi": p.gamma * p.m * p.g * p.l * cos(p.omega * t) - 2 * p.beta * p.m * p.l**2 * v.phi
    },
    "duffing_oscillator": lambda p, q, v, t: {"x": p.gamma * cos(p.omega * t) - p.delta * v.x},
    "van_der_pol_oscillator": lambda p, q, v, t: {"x": p.mu * (1 - q.x**2) * v.x},
    "inverted_pendulum_on_cart": lambda p, q, v, t: {
        "p": p.k1 * q.p + p.k2 * v.p - p.k3 * q.theta - p.k4 * v.theta - p.c * v.p,
        "theta": -p.gamma * v.theta,
    },
}
