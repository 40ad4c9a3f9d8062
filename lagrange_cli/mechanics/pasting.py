"""Sections of a scene on one line, as hints give them to be put in place of the scene's."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import sympy as sp

from lagrange_cli.scene.expression import Expression, Name, names_in
from lagrange_cli.scene.model import Scene, Unilateral

__all__ = [
    "changed_start",
    "fewer_coordinates",
    "initial_line",
    "near_line",
    "one_sided_line",
    "section_line",
]

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


def changed_start(scene: Scene, values: Mapping[str, str]) -> str:
    """The section ``initial`` with other values of some positions."""
    given = {f"dot({e.name})" if e.order else e.name: e.value.text for e in scene.initial}
    return section_line("initial", {**given, **values})


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


def one_sided_line(one_sided: Unilateral, more: sp.Rational, bound: sp.Expr | None) -> str:
    """A one-sided constraint with ``more`` room; empty where the scene has no line for it alone.

    Parameters
    ----------
    bound
        The value of its right side; None where that is no number.
    """
    written = one_sided.inequality
    mark = one_sided.mark
    line = mark.text[mark.column - 1 :].lstrip("'\"")
    if not re.match(rf"{re.escape(one_sided.name)}['\"]?\s*:", line):
        return ""
    sign = 1 if written.relation == "<=" else -1
    left, right = (side.strip() for side in written.text.split(written.relation))
    right = f"{right} {'+' if sign > 0 else '-'} {float(more):.6g}"
    if bound is not None and bound.is_Rational:
        right = f"{float(bound + sign * more):.6g}"
    text = f"{left} {written.relation} {right}"
    if one_sided.restitution is None:
        return f"{one_sided.name}: {_quoted(text)}"
    kept = one_sided.restitution.text
    return f'{one_sided.name}: {{unilateral: "{text}", restitution: {_quoted(kept)}}}'


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
