"""Taylor's method through the optional package heyoka.

Biscani and Izzo, *Mon. Not. R. Astron. Soc.* 504 (2021) 2614; orders and steps after Jorba and
Zou, *Exp. Math.* 14 (2005) 99. The right-hand side is differentiated as expressions
(:class:`.right_hand_side.Expressions`), which heyoka compiles into machine code.

heyoka has a cache on the disk of its own, in the user's folder, which holds machine code that is
loaded unverified. Here it has a private folder while it compiles: what lagrange's cache has for the
same expressions is put there, and what appears there is taken into the cache. So its code is
verified, bounded and cleared as everything else there, and no code remains if the cache is off.
"""

from __future__ import annotations

import copy
import importlib.util
import math
import os
import pickle
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from lagrange_cli.cache import Cache, digest, open_cache
from lagrange_cli.files import temporary_folder
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.base import (
    UNDERFLOW,
    Control,
    Integrator,
    StepError,
    UnfitError,
)
from lagrange_cli.simulate.integrators.right_hand_side import Expressions, Rhs, Tracer, structured
from lagrange_cli.toolchain.compiler import processor

#: Ending of the cache's entries.
SUFFIX = ".db"

#: Name of the file that heyoka makes.
_DATABASE = "cache.db"

#: The folder in which heyoka keeps code is a setting of the process.
_SETTING = threading.Lock()


def compiled_once(state: Any, key: str, build: Callable[[], Any]) -> Any:
    """Compile by ``build``, or load what it compiled when the key was the same.

    Parameters
    ----------
    state
        heyoka's ``llvm_state``; its settings are afterwards what they were.
    key
        The hash of all that the code depends on.
    """
    with _SETTING:
        path, enabled = state.get_diskcache_path(), state.get_diskcache_enabled()
        try:
            state.set_diskcache_enabled(False)
            return _compiled_code(state, open_cache(), key, build)
        finally:
            state.set_diskcache_path(path)
            state.set_diskcache_enabled(enabled)


def _compiled_code(state: Any, cache: Cache, key: str, build: Callable[[], Any]) -> Any:
    """Compile or load while heyoka's own cache is switched off."""
    from pathlib import Path  # a run without heyoka does without

    if cache.reason is not None:
        return build()
    before = cache.get(key, SUFFIX)
    try:
        with temporary_folder() as folder:
            if before is not None:
                Path(folder, _DATABASE).write_bytes(before)
            built = _within(state, folder, build)
            if before is None:
                _keep(cache, key, folder)
            return built
    except OSError:
        # The folder cannot be made or written.
        return build()


def _within(state: Any, folder: str, build: Callable[[], Any]) -> Any:
    """Build with heyoka's cache in this folder, whose files are complete afterwards."""
    path = state.get_diskcache_path()
    state.set_diskcache_path(folder)
    state.set_diskcache_enabled(True)
    try:
        return build()
    finally:
        state.set_diskcache_enabled(False)
        # It closes its files when it is given others.
        state.set_diskcache_path(path)


def _keep(cache: Cache, key: str, folder: str) -> None:
    """Take what heyoka has written into the cache, if it is one file and complete."""
    from pathlib import Path  # a run without heyoka does without

    if [name for name in os.listdir(folder) if name.startswith(_DATABASE)] == [_DATABASE]:
        cache.put(key, Path(folder, _DATABASE).read_bytes(), SUFFIX)


#: Largest relative tolerance with an order of its own.
_LARGEST = 1e-3

#: Smallest one.
_SMALLEST = 2.0**-52

#: Relative tolerance that sets the order if there is none.
_USUAL = 1e-12

#: Operations of a right-hand side above which loops are compiled in place of one long text.
_COMPACT = 150


