"""Elimination in matrices that are held by rows."""

from __future__ import annotations

from lagrange_cli.program.lowered.routines.numbers import EPSILON, Array, root_scale_of


def solve_definite(n: int, a: Array, b: Array, d: Array) -> bool:
    """Solve a x = b for a symmetric positive definite matrix of n rows; x replaces b.

    The upper triangle of a is given by rows; the n numbers of d are overwritten. a = L D L^T:
    D L^T replaces the upper triangle, the ratios L the lower one. Pivots are judged against the
    diagonal before elimination. Four of them at a time are taken from each row below, along
    memory: this makes vector instructions of the inner loops.
    """
    for i in range(n):
        d[i] = a[i * n + i]
    for first in range(0, n, 4):
        last = first + 4
        if last > n:
            last = n
        # The four rows among themselves.
        for j in range(first, last):
            above = j * n
            if not a[above + j] > EPSILON * d[j]:
                return False
            d[j] = 1.0 / a[above + j]
            for i in range(j + 1, last):
                below = i * n
                ratio = a[above + i] * d[j]
                for k in range(i, n):
                    a[below + k] -= ratio * a[above + k]
                b[i] -= ratio * b[j]
                a[below + j] = ratio
        # All rows below them; there is none where fewer than four were left.
        r0 = first * n
        r1 = r0 + n
        r2 = r1 + n
        r3 = r2 + n
        for i in range(last, n):
            below = i * n
            f0 = a[r0 + i] * d[first]
            f1 = a[r1 + i] * d[first + 1]
            f2 = a[r2 + i] * d[first + 2]
            f3 = a[r3 + i] * d[first + 3]
            for k in range(i, n):
                left = a[below + k] - f0 * a[r0 + k] - f1 * a[r1 + k]
                a[below + k] = left - f2 * a[r2 + k] - f3 * a[r3 + k]
            value = b[i] - f0 * b[first] - f1 * b[first + 1]
            b[i] = value - f2 * b[first + 2] - f3 * b[first + 3]
            a[below + first] = f0
            a[below + first + 1] = f1
            a[below + first + 2] = f2
            a[below + first + 3] = f3
    for i in range(n):
        b[i] *= d[i]
    for i in reversed(range(n)):
        known = b[i]
        for k in range(i):
            b[k] -= known * a[i * n + k]
    return True


def solve_pivoted(n: int, a: Array, b: Array) -> bool:
    """Solve a x = b for n unknowns by elimination with partial pivoting; x replaces b."""
    for j in range(n):
        row = j * n
        best = j
        for i in range(j + 1, n):
            if abs(a[i * n + j]) > abs(a[best * n + j]):
                best = i
        if not abs(a[best * n + j]) > 0.0:
            return False
        if best != j:
            swap = b[j]
            b[j] = b[best]
            b[best] = swap
            for k in range(j, n):
                swap = a[row + k]
                a[row + k] = a[best * n + k]
                a[best * n + k] = swap
        for i in range(j + 1, n):
            below = i * n
            ratio = a[below + j] / a[row + j]
            for k in range(j + 1, n):
                a[below + k] -= ratio * a[row + k]
            b[i] -= ratio * b[j]
    for i in reversed(range(n)):
        value = b[i]
        for k in range(i + 1, n):
            value -= a[i * n + k] * b[k]
        b[i] = value / a[i * n + i]
    return True


def solve_columns(n: int, s: int, c: int, a: Array, b: Array, d: Array) -> bool:
    """Solve M x = f + G^T l, G x + C l = g for c columns of right-hand sides; x replaces f.

    Of the matrix [M, G^T; G, C] of s rows, the upper triangle of the n rows of M, the rows of G
    and the diagonal C are given by rows; the right-hand sides stand in the s rows of b; the s
    numbers of d are overwritten. Rows and columns are scaled alike, then eliminated.
    """
    for i in range(s):
        for j in range(i + 1, s):
            if i >= n:
                a[j * s + i] = 0.0
            if j < n:
                a[j * s + i] = a[i * s + j]
            else:
                a[i * s + j] = a[j * s + i]
    scale_alike(s, a, d)
    for i in range(s):
        row = i * s
        right = i * c
        for j in range(s):
            a[row + j] = a[row + j] * d[i] * d[j]
        for k in range(c):
            b[right + k] *= d[i]
    if not eliminate_columns(s, c, a, b):
        return False
    for i in range(n):
        for k in range(c):
            b[i * c + k] *= d[i]
    return True


def scale_alike(s: int, a: Array, d: Array) -> None:
    """Store scales d, powers of two, by which the largest entries of s rows and columns are near 1.

    The method is Ruiz's, RAL-TR-2001-034.
    """
    for i in range(s):
        d[i] = 1.0
    sweeps = 4
    while sweeps > 0:
        sweeps -= 1
        for i in range(s):
            row = i * s
            size = 0.0
            for j in range(s):
                entry = abs(a[row + j]) * d[j]
                if entry > size:
                    size = entry
            if size > 0.0:
                d[i] *= root_scale_of(size * d[i])


def eliminate_columns(s: int, c: int, a: Array, b: Array) -> bool:
    """Solve a x = b for the c columns of b by elimination with partial pivoting; x replaces b."""
    for j in range(s):
        row = j * s
        right = j * c
        best = j
        for i in range(j + 1, s):
            if abs(a[i * s + j]) > abs(a[best * s + j]):
                best = i
        if not abs(a[best * s + j]) > 0.0:
            return False
        if best != j:
            for k in range(j, s):
                swap = a[row + k]
                a[row + k] = a[best * s + k]
                a[best * s + k] = swap
            for k in range(c):
                swap = b[right + k]
                b[right + k] = b[best * c + k]
                b[best * c + k] = swap
        for i in range(j + 1, s):
            below = i * s
            target = i * c
            ratio = a[below + j] / a[row + j]
            if ratio != 0.0:
                for k in range(j + 1, s):
                    a[below + k] -= ratio * a[row + k]
                for k in range(c):
                    b[target + k] -= ratio * b[right + k]
    for i in reversed(range(s)):
        right = i * c
        for j in range(i + 1, s):
            factor = a[i * s + j]
            known = j * c
            if factor != 0.0:
                for k in range(c):
                    b[right + k] -= factor * b[known + k]
        pivot = a[i * s + i]
        for k in range(c):
            b[right + k] /= pivot
    return True
