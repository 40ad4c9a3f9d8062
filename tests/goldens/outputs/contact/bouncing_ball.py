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


RATE_TOLERANCE = 1e-12
GUESSES = 12
LEAST_PIVOT = 1e-06
FEWEST_GUESSED = 8
COMPLEMENTARITY_STEPS = 64
NO_MOTION = 4
UNDETERMINED = 1
IMPACT_TOLERANCES = 1000.0
NOISE = 1.1368683772161603e-13
LAST_PLACE = 2.220446049250313e-16


def falling(c, m, contacts, y, mode, out, gap, force):
    """Store what falls through zero where one of c contacts opens or closes.

    It is the multiplier of a closed one, behind those of m closures, and the gap of an open one.
    gap and force are overwritten. Tell whether all are known.
    """
    if not contacts.gaps(y, gap):
        return False
    closed = False
    for k in range(c):
        out[k] = gap[k]
        if mode[k] > 0.0:
            closed = True
    if closed:
        if not contacts.contact_multipliers(y, mode, force):
            return False
        for k in range(c):
            if mode[k] > 0.0:
                out[k] = force[m + k]
    return True


def gap_rate(n, c, k, y, terms):
    """Return the rate of gap k."""
    rate = terms[c * n + k]
    for i in range(n):
        rate += terms[k * n + i] * y[n + i]
    return rate


def gap_size(n, c, k, y, terms):
    """Return the sum of the magnitudes of the terms of the rate of gap k."""
    size = abs(terms[c * n + k])
    for i in range(n):
        size += abs(terms[k * n + i] * y[n + i])
    return size


def look(n, c, contacts, event, late, y, mode, gap, terms, before, closed, speed, size):
    """Store gaps and terms at a state, what was closed and is now, and rates of the gaps.

    Tell whether all are known.
    """
    if not contacts.gaps(y, gap):
        return False
    if not contacts.gap_terms(y, terms):
        return False
    for k in range(c):
        speed[k] = gap_rate(n, c, k, y, terms)
        size[k] = gap_size(n, c, k, y, terms)
        near = RATE_TOLERANCE * gap[c + k]
        if speed[k] < 0.0:
            near -= late * speed[k]
        before[k] = mode[k]
        closed[k] = 0.0
        if before[k] > 0.0 or k == event or gap[k] <= near:
            closed[k] = 1.0
    return True


def clear(c, mode):
    """Open all contacts of a mode."""
    for k in range(2 * c):
        mode[k] = 0.0


def respond(n, c, contacts, y, mode, terms, closed, d, change):
    """Store by columns what a unit impulse of each closed contact adds to the rates of all gaps."""
    for k in range(c):
        clear(c, mode)
        mode[k] = 1.0
        mode[c + k] = 1.0
        moves = False
        if closed[k] > 0.0:
            moves = contacts.impulse(y, mode, change)
        # One that the closures alone hold back takes no impulse.
        for j in range(c):
            d[j * c + k] = 0.0
            for i in range(n):
                if moves:
                    d[j * c + k] += terms[j * n + i] * change[i]


def solve_active(n, least, d, active, r, a):
    """Solve d x = r for active pushes alone; x replaces r, and a is overwritten.

    What is zero costs nothing (contacts that act on their neighbours). Tell whether all pivots are
    larger than the least one.
    """
    for i in range(n):
        for j in range(n):
            a[i * n + j] = 0.0
            if active[i] > 0.0 and active[j] > 0.0:
                a[i * n + j] = d[i * n + j]
            elif i == j:
                a[i * n + j] = 1.0
    for j in range(n):
        if not a[j * n + j] > least:
            return False
        for i in range(j + 1, n):
            ratio = a[i * n + j] / a[j * n + j]
            if ratio < 0.0 or ratio > 0.0:
                for k in range(j, n):
                    a[i * n + k] -= ratio * a[j * n + k]
                r[i] -= ratio * r[j]
    for i in reversed(range(n)):
        for j in range(i + 1, n):
            r[i] -= a[i * n + j] * r[j]
        r[i] /= a[i * n + i]
    return True


