"""Routines as they are read from their Python: arguments, kinds of numbers, statements.

A kind is ``int`` (never negative), ``real``, ``bool``, ``reals`` (an array), ``integers`` (a table
of indices), ``closures``, ``contacts``, ``dynamics``, ``motion`` or ``relays`` (functions of the
scene), or ``none`` for routines without a result.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.program.lowered.routines.registry import ROUTINES

#: Annotation → kind.
_KINDS = {
    "int": "int",
    "float": "real",
    "bool": "bool",
    "Array": "reals",
    "Integers": "integers",
    "Closures": "closures",
    "Contacts": "contacts",
    "Dynamics": "dynamics",
    "Motion": "motion",
    "Relays": "relays",
    "None": "none",
}

#: Type of a value → kind.
_OF_VALUES: Mapping[type, str] = {bool: "bool", int: "int", float: "real"}

#: Kinds of arguments that stand for functions of the scene.
SCENE_FUNCTIONS = frozenset({"closures", "contacts", "dynamics", "motion", "relays"})

#: Functions of numbers that every language has.
NUMERIC = frozenset({"abs", "max", "min", "sqrt"})


@dataclass(frozen=True)
class Argument:
    """An argument of a routine; ``changed``: the routine stores numbers of that array."""

    name: str
    kind: str
    changed: bool


@dataclass(frozen=True)
class Signature:
    """A routine, as languages declare and call it.

    Attributes
    ----------
    name
        Its name.
    documentation
        Lines of its docstring.
    arguments
        Its arguments, in their order.
    result
        Kind of its result.
    names
        Local variable → kind, in the order in which they are assigned.
    statements
        The statements behind the docstring.
    lines
        Lines of the source, which hold the comments.
    constants
        Global names → their values, constants and other routines among them.
    """

    name: str
    documentation: tuple[str, ...]
    arguments: tuple[Argument, ...]
    result: str
    names: Mapping[str, str]
    statements: tuple[ast.stmt, ...]
    lines: tuple[str, ...]
    constants: Mapping[str, Any]

    def routine(self, name: str) -> Signature | None:
        """Return the routine of a name; None if the name is none."""
        value = self.constants.get(name)
        return signature_of(value) if inspect.isfunction(value) and name not in NUMERIC else None

    @property
    def called(self) -> tuple[Signature, ...]:
        """The routines that this one calls."""
        nodes = (node for step in self.statements for node in ast.walk(step))
        names = dict.fromkeys(node.id for node in nodes if isinstance(node, ast.Name))
        routines = map(self.routine, names)
        return tuple(routine for routine in routines if routine is not None)

    @property
    def evaluates(self) -> bool:
        """Tell whether the routine itself calls functions of the scene."""
        nodes = (node for step in self.statements for node in ast.walk(step))
        return any(isinstance(node, ast.Attribute) for node in nodes)

    def kind(self, node: ast.expr) -> str:
        """Return the kind of an expression."""
        known = {argument.name: argument.kind for argument in self.arguments}
        return _Kinds(self.constants, {**known, **self.names}).kind(node)


def routines_called(names: Iterable[str]) -> list[Signature]:
    """Return routines with those that they call, these first, by names that functions have."""
    ordered: dict[str, Signature] = {}
    for name in names:
        _collect(signature_of(ROUTINES[name]), ordered)
    return list(ordered.values())


def _collect(signature: Signature, ordered: dict[str, Signature]) -> None:
    for called in signature.called:
        _collect(called, ordered)
    ordered.setdefault(signature.name, signature)


def refused(node: ast.AST | None, reason: str) -> InternalError:
    """Return the internal error for a piece of a routine."""
    text = "" if node is None else f": {ast.unparse(node)}"
    return InternalError(Problem(f"a routine cannot be translated: {reason}{text}", rule="routine"))


@cache
def signature_of(function: Callable[..., Any]) -> Signature:
    """Read a routine.

    Raises
    ------
    InternalError
        It is outside the part of Python that is translated.
    """
    source = textwrap.dedent(inspect.getsource(function))
    (definition,) = ast.parse(source).body
    if not isinstance(definition, ast.FunctionDef) or definition.decorator_list:
        raise refused(None, "not a plain function")
    documentation = ast.get_docstring(definition)
    if documentation is None:
        raise refused(None, "no docstring")
    statements = tuple(definition.body[1:])
    constants = function.__globals__
    annotated = {a.arg: _annotated(a.annotation) for a in definition.args.args}
    kinds = _Kinds(constants, dict(annotated))
    for node in _in_order(statements):
        kinds.note(node)
    changed = set(_changed(statements, constants))
    return Signature(
        definition.name,
        tuple(documentation.splitlines()),
        tuple(Argument(name, kind, name in changed) for name, kind in annotated.items()),
        _annotated(definition.returns),
        {name: kind for name, kind in kinds.known.items() if name not in annotated},
        statements,
        tuple(source.splitlines()),
        constants,
    )


def _annotated(node: ast.expr | None) -> str:
    text = "" if node is None else ast.unparse(node)
    if text not in _KINDS:
        raise refused(node, "an annotation is missing or unknown")
    return _KINDS[text]


def _in_order(statements: tuple[ast.stmt, ...]) -> Iterator[ast.stmt]:
    for statement in statements:
        yield statement
        for part in ("body", "orelse"):
            yield from _in_order(tuple(getattr(statement, part, ())))


def _changed(statements: tuple[ast.stmt, ...], constants: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of arrays that statements store into, or hand to routines that do."""
    for statement in statements:
        for node in ast.walk(statement):
            if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store):
                yield ast.unparse(node.value)
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                yield ast.unparse(node.args[-1])
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                called = constants.get(node.func.id)
                if inspect.isfunction(called):
                    passed = zip(signature_of(called).arguments, node.args, strict=True)
                    yield from (ast.unparse(a) for argument, a in passed if argument.changed)


