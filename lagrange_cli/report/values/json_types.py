"""Types of JSON values: each has a JSON Schema and converts values of the package.

A report is an object: a table of keys with the type of each, a sentence that describes it, and
the value that it takes. What ``--json`` writes, its schema and its documentation come from that
table.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import attrgetter, methodcaller
from typing import Any, Generic, Protocol, TypeAlias, TypeVar

#: A part of a JSON Schema.
Schema: TypeAlias = dict[str, Any]

#: The dialect of the schemas.
DRAFT = "https://json-schema.org/draft/2020-12/schema"

_Value = TypeVar("_Value")
_Part = TypeVar("_Part")
_Whole = TypeVar("_Whole")


class JsonType(Protocol):
    """A type of JSON values."""

    @property
    def schema(self) -> Schema:
        """The JSON Schema, without a description."""

    def write(self, value: Any, say: Any = None, /) -> Any:
        """Convert a value to JSON; ``say`` writes expressions, where there are some."""


@dataclass(frozen=True, slots=True)
class ConvertedType:
    """A type whose values a function ``convert(value, say)`` converts."""

    schema: Schema
    convert: Callable[[Any, Any], Any] = lambda value, _: value

    def write(self, value: Any, say: Any = None, /) -> Any:
        return self.convert(value, say)


TEXT = ConvertedType({"type": "string"})
NUMBER = ConvertedType({"type": "number"})
INTEGER = ConvertedType({"type": "integer"})
BOOLEAN = ConvertedType({"type": "boolean"})

#: An expression in the scene language.
EXPRESSION = ConvertedType({"type": "string"}, lambda expression, say: say(expression))


def one_of(*values: str) -> ConvertedType:
    """Return the type of a text that is one of some."""
    return ConvertedType({"type": "string", "enum": list(values)})


def list_of(entry: JsonType, number: int | None = None) -> ConvertedType:
    """Return the type of lists, of NumPy arrays too; ``number``: of entries, None for any.

    NumPy is not imported for that: reports of checks and of the cache do without.
    """

    def convert(values: Any, say: Any) -> list[Any]:
        listed = values.tolist() if hasattr(values, "tolist") else values
        return [entry.write(value, say) for value in listed]

    count = {} if number is None else {"minItems": number, "maxItems": number}
    return ConvertedType({"type": "array", "items": entry.schema, **count}, convert)


#: Names, or other texts.
NAMES = list_of(TEXT)


def by_name(entry: JsonType) -> ConvertedType:
    """Return the type of mappings whose keys are names of the scene, or pairs of these."""

    def convert(values: Any, say: Any) -> dict[str, Any]:
        return {name: entry.write(value, say) for name, value in dict(values).items()}

    return ConvertedType({"type": "object", "additionalProperties": entry.schema}, convert)


def or_null(entry: JsonType) -> ConvertedType:
    """Return the type that has null for None."""

    def convert(value: Any, say: Any) -> Any:
        return None if value is None else entry.write(value, say)

    schema = entry.schema | {"type": [entry.schema["type"], "null"]}
    if "enum" in schema:
        schema["enum"] = [*schema["enum"], None]
    return ConvertedType(schema, convert)


#: Numbers of which some are not known: null for None and for what is not finite.
MAYBE_NUMBER = ConvertedType(
    {"type": ["number", "null"]},
    lambda value, _: None if value is None or not math.isfinite(value) else value,
)

#: A reason in words: null for an empty text.
REASON = ConvertedType({"type": ["string", "null"]}, lambda text, _: text or None)


@dataclass(frozen=True, slots=True)
class Key(Generic[_Value]):
    """A key of an object.

    Attributes
    ----------
    name, type, description
        As the schema has them.
    value
        Takes the key's value from that of the object; None for the attribute of this name.
    optional
        True if the key is left out where the value is None.
    """

    name: str
    type: JsonType
    description: str
    value: Callable[[_Value], Any] | None = None
    optional: bool = False

    @property
    def getter(self) -> Callable[[_Value], Any]:
        """Takes the key's value from that of the object."""
        return self.value or attrgetter(self.name)


def optional(*keys: Key[_Value]) -> tuple[Key[_Value], ...]:
    """Return keys that are left out where the value is None."""
    return tuple(Key(k.name, k.type, k.description, k.value, True) for k in keys)


def through(part: Callable[[_Whole], _Part | None], *keys: Key[_Part]) -> tuple[Key[_Whole], ...]:
    """Return keys of a part of a value as keys of the whole; without the part they are None."""
    return tuple(
        Key(k.name, k.type, k.description, _composed(k.getter, part), k.optional) for k in keys
    )


def _composed(
    outer: Callable[[_Part], Any], inner: Callable[[_Whole], _Part | None]
) -> Callable[[_Whole], Any]:
    def getter(value: _Whole) -> Any:
        part = inner(value)
        return None if part is None else outer(part)

    return getter


class JsonObject(Generic[_Value]):
    """The type of objects with these keys and no others, in this order."""

    def __init__(self, *keys: Key[_Value]) -> None:
        self.keys = keys
        self._getters = [key.getter for key in keys]

    @property
    def schema(self) -> Schema:
        return {
            "type": "object",
            "properties": {
                k.name: k.type.schema | {"description": k.description} for k in self.keys
            },
            "required": [key.name for key in self.keys if not key.optional],
            "additionalProperties": False,
        }

    def write(self, value: _Value, say: Any = None, /) -> dict[str, Any]:
        """Convert a value to JSON; ``say`` writes expressions, where there are some."""
        written = {}
        for key, getter in zip(self.keys, self._getters, strict=True):
            part = getter(value)
            if part is not None or not key.optional:
                written[key.name] = key.type.write(part, say)
        return written


def counts(descriptions: Mapping[str, str], *optional: str) -> JsonObject[Mapping[str, int]]:
    """Return the type of a number for each of some names; ``optional`` ones may be missing."""
    return JsonObject(
        *(
            Key(name, INTEGER, text, methodcaller("get", name), name in optional)
            for name, text in descriptions.items()
        )
    )
