"""Dependencies between names: their order, circles, and traits that expressions inherit.

Definitions, position entries and parameter values refer to each other. Going
through them once in dependency order tells which traits an expression has when
all its names are written out: rates, functions without a derivative, parts
that are not constant, large powers.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass

from lagrange_cli.scene.language.bounds import ANY_EXTENT, Extent, extent_of
from lagrange_cli.scene.language.expression import (
    PIECEWISE,
    TIME_DERIVATIVES,
    Call,
    Expression,
    Name,
    Node,
    children,
    names_in,
    own_function,
    walk,
)
from lagrange_cli.scene.language.templates import shape_of

#: Functions without a derivative everywhere.
NONSMOOTH = ("abs", "sign", "min", "max", "heaviside", PIECEWISE)


@dataclass(frozen=True, slots=True)
class ExpressionTraits:
    """Traits of an expression once its names are written out.

    Attributes
    ----------
    rate
        Time derivatives: 0 for positions, 1 with ``dot``, 2 with ``ddot``.
    rough
        First of :data:`NONSMOOTH` in it, None if it is smooth.
    constant
        True if it depends on parameters and numbers only.
    extent
        Its value, or its largest power.
    first_input, first_state, first_switch
        First input, first state and first state with two values in it, None if it holds none.
    """

    rate: int = 0
    rough: str | None = None
    constant: bool = False
    extent: Extent = ANY_EXTENT
    first_input: str | None = None
    first_state: str | None = None
    first_switch: str | None = None


def dependency_order(meanings: Mapping[str, Expression]) -> tuple[list[str], list[list[str]]]:
    """Order names so that each comes after those that its meaning uses.

    Returns
    -------
    order
        Every name once; within a circle the order is that of discovery.
    circles
        Each circle found, as the names along it.
    """
    order: list[str] = []
    circles: list[list[str]] = []
    done: set[str] = set()
    for start in meanings:
        # The path from the start to the current name, with what remains to be visited of each.
        path: dict[str, Iterator[str]] = {}
        if start not in done:
            path[start] = _uses(start, meanings)
        while path:
            name = next(reversed(path))
            following = next(path[name], None)
            if following is None:
                del path[name]
                done.add(name)
                order.append(name)
            elif following in path:
                names = list(path)
                circles.append(names[names.index(following) :])
            elif following not in done:
                path[following] = _uses(following, meanings)
    return order, circles


def _uses(name: str, meanings: Mapping[str, Expression]) -> Iterator[str]:
    names = dict.fromkeys(n.name for n in names_in(meanings[name].node))
    return iter([n for n in names if n in meanings])


def traits_of(node: Node, names: Mapping[str, ExpressionTraits]) -> ExpressionTraits:
    """Return the traits of a tree, given those of its names (unknown ones are positions).

    Raises
    ------
    ExpressionError
        At the part that exceeds a limit of :mod:`lagrange_cli.scene.language.bounds`.
    """
    rough = first_input = first_state = first_switch = None
    constant, holds_rates = True, False
    for part in walk(node):
        if isinstance(part, Name):
            traits = names.get(part.name, _POSITION)
            constant &= traits.constant
            holds_rates |= bool(traits.rate)
            rough = rough or traits.rough
            first_input = first_input or traits.first_input
            first_state = first_state or traits.first_state
            first_switch = first_switch or traits.first_switch
        elif isinstance(part, Call):
            holds_rates |= part.function in TIME_DERIVATIVES
            rough = rough or _rough_function(part, names)
    extents = _Extents(names)
    extent = extent_of(node, extents)
    rate = _rates(node, names)[id(node)] if holds_rates else 0
    firsts = first_input, first_state, first_switch
    return ExpressionTraits(rate, rough, constant, extent, *firsts)


def _rough_function(call: Call, names: Mapping[str, ExpressionTraits]) -> str | None:
    """Return the name of a function without a derivative everywhere; tables are in ``names``."""
    if call.function in NONSMOOTH:
        return call.function
    return names.get(own_function(call.function), _POSITION).rough


_POSITION = ExpressionTraits()


class TraitsByShape:
    """Traits of trees, computed once for trees that differ only in names with the same traits."""

    def __init__(self) -> None:
        #: A shape and the ``id`` of its names' traits → these, to keep them alive, and the tree's.
        self._known: dict[Hashable, tuple[list[ExpressionTraits], ExpressionTraits]] = {}
        #: One object for all traits that are equal, but those of constants with a value.
        self._distinct: dict[ExpressionTraits, ExpressionTraits] = {}

    def of_tree(self, node: Node, names: Mapping[str, ExpressionTraits]) -> ExpressionTraits:
        """Return the traits of a tree, as :func:`traits_of`."""
        shape, present = shape_of(node)
        traits = [names.get(name, _POSITION) for name in present]
        key = shape, *map(id, traits)
        if key not in self._known:
            whole = traits_of(node, names)
            if whole.extent.value is None:  # an exact number equals the one it is rounded to
                whole = self._distinct.setdefault(whole, whole)
            self._known[key] = traits, whole
        return self._known[key][1]


class _Extents(Mapping[str, Extent]):
    """The extents of names, seen through their traits."""

    def __init__(self, names: Mapping[str, ExpressionTraits]) -> None:
        self.names = names

    def __getitem__(self, name: str) -> Extent:
        return self.names[name].extent

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


def _rates(node: Node, names: Mapping[str, ExpressionTraits]) -> dict[int, int]:
    """Return the number of time derivatives in every part, by ``id``."""
    rates: dict[int, int] = {}
    for part in reversed(list(walk(node))):
        if isinstance(part, Name):
            rates[id(part)] = names.get(part.name, _POSITION).rate
            continue
        inside = max((rates[id(n)] for n in children(part)), default=0)
        outside = TIME_DERIVATIVES.get(part.function, 0) if isinstance(part, Call) else 0
        rates[id(part)] = inside + outside
    return rates


def rate_node(node: Node, names: Mapping[str, ExpressionTraits], allowed: int) -> Node | None:
    """Return the first smallest part with more than ``allowed`` time derivatives, else None."""
    rates = _rates(node, names)
    offending = [part for part in walk(node) if rates[id(part)] > allowed]
    return min(offending, key=lambda part: part.span[1] - part.span[0], default=None)
