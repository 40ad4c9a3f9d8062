"""damped_driven_pendulum: Damped driven pendulum

A pendulum with friction in its hinge, driven by a torque that varies as cos(omega t). With the
dimensionless strength of the drive gamma = 1.073 its motion settles to one of twice the period of
the drive; from 1.0829 on it is chaotic. J. R. Taylor, Classical Mechanics (2005), chapter 12.

Equations of motion M(q, t) a = f(q, v, t) for y = [q, v], in the order of COORDINATES. y is one
state, or many as the columns of an array of shape (2n, m); t and parameters are then numbers or of
shape (m,), and results have m as their last axis. NaN stands for no result. SciPy: solve_ivp(rhs,
(0, 10), INITIAL, args=(DEFAULTS,), vectorized=True).

lagrange VERSION, scene with SHA-256 5823946e160ed59aa7ed0ce9a8e0bb53bfff928d45867c3c5fe557d6e7229055
This output is yours: use it as you like, under any terms.
"""

import sys
from typing import NamedTuple

import numpy as np

# phi [rad]: angle of the rod from the downward vertical
COORDINATES = ('phi',)
CARTESIAN = ('x_bob', 'y_bob', 'z_bob')
PARAMETERS = ('m', 'omega', 'omega0', 'beta', 'gamma', 'g', 'l')
INITIAL = np.array([-1.5707963267948966, 0.0])


class Parameters(NamedTuple):
    m: float = 0.1  # m [kg]: mass of the bob
    omega: float = 6.283185307179586  # omega [rad/s]: angular frequency of the drive
    omega0: float = 9.42477796076938  # omega0 [rad/s]: natural angular frequency
    beta: float = 2.356194490192345  # beta [1/s]: damping
    gamma: float = 1.073  # gamma: torque of the drive over the greatest torque of the weight
    g: float = 9.81  # g [m/s^2]: gravitational acceleration
    l: float = 0.11044009017014816  # l [m]: length of the rod


DEFAULTS = Parameters()


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a]."""
    m, omega, omega0, beta, gamma, g, l = p
    phi, phi_dot = y
    # phi: l*ddot(phi) + 2*beta*l*dot(phi) + g*sin(phi) - gamma*g*cos(omega*t) = 0
    w0 = m*l
    w1 = l*w0
    regular = w1 > 0.0
    check = np.sqrt(regular - 1.0)  # 0, or NaN for a singular mass matrix
    dydt = np.empty(y.shape)
    dydt[0] = phi_dot
    dydt[1] = -(2.0*beta*phi_dot*w1 + g*w0*(np.sin(phi) - gamma*np.cos(omega*t)))/w1 + check
    return dydt


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t) of M a = f, n by n."""
    m, omega, omega0, beta, gamma, g, l = p
    out = np.empty((1, 1) + y.shape[1:])
    out[0, 0] = m*l*l
    return out


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    m, omega, omega0, beta, gamma, g, l = p
    phi, phi_dot = y
    w0 = m*l
    out = np.empty((1,) + y.shape[1:])
    out[0] = -2.0*beta*l*phi_dot*w0 - g*w0*(np.sin(phi) - gamma*np.cos(omega*t))
    return out


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    m, omega, omega0, beta, gamma, g, l = p
    phi, phi_dot = y
    return m*l*(0.5*l*phi_dot*phi_dot - g*np.cos(phi))


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    m, omega, omega0, beta, gamma, g, l = p
    phi, phi_dot = y
    out = np.zeros((3,) + y.shape[1:])
    out[0], out[2] = l*np.sin(phi), -l*np.cos(phi)
    return out


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    m, omega, omega0, beta, gamma, g, l = p
    phi, phi_dot = y
    w0 = l*phi_dot
    out = np.zeros((3,) + y.shape[1:])
    out[0], out[2] = np.cos(phi)*w0, np.sin(phi)*w0
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