class _Kinds:
    """Kinds of names, as far as statements have assigned them."""

    def __init__(self, constants: Mapping[str, Any], known: dict[str, str]) -> None:
        self.constants = constants
        self.known = known

    def note(self, statement: ast.stmt) -> None:
        """Note the kind of the name that a statement assigns or counts with."""
        if isinstance(statement, ast.For) and isinstance(statement.target, ast.Name):
            self._assign(statement.target.id, "int", statement.target)
        elif isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            self._assign(statement.targets[0].id, self.kind(statement.value), statement)

    def _assign(self, name: str, kind: str, node: ast.AST) -> None:
        if self.known.setdefault(name, kind) != kind:
            raise refused(node, f"{self.known[name]} and {kind} under one name")

    def kind(self, node: ast.expr) -> str:
        """Return the kind of an expression."""
        if isinstance(node, ast.Constant):
            kind = _OF_VALUES.get(type(node.value))
            if kind is None:
                raise refused(node, "not a number")
            return kind
        if isinstance(node, ast.Name):
            value = self.constants.get(node.id)
            kind = self.known.get(node.id) or _OF_VALUES.get(type(value))
            if kind is None:
                raise refused(node, "unknown name")
            return kind
        if isinstance(node, ast.Subscript):
            return "int" if self.kind(node.value) == "integers" else "real"
        if isinstance(node, ast.BinOp):
            sides = {self.kind(node.left), self.kind(node.right)}
            return "int" if sides == {"int"} and not isinstance(node.op, ast.Div) else "real"
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            if self.kind(node.operand) != "real":
                raise refused(node, "an integer that is negative")
            return "real"
        if isinstance(node, ast.Compare | ast.BoolOp | ast.UnaryOp):
            return "bool"
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            return self._of_call(node, node.func.id)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            return "bool"
        raise refused(node, "unknown expression")

    def _of_call(self, node: ast.Call, name: str) -> str:
        if name in ("max", "min"):
            kinds = {self.kind(argument) for argument in node.args}
            if len(kinds) > 1:
                raise refused(node, "numbers of two kinds")
            return kinds.pop()
        if name in NUMERIC:
            return "real"
        called = self.constants.get(name)
        if not inspect.isfunction(called):
            raise refused(node, "no routine")
        return signature_of(called).result
