"""Emitted C: compiles clean, computes what the equations say, and is harmless."""

from __future__ import annotations

import functools
import math
import re
import subprocess
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest
import sympy as sp

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.emit.c.target import c_string
from lagrange_cli.errors import InputError, InternalError
from lagrange_cli.mechanics.kinks import Cases
from lagrange_cli.program.printing import decimal_literal, double_literal
from tests.emit import emit_systems as systems
from tests.emit.emit_reference import DIGITS, Reference, difference, exact, states
from tests.emit.emitted_c import WARNINGS, Compiled, compiler, in_types, run, write
from tests.parts import changed
from tests.program.test_program import one_coordinate, x

#: Agreement relative to the largest entry, at unit condition number.
TOLERANCE = {"float": 3e-5, "double": 1e-13, "long-double": 5e-17}

HOSTILE = "*/ int main(void){return 7;} /* ??/ \\\n#error x\r\u2028\x00 \"\"\" '''\\"


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize(("make", "real"), in_types(systems.ALL))
def test_every_function_agrees_with_the_equations(make, real, tmp_path):
    equations = make()
    n = len(equations.system.coordinates)
    compiled = Compiled(equations, tmp_path, real)
    reference = Reference(equations)
    cartesian = len(equations.system.cartesian_names)
    sizes = {"mass_matrix": n * n, "forcing": n, "energy": 3, "positions": cartesian}
    for t, y, p in states(equations):
        condition = reference.condition(t, y, p)
        status, dydt = compiled("rhs", t, y, p, 2 * n)
        assert status == 0
        assert difference(dydt, reference.rhs(t, y, p)) < TOLERANCE[real] * max(10, condition)
        for function, size in sizes.items():
            status, out = compiled(function, t, y, p, size)
            assert status == 0
            expected = getattr(reference, function)(t, y, p)
            assert difference(out, expected) < 100 * TOLERANCE[real], function


def coupled_masses(n):
    """n masses on a line, each attracting each other one, in a mass matrix without zeros."""
    masses = [systems.parameter(f"m{k}", 1.0 + 0.1 * k, positive=True) for k in range(n)]
    xs = [systems.coordinate(f"x{k}") for k in range(n)]
    pairs = [(i, j) for i in range(n) for j in range(i)]
    kinetic = sum(m.symbol * c.v**2 for m, c in zip(masses, xs, strict=True)) / 2
    kinetic += sum(xs[i].v * xs[j].v / (4 * n + (i - j) ** 2) for i, j in pairs)
    potential = -sum(
        masses[i].symbol * masses[j].symbol / sp.sqrt(1 + (xs[i].q - xs[j].q) ** 2)
        for i, j in pairs
    )
    return systems.build(f"masses{n}", masses, xs, [], potential, kinetic=kinetic)


LARGE = {
    "chain": lambda: systems.collected_chain(19),
    "masses": lambda: coupled_masses(9),
    "indefinite": lambda: changed(
        coupled_masses(9), facts=systems.indefinite().derivation.facts, name="pivoted9"
    ),
}


@functools.cache
def large(name):
    """Equations of a large system, and their reference."""
    equations = LARGE[name]()
    return equations, Reference(equations)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize(("name", "real"), in_types(LARGE))
