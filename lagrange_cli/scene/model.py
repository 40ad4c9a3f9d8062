"""The scene as a frozen value: what the user declared, section by section.

Helpers (``gravity``, ``spring``, ``distance``) and ``plane`` are already
written out as the expressions they stand for, in the component names
``x_NAME, y_NAME, z_NAME``; families are as their members, each with a name of
its own such as ``p[3]``. Nothing else is evaluated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from lagrange_cli.errors import Mark, Problem
from lagrange_cli.files import Recording
from lagrange_cli.scene.language.expression import Equation, Expression

#: Samples of any run: rows of a table that a disk may hold.
MOST_SAMPLES = 10_000_000_000


@dataclass(frozen=True, slots=True)
class Size:
    """A number of members of families; expressions hold its value."""

    name: str
    mark: Mark
    value: int


@dataclass(frozen=True, slots=True)
class DeclaredParameter:
    """A named constant; without ``value`` it stays symbolic."""

    name: str
    mark: Mark
    value: Expression | None = None
    unit: str | None = None
    positive: bool = False
    description: str | None = None
    latex: str | None = None


@dataclass(frozen=True, slots=True)
class DeclaredInput:
    """What the user drives: an ``expression`` in t, or a ``recording``; the other is None."""

    name: str
    mark: Mark
    expression: Expression | None = None
    recording: Recording | None = None


@dataclass(frozen=True, slots=True)
class Particle:
    """A point mass; ``position`` has three expressions (bare fresh names are Cartesian names)."""

    name: str
    mark: Mark
    mass: Expression
    position: tuple[Expression, Expression, Expression]


@dataclass(frozen=True, slots=True)
class Point:
    """A massless named position."""

    name: str
    mark: Mark
    position: tuple[Expression, Expression, Expression]


@dataclass(frozen=True, slots=True)
class Constraint:
    """One named holonomic constraint, of one or more equations.

    ``plane: xz`` becomes the constraint named ``plane`` with an equation for
    each particle.
    """

    name: str
    mark: Mark
    equations: tuple[Equation, ...]


@dataclass(frozen=True, slots=True)
class Unilateral:
    """One inequality that holds the motion on one side, as the name of its contact says.

    ``restitution`` None: 0. Where a constraint has several inequalities their names are numbered.
    """

    name: str
    mark: Mark
    inequality: Equation
    restitution: Expression | None = None


@dataclass(frozen=True, slots=True)
class DeclaredCoordinate:
    """A declared generalized coordinate."""

    name: str
    mark: Mark
    latex: str | None = None
    unit: str | None = None
    description: str | None = None


@dataclass(frozen=True, slots=True)
class Definition:
    """A Cartesian name in terms of coordinates, or an abbreviation."""

    name: str
    mark: Mark
    expression: Expression


@dataclass(frozen=True, slots=True)
class Term:
    """A named term of ``potentials``, ``kinetic`` or ``dissipation``, or an output."""

    name: str
    mark: Mark
    expression: Expression


@dataclass(frozen=True, slots=True)
class Force:
    """A force on a particle or point (three components) or a coordinate (one)."""

    name: str
    mark: Mark
    on: str
    on_mark: Mark
    components: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class InitialValue:
    """A value of ``initial`` or ``near``: of a name (``order`` 0) or its ``dot`` (1)."""

    name: str
    order: int
    mark: Mark
    value: Expression


Formulation: TypeAlias = Literal["auto", "minimal", "multiplier"]
"""Few coordinates, or more with constraints beside them; ``auto`` is the program's choice."""


@dataclass(frozen=True, slots=True)
class SimulateDefaults:
    """The section ``simulate``; every number may be an expression in parameters."""

    mark: Mark | None = None
    until: Expression | None = None
    start: Expression | None = None
    accuracy: Expression | None = None
    samples: Expression | None = None
    step: Expression | None = None
    method: str | None = None
    rtol: Expression | None = None
    atol: Expression | None = None
    formulation: Formulation | None = None

    def formulation_for(self, asked: Formulation | None) -> Formulation:
        """The formulation that is asked for, else the scene's, else ``auto``."""
        return asked or self.formulation or "auto"


