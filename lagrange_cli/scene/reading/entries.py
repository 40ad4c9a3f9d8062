"""Entries of sections: a mapping, a list, a name, a text or an expression, or a problem.

Every function takes the node and a phrase that describes it (``parameter 'a'``). If the node
differs from the expected shape, it records both and returns None.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from collections.abc import Mapping as AbstractMapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from lagrange_cli.errors import Mark
from lagrange_cli.scene.language.expression import (
    RANGE,
    RESERVED,
    Call,
    Equation,
    Expression,
    Name,
    Node,
    Number,
    Relation,
    children,
    walk,
)
from lagrange_cli.scene.language.families import (
    Budget,
    assignments,
    check_family,
    element_name,
    leaves,
    whole_number,
    written_equation,
    written_expression,
)
from lagrange_cli.scene.language.grammar import parse_equation, parse_expression, parse_key
from lagrange_cli.scene.language.problems import Problems, shown, suggestion
from lagrange_cli.scene.language.tokens import IDENTIFIER
from lagrange_cli.scene.model import FamilyIndex, Link, Point
from lagrange_cli.scene.reading.source import Mapping, Scalar, Sequence, SourceNode, missing_blank

_BOOLEANS = {
    text: text.lower() == "true" for text in ("true", "True", "TRUE", "false", "False", "FALSE")
}
_BASED = re.compile(r"0o([0-7]+)|0x([0-9a-fA-F]+)")
_INTEGER = re.compile(r"[-+]?[0-9]{1,9}")
_INDEXED = re.compile(r"\s*[A-Za-z_][A-Za-z0-9_]*\s*\[")
#: Sections of particles, bodies, and what these stand on.
BODY_SECTIONS = ("particles", "frames", "bodies", "points")
#: Most characters of a name.
_LONGEST_NAME = 100


@dataclass(slots=True)
class Reading:
    """A scene being read: the problems so far and the sections read so far.

    Attributes
    ----------
    file, problems
        Name of the file in messages; problems so far.
    values
        Sections read so far, by name.
    doubtful
        Sections with problems, and sections whose names resemble an unknown one.
    doubtful_bodies
        Names in such sections of particles and points, without indices.
    helper_parts
        Expressions given to helpers, each with a description of its place.
    helper_templates
        Parsed texts that helpers stand for, by their shape.
    links
        The helpers between two bodies.
    overrides
        Values given beside the scene, by name; those of sizes are needed while reading.
    functions
        Names of the scene's own functions, with their numbers of arguments.
    sizes, indices
        Sizes by name; the same with the indices of the family's element that is being read.
    index_marks
        Every index with the place where it was declared first.
    families
        Family → its indices, of those that have a range for each.
    budget
        Names and numbers that families may still be written out to.
    """

    file: str
    problems: Problems = field(default_factory=Problems)
    values: dict[str, Any] = field(default_factory=dict)
    doubtful: set[str] = field(default_factory=set)
    doubtful_bodies: set[str] = field(default_factory=set)
    helper_parts: list[tuple[Expression, str]] = field(default_factory=list)
    helper_templates: dict[str, Node] = field(default_factory=dict)
    links: list[Link] = field(default_factory=list)
    overrides: AbstractMapping[str, str] = field(default_factory=dict)
    sizes: dict[str, int] = field(default_factory=dict)
    indices: dict[str, int] = field(default_factory=dict)
    index_marks: dict[str, Mark] = field(default_factory=dict)
    families: dict[str, tuple[FamilyIndex, ...]] = field(default_factory=dict)
    budget: Budget = field(default_factory=Budget)
    _expressions: dict[Scalar, tuple[Expression, int]] = field(default_factory=dict)
    _equations: dict[tuple[Scalar, tuple[Relation, ...]], tuple[Equation, int]] = field(
        default_factory=dict
    )
    _keys: dict[Scalar, Expression] = field(default_factory=dict)
    functions: dict[str, int] = field(default_factory=dict)
    _bodies: frozenset[str] | None = None

    @property
    def bodies(self) -> frozenset[str]:
        """Names of particles and points, once these sections have been read."""
        if self._bodies is None:
            sections = (self.values.get("particles", ()), self.values.get("points", ()))
            self._bodies = frozenset(body.name for section in sections for body in section)
        return self._bodies

    def add_point(self, point: Point) -> None:
        """Add a point to those that the scene declares."""
        self.values["points"] = (*self.values.get("points", ()), point)
        self._bodies = None

    @property
    def knows_bodies(self) -> bool:
        """True if particles and points were all understood, so that a missing one is missing."""
        return self.doubtful.isdisjoint(BODY_SECTIONS)

    def doubt(self, section: str, node: SourceNode) -> None:
        """Record that not all of a section may have been understood."""
        self.doubtful.add(section)
        if section in BODY_SECTIONS and isinstance(node, Mapping):
            self.doubtful_bodies |= {_without_index(key.text) for key, _ in node.entries}

    def may_be_a_body(self, name: str) -> bool:
        """Say whether an unknown name may be a particle or point that was not understood."""
        known = {_without_index(body) for body in self.bodies}
        return _without_index(name) in self.doubtful_bodies - known

    def expected(self, wanted: str, what: str, node: SourceNode, hint: str = "") -> None:
        """Record that a node differs from the expected shape."""
        self.problems.add(
            f"expected {wanted} for {what}, found {_described(node)}",
            node.mark,
            hint=hint,
            rule="shape",
        )

    def mapping(self, node: SourceNode, what: str, wanted: str = "a mapping") -> Mapping | None:
        if isinstance(node, Mapping):
            return node
        self.expected(wanted, what, node, missing_blank(node) if "names" in wanted else "")
        return None

    def items(self, node: SourceNode, what: str, wanted: str = "a list") -> Sequence | None:
        if isinstance(node, Sequence):
            return node
        self.expected(wanted, what, node)
        return None

    def text(self, node: SourceNode, what: str) -> str | None:
        """Return the text of any scalar."""
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
        """Read a whole number, perhaps in terms of sizes."""
        if isinstance(node, Scalar) and node.plain and _INTEGER.fullmatch(node.text):
            return int(node.text)
        if not (self.indices and isinstance(node, Scalar)):
            self.expected("an integer", what, node)
            return None
        parsed = self._parsed(node)
        if parsed is not None:
            with self.problems.collect_at(parsed[0]):
                return whole_number(parsed[0].node, self.indices, what)
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
        parsed = self._parsed(scalar)
        if parsed is None:
            return None
        with self.writing_out(*parsed, what):
            return written_expression(parsed[0], self.indices, self.budget)
        return None

    def _parsed(self, scalar: Scalar) -> tuple[Expression, int] | None:
        """Parse an expression, once; return it with its number of names and numbers."""
        if scalar not in self._expressions:
            with self.problems.collect():
                parsed = parse_expression(
                    scalar.text, scalar.mark, exact=scalar.exact, functions=self.functions
                )
                self._expressions[scalar] = (parsed, leaves(parsed.node))
        return self._expressions.get(scalar)

    @contextmanager
    def writing_out(self, expression: Expression, terms: int, what: str) -> Iterator[None]:
        """Charge the terms of a family's element to the budget; record problems raised inside."""
        with self.problems.collect(what), self.problems.collect_at(expression, what):
            if self.in_family:
                self.budget.charge(terms, expression.node.span)
            yield
        if self.budget.exceeded:
            self.problems.raise_if_any()

    @property
    def in_family(self) -> bool:
        """True while an element of a family is read."""
        return len(self.indices) > len(self.sizes)

    def equation(
        self, node: SourceNode, what: str, relations: tuple[Relation, ...] = ("=",)
    ) -> Equation | None:
        """Read an equation, or an inequality if ``relations`` allow it."""
        wanted = "an equation" if len(relations) == 1 else "an equation or inequality"
        scalar = self._expression_text(node, wanted if "=" in relations else "an inequality", what)
        if scalar is None:
            return None
        key = (scalar, relations)
        if key not in self._equations:
            with self.problems.collect():
                parsed = parse_equation(
                    scalar.text,
                    scalar.mark,
                    exact=scalar.exact,
                    relations=relations,
                    functions=self.functions,
                )
                terms = leaves(parsed.left.node) + leaves(parsed.right.node)
                self._equations[key] = (parsed, terms)
        if key not in self._equations:
            return None
        equation, terms = self._equations[key]
        with self.writing_out(equation.left, terms, what):
            return written_equation(equation, self.indices, self.budget)
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
        required: Collection[str] = (),
    ) -> dict[str, SourceNode]:
        """Return the entries of a mapping whose keys are fixed."""
        fields: dict[str, SourceNode] = {}
        for key, value in node.entries:
            if key.text in allowed:
                fields[key.text] = value
            else:
                self.unknown_key(key, what, allowed)
        for name in required:
            if name not in fields:
                self.problems.add(f"{what} has no '{name}'", node.mark, rule="missing")
        return fields

    def unknown_key(self, key: Scalar, what: str, allowed: Collection[str]) -> None:
        hint = suggestion(key.text, allowed, f"known are {', '.join(allowed)}")
        self.problems.add(
            f"unknown key {shown(key.text)} in {what}", key.mark, hint=hint, rule="unknown-key"
        )

    def named(
        self, node: SourceNode, section: str, *, symbols: bool
    ) -> Iterator[tuple[Scalar, SourceNode]]:
        """Yield the entries of a section whose keys are names that the user chooses.

        ``symbols``: the names stand in expressions, so that reserved names are
        refused. A family gives an entry for each of its elements.
        """
        mapping = self.mapping(node, f"'{section}'", "a mapping of names")
        first: dict[str, Mark] = {}
        for key, value in mapping.entries if mapping else ():
            for name in self.names(key, section, symbols=symbols):
                if self._is_new(name, first):
                    yield name, value

    def listed(self, items: tuple[SourceNode, ...], section: str, what: str) -> Iterator[Scalar]:
        """Yield the names of a section that is a list, families written out."""
        first: dict[str, Mark] = {}
        for item in items:
            if not isinstance(item, Scalar):
                self.expected("a name", what, item)
                continue
            for name in self.names(item, section, symbols=True):
                if self._is_new(name, first):
                    yield name

    def _is_new(self, name: Scalar, first: dict[str, Mark]) -> bool:
        earlier = first.setdefault(name.text, name.mark)
        if earlier is not name.mark:
            hint = f"it is given first on line {earlier.line}"
            self.problems.add(
                f"{shown(name.text)} is given twice", name.mark, hint=hint, rule="duplicate"
            )
        return earlier is name.mark

    def names(self, key: Scalar, section: str, *, symbols: bool) -> Iterator[Scalar]:
        """Yield the name that is declared, or those of all elements of a family."""
        if not is_indexed(key.text):
            if self.is_name(key, section, symbols=symbols):
                yield key
            return
        base = replace(key, text=key.text.partition("[")[0].strip())
        if self.is_name(base, section, symbols=symbols):
            yield from self.elements(key)

    def elements(self, key: Scalar) -> Iterator[Scalar]:
        """Yield the elements of ``x[i=1..n]``, or the one of ``x[0]``, or a plain name.

        While an element is read, ``indices`` holds its values. After the first element
        with a problem the others, which would have it too, are left out.
        """
        if not is_indexed(key.text):
            yield key
            return
        parsed = self._declared(key)
        if parsed is None:
            return
        name = parsed.node
        assert isinstance(name, Name)
        ranges = [part for part in name.indices if _is_range(part)]
        if len(ranges) == len(name.indices):
            self.families.setdefault(name.name, tuple(map(self._family_index, ranges)))
        outer = self.indices
        with self.problems.collect_at(parsed):
            check_family(name, ranges, outer)
            for values in assignments(ranges, outer, self.budget):
                before = len(self.problems.errors)
                indices = [_index(part, values) for part in name.indices]
                self.indices = values
                yield replace(key, text=element_name(name.name, indices))
                if len(self.problems.errors) > before:
                    break
        self.indices = outer
        if self.budget.exceeded:
            self.problems.raise_if_any()

    def _family_index(self, node: Node) -> FamilyIndex:
        """Return the index of a range, and the one size that the range ends with."""
        index, _, last = children(node)
        assert isinstance(index, Name)
        names = {part.name for part in walk(last) if isinstance(part, Name)}
        return FamilyIndex(index.name, names.pop() if len(names) == 1 else None)

    def _declared(self, key: Scalar) -> Expression | None:
        """Parse the key of a family, once; None if it is refused."""
        if key not in self._keys:
            with self.problems.collect():
                parsed = parse_key(key.text, key.mark, exact=key.exact)
                self._keys[key] = parsed
                for part in children(parsed.node):
                    if _is_range(part):
                        index = children(part)[0]
                        assert isinstance(index, Name)
                        self.index_marks.setdefault(index.name, parsed.mark(index.span))
        return self._keys.get(key)

    def reference(self, node: Scalar) -> str | None:
        """Return the name that a text refers to: ``p[i-1]`` is ``p[2]`` where ``i`` is 3."""
        if not is_indexed(node.text):
            return node.text
        parsed = self._declared(node)
        if parsed is None:
            return None
        assert isinstance(parsed.node, Name)
        with self.problems.collect_at(parsed):
            indices = [whole_number(part, self.indices) for part in parsed.node.indices]
            return element_name(parsed.node.name, indices)
        return None

    def is_name(self, key: Scalar, section: str, *, symbols: bool) -> bool:
        """Say whether a scalar is a name that may be declared; records why not."""
        text = key.text
        if not IDENTIFIER.fullmatch(text) or len(text) > _LONGEST_NAME:
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


def _is_range(node: Node) -> bool:
    return isinstance(node, Call) and node.function == RANGE


def _without_index(name: str) -> str:
    return name.partition("[")[0].strip()


def _index(node: Node, values: AbstractMapping[str, int]) -> int:
    """Return the value of one index of an element; of a range, that of its index."""
    if not _is_range(node):
        return whole_number(node, values)
    index = children(node)[0]
    assert isinstance(index, Name)
    return values[index.name]


def is_indexed(text: str) -> bool:
    """Say whether a key has the form of an indexed name, ``x[i]``."""
    return _INDEXED.match(text) is not None
