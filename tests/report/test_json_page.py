"""docs/json.md has every key of every report; ``python -m tests.report.test_json_page`` makes it.

The examples in docs/command-line.md have keys of the schemas, with values of their types.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema

from lagrange_cli.api import REPORTS, report_schema

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = DOCS / "json.md"
COMMANDS = (DOCS / "command-line.md").read_text(encoding="utf-8")

HEAD = """\
# Reports as JSON

What each command writes with `--json`, key by key; examples are in [Command line](command-line.md).
`lagrange schema --report NAME` prints the same as a JSON Schema, by which other programs check what
they read. These tables are made from it.

In keys `[]` stands for each entry of a list, and NAME for names of the scene. Expressions are texts
in the scene language (`dot(r)`, `ddot(r)`, `^`). A number that is not known is null. Keys that may
be missing are in *italics*.
"""

WORDS = {"string": "text", "boolean": "true or false", "integer": "whole number", "null": "null"}

#: Examples of the page on commands → their reports, in their order.
EXAMPLES = (
    *("derive", "simulate", "section", "ensemble", "analyze", "path"),
    *("tradeoff", "stress", "fit", "check", "cache"),
)


def kind(schema: dict[str, Any]) -> str:
    """The type of a value in words."""
    if "anyOf" in schema:
        return ", or ".join(map(kind, schema["anyOf"]))
    if "enum" in schema:
        return ", ".join("null" if v is None else f"`{v}`" for v in schema["enum"])
    types = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    return " or ".join(_kind(name, schema) for name in types)


def _kind(name: str, schema: dict[str, Any]) -> str:
    if name == "array" and isinstance(schema.get("items"), dict):
        number = "pair" if schema.get("maxItems") == 2 else "list"
        return f"{number} of {kind(schema['items'])}"
    if name == "object":
        values = schema["additionalProperties"]
        return f"{kind(values)} by name" if isinstance(values, dict) else "object"
    return WORDS.get(name, name)


def rows(schema: dict[str, Any], path: str = "") -> Iterator[str]:
    """The rows of a table; what ``latex`` has again is not listed again."""
    required = schema.get("required", ())
    for name, value in schema.get("properties", {}).items():
        key = f"`{path}{name}`" if name in required else f"*`{path}{name}`*"
        cells = kind(value).replace("|", r"\|"), value["description"].replace("|", r"\|")
        yield f"| {key} | {cells[0]} | {cells[1]} |"
        if name != "latex":
            yield from rows(value, f"{path}{name}.")
    for inner, mark in (("items", "[]."), ("additionalProperties", ".NAME.")):
        if isinstance(schema.get(inner), dict):
            yield from rows(schema[inner], path.removesuffix(".") + mark)
    for choice in schema.get("anyOf", ()):
        yield from rows(choice, path)


def page() -> str:
    sections = [HEAD]
    for name in REPORTS:
        schema = report_schema(name)
        table = ["| key | value | meaning |", "|---|---|---|", *rows(schema)]
        sections.append(f"## {name}\n\n`{REPORTS[name]}`:\n\n" + "\n".join(table) + "\n")
    return "\n".join(sections)


def shortened(schema: Any) -> Any:
    """A schema of examples, which leave keys out."""
    if isinstance(schema, dict):
        return {k: shortened(v) for k, v in schema.items() if k != "required"}
    return [shortened(entry) for entry in schema] if isinstance(schema, list) else schema


def test_the_page_is_made_of_the_schemas():
    assert PAGE.read_text(encoding="utf-8") == page()


def test_examples_are_valid():
    blocks = re.findall(r"^```json\n(.*?)^```", COMMANDS, re.MULTILINE | re.DOTALL)
    assert len(blocks) == len(EXAMPLES)
    for name, text in zip(EXAMPLES, blocks, strict=True):
        jsonschema.Draft202012Validator(shortened(report_schema(name))).validate(json.loads(text))


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
