"""Discs enclose what functions make of the complex numbers in them."""

from __future__ import annotations

import cmath
from operator import add, mul, sub, truediv

import numpy as np
import pytest

from lagrange_cli.simulate.integrators.base import UnfitError
from lagrange_cli.simulate.integrators.external.heyoka_algebra import Algebra, Traced
from lagrange_cli.simulate.sharpness.disc_arithmetic import DISCS, Disc

#: Name, the function over complex numbers, middles that suit it.
FUNCTIONS = [
    *((name, getattr(cmath, name), (-3.0, 3.0)) for name in ("sin", "cos", "exp", "sinh", "cosh")),
    *((name, getattr(cmath, name), (-1.4, 1.4)) for name in ("tan", "tanh", "atan")),
    *((name, getattr(cmath, name), (0.1, 5.0)) for name in ("log", "sqrt")),
]


def numbers_in(disc, rng, count=60):
    """Complex numbers of a disc, most of them on its edge."""
    size = np.where(rng.random(count) < 0.7, 1.0, rng.random(count))
    return disc.middle + disc.radius * size * np.exp(2j * np.pi * rng.random(count))


def check(found, values):
    slack = 1e-12 * (1 + abs(found.middle))
    assert all(abs(value - found.middle) <= found.radius + slack for value in values)


@pytest.mark.parametrize(("name", "exact", "span"), FUNCTIONS, ids=[f[0] for f in FUNCTIONS])
def test_functions_stay_within_their_discs(name, exact, span):
    rng = np.random.default_rng(1)
    seen = 0
    for middle, radius in zip(
        rng.uniform(*span, 200), 10 ** rng.uniform(-6, 0.5, 200), strict=True
    ):
        disc = Disc(middle, radius)
        with np.errstate(all="ignore"):
            found = getattr(DISCS, name)(disc)
        if not np.isfinite(found.radius):
            continue
        seen += 1
        check(found, [exact(z) for z in numbers_in(disc, rng)])
    assert seen > 60


def test_operations_stay_within_their_discs():
    rng = np.random.default_rng(2)
    for _ in range(200):
        a, b = (Disc(*pair) for pair in zip(rng.uniform(-3, 3, 2), rng.random(2), strict=True))
        p, q = numbers_in(a, rng), numbers_in(b, rng)
        with np.errstate(all="ignore"):
            cases = [
                (a + b, p + q),
                (a - b, p - q),
                (2.0 - a, 2.0 - p),
                (a * b, p * q),
                (a * -3.0, p * -3.0),
                (a / b, p / q),
                (1.5 / b, 1.5 / q),
                (a**3, p**3),
                (b**-2, q**-2.0),
                (a**0.5, p**0.5),
                (2.0**a, 2.0**p),
            ]
        for found, values in cases:
            if np.isfinite(found.radius):
                check(found, values)


@pytest.mark.parametrize(
    ("name", "disc"),
    [
        ("log", Disc(1.0, 1.0)),
        ("sqrt", Disc(1.0, 1.5)),
        ("log", Disc(-1.0, 0.1)),
        ("tan", Disc(1.5, 0.1)),
        ("atan", Disc(0.0, 1.0)),
    ],
)
def test_poles_and_branches_are_no_part_of_a_disc(name, disc):
    with np.errstate(all="ignore"):
        assert not np.isfinite(getattr(DISCS, name)(disc).radius)
        assert not np.isfinite(Disc(0.1, 0.1).inverse().radius)


def test_many_discs_at_once_are_the_same_as_one_by_one():
    middles, radii = np.array([0.1, 1.0, 4.0]), np.array([0.05, 0.2, 0.1])
    many = DISCS.sin(Disc(middles, radii)) / Disc(middles, radii) + 1.0
    for k in range(3):
        one = DISCS.sin(Disc(middles[k], radii[k])) / Disc(middles[k], radii[k]) + 1.0
        assert (one.middle, one.radius) == (many.middle[k], many.radius[k])


def test_functions_that_are_not_known_are_refused():
    with pytest.raises(UnfitError, match="asin"):
        DISCS.asin(Disc(0.1, 0.1))


@pytest.mark.parametrize("operation", ["+", "-", "*", "/", "**"])
def test_what_is_not_smooth_stays_so_beside_discs(operation):
    """A disc and a value that has no derivative make one that has none, in either order."""
    algebra = Algebra(DISCS)
    rough = algebra.functions["sign"](Traced(1.0, algebra))
    disc = Traced(Disc(np.array([1.0, 2.0]), np.array([0.1, 0.2])), algebra)
    of = {"+": add, "-": sub, "*": mul, "/": truediv, "**": pow}[operation]
    for left, right in ((disc, rough), (rough, disc)):
        with pytest.raises(UnfitError, match="not smooth"):
            algebra.plain(of(left, right))
