"""Lowered functions as functions of C.

Arrays of a function live in the workspace that it is handed. A structure of parameters cannot be
indexed, so the parameters that loops read are copied behind the values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from lagrange_cli.emit.c.target import EPSILON_NAME, CTarget, wrapped
from lagrange_cli.program.emitted_functions import CANONICAL_PARTS, INTERNAL_FUNCTIONS, SLOPES
from lagrange_cli.program.graph.operands import COUNTED, AffineIndex, Element, cell_named
from lagrange_cli.program.kinds import ProgramKind
from lagrange_cli.program.lowered.functions import (
    EPSILON,
    RESULTS,
    For,
    Function,
    Let,
    LocalArray,
    Remark,
    Require,
    RequireFinite,
    Scope,
    Solve,
    Step,
    Store,
    Total,
    loop_depth,
    names_read,
    numbers_read,
)
from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.program.lowered.workspace import given_size, solver_workspace
from lagrange_cli.program.printing import expression_text
from lagrange_cli.program.program import Program
from lagrange_cli.program.systems.loops import table_name

#: Counters of nested loops, outermost first.
_COUNTERS = "ijkl"


def function_text(function: str, program: Program, target: CTarget) -> str:
    """The definition of one function of the interface."""
    return _Writer(lowered(program, function), program, target).text()


def _sum(start: int, index: AffineIndex) -> str:
    """start + base + step*counter + …, without zeros, and without a place to break a line."""
    base = start + index.base
    text = str(base) if base else ""
    for step, counter in zip(index.steps, _COUNTERS, strict=False):
        if step:
            term = counter if abs(step) == 1 else f"{abs(step)}*{counter}"
            text += ("-" if step < 0 else "+" if text else "") + term
    return text or "0"


class _Writer:
    """Writes one function line by line."""

    def __init__(self, function: Function, program: Program, target: CTarget) -> None:
        self.function = function
        self.target = target
        self.names = target.names
        self.real = target.real.name
        self.given = given_size(program)
        self.reads = names_read(function.body)
        self.result = "dydt" if function.kind is ProgramKind.RIGHT_HAND_SIDE else RESULTS
        self.copied: list[int] = []
        if self.names.parameter_array is None:
            self.copied = [
                k
                for k in numbers_read(function.body, "p")
                if self.names.contact_from is None or k < self.names.contact_from
            ]
        arrays = [s for s in function.body if isinstance(s, LocalArray)]
        values = [s.start + s.shape[0] for s in arrays if s.name in ("w", "work")]
        self.copies_from = values[0] if values else solver_workspace(program)
        #: Array of the function → where it begins in the workspace.
        self.places: dict[str, int] = {"work": 0}
        self.dialect = replace(
            target.dialect,
            names={**target.dialect.names, EPSILON: f"{target.prefix}_{EPSILON_NAME}"},
            element=self._element,
        )

    def text(self) -> str:
        """Head, declarations and statements."""
        name = self.function.name
        inner = name in INTERNAL_FUNCTIONS | CANONICAL_PARTS or name in SLOPES
        static = "static " if inner or self.names.contact_from is not None else ""
        head = f"{static}int {self.target.prefix}_{name}({self.target.arguments(self.result)})"
        lines = [line for step in self.function.body for line in self._lines(step, 1)]
        body = [*self._opening(), *lines, "    return 0;"]
        return "\n".join([head, "{", *body, "}", ""])

    # -- declarations ------------------------------------------------------------

    def _opening(self) -> list[str]:
        """Counters, what is read from the arguments, and the arguments that are not used."""
        layout, depth = self.function.layout, loop_depth(self.function.body)
        lines = [f"    int {', '.join(_COUNTERS[:depth])};"] if depth else []
        named = [(name, k) for k, name in enumerate(layout.variables) if name in self.reads]
        lines += [f"    const {self.real} {self._name(s)} = y[{k}];" for s, k in named]
        unused = {
            "t": "t" not in self.reads,
            "y": not named and "y" not in self.reads,
            "u": not self._reads_any("u"),
            **self._unread(),
            "work": not self._uses_workspace(),
            "out": not self._stores(),
        }
        lines += [f"    (void){name};" for name, is_so in unused.items() if is_so]
        return lines + self._given() + self._arrays()

    def _reads_any(self, letter: str) -> bool:
        return letter in self.reads or any(
            name[0] == letter and name[1:].isdigit() for name in self.reads
        )

    def _unread(self) -> dict[str, bool]:
        """Tell which arguments that hold parameters are not used."""
        first = self.names.contact_from
        read = {cell_named(name).number for name in self.reads if name[0] == "p" and name != "p"}
        read |= set(numbers_read(self.function.body, "p"))
        if first is None:
            return {"p": not read}
        return {"p": not any(k < first for k in read), "contact": not any(k >= first for k in read)}

    def _uses_workspace(self) -> bool:
        arrays = any(isinstance(step, LocalArray) for step in self.function.body)
        return arrays or bool(self.copied) or bool(self.given)

    def _stores(self) -> bool:
        return any(isinstance(step, RequireFinite) for step in self.function.body)

    def _given(self) -> list[str]:
        """Call the functions that give accelerations and multipliers."""
        lines: list[str] = []
        if self.function.given_functions:
            lines.append(f"    {self.real} *const given = work;")
        place = "given"
        for k, name in enumerate(self.function.given_functions):
            passed = f"{self.names.passed}, work + {self.given}, {place}"
            declared = "" if k else "int "
            lines.append(f"    {declared}status = {self.target.prefix}_{name}({passed});")
            lines += ["    if (status != 0) {", "        return status;", "    }"]
            place = f"given + {self.function.layout.size}"
        return [*lines, f"    work += {self.given};"] if lines else []

    def _arrays(self) -> list[str]:
        """Declare the arrays in which loops find values and parameters."""
        values = [s for s in self.function.body if isinstance(s, LocalArray) and s.name == "w"]
        lines = [f"    {self.real} *const w = work + {array.start};" for array in values]
        if self.copied:
            lines.append(f"    {self.real} *const c = work + {self.copies_from};")
            lines += [f"    c[{k}] = {self._name(f'p{k}')};" for k in self.copied]
        return lines

    def _name(self, dummy: str) -> str:
        return self.dialect.names.get(dummy, dummy)

    # -- statements ----------------------------------------------------------------

    def _lines(self, step: Step, depth: int) -> list[str]:
        tab = "    " * depth
        if isinstance(step, Let):
            text = expression_text(step.operand, self.dialect)
            return wrapped(f"const {self.real} {step.name} = {text};", depth, 1)
        if isinstance(step, Store):
            text = expression_text(step.operand, self.dialect)
            return wrapped(f"{self._element(step.target)} = {text};", depth, 1)
        if isinstance(step, For):
            return self._loop(step, depth)
        if isinstance(step, Scope):
            return [f"{tab}{{", *self._all(step.body, depth + 1), f"{tab}}}"]
        if isinstance(step, Remark):
            return [f"{tab}/* {step.text} */"]
        if isinstance(step, LocalArray):
            self.places[step.name] = step.start
            return []
        if isinstance(step, Solve):
            return self._solve(step, depth)
        if isinstance(step, Total):
            call = f"{self.target.prefix}_total({step.count}, {self._pointer(step.start)})"
            return [f"{tab}(void){call};"]
        if isinstance(step, Require):
            value, bound = (expression_text(o, self.dialect) for o in (step.value, step.bound))
            return [f"{tab}if (!({value} > {bound})) {{", f"{tab}    return 1;", f"{tab}}}"]
        return self._finite(step)

    def _all(self, body: Sequence[Step], depth: int) -> list[str]:
        return [line for step in body for line in self._lines(step, depth)]

    def _loop(self, loop: For, depth: int) -> list[str]:
        tab, level = "    " * depth, self._level
        counter = _COUNTERS[level]
        self._level += 1
        body = self._all(loop.body, depth + 1)
        self._level = level
        count = _sum(0, loop.count)
        head = f"{tab}for ({counter} = 0; {counter} < {count}; ++{counter}) {{"
        return [head, *body, f"{tab}}}"]

    #: Number of loops around the statement.
    _level = 0

    def _finite(self, step: RequireFinite) -> list[str]:
        return [
            f"    for (i = 0; i < {step.count}; ++i) {{",
            f"        if (!isfinite({self.result}[i])) {{",
            "            return 2;",
            "        }",
            "    }",
        ]

    def _solve(self, step: Solve, depth: int) -> list[str]:
        tables = [table_name(self.target.prefix, table) for table in step.tables]
        arguments = [*map(str, step.sizes), *tables, *map(self._pointer, step.arrays)]
        call = f"{self.target.prefix}_solve_{step.routine}({', '.join(arguments)})"
        tab = "    " * depth
        return [
            *wrapped(f"if (!{call}) {{", depth, 2),
            f"{tab}    return 1;",
            f"{tab}}}",
        ]

    # -- elements --------------------------------------------------------------------

    def _pointer(self, element: Element) -> str:
        place = self.places[element.name] + element.index.base
        return f"work + {place}" if place else "work"

    def _element(self, element: Element) -> str:
        array, index = element.name, element.index
        if array == COUNTED:
            return f"({self.real})({_sum(0, index)})"
        name, start = self._array(array, index)
        place = _sum(start, index)
        if element.table is not None:
            looked = (
                f"{table_name(self.target.prefix, element.table)}[{_COUNTERS[self._level - 1]}]"
            )
            place = looked if place == "0" else f"{place}+{looked}"
        return f"{name}[{place}]"

    def _array(self, array: str, index: AffineIndex) -> tuple[str, int]:
        """Return the name of an array in C, and where it begins there."""
        first = self.names.contact_from
        if array == RESULTS:
            return self.result, 0
        if array == "p" and first is not None and index.base >= first:
            return "contact", -first
        if array == "p":
            return self.names.parameter_array or "c", 0
        if array in self.places and array != "w":
            return "work", self.places[array]
        return array, 0
