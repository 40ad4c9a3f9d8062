"""Lowered functions as functions of NumPy: one text for one state and for many.

States stand in the first axis of ``y``, many of them beside each other in a second one, so that
broadcasting alone serves both. Loops whose repetitions are independent are slices and index
arrays; where loops are compiled (Numba) they stay loops, as all others do.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

from lagrange_cli.emit.python.elements import NumberPrinter
from lagrange_cli.emit.python.layout import (
    TAB,
    WIDTH,
    Signature,
    Tables,
    assignment,
    defined,
    joined,
    passed_on,
    returned,
    row_of,
    unpacked,
)
from lagrange_cli.emit.python.names import SceneNames
from lagrange_cli.emit.python.simplified import (
    cleared,
    elements_in,
    groups,
    is_independent,
    is_zero,
    with_last_inlined,
    without_aliases,
)
from lagrange_cli.emit.python.vocabulary import Vocabulary
from lagrange_cli.program.graph.operands import Constant, Element, Variable
from lagrange_cli.program.kinds import ProgramKind
from lagrange_cli.program.lowered.functions import (
    RESULTS,
    For,
    Function,
    Let,
    LocalArray,
    Remark,
    Require,
    Solve,
    Step,
    Store,
    Total,
    names_read,
    steps_in,
)

#: Stores of texts up to this length share a line.
_SHORT = 28


def function_text(
    function: Function,
    signature: Signature,
    names: SceneNames,
    vocabulary: Vocabulary,
    tables: Tables,
) -> str:
    """Return the definition of a lowered function."""
    body = _Printer(function, signature, names, vocabulary, tables).lines()
    return defined(signature, body, vocabulary)


class _Printer:
    """Prints one function line by line."""

    def __init__(
        self,
        function: Function,
        signature: Signature,
        names: SceneNames,
        vocabulary: Vocabulary,
        tables: Tables,
    ) -> None:
        self.function = function
        self.signature = signature
        self.names = names
        self.vocabulary = vocabulary
        self.tables = tables
        self.result = "dydt" if function.kind is ProgramKind.RIGHT_HAND_SIDE else "out"
        self.numbers = NumberPrinter(self.result, names, vocabulary, tables)
        self.numbers.shapes[RESULTS] = function.shape or (1,)
        self.zeroed: set[str] = {"matrix"}
        body = [s for s in without_aliases(function.body, {}) if not self._is_allocation(s)]
        self.body = with_last_inlined(body)
        loops = [step for step in steps_in(self.body) if isinstance(step, For)]
        self.numbers.flat |= {e.name for loop in loops for e in elements_in(loop.body)}
        stores = [step for step in self.body if isinstance(step, Store)]
        self.zeroed |= {s.target.name for s in stores if is_zero(s.operand)} - {"w", "work"}
        solves = [step for step in steps_in(self.body) if isinstance(step, Solve)]
        #: Arrays that are stored in or read.
        self.used = {e.name for e in elements_in(self.body)}
        self.used |= {e.name for solve in solves for e in solve.arrays[:2]}
        self.allocated = False
        self.checked = False

    def _is_allocation(self, step: Step) -> bool:
        """Tell whether a loop sets a whole array to zero, which its allocation does."""
        if isinstance(step, LocalArray):
            self.numbers.shapes[step.name] = step.shape
        target = cleared(step)
        if target is None or target.index.base or target.name not in self.numbers.shapes:
            return False
        assert isinstance(step, For)
        whole = step.count.base == prod(self.numbers.shapes[target.name])
        self.zeroed |= {target.name} if whole else set()
        return whole

    def lines(self) -> list[str]:
        """Return the lines of the body."""
        steps = [line for group in groups(self.body) for line in self._group(group, TAB)]
        return [*self._opening(), *steps, *self._closing()]

    # -- before and after the statements -----------------------------------------------

    def _opening(self) -> list[str]:
        """Give names to what is handed to the function."""
        reads, names = names_read(self.body), self.names
        lines = [TAB + line for line in self.signature.opening]
        fields = [f"p{k}" for k in range(len(names.fields))]
        state = self.function.layout.variables
        driven = [f"u{k}" for k in range(self.function.driven)]
        flags = [f"p{len(fields) + k}" for k in range(len(names.flags))]
        after = len(fields) + len(flags)
        targets = [f"p{after + k}" for k in range(len(flags))]
        inputs = f"u({passed_on('t, y, p')})"
        for dummies, source, one in (
            (fields, "p", "p[{}]".format),
            (state, "y", "y[{}]".format),
            (driven, inputs, f"{inputs}[{{}}]".format),
            (flags, "mode", "mode[{}]".format),
            (targets, "targets", "targets[{}]".format),
        ):
            named = [names.local[dummy] for dummy in dummies]
            lines += unpacked(named, [dummy in reads for dummy in dummies], source, one)
        comments = [f"{TAB}# {text}" for text in self.signature.equations]
        return [*lines, *self._given(), *self._rows(), *comments]

    def _rows(self) -> list[str]:
        """Make arrays of what loops find by index, with an axis of states as ``y`` has it."""
        elements = [e for e in elements_in(self.body) if e.name in ("p", "u")]
        read = {self.numbers.array(e)[0] for e in elements}
        if self.vocabulary.compiled:
            return [f"{TAB}u = u(t, y, p)"] if "u" in read else []
        sources = {"p": "*p", "u": "*u(t, y, p)", "mode": "*mode", "targets": "*targets"}
        return [
            f"{TAB}{name} = np.array(np.broadcast_arrays({source}, y[0]))"
            for name, source in sorted(sources.items(), reverse=True)
            if name in read
        ]

    def _given(self) -> list[str]:
        """Call the functions that give accelerations and multipliers."""
        labels = [name.removeprefix("contact_") for name in self.function.given_functions]
        calls = [f"{label}({self.signature.passed})" for label in labels]
        if not calls:
            return []
        text = calls[0] if len(calls) == 1 else f"np.concatenate(({', '.join(calls)}))"
        return [f"{TAB}{self.numbers.local('given')} = {text}"]

    def _closing(self) -> list[str]:
        """Return the results, unless the last statement does."""
        shape = self.function.shape
        if not shape and not self.numbers.flat:
            return []
        if not self.allocated:
            return [f"{TAB}return {self._new(RESULTS)}"]
        whole = f"{self.result}[0]" if not shape else self.result
        if len(shape) > 1 and RESULTS in self.numbers.flat:
            whole = f"{self.result}.reshape({shape} + y.shape[1:])"
        return [f"{TAB}return {whole}"]

    def _allocation(self, tab: str) -> list[str]:
        """Make the array of the results."""
        self.allocated = True
        return [f"{tab}{self.result} = {self._new(RESULTS)}"]

    def _new(self, array: str) -> str:
        """Write a new array, with the axis of states as ``y`` has it."""
        shape, size = self.numbers.shapes[array], self.function.layout.size
        made = "zeros" if array in self.zeroed else "empty"
        if array in self.numbers.flat:
            shape = (prod(shape),)
        if array == RESULTS and shape == (size,) and size:
            return f"np.{made}(y.shape)"
        return f"np.{made}({shape} + y.shape[1:])"

    # -- statements --------------------------------------------------------------------

    def _group(self, group: Sequence[Step], tab: str) -> list[str]:
        """Print statements of one kind that follow each other, or one statement."""
        first = group[0]
        stores = [step for step in steps_in(group) if isinstance(step, Store)]
        if isinstance(first, For) and stores and all(map(self._is_implied, stores)):
            return []
        stored = any(s.target.name == RESULTS and not self._is_implied(s) for s in stores)
        if isinstance(first, Store) and not self.function.shape and not self.numbers.flat:
            (store,) = group
            assert isinstance(store, Store)
            text = self.numbers.text(store.operand)
            constant = isinstance(store.operand, Constant)
            return returned(f"np.full(y.shape[1:], {text})" if constant else text, tab)
        lines = self._allocation(tab) if stored and not self.allocated else []
        if isinstance(first, Store):
            return [*lines, *self._stores(group, tab)]
        if isinstance(first, Require):
            return self._check(group, tab) if self._is_checked() else []
        return [*lines, *self._step(first, tab)]

    def _step(self, step: Step, tab: str) -> list[str]:
        if isinstance(step, Let):
            return assignment(self.numbers.local(step.name), self.numbers.text(step.operand), tab)
        if isinstance(step, For):
            return self._loop(step, tab)
        if isinstance(step, Remark):
            return [f"{tab}# {step.text}"]
        if isinstance(step, LocalArray):
            self.numbers.shapes[step.name], self.numbers.negative_from = step.shape, None
            if step.name not in self.used:
                return []  # scratch space of a solver
            return [f"{tab}{self.numbers.local(step.name)} = {self._new(step.name)}"]
        if isinstance(step, Solve):
            return self._solve(step, tab)
        if isinstance(step, Total):
            name, (start, end) = self.numbers.local(step.start.name), _range(step.start, step.count)
            return [f"{tab}{name}[{start}] = {name}[{start}:{end}].sum(axis=0)"]
        return []  # what is not finite is so in the results

    def _is_checked(self) -> bool:
        """Tell whether results are computed that nothing else makes NaN."""
        tests = [step for step in self.body if isinstance(step, Require)]
        stores = [step for step in self.body if isinstance(step, Store)]
        computed = any(
            store.target.name == RESULTS and not isinstance(store.operand, Variable | Constant)
            for store in stores
        )
        return computed and any(not isinstance(test.value, Constant) for test in tests)

    def _check(self, tests: Sequence[Step], tab: str) -> list[str]:
        """Compute what makes results NaN unless the mass matrix is regular."""
        conditions = [
            f"{self.numbers.text(test.value)} > {self.numbers.text(test.bound)}"
            for test in tests
            if isinstance(test, Require) and not isinstance(test.value, Constant)
        ]
        conditions = list(dict.fromkeys(conditions))
        whole = " & ".join(f"({c})" for c in conditions) if len(conditions) > 1 else conditions[0]
        self.checked = True
        regular, check = self.numbers.local("regular"), self.numbers.local("check")
        return [
            *assignment(regular, whole, tab),
            f"{tab}{check} = np.sqrt({regular} - 1.0)  # 0, or NaN for a singular mass matrix",
        ]

    def _loop(self, loop: For, tab: str) -> list[str]:
        if not self.vocabulary.compiled and (loop.independent or is_independent(loop)):
            self.numbers.members = loop.count.at(())
            lines = [line for step in loop.body for line in self._member(step, tab)]
            self.numbers.members = None
            return lines
        around, counter = self.numbers.counters, self.names.counters[len(self.numbers.counters)]
        head = f"{tab}for {counter} in range({self.numbers.index_sum(loop.count)}):"
        self.numbers.counters = (*around, counter)
        lines = [line for step in loop.body for line in self._member(step, tab + TAB)]
        self.numbers.counters = around
        return [head, *lines]

    def _member(self, step: Step, tab: str) -> list[str]:
        """Print a statement of a loop."""
        if isinstance(step, Store):
            return assignment(
                self.numbers.element(step.target), self.numbers.text(step.operand), tab
            )
        return self._step(step, tab)

    def _solve(self, step: Solve, tab: str) -> list[str]:
        matrix, vector, *_ = step.arrays
        left, right = self.numbers.local(matrix.name), self.numbers.local(vector.name)
        if step.routine == "sparse":
            tables = map(self.tables.name, step.tables)
            first, second = f"{left}[{matrix.index.base}:]", f"{right}[{vector.index.base}:]"
            call = f"solve_sparse({step.sizes[0]}, {', '.join(tables)}, {first}, {second})"
            return [f"{tab}{call}"]
        if step.routine == "banded":
            m, width = step.sizes[0], step.sizes[1] + 1
            if matrix.name != vector.name:
                left = self._shaped(matrix.name)
                return [f"{tab}{right} = solve_banded({left}, {right})"]
            start, end = _range(matrix, m * width)
            band = f"{left}[{start}:{end}].reshape(({m}, {width}) + y.shape[1:])"
            start, end = _range(vector, m)
            right = f"{right}[{start}:{end}]"
            return [f"{tab}{right} = solve_banded({band}, {right})"]
        if step.routine == "saddle":
            self.numbers.negative_from = step.sizes[0]
        left, right = (self._shaped(array) for array in (matrix.name, vector.name))
        call = f"solve({left}, {right})"
        if vector.name in self.numbers.flat and len(self.numbers.shapes[vector.name]) > 1:
            call += ".reshape((-1,) + y.shape[1:])"
        return assignment(self.numbers.local(vector.name), call, tab)

    def _shaped(self, array: str) -> str:
        """Write an array with its rows and columns."""
        name, shape = self.numbers.local(array), self.numbers.shapes[array]
        if array in self.numbers.flat and len(shape) > 1:
            return f"{name}.reshape({shape} + y.shape[1:])"
        return name

    # -- stores --------------------------------------------------------------------------

    def _stores(self, group: Sequence[Step], tab: str) -> list[str]:
        """Print stores; neighbouring copies as slices, short ones on one line."""
        stores = [step for step in group if isinstance(step, Store) and not self._is_implied(step)]
        lines: list[str] = []
        short: list[tuple[str, str]] = []
        while stores:
            size = self._copies(stores)
            if size > 1:
                target, text = self._slices(stores[0], size)
            else:
                target, text = self._target(stores[0].target), self._stored(stores[0])
            del stores[:size]
            is_short = len(text) <= _SHORT and " = " not in target and size == 1
            line = joined([*short, (target, text)], tab)
            array = target.partition("[")[0]
            together = is_short and bool(short) and row_of(target) == row_of(short[-1][0])
            together = together and f"{array}[" not in text
            if short and not (together and len(line) <= WIDTH):
                lines.append(joined(short, tab))
                short = []
            if is_short:
                short.append((target, text))
            else:
                lines += assignment(target, text, tab)
        return lines + ([joined(short, tab)] if short else [])

    def _is_implied(self, store: Store) -> bool:
        """Tell whether a number is stored by allocation, or with the one across the diagonal."""
        if is_zero(store.operand) and store.target.name in self.zeroed:
            return True
        if not self._is_mirrored(store.target.name) or store.target.name in self.numbers.flat:
            return False
        place, operand = store.target.index.base, store.operand
        row, column = divmod(place, self.numbers.shapes[store.target.name][1])
        return row > column and isinstance(operand, Element) and operand.name == store.target.name

    def _is_mirrored(self, array: str) -> bool:
        """Tell whether the lower triangle of an array repeats the upper one."""
        return array == "matrix" or (array == RESULTS and self.function.kind is ProgramKind.MATRIX)

    def _target(self, target: Element) -> str:
        """Write the number that is stored, in a symmetric matrix of results both numbers."""
        text = self.numbers.element(target)
        if target.name != RESULTS or not self._is_mirrored(RESULTS) or RESULTS in self.numbers.flat:
            return text
        row, column = divmod(target.index.base, self.numbers.shapes[RESULTS][1])
        return text if row == column else f"{text} = {self.result}[{column}, {row}]"

    def _stored(self, store: Store) -> str:
        text = self.numbers.text(store.operand)
        copied = isinstance(store.operand, Variable)
        if not self.checked or store.target.name != RESULTS or copied:
            return text
        return f"{text} + {self.numbers.local('check')}"

    def _copies(self, stores: Sequence[Store]) -> int:
        """Count the stores from the first on that copy neighbours to neighbours."""
        size = 1
        start = self._copy(stores[0])
        while start is not None and size < len(stores):
            following = self._copy(stores[size])
            here = (start[0], start[1] + size, start[2], start[3] + size)
            signs = {self.numbers.is_negative(*copy[2:]) for copy in (start, here)}
            if following != here or len(signs) > 1:
                break
            size += 1
        return size

    def _copy(self, store: Store) -> tuple[str, int, str, int] | None:
        """Return array and index of the target and of the number that is copied."""
        target, operand = store.target, store.operand
        if (
            target.name not in self.numbers.flat
            and len(self.numbers.shapes.get(target.name, ())) > 1
        ):
            return None
        if isinstance(operand, Element) and operand.table is None:
            if (
                operand.name not in self.numbers.flat
                and len(self.numbers.shapes.get(operand.name, ())) > 1
            ):
                return None
            return target.name, target.index.base, operand.name, operand.index.base
        layout = self.function.layout
        if isinstance(operand, Variable) and operand.name in layout.variables:
            return target.name, target.index.base, "y", layout.variables.index(operand.name)
        return None

    def _slices(self, store: Store, size: int) -> tuple[str, str]:
        copy = self._copy(store)
        assert copy is not None
        target, to, source, start = copy
        sign = "-" if self.numbers.is_negative(source, start) else ""
        size_of_state = self.function.layout.size
        length = size_of_state if source == "y" else self.numbers.length(source)
        left = f"{self.numbers.local(target)}[{_slice(to, size, self.numbers.length(target))}]"
        return left, f"{sign}{self.numbers.local(source)}[{_slice(start, size, length)}]"


def _range(first: Element, count: int) -> tuple[int, int]:
    return first.index.base, first.index.base + count


def _slice(start: int, size: int, length: int) -> str:
    end = start + size
    return f"{start or ''}:{'' if end == length else end}"
