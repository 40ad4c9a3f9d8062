"""Sines and cosines of sums of angles, from those of the angles.

The positions of n links hold n angles, but their mass matrix holds the cosines
of n(n - 1)/2 differences: cos(a - b) = cos a cos b + sin a sin b needs fewer
calls. The error of each is at most that of a change of its angles by their own
rounding error, but no one change need explain all: where an exact solution of
M a = f counts on small differences to fit together, they keep their own sines.
"""

from __future__ import annotations

from collections.abc import Iterable

from lagrange_cli.program.graph.operands import Coefficient
from lagrange_cli.program.graph.value_graph import ONE, CallNode, SumNode, ValueGraph

#: Calls that must go for each that comes: few differences keep their own sines, which are
#: accurate however small.
_CALLS_SAVED = 4

_UNITS = (1, -1)


def expand_angle_sums(values: ValueGraph, order: Iterable[int]) -> None:
    """Rewrite sin(a ± b) and cos(a ± b) among the nodes ``order`` where far fewer calls result.

    Numbers of nodes keep their meaning.
    """
    circular: dict[int, CallNode] = {}
    for number in order:
        node = values.nodes[number]
        if isinstance(node, CallNode) and node.function in ("sin", "cos"):
            circular[number] = node
    angles = {number: _two_angles(values, node) for number, node in circular.items()}
    stay = {circular[number] for number, pair in angles.items() if pair is None}
    sums = {number: pair for number, pair in angles.items() if pair is not None}
    needed = {CallNode(f, (a,)) for pair in sums.values() for a in pair[:2] for f in ("sin", "cos")}
    if _CALLS_SAVED * len(needed - stay) < len(sums):
        for number, (a, b, sign) in sums.items():
            values.nodes[number] = _expanded(values, circular[number].function, a, b, sign)


def _two_angles(values: ValueGraph, node: CallNode) -> tuple[int, int, Coefficient] | None:
    """a, b and the sign of b where the argument is a ± b."""
    argument = values.nodes[node.arguments[0]]
    if not isinstance(argument, SumNode) or len(argument.terms) != 2:
        return None
    (a, first), (b, sign) = argument.terms
    return (a, b, sign) if first == 1 and sign in _UNITS and ONE not in (a, b) else None


def _expanded(values: ValueGraph, function: str, a: int, b: int, sign: Coefficient) -> SumNode:
    one = 1
    sin_a, cos_a, sin_b, cos_b = (
        (values.call(f, (one, angle)), 1) for angle in (a, b) for f in ("sin", "cos")
    )
    if function == "sin":
        products = [(sin_a, cos_b, one), (cos_a, sin_b, sign)]
    else:
        products = [(cos_a, cos_b, one), (sin_a, sin_b, -sign)]
    terms = {}
    for first, second, coefficient in products:
        scale, number = values.multiply([first, second])
        terms[number] = coefficient * scale
    return SumNode(tuple(sorted(terms.items())))
