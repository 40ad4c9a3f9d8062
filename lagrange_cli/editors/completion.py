"""Completion at a place of a scene's text, which may be half-written there.

A marker is put where the cursor stands, in the ways in which a line may go on; the first text of
these that is YAML says where in the tree the cursor is. Candidates are the keys and values that the
JSON Schema allows there, the names that the scene declares, functions and units.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

import yaml

from lagrange_cli.editors.outline import (
    Outline,
    Path,
    Place,
    Symbol,
    alternatives,
    below_key,
    plain_value,
)
from lagrange_cli.errors import InputError
from lagrange_cli.scene.language.expression import FUNCTIONS, SUM
from lagrange_cli.scene.reading.source import Mapping, SourceNode
from lagrange_cli.scene.schema import scene_schema
from lagrange_cli.scene.schema_parts import UNIT, Schema, WordSchema
from lagrange_cli.scene.unit_table import BASES, unit_names

#: Stands where the cursor is.
MARKER = "zzCursorzz"
#: A line that holds nothing but the beginning of a key or an item.
_ALONE = re.compile(r"[\s-]*\w*")
#: The end of a number or word before the cursor, which is replaced.
_TYPED = re.compile(r"[^\W\d]\w*\Z")
#: Sections, and parts of ``expect``, whose keys are names of values.
_OF_VALUES = ("initial", "near", "state", "equilibria")
#: Most candidates that an editor is given.
_MOST = 500

_BRACKETS = {"FlowSequenceStartToken": "]", "FlowMappingStartToken": "}"}


@dataclass(frozen=True)
class Candidate:
    """A text that may stand at the cursor.

    Attributes
    ----------
    label
        What an editor lists.
    kind
        ``key``, ``value``, ``name``, ``function``, ``helper`` or ``unit``.
    detail
        One line about it.
    text
        What is put in.
    """

    label: str
    kind: str
    detail: str
    text: str


def completions(text: str, offset: int, file: str) -> list[dict[str, Any]]:
    """Return the candidates at an offset of a text."""
    typed = _TYPED.search(text[:offset])
    start = typed.start() if typed else offset
    outline = _with_marker(text, offset, file)
    if outline is None:
        return []
    place = next((p for p in outline.places if MARKER in p.scalar.text), None)
    if place is None:
        return []
    inner = place.scalar.text.partition(MARKER)[0]
    is_whole = not inner or inner == text[start:offset]
    by_label = {c.label: c for c in _candidates(place, outline, is_whole=is_whole)}
    return [asdict(c) for c in list(by_label.values())[:_MOST]]


def _with_marker(text: str, offset: int, file: str) -> Outline | None:
    """Outline the first text with a marker at the cursor that is YAML; None if none is."""
    for variant in _variants(text, offset):
        with suppress(InputError):
            return Outline.of_text(variant, file)
    return None


def _variants(text: str, offset: int) -> Iterator[str]:
    """Yield the text with a marker, as a key or a value, with less and less behind it."""
    before, behind = text[:offset], text[offset:]
    line_end, line_break, below = behind.partition("\n")
    as_value, as_key = f"{before}{MARKER}{behind}", f"{before}{MARKER}: 0{line_break}{below}"
    line = before.rpartition("\n")[2]
    yield from (as_key, as_value) if _ALONE.fullmatch(line + line_end) else (as_value, as_key)
    closed = f"{before}{MARKER}{_closing(before)}"
    yield f"{closed}{line_break}{below}"
    yield closed
    yield f"{before}{MARKER}: 0{_closing(before)}"


def _closing(text: str) -> str:
    """Return the brackets that close those of YAML which are open at the end of a text."""
    closing: list[str] = []
    try:
        for token in yaml.scan(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
            name = type(token).__name__
            if name in _BRACKETS:
                closing.append(_BRACKETS[name])
            elif name in ("FlowSequenceEndToken", "FlowMappingEndToken") and closing:
                closing.pop()
    except yaml.YAMLError:
        pass  # The rest of the brackets is closed all the same.
    return "".join(closing[::-1])


def _candidates(place: Place, outline: Outline, *, is_whole: bool) -> Iterator[Candidate]:
    schemas, path = place.schemas, place.path
    if place.kind in ("key", "name"):
        yield from _keys(outline, path)
        return
    if is_whole:
        yield from _values(schemas)
    if UNIT in schemas and place.kind == "words":
        yield from (Candidate(unit, "unit", "unit", unit) for unit in (*BASES, *unit_names()))
    if place.kind == "reference":
        yield from _names(outline, "body", "value")
        yield Candidate("origin", "name", "the origin of space", "origin")
    elif place.kind in ("expression", "text"):
        yield from _names(outline, "value", "body")
        yield from _functions()
    if is_whole and all(s.get("type") == "object" for s in schemas):
        # A mapping begins here, whose first key is being written.
        yield from _keys(outline, (*path, MARKER))


def _keys(outline: Outline, path: Path) -> Iterator[Candidate]:
    """Yield the keys that a mapping may still have; ``path`` ends with the one at the cursor."""
    schemas: tuple[Schema, ...] = (scene_schema(),)
    node: SourceNode | None = outline.root
    for key in path[:-1]:
        schemas = _below(schemas, key)
        node = _child(node, key)
    taken = {key.text for key, _ in node.entries} if isinstance(node, Mapping) else set()
    for schema in schemas:
        for key, value in schema.get("properties", {}).items():
            if key not in taken:
                yield Candidate(key, "key", described(alternatives(value)), f"{key}: ")
    if set(_OF_VALUES) & set(path[:-1]):
        for candidate in _names(outline, "value"):
            name = candidate.label
            yield Candidate(name, "name", candidate.detail, f"{name}: ")
            yield Candidate(f"dot({name})", "name", f"rate of {name}", f"dot({name}): ")


def _below(schemas: tuple[Schema, ...], key: str | int) -> tuple[Schema, ...]:
    if isinstance(key, int):
        return alternatives(*(s["items"] for s in schemas if isinstance(s.get("items"), dict)))
    return below_key(schemas, key)[0]


def _child(node: SourceNode | None, key: str | int) -> SourceNode | None:
    if isinstance(node, Mapping):
        return next((value for name, value in node.entries if name.text == key), None)
    items = getattr(node, "items", ())
    return items[key] if isinstance(key, int) and key < len(items) else None


def _values(schemas: tuple[Schema, ...]) -> Iterator[Candidate]:
    """Yield values of an enumeration, and helpers, which are mappings, by their first keys."""
    for schema in schemas:
        detail = schema.get("description", "")
        if schema.get("type") == "boolean":
            yield from (Candidate(word, "value", detail, word) for word in ("true", "false"))
        for word in schema.get("enum", ()):
            yield Candidate(word, "value", detail, word)
        required = schema.get("required", ())
        if schema.get("type") == "object" and required:
            inside = ", ".join(f"{key}: " for key in required)
            yield Candidate(f"{{{required[0]}}}", "helper", detail, f"{{{inside}}}")


def _names(outline: Outline, *namespaces: str) -> Iterator[Candidate]:
    """Yield names that are declared, and the components of places in space."""
    symbols = [symbol for symbol in outline.declarations if MARKER not in symbol.name]
    for namespace in namespaces:
        for symbol in symbols:
            if symbol.namespace == namespace:
                yield from _name(symbol, outline, components=namespaces[0] == "value")


def _name(symbol: Symbol, outline: Outline, *, components: bool) -> Iterator[Candidate]:
    name, declared = symbol.name, outline.declarations[symbol]
    if symbol.namespace == "body" and components:
        for axis in "xyz":
            label = f"{axis}_{name}"
            yield Candidate(label, "name", f"{axis} of {name}", label)
    else:
        value = "" if declared.value is None else f": {plain_value(declared.value)}"
        yield Candidate(name, "name", f"{declared.section}{value}"[:100], name)


def _functions() -> Iterator[Candidate]:
    for name in ("t", "pi"):
        detail = "the time" if name == "t" else "3.14159..."
        yield Candidate(name, "name", detail, name)
    for name, number in FUNCTIONS.items():
        detail = "function of several" if number is None else f"function of {number}"
        yield Candidate(name, "function", detail, name)
    yield Candidate(SUM, "function", "sum(..., i=1..n)", SUM)


def described(schemas: tuple[Schema, ...]) -> str:
    """Return one line about values that follow one of some schemas."""
    plain = [s for s in schemas if not isinstance(s, WordSchema)] or list(schemas)
    return next((s["description"] for s in plain if "description" in s), "")
