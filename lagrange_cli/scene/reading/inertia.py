"""Reading ``mass``, ``centre`` and ``inertia`` of a body: moments, a tensor, or a shape.

The tensor that comes out is about the centre of mass, in the body's axes. Moments of bodies of
uniform density are those of H. Goldstein, C. Poole and J. Safko, Classical Mechanics (3rd ed.,
2002), section 5.3, and of any table.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction

from lagrange_cli.scene.bodies import Shape, ShapeKind
from lagrange_cli.scene.language.bounds import extent_of
from lagrange_cli.scene.language.expression import Expression, Node, Number
from lagrange_cli.scene.language.rotations import (
    ZERO,
    is_zero,
    minus,
    product,
    quotient,
    square,
    total,
    whole,
)
from lagrange_cli.scene.language.tokens import ExpressionError
from lagrange_cli.scene.reading.declarations import AXES
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.interactions import flat, helper_part
from lagrange_cli.scene.reading.source import Mapping as Entries
from lagrange_cli.scene.reading.source import Scalar, Sequence, SourceNode

_ROWS = "a list of three moments [Ixx, Iyy, Izz], a 3 x 3 matrix, or a shape"
_MOMENT = "one moment of inertia, or a shape"


def read_inertia(
    node: SourceNode,
    what: str,
    reading: Reading,
    mass: Node,
    centre: tuple[Node, ...],
    across: int | None,
) -> tuple[Node, ...] | None:
    """Read the tensor about the centre of mass, nine entries by rows; None if it is refused.

    Parameters
    ----------
    mass, centre
        Mass, and centre of mass in the body's axes.
    across
        Number of the axis across the plane that the body moves in; None in space.
    """
    if not isinstance(node, Entries):
        return _moments(node, what, reading, across)
    keys = [key.text for key, _ in node.entries]
    if "about" not in keys:
        return _shape(node, what, reading, mass, across)
    fields = reading.fields(
        node, f"'inertia' of {what}", ("about", "moments"), required=("about", "moments")
    )
    about = fields["about"]
    if not (isinstance(about, Scalar) and about.text in ("origin", "centre")):
        reading.expected("origin or centre", f"'about' of {what}", about)
        return None
    if "moments" not in fields:
        return None
    tensor = _moments(fields["moments"], what, reading, across)
    if tensor is None or about.text == "centre":
        return tensor
    return _about_centre(tensor, mass, centre, across)


def _about_centre(
    tensor: tuple[Node, ...], mass: Node, centre: tuple[Node, ...], across: int | None
) -> tuple[Node, ...]:
    """Subtract m (c² 1 − c cᵀ), by the theorem of parallel axes."""
    squares = [square(c) for c in centre]
    entries = []
    for i in range(3):
        for j in range(3):
            shift = minus(product(centre[i], centre[j]))
            if i == j:
                shift = total([squares[k] for k in range(3) if k != i])
            outside = across is not None and not i == j == across
            entries.append(
                ZERO if outside else total([tensor[3 * i + j], minus(product(mass, shift))])
            )
    return tuple(entries)


def _moments(
    node: SourceNode, what: str, reading: Reading, across: int | None
) -> tuple[Node, ...] | None:
    """Read one moment in a plane; in space three along the axes, or a symmetric matrix."""
    label = f"'inertia' of {what}"
    if across is not None and isinstance(node, Scalar):
        moment = helper_part(node, "inertia", what, reading)
        return None if moment is None else _diagonal({across: moment.node})
    if not isinstance(node, Sequence) or len(node.items) != 3:
        reading.expected(_MOMENT if across is not None else _ROWS, label, node)
        return None
    if not any(isinstance(item, Sequence) for item in node.items):
        read = [helper_part(item, "inertia", what, reading) for item in node.items]
        moments = {k: part.node for k, part in enumerate(read) if part is not None}
        if len(moments) < 3:
            return None
        return _diagonal({across: moments[across]} if across is not None else moments)
    rows = [item for item in node.items if isinstance(item, Sequence) and len(item.items) == 3]
    if len(rows) < 3:
        reading.expected(_ROWS, label, node)
        return None
    parts = [helper_part(item, "inertia", what, reading) for row in rows for item in row.items]
    entries = [part for part in parts if part is not None]
    if len(entries) < 9:
        return None
    for i, j in ((0, 1), (0, 2), (1, 2)):
        if flat(entries[3 * i + j]) != flat(entries[3 * j + i]):
            reading.problems.add(
                f"{label} is not symmetric: {flat(entries[3 * i + j])} beside"
                f" {flat(entries[3 * j + i])}",
                entries[3 * j + i].mark(),
                rule="inertia",
            )
            return None
    tensor = [entry.node for entry in entries]
    if across is None:
        return tuple(tensor)
    if any(not is_zero(tensor[3 * across + k]) for k in range(3) if k != across):
        reading.problems.add(
            f"{label} turns the body out of the plane of the scene",
            node.mark,
            hint="products of inertia with the axis across the plane are 0 there",
            rule="inertia",
        )
        return None
    return _diagonal({across: tensor[4 * across]})


def _diagonal(moments: Mapping[int, Node]) -> tuple[Node, ...]:
    return tuple(moments.get(k // 4, ZERO) if k % 4 == 0 else ZERO for k in range(9))


#: A shape's moments: along its axis and across it, or along x, y, z.
_Moments = tuple[Node, ...]


def _rod(mass: Node, sizes: tuple[Node, ...]) -> _Moments:
    return ZERO, _part(mass, 12, square(sizes[0]))


def _disk(mass: Node, sizes: tuple[Node, ...]) -> _Moments:
    radius = square(sizes[0])
    return _part(mass, 2, radius), _part(mass, 4, radius)


def _sphere(mass: Node, sizes: tuple[Node, ...]) -> _Moments:
    moment = _part(mass, 5, product(whole(2), square(sizes[0])))
    return moment, moment


def _cylinder(mass: Node, sizes: tuple[Node, ...]) -> _Moments:
    radius, height = map(square, sizes)
    across = total([product(whole(3), radius), height])
    return _part(mass, 2, radius), _part(mass, 12, across)


def _box(mass: Node, sizes: tuple[Node, ...]) -> _Moments:
    a, b, c = map(square, sizes)
    return tuple(_part(mass, 12, total(pair)) for pair in ([b, c], [a, c], [a, b]))


def _part(mass: Node, divisor: int, length_squared: Node) -> Node:
    return quotient(product(mass, length_squared), whole(divisor))


#: Shapes of uniform density: the number of their sizes, and their moments.
_SHAPES: dict[ShapeKind, tuple[int, Callable[[Node, tuple[Node, ...]], _Moments]]] = {
    "rod": (1, _rod),
    "disk": (1, _disk),
    "sphere": (1, _sphere),
    "cylinder": (2, _cylinder),
    "box": (3, _box),
}

_BY_NAME = {str(kind): law for kind, law in _SHAPES.items()}

#: Shapes whose axis in a plane is the one across it: they roll in it.
_ROUND = ("disk", "cylinder")


def _shape(
    node: Entries, what: str, reading: Reading, mass: Node, across: int | None
) -> tuple[Node, ...] | None:
    label = f"'inertia' of {what}"
    shape = next((key for key, _ in node.entries if key.text in _BY_NAME), None)
    if shape is None:
        first = node.entries[0][0] if node.entries else None
        if first is None:
            reading.expected(_ROWS, label, node)
        else:
            reading.unknown_key(first, label, (*_SHAPES, "about"))
        return None
    fields = reading.fields(node, label, (shape.text, "axis"))
    number, moments_of = _BY_NAME[shape.text]
    parts = _sizes(fields[shape.text], number, f"'{shape.text}' of {what}", reading)
    sizes = None if parts is None else tuple(part.node for part in parts)
    along = _usual_axis(shape.text, across)
    if "axis" in fields:
        axis = fields["axis"]
        if shape.text in ("box", "sphere") or not (isinstance(axis, Scalar) and axis.text in AXES):
            wanted = "no axis" if shape.text in ("box", "sphere") else "x, y or z"
            reading.expected(wanted, f"'axis' of {what}", axis)
            return None
        along = AXES.index(axis.text)
    if sizes is None:
        return None
    moments = moments_of(mass, sizes)
    if len(moments) == 2:
        moments = tuple(moments[0 if k == along else 1] for k in range(3))
    return _diagonal({k: moments[k] for k in range(3) if across is None or k == across})


def _usual_axis(shape: str, across: int | None) -> int:
    return 2 if across is None or shape not in _ROUND else across


def shape_of(node: SourceNode, what: str, reading: Reading, across: int | None) -> Shape | None:
    """Return the shape that an inertia is written by, which has been read; None of moments."""
    if not isinstance(node, Entries):
        return None
    fields = {key.text: value for key, value in node.entries}
    for kind, (number, _) in _SHAPES.items():
        if kind in fields:
            sizes = _sizes(fields[kind], number, f"'{kind}' of {what}", reading)
            written = fields.get("axis")
            axis = AXES.index(written.text) if isinstance(written, Scalar) else None
            along = _usual_axis(kind, across) if axis is None else axis
            return None if sizes is None else Shape(kind, along, sizes)
    return None


def _sizes(
    node: SourceNode, number: int, what: str, reading: Reading
) -> tuple[Expression, ...] | None:
    """Read the lengths of a shape, which are not negative."""
    items = node.items if isinstance(node, Sequence) else (node,)
    if len(items) != number:
        wanted = "one length" if number == 1 else f"a list of {number} lengths"
        reading.expected(wanted, what, node)
        return None
    parts = [helper_part(item, "inertia", what, reading) for item in items]
    sizes = [part for part in parts if part is not None]
    for part in sizes:
        value = number_of(part.node)
        if value is not None and value < 0:
            reading.problems.add(
                f"a length cannot be negative, found {flat(part)}", part.mark(), rule="inertia"
            )
            return None
    return tuple(sizes) if len(sizes) == number else None


def number_of(node: Node) -> Fraction | float | None:
    """Return the value of an expression without names; None if it has any."""
    if isinstance(node, Number):
        return node.value
    try:
        return extent_of(node, {}).value
    except (ExpressionError, OverflowError, KeyError):
        return None
