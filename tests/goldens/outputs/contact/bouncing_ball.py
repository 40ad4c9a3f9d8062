"""bouncing_ball: Ball bouncing on a floor

A ball thrown horizontally bounces with the coefficient of restitution e. Its bounces follow each
other at 2 e^k sqrt(2 h/g), so that infinitely many of them end at sqrt(2 h/g) (1 + e)/(1 - e), here
at 4.06 s. Brach, Mechanical Impact Dynamics, 1991, section 1.4.

Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k] for y = [q, v], in the order of
COORDINATES. l[k] is a multiplier, in the order of MULTIPLIERS, and g[k] the gradient of one of the
closures and contacts, so that l[k]*g[k] is the generalized force that it exerts. y is one state, or
many as the columns of an array of shape (2n, m); t and parameters are then numbers or of shape
(m,), and results have m as their last axis. NaN stands for no result. SciPy: solve_ivp(rhs, (0,
10), INITIAL, args=(DEFAULTS,), vectorized=True).

A contact, one of CONTACTS, pushes while it is closed. mode says which are: as many 0 (open) and 1
(closed), FLIGHT if absent. Integrate with one mode until one of the numbers of events falls through
zero, say number k; find when; call reset with event=k there; go on with the state and the mode that
it returns. Begin with reset alone. The script does so.

lagrange VERSION, scene with SHA-256 66f753407555c50a83bd77a53c6b989af4bfbbbcb84e02761419d8f2fe69a2a0
This output is yours: use it as you like, under any terms.
"""

import sys
from typing import NamedTuple

import numpy as np

COORDINATES = ('x', 'z')
CARTESIAN = ('y',)
PARAMETERS = ('m', 'g', 'h', 'u', 'e')
# floor: z >= 0
MULTIPLIERS = ('floor',)
RESIDUALS = ('floor', 'rate of floor')
CONTACTS = ('floor',)
FLIGHT = (0,)
INITIAL = np.array([0.0, 1.0, 0.5, 0.0])


class Parameters(NamedTuple):
    m: float = 1.0
    g: float = 9.81
    h: float = 1.0  # h [m]: height of the start
    u: float = 0.5  # u [m/s]: horizontal speed
    e: float = 0.8  # e: coefficient of restitution


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


def flight(t, y, p):
    """State derivative while all contacts are open."""
    m, g, h, u_, e = p
    x, z, x_dot, z_dot = y
    # x: ddot(x) = 0
    # z: m*ddot(z) + m*g - lambda_floor = 0
    regular = m > 0.0
    check = np.sqrt(regular - 1.0)  # 0, or NaN for a singular mass matrix
    dydt = np.zeros(y.shape)
    dydt[:2] = y[2:]
    dydt[3] = -m*g/m + check
    return dydt


def mass_matrix(t, y, p=DEFAULTS):
    """Mass matrix M(q, t) of M a = f, n by n."""
    m, g, h, u_, e = p
    out = np.zeros((2, 2) + y.shape[1:])
    out[0, 0] = m
    out[1, 1] = m
    return out


def forcing(t, y, p=DEFAULTS):
    """Forcing f(q, v, t) of M a = f."""
    m, g, h, u_, e = p
    out = np.zeros((2,) + y.shape[1:])
    out[1] = -m*g
    return out


def energy(t, y, p=DEFAULTS):
    """Energy function: the sum of v dL/dv, less L (T + V in most systems)."""
    m, g, h, u_, e = p
    x, z, x_dot, z_dot = y
    return m*(0.5*(x_dot*x_dot + z_dot*z_dot) + g*z)


def positions(t, y, p=DEFAULTS):
    """Cartesian names, in the order of CARTESIAN."""
    return np.zeros((1,) + y.shape[1:])


def velocities(t, y, p=DEFAULTS):
    """Time derivatives of the Cartesian names, in the order of CARTESIAN."""
    return np.zeros((1,) + y.shape[1:])


