"""Tables as functions: their values against SciPy's interpolants, their slopes, their refusals."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from mpmath import mpf
from scipy.interpolate import CubicSpline, PchipInterpolator, RegularGridInterpolator

from lagrange_cli import load
from lagrange_cli.errors import InputError, Mark
from lagrange_cli.files import FileColumn, Table, read_table
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.mechanics.tabulated import in_pieces, tabulated
from lagrange_cli.report.values.derivation import derivation_report

X, Y = sp.symbols("x y", real=True)
AT = Mark("scene.yaml", 3, 5)
COLUMN = Mark("scene.yaml", 3, 25)

POINTS = [(-1, 2), (0, 2.5), (0.3, 4), (1, 4), (2.5, 1), (4, -3.125), (4.5, -3)]
RNG = np.random.default_rng(5)


def source(folder: Path, text: str, column: str = "f") -> FileColumn:
    (folder / "table.csv").write_text(text)
    return FileColumn("table.csv", str(folder), column, AT, COLUMN)


def table(folder: Path, interpolation: str = "monotone", outside: str = "end") -> Table:
    text = "x,f\n" + "".join(f"{x},{f}\n" for x, f in POINTS)
    return read_table(source(folder, text), 1, interpolation, outside)  # type: ignore[arg-type]


def values(expression: sp.Expr, points: np.ndarray) -> np.ndarray:
    return np.array([float(evaluate([expression], {X: mpf(float(x))})[0]) for x in points])


def places() -> np.ndarray:
    x = np.array([x for x, _ in POINTS], dtype=float)
    return np.concatenate([x, RNG.uniform(x[0], x[-1], 60)])


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize(
    ("interpolation", "rule"), [("monotone", PchipInterpolator), ("cubic", CubicSpline)]
)
def test_cubics_are_scipys(tmp_path, interpolation, rule, order):
    x, f = np.array(POINTS, dtype=float).T
    expression = tabulated("f", table(tmp_path, interpolation), [X], order)
    # The second derivative of monotone cubics jumps at the points.
    at = places()[len(POINTS) :] if order == 2 else places()
    assert values(expression, at) == pytest.approx(rule(x, f)(at, order), rel=1e-12, abs=1e-12)


def test_straight_lines(tmp_path):
    x, f = np.array(POINTS, dtype=float).T
    expression = tabulated("f", table(tmp_path, "linear"), [X])
    at = places()
    assert values(expression, at) == pytest.approx(np.interp(at, x, f), abs=1e-14)


def test_monotone_cubics_do_not_overshoot(tmp_path):
    """Between two points all values are between theirs, also for steep data."""
    text = "x,f\n0,0\n1,0\n1.1,100\n2,100.5\n2.01,200\n9,200\n"
    expression = tabulated("f", read_table(source(tmp_path, text), 1, "monotone", "end"), [X])
    rising = values(expression, np.linspace(0, 9, 401))
    assert (np.diff(rising) >= -1e-12).all()
    assert rising.min() == 0
    assert rising.max() == 200


@pytest.mark.parametrize("outside", ["end", "hold", "extend"])
def test_beyond_the_ends(tmp_path, outside):
    expression = tabulated("f", table(tmp_path, outside=outside), [X])
    slope = values(derivative(expression, X), np.array([-1.0, 4.5]))
    beyond = values(expression, np.array([-3.0, 6.5]))
    rate = 0 if outside == "hold" else slope
    assert beyond == pytest.approx([2, -3] + 2 * rate * [-1, 1], abs=1e-12)


def test_derivatives_are_functions_of_the_table(tmp_path):
    given = table(tmp_path)
    whole = derivative(Y * tabulated("f", given, [X**2]), X)
    assert whole == 2 * X * Y * tabulated("f", given, [X**2], 1)
    assert sp.diff(tabulated("f", given, [X]), X) == tabulated("f", given, [X], 1)
    assert tabulated("f", given, [X]) != tabulated("f", table(tmp_path, "linear"), [X])


def test_pieces_join_exactly(tmp_path):
    """Values and slopes on both sides of a point are the same fractions."""
    given = table(tmp_path)
    for order in (0, 1):
        pieces = in_pieces(tabulated("f", given, [X], order))
        for x, _ in POINTS:
            at = sp.Rational(str(x))
            sides = [pieces.xreplace({X: at + s * sp.Rational(1, 10**40)}) for s in (1, -1)]
            assert abs(sides[0] - sides[1]) < sp.Rational(1, 10**37)


GRID = [(x, y, np.sin(x) + x * y**2) for x in (0.0, 0.5, 1.5, 2.0) for y in (-1.0, 0.0, 2.0)]


def grid(folder: Path, interpolation: str) -> Table:
    rows = GRID[::-1]
    text = "x,y,f\n" + "".join(f"{x},{y},{f!r}\n" for x, y, f in rows).replace("np.float64", "")
    return read_table(
        source(folder, text.replace("(", "").replace(")", "")), 2, interpolation, "end"
    )  # type: ignore[arg-type]


def on_grid(expression: sp.Expr, points: np.ndarray) -> np.ndarray:
    at = [{X: mpf(float(x)), Y: mpf(float(y))} for x, y in points]
    return np.array([float(evaluate([expression], place)[0]) for place in at])


def test_bilinear_over_a_grid(tmp_path):
    axes = sorted({x for x, _, _ in GRID}), sorted({y for _, y, _ in GRID})
    known = np.array([f for _, _, f in GRID]).reshape(4, 3)
    points = np.column_stack([RNG.uniform(0, 2, 40), RNG.uniform(-1, 2, 40)])
    expression = tabulated("f", grid(tmp_path, "linear"), [X, Y])
    expected = RegularGridInterpolator(axes, known)(points)
    assert on_grid(expression, points) == pytest.approx(expected, abs=1e-13)


def test_along_lines_of_a_grid_cubics_are_those_of_one_argument(tmp_path):
    expression = tabulated("f", grid(tmp_path, "monotone"), [X, Y])
    for k, y in enumerate((-1.0, 0.0, 2.0)):
        x, f = np.array([(a, c) for a, b, c in GRID if b == y]).T
        at = np.linspace(0, 2, 21)
        points = np.column_stack([at, np.full_like(at, y)])
        assert on_grid(expression, points) == pytest.approx(PchipInterpolator(x, f)(at), abs=1e-13)
        assert k < 3
    for x in (0.0, 0.5, 1.5, 2.0):
        y, f = np.array([(b, c) for a, b, c in GRID if a == x]).T
        at = np.linspace(-1, 2, 21)
        points = np.column_stack([np.full_like(at, x), at])
        assert on_grid(expression, points) == pytest.approx(PchipInterpolator(y, f)(at), abs=1e-13)


def test_slopes_over_a_grid_are_continuous(tmp_path):
    expression = tabulated("f", grid(tmp_path, "monotone"), [X, Y])
    for symbol in (X, Y):
        slope = derivative(expression, symbol)
        for x, y in itertools.product((0.5, 1.5, 0.8), (0.0, 1.1)):
            beside = [(x + s * 1e-9, y + s * 1e-9) for s in (1, -1)]
            high, low = on_grid(slope, np.array(beside))
            assert high == pytest.approx(low, abs=1e-6)
            step = np.array(
                [[x + 1e-5, y], [x - 1e-5, y]] if symbol is X else [[x, y + 1e-5], [x, y - 1e-5]]
            )
            above, below = on_grid(expression, step)
            assert high == pytest.approx((above - below) / 2e-5, abs=1e-4)


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("x,f\n0,1\n0,2\n", 3, "0 is not greater than the value before, 0.0"),
        ("x,f\n0,1\n-1,2\n", 3, "-1 is not greater than the value before, 0.0"),
        ("x,f\n0,1\n", 2, "a table needs two values of each argument"),
        ("x,f\n0,1\n1,nan\n", 3, "expected a finite number, found 'nan'"),
        ("x,f\n0,1\n1,2,3\n", 3, "3 cells in this row, 2 in the first one"),
        ("", 1, "this file is empty"),
    ],
)
def test_bad_rows_are_refused_at_their_place(tmp_path, text, line, said):
    with pytest.raises(InputError) as caught:
        read_table(source(tmp_path, text), 1, "monotone", "end")
    (problem,) = caught.value.problems
    assert problem.message == said
    assert problem.mark is not None
    assert (problem.mark.line, problem.mark.file) == (line, str(tmp_path / "table.csv"))


@pytest.mark.parametrize("column", ["g", "x"])
def test_a_column_without_values_is_refused_in_the_scene(tmp_path, column):
    with pytest.raises(InputError) as caught:
        read_table(source(tmp_path, "x,f\n0,1\n1,2\n", column), 1, "monotone", "end")
    assert caught.value.problems[0].mark == COLUMN


def test_a_grid_with_a_hole_is_refused(tmp_path):
    text = "x,y,f\n0,0,1\n0,1,2\n1,0,3\n"
    with pytest.raises(InputError, match="no row has the arguments 1, 1"):
        read_table(source(tmp_path, text), 2, "monotone", "end")


def test_a_table_of_too_many_points_is_refused(tmp_path):
    text = "x,f\n" + "".join(f"{k},{k}\n" for k in range(500))
    with pytest.raises(InputError, match="a table has at most 400 values"):
        read_table(source(tmp_path, text), 1, "monotone", "end")


SCENE = """
name: tabulated
functions: {f: {of: OF, file: table.csv, column: f}}
particles: {p: {mass: 1, position: POSITION}}
coordinates: [x]
forces: {pull: {on: x, force: FORCE}}
initial: {x: 0.1, dot(x): 0}
simulate: {until: 1}
"""


def scene(folder: Path, of="x", position="[x, 0, 0]", force="f(x)"):
    (folder / "table.csv").write_text("x,f\n" + "".join(f"{x},{f}\n" for x, f in POINTS))
    text = SCENE.replace("OF", of).replace("POSITION", position).replace("FORCE", force)
    (folder / "scene.yaml").write_text(text)
    return load(folder / "scene.yaml")


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"position": "[x, f(x), 0]"}, "f(...) cannot stand in the y position of particle 'p'"),
        ({"of": "u"}, "unknown name 'u' in function 'f'"),
        ({"force": "'f(x, x)'"}, "f(...) takes 1 argument, found 2"),
        ({"of": "[x, x, x]"}, "expected one argument or a list of two"),
    ],
)
def test_scenes_with_misused_tables_are_refused(tmp_path, changed, said):
    with pytest.raises(InputError) as caught:
        scene(tmp_path, **changed)
    assert caught.value.problems[0].message.startswith(said)


def test_a_file_outside_the_folder_is_refused(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "table.csv").write_text("x,f\n0,1\n1,2\n")
    (inner / "scene.yaml").write_text(SCENE.replace("table.csv", "../table.csv"))
    with pytest.raises(InputError, match="lies outside the folder of the scene"):
        load(inner / "scene.yaml")


def test_equations_hold_the_name_and_its_slope(tmp_path):
    """A potential given by a table pushes with its slope, and keeps its energy."""
    scene(tmp_path)
    text = (tmp_path / "scene.yaml").read_text()
    text = text.replace("forces: {pull: {on: x, force: f(x)}}", "potentials: {V: f(x)}")
    (tmp_path / "scene.yaml").write_text(text)
    report = derivation_report(load(tmp_path / "scene.yaml").derive().equations)
    assert report["equations"][0]["residual"] == "ddot(x) + f'(x)"
    assert [q["name"] for q in report["conserved"]] == ["energy"]
    assert report["tables"] == [
        {
            "name": "f",
            "of": "x",
            "file": "table.csv",
            "column": "f",
            "interpolation": "monotone",
            "outside": "end",
        }
    ]
