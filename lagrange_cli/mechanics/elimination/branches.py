"""Refusals of solutions with several branches, with configurations that tell them apart.

A branch without a reason to choose it would be a guess; the error proposes a configuration on each.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InconsistentError, InputError, Mark, Problem, SingularError
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.symbols.quoting import with_carets, written
from lagrange_cli.scene.language.expression import Equation

#: Most configurations that are tried: they serve a hint, which should not delay the
#: refusal.
_TRIES = 60
#: Part of the largest value by which branches are to differ, so that two digits tell them apart.
_APART = mpf("0.05")
#: Largest relative distance of equal branches: the tolerance of consistency.
_SAME = mpf(10) ** -9
#: Digits of a value for ``initial``, which is to satisfy the constraints.
_EXACT = 12
#: Digits of a value for ``near``, which only tells branches apart.
_LOOSE = 6


@dataclass(frozen=True)
class BranchedSolution:
    """All branches of an equation's solution for an unknown.

    Attributes
    ----------
    reference
        Values that the scene gives.
    constants
        Symbols of parameters.
    """

    constraint: str
    mark: Mark
    unknown: sp.Symbol
    branches: Sequence[sp.Expr]
    reference: Mapping[sp.Symbol, mpf]
    constants: frozenset[sp.Symbol]

    def several(self) -> InputError:
        """Refuse several branches without a reason to choose one, or a double one."""
        if len(set(self.branches)) == 1:
            return self._double()
        listed = ", ".join(f"{self.unknown} = {with_carets(b)}" for b in self.branches)
        hint = f"choose one by giving '{self.unknown}', and what it depends on,"
        hint += " in 'initial' or 'near'"
        problem = self._problem(
            f"constraint '{self.constraint}' leaves several branches: {listed}",
            [hint, *(_line("near", place) for place in self._choices(self.reference))],
            "ambiguous-branch",
        )
        return InputError(problem)

    def _double(self) -> SingularError:
        problem = self._problem(
            f"constraint '{self.constraint}' is singular: wherever it holds, its gradient vanishes",
            ["write", f"{self.constraint}: {self.unknown} = {with_carets(self.branches[0])}"],
            "singular",
        )
        return SingularError(problem)

    def meeting(self) -> SingularError:
        """Refuse branches that meet at the given configuration, where the chart ends."""
        symbols = sorted({str(s) for b in self.branches for s in b.free_symbols - self.constants})
        if not symbols:
            return self._double()
        problem = self._problem(
            f"the given configuration is singular: two branches of '{self.constraint}' for"
            f" '{self.unknown}' meet there, so that {', '.join(symbols)} cannot tell them apart",
            [f"take '{self.unknown}' as a coordinate, or start elsewhere", *self._elsewhere()],
            "singular",
        )
        return SingularError(problem)

    def unreal(self, message: str) -> InconsistentError:
        """Refuse branches that are not real at the given configuration."""
        hints = ["start elsewhere", *self._elsewhere()]
        return InconsistentError(self._problem(message, hints, "inconsistent"))

    def _elsewhere(self) -> list[str]:
        constants = {s: x for s, x in self.reference.items() if s in self.constants}
        return [_line("initial", place) for place in self._choices(constants)[-1:]]

    def _problem(self, message: str, hints: Sequence[str], rule: str) -> Problem:
        do, *lines = hints
        hint = "\n".join([f"{do}:", *lines]) if lines else do
        return Problem(message, self.mark, hint=hint, rule=rule)

    def _choices(self, known: Mapping[sp.Symbol, mpf]) -> list[dict[sp.Symbol, mpf]]:
        """Find a configuration on each branch at which all are real and differ.

        Empty if there is none, or a parameter has no value.
        """
        symbols = sorted({s for b in self.branches for s in b.free_symbols}, key=str)
        if any(s in self.constants and s not in known for s in symbols):
            return []
        free = [s for s in symbols if s not in known]
        sizes = [abs(x) for s, x in known.items() if s in self.constants and x]
        for scale in dict.fromkeys([*sizes, mpf(1)]):
            for place in _places(free, scale):
                try:
                    branch_values = evaluate(list(self.branches), {**known, **place})
                except DomainError:
                    continue
                if _differ(branch_values):
                    return [{**place, self.unknown: x} for x in branch_values]
        return []


def _places(free: Sequence[sp.Symbol], scale: mpf) -> Iterator[dict[sp.Symbol, mpf]]:
    """Yield values of two digits within the scale, spread evenly by irrational steps."""
    for k in range(1, (_TRIES if free else 1) + 1):
        parts = [mpmath.frac(k * mpmath.sqrt(2 + i)) * 2 - 1 for i in range(len(free))]
        yield {s: mpf(f"{float(scale * x):.2g}") for s, x in zip(free, parts, strict=True)}


def _differ(branch_values: Sequence[mpf]) -> bool:
    largest = max(map(abs, branch_values))
    return all(
        abs(x - y) > _APART * largest
        for k, x in enumerate(branch_values)
        for y in branch_values[:k]
    )


def meet(x: mpf | None, y: mpf | None, length: mpf) -> bool:
    """Say whether two values agree to the tolerance of consistency."""
    if x is None or y is None:
        return False
    return bool(abs(x - y) <= _SAME * max(length, abs(x), abs(y)))


def _line(section: str, place: Mapping[sp.Symbol, mpf]) -> str:
    digits = _EXACT if section == "initial" else _LOOSE
    entries = ", ".join(f"{s}: {float(x):.{digits}g}" for s, x in place.items())
    return f"{section}: {{{entries}}}"


class NoRealSolutionError(InconsistentError):
    """Stated equations, by number, that no real configuration satisfies."""

    def __init__(self, problem: Problem, numbers: Sequence[int]) -> None:
        super().__init__(problem)
        self.numbers = tuple(numbers)


class AmbiguousFactorError(InputError):
    """Raised for a product of ``factors`` of which the scene does not tell which one vanishes."""

    def __init__(self, constraint: str, equation: Equation, factors: Sequence[sp.Expr]) -> None:
        ways = [f"{written(factor)} = 0" for factor in factors]
        lines = "\n".join(f"{constraint}: {way}" for way in ways)
        super().__init__(
            Problem(
                f"constraint '{constraint}' holds in several ways: {', '.join(ways)}",
                equation.mark(),
                hint=f"write one of them:\n{lines}",
                rule="ambiguous-branch",
            )
        )
        self.factors = tuple(factors)

    def with_coordinates(self, lines: Sequence[str]) -> InputError:
        """Append lines to the hint of an error, the same for each proposal."""
        (problem,) = self.problems
        return InputError(replace(problem, hint="\n".join([problem.hint, *lines])))