def test_loops_agree_with_the_equations(name, real, tmp_path):
    equations, reference = large(name)
    n = len(equations.system.coordinates)
    compiled = Compiled(equations, tmp_path, real)
    source = (tmp_path / f"{equations.presentation.name}.c").read_text()
    assert len(re.findall(r"\] = [^;]*\[[^;]*\bi\b", source)) > 5  # assignments within loops
    for t, y, p in states(equations, count=2):
        condition = max(10, reference.condition(t, y, p))
        status, dydt = compiled("rhs", t, y, p, 2 * n)
        assert status == 0
        assert difference(dydt, reference.rhs(t, y, p)) < 3 * TOLERANCE[real] * condition
        for function, size in {"mass_matrix": n * n, "forcing": n, "energy": 3}.items():
            status, out = compiled(function, t, y, p, size)
            assert status == 0
            expected = getattr(reference, function)(t, y, p)
            assert difference(out, expected) < 100 * TOLERANCE[real], function


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("name", list(LARGE))
def test_loops_stay_within_their_arrays(name, tmp_path):
    equations, _ = large(name)
    n = len(equations.system.coordinates)
    equations = changed(equations, initial=systems.InitialState((0.3,) * n, (0.1,) * n))
    source = write(equations, tmp_path, main=True)
    sanitize = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    run(compiler(), "-std=c99", "-g", *sanitize, source, "-o", tmp_path / "a.out", "-lm")
    assert len(run(tmp_path / "a.out", "until=0.01", "steps=1").splitlines()) == 502


@pytest.mark.compiler
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
def test_main_tells_a_full_disk(tmp_path):
    source = write(systems.masses_through_hole(), tmp_path, main=True)
    run(compiler(), "-std=c99", source, "-o", tmp_path / "a.out", "-lm")
    with open("/dev/full", "w") as full:
        words = [tmp_path / "a.out", "until=0.1"]
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True)
    assert (done.returncode, done.stderr) == (1, "the table could not be written\n")


@pytest.mark.slow
def test_text_of_a_chain_grows_with_its_length_alone():
    lines = {}
    for n in (12, 24):
        (source,) = (
            text
            for name, text in EMITTERS["c"].emit(systems.collected_chain(n)).items()
            if name.endswith(".c")
        )
        body = source.split("_mass_matrix(")[1].split("\nint ")[0]
        lines[n] = sum("c[" not in line.split("=")[0] for line in body.splitlines())
    assert lines[24] < lines[12] + 40


STRICT = ["-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wundef", "-Wdouble-promotion"]


def commands():
    """Pairs of each system with C99, and with one of the others in turn."""
    makes = [*systems.ALL, lambda: systems.collected_chain(16), *LARGE.values(), unused]
    others = [
        ("double", ["g++", "-std=c++11", "-x", "c++"]),
        ("float", ["gcc", "-std=c99"]),
        ("long-double", ["gcc", "-std=c11"]),
    ]
    yield from ((make, "double", ["gcc", "-std=c99"]) for make in makes)
    yield from ((make, *others[k % len(others)]) for k, make in enumerate(makes))


def unused():
    """A free particle: nothing depends on t, q, or most of the parameters."""
    a, b = systems.parameter("a", 1.0), systems.parameter("b", 2.0)
    q = systems.coordinate("x")
    return systems.build("free", [a, b], [q], [("p", a.symbol, (q.q, 0, 0))], 0)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize(("make", "real", "command"), list(commands()))
def test_no_compiler_warns(make, real, command, tmp_path):
    source = write(make(), tmp_path, real, main=True)
    gcc, *flags = command
    run(compiler(gcc), *flags, *WARNINGS, *STRICT, "-c", source, "-o", tmp_path / "object.o")


@pytest.mark.compiler
def test_without_parameters_and_positions(tmp_path):
    q = systems.coordinate("x")
    equations = systems.build("bare", [], [q], [], q.q**2 / 2, kinetic=q.v**2 / 2)
    compiled = Compiled(equations, tmp_path)
    status, dydt = compiled("rhs", 0.0, [0.25, 3.0], [0.0], 2)
    assert (status, list(dydt)) == (0, [3.0, -0.25])
    assert compiled.macro("POSITIONS") == 0
    assert compiled("positions", 0.0, [0.25, 3.0], [0.0], 1)[0] == 0


y = sp.Symbol("y", real=True)