def guess_pushes(n, d, closed, start, size, x, active, r, a):
    """Store x and active of what pushes at first sight: zeros where that does not end soon.

    It is all that is violated, without what would pull, with what is violated then
    (Hintermueller, Ito and Kunisch, SIAM J. Optim. 13 (2002) 865). r and a are overwritten.
    """
    for k in range(n):
        active[k] = 0.0
        if closed[k] > 0.0 and start[k] < 0.0:
            active[k] = 1.0
    rounds = GUESSES
    changing = True
    while changing and rounds > 0:
        rounds -= 1
        for k in range(n):
            r[k] = 0.0
            if active[k] > 0.0:
                r[k] = -start[k]
        if not solve_active(n, LEAST_PIVOT, d, active, r, a):
            break
        changing = False
        for k in range(n):
            rate = start[k]
            magnitude = size[k]
            for j in range(n):
                rate += d[k * n + j] * r[j]
                magnitude += abs(d[k * n + j] * r[j])
            pushes = closed[k] > 0.0 and rate < -RATE_TOLERANCE * magnitude
            if active[k] > 0.0:
                pushes = r[k] > 0.0
            x[k] = 0.0
            if pushes:
                x[k] = 1.0
            if x[k] != active[k]:
                changing = True
        for k in range(n):
            if changing:
                active[k] = x[k]
            x[k] = r[k]
    if changing:
        for k in range(n):
            active[k] = 0.0
            x[k] = 0.0


def raise_push(n, k, d, w, x, active, r, a):
    """Raise push k until w[k] is zero; active pushes that are used up end.

    r and a are overwritten. Tell whether that has an effect; else active are the contacts that
    take all of it.
    """
    while not active[k] > 0.0:
        for j in range(n):
            r[j] = 0.0
            if active[j] > 0.0:
                r[j] = d[j * n + k]
        if not solve_active(n, 0.0, d, active, r, a):
            for j in range(n):
                active[j] = 0.0
            return False
        rise = d[k * n + k]
        first = n
        least = 0.0
        for j in range(n):
            if active[j] > 0.0:
                rise -= d[k * n + j] * r[j]
                if r[j] > 0.0 and (first == n or x[j] / r[j] < least):
                    first = j
                    least = x[j] / r[j]
        if first == n and not rise > RATE_TOLERANCE:
            for j in range(n):
                active[j] = 0.0
                if j == k or r[j] < -RATE_TOLERANCE:
                    active[j] = 1.0
            return False
        if rise > RATE_TOLERANCE and (first == n or -w[k] / rise <= least):
            first = n
            least = -w[k] / rise
        for j in range(n):
            if active[j] > 0.0:
                x[j] -= least * r[j]
                if not x[j] > 0.0:
                    x[j] = 0.0
        x[k] += least
        if first == n:
            active[k] = 1.0
        else:
            w[k] += least * rise
            if w[k] > 0.0:
                w[k] = 0.0
            active[first] = 0.0
            x[first] = 0.0
    return True


def push(n, d, closed, start, size, w, x, active, r, a):
    """Find pushes x of the n contacts of which some are closed, and which of them are active.

    start are the numbers w without pushes, size the magnitudes that they are sums of: what is
    rounding becomes zero. The arrays behind are overwritten. Tell whether there are such pushes;
    else active are contacts that cannot all be met, none where that is not known.
    """
    for k in range(n):
        x[k] = 0.0
        active[k] = 0.0
        if not abs(start[k]) > RATE_TOLERANCE * size[k]:
            start[k] = 0.0
    if n >= FEWEST_GUESSED:
        guess_pushes(n, d, closed, start, size, x, active, r, a)
    steps = COMPLEMENTARITY_STEPS * (n + 1)
    while steps > 0:
        steps -= 1
        violated = n
        for k in reversed(range(n)):
            w[k] = start[k]
            magnitude = size[k]
            for j in range(n):
                w[k] += d[k * n + j] * x[j]
                magnitude += abs(d[k * n + j] * x[j])
            if active[k] > 0.0 or abs(w[k]) <= RATE_TOLERANCE * magnitude:
                w[k] = 0.0
            if closed[k] > 0.0 and w[k] < 0.0:
                violated = k
        if violated == n:
            return True
        if not raise_push(n, violated, d, w, x, active, r, a):
            return False
    for k in range(n):
        active[k] = 0.0
    return False


