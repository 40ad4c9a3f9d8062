"""C++ takes any number type: derivatives by dual numbers are those of the emitted Jacobian."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lagrange_cli.api.emitters import EMITTERS
from tests.emit.languages.cpp import FLAGS, Cpp
from tests.emit.languages.drivers import executed
from tests.systems.shipped import derived, parameter_values, start

#: Numbers x + d e with e^2 = 0, without conversions and without functions in std.
_DUAL = """\
namespace dual {

struct Number {
    double x = 0, d = 0;
    Number() = default;
    explicit Number(double value, double slope = 0) : x(value), d(slope) {}
    Number& operator+=(const Number& b) { x += b.x; d += b.d; return *this; }
    Number& operator-=(const Number& b) { x -= b.x; d -= b.d; return *this; }
    Number& operator*=(const Number& b) { d = d*b.x + x*b.d; x *= b.x; return *this; }
    Number& operator/=(const Number& b) { d = (d - x/b.x*b.d)/b.x; x /= b.x; return *this; }
};

inline Number operator+(Number a, const Number& b) { return a += b; }
inline Number operator-(Number a, const Number& b) { return a -= b; }
inline Number operator*(Number a, const Number& b) { return a *= b; }
inline Number operator/(Number a, const Number& b) { return a /= b; }
inline Number operator-(const Number& a) { return Number(-a.x, -a.d); }
inline bool operator<(const Number& a, const Number& b) { return a.x < b.x; }
inline bool operator>(const Number& a, const Number& b) { return a.x > b.x; }
inline bool operator<=(const Number& a, const Number& b) { return a.x <= b.x; }
inline bool operator!=(const Number& a, const Number& b) { return a.x != b.x; }
inline Number sin(const Number& a) { return Number(std::sin(a.x), std::cos(a.x)*a.d); }
inline Number cos(const Number& a) { return Number(std::cos(a.x), -std::sin(a.x)*a.d); }
inline Number abs(const Number& a) { return a.x < 0 ? -a : a; }
inline Number sqrt(const Number& a) { return Number(std::sqrt(a.x), a.d/(2*std::sqrt(a.x))); }
inline Number pow(const Number& a, const Number& b)
{
    return Number(std::pow(a.x, b.x), b.x*std::pow(a.x, b.x - 1)*a.d);
}

} // namespace dual
"""

_PRINTED = """
    for (std::size_t k = 0; k < 2*@NAME@::dof; ++k) {
        @NAME@::State<dual::Number> y;
        for (std::size_t i = 0; i < y.size(); ++i) {
            y[i] = dual::Number(@NAME@::initial_state[i] + 0.01*double(i), i == k);
        }
        for (const auto& x : @NAME@::rhs(dual::Number(0.5), y@INPUTS@)) {
            std::printf("%.17g ", x.d);
        }
    }
    std::printf("\\n");
"""

#: Closed and free, with a matrix that is eliminated by a loop, and with inputs.
SCENES = ("double_pendulum", "heavy_top", "kepler", "rolling_disk", "driven_spring")


def imported(equations, folder, **options):
    """The emitted Python module of the same scene."""
    ((file, text),) = EMITTERS["python"].emit(equations, options).items()
    (folder / file).write_text(text, encoding="utf-8")
    return SimpleNamespace(**runpy.run_path(str(folder / file)))


def emitted(name, folder, **options):
    for file, text in EMITTERS["cpp"].emit(derived(name), options).items():
        (folder / file).write_text(text, encoding="utf-8")


@pytest.mark.slow
def test_dual_numbers_give_the_emitted_jacobian(tmp_path):
    Cpp().require()
    heads, pieces = [], []
    for name in SCENES:
        emitted(name, tmp_path)
        heads.append(f'#include "{name}.hpp"\n')
        inputs = ", std::array<dual::Number, 1>{dual::Number(0.25)}"
        inputs = inputs if derived(name).system.inputs else ""
        pieces.append(_PRINTED.replace("@NAME@", name).replace("@INPUTS@", inputs))
    text = "".join(["#include <cstdio>\n", *heads, _DUAL, "int main()\n{", *pieces, "}\n"])
    (tmp_path / "main.cpp").write_text(text)
    executed(["g++", *FLAGS, "main.cpp", "-o", "main"], "", tmp_path)
    lines = executed([tmp_path / "main"], "", tmp_path).splitlines()
    for name, line in zip(SCENES, lines, strict=True):
        e = derived(name)
        n = len(e.system.coordinates)
        module = imported(e, tmp_path, jacobian=True)
        y = start(e) + 0.01 * np.arange(2 * n)
        inputs = [lambda t, y, p: [0.25]] if e.system.inputs else []
        expected = module.jacobian(0.5, y, parameter_values(e), *inputs)
        found = np.array([float(x) for x in line.split()]).reshape(2 * n, 2 * n).T
        np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.slow
@pytest.mark.parametrize(("real", "tolerance"), [("float", 1e-5), ("long double", 1e-15)])
def test_other_precisions_are_computed_as_such(real, tolerance, tmp_path):
    """No literal is a double: warnings of narrowing and widening are errors."""
    Cpp().require()
    emitted("rolling_disk", tmp_path)
    (tmp_path / "main.cpp").write_text(
        '#include <cstdio>\n#include "rolling_disk.hpp"\nint main()\n{\n'
        f"    std::array<{real}, 8> y{{}};\n"
        "    for (std::size_t i = 0; i < 8; ++i) {\n"
        f"        y[i] = static_cast<{real}>(rolling_disk::initial_state[i]);\n    }}\n"
        f"    for (const auto x : rolling_disk::rhs<{real}>(0, y)) {{\n"
        '        std::printf("%.21Lg ", static_cast<long double>(x));\n    }\n}\n'
    )
    words = ["g++", *FLAGS, "-Wdouble-promotion", "-Wfloat-conversion", "main.cpp", "-o", "main"]
    executed(words, "", tmp_path)
    found = [float(x) for x in executed([tmp_path / "main"], "", tmp_path).split()]
    e = derived("rolling_disk")
    expected = imported(e, tmp_path).rhs(0.0, start(e))
    np.testing.assert_allclose(found, expected, atol=tolerance * np.abs(expected).max())


@pytest.mark.slow
def test_the_page_shows_a_program(tmp_path):
    Cpp().require()
    page = (Path(__file__).parents[3] / "docs" / "languages.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```cpp\n(.*?)```", page, re.DOTALL)
    emitted("bead_on_parabola", tmp_path)
    (tmp_path / "main.cpp").write_text(block)
    executed(["g++", *FLAGS, "main.cpp", "-o", "main"], "", tmp_path)
    printed = executed([tmp_path / "main"], "", tmp_path)
    e = derived("bead_on_parabola")
    module = imported(e, tmp_path)
    expected = module.rhs(0.0, np.array([1.0, 0.0]), module.DEFAULTS._replace(a=0.25))[1]
    assert printed == f"{expected:.6f}\n"
