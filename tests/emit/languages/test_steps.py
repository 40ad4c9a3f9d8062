"""Fixed steps in every language: of Runge and Kutta, and by the implicit midpoint rule."""

from __future__ import annotations

import re
import subprocess
import sys

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from tests.emit.languages.cpp import FLAGS
from tests.emit.languages.drivers import require
from tests.emit.languages.fortran import COMPILE
from tests.emit.languages.rust import FLAGS as RUST_FLAGS
from tests.emit.languages.test_switches import MAGNET, NEITHER

pytestmark = [pytest.mark.slow, pytest.mark.compiler]

OSCILLATOR = """
name: oscillator
parameters: {m: 1, k: 3, c: 0.2}
coordinates: [x]
kinetic: {block: m*dot(x)^2/2}
potentials: {spring: k*x^2/2}
inputs: {u: sin(t)}
states: {s: (x - s)/0.5}
forces: {f: {on: x, force: u - c*dot(x) - s}}
initial: {x: 1, dot(x): 0, s: 0}
simulate: {until: 5}
"""

#: Three lines of numbers: steps of 0.05 by both methods with u = 0.7, and one that settles not.
PROGRAMS = {
    "python": (
        "run.py",
        """
import numpy as np
import oscillator as m
y, u = [1, 0.2, 0.3], lambda t, y, p: [0.7]
print(*m.step(0.1, y, 0.05, u=u))
print(*m.midpoint(0.1, y, 0.05, u=u))
print(*m.midpoint(0.1, y, 50.0, u=u))
""",
        [],
        [sys.executable, "run.py"],
    ),
    "javascript": (
        "run.mjs",
        """
import { step, midpoint, DEFAULTS as p } from './oscillator.mjs';
const y = [1, 0.2, 0.3], u = [0.7];
console.log(step(0.1, y, 0.05, p, u).join(' '));
console.log(midpoint(0.1, y, 0.05, p, u).join(' '));
console.log(midpoint(0.1, y, 50, p, u).join(' '));
""",
        [],
        ["node", "run.mjs"],
    ),
    "octave": (
        "run.m",
        """
f = oscillator(); y = [1; 0.2; 0.3]; p = f.defaults;
fprintf('%.17g %.17g %.17g\\n', f.step(0.1, y, 0.05, p, 0.7));
fprintf('%.17g %.17g %.17g\\n', f.midpoint(0.1, y, 0.05, p, 0.7), f.midpoint(0.1, y, 50, p, 0.7));
""",
        [],
        ["octave-cli", "run.m"],
    ),
    "fortran": (
        "run.f90",
        """
program run
  use oscillator
  implicit none
  integer, parameter :: wp = kind(initial)
  type(parameters) :: p
  real(wp) :: y(3)
  integer :: status
  y = [1.0_wp, 0.2_wp, 0.3_wp]
  call step(0.1_wp, y, [0.7_wp], 0.05_wp, p, status)
  print *, y
  y = [1.0_wp, 0.2_wp, 0.3_wp]
  call midpoint(0.1_wp, y, [0.7_wp], 0.05_wp, p, status)
  print *, y
  call midpoint(0.1_wp, y, [0.7_wp], 50.0_wp, p, status)
  if (status == 3) print *, 'nan nan nan'
end program run
""",
        [*COMPILE, "oscillator.f90", "run.f90", "-o", "run"],
        ["./run"],
    ),
    "cpp": (
        "run.cpp",
        """
#include "oscillator.hpp"
#include <cstdio>
template <class T> void print(const T& y) { std::printf("%.17g %.17g %.17g\\n", y[0], y[1], y[2]); }
int main()
{
    const std::array<double, 3> y{1, 0.2, 0.3};
    const std::array<double, 1> u{0.7};
    print(oscillator::step(0.1, y, u, 0.05));
    print(oscillator::midpoint(0.1, y, u, 0.05));
    print(oscillator::midpoint(0.1, y, u, 50.0));
}
""",
        ["g++", *FLAGS, "run.cpp", "-o", "run"],
        ["./run"],
    ),
    "rust": (
        "run.rs",
        """
mod oscillator;
use oscillator::{midpoint, step, Failure, DEFAULTS};
fn main() {
    let start = [1.0, 0.2, 0.3];
    let mut y = start;
    step(0.1, &mut y, &[0.7], 0.05, &DEFAULTS).unwrap();
    println!("{:?} {:?} {:?}", y[0], y[1], y[2]);
    y = start;
    midpoint(0.1, &mut y, &[0.7], 0.05, &DEFAULTS).unwrap();
    println!("{:?} {:?} {:?}", y[0], y[1], y[2]);
    y = start;
    assert_eq!(midpoint(0.1, &mut y, &[0.7], 50.0, &DEFAULTS), Err(Failure::NotFinite));
    assert_eq!(y, start);
    println!("nan nan nan");
}
""",
        ["rustc", *RUST_FLAGS, "run.rs", "-o", "run"],
        ["./run"],
    ),
}


def plain(text):
    """The text of comments on one line."""
    return re.sub(r"\s*\n\s*(///|!>|\*|%|#)?\s*", " ", text)


@pytest.fixture(scope="module")
def said():
    """The sentence on the error of each function, as C has it."""
    header = loads(OSCILLATOR).derive().emit("c", step=True, midpoint=True)["oscillator.h"]
    return re.findall(r"With h = .*? was \S+, measured .*? order h\.", plain(header))


@pytest.mark.parametrize("language", PROGRAMS)
def test_a_step_is_that_of_its_method(language, said, tmp_path):
    require(*(word for word in (PROGRAMS[language][2][:1] or PROGRAMS[language][3][:1])))
    file, text, compilation, command = PROGRAMS[language]
    emitted = loads(OSCILLATOR).derive().emit(language, step=True, midpoint=True)
    ((name, module),) = emitted.items()
    assert len(said) == 2
    assert all(sentence in plain(module) for sentence in said)
    (tmp_path / name).write_text(module, encoding="utf-8")
    (tmp_path / file).write_text(text.lstrip(), encoding="utf-8")
    for words in filter(None, (compilation, command)):
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    rows = [[float(x) for x in line.split()] for line in done.stdout.splitlines()]
    found = np.array(rows)
    h, y = 0.05, np.array([1, 0.2, 0.3])
    a, b = np.array([[0, 1, 0], [-3, -0.2, -1], [2, 0, -2]]), np.array([0, 0.7, 0])
    k1 = a @ y + b
    k2 = a @ (y + h / 2 * k1) + b
    k3 = a @ (y + h / 2 * k2) + b
    k4 = a @ (y + h * k3) + b
    assert found[0] == pytest.approx(y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), abs=1e-14)
    half = h / 2 * a
    exact = np.linalg.solve(np.eye(3) - half, y + half @ y + h * b)
    assert found[1] == pytest.approx(exact, abs=1e-14)
    assert np.isnan(found[2]).all()


@pytest.mark.parametrize("language", PROGRAMS)
def test_steps_are_refused_where_events_would_be_missed(language):
    with pytest.raises(InputError, match="contacts open and close within a step"):
        loads(MAGNET).derive().emit(language, step=True)
    with pytest.raises(InputError, match="changes between its two values within a step"):
        loads(NEITHER.replace("START", "0")).derive().emit(language, midpoint=True)


def test_numba_is_not_handed_inputs_that_are_held():
    with pytest.raises(InputError, match="cannot be handed inputs that are held"):
        loads(OSCILLATOR).derive().emit("python", step=True, style="numba")