def collide(n, c, contacts, bounce, y, mode, terms, before, closed, speed, size, start, w, x, d,
        change, r, a):
    """Change velocities by the impact of what is closed, and the rates of the gaps with them.

    Return 0, or why that is impossible.
    """
    for k in range(c):
        e = terms[c * n + 2 * c + k]
        if closed[k] > 0.0 and not (e >= 0.0 and e <= 1.0 + RATE_TOLERANCE):
            return NO_MOTION
        if before[k] > 0.0:
            speed[k] = 0.0
        start[k] = speed[k]
        if speed[k] < 0.0:
            start[k] += bounce * e * speed[k]
    if not push(c, d, closed, start, size, w, x, mode, r, a):
        return NO_MOTION
    # The least rate after the impact, and that of active contacts.
    for k in range(c):
        least = 0.0
        if speed[k] < 0.0:
            least = -bounce * terms[c * n + 2 * c + k] * speed[k]
        speed[k] = least
    # A second time for what rounding has left of the first.
    rounds = 2
    while rounds > 0:
        rounds -= 1
        for k in range(c):
            mode[c + k] = speed[k] - gap_rate(n, c, k, y, terms)
        if not contacts.impulse(y, mode, change):
            clear(c, mode)
            return UNDETERMINED
        for i in range(n):
            y[n + i] += change[i]
    for k in range(c):
        rate = gap_rate(n, c, k, y, terms)
        size[k] += gap_size(n, c, k, y, terms)
        error = speed[k] - rate
        if mode[k] > 0.0:
            error = abs(error)
        if closed[k] > 0.0 and not error <= IMPACT_TOLERANCES * RATE_TOLERANCE * size[k]:
            clear(c, mode)
            return NO_MOTION
        if not mode[k] > 0.0:
            speed[k] = rate
    return 0


def settle(n, c, contacts, y, mode, terms, closed, size, start, w, x, d, slope, force, r, a):
    """Store the mode in which those of the closed contacts are closed that have to push now.

    Return 0, or why nothing follows.
    """
    if not contacts.gap_terms(y, terms):
        return UNDETERMINED
    if not contacts.flight_rhs(y, slope):
        return UNDETERMINED
    for k in range(c):
        start[k] = terms[c * n + c + k]
        size[k] = abs(start[k])
        for i in range(n):
            start[k] += terms[k * n + i] * slope[n + i]
            size[k] += abs(terms[k * n + i] * slope[n + i])
    if not push(c, d, closed, start, size, w, x, mode, r, a):
        return NO_MOTION
    pushing = False
    for k in range(c):
        mode[c + k] = 0.0
        if mode[k] > 0.0:
            pushing = True
    if not pushing:
        return 0
    if not contacts.contact_multipliers(y, mode, force):
        clear(c, mode)
        return UNDETERMINED
    return 0


