"""Run lowered functions: functions of t, y, p and u, made of closures.

The state y is [q, v]; p are the parameters, of which there may be more than are read; u are the
values of inputs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from lagrange_cli.program.interpreter.arithmetic import DOUBLES, Arithmetic, UnsupportedError
from lagrange_cli.program.interpreter.closures import Closure
from lagrange_cli.program.interpreter.families import MANY, members_of, with_numpy
from lagrange_cli.program.interpreter.plan import Plan, Planner
from lagrange_cli.program.lowered.functions import Function, Scope


class Runnable(Protocol):
    """A function of t, y, p and u; results are an array, a number, or a list of objects.

    Attributes
    ----------
    size
        Number of results.
    """

    size: int

    def __call__(self, t: Any, y: Any, p: Sequence[Any], u: Sequence[Any] = ()) -> Any: ...

    def bound(self, p: Sequence[Any], u: Sequence[Any] = ()) -> Callable[[Any, Any], Any]:
        """Return the function of t and y for some parameters and inputs."""
        ...


def compiled(
    function: Function,
    arithmetic: Arithmetic = DOUBLES,
    known: Mapping[str, Function] = MappingProxyType({}),
) -> Runnable:
    """Make closures of a function.

    Parameters
    ----------
    known
        The functions among which are those whose results it is given.

    Raises
    ------
    UnsupportedError
        The arithmetic has no loops over families, or lacks a function; routines that it lacks
        raise at a call.
    """
    earlier = [compiled(known[name], arithmetic, known) for name in function.given_functions]
    of_families = any(isinstance(step, Scope) for step in function.body)
    if of_families and not arithmetic.of_doubles:
        raise UnsupportedError("loops over families")
    if of_families and members_of(function) >= MANY:
        return _Unplanned(with_numpy(function), function)
    sizes = [math.prod(known[name].shape) for name in function.given_functions]
    return _Planned(Planner(function, arithmetic, sum(sizes)).plan(), function, arithmetic, earlier)


class _Planned:
    """A function over registers."""

    def __init__(
        self, plan: Plan, function: Function, arithmetic: Arithmetic, earlier: list[Runnable]
    ) -> None:
        self._plan, self._arithmetic, self._earlier = plan, arithmetic, earlier
        self.size = math.prod(function.shape)
        self._ended = _ended(function) if arithmetic.of_doubles else list
        self._failure = _failure(function) if arithmetic.of_doubles else _refuse

    def _head(self, p: Sequence[Any], u: Sequence[Any]) -> list[Any] | None:
        """Return the first registers, those of parameters and inputs; None without results."""
        plan = self._plan
        if len(p) < plan.parameters or len(u) < plan.inputs:
            raise ValueError(f"it reads {plan.parameters} parameters and {plan.inputs} inputs")
        head = [*plan.constants, *p[: plan.parameters], *u[: plan.inputs]]
        for step in plan.prologue:
            head.append(step(head))
        return head if all(test(head) for test in plan.fixed_tests) else None

    def __call__(self, t: Any, y: Any, p: Sequence[Any], u: Sequence[Any] = ()) -> Any:
        try:
            head = self._head(p, u)
            results = [x for function in self._earlier for x in _listed(function(t, y, p, u))]
            if head is None:
                return self._failure()
            return self._run([*head, t, *self._arithmetic.state(y), *results])
        except self._arithmetic.errors:
            return self._failure()

    def _run(self, r: list[Any]) -> Any:
        plan, append = self._plan, r.append
        for closures, solution in plan.steps:
            for step in closures:
                append(step(r))
            if solution is not None:
                r.extend(solution(r))
        for test in plan.tests:
            if not test(r):
                return self._failure()
        return self._ended(plan.results(r))

    def bound(self, p: Sequence[Any], u: Sequence[Any] = ()) -> Callable[[Any, Any], Any]:
        if self._earlier:
            return lambda t, y: self(t, y, p, u)
        errors, failure = self._arithmetic.errors, self._failure
        try:
            head = self._head(p, u)
        except errors:
            head = None
        if head is None:
            return lambda t, y: failure()
        (closures, solution), *more = self._plan.steps
        if more or solution is not None or not self._arithmetic.of_doubles:
            run, state = self._run, self._arithmetic.state
            return _guarded(lambda t, y: run([*head, t, *state(y)]), errors, failure)
        return _in_order(head, closures, self._plan, self._ended, errors, failure)


def _guarded(
    run: Callable[[Any, Any], Any],
    errors: tuple[type[Exception], ...],
    failure: Callable[[], Any],
) -> Callable[[Any, Any], Any]:
    def function(t: Any, y: Any) -> Any:
        try:
            return run(t, y)
        except errors:
            return failure()

    return function


def _in_order(
    head: list[Any],
    closures: list[Closure],
    plan: Plan,
    ended: Callable[[Any], Any],
    errors: tuple[type[Exception], ...],
    failure: Callable[[], Any],
) -> Callable[[Any, Any], Any]:
    """Return the function of doubles without a solution of equations, of which most are."""
    tests, results, asarray = plan.tests, plan.results, np.asarray

    def function(t: Any, y: Any) -> Any:
        try:
            r = [*head, t, *asarray(y, float).tolist()]
            append = r.append
            for step in closures:
                append(step(r))
            for test in tests:
                if not test(r):
                    return failure()
            return ended(results(r))
        except errors:
            return failure()

    return function


class _Unplanned:
    """A function of large families, through NumPy."""

    def __init__(self, run: Callable[[Any, Any, Any, Any], Any], function: Function) -> None:
        self._function, self._failure = run, _failure(function)
        self.size = math.prod(function.shape)
        self._ended = _ended(function)

    def __call__(self, t: Any, y: Any, p: Sequence[Any], u: Sequence[Any] = ()) -> Any:
        try:
            with np.errstate(all="ignore"):
                return self._ended(self._function(t, y, p, u))
        except DOUBLES.errors:
            return self._failure()

    def bound(self, p: Sequence[Any], u: Sequence[Any] = ()) -> Callable[[Any, Any], Any]:
        return lambda t, y: self(t, y, p, u)


def _listed(results: Any) -> list[Any]:
    return np.ravel(results).tolist() if isinstance(results, np.ndarray) else list(results)


def _refuse() -> Any:
    raise UnsupportedError("a state without results")


def _failure(function: Function) -> Callable[[], Any]:
    """Return what makes the results of a state that has none."""
    shape = function.shape
    return (lambda: np.full(shape, math.nan)) if shape else (lambda: math.nan)


def _ended(function: Function) -> Callable[[Any], Any]:
    """Return what makes results of doubles: finite, or none."""
    shape, failure, array, isfinite = function.shape, _failure(function), np.array, math.isfinite

    def ended(numbers: Any) -> Any:
        # A sum is finite if all are, or may overflow.
        if not isfinite(sum(numbers)) and not all(map(isfinite, numbers)):
            return failure()
        if not shape:
            return float(numbers[0])
        results = array(numbers, float)
        return results if len(shape) == 1 else results.reshape(shape)

    return ended
