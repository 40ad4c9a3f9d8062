"""Time of one right-hand side of the n-link pendulum, side by side with peers.

n point masses on massless rods, absolute angles, masses and lengths read at
run time. Every method finds the accelerations (CasADi's code: mass matrix and
forcing alone) at 64 states in turn. Results are compared with the closed form
before anything is timed; the methods take turns; median and quartiles of one
call are reported. What is C or C++ is compiled by the machine's compiler with
the same options and loops in C; what is Python is called in a loop.

    python benchmarks/right_hand_side.py --json right_hand_side.json

Peers besides NumPy (casadi, pin) take part where they are installed. With
--pinocchio-cpp, Pinocchio is also compiled from its headers for this machine
and called from C++ (about a minute; Eigen's headers are those within casadi).
"""

from __future__ import annotations

import argparse
import ctypes
import importlib.util
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import sympy
from derivation import (
    GRAVITY,
    Array,
    State,
    casadi_derivation,
    closed_form,
    pendulum_scene,
    random_state,
    without_certificate,
)
from reporting import verdict

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text

OPTIONS = [
    *("-O2", "-march=native", "-fno-math-errno", "-ffp-contract=off"),
    *("-ftree-vectorize", "-fvect-cost-model=dynamic"),
]
STATES = 64

#: Seconds of one timing, and the least number of calls.
LENGTH = 0.02
FEWEST = 20


@dataclass(frozen=True)
class Method:
    """``run(count)`` calls ``count`` times and returns the last result: accelerations,
    or mass matrix and forcing. ``seconds`` says what making it took."""

    name: str
    run: Callable[[int], Array]
    of_matrix: bool = False
    seconds: dict[str, float] = field(default_factory=dict)


def states_of(n: int) -> list[State]:
    """States of one pendulum; the first is that of ``random_state``."""
    base, random = random_state(n), np.random.default_rng([n, 1])
    others = (
        State(random.uniform(-3, 3, n), random.uniform(-2, 2, n), base.m, base.l)
        for _ in range(STATES - 1)
    )
    return [base, *others]


# -- compiled code ------------------------------------------------------------

#: A loop in C around a call; the count is chosen so that the first state comes last.
LOOP = """
int loop(long count, const double *y, const double *given, double *work, double *out)
{
    long k;
    int status = 0;
    for (k = count - 1; k >= 0; --k) {
        const double *state = y + (k %% %(states)d)*%(width)d;
        %(call)s
    }
    return status;
}
"""

HAND_WRITTEN = """
#include <math.h>
static void pendulum(const double *y, const double *p, double *a)
{
    const double g = p[0], m1 = p[1], l1 = p[2], m2 = p[3], l2 = p[4];
    const double s = sin(y[0] - y[1]), c = cos(y[0] - y[1]), m = m1 + m2;
    const double f1 = -m2*l2*y[3]*y[3]*s - m*g*sin(y[0]);
    const double f2 = l1*y[2]*y[2]*s - g*sin(y[1]);
    const double d = m1 + m2*s*s;
    a[0] = (f1 - m2*c*f2)/(l1*d);
    a[1] = (m*f2 - c*f1)/(l2*d);
}
"""

PINOCCHIO = """
#include <pinocchio/multibody.hpp>
#include <pinocchio/algorithm/aba.hpp>
using namespace pinocchio;
static void build(Model &model, int n, const double *p)
{
    JointIndex parent = 0;
    double arm = 0;
    model.gravity.linear() << 0, 0, -p[0];
    for (int i = 0; i < n; ++i) {
        const Eigen::Vector3d bob(0, 0, -p[2 + 2*i]);
        const SE3 at(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, -arm));
        parent = model.addJoint(parent, JointModelRY(), at, "joint" + std::to_string(i));
        model.appendBodyToJoint(parent, Inertia(p[1 + 2*i], bob, Eigen::Matrix3d::Zero()));
        arm = p[2 + 2*i];
    }
}
extern "C" void accelerations(int n, const double *y, const double *p, double *out)
{
    typedef Eigen::Matrix<double, Eigen::Dynamic, 1> Vector;
    static Model model;
    static Data *data = nullptr;
    static Vector q(n), v(n), none = Vector::Zero(n);
    if (data == nullptr) {
        build(model, n, p);
        data = new Data(model);
    }
    q = Eigen::Map<const Vector>(y, n);
    v = Eigen::Map<const Vector>(y + n, n);
    Eigen::Map<Vector>(out, n) = aba(model, *data, q, v, none);
}
"""


