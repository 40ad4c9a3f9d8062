"""Emitted derivatives of the state's rates, beside differences of the equations in 60 digits."""

from __future__ import annotations

import ctypes
import sys
import types
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli import load
from lagrange_cli.errors import InputError
from tests.emit.derivative_reference import AccelerationReference, relative
from tests.emit.emitted_c import WARNINGS, Compiled, compiler, run, shared_library
from tests.systems.shipped import NARROW, sliced

SYSTEMS = Path(__file__).parents[2] / "systems"
SCENES = sorted(str(path.relative_to(SYSTEMS).with_suffix("")) for path in SYSTEMS.glob("*/*.yaml"))
SCENES = [scene for scene in SCENES if not scene.startswith("refused/")]

#: Of one degree of freedom; unrolled; with closures of positions and of velocities; with inputs;
#: sparse; solved by a loop; with contacts.
FEW = (
    "pendulums/pendulum",
    "pendulums/furuta_pendulum",
    "constraints/four_bar_linkage",
    "rolling/snakeboard",
    "oscillators/driven_spring",
    "chains/fput",
    "contact/ladder_leaving_wall",
)

#: Largest error, relative to the largest derivative by the same number.
TOLERANCE = 1e-10


def module_of(derivation, **options):
    """The emitted module of Python, with derivatives unless others are asked for."""
    (text,) = derivation.emit("python", **(options or {"jacobian": True})).values()
    module = types.ModuleType("emitted")
    sys.modules["emitted"] = module
    exec(compile(text, "emitted", "exec"), vars(module))
    return module


def state_near(module, seed=3):
    """A state beside the one in which the scene begins, off its closures too."""
    n = len(module.COORDINATES)
    y = np.linspace(0.3, 0.9, 2 * n) if module.INITIAL is None else module.INITIAL
    moves = np.random.default_rng(seed).uniform(0.01, 0.1, 2 * n)
    return y + moves * (np.abs(y).max() or 1.0)


def checked(function, matrix, expected):
    """The rows of accelerations of a matrix, of which the rows of velocities are known."""
    n = len(expected)
    velocities = np.eye(n, 2 * n, n) if function == "jacobian" else 0 * expected
    assert np.array_equal(matrix[:n], velocities), function
    return matrix[n:]


def modes_of(equations):
    """All contacts open, then the first of them closed."""
    count = len(equations.system.contacts)
    return [(0,) * count, (1,) + (0,) * (count - 1)] if count else [()]


def check(scene, folder=None, **parameters):
    """Compare Python, and C compiled in a folder, with the reference."""
    derivation = load(SYSTEMS / f"{scene}.yaml", parameters=parameters).derive()
    equations, module = derivation.equations, module_of(derivation)
    if not equations.system.coordinates:
        assert not hasattr(module, "jacobian")
        return
    p = module.DEFAULTS
    t, y = 0.3, state_near(module)
    u = module.inputs(t, y, p) if equations.system.inputs else ()
    library = None if folder is None else Library(equations, folder, derivation)
    for mode in modes_of(equations):
        keywords = {"mode": mode} if mode else {}
        try:
            exact = AccelerationReference(equations, mode).derivatives(t, y, u, p)
        except ZeroDivisionError:  # a contact that cannot be closed here
            rows = module.jacobian(t, y, p, **keywords)[len(module.COORDINATES) :]
            assert np.isnan(rows).all()
            continue
        for function, expected in zip(("jacobian", "jacobian_u", "jacobian_p"), exact, strict=True):
            if not expected.size:
                assert not hasattr(module, function)
                continue
            found = getattr(module, function)(t, y, p, **keywords)
            found = checked(function, found, expected)
            assert relative(found, expected).max(initial=0.0) < TOLERANCE, (function, mode)
            if library is not None:
                found = library.derivatives(function, t, y, u, expected.shape, mode)
                found = checked(function, found, expected)
                assert relative(found, expected).max(initial=0.0) < TOLERANCE, (function, mode)


