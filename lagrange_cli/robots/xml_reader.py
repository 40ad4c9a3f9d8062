"""XML as elements with their places, read within bounds.

The reader is the standard library's expat. A document type is refused where it begins, so that
there are no entities, neither nested nor of other files; depth, elements and attributes are
bounded.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cached_property
from typing import NoReturn
from xml.parsers import expat

from lagrange_cli.errors import InputError, LimitError, Mark, Problem

#: Bounds on hostile files: robots of hundreds of links are far below them.
_MOST_ELEMENTS, _MOST_DEPTH, _MOST_CHARACTERS = 100_000, 200, 20_000

#: Digits and decimal exponent of a number: those of doubles with room to spare.
_MOST_DIGITS, _LARGEST_EXPONENT = 40, 300

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?")


@dataclass(frozen=True)
class Source:
    """The text of a file, for the places of problems."""

    name: str
    data: bytes

    @cached_property
    def lines(self) -> list[str]:
        return [line.decode("utf-8", "replace") for line in self.data.splitlines()] or [""]

    def mark(self, line: int, column: int, length: int = 1) -> Mark:
        """Return a place; lines and columns count from 1."""
        text = self.lines[line - 1] if line <= len(self.lines) else ""
        return Mark(self.name, line, column, text, length)

    def attribute(self, offset: int, name: str) -> Mark | None:
        """Return the place of an attribute of the element that begins at an offset of the data."""
        match = re.compile(rb"\s(" + re.escape(name.encode()) + rb")\s*=").search(self.data, offset)
        if match is None:
            return None
        before = self.data[: match.start(1)]
        start = max(before.rfind(b"\n"), before.rfind(b"\r")) + 1
        column = len(before[start:].decode("utf-8", "replace")) + 1
        return self.mark(
            len(before.splitlines()) if start < len(before) else before.count(b"\n") + 1,
            column,
            len(name),
        )


@dataclass(frozen=True)
class Element:
    """An element of XML.

    Attributes
    ----------
    tag, attributes, children
        As in the file; text between elements is left out.
    mark
        The place of its tag.
    source, offset
        The file, and where the element begins in its bytes.
    """

    tag: str
    attributes: Mapping[str, str]
    children: tuple[Element, ...]
    mark: Mark
    source: Source = field(repr=False)
    offset: int

    def every(self, tag: str) -> Iterator[Element]:
        """Yield its children of a tag."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        return next(self.every(tag), None)

    def place(self, attribute: str) -> Mark:
        """Return the place of an attribute, or of the element if it has none of this name."""
        known = attribute in self.attributes
        return (self.source.attribute(self.offset, attribute) if known else None) or self.mark

    def refuse(
        self, message: str, attribute: str = "", hint: str = "", rule: str = "robot"
    ) -> NoReturn:
        """Raise the refusal of this element, or of one of its attributes.

        Raises
        ------
        InputError
            Always.
        """
        raise InputError(Problem(message, self.place(attribute), hint, rule))

    def required(self, attribute: str) -> str:
        """Return an attribute that has to be there."""
        if attribute not in self.attributes:
            self.refuse(f"<{self.tag}> has no '{attribute}'", rule="missing")
        return self.attributes[attribute]

    def numbers(
        self, attribute: str, count: int, default: str | None = None
    ) -> tuple[Decimal, ...]:
        """Return as many numbers as an attribute has to have."""
        numbers = self.some_numbers(attribute, default)
        if len(numbers) != count:
            wanted = "one number" if count == 1 else f"{count} numbers"
            self.refuse(f"'{attribute}' is {wanted}, found {len(numbers)}", attribute)
        return numbers

    def number(self, attribute: str, default: str | None = None) -> Decimal:
        (number,) = self.numbers(attribute, 1, default)
        return number

    def some_numbers(self, attribute: str, default: str | None = None) -> tuple[Decimal, ...]:
        """Return the numbers of an attribute, with blanks between them."""
        text = self.attributes.get(attribute, default)
        if text is None:
            text = self.required(attribute)
        return tuple(self._number(word, attribute) for word in text.split())

    def _number(self, word: str, attribute: str) -> Decimal:
        if not _NUMBER.fullmatch(word):
            hint = ""
            if "$" in word or "{" in word:
                hint = "a xacro file has to be expanded first: xacro robot.xacro > robot.urdf"
            self.refuse(f"'{word[:40]}' is not a number", attribute, hint)
        number = Decimal(word)
        if (
            len(number.as_tuple().digits) > _MOST_DIGITS
            or abs(number.adjusted()) > _LARGEST_EXPONENT
        ):
            self.refuse(f"'{word[:40]}' has too many digits, or is too large or small", attribute)
        return number


def read_xml(data: bytes, name: str) -> Element:
    """Return the root element of a document.

    Parameters
    ----------
    data
        The bytes of the file.
    name
        Its name in messages.

    Raises
    ------
    InputError
        Located: this is not XML, has a document type, or is beyond the bounds.
    """
    builder = _Builder(Source(name, data))
    return builder.root()


class _Builder:
    """Builds elements from the events of expat."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._open: list[tuple[str, dict[str, str], list[Element], Mark, int]] = []
        self._count = 0
        self._root: Element | None = None
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.StartDoctypeDeclHandler = self._doctype
        self._parser.EntityDeclHandler = self._entity

    def root(self) -> Element:
        try:
            self._parser.Parse(self._source.data, True)
        except expat.ExpatError as error:
            mark = self._source.mark(error.lineno, error.offset + 1)
            says = expat.errors.messages.get(error.code, "it ends too early")
            raise InputError(Problem(f"this is not XML: {says}", mark, rule="xml")) from None
        assert self._root is not None
        return self._root

    def _here(self, length: int = 1) -> Mark:
        parser = self._parser
        return self._source.mark(parser.CurrentLineNumber, parser.CurrentColumnNumber + 1, length)

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._count += 1
        longest = max((len(text) for text in (tag, *attributes.values())), default=0)
        for limit, value, what in (
            (_MOST_ELEMENTS, self._count, "elements"),
            (_MOST_DEPTH, len(self._open) + 1, "elements within each other"),
            (_MOST_CHARACTERS, longest, "characters in an attribute"),
        ):
            if value > limit:
                problem = Problem(f"more than {limit} {what}", self._here(), rule="limit")
                raise LimitError(problem)
        mark = self._here(len(tag) + 1)
        self._open.append((tag, attributes, [], mark, self._parser.CurrentByteIndex))

    def _end(self, tag: str) -> None:
        _, attributes, children, mark, offset = self._open.pop()
        element = Element(tag, attributes, tuple(children), mark, self._source, offset)
        if self._open:
            self._open[-1][2].append(element)
        else:
            self._root = element

    def _doctype(self, *_: object) -> None:
        hint = "a description of a robot needs none, and entities are not read"
        problem = Problem("a document type is refused", self._here(), hint, rule="xml")
        raise InputError(problem)

    def _entity(self, *_: object) -> None:
        raise InputError(Problem("entities are not read", self._here(), rule="xml"))