ROWS = {
    "sin": sp.sin(x),
    "cos": sp.cos(x),
    "tan": sp.tan(x),
    "asin": sp.asin(x / 4),
    "acos": sp.acos(x / 4),
    "atan": sp.atan(x),
    "sinh": sp.sinh(x),
    "cosh": sp.cosh(x),
    "tanh": sp.tanh(x),
    "asinh": sp.asinh(x),
    "acosh": sp.acosh(x + 4),
    "atanh": sp.atanh(x / 4),
    "exp": sp.exp(x),
    "log": sp.log(x + 4),
    "sqrt": sp.sqrt(x + 4),
    "abs": sp.Abs(x),
    "sign": sp.sign(x),
    "atan2": sp.atan2(x, x - 1),
    "min": sp.Min(x, x**2, sp.Rational(1, 3)),
    "max": sp.Max(x, x**3, -sp.Rational(1, 3)),
    "pow": (x + 4) ** sp.Rational(1, 3),
    "pow of two": (x + 4) ** x,
    "two to the": 2**x,
    "cot": sp.cot(x),
    "sec": sp.sec(x),
    "csc": sp.csc(x),
    "heaviside": sp.Heaviside(x),
    "at least": Cases(x**2, x, sp.Integer(0), Cases(-x, x + 1, sp.Integer(1), sp.Integer(3))),
    "more than": Cases(x**2 - 2, x, sp.Integer(1), sp.sin(x) + 2),
    "inverse power": (x + 4) ** -3,
    "half power": (x + 4) ** sp.Rational(5, 2),
    "large power": (x / 2) ** 100,
    "fraction": x / 3 - sp.Rational(2, 7),
    "pi": sp.pi * x,
}


#: Values of rows where their argument, or the difference in their condition, is zero.
CORNERS = [("sign", 0.0), ("abs", 0.0), ("heaviside", 0.5), ("at least", 0.0), ("more than", 2.0)]


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    equations = one_coordinate(*ROWS.values())
    return Compiled(equations, tmp_path_factory.mktemp("rows")), Reference(equations)


@pytest.mark.compiler
@pytest.mark.parametrize("row", list(ROWS))
def test_every_function_of_the_language(rows, row):
    compiled, reference = rows
    k = list(ROWS).index(row)
    for at in (-2.0, -0.5, 0.3, 1.0, 2.5):
        status, out = compiled("positions", 0.0, [at, 0.0], [1.0, 1.0, 1.0], len(ROWS))
        assert status == 0
        expected = reference.positions(0.0, [at, 0.0], [1.0, 1.0, 1.0])[k]
        assert abs(exact(out[k]) - expected) < 1e-14 * (1 + abs(expected))


@pytest.mark.compiler
@pytest.mark.parametrize(("row", "expected"), CORNERS)
def test_functions_at_their_corner(rows, row, expected):
    compiled, _ = rows
    # Other rows have a pole at zero: the status says so.
    status, out = compiled("positions", 0.0, [0.0, 0.0], [1.0, 1.0, 1.0], len(ROWS))
    assert status == 2
    assert out[list(ROWS).index(row)] == expected


@pytest.mark.compiler
@pytest.mark.parametrize("row", ["sign", "min", "max"])
def test_helpers_pass_nan_on(rows, row):
    compiled, _ = rows
    _, out = compiled("positions", 0.0, [math.nan, 0.0], [1.0, 1.0, 1.0], len(ROWS))
    assert math.isnan(out[list(ROWS).index(row)])


@pytest.mark.parametrize("format_name", ["c", "python"])
@pytest.mark.parametrize("expression", [sp.gamma(x), sp.Function("f")(x), sp.I * x, sp.oo])
def test_what_cannot_be_printed_is_refused(expression, format_name):
    with pytest.raises(InternalError, match="no counterpart"):
        EMITTERS[format_name].emit(one_coordinate(expression))


