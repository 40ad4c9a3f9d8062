"""Equations of motion as frozen values.

Positions q, velocities v, accelerations a and time t are independent SymPy
symbols. A velocity's symbol is named ``dot(q)`` and an acceleration's
``ddot(q)``, so that any expression printed by name reads as scene language.
Everything downstream (display, emission, simulation) sees these values and
never the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from lagrange_cli.mechanics.sparse import entries

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.errors import Mark, Problem
    from lagrange_cli.files import Recording
    from lagrange_cli.mechanics.reaction_values import ConstraintForces
    from lagrange_cli.scene.conditions import SimulationDefaults


def tagged(name: str, tail: str) -> str:
    """A name with something after it that can be read back: ``rod_2``, ``rod_2[1]``."""
    base, bracket, indices = name.partition("[")
    return f"{base}{tail}{bracket}{indices}"


@dataclass(frozen=True)
class Parameter:
    """A parameter; ``value`` is its double (None: must be given to simulate)."""

    name: str
    symbol: Symbol
    value: float | None = None
    positive: bool = False
    unit: str | None = None
    description: str | None = None
    latex: str | None = None


@dataclass(frozen=True)
class Input:
    """A given function of time.

    ``expression`` is the scene's, over t and parameters; None where the values are
    those of a ``recording``, which is read when they are needed.
    """

    name: str
    symbol: Symbol
    expression: Expr | None
    recording: Recording | None = None


@dataclass(frozen=True)
class Coordinate:
    """A generalized coordinate with its independent symbols for q, q̇ and q̈.

    ``is_angle``: it enters positions only through 2π-periodic functions, or
    has unit rad.
    """

    name: str
    q: Symbol
    v: Symbol
    a: Symbol
    is_angle: bool = False
    unit: str | None = None
    description: str | None = None
    latex: str | None = None
    mark: Mark | None = None


@dataclass(frozen=True)
class ConstraintLine:
    """One constraint in the DOF account.

    ``equations`` as written; ``status``: ``independent``; ``satisfied`` (the
    definitions satisfy it identically); ``redundant`` (others imply it, named
    in ``implied_by``); ``nonholonomic`` (it holds velocities and is not
    integrable); ``unilateral`` (an inequality, with its ``restitution`` as written).
    ``rheonomic``: it contains t. ``on_a_part``: the definitions satisfy it around the start,
    and not everywhere.
    """

    name: str
    equations: tuple[str, ...]
    status: Literal["independent", "satisfied", "redundant", "nonholonomic", "unilateral"] = (
        "independent"
    )
    implied_by: tuple[str, ...] = ()
    rheonomic: bool = False
    restitution: str = ""
    on_a_part: bool = False


@dataclass(frozen=True)
class Account:
    """DOF = 3N + E − K, with what K is made of.

    ``cartesian`` = 3N; ``extra`` = E; ``constraints`` = K; ``implied`` of the K
    restrictions are stated by no constraint but follow from definitions or
    position expressions. ``nonholonomic`` constraints lower the freedom of
    velocities, not ``dof``; ``unilateral`` ones neither.
    """

    cartesian: int
    extra: int
    constraints: int
    dof: int
    implied: int
    lines: tuple[ConstraintLine, ...]
    chosen_automatically: bool = False
    nonholonomic: int = 0

    @property
    def unilateral(self) -> int:
        """Number of one-sided constraints."""
        return sum(line.status == "unilateral" for line in self.lines)


@dataclass(frozen=True)
class CartesianName:
    """A Cartesian name that the scene writes (``x1``, ``z_bob``), over (q, t) and (q, v, t)."""

    name: str
    position: Expr
    velocity: Expr
    latex: str | None = None


@dataclass(frozen=True)
class ParticleMotion:
    """A particle: mass, component names, position r(q, t) and velocity ṙ(q, v, t)."""

    name: str
    mass: Expr
    components: tuple[str, str, str]
    position: tuple[Expr, Expr, Expr]
    velocity: tuple[Expr, Expr, Expr]


@dataclass(frozen=True)
class BodyForce:
    """A non-conservative force of the scene and its generalized force on each coordinate."""

    name: str
    on: str
    components: tuple[Expr, ...]
    generalized: tuple[Expr, ...]


@dataclass(frozen=True)
class Closure:
    """An equation that is kept beside the coordinates, with its multiplier.

    ``kind`` ``position``: φ(q, t) = 0 with ``expression`` φ = lhs − rhs,
    φ̇ = ``gradient``·v + ``rate`` and φ̈ = ``gradient``·a + ``bias``.
    ``kind`` ``velocity``: ψ(q, v, t) = 0, not integrable, with ``expression``
    ψ = ``gradient``·v + ``rate`` and ψ̇ = ``gradient``·a + ``bias``.

    ``gradient`` has one entry a coordinate, over q and t, walked by
    :func:`~lagrange_cli.mechanics.sparse.entries`; ``rate`` is over q
    and t, ``bias`` over q, v and t. ``multiplier`` is the symbol λ: λ·gradient
    is the generalized force that the constraint exerts. ``integral``: the scene
    states the rate of φ, whose constant its initial state gives.
    """

    name: str
    kind: Literal["position", "velocity"]
    expression: Expr
    gradient: Sequence[Expr]
    rate: Expr
    bias: Expr
    multiplier: Symbol
    text: str
    mark: Mark | None = None
    integral: bool = False

    @cached_property
    def held(self) -> tuple[int, ...]:
        """Numbers of the coordinates whose entry of the gradient is not plainly zero."""
        return tuple(entries(self.gradient))


@dataclass(frozen=True)
class Contact:
    """A one-sided constraint: the gap φ(q, t) ≥ 0 of ``closure``, whose λ ≥ 0 pushes where φ = 0.

    ``restitution``: Newton's coefficient e over the parameters; a contact that closes with
    φ̇ < 0 opens with −e φ̇.
    """

    closure: Closure
    restitution: Expr

    @property
    def name(self) -> str:
        return self.closure.name


@dataclass(frozen=True)
class ShownEquation:
    """The textbook form of one equation of motion, ``Σ coefficient·factor = 0``.

    ``terms`` in display order: those in ddot (factor an acceleration symbol),
    then those in dot (factor a monomial in velocities), then the rest (factor
    1), then those with a multiplier as factor. ``divided_by`` is the common
    factor that was divided out (1 if none).
    """

    coordinate: str
    terms: tuple[tuple[Expr, Expr], ...]
    divided_by: Expr

    @cached_property
    def residual(self) -> Expr:
        """The sum of the terms: zero along a motion."""
        import sympy

        return sympy.Add(*(coefficient * factor for coefficient, factor in self.terms))


@dataclass(frozen=True)
class Conserved:
    """A conserved quantity.

    ``kind`` ``momentum``: of the cyclic ``coordinate``, ``name`` = ``p_theta``;
    ``energy``: T + V, ``name`` = ``energy``; ``jacobi``: Σ v ∂L/∂v − L where
    that is not T + V, ``name`` = ``jacobi``. ``reason`` is a short phrase.
    """

    name: str
    kind: Literal["momentum", "energy", "jacobi"]
    expression: Expr
    reason: str
    coordinate: str | None = None


@dataclass(frozen=True)
class Facts:
    """Structure facts (all booleans are proven, False means "not shown").

    ``separable``: T(p) + V(q) without closures; ``separable_on_closures``: with closures, if any,
    of positions alone.
    """

    constant_mass_matrix: bool
    diagonal_mass_matrix: bool
    separable: bool
    autonomous: bool
    rheonomic: bool
    planar: bool
    positive_definite_mass_matrix: bool
    unused_parameters: tuple[str, ...] = ()
    separable_on_closures: bool = False


@dataclass(frozen=True)
class Certificate:
    """Random states, decimal digits and largest relative mismatch of the check."""

    points: int
    digits: int
    mismatch: float


@dataclass(frozen=True)
class FormulationChoice:
    """The formulation that was taken of two.

    Attributes
    ----------
    minimal, multiplier
        Operations predicted for one right-hand side in each.
    why
        A short phrase, or empty.
    """

    formulation: Literal["minimal", "multiplier"]
    minimal: int
    multiplier: int
    why: str = ""


@dataclass(frozen=True)
class SingularConfiguration:
    """Zero set of a factor of det M, at which coordinates lose their meaning.

    Attributes
    ----------
    coordinates
        Names of the coordinates whose rates M does not determine there.
    where
        Expression over q and parameters that is zero there.
    infinite
        True at a pole of det M, where the coordinates end.
    """

    coordinates: tuple[str, ...]
    where: Expr
    infinite: bool = False


@dataclass(frozen=True)
class InitialState:
    """Initial q and v (doubles, in coordinate order) at the start time.

    ``projected`` is the largest change made to a given value to satisfy the
    constraints (0 if none).
    """

    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    projected: float = 0.0


@dataclass(frozen=True)
class ReplacedChart:
    """Coordinates that others have replaced, from which each of those follows.

    ``places`` are the present coordinates over the former ones; ``start`` is the initial
    state in these, None where it is not known. ``steady``: those of which
    :func:`.dynamics.singular_configurations.conserved_momenta` proves that their rates keep signs.
    """

    coordinates: tuple[Coordinate, ...]
    places: tuple[CartesianName, ...]
    start: InitialState | None
    steady: tuple[str, ...] = ()


@dataclass(frozen=True)
class Equations:
    """Equations of motion ``mass_matrix · a = forcing + Σ λ·gradient`` with all that explains them.

    ``closures`` are the independent equations that the coordinates obey beside
    them, each with its multiplier λ; none in the formulation ``minimal``.
    ``contacts`` are one-sided: λ is zero while the gap is open.

    ``mass_matrix`` (n rows of n entries, over q, t) and ``forcing`` (n, over q, v, t) are
    unscaled; ``shown`` is the textbook form. ``kinetic`` and ``potential`` are
    T and V in display form; ``potential`` may hold velocities (a generalized
    potential U). ``energy`` is Σ v ∂L/∂v − L, whether conserved or not.
    ``abbreviations`` are the scene's definitions that name no Cartesian name;
    ``outputs`` what it asks for besides, by name, over (q, v, t). The symbols of
    ``inputs`` may stand wherever velocities may, but beside them in L.
    ``literals`` maps exact values to decimals as the scene wrote them.
    ``choice`` is None where there is one formulation only; ``singular`` are places that
    the coordinates do not cover. ``chart``: what the coordinates have replaced.
    ``initial`` is None when the scene gives no initial state or a parameter
    lacks its value; ``suggested`` are values of coordinates that could be given then.
    ``constraint_forces`` is None unless it was asked for. ``open_questions`` names
    coordinates that may be cyclic and quantities that may be conserved: it is neither proven
    nor seen to be false.
    """

    name: str
    title: str | None
    description: str | None
    file: str
    digest: str
    t: Symbol
    parameters: tuple[Parameter, ...]
    coordinates: tuple[Coordinate, ...]
    account: Account
    particles: tuple[ParticleMotion, ...]
    cartesian_names: tuple[CartesianName, ...]
    kinetic: Expr
    potential: Expr
    lagrangian: Expr
    dissipation: Expr
    forces: tuple[BodyForce, ...]
    mass_matrix: tuple[Sequence[Expr], ...]
    forcing: tuple[Expr, ...]
    shown: tuple[ShownEquation, ...]
    energy: Expr
    cyclic: tuple[str, ...]
    conserved: tuple[Conserved, ...]
    facts: Facts
    certificate: Certificate
    initial: InitialState | None
    simulate: SimulationDefaults
    abbreviations: tuple[tuple[str, Expr], ...] = ()
    literals: tuple[tuple[Fraction, str], ...] = ()
    warnings: tuple[Problem, ...] = ()
    remarks: tuple[str, ...] = ()
    closures: tuple[Closure, ...] = ()
    contacts: tuple[Contact, ...] = ()
    outputs: tuple[tuple[str, Expr], ...] = ()
    suggested: tuple[tuple[str, str], ...] = ()
    inputs: tuple[Input, ...] = ()
    constraint_forces: ConstraintForces | None = None
    choice: FormulationChoice | None = None
    singular: tuple[SingularConfiguration, ...] = ()
    chart: ReplacedChart | None = None
    open_questions: tuple[str, ...] = ()

    @property
    def formulation(self) -> Literal["minimal", "multiplier"]:
        return "multiplier" if self.closures or self.contacts else "minimal"

    @property
    def pushing(self) -> tuple[Closure, ...]:
        """All that has a multiplier: closures, then the gaps of contacts."""
        return (*self.closures, *(c.closure for c in self.contacts))

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Names of the constraints whose multipliers the equations hold."""
        return tuple(closure.name for closure in self.pushing)
