"""What Python code of systems with closures has more: a solver, and ``project``."""

from __future__ import annotations

from collections.abc import Collection

from lagrange_cli.emit.constants import (
    LARGEST_EXPONENT,
    LEAST_INERTIA,
    NEWTON_STEPS,
    RESIDUAL_AT_REST,
    RESIDUAL_ROUNDING,
    UNEVEN,
)

__all__ = ["HELPERS", "project_source"]

#: Functions that evaluators and ``project`` call, by name.
HELPERS = {
    "_solve_saddle": '''\
def _solve_saddle(a, b, n):
    """[x, l] of M x = f + G^T l, G x = g, from [[M, G^T], [G, 0]], [f, g] and the number
    of x; units do not matter (equilibration by powers of two after Bunch, J. ACM 18, 566).
    Where M is nearly singular the solution is refined once (Skeel, Math. Comput. 35, 817).
    """
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
        if not (c[k, k] > @UNEVEN@ * own if own > @SMALL@ else not np.delete(m[k], k).any()):
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
                g != 0.0, np.maximum(sizes, min(smallest[-1], @WIDEST@) + exponents), sizes
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
'''.replace("@UNEVEN@", repr(UNEVEN))
    .replace("@SMALL@", repr(LEAST_INERTIA))
    .replace("@WIDEST@", str(LARGEST_EXPONENT)),
    "_solve_banded": '''\
def _solve_banded(a, b):
    """x of S x = b, for a positive definite band of which row k of a holds what is right of
    the diagonal, and it (S = L D L^T).
    """
    m, w = a.shape
    b = np.array([*b, *[0.0] * w])
    bounds = m * 2.0**-53 * a[:, 0]
    a = np.vstack([a, np.zeros((w, w))])
    for k in range(m):
        if not a[k, 0] > bounds[k]:
            raise ArithmeticError("a singular matrix")
        ratio = a[k, 1:] / a[k, 0]
        for i in range(1, w):
            a[k + i, : w - i] -= ratio[i - 1] * a[k, i:]
        b[k + 1 : k + w] -= ratio * b[k]
        b[k] /= a[k, 0]
        a[k, 1:] = ratio
    for k in reversed(range(m)):
        b[k] -= a[k, 1:] @ b[k + 1 : k + w]
    return b[:m].tolist()
''',
    "_residual": '''\
def _residual(out):
    """The largest residual in units of the last place of the magnitudes that follow them."""
    m = len(out) // 2
    return (np.abs(out[:m]) / np.spacing(out[m:])).max()
''',
    "_coupled_residual": '''\
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
''',
}

_HEAD = '''\
def @NAME@(t, y, @P@):
    """The state led back to the closures (all NaN where it is too far from them): q by the
    smallest changes in the metric of the kinetic energy, until only rounding is left
    (Newton's method), then v in the same metric.
    """
    y = np.array(y, dtype=float)
    n = len(y) // 2
    with np.errstate(all="ignore"):
'''

_POSITIONS = """\
        last = np.inf
        for number in range(@ROUNDS@ + 1):
            error = _@OF@position_error(t, y, @CALL@)
            size = _residual(error)
            if size <= @NEAR@:
                break
            if number:
                size = _coupled_residual(error, _@OF@position_reach(t, y, @CALL@))
                if size <= @NEAR@ or (size <= @FAR@ and 2.0 * size > last):
                    break
            if number == @ROUNDS@ or size != size:
                return np.full(2 * n, nan)
            last = size
            y[:n] += _@OF@position_change(t, y, @CALL@)
"""

_VELOCITIES = """\
        if not _residual(_@OF@velocity_error(t, y, @CALL@)) <= @NEAR@:
            y[n:] += _@OF@velocity_change(t, y, @CALL@)
    return y if np.isfinite(y).all() else np.full(2 * n, nan)
"""


def project_source(functions: Collection[str], parameter: str, of: str = "") -> str:
    """The definition of ``project``, empty where there are no closures.

    Parameters
    ----------
    functions
        The other functions of the module.
    parameter
        The text of the last argument (``p``, or ``p=DEFAULTS``).
    of
        ``contact_`` for that of closures and of what is in contact.
    """
    if f"{of}velocity_change" not in functions:
        return ""
    positions = _POSITIONS if f"{of}position_change" in functions else ""
    apart = parameter.endswith("contact")
    text = _HEAD + positions + _VELOCITIES
    replacements = {
        "@NAME@": f"_{of}project" if apart else f"{of}project",
        "@OF@": of,
        "@CALL@": "p, contact" if apart else "p",
        "@P@": parameter,
        "@ROUNDS@": str(NEWTON_STEPS),
        "@NEAR@": repr(RESIDUAL_AT_REST),
        "@FAR@": repr(RESIDUAL_ROUNDING),
    }
    for token, replacement in replacements.items():
        text = text.replace(token, replacement)
    return text
