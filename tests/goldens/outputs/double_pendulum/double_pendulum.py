"""double_pendulum: Double pendulum

Two point masses on massless rods, the second hung from the first, in a vertical plane. Both angles are taken from the downward vertical. Chaotic at large amplitudes. L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 5, problem 1.

Equations of motion M(q, t) a = f(q, v, t). The state y holds the coordinates q in
the order of COORDINATES, then their velocities v. Every function takes (t, y, p) with
p a Parameters, and returns NaN where there is no result (a singular mass matrix, a
domain error, overflow). With SciPy:

    solve_ivp(rhs, (0, 10), INITIAL, args=(DEFAULTS,))

Made by lagrange VERSION from the scene with SHA-256
608b30109126f091f647f3cf513a931dabd5513f457625dc33716b33ba5af17b
This output is yours: use it as you like, under any terms.
"""

import sys
from math import cos, nan, sin
from typing import NamedTuple

import numpy as np


# theta1 [rad]: angle of the upper rod from the downward vertical
# theta2 [rad]: angle of the lower rod from the downward vertical
COORDINATES = ('theta1', 'theta2')
CARTESIAN = ('x1', 'y1', 'z1', 'x2', 'y2', 'z2')
PARAMETERS = ('m1', 'm2', 'l1', 'l2', 'g')

INITIAL = [1.5, 2.0, 0.0, 0.0]
START, UNTIL, ROWS, STEPS = 0.0, 10.0, 500, 20


class Parameters(NamedTuple):
    """Parameters; NaN stands for one that must be given."""
    m1: float = 1.0  # m1 [kg]: mass of the upper bob
    m2: float = 1.0  # m2 [kg]: mass of the lower bob
    l1: float = 1.0  # l1 [m]: length of the upper rod
    l2: float = 1.0  # l2 [m]: length of the lower rod
    g: float = 9.81  # g [m/s^2]: gravitational acceleration


DEFAULTS = Parameters()


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a] at time t; all NaN where it does not exist."""
    try:
        p_m1, p_m2, p_l1, p_l2, p_g = p
        q_theta1, q_theta2, v_theta1, v_theta2 = np.asarray(y, dtype=float).tolist()
        w0 = q_theta1 - q_theta2
        w1 = sin(w0)
        w2 = p_m2*w1
        w3 = p_l1*cos(w0)
        w4 = v_theta1*v_theta1
        w5 = p_l1*(p_m1 + w1*w2)
        w6 = (
            (p_m1*p_g*sin(q_theta1) + w2*(p_g*cos(q_theta2) + p_l2*v_theta2*v_theta2 +
            w3*w4))/w5
        )
        if not p_m2*p_l2*p_l2 > 0.0:
            return np.full(4, nan)
        if not p_l1*w5 > 0.0:
            return np.full(4, nan)
        return np.array([v_theta1, v_theta2, -w6, -((p_g*sin(q_theta2) - p_l1*w1*w4) - w6*w3)/p_l2], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(4, nan)


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t), n by n, of M a = f."""
    try:
        p_m1, p_m2, p_l1, p_l2, p_g = p
        q_theta1, q_theta2, v_theta1, v_theta2 = np.asarray(y, dtype=float).tolist()
        w0 = p_m2*p_l2
        m0 = p_l1*p_l1*(p_m1 + p_m2)
        m1 = p_l1*cos(q_theta1 - q_theta2)*w0
        m2 = p_l2*w0
        return np.array([m0, m1, m1, m2], dtype=float).reshape(2, 2)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full((2, 2), nan)


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    try:
        p_m1, p_m2, p_l1, p_l2, p_g = p
        q_theta1, q_theta2, v_theta1, v_theta2 = np.asarray(y, dtype=float).tolist()
        w0 = p_m2*p_l2
        w1 = sin(q_theta1 - q_theta2)*(p_l1*w0)
        return np.array([-p_l1*p_g*(p_m1 + p_m2)*sin(q_theta1) - v_theta2*v_theta2*w1, -p_g*sin(q_theta2)*w0 + v_theta1*v_theta1*w1], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(2, nan)


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    try:
        p_m1, p_m2, p_l1, p_l2, p_g = p
        q_theta1, q_theta2, v_theta1, v_theta2 = np.asarray(y, dtype=float).tolist()
        w0 = p_l1*v_theta1
        w1 = w0*w0
        w2 = p_l1*cos(q_theta1)
        w3 = p_l2*v_theta2
        w4 = (
            p_m1*(0.5*w1 - p_g*w2) + p_m2*(0.5*(w1 + w3*(w3 + 2.0*cos(q_theta1 - q_theta2)*w0))
            - p_g*(w2 + p_l2*cos(q_theta2)))
        )
        return float(w4)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return nan


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    try:
        p_m1, p_m2, p_l1, p_l2, p_g = p
        q_theta1, q_theta2, v_theta1, v_theta2 = np.asarray(y, dtype=float).tolist()
        w0 = p_l1*sin(q_theta1)
        w1 = p_l1*cos(q_theta1)
        return np.array([w0, 0.0, -w1, w0 + p_l2*sin(q_theta2), 0.0, -w1 - p_l2*cos(q_theta2)], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(6, nan)


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    try:
        p_m1, p_m2, p_l1, p_l2, p_g = p
        q_theta1, q_theta2, v_theta1, v_theta2 = np.asarray(y, dtype=float).tolist()
        w0 = p_l1*v_theta1
        w1 = cos(q_theta1)*w0
        w2 = sin(q_theta1)*w0
        w3 = p_l2*v_theta2
        return np.array([w1, 0.0, w2, w1 + cos(q_theta2)*w3, 0.0, w2 + sin(q_theta2)*w3], dtype=float)
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
