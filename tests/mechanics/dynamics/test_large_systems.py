"""Chains and nets of many links: families, sparse rows, points found in doubles, certificates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mpf

from lagrange_cli.errors import InputError, InternalError
from lagrange_cli.mechanics import derive, derive_uncertified, reduce
from lagrange_cli.mechanics.algebra.alpha_equivalence import ShapeClasses, rename_symbols, shape
from lagrange_cli.mechanics.certify.certificate import certify
from lagrange_cli.mechanics.dynamics import constraints as closures_module
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.numerics.autodiff import Tape
from lagrange_cli.mechanics.numerics.autodiff_float import DoubleTape
from lagrange_cli.mechanics.numerics.elementary import (
    in_decimals,
    numbers_as_decimals,
    to_decimal,
    to_mpf,
)
from lagrange_cli.mechanics.numerics.gauss_newton import least_norm_solution
from lagrange_cli.mechanics.numerics.rank import clearly_independent, dependent_rows
from lagrange_cli.mechanics.sparse import ExpressionRow, entries
from lagrange_cli.mechanics.system import Closure, Coordinate
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.scene import read_text
from tests.mechanics.mechanics_support import generated

LINKS = 40

CHAIN = """
name: chain
sizes: {{n: {n}}}
parameters: {{m: 0.5, l: {length}, g: 9.81}}
plane: xz
points: {{"p[0]": [0, 0, 0]}}
particles:
  p[i=1..n]: {{mass: m, position: ["x[i]", "y[i]", "z[i]"]}}
constraints:
  rod[i=1..n]: {{distance: ["p[i-1]", "p[i]"], equals: l}}
potentials:
  weight: {{gravity: g}}
initial:
  x[i=1..n]: l*i
  z[i=1..n]: 0
"""


def chain(n: int = LINKS, length: str = "0.25", extra: str = "") -> str:
    return CHAIN.format(n=n, length=length) + extra


@cache
def derivation() -> Uncertified:
    return derive_uncertified(reduce(read_text(chain())))


@cache
def equations() -> Equations:
    return derive(read_text(chain()))


# What a large system's certificate catches.


def change(closure: Closure, part: str) -> Closure:
    """The closure with one part slightly wrong."""
    slightly = 1 + sp.Rational(1, 10**20)
    if part == "gradient":
        held = dict(entries(closure.gradient))
        held[max(held)] *= slightly
        return replace(closure, gradient=ExpressionRow(len(closure.gradient), held))
    if part == "neighbour":
        held = {j + 2: entry for j, entry in entries(closure.gradient).items()}
        return replace(closure, gradient=ExpressionRow(len(closure.gradient), held))
    if part == "rate":
        return replace(closure, rate=sp.Rational(1, 10**20))
    return replace(closure, **{part: getattr(closure, part) * slightly})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "part"),
    [
        (0, "gradient"),
        (23, "neighbour"),
        (LINKS - 2, "rate"),
        (0, "bias"),
        (23, "expression"),
        (LINKS - 2, "gradient"),
    ],
)
def test_a_wrong_closure_among_many_is_caught(number: int, part: str) -> None:
    right = derivation()
    closures = list(right.closures)
    closures[number] = change(closures[number], part)
    with pytest.raises(InternalError):
        certify(replace(right, closures=tuple(closures)), 30, 8)


@pytest.mark.slow
@pytest.mark.parametrize("row", [0, 2 * LINKS - 1])
def test_a_wrong_row_among_many_is_caught(row: int) -> None:
    right = derivation()
    mass = [dict(entry) for entry in right.mass]
    mass[row][row] = tuple(2 * e for e in mass[row][row])
    forcing = list(right.forcing)
    forcing[row] = (*forcing[row], sp.Rational(1, 10**20))
    for wrong in (
        replace(right, inertia=replace(right.inertia, terms=mass)),
        replace(right, forcing=tuple(forcing)),
    ):
        with pytest.raises(InternalError):
            certify(wrong, 30, 8)


@pytest.mark.slow
def test_a_wrong_energy_of_many_is_caught() -> None:
    right = derivation()
    first = right.reduced.coordinates[30]
    shown = {"kinetic": right.kinetic, "potential": right.potential}
    for part in shown:
        wrong = SimpleNamespace(**shown | {part: shown[part] + first.v**2 / 10**20})
        with pytest.raises(InternalError):
            certify(replace(right, energies=wrong), 30, 8)


@pytest.mark.slow
def test_one_state_is_enough_for_many() -> None:
    found = equations().derivation.certificate
    assert (found.points, found.digits) == (1, 30)
    assert found.mismatch < 1e-30


# What a family shares.


def test_each_form_of_a_link_is_worked_out_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first link hangs from a fixed point; all others are alike."""
    worked_out: list[sp.Expr] = []
    tidy = closures_module.tidy

    def counted(stated: sp.Expr) -> sp.Expr:
        worked_out.append(stated)
        return tidy(stated)

    monkeypatch.setattr(closures_module, "tidy", counted)
    derive_uncertified(reduce(read_text(chain(12))))
    assert len(worked_out) == 2


