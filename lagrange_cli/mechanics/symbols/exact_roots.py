"""Limits for roots of exact numbers, and a repair of SymPy's cache of factors.

SymPy writes sqrt(12) as 2*sqrt(3), and looks for factors below 2^15 of any number under a root.
That is quick for what a person writes, and takes minutes for numbers of thousands of digits.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import sympy as sp
from sympy.ntheory import factor_

#: Most decimal digits of a numerator or denominator under a root, without powers of ten.
LONGEST_ROOT = 600

#: The same in bits.
_BITS = LONGEST_ROOT * 3322 // 1000

#: Bits that SymPy may leave under a root of a number, of its own making.
_LEFT = 20_000


def has_long_root(base: sp.Expr, exponent: sp.Expr) -> bool:
    """Say whether a power is a root of a number that is too long to be taken apart."""
    if not (base.is_Rational and exponent.is_Rational) or exponent.is_Integer:
        return False
    numbers = int(abs(base.p)), int(base.q)
    if any(_bits_beside_tens(n) > _BITS for n in numbers):
        return True
    powers = int(exponent.p), -int(exponent.p)
    return any(_bits_left(n, p, int(exponent.q)) > _LEFT for n in numbers for p in powers)


def _bits_left(number: int, power: int, root: int) -> int:
    """Bits of the number that stays under the root of number^power.

    Its factors stay there with their exponents modulo ``root``: 12^(5/7) = 2·1944^(1/7), say.
    Exponents of ten digits make numbers that fill the memory.
    """
    left = {k: m * power % root for k, m in sp.Integer(number).factors(limit=2**15).items()}
    shared = math.gcd(*left.values()) or 1
    return sum(exponent // shared * int(k).bit_length() for k, exponent in left.items())


def _bits_beside_tens(number: int) -> int:
    """Count the bits of a number without its powers of ten, which are found at once."""
    number = abs(number)
    tens = _BITS
    while tens and number.bit_length() > _BITS:
        if number % 10**tens == 0:
            number //= 10**tens
        else:
            tens //= 2
    return number.bit_length()


class _Factors(getattr(factor_, "FactorCache", object)):  # type: ignore[misc]
    """SymPy's cache of factors that does not take every unfactored part for a prime.

    A product of two close numbers is taken apart by Fermat's method; with the limit that roots
    ask for, its parts may be composite. SymPy 1.14 then raises instead of leaving them out.
    """

    def add(self, n: int, factors: Iterable[int]) -> None:
        """Keep the factors of a number if all of them are prime."""
        if all(sp.isprime(factor) for factor in factors):
            super().add(n, factors)


if hasattr(factor_, "factor_cache"):
    factor_.factor_cache = _Factors(maxsize=1000)
