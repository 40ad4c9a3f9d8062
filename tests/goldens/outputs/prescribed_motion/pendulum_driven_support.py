"""pendulum_driven_support: Pendulum whose support is driven to and fro

The support moves along a horizontal line as A cos(Omega t); the rod is a constraint that depends on time. No momentum and no energy is conserved. L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 5, problem 3b.

Equations of motion M(q, t) a = f(q, v, t). The state y holds the coordinates q in
the order of COORDINATES, then their velocities v. Every function takes (t, y, p) with
p a Parameters, and returns NaN where there is no result (a singular mass matrix, a
domain error, overflow). With SciPy:

    solve_ivp(rhs, (0, 10), INITIAL, args=(DEFAULTS,))

Made by lagrange VERSION from the scene with SHA-256
9ae90a2a153119514a6f78ff4be207ac26d4f51a66ac45ce9f56b0520f8a9276
This output is yours: use it as you like, under any terms.
"""

import sys
from math import cos, nan, sin
from typing import NamedTuple

import numpy as np


# theta [rad]: angle of the rod from the downward vertical
COORDINATES = ('theta',)
CARTESIAN = ('x', 'y', 'z', 'x_support', 'y_support', 'z_support')
PARAMETERS = ('m', 'l', 'A', 'Omega', 'g')

INITIAL = [0.4, 0.0]
START, UNTIL, ROWS, STEPS = 0.0, 10.0, 500, 20


class Parameters(NamedTuple):
    """Parameters; NaN stands for one that must be given."""
    m: float = 0.5  # m [kg]: mass of the bob
    l: float = 1.0  # l [m]: length of the rod
    A: float = 0.2  # A [m]: amplitude of the support
    Omega: float = 2.5  # Omega [rad/s]: angular frequency of the support
    g: float = 9.81  # g [m/s^2]: gravitational acceleration


DEFAULTS = Parameters()


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a] at time t; all NaN where it does not exist."""
    try:
        p_m, p_l, p_A, p_Omega, p_g = p
        q_theta, v_theta = np.asarray(y, dtype=float).tolist()
        w0 = p_m*p_l
        w1 = p_l*w0
        if not w1 > 0.0:
            return np.full(2, nan)
        return np.array([v_theta, -w0*(p_g*sin(q_theta) - p_A*p_Omega*p_Omega*cos(q_theta)*cos(p_Omega*t))/w1], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(2, nan)


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t), n by n, of M a = f."""
    try:
        p_m, p_l, p_A, p_Omega, p_g = p
        m0 = p_m*p_l*p_l
        return np.array([m0], dtype=float).reshape(1, 1)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full((1, 1), nan)


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    try:
        p_m, p_l, p_A, p_Omega, p_g = p
        q_theta, v_theta = np.asarray(y, dtype=float).tolist()
        return np.array([-p_m*p_l*(p_g*sin(q_theta) - p_A*p_Omega*p_Omega*cos(q_theta)*cos(p_Omega*t))], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(1, nan)


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    try:
        p_m, p_l, p_A, p_Omega, p_g = p
        q_theta, v_theta = np.asarray(y, dtype=float).tolist()
        w0 = p_l*v_theta
        w1 = sin(p_Omega*t)*(p_A*p_Omega)
        return float(0.5*p_m*(w0*w0 - w1*w1 - 2.0*p_l*p_g*cos(q_theta)))
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return nan


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    try:
        p_m, p_l, p_A, p_Omega, p_g = p
        q_theta, v_theta = np.asarray(y, dtype=float).tolist()
        w0 = p_A*cos(p_Omega*t)
        return np.array([w0 + p_l*sin(q_theta), 0.0, -p_l*cos(q_theta), w0, 0.0, 0.0], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(6, nan)


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    try:
        p_m, p_l, p_A, p_Omega, p_g = p
        q_theta, v_theta = np.asarray(y, dtype=float).tolist()
        w0 = p_l*v_theta
        w1 = p_A*p_Omega*sin(p_Omega*t)
        return np.array([cos(q_theta)*w0 - w1, 0.0, sin(q_theta)*w0, -w1, 0.0, 0.0], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(6, nan)


def integrate(y, t, until, steps, p=DEFAULTS):
    """State after ``steps`` classical Runge-Kutta steps of fixed size from t to until."""
    h = (until - t) / steps
    for k in range(steps):
        s = t + k * h
        k1 = rhs(s, y, p)
        k2 = rhs(s + h / 2, y + h / 2 * k1, p)
        k3 = rhs(s + h / 2, y + h / 2 * k2, p)
        k4 = rhs(s + h, y + h * k3, p)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return y


def main(arguments):
    """Integrate from INITIAL and print CSV; NAME=VALUE sets parameters and initial
    values, until=T and steps=N (steps in an interval) the run."""
    state = [*COORDINATES, *(f"dot({name})" for name in COORDINATES)]
    parameters = dict(zip(PARAMETERS, DEFAULTS))
    initial = dict(zip(state, INITIAL or [nan] * len(state)))
    run = {"until": UNTIL, "steps": STEPS}
    for argument in arguments:
        name, _, value = argument.partition("=")
        try:
            table = next(table for table in (initial, parameters, run) if name in table)
            table[name] = type(table[name])(value)
        except (StopIteration, ValueError):
            return f"{argument}: not NAME=NUMBER with a known name"
    given = {**initial, **parameters}
    missing = [name for name, value in given.items() if value != value]
    if missing:
        return f"values needed: {', '.join(f'{name}=VALUE' for name in missing)}"
    p, y = Parameters(*parameters.values()), np.array(list(initial.values()))
    times = np.linspace(START, run["until"], ROWS + 1).tolist()
    print(",".join(["t", *state]))
    for t, following in zip(times, [*times[1:], None]):
        print(",".join(map(repr, [t, *y.tolist()])))
        if following is not None:
            y = integrate(y, t, following, run["steps"], p)
        if not np.isfinite(y).all():
            return f"stopped after t = {t}: the mass matrix is singular or a result not finite"
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