COORDINATES = [
    Coordinate(f"q[{k}]", *(sp.Symbol(f"{kind}q{k}", real=True) for kind in ("", "v", "a")))
    for k in (9, 10, 11, 100)
]
a, b = sp.symbols("a b", positive=True)
#: Expressions in two coordinates and a rate, whose terms SymPy orders by their names.
FORMS: dict[str, Callable[..., sp.Expr]] = {
    "rod": lambda p, q: (p.q - q.q) ** 2 - a**2,
    "sine": lambda p, q: sp.sin(p.q - q.q) - b,
    "cosine": lambda p, q: b * sp.cos(p.q - 2 * q.q) + p.q,
    "unevaluated": lambda p, q: sp.Mul(2, p.q - q.q, evaluate=False) * a,
    "rates": lambda p, q: p.q * q.v - sp.exp(q.q) * p.v,
    "root": lambda p, q: sp.sqrt(a**2 - (p.q + q.q) ** 2) - q.q,
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("pair", [(0, 1), (1, 2), (2, 3), (0, 3), (1, 0), (3, 2)])
def test_members_are_what_their_symbols_say(form: str, pair: tuple[int, int]) -> None:
    """The first of the family is that of q9 and q10."""
    families = ShapeClasses(COORDINATES, lambda expr: expr)
    families.instance(FORMS[form](COORDINATES[0], COORDINATES[1]))
    wanted = FORMS[form](COORDINATES[pair[0]], COORDINATES[pair[1]])
    member = families.instance(wanted)
    assert sp.expand(member.renamed(member.result) - wanted) == 0


def test_forms_that_differ_have_shapes_of_their_own() -> None:
    p, q = COORDINATES[:2]
    places = {p.q: 0, q.q: 1, p.v: 2, q.v: 3}
    found = [form(*pair) for form in FORMS.values() for pair in ((p, q), (q, p))]
    found += [p.q + q.q, p.q - q.q, p.q * q.q, p.q**q.q, a * p.q, b * p.q, 2 * p.q]
    different = set(found)
    assert len({shape(e, places) for e in different}) == len(different)


def test_what_is_left_unevaluated_stays_so() -> None:
    x, y, u, w = sp.symbols("x y u w", real=True)
    factored = sp.Mul(2, x - y, evaluate=False)
    assert str(rename_symbols(factored, {x: w, y: u})) == "2*(-u + w)"


# Rows without their zeros.


@given(st.dictionaries(st.integers(0, 7), st.integers(-2, 2)))
@generated
def test_a_sparse_row_reads_like_a_tuple(held: dict[int, int]) -> None:
    row = ExpressionRow(8, {j: sp.Integer(x) for j, x in held.items()})
    plain = tuple(sp.Integer(held.get(j, 0)) for j in range(8))
    assert (tuple(row), len(row), row[-1], row[2:5]) == (plain, 8, plain[-1], plain[2:5])
    assert row == plain
    assert hash(row) == hash(plain)
    assert entries(row) == entries(plain) == {j: x for j, x in enumerate(plain) if x}
    with pytest.raises(IndexError):
        row[8]


@pytest.mark.slow
def test_matrices_of_many_hold_what_is_not_zero() -> None:
    e = equations()
    assert sum(len(entries(row)) for row in e.system.mass_matrix) == 2 * LINKS
    assert sum(len(entries(c.gradient)) for c in e.system.closures) == 4 * LINKS - 2


# Numbers: doubles first, then all digits.

SMOOTH = ("sin", "cos", "tan", "asin", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt")


def test_doubles_have_the_values_and_slopes_of_high_precision() -> None:
    x, y, c = sp.symbols("x y c", real=True)
    outputs = [getattr(sp, name)(x * y / 3 + c / 7) for name in SMOOTH]
    outputs += [sp.Abs(x - y), sp.atan2(x, y), sp.Max(x, y, c), sp.Min(x, y), x**-3, x, sp.pi * x]
    outputs += [(x - y) ** 2 - c**2, sp.Integer(4), x ** sp.Rational(2, 3)]
    point = [0.7, 1.1, 0.25]
    tape = Tape(outputs, [x, y, c])
    values, slopes = DoubleTape(tape, 2).run(point)
    run = tape.run([(mpf(v), mpf(0), mpf(0)) for v in point], 0)
    assert np.abs(values - np.array([float(v) for v in run.values])).max() < 1e-14
    for k in range(len(outputs)):
        expected = run.partials(k)
        wanted = [float(expected.get(j, 0)) for j in range(2)]
        assert np.abs(slopes[[k]].toarray()[0] - wanted).max() < 1e-13


@pytest.mark.parametrize("value", [1e200, 0.0, -1.0])
def test_what_doubles_do_not_reach_is_an_error(value: float) -> None:
    x = sp.Symbol("x", real=True)
    form = {1e200: x**2, 0.0: 1 / x, -1.0: sp.sqrt(x)}[value]
    with pytest.raises(ArithmeticError):
        DoubleTape(Tape([form], [x]), 1).run([value])


@pytest.mark.slow
@pytest.mark.parametrize("length", ["0.25", "1e200", "1e-200"])
def test_points_of_many_links_have_all_digits(length: str) -> None:
    """Squares of the longest and shortest are beyond the range of doubles."""
    with mpmath.workdps(50):
        reduced = reduce(read_text(chain(length=length)))
        point = reduced.sampler([]).draw()
        assert point is not None
        assert max(reduced.manifold().violations(point)) < mpf(10) ** -40


@pytest.mark.slow
def test_solutions_of_many_equations_have_all_digits_and_are_least() -> None:
    """Against the dense normal equations."""
    count = 80
    rows = [{k: mpf(2) + k, k + 1: mpf(-1), k + 2: mpf(k % 3)} for k in range(count)]
    scale = [mpf(1 + j % 4) for j in range(count + 2)]
    target = [mpf(k * k % 7) - 3 for k in range(count)]
    with mpmath.workdps(40):
        with in_decimals():
            numbers = least_norm_solution(
                [numbers_as_decimals(row) for row in rows],
                [to_decimal(x) for x in target],
                [to_decimal(x) for x in scale],
            )
        found = [to_mpf(x) for x in numbers]
        matrix = mpmath.zeros(count, count + 2)
        for k, row in enumerate(rows):
            for j, x in row.items():
                matrix[k, j] = x * scale[j]
        least = matrix.T * mpmath.lu_solve(matrix * matrix.T, mpmath.matrix(target))
        worst = max(abs(x - y * s) for x, y, s in zip(found, least, scale, strict=True))
        pairs = zip(rows, target, strict=True)
        left = [x - sum(e * found[j] for j, e in row.items()) for row, x in pairs]
        assert worst < mpf(10) ** -14
        assert max(map(abs, left)) < mpf(10) ** -35


@pytest.mark.parametrize("count", [20, 100])
def test_dependent_rows_are_named_with_those_they_follow_from(count: int) -> None:
    rows = [{k: 1.0, k + 1: -0.5} for k in range(count)]
    assert not dependent_rows(rows)
    rows.insert(10, {3: 1.0, 4: 1.5, 5: -1.0})  # the fourth and twice the fifth
    assert clearly_independent(rows) is False
    assert dependent_rows(rows) == {10: (3, 4)}


@pytest.mark.slow
def test_a_redundant_rod_among_many_is_named() -> None:
    text = chain().replace(
        "potentials:", "  bar: {distance: ['p[4]', 'p[5]'], equals: l}\npotentials:"
    )
    found = derive(read_text(text))
    (warning,) = found.derivation.warnings
    assert "'bar' is redundant: implied by 'rod[5]'" in warning.message
    assert (found.derivation.account.dof, len(found.system.closures)) == (LINKS, LINKS)


# The initial state.


@pytest.mark.slow
def test_missing_velocities_of_many_have_least_energy() -> None:
    """One given velocity; the others against the dense formula, masses equal."""
    e = derive(read_text(chain(extra="  dot(z[30]): 2\n  dot(x[7]): 0\n")))
    assert e.system.initial is not None
    names = [c.name for c in e.system.coordinates]
    given = {names.index("z[30]"): 2.0, names.index("x[7]"): 0.0}
    state = {c.q: q for c, q in zip(e.system.coordinates, e.system.initial.positions, strict=True)}
    gradients = np.zeros((LINKS, len(names)))
    for k, closure in enumerate(e.system.closures):
        for j, entry in entries(closure.gradient).items():
            gradients[k, j] = float(entry.xreplace(state))
    free = [j for j in range(len(names)) if j not in given]
    right = -gradients[:, list(given)] @ np.array(list(given.values()))
    expected = np.zeros(len(names))
    expected[list(given)] = list(given.values())
    expected[free] = np.linalg.lstsq(gradients[:, free], right, rcond=None)[0]
    assert np.abs(np.array(e.system.initial.velocities) - expected).max() < 1e-12


@pytest.mark.slow
def test_an_initial_state_off_one_of_many_rods_is_refused() -> None:
    with pytest.raises(InputError) as refused:
        derive(read_text(chain().replace("z[i=1..n]: 0", "z[i=1..n]: l*max(0, i - 39)")))
    assert "violate constraint 'rod[40]'" in refused.value.problems[0].message


# What is reported.


def test_json_of_many_coordinates_lists_entries() -> None:
    matrix = derivation_report(equations())["mass_matrix"]
    assert matrix["shape"] == [2 * LINKS, 2 * LINKS]
    assert matrix["entries"] == [[j, j, "m"] for j in range(2 * LINKS)]