class Taylor(Integrator):
    """Taylor's method of the order that the tolerance asks for.

    Steps are as long as the last two terms of the series of each component, which are also the
    interpolant, are below its tolerance. One step of order p counts p evaluations.
    """

    name = "taylor"
    title = "Taylor series to the order that the tolerance asks for, by heyoka"
    order = 20
    variable_order = True
    package = "heyoka", "taylor"
    traces = True
    state_attributes = ("_terms", "_start", "_longest")

    def __init__(self, rhs: Rhs, t0: float, y0: Array, t_end: float, control: Control) -> None:
        rhs_expressions = structured(rhs).expressions
        if rhs_expressions is None:
            raise UnfitError("its equations are not to be had as expressions")
        self._projection, self._control = structured(rhs).project, control
        self.t, self.y, self.t_end = t0, np.array(y0, dtype=float), t_end
        rtol = float(np.max(control.rtol, initial=0.0)) or _USUAL
        tolerance = min(max(rtol, _SMALLEST), _LARGEST)
        self._series = _series(rhs_expressions, tolerance, len(self.y))
        self._longest = min(control.first_step, control.max_step)

    @classmethod
    def suits(cls, rhs: Rhs, size: int) -> bool:
        """Tell whether it can take a right-hand side of ``size`` numbers here."""
        rhs_expressions = structured(rhs).expressions
        if rhs_expressions is None or importlib.util.find_spec(cls.package[0]) is None:
            return False
        try:
            _system(_traced(rhs_expressions, size))
        except UnfitError:
            return False
        return True

    def step(self, limit: float) -> None:
        series, t, control = self._series, self.t, self._control
        series.time, series.state[:] = t, self.y
        with np.errstate(all="ignore"):
            series.step(max_delta_t=limit - t, write_tc=True)
            terms = series.tc.T.copy()
        self.evaluations += len(terms) - 1
        tolerance = control.atol + control.rtol * np.abs(self.y)
        h = min(_step(terms, tolerance), self._longest, limit - t)
        t_new = limit if h == limit - t else t + h
        if not t_new - t >= 10 * math.ulp(t):
            raise StepError(UNDERFLOW)
        self.y = self._arrived(t_new, _value(terms, t_new - t))
        self._terms, self._start = terms, t
        self.t, self._longest = t_new, control.max_step

    def interpolate(self, times: Array) -> Array:
        return np.array([_value(self._terms, t - self._start) for t in times.tolist()])


def _series(rhs_expressions: Expressions, tolerance: float, size: int) -> Any:
    """Return heyoka's integrator, of which only the series are used."""
    series = copy.copy(_compiled(_traced(rhs_expressions, size), tolerance))
    numbers = (*rhs_expressions.parameters.tolist(), *rhs_expressions.inputs.tolist())
    series.pars[:] = numbers[: len(series.pars)]
    return series


@dataclass(frozen=True)
class _Text:
    """Expressions that a right-hand side is compiled from.

    Attributes
    ----------
    trace
        Runs the right-hand side over objects.
    plain
        Parameters, then inputs: the number if it is 0 or 1, which makes expressions simpler; None
        for a parameter of the compiled code.
    inputs
        Number of inputs.
    size
        Numbers of the state.
    """

    trace: Tracer
    plain: tuple[float | None, ...]
    inputs: int
    size: int


def _traced(rhs_expressions: Expressions, size: int) -> _Text:
    numbers = (*rhs_expressions.parameters.tolist(), *rhs_expressions.inputs.tolist())
    plain = tuple(x if x in (0.0, 1.0) else None for x in numbers)
    return _Text(rhs_expressions.trace, plain, len(rhs_expressions.inputs), size)


@lru_cache(maxsize=64)
def _system(text: _Text) -> tuple[list[tuple[Any, Any]], int]:
    """Write the equations in heyoka's expressions; return them and their operations."""
    import heyoka

    from lagrange_cli.simulate.integrators.external.heyoka_algebra import Algebra, Traced

    algebra = Algebra(heyoka)
    state = [heyoka.expression(f"y{k}") for k in range(text.size)]
    numbers = [
        heyoka.par[k] if x is None else heyoka.expression(x) for k, x in enumerate(text.plain)
    ]
    parameters = [Traced(x, algebra) for x in numbers]
    first = len(parameters) - text.inputs
    slopes = text.trace(
        algebra.functions,
        Traced(heyoka.time, algebra),
        [Traced(x, algebra) for x in state],
        parameters[:first],
        parameters[first:],
    )
    system = [(x, algebra.plain(slope)) for x, slope in zip(state, slopes, strict=True)]
    return system, algebra.operations


@lru_cache(maxsize=64)
def _compiled(text: _Text, tolerance: float) -> Any:
    """Compile the integrator for any parameters, without a state."""
    import heyoka

    system, operations = _system(text)
    compact, start = operations > _COMPACT, [0.0] * text.size
    asked = pickle.dumps((system, tolerance, compact))
    return compiled_once(
        heyoka.llvm_state,
        digest("series", heyoka.__version__, processor(), asked),
        lambda: heyoka.taylor_adaptive(system, start, tol=tolerance, compact_mode=compact),
    )


def _step(terms: Array, tolerance: Array) -> float:
    """Compare the last two terms of each component with its tolerance.

    Even and odd functions have no term of every other order.
    """
    order = len(terms) - 1
    steps = []
    for k in (order - 1, order):
        size = float(np.max(np.abs(terms[k]) / np.maximum(tolerance, 1e-300)))
        steps.append(size ** (-1 / k) if size > 0 else math.inf)
    return min(steps)


def _value(terms: Array, h: float) -> Array:
    """Evaluate the series at a distance, by Horner's rule."""
    value = terms[-1]
    for term in terms[-2:0:-1]:
        value = term + h * value
    return np.asarray(terms[0] + h * value)