def compiled(
    name: str,
    folder: Path,
    texts: Sequence[str | Path],
    call: str,
    states: Array,
    given: Array,
    results: int,
    *,
    work: int = 1,
    more: Sequence[str] = (),
    of_matrix: bool = False,
    after: Callable[[Array], Array] = lambda out: out,
) -> Method:
    """A method in C: ``texts`` are sources, or objects, and before the loop stands the last."""
    folder.mkdir()
    loop = LOOP % {"states": STATES, "width": states.shape[1], "call": call}
    sources = []
    for number, text in enumerate([*texts[:-1], f"{texts[-1]}{loop}"]):
        sources.append(text if isinstance(text, Path) else folder / f"part{number}.c")
        if not isinstance(text, Path):
            sources[-1].write_text(text)
    library = folder / "library.so"
    start = time.perf_counter()
    line = ["cc", "-std=c99", *OPTIONS, "-shared", "-fPIC", "-I", folder.parent, *sources]
    subprocess.run([*map(str, line), "-o", str(library), *more, "-lm"], check=True)
    seconds = time.perf_counter() - start
    function = ctypes.CDLL(str(library)).loop
    out = np.zeros(results)
    arrays = (np.ascontiguousarray(states), given, np.zeros(max(work, 1)), out)

    def run(count: int) -> Array:
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in arrays]
        if function(ctypes.c_long(count), *pointers) != 0:
            raise ArithmeticError(f"{name}: failure at some state")
        return after(out)

    return Method(name, run, of_matrix, {"compile": seconds})


def lagrange_c(n: int, states: Array, given: Array, folder: Path) -> Method:
    """The emitted C, compiled as it is."""
    equations = derive(read_text(pendulum_scene(n)))
    start = time.perf_counter()
    files = EMITTERS["c"].emit(equations)
    seconds = time.perf_counter() - start
    header, source = (next(t for f, t in files.items() if f.endswith(e)) for e in (".h", ".c"))
    name = f"pendulum_{n}"
    (folder / f"{name}.h").write_text(header)
    (line,) = [x for x in header.splitlines() if x.startswith(f"#define {name}_WORK ")]
    call = f"status |= {name}_rhs(0.0, state, 0, (const {name}_params *)given, work, out);"
    texts, work = [source, f'#include "{name}.h"\n'], int(line.split()[-1])
    method = compiled(
        *("lagrange, C", folder / "lagrange", texts, call, states, given, 2 * n),
        work=work,
        after=lambda out: out[n:],
    )
    method.seconds["emit"] = seconds
    return method


def hand_written(states: Array, given: Array, folder: Path) -> Method:
    call = "(void)work; pendulum(state, given, out);"
    return compiled("written by hand, C", folder / "hand", [HAND_WRITTEN], call, states, given, 2)


def casadi_c(n: int, states: Array, given: Array, folder: Path) -> Method:
    """C that CasADi generates for M and f."""
    generated = folder / "casadi_pendulum.c"
    here = os.getcwd()
    function = casadi_derivation(n)
    os.chdir(folder)
    try:
        function.generate(generated.name)
    finally:
        os.chdir(here)
    prototype = "int pendulum(const double **, double **, long long *, double *, int);\n"
    call = (
        f"const double *arg[16] = {{state, state + {n}, given, given + {n}}};\n"
        f"double *res[16] = {{out, out + {n * n}}};\n"
        "status |= pendulum(arg, res, 0, work, 0);"
    )
    arguments = np.r_[given[1::2], given[2::2]]
    texts = [generated.read_text(), prototype]
    return compiled(
        *("CasADi C, M and f alone", folder / "casadi", texts, call, states, arguments, n * n + n),
        work=function.sz_w(),
        of_matrix=True,
    )


def _relative(states: Array, n: int) -> Array:
    """Angles and velocities of joints: each body's less those of the body before."""
    halves = [np.diff(part, axis=1, prepend=0.0) for part in (states[:, :n], states[:, n:])]
    return np.concatenate(halves, axis=1)


