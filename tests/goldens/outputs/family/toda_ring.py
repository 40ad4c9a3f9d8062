"""toda_ring: Toda lattice of n particles on a ring

Particles whose neighbours repel each other exponentially, closed to a ring, without any coordinates in space: the Lagrangian is given by itself. Completely integrable for every n. M. Toda, Vibration of a chain with nonlinear interaction, Journal of the Physical Society of Japan 22 (1967) 431; H. Flaschka, The Toda lattice II, Physical Review B 9 (1974) 1924.

Equations of motion M(q, t) a = f(q, v, t). The state y holds the coordinates q in
the order of COORDINATES, then their velocities v. Every function takes (t, y, p) with
p a Parameters, and returns NaN where there is no result (a singular mass matrix, a
domain error, overflow). With SciPy:

    solve_ivp(rhs, (0, 10), INITIAL, args=(DEFAULTS,))

Made by lagrange VERSION from the scene with SHA-256
a55af92be334a2abe3e9f6fa1120b97fe248272a6c83ded23a758b84640d2f7f
This output is yours: use it as you like, under any terms.
"""

import sys
from math import exp, nan
from typing import NamedTuple

import numpy as np


COORDINATES = ('q[1]', 'q[2]', 'q[3]', 'q[4]', 'q[5]')
CARTESIAN = ()
PARAMETERS = ()

INITIAL = [0.9510565162951535, 0.5877852522924731, -0.5877852522924731, -0.9510565162951535, 0.0, -0.4045084971874737, 0.15450849718747373, 0.15450849718747373, -0.4045084971874737, 0.5]
START, UNTIL, ROWS, STEPS = 0.0, 10.0, 500, 20


class Parameters(NamedTuple):
    """Parameters; NaN stands for one that must be given."""


DEFAULTS = Parameters()


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a] at time t; all NaN where it does not exist."""
    try:
        q_q_1, q_q_2, q_q_3, q_q_4, q_q_5, v_q_1, v_q_2, v_q_3, v_q_4, v_q_5 = np.asarray(y, dtype=float).tolist()
        w0 = exp(q_q_1 - q_q_2)
        w1 = exp(-q_q_1 + q_q_5)
        w2 = exp(q_q_2 - q_q_3)
        w3 = exp(q_q_3 - q_q_4)
        w4 = exp(q_q_4 - q_q_5)
        if not 1.0 > 0.0:
            return np.full(10, nan)
        if not 1.0 > 0.0:
            return np.full(10, nan)
        if not 1.0 > 0.0:
            return np.full(10, nan)
        if not 1.0 > 0.0:
            return np.full(10, nan)
        if not 1.0 > 0.0:
            return np.full(10, nan)
        return np.array([v_q_1, v_q_2, v_q_3, v_q_4, v_q_5, -w0 + w1, w0 - w2, w2 - w3, w3 - w4, -w1 + w4], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(10, nan)


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t), n by n, of M a = f."""
    try:
        return np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], dtype=float).reshape(5, 5)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full((5, 5), nan)


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    try:
        q_q_1, q_q_2, q_q_3, q_q_4, q_q_5, v_q_1, v_q_2, v_q_3, v_q_4, v_q_5 = np.asarray(y, dtype=float).tolist()
        w0 = exp(q_q_1 - q_q_2)
        w1 = exp(-q_q_1 + q_q_5)
        w2 = exp(q_q_2 - q_q_3)
        w3 = exp(q_q_3 - q_q_4)
        w4 = exp(q_q_4 - q_q_5)
        return np.array([-w0 + w1, w0 - w2, w2 - w3, w3 - w4, -w1 + w4], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(5, nan)


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    try:
        q_q_1, q_q_2, q_q_3, q_q_4, q_q_5, v_q_1, v_q_2, v_q_3, v_q_4, v_q_5 = np.asarray(y, dtype=float).tolist()
        w0 = (
            5.0 - 0.5*v_q_1*v_q_1 - 0.5*v_q_2*v_q_2 - 0.5*v_q_3*v_q_3 - 0.5*v_q_4*v_q_4 -
            0.5*v_q_5*v_q_5 - exp(q_q_1 - q_q_2) - exp(q_q_2 - q_q_3) - exp(q_q_3 - q_q_4) -
            exp(q_q_4 - q_q_5) - exp(-q_q_1 + q_q_5)
        )
        return float(-w0)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return nan


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    try:
        return np.array([], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(0, nan)


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    try:
        return np.array([], dtype=float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return np.full(0, nan)


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
