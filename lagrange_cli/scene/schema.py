"""JSON Schema of the scene language, by which editors complete and check scenes.

It lists the keys and the kind of value that each takes. The meaning of values, names and
expressions among them, is checked by the reader alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias, get_args

from lagrange_cli.scene.conditions import Formulation

#: A part of a schema.
Schema: TypeAlias = dict[str, Any]

#: The draft that editors of YAML read.
DRAFT = "http://json-schema.org/draft-07/schema#"

_NUMBER_OR_TEXT = ["number", "string"]


def _text(description: str) -> Schema:
    return {"type": "string", "description": description}


def _expression(description: str) -> Schema:
    return {"type": _NUMBER_OR_TEXT, "description": description}


def _list_of(items: Schema, description: str, number: int | None = None) -> Schema:
    exactly = {} if number is None else {"minItems": number, "maxItems": number}
    return {"type": "array", "items": items, **exactly, "description": description}


def _mapping(description: str, keys: Mapping[str, Schema], required: Sequence[str] = ()) -> Schema:
    """Return the schema of a mapping with these keys and no others."""
    needed = {"required": list(required)} if required else {}
    return {
        "type": "object",
        "properties": dict(keys),
        "additionalProperties": False,
        **needed,
        "description": description,
    }


def _named(value: Schema, description: str) -> Schema:
    """Return the schema of a mapping whose keys are names that the user chooses."""
    return {"type": "object", "additionalProperties": value, "description": description}


def _one_of(words: str, description: str) -> Schema:
    return {"enum": words.split(), "description": description}


def _either(*kinds: Schema) -> Schema:
    return {"anyOf": list(kinds)}


_LATEX = _text(r"Symbol in LaTeX: letters, digits, scripts, macros as \omega_{0}")
_UNIT = _text("Unit, as kg m^2/s; checked")
_DESCRIPTION = _text("Words that are printed beside it")
_POSITIVE = {"type": "boolean", "description": "It stays above zero"}
_POSITION = _list_of(_expression("A component, or a new name for it"), "Position x, y, z", 3)
_PAIR = _list_of(_text("A particle, a point or origin"), "Two bodies, [A, B]", 2)
_EQUATION = _text("Left side = right side")

_PARAMETER = _either(
    _expression("Its value: a number, or an expression in other parameters"),
    _mapping(
        "A parameter",
        {
            "value": _expression("Its value; without one it stays a symbol"),
            "unit": _UNIT,
            "positive": _POSITIVE,
            "description": _DESCRIPTION,
            "latex": _LATEX,
        },
    ),
)

_COLUMN = {
    "file": _text("The CSV file, in the folder of the scene or below"),
    "column": _text("Name of the column with its values"),
}

_INPUT = _either(
    _expression("Its value over t and parameters"),
    _mapping(
        "Values of a CSV file",
        {
            **_COLUMN,
            "interpolation": _one_of("previous linear cubic", "Between rows; linear by default"),
        },
        ["file", "column"],
    ),
)

_STATE_OF_FIRST_ORDER = _either(
    _expression("Its rate over coordinates, velocities, states, inputs and t"),
    _mapping(
        "A state of first order",
        {
            "rate": _expression("Its time derivative"),
            "unit": _UNIT,
            "description": _DESCRIPTION,
            "latex": _LATEX,
        },
        ["rate"],
    ),
)

_FUNCTION = _either(
    _text("Name of its argument"),
    _mapping(
        "A function of one argument",
        {
            "of": _text("Name of its argument"),
            "equals": _expression("Its value over the argument and parameters"),
            "latex": _LATEX,
        },
        ["of"],
    ),
    _mapping(
        "A table",
        {
            "of": _either(_expression("Its argument"), _list_of(_expression("One of them"), "Two")),
            **_COLUMN,
            "interpolation": _one_of("monotone linear cubic", "Between rows; by default monotone"),
            "outside": _one_of("end hold extend", "Beyond them; the run ends by default"),
            "latex": _LATEX,
        },
        ["of", "file", "column"],
    ),
)

_PARTICLE = _mapping(
    "A point mass",
    {"mass": _expression("Its mass"), "position": _POSITION, "latex": _LATEX},
    ["mass"],
)

_VECTOR = _list_of(_expression("A component"), "Components along the axes", 3)

_STANDS_ON = _text("The frame or body that it stands on; space without it")

_ABOUT = {axis: _expression(f"Angle about {axis}") for axis in ("x", "y", "z")}

_TURN = _mapping(
    "A turn about an axis", {**_ABOUT, "axis": _VECTOR, "angle": _expression("Angle about 'axis'")}
)

_PLACED: dict[str, Schema] = {
    "on": _STANDS_ON,
    "at": {**_VECTOR, "description": "Its origin in the axes of what it stands on"},
    "turn": _either(
        _expression("Angle in the plane of the scene"),
        _TURN,
        _list_of(_TURN, "Turns, each about an axis as those before it left it"),
    ),
}

_MOMENTS = _either(
    _expression("Moment of inertia in the plane of the scene"),
    _list_of(
        _either(_expression("A moment"), _VECTOR), "Three moments, or the rows of a matrix", 3
    ),
)

_SHAPES = {
    "rod": _expression("Its length"),
    "disk": _expression("Its radius"),
    "sphere": _expression("Its radius"),
    "cylinder": _list_of(_expression("A length"), "Its radius and height", 2),
    "box": _list_of(_expression("A length"), "Its edges along x, y, z", 3),
}

_INERTIA = _either(
    _MOMENTS,
    _mapping(
        "Moments about the centre of mass or the origin of the body",
        {"about": {"enum": ["origin", "centre"]}, "moments": _MOMENTS},
        ["about", "moments"],
    ),
    *(
        _mapping(
            "A shape of uniform density",
            {shape: size, "axis": _one_of("x y z", "Its axis in the body")},
            [shape],
        )
        for shape, size in _SHAPES.items()
    ),
)

_FRAME = _mapping("A frame", _PLACED)

_BODY = _mapping(
    "A rigid body",
    {
        **_PLACED,
        "mass": _expression("Its mass"),
        "centre": {**_VECTOR, "description": "Its centre of mass in its axes"},
        "inertia": _INERTIA,
        "latex": _LATEX,
    },
    ["mass"],
)

_POINT = _either(
    _POSITION,
    _mapping("A point", {"position": _POSITION, "latex": _LATEX}, ["position"]),
    _mapping(
        "A point of a frame or body", {"on": _STANDS_ON, "at": _VECTOR, "latex": _LATEX}, ["on"]
    ),
)

_COORDINATE = _mapping(
    "A coordinate",
    {"latex": _LATEX, "unit": _UNIT, "positive": _POSITIVE, "description": _DESCRIPTION},
)

_DEFINITION = _either(
    _expression("What the name stands for"),
    _mapping(
        "A definition",
        {"equals": _expression("What the name stands for"), "latex": _LATEX},
        ["equals"],
    ),
)

_NOTATION = {"latex": _LATEX, "multiplier": _text("Symbol of its multiplier in LaTeX")}
_RELATION = _text("An equation =, or an inequality >= or <= between positions")
_RELATIONS = _either(_RELATION, _list_of(_RELATION, "Several at once"))

_CONSTRAINT = _either(
    *_RELATIONS["anyOf"],
    _mapping(
        "Two particles or points keep a distance",
        {"distance": _PAIR, "equals": _expression("The distance"), **_NOTATION},
        ["distance", "equals"],
    ),
    _mapping(
        "A one-sided constraint",
        {
            "unilateral": _text("An inequality >= or <= between positions"),
            "restitution": _expression("Newton's coefficient, from 0 to 1"),
            **_NOTATION,
        },
        ["unilateral"],
    ),
    _mapping("An equation, and how it prints", {"equation": _RELATIONS, **_NOTATION}, ["equation"]),
)

_AMOUNTS = _named(_expression("Its amount"), "Particle or point: amount")

_POTENTIAL = _either(
    _expression("A term of V"),
    _mapping(
        "The weight of every particle",
        {
            "gravity": _expression("g"),
            "direction": _list_of(_expression("A component"), "Where to it pulls; else -z", 3),
        },
        ["gravity"],
    ),
    _mapping(
        "A spring",
        {
            "spring": _PAIR,
            "stiffness": _expression("Its stiffness k"),
            "length": _expression("Its natural length; 0 if left out"),
        },
        ["spring", "stiffness"],
    ),
    _mapping(
        "Attraction of masses",
        {
            "newton": _expression("The constant G"),
            "between": _PAIR,
            "masses": {**_AMOUNTS, "description": "Masses of points that attract, too"},
        },
        ["newton"],
    ),
    _mapping(
        "Forces between charges",
        {
            "coulomb": _expression("The constant k"),
            "charges": {**_AMOUNTS, "description": "Charges of particles and points"},
        },
        ["coulomb", "charges"],
    ),
)

_ON = _text("A particle, a point or a coordinate")

_AXES_OF = _text("Frame or body along whose axes the components are; space without it")

_FORCE = _either(
    _mapping(
        "A force",
        {
            "on": _ON,
            "force": _either(
                _expression("On a coordinate: the generalized force"),
                _list_of(_expression("A component"), "On a particle or point: x, y, z", 3),
            ),
            "axes": _AXES_OF,
        },
        ["on", "force"],
    ),
    _mapping(
        "A torque on a body",
        {
            "on": _ON,
            "torque": _either(
                _expression("In the plane of the scene, in the sense of its turns"),
                _list_of(_expression("A component"), "Its x, y, z", 3),
            ),
            "axes": _AXES_OF,
        },
        ["on", "torque"],
    ),
    _mapping(
        "A force against the velocity",
        {"drag": _expression("Its coefficient c, of -c v"), "on": _ON},
        ["drag", "on"],
    ),
    _mapping(
        "A damper between two bodies",
        {"damper": _PAIR, "coefficient": _expression("Its coefficient c")},
        ["damper", "coefficient"],
    ),
)

_STATE = {
    "type": "object",
    "properties": {
        "t": _expression("The time"),
        "within": _expression("Largest difference"),
    },
    "required": ["t", "within"],
    "additionalProperties": _expression("Value of x or dot(x)"),
    "description": "A state at a time",
}

_EXPECT = _mapping(
    "What must come out; lagrange check compares",
    {
        "dof": {"type": _NUMBER_OR_TEXT, "description": "Degrees of freedom"},
        "cyclic": _list_of(_text("A coordinate"), "Cyclic coordinates, all of them"),
        "conserved": _list_of(_text("A quantity, as energy or p_theta"), "What is conserved"),
        "equations": _either(
            _list_of(_EQUATION, "Equations of motion, up to factors"),
            _named(_EQUATION, "Equations of motion by names, families among them"),
        ),
        "lagrangian": _expression("L, up to a total time derivative"),
        "hamiltonian": _expression("H over coordinates and momenta p_NAME"),
        "state": _either(_STATE, _list_of(_STATE, "States at several times")),
        "drift": _named(_expression("Largest relative change"), "Bounds, as energy: 1e-9"),
        "events": _list_of(
            _mapping(
                "An event",
                {
                    "name": _text("contact:NAME, release:NAME or zeno:NAME"),
                    "t": _expression("Its time"),
                    "within": _expression("Largest difference"),
                },
                ["name"],
            ),
            "Events in their order",
        ),
        "equilibrium": _either(
            _EQUATION,
            _list_of(_EQUATION, "Equations that hold together"),
        ),
        "equilibria": _list_of(
            {
                "type": "object",
                "properties": {"stability": _text("stable, unstable, ...")},
                "additionalProperties": _expression("Value of the coordinate"),
                "description": "An equilibrium",
            },
            "Equilibria",
        ),
        "frequencies": _list_of(_expression("A number"), "Angular frequencies of the modes"),
        "error": _mapping(
            "The scene must be refused so",
            {"kind": _text("Kind of the refusal"), "contains": _text("Words of the message")},
        ),
    },
)

_SIMULATE = _mapping(
    "Defaults of lagrange simulate",
    {
        "until": _expression("End time"),
        "from": _expression("Start time; 0 if left out"),
        "accuracy": _expression("Largest error, as a part of its scale"),
        "samples": _expression("Number of samples, both ends included"),
        "step": _expression("Time between samples"),
        "rtol": _expression("Relative tolerance of a step, with a method"),
        "atol": _expression("Absolute tolerance of a step, with a method"),
        "method": _text("Integration method, as DOP853"),
        "formulation": {"enum": list(get_args(Formulation)), "description": "Form of equations"},
    },
)

#: Name of a section → its schema.
SECTIONS: dict[str, Schema] = {
    "name": _text("An identifier, for files and emitted code"),
    "title": _text("One line"),
    "description": _text("Some lines"),
    "sizes": _named(
        {"type": _NUMBER_OR_TEXT, "description": "A whole number"},
        "Numbers of elements of families",
    ),
    "parameters": _named(_PARAMETER, "Constants of the problem"),
    "inputs": _either(
        _named(_INPUT, "Functions of time that drive the system"),
        _list_of(_text("A name"), "Inputs that emitted code is given"),
    ),
    "states": _named(_STATE_OF_FIRST_ORDER, "Numbers that their rates move, as currents"),
    "functions": _named(_FUNCTION, "Functions of one argument, unknown or given, and tables"),
    "particles": _named(_PARTICLE, "Point masses"),
    "plane": _one_of("xy xz yz", "Every particle and body stays in this plane"),
    "frames": _named(_FRAME, "Axes that stand on others and turn against them"),
    "bodies": _named(_BODY, "Rigid bodies"),
    "points": _named(_POINT, "Positions without mass"),
    "coordinates": _either(
        _list_of(_text("A name"), "Generalized coordinates"),
        _named(_COORDINATE, "Generalized coordinates"),
    ),
    "definitions": _named(_DEFINITION, "Cartesian names over coordinates, and abbreviations"),
    "constraints": _named(_CONSTRAINT, "Equations and inequalities that always hold"),
    "potentials": _named(_POTENTIAL, "Terms of the potential energy V"),
    "kinetic": _named(_expression("A term of T"), "Kinetic energy beyond that of the particles"),
    "forces": _named(_FORCE, "Forces that have no potential"),
    "dissipation": _named(_expression("A term of D"), "Rayleigh's dissipation function"),
    "outputs": _named(_expression("What it stands for"), "Further columns of trajectories"),
    "initial": _named(_expression("Value of x or dot(x)"), "The state at the start"),
    "near": _named(_expression("Value of x"), "A configuration that tells branches apart"),
    "simulate": _SIMULATE,
    "expect": _EXPECT,
}


def scene_schema() -> Schema:
    """Return the JSON Schema of a scene, of draft 7."""
    return {"$schema": DRAFT, "title": "Scene of lagrange", **_mapping("A scene", SECTIONS)}
