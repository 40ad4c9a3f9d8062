"""double_pendulum: Double pendulum

Two point masses on massless rods, the second hung from the first, in a vertical plane. Both angles
are taken from the downward vertical. Chaotic at large amplitudes. L. D. Landau and E. M. Lifshitz,
Mechanics (3rd ed., 1976), section 5, problem 1.

Equations of motion M(q, t) a = f(q, v, t) for y = [q, v], in the order of COORDINATES. y is one
state, or many as the columns of an array of shape (2n, m); t and parameters are then numbers or of
shape (m,), and results have m as their last axis. NaN stands for no result. SciPy: solve_ivp(rhs,
(0, 10), INITIAL, args=(DEFAULTS,), vectorized=True).

lagrange VERSION, scene with SHA-256 608b30109126f091f647f3cf513a931dabd5513f457625dc33716b33ba5af17b
This output is yours: use it as you like, under any terms.
"""

import sys
from typing import NamedTuple

import numpy as np

# theta1 [rad]: angle of the upper rod from the downward vertical
# theta2 [rad]: angle of the lower rod from the downward vertical
COORDINATES = ('theta1', 'theta2')
CARTESIAN = ('x1', 'y1', 'z1', 'x2', 'y2', 'z2')
PARAMETERS = ('m1', 'm2', 'l1', 'l2', 'g')
INITIAL = np.array([1.5, 2.0, 0.0, 0.0])


class Parameters(NamedTuple):
    m1: float = 1.0  # m1 [kg]: mass of the upper bob
    m2: float = 1.0  # m2 [kg]: mass of the lower bob
    l1: float = 1.0  # l1 [m]: length of the upper rod
    l2: float = 1.0  # l2 [m]: length of the lower rod
    g: float = 9.81  # g [m/s^2]: gravitational acceleration


DEFAULTS = Parameters()


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a]."""
    m1, m2, l1, l2, g = p
    theta1, theta2, theta1_dot, theta2_dot = y
    w0 = theta1 - theta2
    w1 = np.sin(w0)
    w2 = m2*w1
    w3 = l1*np.cos(w0)
    w4 = theta1_dot*theta1_dot
    w5 = l1*(m1 + w1*w2)
    w6 = (m1*g*np.sin(theta1) + w2*(g*np.cos(theta2) + l2*theta2_dot*theta2_dot + w3*w4))/w5
    regular = (m2*l2*l2 > 0.0) & (l1*w5 > 0.0)
    check = np.sqrt(regular - 1.0)  # 0, or NaN for a singular mass matrix
    dydt = np.empty(y.shape)
    dydt[:2] = y[2:]
    dydt[2] = -w6 + check
    dydt[3] = -((g*np.sin(theta2) - l1*w1*w4) - w6*w3)/l2 + check
    return dydt


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t) of M a = f, n by n."""
    m1, m2, l1, l2, g = p
    theta1, theta2, theta1_dot, theta2_dot = y
    w0 = m2*l2
    out = np.empty((2, 2) + y.shape[1:])
    out[0, 0] = l1*l1*(m1 + m2)
    out[0, 1] = out[1, 0] = l1*np.cos(theta1 - theta2)*w0
    out[1, 1] = l2*w0
    return out


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    m1, m2, l1, l2, g = p
    theta1, theta2, theta1_dot, theta2_dot = y
    w0 = m2*l2
    w1 = np.sin(theta1 - theta2)*(l1*w0)
    out = np.empty((2,) + y.shape[1:])
    out[0] = -l1*g*(m1 + m2)*np.sin(theta1) - theta2_dot*theta2_dot*w1
    out[1] = -g*np.sin(theta2)*w0 + theta1_dot*theta1_dot*w1
    return out


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    m1, m2, l1, l2, g = p
    theta1, theta2, theta1_dot, theta2_dot = y
    w0 = l1*theta1_dot
    w1 = w0*w0
    w2 = l1*np.cos(theta1)
    w3 = l2*theta2_dot
    return (
        m1*(0.5*w1 - g*w2) + m2*(0.5*(w1 + w3*(w3 + 2.0*np.cos(theta1 - theta2)*w0)) - g*(w2 +
        l2*np.cos(theta2)))
    )


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    m1, m2, l1, l2, g = p
    theta1, theta2, theta1_dot, theta2_dot = y
    w0 = l1*np.sin(theta1)
    w1 = l1*np.cos(theta1)
    out = np.zeros((6,) + y.shape[1:])
    out[0], out[2], out[3], out[5] = w0, -w1, w0 + l2*np.sin(theta2), -w1 - l2*np.cos(theta2)
    return out


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    m1, m2, l1, l2, g = p
    theta1, theta2, theta1_dot, theta2_dot = y
    w0 = l1*theta1_dot
    w1 = np.cos(theta1)*w0
    w2 = np.sin(theta1)*w0
    w3 = l2*theta2_dot
    out = np.zeros((6,) + y.shape[1:])
    out[0], out[2], out[3], out[5] = w1, w2, w1 + np.cos(theta2)*w3, w2 + np.sin(theta2)*w3
    return out


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
    y, p = np.array(given[:4]), Parameters(*np.array(given[4:]))
    times = np.linspace(0.0, until, 501)
    print("t", *state, sep=",")
    for t, following in zip(times[:-1], times[1:]):
        print(t, *y, sep=",")
        y = integrate(y, t, following, steps, p)
        if not np.isfinite(y).all():
            sys.exit(f"stopped after t = {t}: the mass matrix is singular or a result not finite")
    print(until, *y, sep=",")
