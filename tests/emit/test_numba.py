"""Emitted Python under Numba: as it stands, and with the decorators of its style."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from tests.emit.test_arrays import example
from tests.emit.test_styles import module
from tests.program import test_large_systems as large
from tests.systems.shipped import derived

numba: Any = pytest.importorskip("numba")

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", autouse=True)
def unoptimized() -> Iterator[None]:
    """What is compiled here runs once or twice."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE"):
            patch.setenv(f"NUMBA_{name}", "0")
        numba.config.reload_config()
        yield
    numba.config.reload_config()


def near(functions, count=3):
    """States beside the initial one, in columns."""
    start = functions["INITIAL"]
    start = np.full(2 * len(functions["COORDINATES"]), 0.3) if start is None else start
    return start[:, None] + 0.02 * np.random.default_rng(2).standard_normal((len(start), count))


def compare(plain, compiled, names, *, many=False):
    """Compare one state; many states too if asked for, which compiles all a second time."""
    y = near(plain)
    for name in names:
        expected = plain[name](0.0, y)
        results = [compiled[name](0.0, y[:, 1].copy())]
        results += [compiled[name](0.0, y)[..., 1]] if many else []
        for got in results:
            assert np.abs(got - expected[..., 1]).max() <= 1e-10 * np.abs(expected).max()


def test_functions_compile_as_they_stand():
    """Without decorators, by broadcasting in NumPy and in Numba alike."""
    functions = module(derived("double_pendulum"))
    names = ["rhs", "mass_matrix", "forcing", "energy", "positions", "velocities"]
    compare(functions, {name: numba.njit(functions[name]) for name in names}, names, many=True)


def test_compiled_functions_know_a_singular_mass_matrix():
    functions = module(derived("double_pendulum"), "numba")
    light = functions["DEFAULTS"]._replace(m2=0.0)
    assert np.isnan(functions["rhs"](0.0, near(functions)[:, 0].copy(), light)[2:]).all()


@pytest.mark.parametrize(
    ("make", "names"),
    [
        (lambda: derived("four_bar_linkage"), ["rhs", "multipliers"]),
        (lambda: derived("driven_spring"), ["rhs", "inputs", "outputs"]),
        (lambda: large.chain(20), ["rhs"]),
        pytest.param(lambda: large.CASES["net"](), ["rhs"], marks=pytest.mark.campaign),
    ],
    ids=["dense", "driven", "band", "sparse"],
)
def test_the_style_of_numba(make, names):
    equations = make()
    compare(module(equations), module(equations, "numba"), names)


def test_a_loop_of_calls_is_compiled():
    functions = module(derived("double_pendulum"), "numba")
    end = functions["integrate"](functions["INITIAL"], 0.0, 0.1, 10)
    plain = module(derived("double_pendulum"))
    expected = plain["integrate"](plain["INITIAL"], 0.0, 0.1, 10)
    assert np.abs(end - expected).max() < 1e-13
    assert functions["integrate"].signatures


def test_the_example_of_the_documentation(monkeypatch):
    assert example("numba", monkeypatch)["end"].shape == (4,)
