"""The scene as a frozen value: what the user declared, section by section.

Helpers (``gravity``, ``spring``, ``distance``) and ``plane`` are already
written out as the expressions they stand for, in the component names
``x_NAME, y_NAME, z_NAME``; families are written out as their elements, each with a
name such as ``p[3]``. Nothing else is evaluated.

Every ``name`` is written as in the file, and every ``mark`` is a place there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

from lagrange_cli.errors import Mark, Problem
from lagrange_cli.files import FileColumn, Table
from lagrange_cli.scene.conditions import Expect, InitialValue, WrittenDefaults
from lagrange_cli.scene.declared_numbers import (
    DeclaredController,
    DeclaredInput,
    DeclaredParameter,
    DeclaredState,
)
from lagrange_cli.scene.joints import Joint
from lagrange_cli.scene.language.expression import Equation, Expression


@dataclass(frozen=True, slots=True)
class Size:
    """A number of elements of families.

    Attributes
    ----------
    name, mark
        Its name and its place.
    value
        The number, which expressions hold in its place.
    """

    name: str
    mark: Mark
    value: int


@dataclass(frozen=True, slots=True)
class FamilyIndex:
    """An index of an indexed family, as the scene first writes its range.

    Attributes
    ----------
    letter
        The letter of the index.
    size
        Name of the size that the range ends with, None if it ends with none or several.
    """

    letter: str
    size: str | None


@dataclass(frozen=True, slots=True)
class Particle:
    """A point mass.

    Attributes
    ----------
    name, mark
        Its name and its place.
    mass
        Its mass.
    position
        Its x, y and z; a name that stands alone there and is not declared is a Cartesian name.
    latex
        Text that it prints as, also below its components; None for its name.
    """

    name: str
    mark: Mark
    mass: Expression
    position: tuple[Expression, Expression, Expression]
    latex: str | None = None


@dataclass(frozen=True, slots=True)
class Point:
    """A massless named position.

    Attributes
    ----------
    name, mark
        Its name and its place.
    position
        Its x, y and z.
    latex
        Text that it prints as, also below its components; None for its name.
    on
        Name of the body that it is fixed to, perhaps over frames; None for others.
    """

    name: str
    mark: Mark
    position: tuple[Expression, Expression, Expression]
    latex: str | None = None
    on: str | None = None


@dataclass(frozen=True, slots=True)
class ConstraintNotation:
    """LaTeX for a constraint.

    Attributes
    ----------
    index
        Text that stands below λ and φ; None for the constraint's name.
    multiplier
        Text that its multiplier prints as; None for λ with the index.
    """

    index: str | None = None
    multiplier: str | None = None

    def multiplier_text(self, number: str = "") -> str | None:
        """Return the LaTeX of the multiplier, numbered if there are several; None for its name."""
        if self.multiplier is not None:
            return f"{{{self.multiplier}}}_{{{number}}}" if number else self.multiplier
        index = self.index_text(number)
        return None if index is None else rf"\lambda_{{{index}}}"

    def index_text(self, number: str = "") -> str | None:
        """Return the LaTeX that stands below its letters, numbered likewise; None for its name."""
        if self.index is None:
            return None
        return f"{self.index},{number}" if number else self.index


@dataclass(frozen=True, slots=True)
class Constraint:
    """A named constraint of one or more equations.

    ``plane: xz`` becomes the constraint named ``plane`` with an equation for
    each particle.

    Attributes
    ----------
    name, mark
        Its name and its place.
    equations
        Its equations, between positions or between velocities.
    notation
        The LaTeX that it prints as.
    joint
        The joint that its equations stand for, None if the scene has the equations themselves.
    """

    name: str
    mark: Mark
    equations: tuple[Equation, ...]
    notation: ConstraintNotation = ConstraintNotation()
    joint: Joint | None = None

    @property
    def keeps_length(self) -> bool:
        """True if it keeps quaternions at length 1: no force does so, and it restricts nothing."""
        return self.joint is not None and self.joint.kind == "unit"


@dataclass(frozen=True, slots=True)
class Unilateral:
    """An inequality between positions: a one-sided constraint.

    Attributes
    ----------
    name, mark
        Name of its contact, numbered if its constraint has several inequalities; its place.
    inequality
        The inequality as written.
    restitution
        Newton's coefficient of restitution, None for 0.
    notation
        The LaTeX that it prints as.
    """

    name: str
    mark: Mark
    inequality: Equation
    restitution: Expression | None = None
    notation: ConstraintNotation = ConstraintNotation()


@dataclass(frozen=True, slots=True)
class DeclaredCoordinate:
    """A declared generalized coordinate.

    Attributes
    ----------
    name, mark
        Its name and its place.
    latex, unit, description
        Texts for readers, None if absent.
    positive
        True if the scene declares that it stays above zero.
    """

    name: str
    mark: Mark
    latex: str | None = None
    unit: str | None = None
    description: str | None = None
    positive: bool = False


@dataclass(frozen=True, slots=True)
class Definition:
    """A definition of a Cartesian name in terms of coordinates, or of an abbreviation.

    Attributes
    ----------
    name, mark
        The defined name and its place.
    expression
        Its meaning.
    latex
        Text that the name prints as; None for that of the name.
    """

    name: str
    mark: Mark
    expression: Expression
    latex: str | None = None


@dataclass(frozen=True, slots=True)
class DeclaredFunction:
    """A function that is not known, or given, or a table.

    Attributes
    ----------
    name, mark, argument, argument_mark
        Its name, and the text of its argument, each with its place.
    expression
        Its value for that argument; None if it is not known, or a table.
    latex
        Text that it prints as; None for that of its name.
    table, over
        Its points, and arguments that it is meant for; None and empty if it is no table.
    """

    name: str
    mark: Mark
    argument: str
    argument_mark: Mark
    expression: Expression | None = None
    latex: str | None = None
    table: Table | None = None
    over: tuple[Expression, ...] = ()

    @property
    def arity(self) -> int:
        return max(1, len(self.over))

    @property
    def is_unknown(self) -> bool:
        return self.expression is None and self.table is None


@dataclass(frozen=True, slots=True)
class Term:
    """A named term of ``potentials``, ``kinetic`` or ``dissipation``, or an output.

    Attributes
    ----------
    name, mark
        Its name and its place.
    expression
        Its value.
    """

    name: str
    mark: Mark
    expression: Expression


@dataclass(frozen=True, slots=True)
class Force:
    """A force on a particle, a point or a coordinate, or a torque on a body.

    Attributes
    ----------
    name, mark
        Its name and its place.
    on, on_mark
        Name of the particle, point or coordinate that it acts on, and the place of that name.
    components
        Along x, y and z, of a torque if ``is_torque``; one only if it acts on a coordinate.
    """

    name: str
    mark: Mark
    on: str
    on_mark: Mark
    components: tuple[Expression, ...]
    is_torque: bool = False


@dataclass(frozen=True, slots=True)
class Link:
    """A helper between two bodies, beside the expressions that it is written out as.

    Attributes
    ----------
    kind
        Its key in the scene.
    ends
        Names of the two particles or points.
    size
        Length of a distance, stiffness of a spring, coefficient of a damper.
    """

    kind: Literal["distance", "spring", "damper"]
    ends: tuple[str, str]
    size: Expression


@dataclass(frozen=True, slots=True)
class Scene:
    """The contents of a scene file.

    Attributes
    ----------
    name
        Name of the scene: of its section ``name``, or else of its file.
    file
        Path as the user gave it, ``<stdin>`` for standard input.
    digest
        SHA-256 of the text in hexadecimal digits.
    title, description
        Texts for readers, None if absent.
    sizes, parameters, functions, particles, points, definitions, inputs
        Declarations of the sections of these names.
    families
        Families that have a range for every index somewhere, with these.
    constraints, unilateral
        Constraints by equations, and by inequalities.
    coordinates, coordinates_mark
        Declared coordinates and the place of their section, None if it is absent.
    positive
        Names of the coordinates that are declared positive, also if others replace them.
    eliminated
        Names of coordinates that constraints are to determine after all.
    states, state_starts
        States of first order, the memory of controllers behind the others, and their given
        initial values.
    controllers
        Sampled controllers.
    starts
        Coordinates, each with the parameter for its start in constants of integration.
    potentials, kinetic, dissipation, outputs
        Named terms of the sections of these names.
    forces
        Forces besides potentials.
    links
        Distances, springs and dampers that helpers of these names state.
    initial, near
        Given initial values, and values near which a solution is sought.
    simulate, expect
        The sections of these names.
    warnings
        Warnings from reading.
    """

    name: str
    file: str
    digest: str
    title: str | None = None
    description: str | None = None
    sizes: tuple[Size, ...] = ()
    families: tuple[tuple[str, tuple[FamilyIndex, ...]], ...] = ()
    parameters: tuple[DeclaredParameter, ...] = ()
    functions: tuple[DeclaredFunction, ...] = ()
    particles: tuple[Particle, ...] = ()
    points: tuple[Point, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    unilateral: tuple[Unilateral, ...] = ()
    coordinates: tuple[DeclaredCoordinate, ...] | None = None
    coordinates_mark: Mark | None = None
    positive: frozenset[str] = frozenset()
    eliminated: tuple[str, ...] = ()
    starts: tuple[tuple[str, str], ...] = ()
    definitions: tuple[Definition, ...] = ()
    inputs: tuple[DeclaredInput, ...] = ()
    states: tuple[DeclaredState, ...] = ()
    state_starts: tuple[InitialValue, ...] = ()
    controllers: tuple[DeclaredController, ...] = ()
    potentials: tuple[Term, ...] = ()
    kinetic: tuple[Term, ...] = ()
    forces: tuple[Force, ...] = ()
    dissipation: tuple[Term, ...] = ()
    outputs: tuple[Term, ...] = ()
    links: tuple[Link, ...] = ()
    initial: tuple[InitialValue, ...] = ()
    near: tuple[InitialValue, ...] = ()
    simulate: WrittenDefaults = field(default_factory=WrittenDefaults)
    expect: Expect = field(default_factory=Expect)
    warnings: tuple[Problem, ...] = ()

    @property
    def columns(self) -> tuple[FileColumn, ...]:
        """Columns of files that it names: of recorded inputs, then of tables."""
        tables = (f.table.source for f in self.functions if f.table)
        return (*(u.recording for u in self.inputs if u.recording), *tables)

    @property
    def lengths(self) -> tuple[str, ...]:
        """Names of the constraints that keep quaternions at length 1."""
        return tuple(c.name for c in self.constraints if c.keeps_length)

    def expressions(self) -> Iterator[Expression]:
        """Yield the expressions that equations are derived from, in a fixed order of sections.

        Values of parameters, initial values and expectations are not among them.
        """
        for position in (*(p.position for p in self.particles), *(p.position for p in self.points)):
            yield from position
        yield from (p.mass for p in self.particles)
        yield from (s for c in self.constraints for e in c.equations for s in (e.left, e.right))
        for one_sided in self.unilateral:
            yield from (one_sided.inequality.left, one_sided.inequality.right)
            yield from filter(None, [one_sided.restitution])
        yield from (f.expression for f in self.functions if f.expression is not None)
        yield from (d.expression for d in self.definitions)
        yield from (u.expression for u in self.inputs if u.expression is not None)
        yield from (e for s in self.states for e in s.expressions)
        yield from (v.expression for c in self.controllers for v in c.values)
        for term in (*self.potentials, *self.kinetic, *self.dissipation, *self.outputs):
            yield term.expression
        yield from (c for f in self.forces for c in f.components)