def pinocchio_object(folder: Path) -> Path:
    """Pinocchio's ABA compiled from its headers for this machine."""
    import casadi
    import pinocchio

    prefix = Path(pinocchio.__file__).parents[4]
    eigen = Path(casadi.__file__).parent / "include" / "eigen3"
    source, compiled_object = folder / "pinocchio.cpp", folder / "pinocchio.o"
    source.write_text(PINOCCHIO)
    flags = ["-std=c++17", "-w", "-DNDEBUG", "-DBOOST_MPL_LIMIT_LIST_SIZE=30", "-fPIC"]
    flags += ["-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS", "-I", str(prefix / "include")]
    command = ["c++", *OPTIONS, "-O3", *flags, "-I", str(eigen), "-c", str(source)]
    subprocess.run([*command, "-o", str(compiled_object)], check=True)
    return compiled_object


def pinocchio_cpp(n: int, states: Array, given: Array, folder: Path, of: Path) -> Method:
    texts = [of, "void accelerations(int, const double *, const double *, double *);\n"]
    call = f"(void)work; accelerations({n}, state, given, out);"
    return compiled(
        *("Pinocchio ABA, C++", folder / "pinocchio", texts, call, _relative(states, n), given, n),
        more=["-lstdc++"],
        after=np.cumsum,
    )


# -- called from Python -----------------------------------------------------------


def _looped(name: str, call: Callable[[int], Array]) -> Method:
    def run(count: int) -> Array:
        result = np.zeros(0)
        for k in range(count - 1, -1, -1):
            result = call(k % STATES)
        return result

    return Method(name, run)


def numpy_lambdify(n: int, states: Array, given: Array) -> Method:
    (q, v, masses, rods, g), *forms = without_certificate(read_text(pendulum_scene(n)))
    compute = sympy.lambdify([*q, *v, *masses, *rods, g], forms, "numpy", cse=True)
    fixed = [*given[1::2].tolist(), *given[2::2].tolist(), GRAVITY]
    rows = states.tolist()

    def call(k: int) -> Array:
        matrix, forcing = compute(*rows[k], *fixed)
        return np.asarray(np.linalg.solve(np.array(matrix), np.array(forcing)))

    return _looped("NumPy, lambdify and solve", call)


def pinocchio_python(n: int, states: Array, given: Array) -> Method:
    import pinocchio as pin

    model = pin.Model()
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    parent, arm = 0, 0.0
    for i in range(n):
        place = pin.SE3(np.eye(3), np.array([0.0, 0.0, -arm]))
        parent = model.addJoint(parent, pin.JointModelRY(), place, f"joint{i}")
        m, arm = given[1 + 2 * i], given[2 + 2 * i]
        body = pin.Inertia(m, np.array([0.0, 0.0, -arm]), np.zeros((3, 3)))
        model.appendBodyToJoint(parent, body, pin.SE3.Identity())
    data, none = model.createData(), np.zeros(n)
    relative = _relative(states, n)
    pairs = [(row[:n].copy(), row[n:].copy()) for row in relative]

    def call(k: int) -> Array:
        q, v = pairs[k]
        return pin.aba(model, data, q, v, none)  # type: ignore[no-any-return]

    method = _looped("Pinocchio ABA, Python", call)
    return Method(method.name, lambda count: np.cumsum(method.run(count)))


# -- measuring ----------------------------------------------------------------


def methods(n: int, folder: Path, largest_lambdify: int, pinocchio: Path | None) -> list[Method]:
    of = states_of(n)
    states = np.array([np.r_[s.q, s.v] for s in of])
    given = np.r_[GRAVITY, np.column_stack([of[0].m, of[0].l]).ravel()]
    found = [lagrange_c(n, states, given, folder)]
    if n == 2:
        found.append(hand_written(states, given, folder))
    if n <= largest_lambdify:
        found.append(numpy_lambdify(n, states, given))
    if importlib.util.find_spec("casadi"):
        found.append(casadi_c(n, states, given, folder))
    if importlib.util.find_spec("pinocchio"):
        found.append(pinocchio_python(n, states, given))
        if pinocchio is not None:
            found.append(pinocchio_cpp(n, states, given, folder, pinocchio))
    return found


