"""Lowered functions over symbols of JAX or CasADi, whose arrays nothing is stored in.

What a function stores becomes the entries of an array that it makes at once; loops are written out.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from lagrange_cli.emit.python.elements import LocalNames
from lagrange_cli.emit.python.layout import (
    TAB,
    WIDTH,
    Signature,
    assignment,
    defined,
    returned,
    unpacked,
)
from lagrange_cli.emit.python.names import SceneNames
from lagrange_cli.emit.python.vocabulary import CASADI, Vocabulary
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.program.graph.operands import (
    COUNTED,
    AffineIndex,
    Constant,
    Element,
    Operand,
    Variable,
    rebuilt,
)
from lagrange_cli.program.kinds import ProgramKind
from lagrange_cli.program.lowered.functions import (
    RESULTS,
    For,
    Function,
    Let,
    LocalArray,
    Require,
    Scope,
    Solve,
    Step,
    Store,
    names_read,
)
from lagrange_cli.program.printing import Dialect, double_literal, expression_text

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations


def refuse_further(style: str, further: Sequence[str]) -> None:
    """Refuse functions of derivatives, which the library finds by itself.

    Raises
    ------
    InputError
        Some are asked for.
    """
    if not further:
        return
    problem = f"--with {further[0]} is for --style numpy"
    if further[0] != "canonical":
        problem += f"; {style} differentiates by itself"
    raise InputError(Problem(problem, rule="usage"))


def refuse_branches(style: str, equations: Equations, *, loops: bool) -> None:
    """Refuse scenes that ask for branches, or whose programs are loops.

    Raises
    ------
    InputError
        The scene has contacts or recordings, or is written as loops.
    """
    if equations.system.contacts:
        raise _refused(style, "contacts open and close at events, which it cannot follow")
    if any(source.recording is not None for source in equations.system.inputs):
        raise _refused(style, "inputs from a file are looked up, which its expressions cannot do")
    if loops:
        raise _refused(style, "code of a system of this size is loops, which assign to arrays")


def _refused(style: str, reason: str) -> InputError:
    return InputError(
        Problem(
            f"style '{style}' does not suit this scene: {reason}",
            hint="--style numpy holds every scene",
            rule="style",
        )
    )


def traced_text(
    function: Function, signature: Signature, names: SceneNames, vocabulary: Vocabulary
) -> str:
    """Return the definition of a lowered function over symbols."""
    body = _Tracer(function, names, vocabulary).lines()
    return defined(signature, body, vocabulary)


def _unrolled(body: Sequence[Step], counters: tuple[int, ...] = ()) -> Iterator[Step]:
    """Yield the statements that loops execute, with the indices that they have then."""
    for step in body:
        if isinstance(step, For):
            for i in range(step.count.at(counters)):
                yield from _unrolled(step.body, (*counters, i))
        elif isinstance(step, Scope):
            yield from _unrolled(step.body, counters)
        elif isinstance(step, Store):
            target = _at(step.target, counters)
            assert isinstance(target, Element)
            yield Store(target, rebuilt(step.operand, lambda v: _at(v, counters)))
        else:
            yield step


def _at(variable: Variable, counters: tuple[int, ...]) -> Operand:
    if not isinstance(variable, Element):
        return variable
    index = variable.index.at(counters)
    return (
        Constant(index) if variable.name == COUNTED else Element(variable.name, AffineIndex(index))
    )


@dataclass
class _Tracer:
    """Prints one function."""

    function: Function
    names: SceneNames
    vocabulary: Vocabulary
    #: Array → index → text of the number.
    cells: dict[str, dict[int, str]] = field(default_factory=dict)
    #: Array → its shape.
    shapes: dict[str, tuple[int, ...]] = field(default_factory=dict)
    negative_from: int | None = None
    checked: bool = False

    def __post_init__(self) -> None:
        self.shapes[RESULTS] = self.function.shape
        self.dialect = Dialect(
            double_literal, self.vocabulary.functions, LocalNames(self.names), self._element
        )

    def lines(self) -> list[str]:
        """Return the lines of the body."""
        body = list(_unrolled(self.function.body))
        tests = [step for step in body if isinstance(step, Require)]
        lines = self._opening(body)
        for step in body:
            if isinstance(step, Require):
                lines += self._check(tests) if step is tests[0] else []
            else:
                lines += self._step(step)
        return lines + self._result()

    def _opening(self, body: Sequence[Step]) -> list[str]:
        reads, local = names_read(body), self.names.local
        listed = "{}" if self.vocabulary is not CASADI else "casadi.vertsplit({})"
        fields = [f"p{k}" for k in range(len(self.names.fields))]
        state = self.function.layout.variables
        driven = [f"u{k}" for k in range(self.function.driven)]
        lines: list[str] = []
        for dummies, source in (
            (fields, "p"),
            (state, listed.format("y")),
            (driven, listed.format("u(t, y, p) if callable(u) else u")),
        ):
            read = [any(dummy in reads for dummy in dummies)] * len(dummies)
            lines += unpacked([local[d] for d in dummies], read, source, str)
        return lines

    def _check(self, tests: Sequence[Require]) -> list[str]:
        """Name the condition under which the mass matrix is regular."""
        self.checked = True
        values = [f"{self._text(test.value)} > {self._text(test.bound)}" for test in tests]
        whole = values[0]
        for value in values[1:]:
            whole = f"{self._and}({whole}, {value})"
        return assignment("regular", whole)

    @property
    def _and(self) -> str:
        return "casadi.logic_and" if self.vocabulary is CASADI else "jnp.logical_and"

    def _step(self, step: Step) -> list[str]:
        if isinstance(step, Let):
            return assignment(self.names.free(step.name), self._text(step.operand))
        if isinstance(step, LocalArray):
            self.shapes[step.name] = step.shape
            self.cells[step.name], self.negative_from = {}, None
        if isinstance(step, Store):
            return self._store(step)
        if isinstance(step, Solve):
            return self._solve(step)
        return []

    def _store(self, store: Store) -> list[str]:
        array, index = store.target.name, store.target.index.base
        text, lines = self._text(store.operand), []
        compound = not isinstance(store.operand, Variable | Constant)
        read_again = array in ("w", "matrix", "band") or self.function.kind is ProgramKind.MATRIX
        if compound and read_again:
            name = self.names.free(f"{array[0]}{index}")
            lines, text = assignment(name, text), name
        elif compound and self.checked and array == RESULTS:
            choice = "casadi.if_else" if self.vocabulary is CASADI else "jnp.where"
            text = f"{choice}(regular, {text}, {self._nan})"
        self.cells.setdefault(array, {})[index] = text
        return lines

    @property
    def _nan(self) -> str:
        return 'float("nan")' if self.vocabulary is CASADI else "jnp.nan"

    def _solve(self, step: Solve) -> list[str]:
        matrix, vector = step.arrays[0].name, step.arrays[1].name
        size = sum(step.sizes[:1]) if step.routine == "banded" else self.shapes[matrix][0]
        rows = self._banded(step) if step.routine == "banded" else self._symmetric(matrix, size)
        right = [self.cells[vector].get(k, "0.0") for k in range(size)]
        if step.routine == "saddle":
            self.negative_from = step.sizes[0]
        definite = step.routine in ("definite", "banded") and self.vocabulary is CASADI
        called = "solve_definite" if definite else self._solver
        texts = [f"[{', '.join(row)}]" for row in rows]
        del self.cells[vector]
        name = self.names.free(vector)
        if self.vocabulary is CASADI:
            whole = f"casadi.blockcat([{', '.join(texts)}])"
            call = f"casadi.vertsplit({called}({whole}, casadi.vertcat({', '.join(right)})))"
        else:
            whole, listed = f"jnp.array([{', '.join(texts)}])", f"jnp.array([{', '.join(right)}])"
            call = f"{called}({whole}, {listed})"
        return assignment(name, call)

    @property
    def _solver(self) -> str:
        return "casadi.solve" if self.vocabulary is CASADI else "solve"

    def _symmetric(self, array: str, size: int) -> list[list[str]]:
        cells = self.cells[array]
        return [
            [cells.get(i * size + j, cells.get(j * size + i, "0.0")) for j in range(size)]
            for i in range(size)
        ]

    def _banded(self, step: Solve) -> list[list[str]]:
        m, width = step.sizes[0], step.sizes[1] + 1
        cells, rows = self.cells[step.arrays[0].name], [["0.0"] * m for _ in range(m)]
        for k in range(m):
            for j in range(min(width, m - k)):
                rows[k][k + j] = rows[k + j][k] = cells[k * width + j]
        return rows

    def _result(self) -> list[str]:
        """Return the results as an array."""
        shape, cells = self.function.shape, self.cells.get(RESULTS, {})
        if not shape:
            return returned(cells[0])
        size, is_casadi = shape[0], self.vocabulary is CASADI
        if len(shape) == 1:
            texts = [cells[k] for k in range(size)]
            opening, end = ("casadi.vertcat(", ")") if is_casadi else ("jnp.array([", "])")
        else:
            rows = self._symmetric(RESULTS, size)
            texts = [f"[{', '.join(row)}]" for row in rows]
            opening, end = ("casadi.blockcat([", "])") if is_casadi else ("jnp.array([", "])")
        line = f"{TAB}return {opening}{', '.join(texts)}{end}"
        if len(line) <= WIDTH:
            return [line]
        entries = [f"{2 * TAB}{text}," for text in texts]
        return [f"{TAB}return {opening}", *entries, f"{TAB}{end}"]

    def _text(self, operand: Operand) -> str:
        return expression_text(operand, self.dialect)

    def _element(self, element: Element) -> str:
        array, index = element.name, element.index.base
        known = self.cells.get(array, {}).get(index)
        if known is not None:
            return known
        is_negative = self.negative_from is not None and index >= self.negative_from
        sign = "-" if array == "vector" and is_negative else ""
        return f"{sign}{self.names.free(array)}[{index}]"
