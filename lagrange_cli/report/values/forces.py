"""Constraint forces and multipliers as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from lagrange_cli.notation.labels import multiplier_column
from lagrange_cli.report.contents.forces import magnitude
from lagrange_cli.report.values.json_types import (
    EXPRESSION,
    NAMES,
    TEXT,
    JsonObject,
    Key,
    list_of,
    one_of,
    or_null,
    through,
)

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.findings import BodyReaction, ConstraintForces, Reaction


class DerivedForces(NamedTuple):
    """The forces of some equations."""

    equations: Equations
    forces: ConstraintForces


class _Multiplier(NamedTuple):
    equations: Equations
    reaction: Reaction


_FORCE: JsonObject[BodyReaction] = JsonObject(
    Key("particle", TEXT, "Name of the particle or point.", lambda body: body.name),
    Key("components", list_of(EXPRESSION, 3), "The force along x, y and z."),
    Key(
        "magnitude",
        or_null(EXPRESSION),
        "Its magnitude, null without a short form.",
        lambda body: None if body.size is None else magnitude(body.size),
    ),
)
_SIZE: JsonObject[tuple[str, Expr]] = JsonObject(
    Key("particle", TEXT, "Name of the particle or point.", lambda pair: pair[0]),
    Key("along_gradient", EXPRESSION, "Its force along the gradient.", lambda pair: pair[1]),
)
_MULTIPLIER: JsonObject[_Multiplier] = JsonObject(
    Key(
        "name",
        TEXT,
        "Name of the column of simulate --with forces.",
        lambda value: multiplier_column(value.equations, value.reaction.name),
    ),
    *through(
        lambda value: value.reaction,
        Key("constraint", TEXT, "The constraint as the scene writes it.", lambda r: r.text),
        Key("multiplier", EXPRESSION, "Its multiplier."),
        Key("forces", list_of(_SIZE), "What it exerts on each particle.", lambda r: r.sizes),
    ),
)
FORCES: JsonObject[DerivedForces] = JsonObject(
    Key(
        "constraint_forces",
        list_of(_FORCE),
        "With --forces: the constraint force on each particle.",
        lambda derived: derived.forces.bodies,
    ),
    Key(
        "constraint_multipliers",
        list_of(_MULTIPLIER),
        "With --forces: the multiplier of each constraint.",
        lambda derived: [_Multiplier(derived.equations, r) for r in derived.forces.reactions],
    ),
    Key(
        "undetermined_multipliers",
        NAMES,
        "With --forces: multipliers that are not determined or have no short form.",
        lambda d: [multiplier_column(d.equations, name) for name in d.forces.open],
    ),
    Key(
        "forces_in_terms_of",
        one_of("motion", "accelerations", "multipliers"),
        "With --forces: what stands in the expressions beside coordinates and velocities.",
        lambda derived: derived.forces.form,
    ),
    Key(
        "forces_pass_on",
        NAMES,
        "With --forces: terms that act on no particle, which the constraints pass on.",
        lambda derived: derived.forces.included,
    ),
    Key(
        "forces_not_unique",
        NAMES,
        "With --forces: particles on which the forces are not unique.",
        lambda derived: derived.forces.shared,
    ),
    Key(
        "without_weight",
        NAMES,
        "With --forces: particles without weight in a scene that gives it to others.",
        lambda derived: derived.forces.weightless,
    ),
)
