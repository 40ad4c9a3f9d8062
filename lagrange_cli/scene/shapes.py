"""Expected shapes: a mapping, a list, a name, a text, an expression at a node.

Every function takes the node and a phrase for what it is (``parameter 'a'``),
records what was found and what was expected where they differ, and then
returns None.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from lagrange_cli.errors import Mark
from lagrange_cli.scene.expression import RESERVED, Equation, Expression, Number
from lagrange_cli.scene.grammar import parse_equation, parse_expression
from lagrange_cli.scene.problems import Problems, shown, suggestion
from lagrange_cli.scene.source import Mapping, Scalar, Sequence, SourceNode
from lagrange_cli.scene.tokens import IDENTIFIER

__all__ = ["Reading", "is_indexed"]

_BOOLEANS = {
    text: text.lower() == "true" for text in ("true", "True", "TRUE", "false", "False", "FALSE")
}
_BASED = re.compile(r"0o([0-7]+)|0x([0-9a-fA-F]+)")
_INTEGER = re.compile(r"[-+]?[0-9]{1,9}")
_INDEXED = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\[")
_LONGEST_NAME = 100


@dataclass(slots=True)
class Reading:
    """A scene being read: the problems so far and the sections read so far."""

    file: str
    problems: Problems = field(default_factory=Problems)
    values: dict[str, Any] = field(default_factory=dict)
    #: Expressions given to helpers, each with what it is part of.
    parts: list[tuple[Expression, str]] = field(default_factory=list)
    _bodies: frozenset[str] | None = None

    @property
    def bodies(self) -> frozenset[str]:
        """The names of particles and points, once these sections have been read."""
        if self._bodies is None:
            sections = (self.values.get("particles", ()), self.values.get("points", ()))
            self._bodies = frozenset(body.name for section in sections for body in section)
        return self._bodies

    def expected(self, wanted: str, what: str, node: SourceNode, hint: str = "") -> None:
        """Record that a node is not what was wanted."""
        self.problems.add(
            f"expected {wanted} for {what}, found {_described(node)}",
            node.mark,
            hint=hint,
            rule="shape",
        )

    def unsupported(self, what: str, mark: Mark) -> None:
        """Record the use of what the language has but this version does not read."""
        self.problems.add(f"{what} not supported yet", mark, rule="unsupported")

    def mapping(self, node: SourceNode, what: str, wanted: str = "a mapping") -> Mapping | None:
        if isinstance(node, Mapping):
            return node
        self.expected(wanted, what, node)
        return None

    def items(self, node: SourceNode, what: str, wanted: str = "a list") -> Sequence | None:
        if isinstance(node, Sequence):
            return node
        self.expected(wanted, what, node)
        return None

    def text(self, node: SourceNode, what: str) -> str | None:
        """Any scalar, as its text."""
        if isinstance(node, Scalar):
            return node.text
        self.expected("a text", what, node)
        return None

    def boolean(self, node: SourceNode, what: str) -> bool | None:
        if isinstance(node, Scalar) and node.plain and node.text in _BOOLEANS:
            return _BOOLEANS[node.text]
        self.expected("true or false", what, node)
        return None

    def integer(self, node: SourceNode, what: str) -> int | None:
        if isinstance(node, Scalar) and node.plain and _INTEGER.fullmatch(node.text):
            return int(node.text)
        self.expected("an integer", what, node)
        return None

    def expression(self, node: SourceNode, what: str) -> Expression | None:
        scalar = self._expression_text(node, "an expression", what)
        if scalar is None:
            return None
        based = _BASED.fullmatch(scalar.text) if scalar.plain else None
        if based and len(scalar.text) <= _LONGEST_NAME:
            value = int(based[1], 8) if based[1] else int(based[2], 16)
            number = Number(Fraction(value), str(value), (0, len(str(value))))
            return Expression(number, str(value), scalar.mark, exact=False)
        with self.problems.collect():
            return parse_expression(scalar.text, scalar.mark, exact=scalar.exact)
        return None

    def part(self, node: SourceNode, key: str, what: str) -> Expression | None:
        """An expression that is given to the helper of ``what`` at ``key``."""
        expression = self.expression(node, f"'{key}' of {what}")
        if expression:
            self.parts.append((expression, what))
        return expression

    def equation(self, node: SourceNode, what: str) -> Equation | None:
        scalar = self._expression_text(node, "an equation", what)
        if scalar is None:
            return None
        with self.problems.collect():
            return parse_equation(scalar.text, scalar.mark, exact=scalar.exact)
        return None

    def _expression_text(self, node: SourceNode, wanted: str, what: str) -> Scalar | None:
        if isinstance(node, Scalar) and not (node.plain and node.text in _BOOLEANS):
            return node
        split = isinstance(node, Mapping) and wanted == "an expression"
        hint = "quote an expression that holds ': ' or begins with '{'" if split else ""
        self.expected(wanted, what, node, hint)
        return None

    def fields(
        self,
        node: Mapping,
        what: str,
        allowed: Collection[str],
        *,
        later: Collection[str] = (),
        required: Collection[str] = (),
    ) -> dict[str, SourceNode]:
        """The entries of a mapping whose keys are fixed."""
        found: dict[str, SourceNode] = {}
        for key, value in node.entries:
            if key.text in allowed:
                found[key.text] = value
            elif key.text in later:
                self.unsupported(f"'{key.text}' in {what} is", key.mark)
            else:
                self.unknown_key(key, what, allowed)
        for name in required:
            if name not in found:
                self.problems.add(f"{what} has no '{name}'", node.mark, rule="missing")
        return found

    def unknown_key(self, key: Scalar, what: str, allowed: Collection[str]) -> None:
        hint = suggestion(key.text, allowed, f"known are {', '.join(allowed)}")
        self.problems.add(
            f"unknown key {shown(key.text)} in {what}", key.mark, hint=hint, rule="unknown-key"
        )

    def named(
        self, node: SourceNode, section: str, *, symbols: bool
    ) -> Iterator[tuple[Scalar, SourceNode]]:
        """The entries of a section whose keys are names that the user chooses.

        ``symbols``: the names stand in expressions, so that reserved names are
        refused.
        """
        mapping = self.mapping(node, f"'{section}'", "a mapping of names")
        for key, value in mapping.entries if mapping else ():
            if self.is_name(key, section, symbols=symbols):
                yield key, value

    def is_name(self, key: Scalar, section: str, *, symbols: bool) -> bool:
        """Whether a scalar is a name that may be declared; records why not."""
        text = key.text
        if is_indexed(text):
            self.unsupported("indexed families are", key.mark)
        elif not IDENTIFIER.fullmatch(text) or len(text) > _LONGEST_NAME:
            self.problems.add(
                f"expected a name in '{section}', found {shown(text)}",
                key.mark,
                hint="a name is a letter or _ followed by letters, digits and _ (A-Z, a-z, 0-9)",
                rule="name",
            )
        elif symbols and text in RESERVED:
            self.problems.add(
                f"'{text}' is reserved and cannot be declared in '{section}'",
                key.mark,
                rule="reserved",
            )
        else:
            return True
        return False


def _described(node: SourceNode) -> str:
    if isinstance(node, Mapping):
        return "a mapping" if node.entries else "an empty mapping"
    if isinstance(node, Sequence):
        return f"a list of {len(node.items)}" if node.items else "an empty list"
    return shown(node.text)


def is_indexed(text: str) -> bool:
    """Whether a key has the form of an indexed name, ``x[i]``."""
    return _INDEXED.match(text) is not None
