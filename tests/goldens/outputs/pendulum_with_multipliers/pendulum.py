"""pendulum: Simple pendulum

A point mass on a massless rod, swinging in a vertical plane, released at rest. The angle is 2 asin(k cd(sqrt(g/l) t, k)) with k = sin(theta0/2), cd = cn/dn Jacobi's function; the period is 4 sqrt(l/g) K(k). L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 11, problem 1.

Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with the closures of
MULTIPLIERS beside them: l[k] is the multiplier and g[k] the gradient of closure k, so
that l[k]*g[k] is the generalized force that it exerts. project leads a state back to
the closures, to be called after each step. The state y holds the coordinates q in
the order of COORDINATES, then their velocities v. Every function takes (t, y, p) with
p a Parameters, and returns NaN where there is no result (a singular configuration, a
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
from functools import cache, partial
from math import inf, nan
from types import FunctionType
from typing import NamedTuple

import numpy as np
from numpy import array, asarray


# What is done otherwise with arrays of states.
_number = float
_numbers = np.ndarray.tolist
_shaped = np.ndarray.reshape


def _undefined(shape, *given):
    """What a function returns where it has no result."""
    if any(map(np.ndim, given)):
        raise ValueError("t and the parameters are numbers where y is one state")
    return np.full(shape, nan)


def _residual(out):
    """The largest residual in units of the last place of the magnitudes that follow them."""
    m = len(out) // 2
    return (np.abs(out[:m]) / np.spacing(out[m:])).max()


def _coupled_residual(out, squares):
    """The same where changes of all coordinates are found together, and rounded together: the
    magnitude of one residual counts for another as far as a change of the coordinates that
    makes the one does the other; ``squares`` are those of the gradients.
    """
    m = len(out) // 2
    slopes = np.sqrt(squares)
    reach = np.max(out[m:][slopes > 0.0] / slopes[slopes > 0.0], initial=0.0)
    beside = np.where(np.isfinite(reach * slopes), reach * slopes, 0.0)
    return _residual(np.concatenate([out[:m], np.maximum(out[m:], beside)]))


def _solve_saddle(a, b, n):
    """[x, l] of M x = f + G^T l, G x = g, from [[M, G^T], [G, 0]], [f, g] and the number
    of x; units do not matter (equilibration by powers of two after Bunch, J. ACM 18, 566).
    Where M is nearly singular the solution is refined once (Skeel, Math. Comput. 35, 817).
    """
    with np.errstate(all="ignore"):
        s, size = len(b), np.abs(a[:n, :n]).max()
        unit = np.ldexp(1.0, -np.frexp(size)[1]) if size > 0.0 else 1.0
        a[:n, :n] *= unit
        b[:n] *= unit
        d = np.zeros(s)
        uneven = _is_uneven(a[:n, :n])
        if uneven:
            d[:n] = _inertia_scales(a, n)
        stuck = False
        while not d.all():
            before = np.count_nonzero(d)
            for i in np.flatnonzero(d == 0.0):
                entries = np.abs(a[i]) * (1.0 if stuck else d)
                size = max(entries.max(), np.sqrt(np.abs(a[i, i])))
                if size > 0.0:
                    d[i] = 1.0 if stuck else np.ldexp(1.0, -np.frexp(size)[1])
                    stuck = False
            if np.count_nonzero(d) == before:
                if stuck:
                    raise ArithmeticError("a row of zeros")
                stuck = True
        a *= d[:, None]
        a *= d
        b *= d
        x = _solve_pivoted(a.copy(), b.copy())
        if uneven:
            x += _solve_pivoted(a.copy(), b - a @ x)
        x *= d
        x[n:] /= -unit
        if not np.isfinite(x).all():
            raise ArithmeticError("not finite")
        return x


def _is_uneven(m):
    """Whether elimination leaves little of an inertia; coordinates without any do not count."""
    c = m.copy()
    for k, own in enumerate(m.diagonal()):
        rest = c[k, k + 1 :]
        if not (c[k, k] > 0.00390625 * own if own > 7.888609052210118e-31 else not np.delete(m[k], k).any()):
            return True
        if rest.any():
            c[k + 1 :, k + 1 :] -= np.outer(rest / c[k, k], rest)
    return False


def _inertia_scales(a, n):
    """One over the root of the inertia of each coordinate, or of w g^2 where that is more, for
    the gradient g of each closure and the second smallest w of inertias over g^2 that it meets
    (if there are two); 0 without either.
    """
    inertia = a.diagonal()[:n]
    own = np.where(inertia != 0.0, np.frexp(inertia)[1], -65536)
    sizes = own.copy()
    for g in a[n:, :n]:
        exponents = 2 * np.frexp(g)[1]
        both = (g != 0.0) & (inertia != 0.0)
        if both.any():
            smallest = np.sort((own - exponents)[both])[:2]
            sizes = np.where(
                g != 0.0, np.maximum(sizes, min(smallest[-1], 100) + exponents), sizes
            )
    return np.where(sizes > -65536, np.ldexp(1.0, -np.ceil(sizes / 2).astype(int)), 0.0)


def _solve_pivoted(a, b):
    """x of a x = b by elimination with partial pivoting; a and b are overwritten."""
    s = len(b)
    for j in range(s):
        best = j + np.argmax(np.abs(a[j:, j]))
        if not abs(a[best, j]) > s * 2.0**-53:
            raise ArithmeticError("a singular matrix")
        a[[j, best]] = a[[best, j]]
        b[[j, best]] = b[[best, j]]
        ratio = a[j + 1 :, j] / a[j, j]
        a[j + 1 :, j:] -= ratio[:, None] * a[j, j:]
        b[j + 1 :] -= ratio * b[j]
    for j in reversed(range(s)):
        b[j] = (b[j] - a[j, j + 1 :] @ b[j + 1 :]) / a[j, j]
    return b


COORDINATES = ('x', 'z')
CARTESIAN = ('y',)
PARAMETERS = ('m', 'l', 'g')
# bob: x = l*sin(theta), z = -l*cos(theta)
MULTIPLIERS = ('bob',)
RESIDUALS = ('bob', 'rate of bob')

INITIAL = [0.9092974268256817, 0.4161468365471424, 0.0, 0.0]
START, UNTIL, ROWS, STEPS = 0.0, 20.0, 500, 20


class Parameters(NamedTuple):
    """Parameters; NaN stands for one that must be given."""
    m: float = 1.0  # m [kg]: mass of the bob
    l: float = 1.0  # l [m]: length of the rod
    g: float = 9.81  # g [m/s^2]: gravitational acceleration


DEFAULTS = Parameters()


#: Axes of y for one state; more are states beside each other.
_AXES = 1


def _solve_saddles(a, b, n):
    """The same for many states, all of them regular and even; else an ArithmeticError."""
    with np.errstate(all="ignore"):
        states, s = (a[0, 0] * b[0]).shape, len(b)
        a, b = a + np.zeros(states), b + np.zeros(states)
        size = np.abs(a[:n, :n]).max(axis=(0, 1))
        unit = np.where(size > 0.0, np.ldexp(1.0, -np.frexp(size)[1]), 1.0)
        a[:n, :n] *= unit
        b[:n] *= unit
        _refuse_uneven(a[:n, :n])
        d = np.zeros(b.shape)
        for i in [*range(s)] * s:
            size = np.maximum((np.abs(a[i]) * d).max(axis=0), np.sqrt(np.abs(a[i, i])))
            new = (d[i] == 0.0) & (size > 0.0)
            d[i] = np.where(new, np.ldexp(1.0, -np.frexp(size)[1]), d[i])
            if d.all():
                break
        a *= d[:, None] * d
        x = d * _solve_pivoted_each(a, d * b)
        x[n:] /= -unit
        return x


def _refuse_uneven(m):
    """An ArithmeticError if elimination leaves little of an inertia."""
    c = m.copy()
    for k, row in enumerate(m):
        light, alone = ~(row[k] > 7.888609052210118e-31), ~np.delete(row, k, axis=0).any(axis=0)
        if not np.where(light, alone, c[k, k] > 0.00390625 * row[k]).all():
            raise ArithmeticError("uneven inertias")
        ratio = c[k, k + 1 :] / np.where(light, 1.0, c[k, k])
        c[k + 1 :, k + 1 :] -= ratio[:, None] * c[k, k + 1 :]


def _solve_pivoted_each(a, b):
    """x of a x = b for each state by elimination with partial pivoting."""
    s, every = len(b), np.arange(b.shape[1])
    for j in range(s):
        best = j + np.abs(a[j:, j]).argmax(axis=0)
        a[j], a[best, :, every] = a[best, :, every].T, a[j].T.copy()
        b[j], b[best, every] = b[best, every], b[j].copy()
        if not (np.abs(a[j, j]) > s * 2.0**-53).all():
            raise ArithmeticError("a singular matrix")
        ratio = a[j + 1 :, j] / a[j, j]
        a[j + 1 :, j:] -= ratio[:, None] * a[j, j:]
        b[j + 1 :] -= ratio * b[j]
    for j in reversed(range(s)):
        b[j] /= a[j, j]
        b[:j] -= a[:j, j] * b[j]
    return b


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
    "array": _stacked,
    "_AXES": 2,
    "_undefined": _irregular,
    "_number": np.asarray,
    "_numbers": np.asarray,
    "_shaped": lambda a, *shape: a.reshape(*shape, -1),
    "_solve_saddle": _solve_saddles,
}


def _solution(t, y, p):
    """Accelerations, then multipliers; raises where they do not exist."""
    p_m, p_l, p_g = p
    q_x, q_z, v_x, v_z = _numbers(y)
    m0_2 = 2.0*q_x
    m0_4 = 2.0*q_z
    m0 = _shaped(array([p_m, 0.0, m0_2, 0.0, p_m, m0_4, m0_2, m0_4, 0.0], float), 3, 3)
    b0 = array([0.0, -p_m*p_g, -2.0*(v_x*v_x + v_z*v_z)], float)
    a0 = _numbers(_solve_saddle(m0, b0, 2))
    return a0


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a] at time t; all NaN where it does not exist."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(rhs, t, y, p)
    try:
        return array([*_numbers(y)[2:], *_solution(t, y, p)[:2]], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(4, t, *p)


def multipliers(t, y, p=DEFAULTS):
    """Multipliers, in the order of MULTIPLIERS; all NaN where they do not exist."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(multipliers, t, y, p)
    try:
        return array(_solution(t, y, p)[2:], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(1, t, *p)


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t), n by n, of M a = f."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(mass_matrix, t, y, p)
    try:
        p_m, p_l, p_g = p
        return _shaped(array([p_m, 0.0, 0.0, p_m], float), 2, 2)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined((2, 2), t, *p)


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(forcing, t, y, p)
    try:
        p_m, p_l, p_g = p
        return array([0.0, -p_m*p_g], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(energy, t, y, p)
    try:
        p_m, p_l, p_g = p
        q_x, q_z, v_x, v_z = _numbers(y)
        return _number(p_m*(0.5*(v_x*v_x + v_z*v_z) + p_g*q_z))
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _number(_undefined((), t, *p))


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(positions, t, y, p)
    try:
        return array([0.0], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(1, t, *p)


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(velocities, t, y, p)
    try:
        return array([0.0], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(1, t, *p)


def constraints(t, y, p=DEFAULTS):
    """What is zero: lhs - rhs of closures of positions, then rates of all closures."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(constraints, t, y, p)
    try:
        p_m, p_l, p_g = p
        q_x, q_z, v_x, v_z = _numbers(y)
        return array([q_x*q_x + q_z*q_z - p_l*p_l, 2.0*(q_x*v_x + q_z*v_z)], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def _position_error(t, y, p):
    """Closures of positions, then the magnitudes behind them."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_position_error, t, y, p)
    try:
        p_m, p_l, p_g = p
        q_x, q_z, v_x, v_z = _numbers(y)
        w0 = q_x*q_x
        w1 = q_z*q_z
        w2 = p_l*p_l
        return array([w0 + w1 - w2, abs(w0) + abs(w1) + abs(w2) + abs(2.0*w0) + abs(2.0*w1)], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def _position_reach(t, y, p):
    """Squares of the gradients of closures of positions, over the masses."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_position_reach, t, y, p)
    try:
        p_m, p_l, p_g = p
        q_x, q_z, v_x, v_z = _numbers(y)
        return array([4.0*(q_x*q_x + q_z*q_z)/p_m], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(1, t, *p)


def _position_change(t, y, p):
    """The change of q that makes the linearized closures vanish."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_position_change, t, y, p)
    try:
        p_m, p_l, p_g = p
        q_x, q_z, v_x, v_z = _numbers(y)
        m0_2 = 2.0*q_x
        m0_4 = 2.0*q_z
        m0 = _shaped(array([p_m, 0.0, m0_2, 0.0, p_m, m0_4, m0_2, m0_4, 0.0], float), 3, 3)
        b0 = array([0.0, 0.0, -q_x*q_x - q_z*q_z + p_l*p_l], float)
        a0 = _numbers(_solve_saddle(m0, b0, 2))
        return array([a0[0], a0[1]], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def _velocity_error(t, y, p):
    """Rates of the closures, then the magnitudes behind them."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_velocity_error, t, y, p)
    try:
        q_x, q_z, v_x, v_z = _numbers(y)
        w0 = q_x*v_x
        w1 = q_z*v_z
        return array([2.0*(w0 + w1), abs(2.0*w0) + abs(2.0*w1)], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def _velocity_change(t, y, p):
    """The change of v that makes the rates of the closures vanish."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_velocity_change, t, y, p)
    try:
        p_m, p_l, p_g = p
        q_x, q_z, v_x, v_z = _numbers(y)
        m0_2 = 2.0*q_x
        m0_4 = 2.0*q_z
        m0 = _shaped(array([p_m, 0.0, m0_2, 0.0, p_m, m0_4, m0_2, m0_4, 0.0], float), 3, 3)
        b0 = array([0.0, 0.0, -2.0*(q_x*v_x + q_z*v_z)], float)
        a0 = _numbers(_solve_saddle(m0, b0, 2))
        return array([a0[0], a0[1]], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def project(t, y, p=DEFAULTS):
    """The state led back to the closures (all NaN where it is too far from them): q by the
    smallest changes in the metric of the kinetic energy, until only rounding is left
    (Newton's method), then v in the same metric.
    """
    y = array(y, float)
    if y.ndim > _AXES:
        return _of_many(project, t, y, p, few=inf)
    n = len(y) // 2
    with np.errstate(all="ignore"):
        last = np.inf
        for number in range(50 + 1):
            error = _position_error(t, y, p)
            size = _residual(error)
            if size <= 1.0:
                break
            if number:
                size = _coupled_residual(error, _position_reach(t, y, p))
                if size <= 1.0 or (size <= 1024.0 and 2.0 * size > last):
                    break
            if number == 50 or size != size:
                return np.full(2 * n, nan)
            last = size
            y[:n] += _position_change(t, y, p)
        if not _residual(_velocity_error(t, y, p)) <= 1.0:
            y[n:] += _velocity_change(t, y, p)
    return y if np.isfinite(y).all() else np.full(2 * n, nan)


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
        y = project(s + h, y, p)
    return y


def start(given, until, p):
    """The initial state led to the closures, and what is wrong with it: it violates them."""
    y = project(START, given, p)
    residuals = constraints(START, given, p)
    n = len(given) // 2
    places, rates = np.abs(given).reshape(2, n).max(axis=1).tolist()
    rates = 1e-09 * rates
    if until != START:
        # Velocities that move no coordinate by more than rounding are none.
        rates += 7.105427357601002e-15 * places / abs(until - START)
    bounds = np.repeat([1e-09 * places, rates], n)
    near = np.isfinite(residuals).all() and (np.abs(y - given) <= bounds).all()
    if near:
        return y, ""
    worst = int(np.abs(residuals).argmax())
    wrong = (
        "the initial state violates the constraints by "
        f"{abs(residuals[worst]):.3g} ({RESIDUALS[worst]})\n"
    )
    if not np.isfinite(y).all():
        return y, f"{wrong}no state that obeys them was found near it"
    state = [*COORDINATES, *(f"dot({name})" for name in COORDINATES)]
    return y, f"{wrong}nearest: {' '.join(map('{}={!r}'.format, state, y.tolist()))}"


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
    y, wrong = start(y, run["until"], p)
    if wrong:
        return wrong
    times = np.linspace(START, run["until"], ROWS + 1).tolist()
    print(",".join(["t", *state]))
    for t, following in zip(times, [*times[1:], None]):
        print(",".join(map(repr, [t, *y.tolist()])))
        if following is not None:
            y = integrate(y, t, following, run["steps"], p)
        if not np.isfinite(y).all():
            return f"stopped after t = {t}: a singular configuration or a result not finite"
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