@pytest.mark.compiler
def test_singular_matrix_and_results_that_are_not_finite(tmp_path):
    compiled = Compiled(systems.simplified(systems.masses_through_hole()), tmp_path)
    p = compiled.defaults
    assert compiled("rhs", 0.0, [0.0, 0.0, 0.0, 3.0], p, 4)[0] == 1
    assert compiled("rhs", 0.0, [1.0, 0.0, 1e200, 1e200], p, 4)[0] == 2
    assert compiled("energy", 0.0, [1.0, 0.0, 1e200, 1e200], p, 3)[0] == 2
    assert compiled("rhs", 0.0, [1.0, 0.0, math.nan, 0.0], p, 4)[0] == 2
    assert compiled("rhs", 0.0, [1e-100, 0.0, 0.0, 3.0], p, 4)[0] == 0


@pytest.mark.slow
@pytest.mark.compiler
def test_a_dependent_pair_of_rods_is_singular_in_every_solver(tmp_path):
    for n in (2, 6):
        equations = systems.pendulum_chain(n)
        compiled = Compiled(equations, tmp_path)
        p = np.array(compiled.defaults)
        p[1:n] = 0.0  # only the first bob has a mass
        state = np.r_[np.linspace(0.1, 0.9, n), np.zeros(n)]
        assert compiled("rhs", 0.0, state, p, 2 * n)[0] == 1
    compiled = Compiled(systems.indefinite(), tmp_path)
    assert compiled("rhs", 0.0, np.zeros(6), [0.0, 1.0], 6)[0] == 1


@pytest.mark.compiler
def test_the_indefinite_system_is_solved_with_pivoting(tmp_path):
    equations = systems.indefinite()
    compiled, reference = Compiled(equations, tmp_path), Reference(equations)
    for t, state, p in states(equations, count=5):
        assert reference.mass_matrix(t, state, p)[0] == 0  # no elimination starts here
        status, dydt = compiled("rhs", t, state, p, 6)
        assert status == 0
        assert difference(dydt, reference.rhs(t, state, p)) < 1e-12


@pytest.mark.compiler
def test_defaults_and_parameters_that_must_be_given(tmp_path):
    base = systems.bead_on_parabola()
    m, a, g = base.system.parameters
    equations = changed(base, parameters=(m, replace(a, value=None), g), initial=None)
    compiled = Compiled(equations, tmp_path)
    assert compiled.defaults[0] == 1.0
    assert math.isnan(compiled.defaults[1])
    assert compiled.defaults[2] == 9.81
    assert compiled("rhs", 0.0, [1.0, 0.0], compiled.defaults, 2)[0] != 0
    assert re.search(r"a; /\* a; must be given \*/", compiled.header)


HOSTILE_NAMES = [
    "double", "I", "y0", "j1", "gamma", "signgam", "errno", "NULL", "NAN", "linux", "unix", "sin",
    "p", "y", "u", "t_", "work", "dydt", "out", "i", "w0", "w1", "q_x", "v_x", "class", "lambda",
    "this", "template", "isnan", "isfinite", "M_PI", "min", "max", "near", "far", "small", "EOF",
    "main", "rhs", "np", "nan", "count", "index", "None", "def", "double_", "_x", "__x", "x",
    "stdin", "const", "E", "N", "S", "Q", "P0", "abs", "x[1]", "x_1", "Parameters", "DEFAULTS",
]  # fmt: skip


def hostile():
    """Every hostile name as a parameter, many as coordinates, hostile text elsewhere."""
    parameters = [
        systems.parameter(n, 1.0 + 0.01 * k, unit=HOSTILE, description=HOSTILE)
        for k, n in enumerate(HOSTILE_NAMES)
    ]
    names = ["z", "dot_y", "int", "w2", "I2", "_q", "x[2]"]
    coordinates = [systems.coordinate(n, unit=HOSTILE, description=HOSTILE) for n in names]
    stiffness = sp.Add(*(p.symbol for p in parameters))
    potential = stiffness * sp.Add(*(c.q**4 for c in coordinates))
    kinetic = sp.Add(*((1 + c.q**2) * c.v**2 for c in coordinates)) / 2
    return systems.build(
        "while",
        parameters,
        coordinates,
        [],
        potential,
        kinetic=kinetic,
        title=HOSTILE,
        description=HOSTILE,
        initial=systems.InitialState((0.1,) * 7, (0.0,) * 7),
    )


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("language", ["c", "c++"])
def test_hostile_names_and_texts(language, tmp_path):
    equations = hostile()
    source = write(equations, tmp_path, main=True)
    text = source.read_text() + source.with_suffix(".h").read_text()
    assert text.isascii() or "\u2028" not in text
    assert "??/" not in text
    assert "\\\n" not in text
    flags = ["-x", "c", "-std=c99"] if language == "c" else ["-x", "c++", "-std=c++11"]
    gcc = compiler("gcc" if language == "c" else "g++")
    run(gcc, *flags, *WARNINGS, source, "-o", tmp_path / "a.out", "-lm")
    lines = run(tmp_path / "a.out", "until=0.1", "double=2").splitlines()
    assert len(lines) == 502
    assert all(len(line.split(",")) == 15 for line in lines)


