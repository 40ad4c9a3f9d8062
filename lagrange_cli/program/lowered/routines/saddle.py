"""Equations of motion with closures, whose mass matrix may be singular by itself."""

from __future__ import annotations

from math import sqrt

from lagrange_cli.program.lowered.routines.elimination import solve_pivoted
from lagrange_cli.program.lowered.routines.numbers import (
    EPSILON,
    Array,
    power_of_two,
    root_scale_of,
    scale_of,
)
from lagrange_cli.program.solvers.tolerances import LARGEST_EXPONENT, LEAST_INERTIA, UNEVEN_PIVOT

#: The largest inertia over gradient squared, both as powers of two.
LARGEST_RATIO = 2.0 ** (LARGEST_EXPONENT + 1)


def solve_saddle(n: int, m: int, a: Array, b: Array, d: Array, copy: Array, defect: Array) -> bool:
    """Solve M x = f + G^T l, G x + C l = g for n numbers x and m numbers l.

    Of the matrix [M, G^T; G, C] by rows, the upper triangle of M, the rows of G and the diagonal
    C are given: C is 0, or 1 where a row of G and g are zero, which makes that number of l zero.
    [x; l] replaces [f; g] in b; scales d, a copy of the matrix and the defect of the solution are
    overwritten. Units do not matter: M is divided by its size, and rows and columns are scaled
    alike, all by powers of two. Then comes elimination with pivoting; where M is nearly singular
    the solution is refined once, so that every row holds to the rounding of its own terms (Skeel,
    Math. Comput. 35 (1980) 817).
    """
    s = n + m
    size = 0.0
    unit = 1.0
    for i in range(n):
        for j in range(i, n):
            if abs(a[i * s + j]) > size:
                size = abs(a[i * s + j])
    if size > 0.0:
        unit = scale_of(size)
    for i in range(s):
        for j in range(i, s):
            if j < n:
                a[i * s + j] *= unit
            elif i < n:
                a[i * s + j] = a[j * s + i]
            elif i < j:
                a[i * s + j] = 0.0
            a[j * s + i] = a[i * s + j]
        if i < n:
            b[i] *= unit
        d[i] = 0.0
    uneven = is_uneven(n, s, a, copy)
    if uneven:
        scale_inertia(n, s, a, d)
    if not equilibrate(s, a, d):
        return False
    for i in range(s):
        for j in range(s):
            a[i * s + j] = a[i * s + j] * d[i] * d[j]
            copy[i * s + j] = a[i * s + j]
        b[i] *= d[i]
        defect[i] = b[i]
    if not solve_pivoted(s, a, b):
        return False
    if uneven:
        for i in range(s):
            for j in range(s):
                defect[i] -= copy[i * s + j] * b[j]
        if not solve_pivoted(s, copy, defect):
            return False
    for i in range(s):
        if not abs(a[i * s + i]) > s * EPSILON:
            return False
        if uneven:
            b[i] += defect[i]
        b[i] *= d[i]
        if i >= n:
            b[i] /= -unit
    return True


def is_uneven(n: int, s: int, a: Array, c: Array) -> bool:
    """Tell whether elimination leaves little of the inertia of a coordinate.

    c is overwritten. Coordinates without any inertia do not count.
    """
    for i in range(n):
        for j in range(n):
            c[i * n + j] = a[i * s + j]
    for k in range(n):
        row = k * n
        inertia = a[k * s + k]
        if inertia > LEAST_INERTIA:
            if not c[row + k] > UNEVEN_PIVOT * inertia:
                return True
        else:
            for i in range(n):
                if i != k and a[i * s + k] != 0.0:
                    return True
        for i in range(k + 1, n):
            if c[row + i] != 0.0:
                ratio = c[row + i] / c[row + k]
                for j in range(i, n):
                    c[i * n + j] -= ratio * c[row + j]
    return False


def scale_inertia(n: int, s: int, a: Array, d: Array) -> None:
    """Store factors d of the n coordinates for the matrix of solve_saddle.

    They are one over the root of the inertia, or of w g^2 where that is more, for the gradient g
    of each closure. w is the second smallest inertia over g^2 that it meets, if there are two: a
    coordinate that a closure holds need not have inertia at every state. 0 without either.
    """
    for j in range(n):
        d[j] = 0.0
        if a[j * s + j] != 0.0:
            d[j] = power_of_two(abs(a[j * s + j]))
    for i in range(n, s):
        first = LARGEST_RATIO
        second = LARGEST_RATIO
        count = 0
        for j in range(n):
            if a[i * s + j] != 0.0 and a[j * s + j] != 0.0:
                gradient = power_of_two(abs(a[i * s + j]))
                inertia = power_of_two(abs(a[j * s + j]))
                ratio = LARGEST_RATIO
                if gradient * LARGEST_RATIO * gradient > inertia:
                    ratio = inertia / gradient / gradient
                if ratio < first:
                    second = first
                    first = ratio
                elif ratio < second:
                    second = ratio
                count += 1
        if count == 1:
            second = first
        for j in range(n):
            if count > 0 and a[i * s + j] != 0.0:
                gradient = power_of_two(abs(a[i * s + j]))
                size = gradient * second * gradient
                if size > d[j]:
                    d[j] = size
    for j in range(n):
        if d[j] > 0.0:
            d[j] = root_scale_of(d[j])


def equilibrate(s: int, a: Array, d: Array) -> bool:
    """Equilibrate a symmetric matrix of s rows by powers of two (Bunch, J. ACM 18 (1971) 566).

    a[i,j] d[i] d[j] is not small throughout a row. Rows of which d is 0 start from the diagonal,
    or follow from those that they touch. A row of zeros has no scale.
    """
    left = 0
    for i in range(s):
        if not d[i] > 0.0:
            left += 1
    before = s + 1
    while left > 0:
        stuck = left == before
        before = left
        for i in range(s):
            if not d[i] > 0.0:
                size = sqrt(abs(a[i * s + i]))
                for j in range(s):
                    entry = abs(a[i * s + j])
                    if not stuck:
                        entry *= d[j]
                    if entry > size:
                        size = entry
                if size > 0.0:
                    d[i] = scale_of(size)
                    if stuck:
                        d[i] = 1.0
                    stuck = False
                    left -= 1
        if stuck:
            return False
    return True
