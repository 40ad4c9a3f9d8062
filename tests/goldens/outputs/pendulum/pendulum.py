"""pendulum: Simple pendulum

A point mass on a massless rod, swinging in a vertical plane, released at rest. The angle is 2 asin(k cd(sqrt(g/l) t, k)) with k = sin(theta0/2), cd = cn/dn Jacobi's function; the period is 4 sqrt(l/g) K(k). L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 11, problem 1.

Equations of motion M(q, t) a = f(q, v, t). The state y holds the coordinates q in
the order of COORDINATES, then their velocities v. Every function takes (t, y, p) with
p a Parameters, and returns NaN where there is no result (a singular mass matrix, a
domain error, overflow). With SciPy:

    solve_ivp(rhs, (0, 10), INITIAL, args=(DEFAULTS,))

Made by lagrange VERSION from the scene with SHA-256
9026f7bac4ba64776743278ccd80f930012f3881a0ea10f9b800090fbb7dfee1
This output is yours: use it as you like, under any terms.
"""

import sys
from math import cos, nan, sin
from typing import NamedTuple

import numpy as np


# theta [rad]: angle from the downward vertical
COORDINATES = ('theta',)
CARTESIAN = ('x', 'y', 'z')
PARAMETERS = ('m', 'l', 'g')

INITIAL = [2.0, 0.0]
START, UNTIL, ROWS, STEPS = 0.0, 20.0, 500, 20


class Parameters(NamedTuple):
    """Parameters; NaN stands for one that must be given."""
    m: float = 1.0  # m [kg]: mass of the bob
    l: float = 1.0  # l [m]: length of the rod
    g: float = 9.81  # g [m/s^2]: gravitational acceleration


DEFAULTS = Parameters()


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a] at time t; all NaN where it does not exist."""
    try:
        p_m, p_l, p_g = p
        q_theta, v_theta = np.asarray(y, dtype=float).tolist()
        w0 = p_m*p_l
        w1 = p_l*w0
        if not w1 > 0.0:
            return np.full(2, nan)
        return np.array([v_theta, -p_g*sin(q_theta)*w0/w1], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(2, nan)


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t), n by n, of M a = f."""
    try:
        p_m, p_l, p_g = p
        m0 = p_m*p_l*p_l
        return np.array([m0], dtype=float).reshape(1, 1)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full((1, 1), nan)


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    try:
        p_m, p_l, p_g = p
        q_theta, v_theta = np.asarray(y, dtype=float).tolist()
        return np.array([-p_m*p_l*p_g*sin(q_theta)], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(1, nan)


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    try:
        p_m, p_l, p_g = p
        q_theta, v_theta = np.asarray(y, dtype=float).tolist()
        return float(p_m*p_l*(0.5*p_l*v_theta*v_theta - p_g*cos(q_theta)))
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return nan


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    try:
        p_m, p_l, p_g = p
        q_theta, v_theta = np.asarray(y, dtype=float).tolist()
        return np.array([p_l*sin(q_theta), 0.0, -p_l*cos(q_theta)], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(3, nan)


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    try:
        p_m, p_l, p_g = p
        q_theta, v_theta = np.asarray(y, dtype=float).tolist()
        w0 = p_l*v_theta
        return np.array([cos(q_theta)*w0, 0.0, sin(q_theta)*w0], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(3, nan)


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