@dataclass(frozen=True)
class SimulationDefaults:
    """The scene's section ``simulate`` as numbers (None: absent), and its place."""

    until: float | None = None
    start: float = 0.0
    accuracy: float | None = None
    samples: int | None = None
    step: float | None = None
    method: str | None = None
    rtol: float | None = None
    atol: float | None = None
    formulation: str | None = None
    mark: Mark | None = None


@dataclass(frozen=True, slots=True)
class StateExpectation:
    """``state: {t: 1.0, x: 0.12, within: 1e-8}``; names may be ``dot(x)`` (order 1)."""

    mark: Mark
    time: Expression
    values: tuple[InitialValue, ...]
    within: Expression


@dataclass(frozen=True, slots=True)
class EventExpectation:
    """``{name: release:sphere, t: 0.72, within: 1e-9}``; without ``t`` it happens at any time."""

    name: str
    mark: Mark
    time: Expression | None = None
    within: Expression | None = None


@dataclass(frozen=True, slots=True)
class ErrorExpectation:
    """``error: {kind: ..., contains: ...}``: the scene must be refused so."""

    mark: Mark
    kind: str | None
    contains: str | None


@dataclass(frozen=True, slots=True)
class Expect:
    """The section ``expect``; what is absent is None and not checked."""

    mark: Mark | None = None
    dof: int | None = None
    dof_mark: Mark | None = None
    cyclic: tuple[str, ...] | None = None
    cyclic_mark: Mark | None = None
    conserved: tuple[str, ...] | None = None
    conserved_mark: Mark | None = None
    equations: tuple[Equation, ...] | None = None
    lagrangian: Expression | None = None
    states: tuple[StateExpectation, ...] = ()
    drift: tuple[tuple[str, Expression], ...] = ()
    events: tuple[EventExpectation, ...] = ()
    error: ErrorExpectation | None = None


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything a scene file says.

    ``file`` is the path as the user gave it (``<stdin>`` for standard input),
    ``digest`` the SHA-256 of the text (hex).
    """

    name: str
    file: str
    digest: str
    title: str | None = None
    description: str | None = None
    sizes: tuple[Size, ...] = ()
    parameters: tuple[DeclaredParameter, ...] = ()
    particles: tuple[Particle, ...] = ()
    points: tuple[Point, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    unilateral: tuple[Unilateral, ...] = ()
    coordinates: tuple[DeclaredCoordinate, ...] | None = None
    coordinates_mark: Mark | None = None
    definitions: tuple[Definition, ...] = ()
    inputs: tuple[DeclaredInput, ...] = ()
    potentials: tuple[Term, ...] = ()
    kinetic: tuple[Term, ...] = ()
    forces: tuple[Force, ...] = ()
    dissipation: tuple[Term, ...] = ()
    outputs: tuple[Term, ...] = ()
    initial: tuple[InitialValue, ...] = ()
    near: tuple[InitialValue, ...] = ()
    simulate: SimulateDefaults = field(default_factory=SimulateDefaults)
    expect: Expect = field(default_factory=Expect)
    warnings: tuple[Problem, ...] = ()

    def expressions(self) -> Iterator[Expression]:
        """What is derived from, in the order of the sections: without values and expectations."""
        for position in (*(p.position for p in self.particles), *(p.position for p in self.points)):
            yield from position
        yield from (p.mass for p in self.particles)
        yield from (s for c in self.constraints for e in c.equations for s in (e.left, e.right))
        for one_sided in self.unilateral:
            yield from (one_sided.inequality.left, one_sided.inequality.right)
            yield from filter(None, [one_sided.restitution])
        yield from (d.expression for d in self.definitions)
        yield from (u.expression for u in self.inputs if u.expression is not None)
        for term in (*self.potentials, *self.kinetic, *self.dissipation, *self.outputs):
            yield term.expression
        yield from (c for f in self.forces for c in f.components)
