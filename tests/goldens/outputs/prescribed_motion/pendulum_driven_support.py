"""pendulum_driven_support: Pendulum whose support is driven to and fro

The support moves along a horizontal line as A cos(Omega t); the rod is a constraint that depends on
time. No momentum and no energy is conserved. L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed.,
1976), section 5, problem 3b.

Equations of motion M(q, t) a = f(q, v, t) for y = [q, v], in the order of COORDINATES. y is one
state, or many as the columns of an array of shape (2n, m); t and parameters are then numbers or of
shape (m,), and results have m as their last axis. NaN stands for no result. SciPy: solve_ivp(rhs,
(0, 10), INITIAL, args=(DEFAULTS,), vectorized=True).

lagrange VERSION, scene with SHA-256 9ae90a2a153119514a6f78ff4be207ac26d4f51a66ac45ce9f56b0520f8a9276
This output is yours: use it as you like, under any terms.
"""

import sys
from typing import NamedTuple

import numpy as np

# theta [rad]: angle of the rod from the downward vertical
COORDINATES = ('theta',)
CARTESIAN = ('x', 'y', 'z', 'x_support', 'y_support', 'z_support')
PARAMETERS = ('m', 'l', 'A', 'Omega', 'g')
INITIAL = np.array([0.4, 0.0])


class Parameters(NamedTuple):
    m: float = 0.5  # m [kg]: mass of the bob
    l: float = 1.0  # l [m]: length of the rod
    A: float = 0.2  # A [m]: amplitude of the support
    Omega: float = 2.5  # Omega [rad/s]: angular frequency of the support
    g: float = 9.81  # g [m/s^2]: gravitational acceleration


DEFAULTS = Parameters()


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a]."""
    m, l, A, Omega, g = p
    theta, theta_dot = y
    # theta: l*ddot(theta) + g*sin(theta) - A*Omega^2*cos(theta)*cos(Omega*t) = 0
    w0 = m*l
    w1 = l*w0
    regular = w1 > 0.0
    check = np.sqrt(regular - 1.0)  # 0, or NaN for a singular mass matrix
    dydt = np.empty(y.shape)
    dydt[0] = theta_dot
    dydt[1] = -w0*(g*np.sin(theta) - A*Omega*Omega*np.cos(theta)*np.cos(Omega*t))/w1 + check
    return dydt


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t) of M a = f, n by n."""
    m, l, A, Omega, g = p
    out = np.empty((1, 1) + y.shape[1:])
    out[0, 0] = m*l*l
    return out


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    m, l, A, Omega, g = p
    theta, theta_dot = y
    out = np.empty((1,) + y.shape[1:])
    out[0] = -m*l*(g*np.sin(theta) - A*Omega*Omega*np.cos(theta)*np.cos(Omega*t))
    return out


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    m, l, A, Omega, g = p
    theta, theta_dot = y
    w0 = np.sin(Omega*t)*(A*Omega)
    return m*l*(0.5*l*theta_dot*theta_dot - g*np.cos(theta)) - 0.5*m*w0*w0


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    m, l, A, Omega, g = p
    theta, theta_dot = y
    w0 = A*np.cos(Omega*t)
    out = np.zeros((6,) + y.shape[1:])
    out[0], out[2], out[3] = w0 + l*np.sin(theta), -l*np.cos(theta), w0
    return out


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    m, l, A, Omega, g = p
    theta, theta_dot = y
    w0 = l*theta_dot
    w1 = A*Omega*np.sin(Omega*t)
    out = np.zeros((6,) + y.shape[1:])
    out[0], out[2], out[3] = np.cos(theta)*w0 - w1, np.sin(theta)*w0, -w1
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
    y, p = np.array(given[:2]), Parameters(*np.array(given[2:]))
    times = np.linspace(0.0, until, 501)
    print("t", *state, sep=",")
    for t, following in zip(times[:-1], times[1:]):
        print(t, *y, sep=",")
        y = integrate(y, t, following, steps, p)
        if not np.isfinite(y).all():
            sys.exit(f"stopped after t = {t}: the mass matrix is singular or a result not finite")
    print(until, *y, sep=",")