def mismatch(method: Method, n: int) -> float:
    """Largest difference from the closed form at the first state, relative to its largest entry."""
    matrix, forcing = closed_form(states_of(n)[0])
    expected = np.linalg.solve(matrix, forcing)
    found = method.run(1)
    if method.of_matrix:
        found = np.linalg.solve(found[: n * n].reshape(n, n), found[n * n :])
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def timed(method: Method, count: int) -> float:
    """Microseconds of one call."""
    start = time.perf_counter()
    method.run(count)
    return 1e6 * (time.perf_counter() - start) / count


def measure(n: int, candidates: list[Method], repetitions: int) -> list[dict[str, Any]]:
    """Median, quartiles and mismatch of every method at one size, the methods taking turns."""
    errors = {m.name: mismatch(m, n) for m in candidates}
    counts = {m.name: max(FEWEST, int(1e6 * LENGTH / timed(m, FEWEST))) for m in candidates}
    times: dict[str, list[float]] = {m.name: [] for m in candidates}
    for _ in range(repetitions):
        for method in candidates:
            times[method.name].append(timed(method, counts[method.name]))
    return [summary(n, m, times[m.name], errors[m.name]) for m in candidates]


def summary(n: int, method: Method, of: list[float], error: float) -> dict[str, Any]:
    """Median and quartiles of one method at one size."""
    low, median, high = statistics.quantiles(of, n=4) if len(of) > 1 else of * 3
    return {
        "n": n,
        "method": method.name,
        "microseconds": median,
        "quartiles": [low, high],
        "mismatch": error,
        "seconds_to_make": method.seconds,
    }


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown: a row a size, a column a method, in microseconds, with the spread."""
    names = list(dict.fromkeys(r["method"] for r in rows))
    of = {(r["n"], r["method"]): r for r in rows}
    lines = ["| n | " + " | ".join(names) + " | seconds to compile |", "|---" * (len(names) + 2)]
    lines[1] += "|"
    for n in sorted({r["n"] for r in rows}):
        cells = [_cell(of.get((n, name))) for name in names]
        seconds = of[n, names[0]]["seconds_to_make"]["compile"]
        lines.append(f"| {n} | " + " | ".join(cells) + f" | {seconds:.2f} |")
    return "\n".join(lines)


def _cell(row: dict[str, Any] | None) -> str:
    if row is None:
        return "–"
    spread = (row["quartiles"][1] - row["quartiles"][0]) / row["microseconds"]
    return f"{row['microseconds']:.3g} ± {50 * spread:.0f} %"


def about() -> dict[str, Any]:
    """What the figures depend on."""
    compiler = subprocess.run(["cc", "--version"], capture_output=True, text=True, check=True)
    packages = {"sympy": "sympy", "numpy": "numpy", "casadi": "casadi", "pin": "pinocchio"}
    found = {p: version(p) for p, module in packages.items() if importlib.util.find_spec(module)}
    return {
        "python": platform.python_version(),
        "compiler": compiler.stdout.splitlines()[0],
        "options": OPTIONS,
        **found,
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[2, 4, 8, 16, 32, 64])
    parser.add_argument("--largest-lambdify", type=int, default=16)
    parser.add_argument("--repetitions", type=int, default=15)
    parser.add_argument("--quick", action="store_true", help="n = 2 and 4, few repetitions")
    parser.add_argument("--pinocchio-cpp", action="store_true")
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    if shutil.which("cc") is None:
        print("a C compiler is needed (cc on the path)", file=sys.stderr)
        return 1
    sizes, repetitions = ([2, 4], 3) if options.quick else (options.sizes, options.repetitions)
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as root:
        pinocchio = pinocchio_object(Path(root)) if options.pinocchio_cpp else None
        for n in sizes:
            folder = Path(root) / str(n)
            folder.mkdir()
            made = methods(n, folder, options.largest_lambdify, pinocchio)
            rows += measure(n, made, repetitions)
            print(f"n = {n} done", file=sys.stderr)
    print(table(rows))
    return verdict(rows, about(), "the closed form", options.json)


if __name__ == "__main__":
    sys.exit(main())