def reset_contacts(n, c, contacts, event, bounce, late, y, mode, gap, terms, before, closed, speed,
        size, start, w, x, d, change, slope, force, r, a):
    """Change state and mode behind an event of a contact, or at a start, where event is c.

    bounce is 1, or 0 for an impact without restitution; what closes within the time late closes
    now. The arrays behind the mode are overwritten. Return 0, or why nothing follows: 1 in a
    singular configuration or where a number is not finite, 4 where contacts leave no motion, which
    are then those of the mode.
    """
    if not look(n, c, contacts, event, late, y, mode, gap, terms, before, closed, speed, size):
        clear(c, mode)
        return UNDETERMINED
    respond(n, c, contacts, y, mode, terms, closed, d, change)
    clear(c, mode)
    approaching = False
    for k in range(c):
        if closed[k] > 0.0 and not before[k] > 0.0 and speed[k] < -RATE_TOLERANCE * size[k]:
            approaching = True
    if approaching:
        outcome = collide(
            n,
            c,
            contacts,
            bounce,
            y,
            mode,
            terms,
            before,
            closed,
            speed,
            size,
            start,
            w,
            x,
            d,
            change,
            r,
            a,
        )
        if outcome > 0:
            return outcome
    for k in range(c):
        stays = speed[k] <= RATE_TOLERANCE * size[k]
        if before[k] > 0.0 and not approaching:
            stays = k != event
        if not stays:
            closed[k] = 0.0
    return settle(n, c, contacts, y, mode, terms, closed, size, start, w, x, d, slope, force, r, a)


def first_due(c, mode, before, values, largest):
    """Return the first of c contacts that has to open or close, c without any.

    Numbers are measured by the largest so far, so that rounding is no event; nor is what was below
    zero before (a gap that only touches).
    """
    due = c
    for k in range(c):
        place = k
        if mode[k] > 0:
            place = c + k
        if abs(values[k]) > largest[place]:
            largest[place] = abs(values[k])
        least = -NOISE * largest[place]
        if before[k] < 0.0:
            least += before[k]
        if due == c and values[k] < least:
            due = k
    return due


def advance(n, c, motion, t, h, mode, y, start, before, values, largest, taken):
    """Advance the n numbers of a state from t by h, or to the first event of c
    contacts and relays.

    Return the number of the contact, c without an event, c + 1 without a result; the time that it
    took is stored in taken. largest holds the largest numbers so far, of open contacts, then of
    closed ones. start, before and values are overwritten.
    """
    for i in range(n):
        start[i] = y[i]
    taken[0] = h
    if not motion.falls(t, y, mode, before):
        return c + 1
    event = c
    early = 0.0
    late = h
    trial = h
    searching = True
    while searching:
        if not motion.step(t, trial, start, mode, y):
            return c + 1
        if not motion.falls(t + trial, y, mode, values):
            return c + 1
        due = first_due(c, mode, before, values, largest)
        if due == c and event == c:
            return c
        if due < c:
            event = due
            late = trial
        else:
            early = trial
        trial = early + (late - early) / 2.0
        searching = early < trial and trial < late and late - early > LAST_PLACE * abs(t)
    taken[0] = late
    if not motion.step(t, late, start, mode, y):
        return c + 1
    return event


class _Contacts:
    """Functions of contacts at one time: each stores its results and tells whether they are finite,
    those of one state at least.
    """

    def __init__(self, t, *given):
        self.t, self.given = t, given

    def stored(self, results, function, y, *mode):
        results[:] = function(self.t, y, *self.given, *mode)
        return np.isfinite(results).all(axis=0).any()

    def gaps(self, y, results):
        return self.stored(results, _gaps, y)

    def gap_terms(self, y, results):
        return self.stored(results, _gap_terms, y)

    def flight_rhs(self, y, results):
        return self.stored(results, flight, y)

    def impulse(self, y, mode, results):
        return self.stored(results, _impulse, y, mode[:1], mode[1:])

    def contact_multipliers(self, y, mode, results):
        return self.stored(results, multipliers, y, mode[:1])


def _flags(mode):
    """Flags of closed contacts, with places for targets behind them."""
    if len(mode) != 1:
        raise ValueError(f"a mode has as many numbers as CONTACTS, 1, not {len(mode)}")
    return np.array([*mode, *1*[0]], dtype=float)