def rhs(t, y, p=DEFAULTS, mode=FLIGHT):
    """State derivative [v, a]."""
    if not any(mode):
        return flight(t, y, p)
    m, g, h, u_, e = p
    x, z, x_dot, z_dot = y
    (floor,) = mode
    dydt = np.zeros(y.shape)
    dydt[:2] = y[2:]
    matrix = np.zeros((2, 2) + y.shape[1:])
    vector = np.zeros((2,) + y.shape[1:])
    matrix[0, 0] = m
    matrix[1, 0], matrix[1, 1] = floor, 1.0 - floor
    vector[0] = -m*g
    vector = solve(matrix, vector)
    dydt[3] = vector[0]
    return dydt


def multipliers(t, y, p=DEFAULTS, mode=FLIGHT):
    """Multipliers, in the order of MULTIPLIERS."""
    m, g, h, u_, e = p
    (floor,) = mode
    matrix = np.zeros((2, 2) + y.shape[1:])
    vector = np.zeros((2,) + y.shape[1:])
    matrix[0, 0] = m
    matrix[1, 0], matrix[1, 1] = floor, 1.0 - floor
    vector[0] = -m*g
    vector = solve(matrix, vector)
    out = np.empty((1,) + y.shape[1:])
    out[0] = -vector[1]
    return out


def constraints(t, y, p=DEFAULTS, mode=FLIGHT):
    """Residuals: lhs - rhs of closures of positions, then rates of all closures."""
    x, z, x_dot, z_dot = y
    (floor,) = mode
    out = np.empty((2,) + y.shape[1:])
    out[0], out[1] = floor*z, floor*z_dot
    return out


def _position_error(t, y, p, mode):
    """Closures of positions, then the magnitudes behind them."""
    x, z, x_dot, z_dot = y
    (floor,) = mode
    out = np.empty((2,) + y.shape[1:])
    out[0], out[1] = floor*z, 2.0*floor*np.abs(z)
    return out


def _position_reach(t, y, p, mode):
    """Squares of the gradients of closures of positions, over the masses."""
    m, g, h, u_, e = p
    (floor,) = mode
    out = np.empty((1,) + y.shape[1:])
    out[0] = floor*floor/m
    return out


def _position_change(t, y, p, mode):
    """Change of q that makes the linearized closures vanish."""
    m, g, h, u_, e = p
    x, z, x_dot, z_dot = y
    (floor,) = mode
    matrix = np.zeros((2, 2) + y.shape[1:])
    vector = np.zeros((2,) + y.shape[1:])
    matrix[0, 0] = m
    matrix[1, 0], matrix[1, 1] = floor, 1.0 - floor
    vector[1] = -floor*z
    vector = solve(matrix, vector)
    out = np.zeros((2,) + y.shape[1:])
    out[1] = vector[0]
    return out


def _velocity_error(t, y, p, mode):
    """Rates of the closures, then the magnitudes behind them."""
    x, z, x_dot, z_dot = y
    (floor,) = mode
    out = np.empty((2,) + y.shape[1:])
    out[0], out[1] = floor*z_dot, floor*np.abs(z_dot)
    return out


def _velocity_change(t, y, p, mode):
    """Change of v that makes the rates of the closures vanish."""
    m, g, h, u_, e = p
    x, z, x_dot, z_dot = y
    (floor,) = mode
    matrix = np.zeros((2, 2) + y.shape[1:])
    vector = np.zeros((2,) + y.shape[1:])
    matrix[0, 0] = m
    matrix[1, 0], matrix[1, 1] = floor, 1.0 - floor
    vector[1] = -floor*z_dot
    vector = solve(matrix, vector)
    out = np.zeros((2,) + y.shape[1:])
    out[1] = vector[0]
    return out


def _gaps(t, y, p):
    """Gaps of all contacts, then the magnitudes behind them."""
    x, z, x_dot, z_dot = y
    out = np.empty((2,) + y.shape[1:])
    out[0], out[1] = z, 2.0*np.abs(z)
    return out


