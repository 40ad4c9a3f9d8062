"""bouncing_ball: Ball bouncing on a floor

A ball thrown horizontally bounces with the coefficient of restitution e. Its bounces follow each other at 2 e^k sqrt(2 h/g), so that infinitely many of them end at sqrt(2 h/g) (1 + e)/(1 - e), here at 4.06 s. Brach, Mechanical Impact Dynamics, 1991, section 1.4.

Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with the closures and
contacts of MULTIPLIERS beside them: l[k] is the multiplier and g[k] the gradient of
one, so that l[k]*g[k] is the generalized force that it exerts. project leads a state
back to what is closed, to be called after each step. y holds the coordinates q in
the order of COORDINATES, then their velocities v. Every function takes (t, y, p) with
p a Parameters, and returns NaN where there is no result (a singular configuration, a
domain error, overflow). With SciPy:

    solve_ivp(rhs, (0, 10), INITIAL, args=(DEFAULTS,))

y may hold many states, as the columns of an array of shape (2n, m); t and each parameter
are then numbers or arrays of shape (m,). Results have the shape that they have for one
state, with m behind it, and NaN for states without a result. With SciPy, vectorized=True.

A contact, one of CONTACTS, pushes while it is closed. mode says which are: a sequence of
as many 0 (open) and 1 (closed), FLIGHT if absent. Integrate with a fixed mode until one of
the numbers that events gives falls through zero, say number k; find when; call reset with
event=k there; go on with the state and the mode that it returns. Begin with reset alone.
As a script the module does so.

Made by lagrange VERSION from the scene with SHA-256
66f753407555c50a83bd77a53c6b989af4bfbbbcb84e02761419d8f2fe69a2a0
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
_holds = bool
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
PARAMETERS = ('m', 'g', 'h', 'u', 'e')
MULTIPLIERS = ('floor',)
RESIDUALS = ('floor', 'rate of floor')
# floor: z >= 0
CONTACTS = ('floor',)
FLIGHT = (0,)

INITIAL = [0.0, 1.0, 0.5, 0.0]
START, UNTIL, ROWS, STEPS = 0.0, 3.0, 500, 20


class Parameters(NamedTuple):
    """Parameters; NaN stands for one that must be given."""
    m: float = 1.0
    g: float = 9.81
    h: float = 1.0  # h [m]: height of the start
    u: float = 0.5  # u [m/s]: horizontal speed
    e: float = 0.8  # e: coefficient of restitution


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
    "_holds": np.all,
    "_number": np.asarray,
    "_numbers": np.asarray,
    "_shaped": lambda a, *shape: a.reshape(*shape, -1),
    "_solve_saddle": _solve_saddles,
}


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t), n by n, of M a = f."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(mass_matrix, t, y, p)
    try:
        p_m, p_g, p_h, p_u, p_e = p
        return _shaped(array([p_m, 0.0, 0.0, p_m], float), 2, 2)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined((2, 2), t, *p)


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(forcing, t, y, p)
    try:
        p_m, p_g, p_h, p_u, p_e = p
        return array([0.0, -p_m*p_g], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(energy, t, y, p)
    try:
        p_m, p_g, p_h, p_u, p_e = p
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


def _flight_rhs(t, y, p):
    """State derivative [v, a] at time t; all NaN where it does not exist."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_flight_rhs, t, y, p)
    try:
        p_m, p_g, p_h, p_u, p_e = p
        q_x, q_z, v_x, v_z = _numbers(y)
        regular = p_m > 0.0
        if not _holds(regular):
            return _undefined(4, t, *p)
        return array([v_x, v_z, 0.0, -p_m*p_g/p_m], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(4, t, *p)


def _contact_rhs(t, y, p, contact):
    """State derivative [v, a] at time t; all NaN where it does not exist."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_contact_rhs, t, y, p, contact)
    try:
        p_m, p_g, p_h, p_u, p_e = p
        p5, p6 = contact
        q_x, q_z, v_x, v_z = _numbers(y)
        regular = p_m > 0.0
        if not _holds(regular):
            return _undefined(4, t, *p)
        m1_2 = 1.0 - p5
        m1 = _shaped(array([p_m, p5, p5, m1_2], float), 2, 2)
        b1 = array([-p_m*p_g, 0.0], float)
        a1 = _numbers(_solve_saddle(m1, b1, 1))
        return array([v_x, v_z, 0.0, a1[0]], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(4, t, *p)


def _contact_multipliers(t, y, p, contact):
    """Multipliers, in the order of MULTIPLIERS; all NaN where they do not exist."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_contact_multipliers, t, y, p, contact)
    try:
        p_m, p_g, p_h, p_u, p_e = p
        p5, p6 = contact
        m0_2 = 1.0 - p5
        m0 = _shaped(array([p_m, p5, p5, m0_2], float), 2, 2)
        b0 = array([-p_m*p_g, 0.0], float)
        a0 = _numbers(_solve_saddle(m0, b0, 1))
        return array([a0[1]], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(1, t, *p)


def _contact_constraints(t, y, p, contact):
    """What is zero: lhs - rhs of closures of positions, then rates of all closures."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_contact_constraints, t, y, p, contact)
    try:
        p5, p6 = contact
        q_x, q_z, v_x, v_z = _numbers(y)
        return array([p5*q_z, p5*v_z], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def _contact_position_error(t, y, p, contact):
    """Closures of positions, then the magnitudes behind them."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_contact_position_error, t, y, p, contact)
    try:
        p5, p6 = contact
        q_x, q_z, v_x, v_z = _numbers(y)
        return array([p5*q_z, 2.0*p5*abs(q_z)], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def _contact_position_reach(t, y, p, contact):
    """Squares of the gradients of closures of positions, over the masses."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_contact_position_reach, t, y, p, contact)
    try:
        p_m, p_g, p_h, p_u, p_e = p
        p5, p6 = contact
        return array([p5*p5/p_m], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(1, t, *p)


def _contact_position_change(t, y, p, contact):
    """The change of q that makes the linearized closures vanish."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_contact_position_change, t, y, p, contact)
    try:
        p_m, p_g, p_h, p_u, p_e = p
        p5, p6 = contact
        q_x, q_z, v_x, v_z = _numbers(y)
        m0_2 = 1.0 - p5
        m0 = _shaped(array([p_m, p5, p5, m0_2], float), 2, 2)
        b0 = array([0.0, -p5*q_z], float)
        a0 = _numbers(_solve_saddle(m0, b0, 1))
        return array([0.0, a0[0]], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def _contact_velocity_error(t, y, p, contact):
    """Rates of the closures, then the magnitudes behind them."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_contact_velocity_error, t, y, p, contact)
    try:
        p5, p6 = contact
        q_x, q_z, v_x, v_z = _numbers(y)
        return array([p5*v_z, p5*abs(v_z)], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def _contact_velocity_change(t, y, p, contact):
    """The change of v that makes the rates of the closures vanish."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_contact_velocity_change, t, y, p, contact)
    try:
        p_m, p_g, p_h, p_u, p_e = p
        p5, p6 = contact
        q_x, q_z, v_x, v_z = _numbers(y)
        m0_2 = 1.0 - p5
        m0 = _shaped(array([p_m, p5, p5, m0_2], float), 2, 2)
        b0 = array([0.0, -p5*v_z], float)
        a0 = _numbers(_solve_saddle(m0, b0, 1))
        return array([0.0, a0[0]], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def _gaps(t, y, p, contact):
    """The gaps of all one-sided constraints, then the magnitudes behind them."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_gaps, t, y, p, contact)
    try:
        q_x, q_z, v_x, v_z = _numbers(y)
        return array([q_z, 2.0*abs(q_z)], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def _gap_terms(t, y, p, contact):
    """Gradients of the gaps, by rows; their rates; biases; restitutions."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_gap_terms, t, y, p, contact)
    try:
        p_m, p_g, p_h, p_u, p_e = p
        return array([0.0, 1.0, 0.0, 0.0, p_e], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(5, t, *p)


def _impulse(t, y, p, contact):
    """The change of v that changes the rates of what is in contact by the targets."""
    y = asarray(y, float)
    if y.ndim > _AXES:
        return _of_many(_impulse, t, y, p, contact)
    try:
        p_m, p_g, p_h, p_u, p_e = p
        p5, p6 = contact
        m0_2 = 1.0 - p5
        m0 = _shaped(array([p_m, p5, p5, m0_2], float), 2, 2)
        b0 = array([0.0, p5*p6], float)
        a0 = _numbers(_solve_saddle(m0, b0, 1))
        return array([0.0, a0[0]], float)
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return _undefined(2, t, *p)


def _contact_project(t, y, p, contact):
    """The state led back to the closures (all NaN where it is too far from them): q by the
    smallest changes in the metric of the kinetic energy, until only rounding is left
    (Newton's method), then v in the same metric.
    """
    y = array(y, float)
    if y.ndim > _AXES:
        return _of_many(_contact_project, t, y, p, contact, few=inf)
    n = len(y) // 2
    with np.errstate(all="ignore"):
        last = np.inf
        for number in range(50 + 1):
            error = _contact_position_error(t, y, p, contact)
            size = _residual(error)
            if size <= 1.0:
                break
            if number:
                size = _coupled_residual(error, _contact_position_reach(t, y, p, contact))
                if size <= 1.0 or (size <= 1024.0 and 2.0 * size > last):
                    break
            if number == 50 or size != size:
                return np.full(2 * n, nan)
            last = size
            y[:n] += _contact_position_change(t, y, p, contact)
        if not _residual(_contact_velocity_error(t, y, p, contact)) <= 1.0:
            y[n:] += _contact_velocity_change(t, y, p, contact)
    return y if np.isfinite(y).all() else np.full(2 * n, nan)


def _contact_events(t, y, p, contact):
    """What falls through zero at an event: multipliers of what is in contact, else gaps."""
    flags = np.array(contact[:1])
    found = _gaps(t, y, p, contact)[:1]
    if not flags.any():
        return found
    found[flags > 0.0] = _contact_multipliers(t, y, p, contact)[-1:][flags > 0.0]
    return found


class _Deadlock(ArithmeticError):
    """There is no motion behind an event; ``flags`` are 1.0 for contacts that leave none."""

    def __init__(self, flags):
        self.flags = np.asarray(flags, dtype=float)


def _raise(k, d, w, x, active):
    """Raises push k until w[k] is zero; active pushes that are used up end."""
    while True:
        held = np.flatnonzero(active)
        r = np.linalg.solve(d[np.ix_(held, held)], d[held, k])
        rise = d[k, k] - d[k, held] @ r
        full = -w[k] / rise if rise > 1e-12 else np.inf
        ends = [(x[j] / ratio, j) for j, ratio in zip(held, r) if ratio > 0.0]
        least, first = min(ends, default=(np.inf, -1))
        if min(full, least) == np.inf:
            flags = np.arange(len(w)) == k
            flags[held] = r < -1e-12
            raise _Deadlock(flags)
        x[held] = np.maximum(x[held] - min(full, least) * r, 0.0)
        x[k] += min(full, least)
        if full <= least:
            active[k] = True
            return
        w[k] = min(w[k] + least * rise, 0.0)
        x[first], active[first] = 0.0, False


def _pushes(d, w, size, closed):
    """Which closed contacts push, with w + d x >= 0 for pushes x >= 0, one of both zero for each
    (the dual method of Goldfarb and Idnani, Math. Programming 27 (1983) 1).
    """
    x, active = np.zeros(len(w)), np.zeros(len(w), dtype=bool)
    given, sizes = np.where(np.abs(w) > 1e-12 * size, w, 0.0), size
    for _ in range(64 * (len(w) + 1)):
        w = given + d @ x
        size = sizes + np.abs(d) @ x
        w[active | (np.abs(w) <= 1e-12 * size)] = 0.0
        violated = np.flatnonzero(closed & (w < 0.0))
        if not violated.size:
            return active
        _raise(violated[0], d, w, x, active)
    raise _Deadlock(np.zeros(len(w)))


def _known(values):
    """The values, all of which must be finite."""
    if not np.isfinite(values).all():
        raise ArithmeticError("not finite")
    return values


def _gap_table(t, y, p, contact):
    """Gradients of the gaps by rows, then rates, biases and restitutions."""
    terms = _known(_gap_terms(t, y, p, contact))
    n = len(y) // 2
    return terms[: 1 * n].reshape(1, n), *terms[1 * n :].reshape(3, 1)


def _responses(t, y, p, contact, gradient, closed):
    """What a unit impulse of each closed contact adds to the rates of all, in its own unit."""
    d = np.zeros((1, 1))
    for k in np.flatnonzero(closed):
        flags = targets = (np.arange(1) == k).astype(float)
        contact = [*map(float, flags), *map(float, targets)]
        change = _impulse(t, y, p, contact)
        # One that the closures alone hold back takes no impulse.
        if np.isfinite(change).all():
            d[:, k] = gradient @ change
    return d


def _hit(t, y, p, contact, bounce, d, table, speed, size, closed, held):
    """The state after an impact of what is closed, the rates of the gaps and their magnitudes."""
    gradient, rate, _, restitution = table
    if not ((restitution >= 0.0) & (restitution <= 1.0 + 1e-12))[closed].all():
        raise ArithmeticError("a restitution is not between 0 and 1")
    speed = np.where(held, 0.0, speed)
    # The least rate after the impact, and that of active contacts.
    least = -bounce * restitution * np.minimum(speed, 0.0)
    flags = _pushes(d, speed - least, size, closed)
    n = len(y) // 2
    # A second time for what rounding has left of the first.
    for _ in range(2):
        targets = least - gradient @ y[n:] - rate
        contact = [*map(float, flags), *map(float, targets)]
        y[n:] += _known(_impulse(t, y, p, contact))
    speed = gradient @ y[n:] + rate
    size = size + np.abs(gradient) @ np.abs(y[n:]) + np.abs(rate)
    off = np.where(flags, np.abs(speed - least), least - speed)
    if not (off <= 1000.0 * 1e-12 * size)[closed].all():
        raise ArithmeticError("an impact that is not resolved")
    return y, np.where(flags, least, speed), size


def _settle(t, y, p, contact, d, closed):
    """The contacts among what is closed that have to push now (1.0, else 0.0)."""
    gradient, _, bias, _ = _gap_table(t, y, p, contact)
    a = _known(_flight_rhs(t, y, p))[len(y) // 2 :]
    w, size = gradient @ a + bias, np.abs(gradient) @ np.abs(a) + np.abs(bias)
    flags, targets = _pushes(d, w, size, closed).astype(float), np.zeros(1)
    contact = [*map(float, flags), *map(float, targets)]
    if flags.any():
        _known(_contact_multipliers(t, y, p, contact))
    return flags


def _after(t, y, p, contact, event, bounce):
    """The state and what is in contact after an event, or an ArithmeticError."""
    gap, near = _known(_gaps(t, y, p, contact)).reshape(2, 1)
    table = _gap_table(t, y, p, contact)
    gradient, rate = table[:2]
    v = y[len(y) // 2 :]
    speed, size = gradient @ v + rate, np.abs(gradient) @ np.abs(v) + np.abs(rate)
    # What closes within the rounding error of the time closes now.
    near = 1e-12 * near - 1.4210854715202004e-14 * abs(t) * np.minimum(speed, 0.0)
    held = np.array(contact[:1]) > 0.0
    closed = held | (np.arange(1) == event) | (gap <= near)
    d = _responses(t, y, p, contact, gradient, closed)
    stays = held
    if (closed & ~held & (speed < -1e-12 * size)).any():
        y, speed, size = _hit(t, y, p, contact, bounce, d, table, speed, size, closed, held)
        stays = np.zeros(1, dtype=bool)
    # One that was in contact and has its event is released, unless an impact came between.
    closed &= ~(stays & (np.arange(1) == event))
    closed &= stays | (speed <= 1e-12 * size)
    return y, _settle(t, y, p, contact, d, closed)


def _contact_reset(t, y, p, contact, event, bounce):
    """The state after an event, and which contacts are then closed (1.0, else 0.0).

    ``event``: the number of the contact whose event it is (-1: a start); ``bounce``: 1.0, or 0.0
    for an impact without restitution. Where there is no such state it is None, and the contacts
    are those that leave no motion, if that is the reason.
    """
    try:
        with np.errstate(all="ignore"):
            return _after(t, np.array(y, dtype=float), p, contact, event, bounce)
    except _Deadlock as found:
        return None, found.flags
    except (ArithmeticError, np.linalg.LinAlgError):
        return None, np.zeros(1)


def _flags(mode):
    """1.0 for what is closed, then zeros (targets of impulses)."""
    if len(mode) != len(CONTACTS):
        raise ValueError("mode has one entry for each of CONTACTS")
    return [*(float(bool(closed)) for closed in mode), *[0.0] * len(CONTACTS)]


def rhs(t, y, p=DEFAULTS, mode=FLIGHT):
    """State derivative [v, a] at time t while mode stays; all NaN where it does not exist."""
    if not any(mode):
        return _flight_rhs(t, y, p)
    return _contact_rhs(t, y, p, _flags(mode))


def multipliers(t, y, p=DEFAULTS, mode=FLIGHT):
    """Multipliers, in the order of MULTIPLIERS, zero for what is open; NaN if none."""
    return _contact_multipliers(t, y, p, _flags(mode))


def constraints(t, y, p=DEFAULTS, mode=FLIGHT):
    """What is zero, in the order of RESIDUALS; so is all of what is open."""
    return _contact_constraints(t, y, p, _flags(mode))


def events(t, y, p=DEFAULTS, mode=FLIGHT):
    """What falls through zero at events: multipliers of what is closed, else gaps."""
    return _contact_events(t, y, p, _flags(mode))


def project(t, y, p=DEFAULTS, mode=FLIGHT):
    """The state led back to what is closed (all NaN where it is too far from it): q by the
    smallest changes in the metric of the kinetic energy, until only rounding is left
    (Newton's method), then v in the same metric.
    """
    return _contact_project(t, y, p, _flags(mode))


def reset(t, y, p=DEFAULTS, mode=FLIGHT, event=-1, bounce=1.0):
    """The state and the mode to go on with after an event, or from a start (event=-1).

    What closes takes an impact, by Newton's law with impulses that only push (bounce=0.0:
    without restitution, to end a sequence of ever shorter bounces). None where there is no such
    impact, or a restitution is not between 0 and 1.
    """
    if np.ndim(y) > 1:
        raise ValueError(f"reset takes one state, y of shape ({2 * len(COORDINATES)},)")
    state, flags = _contact_reset(t, y, p, _flags(mode), event, bounce)
    return None if state is None else (state, tuple(int(flag) for flag in flags))


def step(t, y, h, p, mode):
    """State after one classical Runge-Kutta step of size h, led back to what is closed."""
    k1 = rhs(t, y, p, mode=mode)
    k2 = rhs(t + h / 2, y + h / 2 * k1, p, mode=mode)
    k3 = rhs(t + h / 2, y + h / 2 * k2, p, mode=mode)
    k4 = rhs(t + h, y + h * k3, p, mode=mode)
    return project(t + h, y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), p, mode)


def find(before, found, mode, largest):
    """A contact that has to open or close, or None. Numbers are measured by the largest so far,
    so that rounding is no event; nor is what was below zero before (a gap that only touches).
    """
    for k, closed in enumerate(mode):
        largest[closed][k] = max(largest[closed][k], abs(found[k]))
        if found[k] < min(before[k], 0.0) - 1.1368683772161603e-13 * largest[closed][k]:
            return k
    return None


def advance(t, y, h, p, mode, largest):
    """State and mode after a step of size h, with its events, whose times are bisected."""
    end = t + h
    for count in range(1000 + 1):
        if not t < end:
            return y, mode
        early, late, event = 0.0, end - t, None
        trial, rounding = late, 2.220446049250313e-16 * abs(t)
        before = events(t, y, p, mode=mode)
        while event is None or (early < trial < late and late - early > rounding):
            state = step(t, y, trial, p, mode)
            due = find(before, events(t + trial, state, p, mode=mode), mode, largest)
            if event is None and due is None:
                return state, mode
            if due is None:
                early = trial
            else:
                event, late = due, trial
            trial = early + (late - early) / 2
        y, t = step(t, y, late, p, mode), t + late
        name = f"{'release' if mode[event] else 'contact'}:{CONTACTS[event]}"
        print(f"t = {t!r}: {name}", file=sys.stderr)
        after = reset(t, y, p, mode=mode, event=event, bounce=float(count < 50))
        if after is None:
            break
        y, mode = after
        if count == 50:
            print(f"t = {t!r}: ever shorter bounces end here", file=sys.stderr)
    return np.full(len(y), nan), mode


def integrate(y, t, until, steps, p=DEFAULTS, mode=FLIGHT, largest=None):
    """State and mode after ``steps`` steps of fixed size from t to until."""
    h = (until - t) / steps
    largest = np.zeros((2, len(mode))) if largest is None else largest
    for k in range(steps):
        y, mode = advance(t + k * h, y, h, p, mode, largest)
    return y, mode


def begin(y, until, p):
    """State and mode at the start, and what is wrong with it: a gap below zero."""
    if until < START:
        return y, FLIGHT, "until=T: impacts cannot be followed back in time"
    bound = -1e-09 * np.abs(y[: len(y) // 2]).max()
    for name, gap in zip(CONTACTS, events(START, y, p).tolist()):
        if gap < bound:
            return y, FLIGHT, f"the initial state violates {name} by {-gap:.3g}"
    after = reset(START, y, p)
    if after is None:
        return y, FLIGHT, "no motion begins at the initial state"
    return *after, ""


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
    y, mode, wrong = begin(y, run["until"], p)
    if wrong:
        return wrong
    largest = np.zeros((2, len(mode)))
    times = np.linspace(START, run["until"], ROWS + 1).tolist()
    print(",".join(["t", *state]))
    for t, following in zip(times, [*times[1:], None]):
        print(",".join(map(repr, [t, *y.tolist()])))
        if following is not None:
            y, mode = integrate(y, t, following, run["steps"], p, mode, largest)
        if not np.isfinite(y).all():
            return f"stopped after t = {t}: a singular configuration or a result not finite"
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
