"""JSON Schema of the scene language, by which editors complete and check scenes.

It lists the keys and the kind of value that each takes. The meaning of values, names and
expressions among them, is checked by the reader alone.
"""

from __future__ import annotations

from typing import get_args

from lagrange_cli.scene.body_schema import BODY, CONSTRAINT, FRAME, POINT
from lagrange_cli.scene.conditions import Formulation
from lagrange_cli.scene.schema_parts import (
    DESCRIPTION,
    LATEX,
    NUMBER_OR_TEXT,
    PAIR,
    POSITION,
    POSITIVE,
    UNIT,
    Schema,
    either,
    expression_of,
    list_of,
    mapping_of,
    named,
    one_of,
    reference_to,
    text_of,
    words_of,
)

#: The draft that editors of YAML read.
DRAFT = "http://json-schema.org/draft-07/schema#"

_EQUATION = text_of("Left side = right side")

_PARAMETER = either(
    expression_of("Its value: a number, or an expression in other parameters"),
    mapping_of(
        "A parameter",
        {
            "value": expression_of("Its value; without one it stays a symbol"),
            "unit": UNIT,
            "positive": POSITIVE,
            "description": DESCRIPTION,
            "latex": LATEX,
        },
    ),
)

_COLUMN = {
    "file": words_of("The CSV file, in the folder of the scene or below"),
    "column": words_of("Name of the column with its values"),
}

_INPUT = either(
    expression_of("Its value over t and parameters"),
    mapping_of(
        "Values of a CSV file",
        {
            **_COLUMN,
            "interpolation": one_of("previous linear cubic", "Between rows; linear by default"),
        },
        ["file", "column"],
    ),
)


def _state(moved_by: str, description: str) -> Schema:
    texts = {"unit": UNIT, "description": DESCRIPTION, "latex": LATEX}
    moved = {moved_by: expression_of(description)}
    return either(moved[moved_by], mapping_of("A state", moved | texts, [moved_by]))


_SWITCH = mapping_of(
    "A state that inequalities make 1 and 0",
    {
        "on": text_of("Makes it 1"),
        "off": text_of("Makes it 0"),
        "description": DESCRIPTION,
        "latex": LATEX,
    },
    ["on", "off"],
)

_CONTROLLER = mapping_of(
    "Samples the state and holds inputs until the next sample",
    {
        "every": expression_of("Time between samples: a number or the name of a parameter"),
        "hold": named(expression_of("Its value from a sample to the next"), "Inputs that it sets"),
        "memory": named(_state("next", "Its value behind a sample"), "What it keeps, as sums"),
    },
    ["every"],
)

_FUNCTION = either(
    text_of("Name of its argument"),
    mapping_of(
        "A function of one argument",
        {
            "of": text_of("Name of its argument"),
            "equals": expression_of("Its value over the argument and parameters"),
            "latex": LATEX,
        },
        ["of"],
    ),
    mapping_of(
        "A table",
        {
            "of": either(
                expression_of("Its argument"), list_of(expression_of("One of them"), "Two")
            ),
            **_COLUMN,
            "interpolation": one_of("monotone linear cubic", "Between rows; by default monotone"),
            "outside": one_of("end hold extend", "Beyond them; the run ends by default"),
            "latex": LATEX,
        },
        ["of", "file", "column"],
    ),
)

_PARTICLE = mapping_of(
    "A point mass",
    {"mass": expression_of("Its mass"), "position": POSITION, "latex": LATEX},
    ["mass"],
)

_COORDINATE = mapping_of(
    "A coordinate",
    {"latex": LATEX, "unit": UNIT, "positive": POSITIVE, "description": DESCRIPTION},
)

_DEFINITION = either(
    expression_of("What the name stands for"),
    mapping_of(
        "A definition",
        {"equals": expression_of("What the name stands for"), "latex": LATEX},
        ["equals"],
    ),
)

_AMOUNTS = named(expression_of("Its amount"), "Particle or point: amount")

_POTENTIAL = either(
    expression_of("A term of V"),
    mapping_of(
        "The weight of every particle",
        {
            "gravity": expression_of("g"),
            "direction": list_of(expression_of("A component"), "Where to it pulls; else -z", 3),
        },
        ["gravity"],
    ),
    mapping_of(
        "A spring",
        {
            "spring": PAIR,
            "stiffness": expression_of("Its stiffness k"),
            "length": expression_of("Its natural length; 0 if left out"),
        },
        ["spring", "stiffness"],
    ),
    mapping_of(
        "Attraction of masses",
        {
            "newton": expression_of("The constant G"),
            "between": PAIR,
            "masses": {**_AMOUNTS, "description": "Masses of points that attract, too"},
        },
        ["newton"],
    ),
    mapping_of(
        "Forces between charges",
        {
            "coulomb": expression_of("The constant k"),
            "charges": {**_AMOUNTS, "description": "Charges of particles and points"},
        },
        ["coulomb", "charges"],
    ),
)

_ON = reference_to("A particle, a point or a coordinate")

_AXES_OF = reference_to("Frame or body along whose axes the components are; space without it")

_FORCE = either(
    mapping_of(
        "A force",
        {
            "on": _ON,
            "force": either(
                expression_of("On a coordinate: the generalized force"),
                list_of(expression_of("A component"), "On a particle or point: x, y, z", 3),
            ),
            "axes": _AXES_OF,
        },
        ["on", "force"],
    ),
    mapping_of(
        "A torque on a body",
        {
            "on": _ON,
            "torque": either(
                expression_of("In the plane of the scene, in the sense of its turns"),
                list_of(expression_of("A component"), "Its x, y, z", 3),
            ),
            "axes": _AXES_OF,
        },
        ["on", "torque"],
    ),
    mapping_of(
        "A force against the velocity",
        {"drag": expression_of("Its coefficient c, of -c v"), "on": _ON},
        ["drag", "on"],
    ),
    mapping_of(
        "A damper between two bodies",
        {"damper": PAIR, "coefficient": expression_of("Its coefficient c")},
        ["damper", "coefficient"],
    ),
)

