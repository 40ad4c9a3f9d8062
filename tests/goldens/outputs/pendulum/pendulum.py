"""pendulum: Simple pendulum

A point mass on a massless rod, swinging in a vertical plane, released at rest. The angle is 2
asin(k cd(sqrt(g/l) t, k)) with k = sin(theta0/2), cd = cn/dn Jacobi's function; the period is 4
sqrt(l/g) K(k). L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 11, problem 1.

Equations of motion M(q, t) a = f(q, v, t) for y = [q, v], in the order of COORDINATES. y is one
state, or many as the columns of an array of shape (2n, m); t and parameters are then numbers or of
shape (m,), and results have m as their last axis. NaN stands for no result. SciPy: solve_ivp(rhs,
(0, 10), INITIAL, args=(DEFAULTS,), vectorized=True).

lagrange VERSION, scene with SHA-256 d8ab23885144fff672c2bbbf20ccdd4e6e5060c564f9fb77ff6792c03ba61d08
This output is yours: use it as you like, under any terms.
"""

import sys
from typing import NamedTuple

import numpy as np

# theta [rad]: angle from the downward vertical
COORDINATES = ('theta',)
CARTESIAN = ('x', 'y', 'z')
PARAMETERS = ('m', 'l', 'g')
INITIAL = np.array([2.0, 0.0])


class Parameters(NamedTuple):
    m: float = 1.0  # m [kg]: mass of the bob
    l: float = 1.0  # l [m]: length of the rod
    g: float = 9.81  # g [m/s^2]: gravitational acceleration


DEFAULTS = Parameters()


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a]."""
    m, l, g = p
    theta, theta_dot = y
    # theta: l*ddot(theta) + g*sin(theta) = 0
    w0 = m*l
    w1 = l*w0
    regular = w1 > 0.0
    check = np.sqrt(regular - 1.0)  # 0, or NaN for a singular mass matrix
    dydt = np.empty(y.shape)
    dydt[0] = theta_dot
    dydt[1] = -g*np.sin(theta)*w0/w1 + check
    return dydt


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t) of M a = f, n by n."""
    m, l, g = p
    out = np.empty((1, 1) + y.shape[1:])
    out[0, 0] = m*l*l
    return out


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    m, l, g = p
    theta, theta_dot = y
    out = np.empty((1,) + y.shape[1:])
    out[0] = -m*l*g*np.sin(theta)
    return out


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    m, l, g = p
    theta, theta_dot = y
    return m*l*(0.5*l*theta_dot*theta_dot - g*np.cos(theta))


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    m, l, g = p
    theta, theta_dot = y
    out = np.zeros((3,) + y.shape[1:])
    out[0], out[2] = l*np.sin(theta), -l*np.cos(theta)
    return out


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    m, l, g = p
    theta, theta_dot = y
    w0 = l*theta_dot
    out = np.zeros((3,) + y.shape[1:])
    out[0], out[2] = np.cos(theta)*w0, np.sin(theta)*w0
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
    given = [*INITIAL, *DEFAULTS, 20.0, 20]
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
    y, p = np.array(given[:2]), Parameters(*np.array(given[2:]))
    times = np.linspace(0.0, until, 501)
    print("t", *state, sep=",")
    for t, following in zip(times[:-1], times[1:]):
        print(t, *y, sep=",")
        y = integrate(y, t, following, steps, p)
        if not np.isfinite(y).all():
            sys.exit(f"stopped after t = {t}: the mass matrix is singular or a result not finite")
    print(until, *y, sep=",")
