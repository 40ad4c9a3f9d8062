"""Lines of a scene in the usual layout, without a look at their meaning.

Tokens of YAML are written again with the blanks between them that the layout wants; texts, comments
and line breaks stay. Sections stand in :data:`ORDER`, each with the comments above it.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import dropwhile, pairwise
from typing import Any

import yaml

from lagrange_cli.scene.reading.source import MAX_DEPTH

#: The sections in the order in which the layout has them: declarations before what uses them.
ORDER = (
    *("name", "title", "description", "sizes", "parameters", "functions", "inputs"),
    *("plane", "points", "frames", "particles", "bodies", "constraints", "coordinates", "states"),
    *("controllers", "definitions", "kinetic", "potentials", "forces", "dissipation", "outputs"),
    *("initial", "near", "simulate", "expect"),
)

#: Columns by which each level of blocks is indented.
_STEP = 2

#: Blanks before a comment at the end of a line.
_BEFORE_COMMENT = 2

#: A text that means the same without quotes, wherever it stands.
_SAFE = re.compile(r"[A-Za-z_][A-Za-z0-9_()+*/^.]*( [A-Za-z0-9_()+*/^.<>=-]+)*")

_OPENING = (yaml.FlowMappingStartToken, yaml.FlowSequenceStartToken)
_CLOSING = (yaml.FlowMappingEndToken, yaml.FlowSequenceEndToken)
_BLOCKS = (yaml.BlockMappingStartToken, yaml.BlockSequenceStartToken)

#: The tag of a text.
_STRING = "tag:yaml.org,2002:str"


@dataclass
class _Block:
    """A block collection that is open.

    Attributes
    ----------
    is_mapping
        False for a sequence.
    column
        New column of its entries.
    entry
        New column of the present entry; that of a dash right below a key is deeper.
    shift
        Columns by which the present entry moves to the right.
    """

    is_mapping: bool
    column: int
    entry: int
    shift: int = 0


@dataclass
class _Line:
    """A line of the new text.

    Attributes
    ----------
    text
        The line without a comment at its end.
    old_column
        Column at which it began; None if it is blank or goes on with a text of several lines.
    comment
        Its comment; empty for none.
    comment_column
        Column at which the comment stood.
    is_text
        True within a text of several lines.
    """

    text: str = ""
    old_column: int | None = None
    comment: str = ""
    comment_column: int = 0
    is_text: bool = False

    @property
    def is_blank(self) -> bool:
        return not (self.text or self.comment or self.is_text)

    @property
    def may_lead(self) -> bool:
        """Say whether it may belong to the section below: blank, or a comment at the margin."""
        alone = bool(self.comment) and self.old_column is None and not self.is_text
        return self.is_blank or (alone and self.comment_column == 0)

    @property
    def column(self) -> int:
        return len(self.text) - len(self.text.lstrip(" "))


class Layout:
    """The layout of one text, whose lines end with line feeds."""

    def __init__(self, source: str) -> None:
        self.source, self.old = source, source.split("\n")
        self.lines = [_Line() for _ in self.old]
        self.ends = [0] * len(self.old)
        self.tokens: list[Any] = list(yaml.scan(source, Loader=_loader()))
        self.padding = dict(_paddings(source, self.tokens))
        self.blocks: list[_Block] = []
        self.sections: list[tuple[int, str]] = []
        self.flow = 0, 0
        self._write_tokens()
        self._find_comments()

    def text(self) -> str:
        """Return the new text."""
        self._indent_comments()
        self._place_comments()
        written: list[_Line] = []
        for line in self._in_order():
            if not line.is_blank or (written and not written[-1].is_blank):
                written.append(line)
        return "\n".join(line.text for line in written).rstrip("\n") + "\n"

    def comments(self) -> Counter[str]:
        """Return the comments of the text."""
        return Counter(line.comment for line in self.lines if line.comment)

    # Tokens.

    def _write_tokens(self) -> None:
        """Write every token, at the column of its line or after those before it."""
        depth, last = 0, -1
        before: tuple[int, Any] | None = None
        for number, token in enumerate(self.tokens):
            if isinstance(token, _BLOCKS):
                column = self.blocks[-1].entry + _STEP if self.blocks else 0
                is_mapping = isinstance(token, yaml.BlockMappingStartToken)
                self.blocks.append(_Block(is_mapping, column, column))
            elif isinstance(token, yaml.BlockEndToken):
                self.blocks.pop()
            elif not depth:
                self._begin_entry(number)
            if token.start_mark.index == token.end_mark.index:
                continue
            line = token.start_mark.line
            if before is None or last != line:
                self.lines[line].old_column = token.start_mark.column
                self.lines[line].text = " " * self._column(number, is_nested=depth > 0)
            else:
                self.lines[line].text += self._blanks(*before, token)
            if isinstance(token, _OPENING) and not depth:
                self.flow = token.start_mark.column, len(self.lines[line].text)
            depth += isinstance(token, _OPENING) - isinstance(token, _CLOSING)
            last = self._write(token, is_nested=depth > 0)
            before = number, token

    def _begin_entry(self, number: int) -> None:
        """Note the columns of the entry that a token begins, if it begins one."""
        token = self.tokens[number]
        if self.blocks and isinstance(token, (yaml.KeyToken, yaml.BlockEntryToken)):
            block = self.blocks[-1]
            is_dash = isinstance(token, yaml.BlockEntryToken)
            block.entry = block.column + (_STEP if is_dash and block.is_mapping else 0)
            block.shift = block.entry - token.start_mark.column
            if len(self.blocks) == 1 and not is_dash:
                name = getattr(self.tokens[number + 1], "value", "")
                self.sections.append((token.start_mark.line, name))

    def _column(self, number: int, *, is_nested: bool) -> int:
        """Return the new column of a token that begins a line."""
        token, start = self.tokens[number], self.tokens[number].start_mark.column
        if is_nested:
            return self._continued(start)
        if not self.blocks:
            return 0
        begins = (yaml.KeyToken, yaml.BlockEntryToken, yaml.ValueToken)
        is_entry = isinstance(token, begins) or isinstance(self.tokens[number - 1], yaml.KeyToken)
        return self.blocks[-1].entry + (0 if is_entry else _STEP)

    def _continued(self, column: int) -> int:
        """Return the new column of a line that goes on with an entry.

        Lines below the inside of brackets move with these, others with the entry.
        """
        old, new = self.flow
        moved = new - old if column > old else self.blocks[-1].shift if self.blocks else 0
        return max(column + moved, 0)

    def _blanks(self, number: int, before: Any, token: Any) -> str:
        """Return the blanks between two tokens on one line."""
        ends = isinstance(token, (*_CLOSING, yaml.FlowEntryToken))
        if isinstance(before, _OPENING) or (ends and not isinstance(before, yaml.ValueToken)):
            return ""
        if isinstance(token, yaml.ValueToken) and not isinstance(before, yaml.AliasToken):
            return ""
        return " " * (1 + self.padding.get(number, 0))

    def _write(self, token: Any, *, is_nested: bool) -> int:
        """Write a token; return its last line."""
        first, end = token.start_mark.line, token.end_mark
        raw = self.source[token.start_mark.index : end.index]
        style = token.style if isinstance(token, yaml.ScalarToken) else None
        if style in ("|", ">"):
            return self._write_block(token, raw)
        head, *further = raw.split("\n")
        if not further:
            self.lines[first].text += _written(token, raw)
        else:
            self.lines[first].text += head.rstrip() if style != '"' else head
        for number, piece in enumerate(further, first + 1):
            indent = len(piece) - len(piece.lstrip(" \t"))
            column = self._continued(indent) if is_nested else indent + self.blocks[-1].shift
            content = piece[indent:] if style == '"' else piece[indent:].rstrip()
            self.lines[number] = _Line(" " * column + content if content else "", is_text=True)
            self.ends[number - 1] = len(self.old[number - 1])
        self.ends[end.line] = end.column
        return int(end.line)

    def _write_block(self, token: Any, raw: str) -> int:
        """Write a text with ``|`` or ``>`` and its lines; return the last of these."""
        first = token.start_mark.line
        head, *content = raw.split("\n")
        is_kept = "+" in head.split("#")[0]
        while content and not is_kept and not content[-1].strip(" "):
            content.pop()
        self.lines[first].text += head.rstrip()
        self.ends[first] = len(self.old[first])
        block = self.blocks[-1]
        indent = next((len(c) - len(c.lstrip(" ")) for c in content if c.strip(" ")), 0)
        has_own = any(character.isdigit() for character in head.split("#")[0])
        shift = block.shift if has_own else block.entry + _STEP - indent
        for number, piece in enumerate(content, first + 1):
            moved = " " * shift + piece if shift > 0 else piece[-shift:]
            self.lines[number] = _Line(moved, is_text=True)
            self.ends[number] = len(self.old[number])
        return int(first + len(content))

    # Comments.

    def _find_comments(self) -> None:
        for line, old, end in zip(self.lines, self.old, self.ends, strict=True):
            remark = old[end:].lstrip()
            if remark.startswith("#"):
                line.comment, line.comment_column = remark.rstrip(), len(old) - len(remark)

    def _indent_comments(self) -> None:
        """Indent each comment on a line of its own as an entry of the section that it stands in."""
        starts = [line for line, _ in self.sections]
        begun: list[tuple[int, _Line]] = []
        waiting: list[tuple[int, int, _Line]] = []
        below_text = False
        for number, line in enumerate([*self.lines, _Line(old_column=0)]):
            section = bisect_right(starts, number)
            if line.old_column is not None:
                for place, deepest, comment in waiting:
                    above = [one for there, one in reversed(begun) if there == place]
                    is_within = section == place and number < len(self.lines)
                    _indent(comment, [line, *above] if is_within else above, deepest)
                waiting = []
                begun.append((section, line))
            elif line.comment and not line.is_text:
                # A text that ends here would go on with a comment as deep as itself.
                deepest = begun[-1][1].column if below_text else MAX_DEPTH * _STEP
                waiting.append((section, deepest, line))
            below_text = line.is_text or (below_text and line.old_column is None)

    def _place_comments(self) -> None:
        """Write the comments at the ends of lines, below each other where they stood so."""
        begins = {line for line, _ in self.sections}
        run: list[_Line] = []
        for number, line in enumerate([*self.lines, _Line()]):
            follows = run and run[-1].comment_column == line.comment_column
            is_trailing = bool(line.comment) and (line.old_column is not None or line.is_text)
            if run and (number in begins or not is_trailing or not follows):
                width = max(len(member.text) for member in run) + _BEFORE_COMMENT
                for member in run:
                    member.text = f"{member.text:{width}}{member.comment}"
                run = []
            if is_trailing:
                run.append(line)

    # Sections.

    def _in_order(self) -> list[_Line]:
        """Return the lines, with the sections in their order."""
        ranks = list(_ranks([name for _, name in self.sections]))
        has_anchors = any(isinstance(token, yaml.AnchorToken) for token in self.tokens)
        if ranks == sorted(ranks) or has_anchors:
            return self.lines
        starts = [self._lead(line) for line, _ in self.sections]
        end = next(
            (t.start_mark.line for t in self.tokens if isinstance(t, yaml.DocumentEndToken)),
            len(self.lines),
        )
        while self.lines[end - 1].may_lead:
            end -= 1
        parts = [self.lines[start:stop] for start, stop in pairwise([*starts, end])]
        leading = [part[0].is_blank for part in parts]
        ordered = sorted(range(len(parts)), key=ranks.__getitem__)
        written = list(self.lines[: starts[0]])
        for place, number in enumerate(ordered):
            if place and (leading[number] or all(leading[1:])):
                written.append(_Line())
            written += dropwhile(lambda line: line.is_blank, parts[number])
        return [*written, *self.lines[end:]]

    def _lead(self, line: int) -> int:
        """Return the first line of those that belong to the section that begins on a line.

        At the top of the file, what stands before a blank line is of the whole file.
        """
        start = line
        while start and self.lines[start - 1].may_lead:
            start -= 1
        if line != self.sections[0][0]:
            return start
        blank = [k for k in range(start, line) if self.lines[k].is_blank]
        return blank[-1] + 1 if blank else line if start == 0 else start


def _indent(comment: _Line, entries: Sequence[_Line], deepest: int) -> None:
    """Write a comment on a line of its own: below an entry that it stood below, else the first."""
    same = [entry for entry in entries if entry.old_column == comment.comment_column]
    column = next((entry.column for entry in (*same, *entries)), 0)
    comment.text = " " * (min(column, deepest) if comment.comment_column else 0) + comment.comment


def _loader() -> Any:
    return getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def _paddings(source: str, tokens: Sequence[Any]) -> Iterator[tuple[int, int]]:
    """Yield the blanks more than one after colons of maps whose values stand below each other.

    They do if keys of different lengths have values at one column; those of the root never do.
    """
    entries: list[list[tuple[int, int, int]]] = []
    depth = 0
    for number, token in enumerate(tokens):
        depth += isinstance(token, _OPENING) - isinstance(token, _CLOSING)
        if isinstance(token, _BLOCKS):
            entries.append([])
        elif isinstance(token, yaml.BlockEndToken):
            known = entries.pop()
            widths: dict[int, set[int]] = {}
            for _, width, column in known:
                widths.setdefault(column, set()).add(width)
            if entries and any(len(different) > 1 for different in widths.values()):
                widest = max(width for _, width, _ in known)
                yield from ((place, widest - width) for place, width, _ in known)
        elif isinstance(token, yaml.ValueToken) and not depth and entries:
            key, value = tokens[number - 1], tokens[number + 1]
            is_alone = isinstance(tokens[number - 2], yaml.KeyToken)
            if is_alone and value.start_mark.line == token.start_mark.line:
                raw = source[key.start_mark.index : key.end_mark.index]
                width = len(_written(key, raw))
                entries[-1].append((number, width, value.start_mark.column))


def _written(token: Any, raw: str) -> str:
    """Return a token of one line, with the quotes that a text needs."""
    if not isinstance(token, yaml.ScalarToken) or token.style not in ("'", '"'):
        return raw.rstrip()
    text = str(token.value)
    if _SAFE.fullmatch(text) and is_string(text):
        return text
    is_simple = text.isprintable() and "\\" not in text and '"' not in text
    return f'"{text}"' if is_simple else raw


def is_string(text: str) -> bool:
    """Say whether a text without quotes is no number, truth value or null."""
    resolver: Any = yaml.SafeLoader("")
    return bool(resolver.resolve(yaml.ScalarNode, text, (True, False)) == _STRING)


def _ranks(names: Sequence[str]) -> Iterator[int]:
    """Yield the place of each section; an unknown one stays after the one before it."""
    rank = 0
    for name in names:
        rank = ORDER.index(name) if name in ORDER else rank
        yield rank
