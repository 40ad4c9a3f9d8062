"""Arithmetic modulo safe primes: inverses, roots, points of the unit circle.

An expression that vanishes identically vanishes at every point of a finite field, and one
that does not is zero there by accident with a probability of its degree over the size of the
field (J. Schwartz, J. ACM 27, 1980; R. Zippel, EUROSAM 1979). Numbers there are exact: no
coefficient is too small to matter.
"""

from __future__ import annotations

from collections.abc import Sequence

#: Primes p = 2r + 1 with r prime, p ≡ 7 (mod 8): −1 is no square, every odd root is unique,
#: and 2, 3, 5, 7, 11, 13 are squares.
SAFE_PRIMES = (
    2282378877958138110872710594916919599,
    2284563664648514326049980794932141519,
    2285939845523290920912371081319143999,
    2287954374564233379780744041853401639,
    2288089006818306050468765466673900439,
    2289054182232256327383526295669179199,
)

#: Bound of numerators and denominators that distinguishes a fraction from a random element.
_SMALL = 2**40

CirclePoint = tuple[int, int]
"""Cosine and sine: a point with c² + s² = 1."""


class NoValueError(ArithmeticError):
    """An expression has no value at this point of the field: 1/0, or a root that is not in it."""


def field_inverse(x: int, p: int) -> int:
    """Invert x; NoValueError for 0."""
    if x % p == 0:
        raise NoValueError
    return pow(x, -1, p)


def field_power(x: int, n: int, p: int) -> int:
    """Raise x to an integer power; NoValueError for a negative power of 0."""
    if n < 0 and x % p == 0:
        raise NoValueError
    return pow(x, n, p)


def field_root(x: int, q: int, p: int) -> int:
    """Take a q-th root of x, itself a square for even q.

    Raises
    ------
    NoValueError
        There is none.
    """
    odd, root = q, x
    while odd % 2 == 0:
        odd //= 2
        square = pow(root, (p + 1) // 4, p)
        if square * square % p != root % p:
            raise NoValueError
        root = square
    return root if odd == 1 else pow(root, pow(odd, -1, p - 1), p)


def solved_linear_system(rows: Sequence[Sequence[int]], p: int) -> list[int]:
    """Solve A x = b modulo p by elimination (Gauss and Jordan).

    Parameters
    ----------
    rows
        Rows of A, shape (n, n), each followed by its entry of b.

    Raises
    ------
    NoValueError
        A is singular.
    """
    left = [list(row) for row in rows]
    for k in range(len(left)):
        pivot = next((i for i in range(k, len(left)) if left[i][k] % p), None)
        if pivot is None:
            raise NoValueError
        left[k], left[pivot] = left[pivot], left[k]
        inverse = field_inverse(left[k][k], p)
        left[k] = [x * inverse % p for x in left[k]]
        for i, row in enumerate(left):
            if i != k and row[k]:
                left[i] = [(x - row[k] * y) % p for x, y in zip(row, left[k], strict=True)]
    return [row[-1] for row in left]


def sign_of_fraction(x: int, p: int) -> int:
    """Give the sign of the fraction with small numerator and denominator that x is; 0 if none.

    Rational reconstruction (P. Wang, SYMSAC 1981); a random element is such a fraction with a
    probability of 1e-12.
    """
    before, after, factor, following = p, x % p, 0, 1
    while after >= _SMALL:
        quotient = before // after
        before, after = after, before - quotient * after
        factor, following = following, factor - quotient * following
    if not after or abs(following) >= _SMALL:
        return 0
    return 1 if following > 0 else -1


def circle_point(u: int, p: int) -> CirclePoint:
    """Give the point of the unit circle whose half-angle has the tangent u.

    1 + u² has an inverse since −1 is no square.
    """
    scale = field_inverse(1 + u * u, p)
    return (1 - u * u) * scale % p, 2 * u * scale % p


def add_angles(a: CirclePoint, b: CirclePoint, p: int) -> CirclePoint:
    """Give cosine and sine of the sum of two angles."""
    return (a[0] * b[0] - a[1] * b[1]) % p, (a[0] * b[1] + a[1] * b[0]) % p


def multiple_angle(a: CirclePoint, n: int, p: int) -> CirclePoint:
    """Give cosine and sine of n times an angle."""
    if n < 0:
        a, n = (a[0], -a[1]), -n
    result: CirclePoint = (1, 0)
    while n:
        if n & 1:
            result = add_angles(result, a, p)
        a, n = add_angles(a, a, p), n >> 1
    return result
