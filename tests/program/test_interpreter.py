"""Functions that are interpreted have the values of the equations, over numbers of any kind."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from lagrange_cli.program.emitted_functions import constraint_programs, derivative_programs
from lagrange_cli.program.graph.operands import (
    AffineIndex,
    Constant,
    Element,
    FunctionCall,
    Product,
    Sum,
    Variable,
)
from lagrange_cli.program.interpreter import interpreter
from lagrange_cli.program.interpreter.arithmetic import (
    DOUBLES,
    UnsupportedError,
    digits,
    objects,
)
from lagrange_cli.program.interpreter.interpreter import compiled
from lagrange_cli.program.kinds import ProgramKind
from lagrange_cli.program.lowered.functions import Function, Let, Scope, Store
from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.program.program import build_program
from tests.emit import emit_systems as systems
from tests.emit.emit_reference import DIGITS, Reference, difference, states
from tests.emit.test_c import ROWS
from tests.program.test_large_systems import CASES, chain, net, state
from tests.program.test_program import one_coordinate
from tests.systems.shipped import SCENES, SLICE, derived, parameter_values, sliced, start

#: Functions of a state, by the outputs of their programs.
OUTPUTS = {"mass_matrix": "mass_matrix", "forcing": "forcing", "energy": "energy"}
OUTPUTS |= {"positions": "positions", "velocities": "velocities", "rhs": "acceleration"}


def function_of(equations, name):
    return lowered(build_program(equations, [OUTPUTS[name]]), name)


@pytest.mark.slow
@pytest.mark.parametrize("make", systems.ALL)
def test_doubles_agree_with_the_equations(make):
    equations = make()
    reference = Reference(equations)
    functions = {name: compiled(function_of(equations, name)) for name in OUTPUTS}
    for t, y, p in states(equations, count=5):
        rhs = functions["rhs"](t, y, p)
        bound = 1e-13 * max(10, reference.condition(t, y, p))
        assert difference(rhs, reference.rhs(t, y, p)) < bound
        assert functions["rhs"].bound(p)(t, y).tolist() == rhs.tolist()
        matrix = functions["mass_matrix"](t, y, p)
        assert difference(matrix.ravel(), reference.mass_matrix(t, y, p)) < 1e-13
        for name in ("forcing", "positions", "velocities"):
            values = functions[name](t, y, p)
            assert difference(values, getattr(reference, name)(t, y, p)) < 1e-12
        energies = reference.energy(t, y, p)
        error = abs(functions["energy"](t, y, p) - float(energies[2]))
        assert error < 1e-13 * (1 + float(max(map(abs, energies))))


#: Scenes with a start and with nothing that is read from files; functions of digits know no loops.
_STILL = {"seismometer", "driven_spring", "damped_driven_pendulum"}


def function_of_families(function):
    return any(isinstance(step, Scope) for step in function.body)


@sliced(sorted(SCENES.keys() - _STILL), SLICE)
def test_scenes_have_the_values_of_their_equations(name):
    """Doubles, and many digits where no family is large, against expressions in mpmath."""
    equations = derived(name)
    if equations.system.initial is None or equations.system.inputs:
        pytest.skip("the scene has no state to begin with")
    reference = Reference(equations)
    t, y, p = 0.25, start(equations) + 0.01, parameter_values(equations)
    for function in ("forcing", "energy", "positions", "velocities", "mass_matrix"):
        lowered_function = function_of(equations, function)
        expected = getattr(reference, function)(t, y, p)[-1 if function == "energy" else 0 :]
        if not all(isinstance(x, mpmath.mpf) and mpmath.isfinite(x) for x in expected):
            continue
        values = np.ravel(compiled(lowered_function)(t, y, p))
        size = max([abs(x) for x in expected], default=0)
        error = max((abs(a - b) for a, b in zip(values, expected, strict=True)), default=0)
        assert error <= 1e-12 * (1 + size)
        try:
            with mpmath.workdps(DIGITS):
                exact = compiled(lowered_function, digits(mpmath.mp))
                values = exact(mpmath.mpf(t), [*map(mpmath.mpf, y)], [*map(mpmath.mpf, p)])
                error = max((abs(a - b) for a, b in zip(values, expected, strict=True)), default=0)
                assert error <= mpmath.mpf(10) ** (4 - DIGITS) * (1 + size)
        except UnsupportedError:
            assert function_of_families(lowered_function)


@pytest.mark.parametrize("row", list(ROWS))
def test_every_function_of_the_language(row):
    equations = one_coordinate(ROWS[row])
    reference = Reference(equations)
    positions = compiled(function_of(equations, "positions"))
    for at in (-2.0, -0.5, 0.3, 1.0, 2.5):
        (value,) = positions(0.0, [at, 0.0], [1.0, 1.0, 1.0])
        (expected,) = reference.positions(0.0, [at, 0.0], [1.0, 1.0, 1.0])
        assert abs(value - expected) < 1e-14 * (1 + abs(expected))


def function_over(operand, *lets):
    """A function of p0 and p1 with one result."""
    store = Store(Element("out", AffineIndex(0)), operand)
    return Function("f", ProgramKind.ENERGY, (*lets, store), (1,), 0, 2)


class Counted:
    """A number that writes down what is done with it."""

    def __init__(self, text):
        self.text = text

    def __add__(self, other):
        return Counted(f"({self.text} + {text_of(other)})")

    def __radd__(self, other):
        return Counted(f"({text_of(other)} + {self.text})")

    def __sub__(self, other):
        return Counted(f"({self.text} - {text_of(other)})")

    def __rsub__(self, other):
        return Counted(f"({text_of(other)} - {self.text})")

    def __mul__(self, other):
        return Counted(f"({self.text} * {text_of(other)})")

    def __rmul__(self, other):
        return Counted(f"({text_of(other)} * {self.text})")

    def __truediv__(self, other):
        return Counted(f"({self.text} / {text_of(other)})")

    def __rtruediv__(self, other):
        return Counted(f"({text_of(other)} / {self.text})")

    def __neg__(self):
        return Counted(f"(-{self.text})")


def text_of(value):
    return value.text if isinstance(value, Counted) else repr(value)


A, B = Variable("p0"), Variable("p1")


@pytest.mark.parametrize(
    ("operand", "expected"),
    [
        (Product((A, B, A), (B, A)), "(((a * b) * a) / (b * a))"),
        (Product((), (A,)), "(1.0 / a)"),
        (Sum(((1, A), (-1, B), (Fraction(3, 2), A))), "((a - b) + (1.5 * a))"),
        (Sum(((-2, Product((A, B), (A,))),)), "((-((2.0 * a) * b)) / a)"),
        (Sum(((1, A), (-3, Constant(1)))), "(a - 3.0)"),
        (Product((Sum(((1, A), (1, B))), FunctionCall("sin", (A,))), ()), "((a + b) * sin(a))"),
        (FunctionCall("atan2", (A, Sum(((-1, B),)))), "atan2(a, (-b))"),
    ],
)
def test_operations_have_the_order_of_texts(operand, expected):
    """Emitted languages print the same operand with the same parentheses."""
    known = {
        "sin": lambda x: Counted(f"sin({text_of(x)})"),
        "atan2": lambda x, y: Counted(f"atan2({text_of(x)}, {text_of(y)})"),
    }
    function = compiled(function_over(operand), objects(known))
    (value,) = function(0.0, [], [Counted("a"), Counted("b")])
    assert value.text == expected


def test_equal_values_are_one_object():
    square = Product((Variable("w0"), Variable("w0")), ())
    function = function_over(square, Let("w0", Sum(((1, A), (1, B)))))
    seen = []

    class Squared(Counted):
        def __mul__(self, other):
            seen.append(other is self)
            return self

        def __add__(self, other):
            return Squared("sum")

    compiled(function, objects({}))(0.0, [], [Squared("a"), Squared("b")])
    assert seen == [True]


def test_bound_parameters_are_evaluated_once():
    calls = []
    arithmetic = replace(DOUBLES, functions={"exp": lambda x: calls.append(x) or math.exp(x)})
    state = Product((FunctionCall("exp", (A,)), Variable("t")), ())
    bound = compiled(function_over(state), arithmetic).bound([2.0, 1.0])
    assert [bound(t, [])[0] for t in (1.0, 2.0)] == [math.exp(2.0), 2 * math.exp(2.0)]
    assert calls == [2.0]


@pytest.mark.parametrize(
    "operand",
    [
        FunctionCall("sqrt", (A,)),
        FunctionCall("log", (A,)),
        Product((A,), (B,)),
        FunctionCall("exp", (Product((A, A), ()),)),
        Product((A, A, A), ()),
    ],
)
def test_numbers_without_a_value_are_nan(operand):
    """A domain error, a division by zero, an overflow of a function and of a product."""
    function = compiled(function_over(operand))
    p = [-1e300, 0.0]
    assert np.isnan(function(0.0, [], p)).all()
    assert np.isnan(function.bound(p)(0.0, [])).all()


def test_a_long_chain_of_sums_is_no_deep_call():
    lets, last = [], A
    for k in range(3000):
        lets.append(Let(f"w{k}", Sum(((1, Product((last, B), ())), (1, A)))))
        last = Variable(f"w{k}")
    (value,) = compiled(function_over(last, *lets))(0.0, [], [1.0, 0.5])
    assert value == pytest.approx(2.0)


def test_states_without_accelerations_have_no_results():
    """A pendulum of Cartesian coordinates whose rod has no direction."""
    equations = derived("pendulum_in_cartesian_coordinates")
    rhs, p = compiled(function_of(equations, "rhs")), parameter_values(equations)
    y = start(equations)
    assert np.isfinite(rhs(0.0, y, p)).all()
    y[: len(y) // 2] = 0.0
    assert np.isnan(rhs(0.0, y, p)).all()
    assert np.isnan(rhs.bound(p)(0.0, y)).all()


def test_linear_systems_in_many_digits():
    """A definite block of four and closures: residuals of the solved equations vanish."""
    for name in ("four_bar_linkage", "spherical_pendulum_from_the_pole"):
        equations = derived(name)
        program = build_program(equations, ["acceleration"])
        y, p = start(equations) + 0.01, parameter_values(equations)
        with mpmath.workdps(DIGITS):
            exact = compiled(lowered(program, "rhs"), digits(mpmath.mp))
            values = exact(mpmath.mpf(0), [*map(mpmath.mpf, y)], [*map(mpmath.mpf, p)])
        doubles = compiled(lowered(program, "rhs"))(0.0, y, p)
        assert doubles == pytest.approx([float(x) for x in values], rel=1e-9)


def test_derivatives_read_accelerations_and_multipliers():
    """Against differences of the right-hand side."""
    equations = derived("four_bar_linkage")
    programs = derivative_programs(equations, jacobian=True, linearization=False)
    programs["rhs"] = build_program(equations, ["acceleration"])
    programs["multipliers"] = constraint_programs(equations)["multipliers"]
    functions = {name: lowered(program, name) for name, program in programs.items()}
    jacobian = compiled(functions["jacobian"], known=functions)
    rhs = compiled(functions["rhs"])
    n, y, p = (
        len(equations.system.coordinates),
        start(equations) + 0.01,
        parameter_values(equations),
    )
    whole = jacobian(0.0, y, p)
    for k, step in enumerate(np.eye(2 * n) * 1e-6):
        slope = (rhs(0.0, y + step, p) - rhs(0.0, y - step, p)) / 2e-6
        assert whole[:, k] == pytest.approx(slope, rel=1e-5, abs=1e-5 * np.abs(whole).max())


def test_families_are_for_doubles_alone():
    program = build_program(chain(30), ["acceleration"])
    assert program.parts
    with pytest.raises(UnsupportedError):
        compiled(lowered(program, "rhs"), digits(mpmath.mp))


@pytest.mark.parametrize("make", [lambda: chain(30), lambda: net(5), CASES["large_net"]])
def test_families_have_the_same_values_through_numpy(make, monkeypatch):
    """Bands and supernodes; each number by itself is the other way."""
    equations = make()
    y, p = state(equations, 4), [x.value for x in equations.system.parameters]
    for function in OUTPUTS:
        values = []
        for least in (0, 10**9):
            monkeypatch.setattr(interpreter, "MANY", least)
            values.append(np.ravel(compiled(function_of(equations, function))(0.25, y, p)))
        assert np.isfinite(values[0]).all()
        size = np.abs(values[1]).max(initial=0.0)
        assert values[0] == pytest.approx(values[1], rel=1e-12, abs=1e-12 * size)
