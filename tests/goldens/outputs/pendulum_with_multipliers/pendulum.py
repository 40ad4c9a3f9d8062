"""pendulum: Simple pendulum

A point mass on a massless rod, swinging in a vertical plane, released at rest. The angle is 2
asin(k cd(sqrt(g/l) t, k)) with k = sin(theta0/2), cd = cn/dn Jacobi's function; the period is 4
sqrt(l/g) K(k). L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 11, problem 1.

Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k] for y = [q, v], in the order of
COORDINATES. l[k] is a multiplier, in the order of MULTIPLIERS, and g[k] the gradient of one of the
closures, so that l[k]*g[k] is the generalized force that it exerts. project leads a state back to
what is closed, to be called after each step. y is one state, or many as the columns of an array of
shape (2n, m); t and parameters are then numbers or of shape (m,), and results have m as their last
axis. NaN stands for no result. SciPy: solve_ivp(rhs, (0, 10), INITIAL, args=(DEFAULTS,),
vectorized=True).

lagrange VERSION, scene with SHA-256 d8ab23885144fff672c2bbbf20ccdd4e6e5060c564f9fb77ff6792c03ba61d08
This output is yours: use it as you like, under any terms.
"""

import sys
from typing import NamedTuple

import numpy as np

COORDINATES = ('x', 'z')
CARTESIAN = ('y',)
PARAMETERS = ('m', 'l', 'g')
# bob: x = l*sin(theta), z = -l*cos(theta)
MULTIPLIERS = ('bob',)
RESIDUALS = ('bob', 'rate of bob')
INITIAL = np.array([0.9092974268256817, 0.4161468365471424, 0.0, 0.0])


class Parameters(NamedTuple):
    m: float = 1.0  # m [kg]: mass of the bob
    l: float = 1.0  # l [m]: length of the rod
    g: float = 9.81  # g [m/s^2]: gravitational acceleration


DEFAULTS = Parameters()


