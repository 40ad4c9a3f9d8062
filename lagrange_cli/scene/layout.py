"""Layout of a scene's text: order of sections, indentation, spaces and quotes.

A result is returned only if it reads as the text did: the same tree, the same scene, the same
comments.
"""

from __future__ import annotations

import re
from dataclasses import fields, is_dataclass, replace
from typing import Any

from lagrange_cli.errors import InputError, InternalError, Mark, Problem
from lagrange_cli.scene.layout_lines import Layout, is_string
from lagrange_cli.scene.reader import read_text
from lagrange_cli.scene.reading.source import Mapping, Scalar, SourceNode, compose, decode

#: Line breaks of YAML beside those of every editor.
_OTHER_BREAKS = re.compile("[\x85\u2028\u2029]")


def laid_out(data: bytes, file: str) -> str:
    """Return the text of a scene in the usual layout.

    Raises
    ------
    InputError
        It is no YAML that a scene can be.
    """
    before = decode(data, file)
    tree = compose(before, file)
    if not isinstance(tree, Mapping):
        hint = "a mapping of sections such as 'particles'"
        raise InputError(Problem("this is no scene", tree.mark, hint, rule="type"))
    text = before.replace("\r\n", "\n").replace("\r", "\n")
    if (hidden := _OTHER_BREAKS.search(text)) is not None:
        line = text.count("\n", 0, hidden.start()) + 1
        message = f"a line ends with U+{ord(hidden.group()):04X}, which editors do not show"
        raise InputError(Problem(message, Mark(file, line, 1), "end it as others", rule="not-text"))
    after = Layout(text).text()
    if not (_same_tree(tree, compose(after, file)) and _same_scene(before, after, file)):
        raise InternalError(Problem("the layout would change the meaning of a scene", rule="crash"))
    if Layout(text).comments() != Layout(after).comments():
        raise InternalError(Problem("the layout would lose a comment of a scene", rule="crash"))
    return after


def _same_tree(first: SourceNode, second: SourceNode) -> bool:
    """Say whether two trees hold the same, the sections of the root in any order."""
    alike: bool = plain_tree(first, is_root=True) == plain_tree(second, is_root=True)
    return alike


def plain_tree(node: SourceNode, *, is_root: bool = False) -> Any:
    """Return a tree as tuples, without places; quotes count where a text without them is none."""
    if isinstance(node, Scalar):
        return node.text, node.plain or is_string(node.text)
    if isinstance(node, Mapping):
        entries = [(key.text, plain_tree(value)) for key, value in node.entries]
        return sorted(entries, key=lambda entry: entry[0]) if is_root else entries
    return tuple(map(plain_tree, node.items))


def _same_scene(first: str, second: str, file: str) -> bool:
    """Say whether two texts read as one scene, or are refused alike."""
    alike: bool = _reading(first, file) == _reading(second, file)
    return alike


def _reading(text: str, file: str) -> Any:
    """Return the scene of a text without places, or the kinds of problems that it has."""
    try:
        scene = read_text(text, file)
    except InputError as error:
        return sorted(problem.rule for problem in error.problems)
    return _placeless(replace(scene, digest="", warnings=()))


def _placeless(value: Any) -> Any:
    """Return a value without the places that it holds."""
    if isinstance(value, Mark):
        return None
    if is_dataclass(value):
        return type(value), [_placeless(getattr(value, f.name)) for f in fields(value)]
    if isinstance(value, dict):
        return [(key, _placeless(entry)) for key, entry in value.items()]
    return [_placeless(entry) for entry in value] if isinstance(value, (tuple, list)) else value
