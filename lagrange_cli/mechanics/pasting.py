"""Sections of a scene on one line, as hints give them to be put in place of the scene's."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from lagrange_cli.scene.expression import Expression, Name, names_in
from lagrange_cli.scene.model import Scene

__all__ = ["fewer_coordinates", "initial_line", "near_line", "section_line"]

#: Text that needs no quotes within braces.
_PLAIN = re.compile(r"[\w.+\-*/^() ]+", re.ASCII)


def initial_line(scene: Scene, values: Mapping[str, str], orders: Sequence[int]) -> str:
    """The section ``initial``: values beside what it has of positions (0) and velocities (1)."""
    given = {
        f"dot({e.name})" if e.order else e.name: e.value.text
        for e in scene.initial
        if e.order in orders
    }
    return section_line("initial", {**given, **{k: v for k, v in values.items() if k not in given}})


def near_line(scene: Scene, values: Mapping[str, str]) -> str:
    """The section ``near`` with these values too."""
    return section_line("near", {**{e.name: e.value.text for e in scene.near}, **values})


def fewer_coordinates(scene: Scene, rest: Sequence[str], dropped: str, value: str) -> str:
    """The section ``coordinates`` without a name.

    One that is no Cartesian name needs a value from then on: a definition gives it.
    """
    lines = [f"coordinates: [{', '.join(rest)}]"]
    used = {
        n.name
        for e in (*(d.expression for d in scene.definitions), *_positions(scene))
        for n in names_in(e.node)
    }
    if dropped in used:
        given = {d.name: d.expression.text for d in scene.definitions}
        lines.append(section_line("definitions", {dropped: value, **given}))
    return "\n".join(lines)


def _positions(scene: Scene) -> Iterator[Expression]:
    entries = [*(p.position for p in scene.particles), *(p.position for p in scene.points)]
    for position in entries:
        yield from (e for e in position if not isinstance(e.node, Name))


def section_line(section: str, values: Mapping[str, str]) -> str:
    """A section of names and values."""
    entries = ", ".join(f"{_quoted(k)}: {_quoted(v)}" for k, v in values.items())
    return f"{section}: {{{entries}}}"


def _quoted(text: str) -> str:
    return text if _PLAIN.fullmatch(text) else f'"{text}"'
