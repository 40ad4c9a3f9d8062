"""Routines in a language, translated from their Python.

Routines (:mod:`lagrange_cli.program.lowered.routines`) are functions with annotated arguments and
a docstring, which becomes a comment. They may hold assignments, ``for`` over ``range`` or
``reversed(range(…))``, ``while``, ``if``, ``break``, ``return``, arithmetic, tests, numbers of
arrays, and calls of each other. A variable is assigned first in a block around all its uses;
another block may use the name again. All else is refused.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from fractions import Fraction

from lagrange_cli.emit.routines.signatures import (
    NUMERIC,
    SCENE_FUNCTIONS,
    Signature,
    refused,
    routines_called,
)
from lagrange_cli.emit.routines.syntax import Syntax

_OPERATORS: dict[type[ast.AST], str] = {
    ast.Add: " + ",
    ast.Sub: " - ",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.And: "and",
    ast.Or: "or",
}

#: How tightly expressions bind, from tests to single numbers.
_OR, _AND, _TEST, _SUM, _PRODUCT, _ATOM = range(6)


def routine_texts(language: Syntax) -> list[str]:
    """Return the routines that a language's functions call, those first that others call."""
    return [routine_text(r, language) for r in routines_called(sorted(language.routines))]


def routine_text(routine: Signature, language: Syntax) -> str:
    """Return a routine in a language.

    Raises
    ------
    InternalError
        It is outside the part of Python that is translated.
    """
    return "\n".join(_Writer(routine, language).lines())


def _positive(node: ast.expr) -> int:
    match node:
        case ast.Constant(value=int() as value) if value > 0:
            return value
    raise refused(node, "a step that is not stated")


