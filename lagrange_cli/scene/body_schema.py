"""JSON Schema of frames, bodies, points on them, and constraints between them."""

from __future__ import annotations

from lagrange_cli.scene.schema_parts import (
    LATEX,
    PAIR,
    POSITION,
    Schema,
    either,
    expression_of,
    list_of,
    mapping_of,
    one_of,
    reference_to,
    text_of,
    words_of,
)

_VECTOR = list_of(expression_of("A component"), "Components along the axes", 3)

_STANDS_ON = reference_to("The frame or body that it stands on; space without it")

_ABOUT = {axis: expression_of(f"Angle about {axis}") for axis in ("x", "y", "z")}

_TURN = mapping_of(
    "A turn about an axis, or by a quaternion",
    {
        **_ABOUT,
        "axis": _VECTOR,
        "angle": expression_of("Angle about 'axis'"),
        "quaternion": list_of(
            text_of("A coordinate"), "A quaternion of length 1, its scalar first", 4
        ),
    },
)

_PLACED: dict[str, Schema] = {
    "on": _STANDS_ON,
    "at": {**_VECTOR, "description": "Its origin in the axes of what it stands on"},
    "turn": either(
        expression_of("Angle in the plane of the scene"),
        _TURN,
        list_of(_TURN, "Turns, each about an axis as those before it left it"),
    ),
}

_MOMENTS = either(
    expression_of("Moment of inertia in the plane of the scene"),
    list_of(
        either(expression_of("A moment"), _VECTOR), "Three moments, or the rows of a matrix", 3
    ),
)

_SHAPES = {
    "rod": expression_of("Its length"),
    "disk": expression_of("Its radius"),
    "sphere": expression_of("Its radius"),
    "cylinder": list_of(expression_of("A length"), "Its radius and height", 2),
    "box": list_of(expression_of("A length"), "Its edges along x, y, z", 3),
}

_INERTIA = either(
    _MOMENTS,
    mapping_of(
        "Moments about the centre of mass or the origin of the body",
        {"about": {"enum": ["origin", "centre"]}, "moments": _MOMENTS},
        ["about", "moments"],
    ),
    *(
        mapping_of(
            "A shape of uniform density",
            {shape: size, "axis": one_of("x y z", "Its axis in the body")},
            [shape],
        )
        for shape, size in _SHAPES.items()
    ),
)

FRAME = mapping_of("A frame", _PLACED)

BODY = mapping_of(
    "A rigid body",
    {
        **_PLACED,
        "mass": expression_of("Its mass"),
        "centre": {**_VECTOR, "description": "Its centre of mass in its axes"},
        "inertia": _INERTIA,
        "latex": LATEX,
    },
    ["mass"],
)

POINT = either(
    POSITION,
    mapping_of("A point", {"position": POSITION, "latex": LATEX}, ["position"]),
    mapping_of(
        "A point of a frame or body", {"on": _STANDS_ON, "at": _VECTOR, "latex": LATEX}, ["on"]
    ),
)

_NOTATION = {"latex": LATEX, "multiplier": words_of("Symbol of its multiplier in LaTeX")}
_RELATION = text_of("An equation =, or an inequality >= or <= between positions")
_RELATIONS = either(_RELATION, list_of(_RELATION, "Several at once"))

_DIRECTION = either(one_of("x y z", "An axis"), _VECTOR)

_DIRECTION_OF_BODY = either(
    _DIRECTION,
    {
        "type": "array",
        "items": [_DIRECTION, reference_to("The frame or body that it is fixed in")],
        "minItems": 2,
        "maxItems": 2,
    },
)

_JOINTS = (
    ("pin", PAIR, "Two particles or points coincide"),
    ("parallel", list_of(_DIRECTION_OF_BODY, "Two directions", 2), "Two directions are parallel"),
    ("weld", list_of(reference_to("A frame or body"), "Two of them", 2), "Two frames coincide"),
)

_ROUND: dict[str, Schema] = {
    "point": either(reference_to("A point"), _VECTOR),
    "inside": {"type": "boolean", "description": "True if bodies touch it from inside"},
    "on": reference_to("The frame that it is fixed in; space without it"),
}

_SURFACE = {
    "radius": expression_of("Radius of the disk or sphere"),
    "axis": {**_DIRECTION, "description": "Axis of a disk in its body; without it, a sphere"},
    "on": either(
        reference_to("A frame, whose xy plane it is"),
        mapping_of(
            "A plane",
            {
                "point": either(reference_to("A point"), _VECTOR),
                "normal": {**_DIRECTION, "description": "Its normal, to the side of the body"},
                "on": reference_to("The frame that it is fixed in; space without it"),
            },
            ["normal"],
        ),
        mapping_of("A sphere", {"sphere": expression_of("Its radius"), **_ROUND}, ["sphere"]),
        mapping_of(
            "A cylinder",
            {
                "cylinder": expression_of("Its radius"),
                "axis": {**_DIRECTION, "description": "Its axis, in space"},
                **_ROUND,
            },
            ["cylinder"],
        ),
    ),
}

_ON_SURFACES = {
    "touch": "The nearest point of a disk or sphere stays on a surface",
    "roll": "A disk or sphere rolls on a surface without slip",
}

CONSTRAINT = either(
    *_RELATIONS["anyOf"],
    mapping_of(
        "Two particles or points keep a distance",
        {"distance": PAIR, "equals": expression_of("The distance"), **_NOTATION},
        ["distance", "equals"],
    ),
    *(mapping_of(words, {key: value, **_NOTATION}, [key]) for key, value, words in _JOINTS),
    *(
        mapping_of(words, {key: _STANDS_ON, **_SURFACE, **_NOTATION}, [key, "radius", "on"])
        for key, words in _ON_SURFACES.items()
    ),
    mapping_of(
        "A one-sided constraint",
        {
            "unilateral": text_of("An inequality >= or <= between positions"),
            "restitution": expression_of("Newton's coefficient, from 0 to 1"),
            **_NOTATION,
        },
        ["unilateral"],
    ),
    mapping_of(
        "An equation, and how it prints", {"equation": _RELATIONS, **_NOTATION}, ["equation"]
    ),
)