def _gap_terms(t, y, p):
    """Gradients of the gaps, by rows; their rates; biases; restitutions."""
    m, g, h, u_, e = p
    out = np.zeros((5,) + y.shape[1:])
    out[1], out[4] = 1.0, e
    return out


def _impulse(t, y, p, mode, targets):
    """Change of v that changes the rates of closed contacts by the targets."""
    m, g, h, u_, e = p
    (floor,) = mode
    (target_floor,) = targets
    matrix = np.zeros((2, 2) + y.shape[1:])
    vector = np.zeros((2,) + y.shape[1:])
    matrix[0, 0] = m
    matrix[1, 0], matrix[1, 1] = floor, 1.0 - floor
    vector[1] = floor*target_floor
    vector = solve(matrix, vector)
    out = np.zeros((2,) + y.shape[1:])
    out[1] = vector[0]
    return out


def project(t, y, p=DEFAULTS, mode=FLIGHT):
    """One state led back to what is closed; NaN where it is too far away.

    q changes as little as possible in the metric of the kinetic energy, until only rounding is
    left (Newton's method), then v likewise.
    """
    y = np.array(y, dtype=float)
    n = len(y)//2
    last = np.inf
    for k in range(50 + 1):
        error = _position_error(t, y, p, mode)
        size = _residual(error)
        if size <= 1.0:
            break
        if k:
            size = _coupled_residual(error, _position_reach(t, y, p, mode))
            if size <= 1.0 or (size <= 1024.0 and 2.0*size > last):
                break
        if k == 50 or np.isnan(size):
            return np.full(2*n, np.nan)
        last = size
        y[:n] += _position_change(t, y, p, mode)
    if not _residual(_velocity_error(t, y, p, mode)) <= 1.0:
        y[n:] += _velocity_change(t, y, p, mode)
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


def events(t, y, p=DEFAULTS, mode=FLIGHT):
    """What falls through zero at events: multipliers of closed contacts, gaps of open ones."""
    falling = _gaps(t, y, p)[:1]
    if any(mode):
        closed = np.array(mode) > 0
        falling[closed] = multipliers(t, y, p, mode)[-1:][closed]
    return falling


def reset(t, y, p=DEFAULTS, mode=FLIGHT, event=-1, bounce=1.0):
    """State and mode after an event, or from a start (event=-1), of one state; None without any.

    What closes takes an impact, by Newton's law with impulses that only push (bounce=0.0: without
    restitution, to end a sequence of ever shorter bounces).
    """
    try:
        with np.errstate(all="ignore"):
            return _after(t, np.array(y, dtype=float), p, mode, event, bounce)
    except (ArithmeticError, np.linalg.LinAlgError):
        return None