@pytest.mark.slow
@pytest.mark.compiler
def test_hostile_names_mean_the_right_parameter(tmp_path):
    equations = hostile()
    compiled = Compiled(equations, tmp_path)
    assert list(compiled.defaults) == [p.value for p in equations.system.parameters]


@pytest.mark.compiler
def test_a_name_that_is_no_identifier(tmp_path):
    equations = changed(systems.bead_on_parabola(), name='2 x";\n#error')
    (header, source) = EMITTERS["c"].emit(equations)
    assert re.fullmatch(r"\w+\.h", header)
    assert re.fullmatch(r"\w+\.c", source)
    run(compiler(), "-std=c99", *WARNINGS, "-c", write(equations, tmp_path), "-o", tmp_path / "o")


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("real", list(TOLERANCE))
def test_main_integrates(real, tmp_path):
    equations = systems.masses_through_hole()
    source = write(equations, tmp_path, real, main=True)
    run(compiler(), "-std=c99", *WARNINGS, "-O1", source, "-o", tmp_path / "a.out", "-lm")
    lines = run(tmp_path / "a.out", "until=2", "dot(theta)=2.5").splitlines()
    assert lines[0] == "t,r,theta,dot(r),dot(theta)"
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    assert table.shape == (501, 5)
    assert table[0].tolist() == [0.0, 1.0, 0.0, 0.0, 2.5]
    assert table[-1, 0] == pytest.approx(2.0)
    # The angular momentum r² θ̇ is conserved.
    momentum = table[:, 1] ** 2 * table[:, 4]
    assert np.ptp(momentum) < (1e-3 if real == "float" else 1e-9)


