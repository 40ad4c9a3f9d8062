"""pendulum: Simple pendulum

A point mass on a massless rod, swinging in a vertical plane, released at rest. The angle is 2 asin(k cd(sqrt(g/l) t, k)) with k = sin(theta0/2), cd = cn/dn Jacobi's function; the period is 4 sqrt(l/g) K(k). L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 11, problem 1.

Equations of motion M(q, t) a = f(q, v, t). The state y holds the coordinates q in
the order of COORDINATES, then their velocities v. Every function takes (t, y, p) with
p a Parameters, and returns NaN where there is no result (a singular mass matrix, a
domain error, overflow). With SciPy:

    solve_ivp(rhs, (0, 10), INITIAL, args=(DEFAULTS,))

y may hold many states, as the columns of an array of shape (2n, m); t and each parameter
are then numbers or arrays of shape (m,). Results have the shape that they have for one
state, with m behind it, and NaN for states without a result. With SciPy, vectorized=True.

Made by lagrange VERSION from the scene with SHA-256
d8ab23885144fff672c2bbbf20ccdd4e6e5060c564f9fb77ff6792c03ba61d08
This output is yours: use it as you like, under any terms.
"""

import sys
from functools import cache
from math import cos, nan, sin
from types import FunctionType
from typing import NamedTuple

import numpy as np
from numpy import array, asarray


# What is done otherwise with arrays of states.
_holds = bool
_number = float
_numbers = np.ndarray.tolist
_shaped = np.ndarray.reshape


def _undefined(shape, *given):
    """What a function returns where it has no result."""
    if any(map(np.ndim, given)):
        raise ValueError("t and the parameters are numbers where y is one state")
    return np.full(shape, nan)


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


#: Axes of y for one state; more are states beside each other.
_AXES = 1


def _of_many(function, t, y, p, *others, few=16):
    """What a function gives at the states in the columns of y, with these as its last axis; t and
    the parameters are numbers, or have one for each state.
    """
    if y.ndim != 2 or len(y) != 2 * len(COORDINATES):
        n = 2 * len(COORDINATES)
        raise ValueError(f"y has the shape {y.shape}, not ({n},) or ({n}, m)")
    m = y.shape[1]
    t, *p = [np.asarray(value, float) for value in (t, *p)]
    for name, value in zip(("t", *PARAMETERS), (t, *p)):
        if value.shape not in ((), (m,)):
            raise ValueError(f"{name} has the shape {value.shape}, not () or ({m},)")
    if not m:
        alone = function(0.0, np.full(len(y), nan), DEFAULTS, *others)
        return np.empty((*np.shape(alone), 0))
    return _evaluated(function, t, y, p, others, few)


def _evaluated(function, t, y, p, others, few):
    """The same by functions of NumPy. Where something goes wrong there, states are halved and the
    last few taken one by one: so NaN stays with the state that has no result.
    """
    m = y.shape[1]
    finite = np.isfinite(y).all(axis=0)
    if m <= few:
        return np.stack([_at(k, function, t, y, p, others) for k in range(m)], axis=-1)
    if finite.all():
        try:
            with np.errstate(all="raise", under="ignore"):
                out = _at(..., _array_functions()[function.__name__], t, y, p, others)
            return np.array(np.broadcast_to(out, (*out.shape[:-1], m)))
        except (ArithmeticError, TypeError, ValueError, np.linalg.LinAlgError):
            pass
    half = np.arange(m) < m // 2 if finite.all() or not finite.any() else finite
    for part in (half, ~half):
        values = (value[part] if value.ndim else value for value in (t, *p))
        found = _evaluated(function, next(values), y[:, part], list(values), others, few)
        if part is half:
            out = np.empty((*found.shape[:-1], m))
        out[..., part] = found
    return out


def _at(k, function, t, y, p, others):
    """What a function gives at state number k, or at all (...)."""
    t, *p = [value[k] if value.ndim else value for value in (t, *p)]
    t, *p = [float(value) if not np.ndim(value) else value for value in (t, *p)]
    return function(t, y[:, k], Parameters(*p), *others)


def _stacked(values, _):
    """The array of what is given, numbers or one for each state, with these as its last axis."""
    out = np.empty((len(values), max(map(np.size, values), default=1)))
    for row, value in zip(out, values):
        row[:] = value
    return out


def _irregular(shape, *_):
    """Where a function has no result: at some of the states."""
    raise ArithmeticError("no result at some state")


@cache
def _array_functions():
    """The functions of this module with those of NumPy in place of those of numbers."""
    names = {**globals(), **_OF_ARRAYS}
    for name, function in globals().items():
        if getattr(function, "__globals__", None) is globals() and name not in _OF_ARRAYS:
            code, given = function.__code__.replace(), function.__defaults__
            names[name] = FunctionType(code, names, name, given, function.__closure__)
    return names


#: Names of functions of numbers, and what they are for arrays.
_OF_ARRAYS = {
    "sin": np.sin,
    "cos": np.cos,
    "array": _stacked,
    "_AXES": 2,
    "_undefined": _irregular,
    "_holds": np.all,
    "_number": np.asarray,
    "_numbers": np.asarray,
    "_shaped": lambda a, *shape: a.reshape(*shape, -1),
}


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a] at time t; all NaN where it does not exist."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(rhs, t, y, p)
    try:
        p_m, p_l, p_g = p
        q_theta, v_theta = _numbers(y)
        w0 = p_m*p_l
        w1 = p_l*w0
        regular = w1 > 0.0
        if not _holds(regular):
            return _undefined(2, t, *p)
        return array([v_theta, -p_g*sin(q_theta)*w0/w1], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t), n by n, of M a = f."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(mass_matrix, t, y, p)
    try:
        p_m, p_l, p_g = p
        m0 = p_m*p_l*p_l
        return _shaped(array([m0], float), 1, 1)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined((1, 1), t, *p)


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(forcing, t, y, p)
    try:
        p_m, p_l, p_g = p
        q_theta, v_theta = _numbers(y)
        return array([-p_m*p_l*p_g*sin(q_theta)], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(1, t, *p)


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(energy, t, y, p)
    try:
        p_m, p_l, p_g = p
        q_theta, v_theta = _numbers(y)
        return _number(p_m*p_l*(0.5*p_l*v_theta*v_theta - p_g*cos(q_theta)))
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _number(_undefined((), t, *p))


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(positions, t, y, p)
    try:
        p_m, p_l, p_g = p
        q_theta, v_theta = _numbers(y)
        return array([p_l*sin(q_theta), 0.0, -p_l*cos(q_theta)], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(3, t, *p)


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(velocities, t, y, p)
    try:
        p_m, p_l, p_g = p
        q_theta, v_theta = _numbers(y)
        w0 = p_l*v_theta
        return array([cos(q_theta)*w0, 0.0, sin(q_theta)*w0], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(3, t, *p)


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
