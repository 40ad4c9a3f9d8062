"""The outline of a scene's text: each scalar with its kind, each name with its places.

Kinds follow from the JSON Schema of scenes along the tree of YAML. A name is declared by a key or
an item of a section that declares names; ``x_bob`` is a place of ``bob``, ``p_theta`` one of
``theta``, ``lambda_rod`` one of the constraint ``rod``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple, TypeAlias

from lagrange_cli.errors import Mark, Problem
from lagrange_cli.scene.checks.table import name_table
from lagrange_cli.scene.language.expression import ANGULAR_VELOCITIES
from lagrange_cli.scene.language.tokens import IDENTIFIER, ExpressionError, tokenize
from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.reader import SECTIONS, read_partly
from lagrange_cli.scene.reading.declarations import AXES
from lagrange_cli.scene.reading.source import (
    Mapping,
    Scalar,
    Sequence,
    SourceNode,
    compose_partly,
)
from lagrange_cli.scene.schema import scene_schema
from lagrange_cli.scene.schema_parts import (
    NUMBER_OR_TEXT,
    ReferenceSchema,
    Schema,
    WordSchema,
)

Kind: TypeAlias = Literal["key", "name", "expression", "text", "reference", "words"]
"""What a scalar is: a fixed key, a key that is a name, a value by its schema, or other words."""

Namespace: TypeAlias = Literal["value", "body", "label"]
"""What a name belongs to: values in expressions, particles and the like, or labels of terms."""

Path: TypeAlias = tuple[str | int, ...]

#: Sections whose keys are names of places in space.
_BODIES = ("particles", "bodies", "frames", "points")
#: Sections whose keys are labels.
_LABELS = ("constraints", "potentials", "kinetic", "forces", "dissipation")
#: Beginnings of names that are made of others.
_COMPONENT = re.compile(rf"[{''.join(AXES)}]_")
_MULTIPLIER = "lambda_"


class Symbol(NamedTuple):
    """A name: what it belongs to, and itself."""

    namespace: Namespace
    name: str


@dataclass(frozen=True)
class Declaration:
    """The place where a name is declared.

    Attributes
    ----------
    section
        The section that declares it; ``position`` for a name that stands bare in one.
    mark
        Its place.
    value
        What it is declared as; None if it is listed alone.
    """

    section: str
    mark: Mark
    value: SourceNode | None = None


@dataclass(frozen=True)
class Place:
    """A scalar of the tree.

    Attributes
    ----------
    scalar
        The scalar.
    path
        Keys and numbers of items that lead to it; for a key, its own as the last.
    kind
        What it is.
    schemas
        The schemas that it may follow; for a key, those of its value.
    """

    scalar: Scalar
    path: Path
    kind: Kind
    schemas: tuple[Schema, ...]


@dataclass(frozen=True)
class Occurrence:
    """A place of a symbol; ``exact`` if it is known to the character."""

    symbol: Symbol
    mark: Mark
    exact: bool


def alternatives(*schemas: Schema) -> tuple[Schema, ...]:
    """Return the kinds of values that schemas allow, each without alternatives of its own."""
    flat: list[Schema] = []
    for schema in schemas:
        flat += alternatives(*schema["anyOf"]) if "anyOf" in schema else [schema]
    return tuple(flat)


def below_key(schemas: tuple[Schema, ...], key: str) -> tuple[tuple[Schema, ...], bool]:
    """Return the schemas of the value of a key, and whether the key is a fixed one."""
    fixed = [s["properties"][key] for s in schemas if key in s.get("properties", {})]
    if fixed:
        return alternatives(*fixed), True
    others = [s["additionalProperties"] for s in schemas if s.get("additionalProperties")]
    return alternatives(*others), False


def below_item(schemas: tuple[Schema, ...], number: int) -> tuple[Schema, ...]:
    """Return the schemas of an item of a list."""
    items = [s["items"] for s in schemas if "items" in s]
    chosen = [i if isinstance(i, dict) else i[min(number, len(i) - 1)] for i in items]
    return alternatives(*chosen)


def kind_of(schemas: tuple[Schema, ...]) -> Kind:
    """Return the kind of a scalar that follows one of some schemas."""
    if any(s.get("type") == NUMBER_OR_TEXT for s in schemas):
        return "expression"
    if any(isinstance(s, ReferenceSchema) for s in schemas):
        return "reference"
    texts = [s for s in schemas if s.get("type") == "string" and not isinstance(s, WordSchema)]
    return "text" if texts else "words"


def places(root: SourceNode) -> Iterator[Place]:
    """Yield the scalars of a tree, in reading order, each once."""
    pending: list[tuple[SourceNode, Path, tuple[Schema, ...]]] = [(root, (), (scene_schema(),))]
    seen: set[int] = set()
    while pending:
        node, path, schemas = pending.pop()
        if id(node) in seen:
            continue  # an alias
        seen.add(id(node))
        if isinstance(node, Scalar):
            yield Place(node, path, kind_of(schemas), schemas)
        elif isinstance(node, Sequence):
            pending += [
                (item, (*path, number), below_item(schemas, number))
                for number, item in reversed(list(enumerate(node.items)))
            ]
        else:
            further = []
            for key, value in node.entries:
                inner, is_fixed = below_key(schemas, key.text)
                along = (*path, key.text)
                yield Place(key, along, "key" if is_fixed else "name", inner)
                further.append((value, along, inner))
            pending += further[::-1]


def words_of(text: str) -> list[tuple[str, int, bool]]:
    """Return the names of an expression, their offsets, and whether each is a frame's.

    The names of a text that is none are its identifiers.
    """
    try:
        tokens = tokenize(text)
    except ExpressionError:
        return [(m.group(), m.start(), False) for m in IDENTIFIER.finditer(text)]
    turned = {i + 2 for i, token in enumerate(tokens[:-2]) if token.text in ANGULAR_VELOCITIES}
    return [(t.text, t.start, i in turned) for i, t in enumerate(tokens) if t.kind == "name"]


@dataclass(frozen=True)
class Outline:
    """Tree, scene, problems and names of a scene's text.

    Attributes
    ----------
    root
        Its tree, in which entries may be wrong.
    scene
        The scene as far as it is understood; None if nothing of it is.
    problems
        Errors and warnings of its reading.
    """

    root: SourceNode
    scene: Scene | None
    problems: tuple[Problem, ...]

    @classmethod
    def of_text(cls, text: str, file: str) -> Outline:
        """Outline a text.

        Raises
        ------
        InputError
            It is no YAML, or exceeds a limit.
        """
        root, _ = compose_partly(text, file)
        return cls(root, *read_partly(text, file))

    @cached_property
    def places(self) -> tuple[Place, ...]:
        return tuple(places(self.root))

    @cached_property
    def declarations(self) -> dict[Symbol, Declaration]:
        """Every name that is declared, where it is declared first."""
        declared: dict[Symbol, Declaration] = {}
        entries = dict(self._entries())
        for section, declares in ((name, entry.declares) for name, entry in SECTIONS.items()):
            if not (declares or section in (*_LABELS, "outputs")) or section not in entries:
                continue
            for scalar, value in _declared(entries[section], section):
                name = scalar.text.partition("[")[0].strip()
                if IDENTIFIER.fullmatch(name):
                    mark = replace(scalar.mark, length=len(name))
                    symbol = Symbol(namespace_of(section), name)
                    declared.setdefault(symbol, Declaration(section, mark, value))
        if self.scene is not None:
            for name, mark in name_table(self.scene).cartesian.items():
                symbol = Symbol("value", name.partition("[")[0])
                declared.setdefault(symbol, Declaration("position", mark))
        return declared

    def _entries(self) -> Iterator[tuple[str, SourceNode]]:
        if isinstance(self.root, Mapping):
            yield from ((key.text, value) for key, value in self.root.entries)

    @cached_property
    def occurrences(self) -> tuple[Occurrence, ...]:
        """Every place of every symbol."""
        return tuple(o for place in self.places for o in self._occurrences_in(place))

    def _occurrences_in(self, place: Place) -> Iterator[Occurrence]:
        if place.kind in ("key", "words"):
            return
        scalar, is_label = place.scalar, place.path[0] in _LABELS and len(place.path) == 2
        for word, offset, is_frame in words_of(scalar.text):
            if place.kind == "name" and is_label and not offset:
                symbol, skipped = Symbol("label", word), 0
                if symbol not in self.declarations:
                    continue
            else:
                resolved = self._resolved(word, "reference" if is_frame else place.kind, place.path)
                if resolved is None:
                    continue
                symbol, skipped = resolved
            mark = scalar.mark
            if scalar.exact:
                column = mark.column + offset + skipped
                mark = replace(mark, column=column, length=len(symbol.name))
            yield Occurrence(symbol, mark, scalar.exact)

    def _resolved(self, word: str, kind: Kind, path: Path) -> tuple[Symbol, int] | None:
        """Return the symbol that a word stands for, and the offset of its name in the word."""
        is_body = kind == "reference" or (kind == "name" and path[0] in (*_BODIES, "potentials"))
        spaces: tuple[Namespace, ...] = ("body", "value") if is_body else ("value", "body")
        candidates = [(Symbol(space, word), 0) for space in spaces]
        if _COMPONENT.match(word):
            candidates.append((Symbol("body", word[2:]), 2))
        if path[0] == "expect":
            if word.startswith("p_"):
                candidates.append((Symbol("value", word[2:]), 2))
            if path[1:2] == ("events",) and path[-1] == "name":
                candidates = [(Symbol("label", word), 0)]
            if word.startswith(_MULTIPLIER):
                start = len(_MULTIPLIER)
                numbered = word[start:].rpartition("_")[0]
                candidates += [(Symbol("label", n), start) for n in (word[start:], numbered)]
        return next(((s, k) for s, k in candidates if s in self.declarations), None)

    def place_at(self, line: int, column: int) -> Place | None:
        """Return the scalar at a place, both counted from 1; None if there is none."""
        return next((p for p in self.places if is_at(p.scalar.mark, line, column)), None)

    def symbol_at(self, line: int, column: int) -> Occurrence | None:
        """Return the occurrence of a symbol at a place."""
        exact = (o for o in self.occurrences if o.exact)
        return next((o for o in exact if is_at(o.mark, line, column)), None)


def is_at(mark: Mark, line: int, column: int) -> bool:
    """Say whether a place is in a mark, or just behind it."""
    return mark.line == line and mark.column <= column <= mark.column + mark.length


def namespace_of(section: str) -> Namespace:
    """Return what the names that a section declares belong to."""
    return "body" if section in _BODIES else "label" if section in _LABELS else "value"


def _declared(node: SourceNode, section: str) -> Iterator[tuple[Scalar, SourceNode | None]]:
    """Yield the names that a section declares, with what they are declared as."""
    if isinstance(node, Sequence):
        yield from ((item, None) for item in node.items if isinstance(item, Scalar))
    elif isinstance(node, Mapping) and section == "controllers":
        for key, value in node.entries:
            if key.text == "memory" and isinstance(value, Mapping):
                yield from value.entries
            elif isinstance(value, Mapping):
                yield from _declared(value, section)
    elif isinstance(node, Mapping):
        yield from node.entries


def plain_value(node: SourceNode) -> Any:
    """Return a node as plain values, for a person to read."""
    if isinstance(node, Scalar):
        return node.text
    if isinstance(node, Sequence):
        return [plain_value(item) for item in node.items]
    return {key.text: plain_value(value) for key, value in node.entries}
