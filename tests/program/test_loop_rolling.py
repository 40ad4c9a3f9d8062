"""Loops found in statements: the same statements, in the same order."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lagrange_cli.program.graph.operands import (
    AffineIndex,
    Cell,
    Constant,
    FunctionCall,
    Product,
    Sum,
    Variable,
    rebuilt,
)
from lagrange_cli.program.systems.loop_rolling import (
    LoopNest,
    LoopStatement,
    Statement,
    roll_loops,
)

pytestmark = pytest.mark.slow


def locate(name):
    return None if name == "t" else Cell(name[0], int(name[1:]))


def expanded(items):
    """All statements that loops stand for, one by one."""
    for item in items:
        if isinstance(item, LoopNest):
            yield from repeated(item, ())
        else:
            yield item


def repeated(loop, counters):
    if len(counters) < len(loop.counts):
        for i in range(loop.counts[len(counters)].at(counters)):
            yield from repeated(loop, (*counters, i))
        return
    for statement in loop.body:
        target, *places = [
            None if place is None else Cell(place[0], place[1].at(counters))
            for place in statement.places
        ]
        read = iter(places)

        def moved(variable, read=read):
            cell = next(read)
            return variable if cell is None else Variable(f"{cell.array}{cell.number}")

        yield Statement(target, rebuilt(statement.operand, moved))


def counted(statements):
    """Statements with variables #2, #3, … in the place of all whole numbers from 2 on."""
    return [Statement(s.target, with_counts(s.operand)) for s in statements]


def with_counts(operand):
    if isinstance(operand, Constant):
        return Variable(f"#{operand.value}") if operand.value >= 2 else operand
    if isinstance(operand, Sum):
        return Sum(tuple(term_with_count(c, with_counts(part)) for c, part in operand.terms))
    if isinstance(operand, Product):
        above, below = (
            tuple(map(with_counts, parts)) for parts in (operand.numerator, operand.denominator)
        )
        return Product(above, below)
    return operand


def term_with_count(coefficient, part):
    if abs(coefficient) < 2:
        return coefficient, part
    number, sign = Variable(f"#{abs(coefficient)}"), -1 if coefficient < 0 else 1
    if isinstance(part, Product):
        return sign, Product((number, *part.numerator), part.denominator)
    return sign, Product((number, part), ())


def times(*names):
    return Product(tuple(map(Variable, names)), ())


def triangle(n):
    """work[i, j] = a[i]*b[j] for i < j."""
    return [
        Statement(Cell("work", i * n + j), times(f"a{i}", f"b{j}"))
        for i in range(n)
        for j in range(i + 1, n)
    ]


def test_a_triangle_is_one_nest_of_loops():
    statements = triangle(12)
    items = roll_loops(statements, locate)
    nest = items[0]
    assert isinstance(nest, LoopNest)
    assert [(count.base, count.steps) for count in nest.counts] == [(8, ()), (11, (-1,))]
    assert list(expanded(items)) == statements
    # Rows of less than four entries stay written out.
    assert len(items) == 1 + 3 + 2 + 1


def test_a_cube_is_three_loops():
    statements = [
        Statement(Cell("w", 100 * i + 10 * j + k), times(f"a{i}", f"b{j}", f"c{k}", "t"))
        for i in range(5)
        for j in range(6)
        for k in range(7)
    ]
    (loop,) = roll_loops(statements, locate)
    assert [count.base for count in loop.counts] == [5, 6, 7]
    assert list(expanded([loop])) == statements


def test_a_chain_is_a_loop():
    statements = [
        Statement(
            Cell("w", k + 1),
            Sum(((Fraction(1), Variable(f"p{9 - k}")), (Fraction(1), Variable(f"w{k}")))),
        )
        for k in range(10)
    ]
    (loop,) = roll_loops(statements, locate)
    assert list(expanded([loop])) == statements


