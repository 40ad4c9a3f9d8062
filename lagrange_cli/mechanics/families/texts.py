"""Texts of a scene that differ in indices alone, as one: ``y_p[i] = 0, i = 1 … n``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import sympy as sp

from lagrange_cli.mechanics.families.elements import FEWEST, Place, element_of
from lagrange_cli.mechanics.families.fitting import Vector, links, runs
from lagrange_cli.mechanics.families.forms import Range

_TOKEN = re.compile(r"[^\W\d]\w*(?:\[[^\]]*\])?|\d+\.\d*|\d+|\s+|.", re.DOTALL)


class IndexedText(NamedTuple):
    """A text in place of several, with letters for their indices.

    Attributes
    ----------
    text
        The text.
    ranges
        The indices; none if it is a single text.
    covers
        Numbers of the texts that it replaces.
    """

    text: str
    ranges: tuple[Range, ...]
    covers: tuple[int, ...]


class _Slots(NamedTuple):
    """A text split into its parts without numbers, and the numbers."""

    skeleton: tuple[str, ...]
    numbers: Vector


def indexed_texts(texts: Sequence[str], letters: Sequence[sp.Symbol]) -> list[IndexedText]:
    """Merge neighbouring texts that differ in indices which run over ranges."""
    parts = [_taken_apart(text) for text in texts]
    results: list[IndexedText] = []
    for _, group in groupby(range(len(texts)), key=lambda k: parts[k].skeleton):
        covered = tuple(group)
        whole = _indexed([parts[k] for k in covered], letters, covered)
        if whole is None:
            results += [IndexedText(texts[k], (), (k,)) for k in covered]
        else:
            results.append(whole)
    return results


def _taken_apart(text: str) -> _Slots:
    skeleton: list[str] = []
    numbers: list[int] = []
    for token in _TOKEN.findall(text):
        element = element_of(token)
        if element is not None:
            skeleton.append(f"{element.family}[{len(element.places)}")
            numbers += element.places  # type: ignore[arg-type]
        elif token.isdigit():
            skeleton.append("0")
            numbers.append(int(token))
        else:
            skeleton.append(token)
    return _Slots(tuple(skeleton), tuple(numbers))


def _indexed(
    parts: Sequence[_Slots], letters: Sequence[sp.Symbol], covered: tuple[int, ...]
) -> IndexedText | None:
    vectors = [p.numbers for p in parts]
    if len(parts) < FEWEST or not vectors[0]:
        return None
    linked = links(vectors)
    firsts = [
        next(k for k, link in enumerate(linked) if link.variable == v)
        for v in (0, 1)
        if any(link.variable == v for link in linked)
    ]
    if not firsts or any((link.variable or 0) > 1 for link in linked):
        return None
    points = {tuple(v[k] for k in firsts) for v in vectors}
    spans = [runs({p[k] for p in points}) for k in range(len(firsts))]
    size = 1
    for span in spans:
        size *= len(span[0])
    if any(len(span) > 1 for span in spans) or not size == len(points) == len(parts):
        return None
    places = [
        str(link.offset)
        if link.variable is None
        else str(Place(letters[link.variable], link.offset))
        for link in linked
    ]
    ranges = tuple(
        Range(letter, span[0].start, span[0].stop - 1)
        for letter, span in zip(letters, spans, strict=False)
    )
    return IndexedText(_put_together(parts[0].skeleton, places), ranges, covered)


def _put_together(skeleton: Sequence[str], places: Sequence[str]) -> str:
    waiting = list(places)
    shown = []
    for token in skeleton:
        if token == "0":
            number = waiting.pop(0)
            shown.append(f"({number})" if "+" in number or "-" in number else number)
        elif token[-2:] in ("[1", "[2"):
            indices = [waiting.pop(0) for _ in range(int(token[-1]))]
            shown.append(f"{token[:-1]}{','.join(indices)}]")
        else:
            shown.append(token)
    return "".join(shown)