_STATE = {
    "type": "object",
    "properties": {
        "t": expression_of("The time"),
        "within": expression_of("Largest difference"),
    },
    "required": ["t", "within"],
    "additionalProperties": expression_of("Value of x or dot(x)"),
    "description": "A state at a time",
}

_EXPECT = mapping_of(
    "What must come out; lagrange check compares",
    {
        "dof": {"type": NUMBER_OR_TEXT, "description": "Degrees of freedom"},
        "cyclic": list_of(text_of("A coordinate"), "Cyclic coordinates, all of them"),
        "conserved": list_of(text_of("A quantity, as energy or p_theta"), "What is conserved"),
        "equations": either(
            list_of(_EQUATION, "Equations of motion, up to factors"),
            named(_EQUATION, "Equations of motion by names, families among them"),
        ),
        "lagrangian": expression_of("L, up to a total time derivative"),
        "hamiltonian": expression_of("H over coordinates and momenta p_NAME"),
        "state": either(_STATE, list_of(_STATE, "States at several times")),
        "drift": named(expression_of("Largest relative change"), "Bounds, as energy: 1e-9"),
        "events": list_of(
            mapping_of(
                "An event",
                {
                    "name": text_of("contact:NAME, release:NAME or zeno:NAME"),
                    "t": expression_of("Its time"),
                    "within": expression_of("Largest difference"),
                },
                ["name"],
            ),
            "Events in their order",
        ),
        "equilibrium": either(
            _EQUATION,
            list_of(_EQUATION, "Equations that hold together"),
        ),
        "equilibria": list_of(
            {
                "type": "object",
                "properties": {"stability": words_of("stable, unstable, ...")},
                "additionalProperties": expression_of("Value of the coordinate"),
                "description": "An equilibrium",
            },
            "Equilibria",
        ),
        "frequencies": list_of(expression_of("A number"), "Angular frequencies of the modes"),
        "error": mapping_of(
            "The scene must be refused so",
            {"kind": words_of("Kind of the refusal"), "contains": words_of("Words of the message")},
        ),
    },
)

_SIMULATE = mapping_of(
    "Defaults of lagrange simulate",
    {
        "until": expression_of("End time"),
        "from": expression_of("Start time; 0 if left out"),
        "accuracy": expression_of("Largest error, as a part of its scale"),
        "samples": expression_of("Number of samples, both ends included"),
        "step": expression_of("Time between samples"),
        "rtol": expression_of("Relative tolerance of a step, with a method"),
        "atol": expression_of("Absolute tolerance of a step, with a method"),
        "method": words_of("Integration method, as DOP853"),
        "formulation": {"enum": list(get_args(Formulation)), "description": "Form of equations"},
    },
)

#: Name of a section → its schema.
SECTIONS: dict[str, Schema] = {
    "name": words_of("An identifier, for files and emitted code"),
    "title": words_of("One line"),
    "description": words_of("Some lines"),
    "sizes": named(
        {"type": NUMBER_OR_TEXT, "description": "A whole number"},
        "Numbers of elements of families",
    ),
    "parameters": named(_PARAMETER, "Constants of the problem"),
    "inputs": either(
        named(_INPUT, "Functions of time that drive the system"),
        list_of(text_of("A name"), "Inputs that emitted code is given"),
    ),
    "states": named(
        either(
            _state("rate", "Its rate over coordinates, velocities, states, inputs and t"), _SWITCH
        ),
        "Numbers that their rates move, as currents, or inequalities switch",
    ),
    "controllers": either(_CONTROLLER, named(_CONTROLLER, "Sampled controllers by name")),
    "functions": named(_FUNCTION, "Functions of one argument, unknown or given, and tables"),
    "particles": named(_PARTICLE, "Point masses"),
    "plane": one_of("xy xz yz", "Every particle and body stays in this plane"),
    "frames": named(FRAME, "Axes that stand on others and turn against them"),
    "bodies": named(BODY, "Rigid bodies"),
    "points": named(POINT, "Positions without mass"),
    "coordinates": either(
        list_of(text_of("A name"), "Generalized coordinates"),
        named(_COORDINATE, "Generalized coordinates"),
    ),
    "definitions": named(_DEFINITION, "Cartesian names over coordinates, and abbreviations"),
    "constraints": named(CONSTRAINT, "Equations and inequalities that always hold"),
    "potentials": named(_POTENTIAL, "Terms of the potential energy V"),
    "kinetic": named(expression_of("A term of T"), "Kinetic energy beyond that of the particles"),
    "forces": named(_FORCE, "Forces that have no potential"),
    "dissipation": named(expression_of("A term of D"), "Rayleigh's dissipation function"),
    "outputs": named(expression_of("What it stands for"), "Further columns of trajectories"),
    "initial": named(expression_of("Value of x or dot(x)"), "The state at the start"),
    "near": named(expression_of("Value of x"), "A configuration that tells branches apart"),
    "simulate": _SIMULATE,
    "expect": _EXPECT,
}


def scene_schema() -> Schema:
    """Return the JSON Schema of a scene, of draft 7."""
    return {"$schema": DRAFT, "title": "Scene of lagrange", **mapping_of("A scene", SECTIONS)}