def test_sines_and_cosines_of_the_same_angles_share_a_loop():
    calls = [
        Statement(Cell("w", shift + k), FunctionCall(function, (Variable(f"y{k}"),)))
        for function, shift in (("cos", 0), ("sin", 8))
        for k in range(8)
    ]
    (loop,) = roll_loops(calls, locate)
    assert len(loop.body) == 2
    assert Counter(expanded([loop])) == Counter(calls)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_repetitions_stay_written_out(count):
    statements = [Statement(Cell("w", k), times(f"a{k}", "b0")) for k in range(count)]
    assert roll_loops(statements, locate) == statements


def test_independent_statements_may_change_places():
    rows = [
        Statement(Cell("work", 20 * i + j), times(f"a{i}", f"b{j}" if j < 9 else "c0"))
        for i in range(10)
        for j in range(10)
    ]
    items = roll_loops(rows, locate, independent=True)
    assert len(items) == 2  # nine columns of one form, and the tenth
    assert Counter(expanded(items)) == Counter(rows)
    assert list(expanded(roll_loops(rows, locate))) == rows


def test_numbers_advance_with_the_cells():
    """(n - max(i, j)) a[i] b[j] of a chain, and what holds each number alone."""
    n = 12
    statements = [
        Statement(
            Cell("work", i * n + j),
            Product((Constant(Fraction(n - j)), Variable(f"a{i}"), Variable(f"b{j}")), ()),
        )
        for i in range(n)
        for j in range(i, n)
    ]
    nest, *others = roll_loops(statements, locate, independent=True)
    assert [(count.base, count.steps) for count in nest.counts] == [(8, ()), (11, (-1,))]
    assert Counter(counted(expanded([nest, *others]))) == Counter(counted(statements))


@pytest.mark.parametrize("sign", [1, -1])
def test_coefficients_advance_with_the_cells(sign):
    statements = [
        Statement(
            Cell("w", k), Sum(((1, Variable(f"a{k}")), (sign * (9 - k), times("t", f"b{k}"))))
        )
        for k in range(10)
    ]
    items = roll_loops(statements, locate)
    loop = items[0]
    assert loop.counts[0].base == 8
    assert len(items) == 3  # 9, 8, …, 2; then 1 and 0
    assert counted(expanded(items)) == counted(statements)


def test_numbers_that_are_rounded_stay():
    statements = [
        Statement(Cell("w", k), Product((Constant(value), Variable(f"a{k}")), ()))
        for k, value in enumerate([2**60, 2**60 + 1, Fraction(5, 2), Fraction(7, 2)] * 3)
    ]
    items = roll_loops(statements, locate)
    assert items == statements


cells = st.builds(Cell, st.sampled_from("ab"), st.integers(0, 5))
names = st.builds(lambda cell: Variable(f"{cell.array}{cell.number}"), cells)
operands = st.one_of(
    names,
    st.tuples(names, names).map(lambda ab: Product(ab, ())),
    st.tuples(names, st.just(Variable("t"))).map(
        lambda ab: Sum(((Fraction(2), ab[0]), (Fraction(-1), ab[1])))
    ),
    st.tuples(names, st.integers(-4, 4).filter(bool), st.integers(1, 4)).map(
        lambda abc: Sum(((abc[1], abc[0]), (1, Product((Constant(abc[2]), abc[0]), ()))))
    ),
)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.builds(Statement, cells, operands), max_size=40), st.integers(1, 5))
def test_loops_repeat_the_statements(statements, times_over):
    statements = statements * times_over
    written = counted(statements)
    assert counted(expanded(roll_loops(statements, locate))) == written
    assert Counter(counted(expanded(roll_loops(statements, locate, independent=True)))) == Counter(
        written
    )


def test_a_loop_tells_the_numbers_of_each_array():
    """w[2 i + 1] = y[i] t for three i: those of w are odd."""
    places = ("w", AffineIndex(1, (2,))), ("y", AffineIndex(0, (1,))), None
    product = Product((Variable("y0"), Variable("t")), ())
    loop = LoopNest((AffineIndex(3),), (LoopStatement(places, product),))
    assert [sorted(loop.numbers(array)) for array in "wyt"] == [[1, 3, 5], [0, 1, 2], []]
