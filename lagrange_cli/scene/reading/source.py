"""YAML text as a tree of nodes that know their places.

The tree is composed from the parser's events with an explicit stack, so that
neither deep nesting nor aliases can exhaust anything: depth is limited as it
grows, and what aliases would expand to is counted before any of it is read.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import yaml

from lagrange_cli.errors import Edit, InputError, Mark, Problem
from lagrange_cli.scene.language.problems import Problems, shown

#: Deepest nesting of YAML.
MAX_DEPTH = 64
#: Characters that all aliases together may expand to.
MAX_ALIASED = 2**20

_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
_FORBIDDEN = re.compile(
    "[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
)
_NULLS = frozenset(("", "~", "null", "Null", "NULL"))
_NOT_FINITE = re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")


@dataclass(frozen=True, slots=True)
class Scalar:
    """A scalar of YAML.

    Attributes
    ----------
    text
        Its text, without quotes and escapes.
    mark
        The place of its first character.
    exact
        True if the text stands in the file character by character, on one line.
    plain
        True if it was written without quotes, so that it may be a number.
    """

    text: str
    mark: Mark
    exact: bool = True
    plain: bool = True


@dataclass(frozen=True, slots=True)
class Sequence:
    items: tuple[SourceNode, ...]
    mark: Mark


@dataclass(frozen=True, slots=True)
class Mapping:
    entries: tuple[tuple[Scalar, SourceNode], ...]
    mark: Mark


SourceNode: TypeAlias = Scalar | Sequence | Mapping


@dataclass(slots=True)
class _Open:
    """A collection whose end has not been reached.

    Attributes
    ----------
    event
        The parser's event that opened it.
    mark
        Its first character.
    items
        Nodes so far; of a mapping keys and values in turn.
    size
        Characters of the nodes so far, with aliases written out.
    """

    event: Any
    mark: Mark
    items: list[SourceNode] = field(default_factory=list)
    size: int = 1


def decode(data: bytes, file: str) -> str:
    """Decode UTF-8, without a byte order mark; refuse bytes that are no text.

    Raises
    ------
    InputError
        At the first byte or character that YAML text cannot hold.
    """
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8-sig")
        what = "a binary file" if b"\0" in data else "not UTF-8 text"
        raise _refusal(
            f"this is {what}: found the byte 0x{data[error.start]:02x}",
            _mark_at(before, len(before), file),
            "a scene is a YAML file in UTF-8",
            rule="not-text",
        ) from None
    return text


def compose(text: str, file: str) -> SourceNode:
    """Compose the one YAML document of ``text``.

    Raises
    ------
    InputError
        The text is not YAML, is empty, holds more than one document, exceeds a limit, or holds
        tags, merge keys, null values, infinities or duplicate keys, which scenes do without.
    """
    root, problems = compose_partly(text, file)
    problems.raise_if_any()
    return root


def compose_partly(text: str, file: str) -> tuple[SourceNode, Problems]:
    """Compose a document in which entries may be wrong; return their problems beside its tree.

    Raises
    ------
    InputError
        The text is not YAML, is empty, holds more than one document, or exceeds a limit.
    """
    bad = _FORBIDDEN.search(text)
    if bad:
        what = "this is a binary file" if bad.group() == "\0" else "this is not plain text"
        raise _refusal(
            f"{what}: found the character U+{ord(bad.group()):04X}",
            _mark_at(text, bad.start(), file),
            "a scene is a YAML file in UTF-8",
            rule="not-text",
        )
    composer = _Composer(text, file)
    return composer.compose(), composer.problems


def _refusal(message: str, mark: Mark, hint: str = "", rule: str = "yaml") -> InputError:
    return InputError(Problem(message, mark, hint, rule))


def _mark_at(text: str, offset: int, file: str) -> Mark:
    """Return the place of an offset of ``text``."""
    start, line = 0, 1
    for line_break in _BREAK.finditer(text, 0, offset):
        start, line = line_break.end(), line + 1
    end = _BREAK.search(text, offset)
    content = text[start : end.start() if end else len(text)]
    return Mark(file, line, offset - start + 1, content)


def edited(text: str, edits: Iterable[Edit]) -> str:
    """Replace what marks of a text mark; equal edits of one place are one.

    Raises
    ------
    InputError
        A line is no longer that of its mark, or edits of one place differ.
    """
    starts = [0, *(line_break.end() for line_break in _BREAK.finditer(text))]
    spans: dict[tuple[int, int], str] = {}
    for edit in edits:
        mark = edit.mark
        start = starts[mark.line - 1] if mark.line <= len(starts) else len(text)
        if not text.startswith(mark.text, start):
            raise _refusal("the file is another since it was read", mark, rule="edit")
        span = (start + mark.column - 1, start + mark.column - 1 + mark.length)
        if spans.setdefault(span, edit.text) != edit.text:
            raise _refusal("several values stand here as one", mark, rule="edit")
    for (start, end), new in sorted(spans.items(), reverse=True):
        text = text[:start] + new + text[end:]
    return text


#: A line that begins an entry, and a number with a comma at the end of a text.
_ENTRY, _DECIMAL_COMMA = re.compile(r" *[^\s#:\-][^:]*:(\s|$)"), re.compile(r"(\d+),(\d+)$")


class _Composer:
    """Builds the tree of one text."""

    def __init__(self, text: str, file: str) -> None:
        self.text = text
        self.file = file
        self.lines = _BREAK.split(text)
        self.problems = Problems()
        self.open: list[_Open] = []
        self.anchors: dict[str, tuple[SourceNode, int]] = {}
        self.aliased = 0
        self.root: SourceNode | None = None

    def compose(self) -> SourceNode:
        loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
        try:
            for event in yaml.parse(self.text, Loader=loader):
                self._event(event)
        except yaml.MarkedYAMLError as error:
            raise self._syntax_error(error) from None
        except yaml.YAMLError as error:
            raise _refusal(f"not valid YAML: {error}", Mark(self.file, 1, 1)) from None
        if self.root is None or (isinstance(self.root, Scalar) and _is_null(self.root)):
            raise _refusal(
                "this scene is empty",
                Mark(self.file, 1, 1, self.lines[0]),
                "a scene is a YAML mapping of sections such as 'particles' and 'potentials'",
                rule="empty",
            )
        return self.root

    def _event(self, event: Any) -> None:
        if isinstance(event, yaml.DocumentStartEvent) and self.root is not None:
            raise _refusal(
                "a second document begins here",
                self._mark(event.start_mark),
                "a scene file holds one YAML document",
            )
        if isinstance(event, yaml.AliasEvent):
            self._alias(event)
        elif isinstance(event, yaml.NodeEvent):
            self._refuse_tag(event)
            if isinstance(event, yaml.ScalarEvent):
                self._close(event.anchor, self._scalar(event), len(event.value) + 1)
            else:
                self._begin(event)
        elif isinstance(event, yaml.CollectionEndEvent):
            top = self.open.pop()
            node = self._collection(top)
            self._close(top.event.anchor, node, top.size)

    def _begin(self, event: Any) -> None:
        mark = self._mark(event.start_mark)
        if len(self.open) >= MAX_DEPTH:
            raise _refusal(f"nested more than {MAX_DEPTH} deep", mark, rule="limit")
        if event.anchor is not None:
            # A new meaning of the name begins; inside, the name stands for nothing.
            self.anchors.pop(event.anchor, None)
        self.open.append(_Open(event, mark))

    def _close(self, anchor: str | None, node: SourceNode, size: int) -> None:
        if anchor is not None:
            self.anchors[anchor] = (node, size)
        if self.open:
            self.open[-1].items.append(node)
            self.open[-1].size += size
        else:
            self.root = node

    def _alias(self, event: Any) -> None:
        mark = self._mark(event.start_mark, len(event.anchor) + 1)
        if event.anchor not in self.anchors:
            raise _refusal(f"{shown('*' + event.anchor)} stands for nothing", mark, rule="alias")
        node, size = self.anchors[event.anchor]
        self.aliased += size
        if self.aliased > MAX_ALIASED:
            raise _refusal(
                f"aliases expand to more than {MAX_ALIASED} characters", mark, rule="limit"
            )
        self._close(None, node, size)

    def _refuse_tag(self, event: Any) -> None:
        if event.tag is not None:
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            self.problems.add(
                f"tags such as {shown(tag)} are not part of a scene",
                self._mark(event.start_mark),
                rule="tag",
            )

    def _scalar(self, event: Any) -> Scalar:
        text, start, end = event.value, event.start_mark, event.end_mark
        plain = event.style in (None, "")
        content = self.lines[end.line] if end.line < len(self.lines) else ""
        column = end.column - len(text) - (0 if plain else 1)
        exact = column >= 0 and "\n" not in text and content[column : column + len(text)] == text
        if exact and event.style in (None, "", "'", '"'):
            mark = Mark(self.file, end.line + 1, column + 1, content, max(1, len(text)))
        else:
            exact = False
            mark = self._mark(start)
            same_line = end.line == start.line
            stop = end.column if same_line else len(mark.text)
            mark = Mark(mark.file, mark.line, mark.column, mark.text, max(1, stop - start.column))
        if plain and _NOT_FINITE.fullmatch(text):
            self.problems.add(f"'{text}' is not a finite number", mark, rule="not-finite")
        return Scalar(text, mark, exact, plain)

    def _collection(self, top: _Open) -> SourceNode:
        if isinstance(top.event, yaml.SequenceStartEvent):
            if not (top.event.flow_style and self._split_in(top.items)):
                for item in top.items:
                    if isinstance(item, Scalar) and _is_null(item):
                        self.problems.add("this item has no value", item.mark, rule="null")
            return Sequence(tuple(top.items), top.mark)
        pairs = list(zip(top.items[::2], top.items[1::2], strict=True))
        parts = [n for pair in pairs for n in pair]
        split = bool(top.event.flow_style) and self._split_in(parts)
        return Mapping(self._entries(pairs, split), top.mark)

    def _entries(
        self, pairs: list[tuple[SourceNode, SourceNode]], split: bool
    ) -> tuple[tuple[Scalar, SourceNode], ...]:
        entries: dict[str, tuple[Scalar, SourceNode]] = {}
        for key, value in pairs:
            if not isinstance(key, Scalar) or _is_null(key):
                self.problems.add("expected a name before ':'", key.mark, rule="key")
            elif key.plain and key.text == "<<":
                self.problems.add("merge keys '<<' are not part of a scene", key.mark, rule="merge")
            elif key.text in entries:
                first = entries[key.text][0].mark
                self.problems.add(
                    f"{shown(key.text)} is given twice",
                    key.mark,
                    hint=f"it is given first on line {first.line}",
                    rule="duplicate",
                )
            else:
                entries[key.text] = (key, value)
                if isinstance(value, Scalar) and _is_null(value) and not split:
                    self._refuse_null(key)
        return tuple(entries.values())

    def _refuse_null(self, key: Scalar) -> None:
        hint = "leave it out, or write {} where it may be empty"
        written, line = key.mark.text, key.mark.line
        below = self.lines[line] if line < len(self.lines) else ""
        number = _DECIMAL_COMMA.search(written[: key.mark.column - 1 + len(key.text)])
        if number is not None and number[2] == key.text:
            hint = f"a decimal number has a point: write {number[1]}.{number[2]}"
        elif written.rstrip() == f"{key.text}:" and _ENTRY.match(below) and not _indent(below):
            hint += f"; what belongs to it is indented, as '  {below.strip()[:40]}'"
        self.problems.add(f"{shown(key.text)} has no value", key.mark, hint=hint, rule="null")

    def _split_in(self, parts: list[SourceNode]) -> bool:
        """Find a plain expression that YAML split at a comma: ``min(x`` and ``y)``."""
        for i, part in enumerate(parts):
            whole = [part.text] if isinstance(part, Scalar) and part.plain else []
            if not whole or _open_parentheses(whole[0]) <= 0:
                continue
            for following in parts[i + 1 :]:
                if not isinstance(following, Scalar):
                    break
                if not _is_null(following):
                    whole.append(following.text)
                if _open_parentheses("".join(whole)) <= 0:
                    self.problems.add(
                        "YAML split this expression at its comma",
                        part.mark,
                        hint=f'quote this expression: "{", ".join(whole)}"',
                        rule="split",
                    )
                    return True
        return False

    def _mark(self, mark: Any, length: int = 1) -> Mark:
        content = self.lines[mark.line] if mark.line < len(self.lines) else ""
        return Mark(self.file, mark.line + 1, mark.column + 1, content, length)

    def _syntax_error(self, error: yaml.MarkedYAMLError) -> InputError:
        place = error.problem_mark or error.context_mark
        mark = self._mark(place) if place else Mark(self.file, 1, 1, self.lines[0])
        indent = mark.text[: len(mark.text) - len(mark.text.lstrip())]
        if "\t" in indent:
            mark = Mark(mark.file, mark.line, indent.index("\t") + 1, mark.text)
            return _refusal("a tab cannot indent", mark, "indent with spaces", rule="tab")
        if ">=" in (mark.text[mark.column - 2 : mark.column], mark.text[mark.column - 1 :][:2]):
            message = "an inequality has two sides, found nothing before '>='"
            return _refusal(message, mark, "as in x >= 0", rule="syntax")
        moved = self._misplaced(mark)
        if moved:
            return _refusal("this line begins at the wrong column", mark, moved, rule="indent")
        context = f" ({error.context})" if error.context else ""
        hint = (
            "quote a text that begins with one of * & ! | > % @ ` or holds ': ' or ' #',\n"
            "or within brackets one of , [ ] { }"
        )
        return _refusal(f"not valid YAML: {error.problem}{context}", mark, hint)

    def _misplaced(self, mark: Mark) -> str:
        """Return the hint to indent a line as the entry above it; empty where that is no cause."""
        above = next((x for x in reversed(self.lines[: mark.line - 1]) if x.strip()), "")
        if not (_ENTRY.match(mark.text) and _ENTRY.match(above)):
            return ""
        entry, indents = mark.text.strip(), (_indent(mark.text), _indent(above))
        has_value = not above.rstrip().endswith(":")
        if indents[0] == indents[1] or (indents[0] > indents[1] and not has_value):
            return ""
        deep = "deeper" if indents[0] > indents[1] else "less deep"
        line = " " * indents[1] + entry[:40]
        return f"it is indented {deep} than the entry above: write '{line}'"


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip(" "))


def _is_null(node: Scalar) -> bool:
    return node.plain and node.text in _NULLS


#: An entry without a blank behind its colon.
_NO_BLANK = re.compile(r"([A-Za-z_]\w*):(\S.{0,60})")


def missing_blank(node: SourceNode) -> str:
    """Return the hint to put a blank behind a colon; empty where that is not what is missing."""
    entry = _NO_BLANK.match(node.text) if isinstance(node, Scalar) and node.plain else None
    return f"a blank follows the colon: write '{entry[1]}: {entry[2]}'" if entry else ""


def _open_parentheses(text: str) -> int:
    return text.count("(") - text.count(")")