def events(t, y, p=DEFAULTS, mode=FLIGHT):
    """What falls through zero at events: multipliers of closed contacts, gaps of open ones."""
    out, gap, force = (np.zeros((k, *y.shape[1:])) for k in (1, 2, 1))
    falling(1, 0, _Contacts(t, p), y, _flags(mode), out, gap, force)
    known = np.isfinite(gap).all(axis=0) & np.isfinite(force).all(axis=0)
    return np.where(known, out, np.nan)


def reset(t, y, p=DEFAULTS, mode=FLIGHT, event=-1, bounce=1.0):
    """State and mode after an event, or from a start (event=-1), of one state; None without any.

    What closes takes an impact, by Newton's law with impulses that only push (bounce=0.0: without
    restitution, to end a sequence of ever shorter bounces).
    """
    y, flags = np.array(y, dtype=float), _flags(mode)
    arrays = map(np.zeros, (2, 5, 1, 1, 1, 1, 1, 1, 1, 1, 2, 4, 1, 1, 1))
    late, event = 1.4210854715202004e-14*abs(t), event if event >= 0 else 1
    with np.errstate(all="ignore"):
        contacts = _Contacts(t, p)
        status = reset_contacts(2, 1, contacts, event, bounce, late, y, flags, *arrays)
    return None if status else (y, tuple(flags[:1].astype(int).tolist()))


def stepped(t, y, h, p, mode):
    """State after one classical Runge-Kutta step of size h, led back to what is closed."""
    k1 = rhs(t, y, p, mode=mode)
    k2 = rhs(t + h/2, y + h/2*k1, p, mode=mode)
    k3 = rhs(t + h/2, y + h/2*k2, p, mode=mode)
    k4 = rhs(t + h, y + h*k3, p, mode=mode)
    return project(t + h, y + h/6*(k1 + 2*k2 + 2*k3 + k4), p, mode)


class _Motion:
    """Steps and events of a motion: each stores its results and tells whether they are finite."""

    def __init__(self, p):
        self.p = p

    def step(self, t, h, start, mode, results):
        results[:] = stepped(t, start, h, self.p, mode)
        return np.isfinite(results).all()

    def falls(self, t, y, mode, results):
        results[:] = events(t, y, self.p, mode=mode)
        return np.isfinite(results).all()


def follow(t, y, h, p, mode, largest):
    """State and mode after a step of size h, with its events."""
    end, n = t + h, len(y)
    y, taken = np.array(y), np.zeros(1)
    for count in range(1000 + 1):
        if not t < end:
            return y, mode
        arrays = np.empty(n), np.empty(1), np.empty(1)
        event = advance(n, 1, _Motion(p), t, end - t, mode, y, *arrays, largest, taken)
        if event == 1:
            return y, mode
        if event > 1:
            break
        t += taken[0]
        name = f"{'release' if mode[event] else 'contact'}:{CONTACTS[event]}"
        print(f"t = {t}: {name}", file=sys.stderr)
        after = reset(t, y, p, mode=mode, event=event, bounce=float(count < 50))
        if after is None:
            break
        y, mode = after
        if count == 50:
            print(f"t = {t}: ever shorter bounces end here", file=sys.stderr)
    return np.full(n, np.nan), mode


def integrate(y, t, until, steps, p=DEFAULTS, mode=FLIGHT, largest=None):
    """State and mode after ``steps`` steps of one size from t to until."""
    h = (until - t)/steps
    largest = np.zeros(2) if largest is None else largest
    for k in range(steps):
        y, mode = follow(t + k*h, y, h, p, mode, largest)
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
    largest = np.zeros(2)
    times = np.linspace(0.0, until, 501)
    print("t", *state, sep=",")
    for t, following in zip(times[:-1], times[1:]):
        print(t, *y, sep=",")
        y, mode = integrate(y, t, following, steps, p, mode, largest)
        if not np.isfinite(y).all():
            sys.exit(f"stopped after t = {t}: a singular configuration or a result not finite")
    print(until, *y, sep=",")