def solve(a, b):
    """x of a x = b for a symmetric matrix, one of whose triangles may be zero; NaN if singular.

    Units do not matter: rows and columns are scaled alike by powers of two, inertias to one, then
    what has none (J. R. Bunch, J. ACM 18 (1971) 566). A large inverse tells a singular matrix.
    """
    columns = b if b.ndim == a.ndim else b[:, None]
    a = np.where(a == 0.0, a.swapaxes(0, 1), a)
    inertia = np.abs(np.einsum("ii...->i...", a))
    light, g = inertia == 0.0, a*a
    coupled = (g*~light*~light[:, None] > 0.0).sum(axis=(0, 1)) > (~light).sum(axis=0)
    ratio = np.full(g.shape, np.inf)
    np.divide(np.where(light, np.inf, inertia), g, out=ratio, where=g > 0.0)
    for k in np.flatnonzero((light & coupled).reshape(len(b), -1).any(axis=1)):
        # What holds two inertias together, one of which may be next to none, weighs both.
        held = np.sort(ratio[k], axis=0)[1]
        held = np.where(light[k] & coupled & (held < 2.0**100), held, 0.0)*g[k]
        inertia = np.maximum(inertia, held)
    light = inertia == 0.0
    d = np.where(light, 0.0, np.ldexp(1.0, -(np.frexp(inertia)[1]//2)))
    for _ in b:
        size = (np.abs(a)*d).max(axis=1)
        if not size[d == 0.0].any():
            size = np.sqrt(np.abs(a).max(axis=1))
        d = np.where((d == 0.0) & (size > 0.0), np.ldexp(1.0, -np.frexp(size)[1]), d)
        if d.all():
            break
    # LAPACK has states first.
    a = np.moveaxis(a*d*d[:, None], (0, 1), (-2, -1))
    right = np.moveaxis(columns*d[:, None], (0, 1), (-2, -1))
    regular = np.linalg.slogdet(a)[0][..., None, None] != 0.0
    inverse = np.linalg.inv(np.where(regular, a, np.eye(len(b))))
    x = inverse @ right
    x += inverse @ (right - a @ x)
    regular &= np.abs(inverse).max(axis=(-2, -1), keepdims=True) < 2.0**53/len(b)
    x = np.moveaxis(np.where(regular, x, np.nan), (-2, -1), (0, 1))*d[:, None]
    return x if b.ndim == a.ndim else x[:, 0]


def _solution(t, y, p):
    """Accelerations, then multipliers."""
    m, l, g = p
    x, z, x_dot, z_dot = y
    # x: m*ddot(x) - 2*lambda_bob*x = 0
    # z: m*ddot(z) + m*g - 2*lambda_bob*z = 0
    matrix = np.zeros((3, 3) + y.shape[1:])
    vector = np.zeros((3,) + y.shape[1:])
    matrix[0, 0] = m
    matrix[1, 1] = m
    matrix[2, 0], matrix[2, 1] = 2.0*x, 2.0*z
    vector[1] = -m*g
    vector[2] = -2.0*(x_dot*x_dot + z_dot*z_dot)
    vector = solve(matrix, vector)
    out = np.empty((3,) + y.shape[1:])
    out[:2] = vector[:2]
    out[2] = -vector[2]
    return out


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a]."""
    return np.concatenate((y[2:], _solution(t, y, p)[:2]))


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t) of M a = f, n by n."""
    m, l, g = p
    out = np.zeros((2, 2) + y.shape[1:])
    out[0, 0] = m
    out[1, 1] = m
    return out


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    m, l, g = p
    out = np.zeros((2,) + y.shape[1:])
    out[1] = -m*g
    return out


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    m, l, g = p
    x, z, x_dot, z_dot = y
    return m*(0.5*(x_dot*x_dot + z_dot*z_dot) + g*z)


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    return np.zeros((1,) + y.shape[1:])


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    return np.zeros((1,) + y.shape[1:])


def multipliers(t, y, p=DEFAULTS):
    """Multipliers, in the order of MULTIPLIERS."""
    return _solution(t, y, p)[2:]


def constraints(t, y, p=DEFAULTS):
    """Residuals: lhs - rhs of closures of positions, then rates of all closures."""
    m, l, g = p
    x, z, x_dot, z_dot = y
    out = np.empty((2,) + y.shape[1:])
    out[0], out[1] = x*x + z*z - l*l, 2.0*(x*x_dot + z*z_dot)
    return out


def _position_error(t, y, p):
    """Closures of positions, then the magnitudes behind them."""
    m, l, g = p
    x, z, x_dot, z_dot = y
    w0 = x*x
    w1 = z*z
    w2 = l*l
    out = np.empty((2,) + y.shape[1:])
    out[0] = w0 + w1 - w2
    out[1] = np.abs(w0) + np.abs(w1) + np.abs(w2) + np.abs(2.0*w0) + np.abs(2.0*w1)
    return out


def _position_reach(t, y, p):
    """Squares of the gradients of closures of positions, over the masses."""
    m, l, g = p
    x, z, x_dot, z_dot = y
    out = np.empty((1,) + y.shape[1:])
    out[0] = 4.0*(x*x + z*z)/m
    return out


def _position_change(t, y, p):
    """Change of q that makes the linearized closures vanish."""
    m, l, g = p
    x, z, x_dot, z_dot = y
    matrix = np.zeros((3, 3) + y.shape[1:])
    vector = np.zeros((3,) + y.shape[1:])
    matrix[0, 0] = m
    matrix[1, 1] = m
    matrix[2, 0], matrix[2, 1] = 2.0*x, 2.0*z
    vector[2] = -x*x - z*z + l*l
    vector = solve(matrix, vector)
    out = np.empty((2,) + y.shape[1:])
    out[:] = vector[:2]
    return out


def _velocity_error(t, y, p):
    """Rates of the closures, then the magnitudes behind them."""
    x, z, x_dot, z_dot = y
    w0 = x*x_dot
    w1 = z*z_dot
    out = np.empty((2,) + y.shape[1:])
    out[0] = 2.0*(w0 + w1)
    out[1] = np.abs(2.0*w0) + np.abs(2.0*w1)
    return out


def _velocity_change(t, y, p):
    """Change of v that makes the rates of the closures vanish."""
    m, l, g = p
    x, z, x_dot, z_dot = y
    matrix = np.zeros((3, 3) + y.shape[1:])
    vector = np.zeros((3,) + y.shape[1:])
    matrix[0, 0] = m
    matrix[1, 1] = m
    matrix[2, 0], matrix[2, 1] = 2.0*x, 2.0*z
    vector[2] = -2.0*(x*x_dot + z*z_dot)
    vector = solve(matrix, vector)
    out = np.empty((2,) + y.shape[1:])
    out[:] = vector[:2]
    return out


def project(t, y, p=DEFAULTS):
    """One state led back to the closures; NaN where it is too far away.

    q changes as little as possible in the metric of the kinetic energy, until only rounding is
    left (Newton's method), then v likewise.
    """
    y = np.array(y, dtype=float)
    n = len(y)//2
    last = np.inf
    for k in range(50 + 1):
        error = _position_error(t, y, p)
        size = _residual(error)
        if size <= 1.0:
            break
        if k:
            size = _coupled_residual(error, _position_reach(t, y, p))
            if size <= 1.0 or (size <= 1024.0 and 2.0*size > last):
                break
        if k == 50 or np.isnan(size):
            return np.full(2*n, np.nan)
        last = size
        y[:n] += _position_change(t, y, p)
    if not _residual(_velocity_error(t, y, p)) <= 1.0:
        y[n:] += _velocity_change(t, y, p)
    return y if np.isfinite(y).all() else np.full(2*n, np.nan)


def _residual(out):
    """The largest residual in units of the last place of the magnitudes that follow them."""
    size, magnitude = np.abs(out).reshape(2, -1)
    return (size/np.spacing(magnitude)).max()


def _coupled_residual(out, squares):
    """The same where changes of all coordinates are found, and rounded, together.

    The magnitude of one residual counts for another as far as a change of the coordinates that
    makes the one does the other; ``squares`` are those of the gradients.
    """
    m = len(out)//2
    slopes = np.sqrt(squares)
    reach = np.max(out[m:][slopes > 0.0]/slopes[slopes > 0.0], initial=0.0)
    beside = np.where(np.isfinite(reach*slopes), reach*slopes, 0.0)
    return _residual(np.concatenate((out[:m], np.maximum(out[m:], beside))))


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
        y = project(s + h, y, p)
    return y


def start(given, t, until, p):
    """Initial state led to the closures, and what is wrong with it: that it violates them."""
    y = project(t, given, p)
    residuals = constraints(t, given, p)
    n = len(y)//2
    places, rates = np.abs(given).reshape(2, n).max(axis=1)
    rates = 1e-09*rates
    if until != t:
        # Velocities that move no coordinate by more than rounding are none.
        rates += 7.105427357601002e-15*places/abs(until - t)
    bounds = np.repeat([1e-09*places, rates], n)
    if np.isfinite(residuals).all() and (np.abs(y - given) <= bounds).all():
        return y, ""
    worst = int(np.abs(residuals).argmax())
    size = abs(residuals[worst])
    wrong = f"the initial state violates the constraints by {size:.3g} ({RESIDUALS[worst]})\n"
    if not np.isfinite(y).all():
        return y, f"{wrong}no state that obeys them was found near it"
    state = [*COORDINATES, *(f"dot({name})" for name in COORDINATES)]
    return y, f"{wrong}nearest: {' '.join(map('{}={!r}'.format, state, y.tolist()))}"


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
    y, p = np.array(given[:4]), Parameters(*np.array(given[4:]))
    y, wrong = start(y, 0.0, until, p)
    if wrong:
        sys.exit(wrong)
    times = np.linspace(0.0, until, 501)
    print("t", *state, sep=",")
    for t, following in zip(times[:-1], times[1:]):
        print(t, *y, sep=",")
        y = integrate(y, t, following, steps, p)
        if not np.isfinite(y).all():
            sys.exit(f"stopped after t = {t}: a singular configuration or a result not finite")
    print(until, *y, sep=",")
