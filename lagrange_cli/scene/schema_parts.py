"""Parts that schemas of the scene language are made of: kinds of values, keys of many sections."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

#: A part of a schema.
Schema: TypeAlias = dict[str, Any]

NUMBER_OR_TEXT = ["number", "string"]


class WordSchema(dict[str, Any]):
    """The schema of a text in which no name of the scene stands."""


class ReferenceSchema(dict[str, Any]):
    """The schema of a text that is the name of a particle, a body, a frame, a point or the like."""


def text_of(description: str) -> Schema:
    """Return the schema of a text, of an equation or of names."""
    return {"type": "string", "description": description}


def words_of(description: str) -> Schema:
    return WordSchema(text_of(description))


def reference_to(description: str) -> Schema:
    return ReferenceSchema(text_of(description))


def expression_of(description: str) -> Schema:
    return {"type": NUMBER_OR_TEXT, "description": description}


def list_of(items: Schema, description: str, number: int | None = None) -> Schema:
    exactly = {} if number is None else {"minItems": number, "maxItems": number}
    return {"type": "array", "items": items, **exactly, "description": description}


def mapping_of(
    description: str, keys: Mapping[str, Schema], required: Sequence[str] = ()
) -> Schema:
    """Return the schema of a mapping with these keys and no others."""
    needed = {"required": list(required)} if required else {}
    return {
        "type": "object",
        "properties": dict(keys),
        "additionalProperties": False,
        **needed,
        "description": description,
    }


def named(value: Schema, description: str) -> Schema:
    """Return the schema of a mapping whose keys are names that the user chooses."""
    return {"type": "object", "additionalProperties": value, "description": description}


def one_of(words: str, description: str) -> Schema:
    return {"enum": words.split(), "description": description}


def either(*kinds: Schema) -> Schema:
    return {"anyOf": list(kinds)}


LATEX = words_of(r"Symbol in LaTeX: letters, digits, scripts, macros as \omega_{0}")
UNIT = words_of("Unit, as kg m^2/s; checked")
DESCRIPTION = words_of("Words that are printed beside it")
POSITIVE = {"type": "boolean", "description": "It stays above zero"}
POSITION = list_of(expression_of("A component, or a new name for it"), "Position x, y, z", 3)
PAIR = list_of(reference_to("A particle, a point or origin"), "Two bodies, [A, B]", 2)
