"""Text of messages and hints: quoted names, expressions as a scene writes them, YAML to paste."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

import sympy as sp

from lagrange_cli.scene.bodies import ComposedExpression
from lagrange_cli.scene.checks.table import dependent_names
from lagrange_cli.scene.conditions import InitialValue
from lagrange_cli.scene.language.expression import Expression, Name, names_in
from lagrange_cli.scene.model import Scene, Unilateral

#: Most names that are listed in full: two lines of a terminal.
_MOST = 12
#: Names that are listed at each end of a longer list: one line in all.
_ENDS = 4

#: Largest denominator of a number that is written as a fraction: a longer one reads worse than its
#: decimal.
_LONGEST = 10**6

#: Text that needs no quotes within braces.
_PLAIN = re.compile(r"[\w.+\-*/^() ]+", re.ASCII)


def quoted(names: Sequence[object]) -> str:
    """List names as ``'a', 'b', 'c'``, each once; many as ``'a', 'b', …, 'z' (40 in all)``."""
    different = [f"'{name}'" for name in dict.fromkeys(map(str, names))]
    if len(different) <= _MOST:
        return ", ".join(different)
    shown = [*different[:_ENDS], "...", *different[-_ENDS:]]
    return f"{', '.join(shown)} ({len(different)} in all)"


def contradict(names: Sequence[object], alone: str = "cannot hold") -> str:
    """Write that constraints contradict each other; of a single one, that it ``alone``."""
    several = len(set(names)) > 1
    what = "contradict each other" if several else alone
    return f"constraint{'s' if several else ''} {quoted(names)} {what}"


def leave_out(names: Sequence[object]) -> str:
    """Write the hint for an irreducible inconsistent set, any of whose names may be left out."""
    different = list(dict.fromkeys(names))
    if len(different) == 1:
        return f"leave out {quoted(different)}"
    if len(different) > _MOST:
        return "leave out any one of them"
    *first, last = (f"'{name}'" for name in different)
    return f"leave out {', '.join(first)} or {last}"


def written(expr: sp.Expr) -> str:
    """Write an expression as a scene does, long fractions as decimals."""
    long = {r: sp.Symbol(repr(float(r))) for r in expr.atoms(sp.Rational) if r.q > _LONGEST}
    return with_carets(expr.xreplace(long))


def with_carets(expr: sp.Expr) -> str:
    """Write an expression as SymPy does, with the powers of the scene language."""
    return str(expr).replace("**", "^")


def initial_snippet(scene: Scene, values: Mapping[str, str], orders: Sequence[int]) -> str:
    """Write ``initial`` with more values, keeping its positions (0) or velocities (1)."""
    stated = _values((*(e for e in scene.initial if e.order in orders), *scene.state_starts))
    return section_snippet(
        "initial", {**stated, **{k: v for k, v in values.items() if k not in stated}}
    )


def changed_initial(scene: Scene, values: Mapping[str, str]) -> str:
    """Write ``initial`` with other values of some positions."""
    return section_snippet("initial", {**_values(scene.initial), **values})


def near_snippet(scene: Scene, values: Mapping[str, str]) -> str:
    """Write ``near`` with more values."""
    return section_snippet("near", {**{e.name: e.value.text for e in scene.near}, **values})


def coordinates_snippet(names: Sequence[str]) -> str:
    """Write the section ``coordinates``."""
    return f"coordinates: [{', '.join(map(_quoted, names))}]"


def fewer_coordinates_snippet(
    scene: Scene, remaining: Sequence[str], dropped: Mapping[str, str]
) -> str:
    """Write ``coordinates`` without some names, and the sections that depend on them.

    A dropped name that is not Cartesian gets its value from a definition from then on, and
    loses its entries in ``initial`` and ``near``.
    """
    lines, used = [coordinates_snippet(remaining)], _used(scene)
    freed = {name: value for name, value in dropped.items() if name not in _cartesian(scene)}
    if not freed.keys().isdisjoint(used):
        written = (d for d in scene.definitions if not isinstance(d.expression, ComposedExpression))
        definitions = {d.name: d.expression.text for d in written}
        needed = {name: value for name, value in freed.items() if name in used}
        lines.append(section_snippet("definitions", {**needed, **definitions}))
    for section, entries in (("initial", scene.initial), ("near", scene.near)):
        left = [e for e in entries if e.name not in freed]
        if len(left) < len(entries):
            lines.append(section_snippet(section, _values(left)))
    return "\n".join(lines)


def must_stay(scene: Scene, name: str) -> bool:
    """Say whether a coordinate has to stay because a force or ``expect`` names it."""
    expect = scene.expect
    stated = (v.name for state in expect.states for v in state.values)
    momenta = (c.removeprefix("p_") for c in expect.conserved or ())
    return name in {f.on for f in scene.forces}.union(expect.cyclic or (), stated, momenta)


def _values(entries: Iterable[InitialValue]) -> dict[str, str]:
    return {f"dot({e.name})" if e.order else e.name: e.value.text for e in entries}


def _cartesian(scene: Scene) -> set[str]:
    """Collect names that constraints may determine: bare in positions, or dependent."""
    bare = {e.node.name for e in _entries(scene) if isinstance(e.node, Name)}
    return bare | dependent_names(scene).keys()


def undeclared_names(scene: Scene) -> set[str]:
    """Collect the names that nothing but constraints can determine."""
    declared = {c.name for c in scene.coordinates or ()} | {d.name for d in scene.definitions}
    fixed = {p.name for p in scene.parameters} | {u.name for u in scene.inputs} | {"t", "pi"}
    fixed |= {s.name for s in scene.states}
    return _cartesian(scene) - declared - fixed


def _entries(scene: Scene) -> list[Expression]:
    """List the components of all positions."""
    positions = [*(p.position for p in scene.particles), *(p.position for p in scene.points)]
    return [entry for position in positions for entry in position]


def _used(scene: Scene) -> set[str]:
    """Collect names in expressions of the scene."""
    terms = (*scene.potentials, *scene.kinetic, *scene.dissipation, *scene.outputs)
    expressions = [
        *(d.expression for d in scene.definitions),
        *_entries(scene),
        *(term.expression for term in terms),
        *(c for force in scene.forces for c in force.components),
        *(side for c in scene.constraints for e in c.equations for side in (e.left, e.right)),
        *(side for u in scene.unilateral for side in (u.inequality.left, u.inequality.right)),
    ]
    return {n.name for e in expressions for n in names_in(e.node)}


def one_sided_snippet(one_sided: Unilateral, more: sp.Rational, bound: sp.Expr | None) -> str:
    """Write a one-sided constraint with its bound moved by ``more``; empty if it has no own line.

    Parameters
    ----------
    bound
        The value of its right side; None if that is no number.
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
    restitution = one_sided.restitution.text
    return f'{one_sided.name}: {{unilateral: "{text}", restitution: {_quoted(restitution)}}}'


def section_snippet(section: str, values: Mapping[str, str]) -> str:
    """Write a section of names and values."""
    entries = ", ".join(f"{_quoted(k)}: {_quoted(v)}" for k, v in values.items())
    return f"{section}: {{{entries}}}"


def _quoted(text: str) -> str:
    return text if _PLAIN.fullmatch(text) else f'"{text}"'