def _after(t, y, p, mode, event, bounce):
    """State and mode after an event, or an ArithmeticError."""
    gap, near = _known(_gaps(t, y, p)).reshape(2, 1)
    table = _gap_table(t, y, p)
    gradient, rate = table[:2]
    v = y[len(y)//2 :]
    speed, size = gradient @ v + rate, np.abs(gradient) @ np.abs(v) + np.abs(rate)
    # What closes within the rounding error of the time closes now.
    near = 1e-12*near - 1.4210854715202004e-14*abs(t)*np.minimum(speed, 0.0)
    held, is_event = np.array(mode) > 0, np.arange(1) == event
    closed = held | is_event | (gap <= near)
    d = _responses(t, y, p, gradient, closed)
    stays = held
    if (closed & ~held & (speed < -1e-12*size)).any():
        y, speed, size = _hit(t, y, p, bounce, d, table, speed, size, closed, held)
        stays = np.zeros(1, dtype=bool)
    # One that was in contact and has its event is released, unless an impact came between.
    closed &= ~(stays & is_event)
    closed &= stays | (speed <= 1e-12*size)
    return y, _settled(t, y, p, d, closed)


def _gap_table(t, y, p):
    """Gradients of the gaps by rows, then rates, biases and restitutions."""
    terms, n = _known(_gap_terms(t, y, p)), len(y)//2
    return terms[: 1*n].reshape(1, n), *terms[1*n :].reshape(3, 1)


def _responses(t, y, p, gradient, closed):
    """What a unit impulse of each closed contact adds to the rates of all, in its own unit."""
    d = np.zeros((1, 1))
    for k in np.flatnonzero(closed):
        unit = np.eye(1)[k]
        change = _impulse(t, y, p, unit, unit)
        # One that the closures alone hold back takes no impulse.
        if np.isfinite(change).all():
            d[:, k] = gradient @ change
    return d


def _hit(t, y, p, bounce, d, table, speed, size, closed, held):
    """The state after an impact of what is closed, the rates of the gaps and their magnitudes."""
    gradient, rate, _, restitution = table
    if not ((restitution >= 0.0) & (restitution <= 1.0 + 1e-12))[closed].all():
        raise ArithmeticError("a restitution is not between 0 and 1")
    speed = np.where(held, 0.0, speed)
    # The least rate after the impact, and that of active contacts.
    least = -bounce*restitution*np.minimum(speed, 0.0)
    active = _pushes(d, speed - least, size, closed)
    n = len(y)//2
    # A second time for what rounding has left of the first.
    for _ in range(2):
        targets = least - gradient @ y[n:] - rate
        y[n:] += _known(_impulse(t, y, p, active.astype(float), targets))
    speed = gradient @ y[n:] + rate
    size = size + np.abs(gradient) @ np.abs(y[n:]) + np.abs(rate)
    off = np.where(active, np.abs(speed - least), least - speed)
    if not (off <= 1000.0*1e-12*size)[closed].all():
        raise ArithmeticError("an impact that is not resolved")
    return y, np.where(active, least, speed), size


def _settled(t, y, p, d, closed):
    """The mode in which those of the closed contacts are closed that have to push."""
    gradient, _, bias, _ = _gap_table(t, y, p)
    a = _known(flight(t, y, p))[len(y)//2 :]
    w, size = gradient @ a + bias, np.abs(gradient) @ np.abs(a) + np.abs(bias)
    mode = tuple(_pushes(d, w, size, closed).astype(int).tolist())
    if any(mode):
        _known(multipliers(t, y, p, mode))
    return mode


def _pushes(d, w, size, closed):
    """Which closed contacts push, with w + d x >= 0 for pushes x >= 0, one of both zero for each
    (the dual method of Goldfarb and Idnani, Math. Programming 27 (1983) 1).
    """
    x, active = np.zeros(len(w)), np.zeros(len(w), dtype=bool)
    start, sizes = np.where(np.abs(w) > 1e-12*size, w, 0.0), size
    for _ in range(64*(len(w) + 1)):
        w = start + d @ x
        size = sizes + np.abs(d) @ x
        w[active | (np.abs(w) <= 1e-12*size)] = 0.0
        violated = np.flatnonzero(closed & (w < 0.0))
        if not violated.size:
            return active
        _raise(violated[0], d, w, x, active)
    raise ArithmeticError("no pushes were found")


def _raise(k, d, w, x, active):
    """Raises push k until w[k] is zero; active pushes that are used up end."""
    while True:
        held = np.flatnonzero(active)
        r = np.linalg.solve(d[np.ix_(held, held)], d[held, k])
        rise = d[k, k] - d[k, held] @ r
        full = -w[k]/rise if rise > 1e-12 else np.inf
        ends = [(x[j]/ratio, j) for j, ratio in zip(held, r) if ratio > 0.0]
        least, first = min(ends, default=(np.inf, -1))
        if min(full, least) == np.inf:
            raise ArithmeticError("there is no motion behind the event")
        x[held] = np.maximum(x[held] - min(full, least)*r, 0.0)
        x[k] += min(full, least)
        if full <= least:
            active[k] = True
            return
        w[k] = min(w[k] + least*rise, 0.0)
        x[first], active[first] = 0.0, False


def _known(values):
    """The values, all of which must be finite."""
    if not np.isfinite(values).all():
        raise ArithmeticError("not finite")
    return values


def step(t, y, h, p, mode):
    """State after one classical Runge-Kutta step of size h, led back to what is closed."""
    k1 = rhs(t, y, p, mode=mode)
    k2 = rhs(t + h/2, y + h/2*k1, p, mode=mode)
    k3 = rhs(t + h/2, y + h/2*k2, p, mode=mode)
    k4 = rhs(t + h, y + h*k3, p, mode=mode)
    return project(t + h, y + h/6*(k1 + 2*k2 + 2*k3 + k4), p, mode)


def find(before, falling, mode, largest):
    """A contact that has to open or close, or None. Numbers are measured by the largest so far,
    so that rounding is no event; nor is what was below zero before (a gap that only touches).
    """
    for k, closed in enumerate(mode):
        largest[closed][k] = max(largest[closed][k], abs(falling[k]))
        if falling[k] < min(before[k], 0.0) - 1.1368683772161603e-13*largest[closed][k]:
            return k
    return None


def advance(t, y, h, p, mode, largest):
    """State and mode after a step of size h, with its events, whose times are bisected."""
    end = t + h
    for count in range(1000 + 1):
        if not t < end:
            return y, mode
        early, late, event = 0.0, end - t, None
        trial, rounding = late, 2.220446049250313e-16*abs(t)
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
            trial = early + (late - early)/2
        y, t = step(t, y, late, p, mode), t + late
        name = f"{'release' if mode[event] else 'contact'}:{CONTACTS[event]}"
        print(f"t = {t}: {name}", file=sys.stderr)
        after = reset(t, y, p, mode=mode, event=event, bounce=float(count < 50))
        if after is None:
            break
        y, mode = after
        if count == 50:
            print(f"t = {t}: ever shorter bounces end here", file=sys.stderr)
    return np.full(len(y), np.nan), mode


def integrate(y, t, until, steps, p=DEFAULTS, mode=FLIGHT, largest=None):
    """State and mode after ``steps`` steps of one size from t to until."""
    h = (until - t)/steps
    largest = np.zeros((2, len(mode))) if largest is None else largest
    for k in range(steps):
        y, mode = advance(t + k*h, y, h, p, mode, largest)
    return y, mode


def begin(y, t, until, p):
    """State and mode at the start, and what is wrong with it: a gap below zero."""
    if until < t:
        return y, FLIGHT, "until=T: impacts cannot be followed back in time"
    bound = -1e-09*np.abs(y[: len(y)//2]).max()
    for name, gap in zip(CONTACTS, events(t, y, p)):
        if gap < bound:
            return y, FLIGHT, f"the initial state violates {name} by {-gap:.3g}"
    after = reset(t, y, p)
    if after is None:
        return y, FLIGHT, "no motion begins at the initial state"
    return *after, ""


if __name__ == "__main__":
    np.seterr(all="ignore")
    state = [*COORDINATES, *(f"dot({name})" for name in COORDINATES)]
    names = [*state, *PARAMETERS, "until", "steps"]
    given = [*INITIAL, *DEFAULTS, 3.0, 20]
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
    y, mode, wrong = begin(y, 0.0, until, p)
    if wrong:
        sys.exit(wrong)
    largest = np.zeros((2, len(mode)))
    times = np.linspace(0.0, until, 501)
    print("t", *state, sep=",")
    for t, following in zip(times[:-1], times[1:]):
        print(t, *y, sep=",")
        y, mode = integrate(y, t, following, steps, p, mode, largest)
        if not np.isfinite(y).all():
            sys.exit(f"stopped after t = {t}: a singular configuration or a result not finite")
    print(until, *y, sep=",")
