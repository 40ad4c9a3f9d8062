"""knife_edge_on_incline: Knife edge on an inclined plane

A skate that turns steadily on a plane inclined by alpha, x pointing downhill: it may slide along
its edge and not across. Released without speed it does not slide off, but moves on a cycloid across
the slope. Yu. I. Neimark and N. A. Fufaev, Dynamics of Nonholonomic Systems (1972), chapter III; A.
M. Bloch, Nonholonomic Mechanics and Control (2nd ed., 2015), section 1.6.

Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k] for y = [q, v], in the order of
COORDINATES. l[k] is a multiplier, in the order of MULTIPLIERS, and g[k] the gradient of one of the
closures, so that l[k]*g[k] is the generalized force that it exerts. project leads a state back to
what is closed, to be called after each step. y is one state, or many as the columns of an array of
shape (2n, m); t and parameters are then numbers or of shape (m,), and results have m as their last
axis. NaN stands for no result. SciPy: solve_ivp(rhs, (0, 10), INITIAL, args=(DEFAULTS,),
vectorized=True).

lagrange VERSION, scene with SHA-256 dc353cd94f3299aca70ba3ade1394b3838a03af9c2fae77ab87b5944e739bb88
This output is yours: use it as you like, under any terms.
"""

import sys
from typing import NamedTuple

import numpy as np

# x [m]: downhill
# y [m]: across
# phi [rad]: direction of the edge
COORDINATES = ('x', 'y', 'phi')
CARTESIAN = ('z_skate',)
PARAMETERS = ('m', 'J', 'g', 'alpha')
# edge: dot(x)*sin(phi) = dot(y)*cos(phi)
MULTIPLIERS = ('edge',)
RESIDUALS = ('edge',)
INITIAL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0])


class Parameters(NamedTuple):
    m: float = 1.0  # m [kg]
    J: float = 0.1  # J [kg m^2]: moment of inertia about the vertical
    g: float = 9.81  # g [m/s^2]
    alpha: float = 0.3  # alpha [rad]: inclination


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


def rhs(t, y, p=DEFAULTS):
    """State derivative [v, a]."""
    m, J, g, alpha = p
    x, y_, phi, x_dot, y_dot, phi_dot = y
    # x: m*ddot(x) - m*g*sin(alpha) - lambda_edge*sin(phi) = 0
    # y: m*ddot(y) + lambda_edge*cos(phi) = 0
    # phi: ddot(phi) = 0
    w0 = np.sin(phi)
    w1 = np.cos(phi)
    dydt = np.zeros(y.shape)
    dydt[:3] = y[3:]
    matrix = np.zeros((3, 3) + y.shape[1:])
    vector = np.zeros((3,) + y.shape[1:])
    matrix[0, 0] = m
    matrix[1, 1] = m
    matrix[2, 0], matrix[2, 1] = w0, -w1
    vector[0] = m*g*np.sin(alpha)
    vector[2] = -phi_dot*(x_dot*w1 + y_dot*w0)
    vector = solve(matrix, vector)
    dydt[3:5] = vector[:2]
    return dydt


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t) of M a = f, n by n."""
    m, J, g, alpha = p
    out = np.zeros((3, 3) + y.shape[1:])
    out[0, 0] = m
    out[1, 1] = m
    out[2, 2] = J
    return out


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    m, J, g, alpha = p
    out = np.zeros((3,) + y.shape[1:])
    out[0] = m*g*np.sin(alpha)
    return out


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    m, J, g, alpha = p
    x, y_, phi, x_dot, y_dot, phi_dot = y
    return 0.5*J*phi_dot*phi_dot + m*(0.5*(x_dot*x_dot + y_dot*y_dot) - g*x*np.sin(alpha))


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    return np.zeros((1,) + y.shape[1:])


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    return np.zeros((1,) + y.shape[1:])


def multipliers(t, y, p=DEFAULTS):
    """Multipliers, in the order of MULTIPLIERS."""
    m, J, g, alpha = p
    x, y_, phi, x_dot, y_dot, phi_dot = y
    w0 = np.sin(phi)
    w1 = np.cos(phi)
    matrix = np.zeros((3, 3) + y.shape[1:])
    vector = np.zeros((3,) + y.shape[1:])
    matrix[0, 0] = m
    matrix[1, 1] = m
    matrix[2, 0], matrix[2, 1] = w0, -w1
    vector[0] = m*g*np.sin(alpha)
    vector[2] = -phi_dot*(x_dot*w1 + y_dot*w0)
    vector = solve(matrix, vector)
    out = np.empty((1,) + y.shape[1:])
    out[0] = -vector[2]
    return out


def constraints(t, y, p=DEFAULTS):
    """Residuals: lhs - rhs of closures of positions, then rates of all closures."""
    x, y_, phi, x_dot, y_dot, phi_dot = y
    out = np.empty((1,) + y.shape[1:])
    out[0] = x_dot*np.sin(phi) - y_dot*np.cos(phi)
    return out


def _velocity_error(t, y, p):
    """Rates of the closures, then the magnitudes behind them."""
    x, y_, phi, x_dot, y_dot, phi_dot = y
    w0 = x_dot*np.sin(phi)
    w1 = y_dot*np.cos(phi)
    out = np.empty((2,) + y.shape[1:])
    out[0], out[1] = w0 - w1, np.abs(w0) + np.abs(w1)
    return out


def _velocity_change(t, y, p):
    """Change of v that makes the rates of the closures vanish."""
    m, J, g, alpha = p
    x, y_, phi, x_dot, y_dot, phi_dot = y
    w0 = np.sin(phi)
    w1 = np.cos(phi)
    matrix = np.zeros((3, 3) + y.shape[1:])
    vector = np.zeros((3,) + y.shape[1:])
    matrix[0, 0] = m
    matrix[1, 1] = m
    matrix[2, 0], matrix[2, 1] = w0, -w1
    vector[2] = -x_dot*w0 + y_dot*w1
    vector = solve(matrix, vector)
    out = np.zeros((3,) + y.shape[1:])
    out[:2] = vector[:2]
    return out


def project(t, y, p=DEFAULTS):
    """One state led back to the closures; NaN where it is too far away.

    q changes as little as possible in the metric of the kinetic energy, until only rounding is
    left (Newton's method), then v likewise.
    """
    y = np.array(y, dtype=float)
    n = len(y)//2
    if not _residual(_velocity_error(t, y, p)) <= 1.0:
        y[n:] += _velocity_change(t, y, p)
    return y if np.isfinite(y).all() else np.full(2*n, np.nan)


def _residual(out):
    """The largest residual in units of the last place of the magnitudes that follow them."""
    size, magnitude = np.abs(out).reshape(2, -1)
    return (size/np.spacing(magnitude)).max()


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
    y, p = np.array(given[:6]), Parameters(*np.array(given[6:]))
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
