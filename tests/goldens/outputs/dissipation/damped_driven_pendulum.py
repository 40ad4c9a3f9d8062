"""damped_driven_pendulum: Damped driven pendulum

A pendulum with friction in its hinge, driven by a torque that varies as cos(omega t). With the dimensionless strength of the drive gamma = 1.073 its motion settles to one of twice the period of the drive; from 1.0829 on it is chaotic. J. R. Taylor, Classical Mechanics (2005), chapter 12.

Equations of motion M(q, t) a = f(q, v, t). The state y holds the coordinates q in
the order of COORDINATES, then their velocities v. Every function takes (t, y, p) with
p a Parameters, and returns NaN where there is no result (a singular mass matrix, a
domain error, overflow). With SciPy:

    solve_ivp(rhs, (0, 10), INITIAL, args=(DEFAULTS,))

Made by lagrange VERSION from the scene with SHA-256
5823946e160ed59aa7ed0ce9a8e0bb53bfff928d45867c3c5fe557d6e7229055
This output is yours: use it as you like, under any terms.
"""

import sys
from math import cos, nan, sin
from typing import NamedTuple

import numpy as np


# phi [rad]: angle of the rod from the downward vertical
COORDINATES = ('phi',)
CARTESIAN = ('x_bob', 'y_bob', 'z_bob')
PARAMETERS = ('m', 'omega', 'omega0', 'beta', 'gamma', 'g', 'l')

INITIAL = [-1.5707963267948966, 0.0]
START, UNTIL, ROWS, STEPS = 0.0, 10.0, 500, 20


class Parameters(NamedTuple):
    """Parameters; NaN stands for one that must be given."""
    m: float = 0.1  # m [kg]: mass of the bob
    omega: float = 6.283185307179586  # omega [rad/s]: angular frequency of the drive
    omega0: float = 9.42477796076938  # omega0 [rad/s]: natural angular frequency
    beta: float = 2.356194490192345  # beta [1/s]: damping
    gamma: float = 1.073  # gamma: torque of the drive over the greatest torque of the weight
    g: float = 9.81  # g [m/s^2]: gravitational acceleration
    l: float = 0.11044009017014816  # l [m]: length of the rod


DEFAULTS = Parameters()


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a] at time t; all NaN where it does not exist."""
    try:
        p_m, p_omega, p_omega0, p_beta, p_gamma, p_g, p_l = p
        q_phi, v_phi = np.asarray(y, dtype=float).tolist()
        w0 = p_m*p_l
        w1 = p_l*w0
        if not w1 > 0.0:
            return np.full(2, nan)
        return np.array([v_phi, -(2.0*p_beta*v_phi*w1 + p_g*w0*(sin(q_phi) - p_gamma*cos(p_omega*t)))/w1], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(2, nan)


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t), n by n, of M a = f."""
    try:
        p_m, p_omega, p_omega0, p_beta, p_gamma, p_g, p_l = p
        m0 = p_m*p_l*p_l
        return np.array([m0], dtype=float).reshape(1, 1)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full((1, 1), nan)


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    try:
        p_m, p_omega, p_omega0, p_beta, p_gamma, p_g, p_l = p
        q_phi, v_phi = np.asarray(y, dtype=float).tolist()
        w0 = p_m*p_l
        return np.array([-2.0*p_beta*p_l*v_phi*w0 - p_g*w0*(sin(q_phi) - p_gamma*cos(p_omega*t))], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(1, nan)


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    try:
        p_m, p_omega, p_omega0, p_beta, p_gamma, p_g, p_l = p
        q_phi, v_phi = np.asarray(y, dtype=float).tolist()
        return float(p_m*p_l*(0.5*p_l*v_phi*v_phi - p_g*cos(q_phi)))
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return nan


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    try:
        p_m, p_omega, p_omega0, p_beta, p_gamma, p_g, p_l = p
        q_phi, v_phi = np.asarray(y, dtype=float).tolist()
        return np.array([p_l*sin(q_phi), 0.0, -p_l*cos(q_phi)], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(3, nan)


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    try:
        p_m, p_omega, p_omega0, p_beta, p_gamma, p_g, p_l = p
        q_phi, v_phi = np.asarray(y, dtype=float).tolist()
        w0 = p_l*v_phi
        return np.array([cos(q_phi)*w0, 0.0, sin(q_phi)*w0], dtype=float)
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
