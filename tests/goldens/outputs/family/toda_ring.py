"""toda_ring: Toda lattice of n particles on a ring

Particles whose neighbours repel each other exponentially, closed to a ring, without any coordinates
in space: the Lagrangian is given by itself. Completely integrable for every n. M. Toda, Vibration
of a chain with nonlinear interaction, Journal of the Physical Society of Japan 22 (1967) 431; H.
Flaschka, The Toda lattice II, Physical Review B 9 (1974) 1924.

Equations of motion M(q, t) a = f(q, v, t) for y = [q, v], in the order of COORDINATES. y is one
state, or many as the columns of an array of shape (2n, m); t and parameters are then numbers or of
shape (m,), and results have m as their last axis. NaN stands for no result. SciPy: solve_ivp(rhs,
(0, 10), INITIAL, args=(DEFAULTS,), vectorized=True).

lagrange VERSION, scene with SHA-256 a55af92be334a2abe3e9f6fa1120b97fe248272a6c83ded23a758b84640d2f7f
This output is yours: use it as you like, under any terms.
"""

import sys
from typing import NamedTuple

import numpy as np

COORDINATES = ('q[1]', 'q[2]', 'q[3]', 'q[4]', 'q[5]')
CARTESIAN = ()
PARAMETERS = ()
INITIAL = (
    np.array([0.9510565162951535, 0.5877852522924731, -0.5877852522924731, -0.9510565162951535, 0.0,
    -0.4045084971874737, 0.15450849718747373, 0.15450849718747373, -0.4045084971874737, 0.5])
)


class Parameters(NamedTuple):
    pass


DEFAULTS = Parameters()


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a]."""
    q_1, q_2, q_3, q_4, q_5, q_1_dot, q_2_dot, q_3_dot, q_4_dot, q_5_dot = y
    w0 = np.exp(q_1 - q_2)
    w1 = np.exp(-q_1 + q_5)
    w2 = np.exp(q_2 - q_3)
    w3 = np.exp(q_3 - q_4)
    w4 = np.exp(q_4 - q_5)
    dydt = np.empty(y.shape)
    dydt[:5] = y[5:]
    dydt[5], dydt[6], dydt[7], dydt[8], dydt[9] = -w0 + w1, w0 - w2, w2 - w3, w3 - w4, -w1 + w4
    return dydt


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t) of M a = f, n by n."""
    out = np.zeros((5, 5) + y.shape[1:])
    out[0, 0] = 1.0
    out[1, 1] = 1.0
    out[2, 2] = 1.0
    out[3, 3] = 1.0
    out[4, 4] = 1.0
    return out


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    q_1, q_2, q_3, q_4, q_5, q_1_dot, q_2_dot, q_3_dot, q_4_dot, q_5_dot = y
    w0 = np.exp(q_1 - q_2)
    w1 = np.exp(-q_1 + q_5)
    w2 = np.exp(q_2 - q_3)
    w3 = np.exp(q_3 - q_4)
    w4 = np.exp(q_4 - q_5)
    out = np.empty((5,) + y.shape[1:])
    out[0], out[1], out[2], out[3], out[4] = -w0 + w1, w0 - w2, w2 - w3, w3 - w4, -w1 + w4
    return out


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    q_1, q_2, q_3, q_4, q_5, q_1_dot, q_2_dot, q_3_dot, q_4_dot, q_5_dot = y
    w0 = (
        5.0 - 0.5*(q_1_dot*q_1_dot + q_2_dot*q_2_dot + q_3_dot*q_3_dot + q_4_dot*q_4_dot +
        q_5_dot*q_5_dot) - np.exp(q_1 - q_2) - np.exp(q_2 - q_3) - np.exp(q_3 - q_4) - np.exp(q_4 -
        q_5) - np.exp(-q_1 + q_5)
    )
    return -w0


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    return np.empty((0,) + y.shape[1:])


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    return np.empty((0,) + y.shape[1:])


def integrate(y, t, until, steps, p=DEFAULTS):
    """State after ``steps`` classical Runge-Kutta steps of one size from t to until."""
    h = (until - t)/steps
    for k in range(steps):
        s = t + k*h
        k1 = rhs(s, y, p)
        k2 = rhs(s + h/2, y + h/2*k1, p)
        k3 = rhs(s + h/2, y + h/2*k2, p)
        k4 = rhs(s + h, y + h*k3, p)
        y = y + h/6*(k1 + 2*k2 + 2*k3 + k4)
    return y


if __name__ == "__main__":
    np.seterr(all="ignore")
    state = [*COORDINATES, *(f"dot({name})" for name in COORDINATES)]
    names = [*state, *PARAMETERS, "until", "steps"]
    given = [*INITIAL, *DEFAULTS, 10.0, 20]
    for argument in sys.argv[1:]:
        name, _, value = argument.partition("=")
        try:
            k = names.index(name)
            given[k] = type(given[k])(value)
            if not np.isfinite(given[k]) or given[-1] < 1:
                raise ValueError
        except ValueError:
            sys.exit(f"{argument}: not NAME=NUMBER with a known name")
    *given, until, steps = given
    y, p = np.array(given[:10]), Parameters(*np.array(given[10:]))
    times = np.linspace(0.0, until, 501)
    print("t", *state, sep=",")
    for t, following in zip(times[:-1], times[1:]):
        print(t, *y, sep=",")
        y = integrate(y, t, following, steps, p)
        if not np.isfinite(y).all():
            sys.exit(f"stopped after t = {t}: the mass matrix is singular or a result not finite")
    print(until, *y, sep=",")