class Library(Compiled):
    """Emitted C with derivatives."""

    asked = "jacobian"

    def __init__(self, equations, folder, derivation):
        files = derivation.emit("c", **{self.asked: True})
        for name, text in files.items():
            (folder / name).write_text(text, encoding="utf-8")
        (source,) = [folder / name for name in files if name.endswith(".c")]
        self.library = shared_library(source)
        self.type, self.prefix = np.float64, source.stem
        self.header = source.with_suffix(".h").read_text(encoding="utf-8")
        self.defaults = np.zeros(max(1, len(equations.system.parameters)))
        fill = getattr(self.library, f"{self.prefix}_defaults")
        fill.restype = None
        fill(ctypes.c_void_p(self.defaults.ctypes.data))

    def derivatives(self, function, t, y, u, shape, mode=()):
        """The whole matrix of a function, of as many rows of accelerations as a shape has."""
        whole = self.results(function, t, y, u, 2 * shape[0] * shape[1], mode)
        whole = whole.reshape(2 * shape[0], shape[1])
        if f"{self.prefix}_{function}_rows" in self.header:
            count = self.macro(f"{function.upper()}_NONZERO")
            entries = self.results(f"{function}_entries", t, y, u, count, mode)
            rows, columns = (
                (ctypes.c_int * count).in_dll(self.library, f"{self.prefix}_{function}_{name}")
                for name in ("rows", "columns")
            )
            matrix = np.zeros_like(whole)
            matrix[list(rows), list(columns)] = entries
            assert np.array_equal(matrix, whole)
        return whole

    def results(self, function, t, y, u, count, mode):
        """So many results of a function."""
        arrays = [np.ascontiguousarray(a, float) for a in (y, u, self.defaults)]
        flags = [np.array(mode, ctypes.c_int)] if len(mode) else []
        work, out = np.full(self.macro("WORK"), np.nan), np.full(count + 1, np.nan)
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in (*arrays, *flags, work, out)]
        call = getattr(self.library, f"{self.prefix}_{function}")
        assert call(ctypes.c_double(t), *pointers) == 0
        assert np.isnan(out[count]), "nothing is written behind the results"
        return out[:count]


@pytest.mark.slow
@pytest.mark.parametrize("scene", FEW)
def test_python(scene):
    check(scene)


@pytest.mark.slow
@pytest.mark.compiler
def test_sparse_results(tmp_path):
    """25 beads that springs couple to their neighbours."""
    compiler()
    derivation = load(SYSTEMS / "chains" / "net_of_springs.yaml", parameters={"n": 5}).derive()
    module = module_of(derivation)
    assert 50 < len(module.JACOBIAN_ROWS) < 50 * 50 / 8
    entries = module.jacobian_entries(0.0, module.INITIAL)
    whole = module.jacobian(0.0, module.INITIAL)
    assert np.array_equal(whole[module.JACOBIAN_ROWS, module.JACOBIAN_COLUMNS], entries)
    check("chains/net_of_springs", tmp_path, n=5)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("scene", ["constraints/four_bar_linkage", "chains/pendulum_chain"])
@pytest.mark.parametrize("real", ["float", "long-double"])
def test_other_types_compile(scene, real, tmp_path):
    derivation = load(SYSTEMS / f"{scene}.yaml").derive()
    for name, text in derivation.emit("c", jacobian=True, real=real).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (source,) = tmp_path.glob("*.c")
    words = ["-std=c99", *WARNINGS, "-Wdouble-promotion", "-fsyntax-only"]
    run(compiler(), *words, source)


@pytest.mark.slow
def test_too_many_to_write_out():
    derivation = load(SYSTEMS / "chains" / "chain_of_rods.yaml", parameters={"n": 310}).derive()
    with pytest.raises(InputError, match="too many to write out"):
        derivation.emit("c", jacobian=True)


def test_without_it_nothing_is_added():
    derivation = load(SYSTEMS / "pendulums" / "pendulum.yaml").derive()
    for to in ("c", "python"):
        assert "jacobian" not in "".join(derivation.emit(to).values())


@pytest.mark.slow
@pytest.mark.compiler
@sliced(SCENES, NARROW, "scene")
def test_shipped_scenes(scene, tmp_path):
    compiler()
    check(scene, tmp_path)