@pytest.mark.compiler
def test_main_asks_for_what_is_missing(tmp_path):
    base = systems.bead_on_parabola()
    m, a, g = base.system.parameters
    equations = changed(base, parameters=(m, replace(a, value=None), g), initial=None)
    source = write(equations, tmp_path, main=True)
    program = tmp_path / "a.out"
    run(compiler(), "-std=c99", *WARNINGS, source, "-o", program, "-lm")

    def status(*arguments):
        done = subprocess.run([program, *arguments], capture_output=True, text=True, timeout=60)
        return done.returncode, done.stderr.strip()

    assert status() == (2, "initial value needed: x=VALUE")
    assert status("x=1", "dot(x)=0") == (2, "parameter needed: a=VALUE")
    assert status("x=1", "dot(x)=0", "a=0.5")[0] == 0
    assert status("x=1", "dot(x)=0", "a=0.5", "m=0")[0] == 1
    assert status("z=1") == (2, "z: not NAME=NUMBER with a known name")
    assert status("steps=0")[0] == 2
    for wrong in ("x=1.5e", "x=np.float64(1)", "x=", "until=2s", "steps=3.5", "a=one"):
        assert status(wrong) == (2, f"{wrong.split('=')[0]}: not NAME=NUMBER with a known name")


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("make", [systems.indefinite, lambda: systems.collected_chain(8)])
def test_no_undefined_behaviour(make, tmp_path):
    equations = make()
    n = len(equations.system.coordinates)
    equations = changed(equations, initial=systems.InitialState((0.3,) * n, (0.1,) * n))
    source = write(equations, tmp_path, main=True)
    sanitize = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    run(compiler(), "-std=c99", "-g", *sanitize, source, "-o", tmp_path / "a.out", "-lm")
    assert len(run(tmp_path / "a.out", "until=0.5", "steps=2").splitlines()) == 502


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("make", [systems.driven_cart, lambda: systems.collected_chain(8)])
def test_no_allocation_no_state_only_math(make, tmp_path):
    source = write(make(), tmp_path)
    text = source.read_text()
    assert re.findall(r"#include (.*)", text) == [f'"{source.stem}.h"', "<math.h>"]
    assert "M_PI" not in text
    assert not re.search(r"\b(malloc|alloca|static \w+ \w+ ?[\[=;])", text)
    # Locals are scalars: no array is declared anywhere.
    assert not re.search(r"^\s+(const )?double \w+\[", text, re.M)
    freestanding = ("-std=c99", "-O1", "-ffreestanding")
    run(compiler(), *freestanding, "-c", source, "-o", tmp_path / "object.o")
    symbols = [
        line.split() for line in run(compiler("nm"), "-P", tmp_path / "object.o").splitlines()
    ]
    assert {kind for _, kind, *_ in symbols} <= {"T", "t", "U", "r"}
    math_functions = {"sin", "cos", "sincos", "exp", "sqrt", "fabs", "_GLOBAL_OFFSET_TABLE_"}
    assert {name for name, kind, *_ in symbols if kind == "U"} <= math_functions


def test_comments_of_the_header_are_wrapped():
    long = "one two three " * 40
    (parameter, *others) = systems.bead_on_parabola().system.parameters
    equations = changed(
        systems.bead_on_parabola(),
        description=long,
        parameters=(replace(parameter, description=long), *others),
    )
    header = EMITTERS["c"].emit(equations)["bead_on_parabola.h"]
    comment = header[: header.index("int bead_on_parabola_rhs")]
    assert max(map(len, comment.splitlines())) <= 100
    assert comment.count("two") == 80


@pytest.mark.compiler
def test_the_header_documents_itself(tmp_path):
    compiled = Compiled(systems.bead_on_parabola(), tmp_path)
    for text in ("Bead sliding on a parabola", "ab" * 32, "lagrange 0.1.0", "yours", "[m]"):
        assert text in compiled.header
    assert compiled.macro("DOF") == 1
    assert compiled.macro("WORK") >= 1
    assert 'extern "C"' in compiled.header


@pytest.mark.parametrize(
    "value",
    [
        Fraction(1, 3), Fraction(981, 100), Fraction(-22, 7), Fraction(10) ** 30,
        Fraction(1, 10**30), Fraction(123456789, 1000), Fraction(1, 10**5),
        Fraction(10**40 - 1, 10**40), Fraction(7),
    ],
)  # fmt: skip
def test_literals_read_back_to_the_nearest_number(value):
    assert float(double_literal(value)) == float(value)
    assert float(decimal_literal(value)) == float(value)
    with mpmath.workdps(DIGITS):
        error = mpmath.mpf(decimal_literal(value)) * value.denominator / value.numerator - 1
        assert abs(error) < 1e-35


@pytest.mark.parametrize("real", list(TOLERANCE))
def test_numbers_beyond_the_type_are_refused(real):
    equations = one_coordinate(sp.Integer(10) ** 5000 * x)
    with pytest.raises(InputError, match="outside the range"):
        EMITTERS["c"].emit(equations, {"real": real})
    tiny = one_coordinate(sp.Rational(1, 10**5000) * x)
    with pytest.raises(InputError, match="outside the range"):
        EMITTERS["c"].emit(tiny, {"real": real})


def test_a_string_literal_holds_any_text():
    assert c_string('a"b\\c\n?%@é') == '"a\\042b\\134c\\012\\077\\045\\100\\303\\251"'