class _Writer:
    """Writes one routine."""

    def __init__(self, signature: Signature, language: Syntax) -> None:
        self.signature = signature
        self.language = language
        #: Names that each of the blocks around a statement knows, outermost first.
        self.scopes: list[set[str]] = [{argument.name for argument in signature.arguments}]
        self.source = signature.lines

    def lines(self) -> list[str]:
        """Head, statements and end."""
        language, signature = self.language, self.signature
        body = self._indented(signature.statements)
        return [*language.routine_head(signature), *body, *language.routine_foot(signature)]

    # -- statements ----------------------------------------------------------------

    def _indented(self, body: Sequence[ast.stmt], names: Sequence[str] = ()) -> list[str]:
        """Return the lines of a block, which knows further names."""
        self.scopes.append(set(names))
        lines = [line for step in body for line in (*self._remarks(step), *self._lines(step, body))]
        self.scopes.pop()
        return [f"{self.language.tab}{line}" for line in lines]

    def _remarks(self, step: ast.stmt) -> Iterator[str]:
        """Yield the comments that stand right above a statement."""
        last = step.lineno - 1
        first = last
        while self.source[first - 1].lstrip().startswith("#"):
            first -= 1
        for line in self.source[first:last]:
            yield self.language.remark(line.strip().lstrip("# "))

    def _lines(self, step: ast.stmt, block: Sequence[ast.stmt]) -> list[str]:
        language = self.language
        match step:
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                before, text = self._value(value)
                return [*before, *language.broken(self._assigned(name, text, block))]
            case ast.Assign(targets=[ast.Subscript() as target], value=value):
                text = self.text(value)
                return language.broken(language.store(self.text(target), text))
            case ast.AugAssign():
                return language.broken(self._augmented(step))
            case ast.For():
                return self._loop(step)
            case ast.While(test=test, orelse=[]):
                begins, ends = language.repeated(self.text(test))
                return [begins, *self._indented(step.body), ends]
            case ast.If():
                return self._branches(step)
            case ast.Break():
                return [language.leaving]
            case ast.Return(value=None):
                return language.returned(None)
            case ast.Return(value=ast.expr() as value):
                if self.signature.kind(value) != self.signature.result:
                    raise refused(step, "a result of another kind")
                before, text = self._value(value)
                return [*before, *language.returned(text)]
            case ast.Expr(value=ast.Call() as call):
                before, text = self._value(call)
                return [*before, *language.called_alone(text)]
        raise refused(step, "unknown statement")

    def _assigned(self, name: str, text: str, block: Sequence[ast.stmt]) -> str:
        """Assign a variable, or declare it for the block where it is new."""
        if any(name in scope for scope in self.scopes):
            return self.language.store(name, text)
        self.scopes[-1].add(name)
        times = sum(
            isinstance(node, ast.Name) and node.id == name and isinstance(node.ctx, ast.Store)
            for step in block
            for node in ast.walk(step)
        )
        return self.language.declared(name, self.signature.names[name], text, fixed=times == 1)

    def _augmented(self, step: ast.AugAssign) -> str:
        target = self.text(step.target)
        if not self.language.augments:
            whole = ast.BinOp(step.target, step.op, step.value)
            return self.language.store(target, self.text(whole))
        operator = self._operator(step.op, step).strip()
        return self.language.augmented(target, operator, self._mixed(step.target, step.value))

    def _mixed(self, target: ast.expr, value: ast.expr) -> str:
        """Return a number, as a real one beside a real one."""
        return self._at_least(_OR, value, real=self.signature.kind(target) == "real")

    def _loop(self, step: ast.For) -> list[str]:
        match step:
            case ast.For(
                target=ast.Name(id=counter),
                iter=ast.Call(func=ast.Name(id="reversed"), args=[ast.Call() as bounds]),
                orelse=[],
            ):
                down = True
            case ast.For(target=ast.Name(id=counter), iter=ast.Call() as bounds, orelse=[]):
                down = False
            case _:
                raise refused(step, "a loop without a range")
        if not (isinstance(bounds.func, ast.Name) and bounds.func.id == "range"):
            raise refused(step, "a loop without a range")
        start, stop, step_by = "0", bounds.args[0], 1
        if len(bounds.args) > 1:
            start, stop = self.text(bounds.args[0]), bounds.args[1]
        if len(bounds.args) > 2:
            step_by = _positive(bounds.args[2])
        begins, ends = self.language.counting(
            counter, start, self.text(stop), step=step_by, down=down
        )
        return [begins, *self._indented(step.body, [counter]), ends]

    def _branches(self, step: ast.If) -> list[str]:
        language = self.language
        before, test = self._value(step.test)
        lines = [*before, *language.broken(language.branch(test)), *self._indented(step.body)]
        while len(step.orelse) == 1 and isinstance(step.orelse[0], ast.If):
            step = step.orelse[0]
            lines += [language.other_branch(self.text(step.test)), *self._indented(step.body)]
        if step.orelse:
            lines += [language.otherwise, *self._indented(step.orelse)]
        return [*lines, language.ended]

    # -- expressions ---------------------------------------------------------------

    def _value(self, node: ast.expr) -> tuple[list[str], str]:
        """Return an expression, and the lines before it; a call of a routine may need some."""
        match node:
            case ast.Call(func=ast.Name(id=name)) if name not in NUMERIC:
                return self._called(node, name)
            case ast.Call(func=ast.Attribute(value=ast.Name() as owner, attr=name)):
                kind, arguments = self.signature.kind(owner), [self.text(a) for a in node.args]
                return self.language.evaluated(kind, name, arguments)
            case ast.UnaryOp(op=ast.Not(), operand=ast.Call() as call):
                before, text = self._value(call)
                return before, self.language.words["not"] + text
        return [], self.text(node)

    def _called(self, node: ast.Call, name: str) -> tuple[list[str], str]:
        routine = self.signature.routine(name)
        if routine is None:
            raise refused(node, "no routine")
        kinds = [argument.kind for argument in routine.arguments]
        if [self.signature.kind(argument) for argument in node.args] != kinds:
            raise refused(node, "arguments of other kinds")
        arguments = [text for argument in node.args for text in self._passed(argument)]
        return self.language.called(routine, arguments)

    def _passed(self, argument: ast.expr) -> list[str]:
        """Return an argument, or those by which functions of the scene are called."""
        kind = self.signature.kind(argument)
        return self.language.handed(kind) if kind in SCENE_FUNCTIONS else [self.text(argument)]

    def text(self, node: ast.expr) -> str:
        """Return an expression."""
        return self._format(node)[0]

    def _at_least(self, binding: int, node: ast.expr, *, real: bool = False) -> str:
        """Return an expression, in parentheses where it binds more loosely."""
        text, precedence = self._format(node)
        if real and self.signature.kind(node) == "int":
            return self.language.counted(text if precedence == _ATOM else f"({text})")
        return text if precedence >= binding else f"({text})"

    def _format(self, node: ast.expr) -> tuple[str, int]:
        words = self.language.words
        match node:
            case ast.Constant(value=bool() as value):
                return words[str(value)], _ATOM
            case ast.Constant(value=int() as value):
                return str(value), _ATOM
            case ast.Constant(value=float() as value):
                return self.language.number(Fraction(value)), _ATOM
            case ast.Name(id=name):
                return self._name(node, name), _ATOM
            case ast.Subscript(value=ast.Name(id=name), slice=index):
                return self.language.element_text(name, self._place(index)), _ATOM
            case ast.BinOp():
                return self._arithmetic(node)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"-{self._at_least(_ATOM, operand)}", _TEST
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return words["not"] + self._at_least(_ATOM, operand), _ATOM
            case ast.BoolOp():
                binding = _AND if isinstance(node.op, ast.And) else _OR
                word = f" {words[_OPERATORS[type(node.op)]]} "
                return word.join(self._at_least(binding + 1, v) for v in node.values), binding
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                real = "real" in (self.signature.kind(left), self.signature.kind(right))
                before, after = (self._at_least(_SUM, x, real=real) for x in (left, right))
                operator = self._operator(op, node)
                return self.language.compared(before, operator, after, real=real), _TEST
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self._call(node, name, arguments), _ATOM
        raise refused(node, "unknown expression")

    def _arithmetic(self, node: ast.BinOp) -> tuple[str, int]:
        if isinstance(node.op, ast.FloorDiv):
            parts = (self._at_least(_ATOM, part) for part in (node.left, node.right))
            return self.language.whole_quotient(*parts), _PRODUCT
        binding = _SUM if isinstance(node.op, ast.Add | ast.Sub) else _PRODUCT
        real = self.signature.kind(node) == "real"
        left = self._at_least(binding, node.left, real=real)
        right = self._at_least(binding + 1, node.right, real=real)
        return f"{left}{self._operator(node.op, node)}{right}", binding

    def _operator(self, operator: ast.AST, node: ast.AST) -> str:
        if type(operator) not in _OPERATORS:
            raise refused(node, "unknown operator")
        return _OPERATORS[type(operator)]

    def _name(self, node: ast.Name, name: str) -> str:
        if any(name in scope for scope in self.scopes):
            return name
        if name in self.signature.names:
            raise refused(node, "a variable outside the block that assigns it first")
        value = self.signature.constants.get(name)
        if isinstance(value, int):
            return str(value)
        if isinstance(value, float):
            return self.language.constant(name, value)
        raise refused(node, "unknown name")

    def _place(self, index: ast.expr) -> str:
        """Return an index, counted from the first one of the language."""
        first = self.language.first
        if not first:
            return self.text(index)
        match index:
            case ast.Constant(value=int() as value):
                return str(value + first)
            case ast.BinOp(left=left, op=ast.Add(), right=ast.Constant(value=int() as value)):
                return f"{self.text(left)} + {value + first}"
        return f"{self.text(index)} + {first}"

    def _call(self, node: ast.Call, name: str, arguments: Sequence[ast.expr]) -> str:
        if name in NUMERIC:
            passed = ", ".join(map(self.text, arguments))
            callee = self.language.callee(name)
            if self.signature.kind(node) == "int":
                callee = self.language.whole.get(name, callee)
            else:
                self.language.numeric.add(name)
            return f"{callee}({passed})"
        before, text = self._called(node, name)
        if before:
            raise refused(node, "a call within an expression")
        return text
