"""Positive definite matrices with few nonzeros, factored into ratios and pivots."""

from __future__ import annotations

from lagrange_cli.program.lowered.routines.numbers import EPSILON, Array, Integers


def solve_banded(m: int, w: int, a: Array, b: Array, d: Array) -> bool:
    """Solve a x = b for a symmetric positive definite band of m rows; x replaces b.

    Each row is given from the diagonal on to w columns right of it; the m numbers of d are
    overwritten. a = L D L^T: the ratios L replace what is right of the diagonal. Pivots are judged
    against the diagonal before elimination.
    """
    for k in range(m):
        d[k] = a[k * (w + 1)]
    for k in range(m):
        row = k * (w + 1)
        last = m - 1 - k
        if last > w:
            last = w
        if not a[row] > m * EPSILON * d[k]:
            return False
        d[k] = 1.0 / a[row]
        for i in range(1, last + 1):
            below = row + i * (w + 1) - i
            ratio = a[row + i] * d[k]
            for j in range(i, last + 1):
                a[below + j] -= ratio * a[row + j]
            b[k + i] -= ratio * b[k]
            a[row + i] = ratio
    for k in reversed(range(m)):
        row = k * (w + 1)
        last = m - 1 - k
        if last > w:
            last = w
        value = b[k] * d[k]
        for i in range(1, last + 1):
            value -= a[row + i] * b[k + i]
        b[k] = value
    return True


def solve_sparse(
    m: int,
    n: int,
    node: Integers,
    rows: Integers,
    source: Integers,
    spots: Integers,
    a: Array,
    b: Array,
    d: Array,
    column: Array,
) -> bool:
    """Solve a x = b for a symmetric positive definite matrix of m rows; x replaces b.

    The lower triangle is given by n rectangles: neighbouring columns with nonzeros in the same
    rows, zeros where elimination will fill them. The m numbers of d and a column are overwritten.
    a = L D L^T, from left to right: the ratios L replace what is below the diagonal. Pivots are
    judged against the diagonal before elimination.

    Of each rectangle, node has its first column, the numbers of its columns and of its rows, where
    its numbers start (column by column), where its rows start in rows, and where its updates end.
    Of each update of it, source has the rectangle that it comes from, which of its rows, from the
    first to before the last, are columns of this one, and where in spots those and all later rows
    of it stand among the rows of this one.
    """
    update = 0
    for h in range(n):
        for k in range(node[6 * h + 1]):
            d[node[6 * h] + k] = a[node[6 * h + 3] + k * node[6 * h + 2] + k]
    for h in range(n):
        first = node[6 * h]
        height = node[6 * h + 2]
        start = node[6 * h + 3]
        below = node[6 * h + 4]
        while update < node[6 * h + 5]:
            # Take from this rectangle what an earlier one changes of it.
            giver = 6 * source[4 * update]
            begin = source[4 * update + 1]
            end = node[giver + 2]
            spot = source[4 * update + 3]
            for k in range(begin, source[4 * update + 2]):
                for i in range(k, end):
                    column[i] = 0.0
                for j in range(node[giver + 1]):
                    left = node[giver + 3] + j * end
                    ratio = a[left + k] * a[left + j]
                    for i in range(k, end):
                        column[i] += ratio * a[left + i]
                target = start + spots[spot + k - begin] * height
                for i in range(k, end):
                    a[target + spots[spot + i - begin]] -= column[i]
            update += 1
        for k in range(node[6 * h + 1]):
            top = start + k * height
            if not a[top + k] > m * EPSILON * d[first + k]:
                return False
            d[first + k] = 1.0 / a[top + k]
            for j in range(k + 1, node[6 * h + 1]):
                right = start + j * height
                ratio = a[top + j] * d[first + k]
                for i in range(j, height):
                    a[right + i] -= ratio * a[top + i]
            for i in range(k + 1, height):
                a[top + i] *= d[first + k]
                b[rows[below + i]] -= a[top + i] * b[first + k]
    for h in reversed(range(n)):
        first = node[6 * h]
        height = node[6 * h + 2]
        below = node[6 * h + 4]
        for k in reversed(range(node[6 * h + 1])):
            top = node[6 * h + 3] + k * height
            value = b[first + k] * d[first + k]
            for i in range(k + 1, height):
                value -= a[top + i] * b[rows[below + i]]
            b[first + k] = value
    return True
