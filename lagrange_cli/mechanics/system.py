"""The mechanical system as a frozen value: code, analysis and simulation are made from it.

Positions q, velocities v, accelerations a and time t are independent SymPy symbols. A velocity's
symbol is named ``dot(q)`` and an acceleration's ``ddot(q)``, so that any expression printed by
name reads as scene language.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from lagrange_cli.mechanics.kinks import Switch
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.state_layout import StateLayout

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.errors import Mark
    from lagrange_cli.files import Recording
    from lagrange_cli.mechanics.elements.motion import ElementMotion
    from lagrange_cli.scene.bodies import ThreeAngles
    from lagrange_cli.scene.conditions import SimulationDefaults
    from lagrange_cli.scene.model import DeclaredFunction


def tagged(name: str, tail: str) -> str:
    """A name with something after it that can be read back: ``rod_2``, ``rod_2[1]``."""
    base, bracket, indices = name.partition("[")
    return f"{base}{tail}{bracket}{indices}"


@dataclass(frozen=True)
class Parameter:
    """A parameter.

    Attributes
    ----------
    name, symbol
        Its name in the scene, and its symbol.
    value
        Its double; None if it must be given to simulate.
    decimal
        The same with 40 digits; empty if only the double is known.
    positive
        True if the scene declares it positive.
    unit, description, latex
        Texts of the scene, None if absent.
    start_of
        Coordinate, or ``t``, whose start it is: a constant of integration. None for others.
    exact
        The value as an exact number; None if there is none.
    """

    name: str
    symbol: Symbol
    value: float | None = None
    positive: bool = False
    decimal: str = field(default="", compare=False)
    unit: str | None = None
    description: str | None = None
    latex: str | None = None
    start_of: str | None = None
    exact: Expr | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Input:
    """A given function of time.

    Attributes
    ----------
    name, symbol
        Its name in the scene, and its symbol.
    expression
        Its value over t and parameters, None if it is recorded or driven.
    recording
        The file that holds its values, read when they are needed; None if it is an expression or
        driven.
    order
        1 or 2 for the rates, behind it, of an input that positions hold: a function of t.
    """

    name: str
    symbol: Expr
    expression: Expr | None
    recording: Recording | None = None
    order: int = 0

    @property
    def base(self) -> str:
        """Name without ``dot`` or ``ddot``."""
        return self.name.rpartition("(")[2].rstrip(")") if self.order else self.name

    @property
    def driven(self) -> bool:
        """Its values are given by whoever evaluates the equations, and unknown before."""
        return self.expression is None and self.recording is None


@dataclass(frozen=True)
class State:
    """A state of first order, ẋ = ``rate``, or of two values that a ``switch`` sets, and rate 0.

    The rate is over coordinates, velocities, states, inputs and t.
    """

    name: str
    symbol: Symbol
    rate: Expr
    unit: str | None = None
    description: str | None = None
    latex: str | None = None
    switch: Switch | None = None

    @property
    def expressions(self) -> tuple[Expr, ...]:
        """Its rate, and the functions of the conditions of its switch."""
        switch = self.switch
        return (self.rate,) if switch is None else (self.rate, switch.on, switch.off)

    def rewritten(self, put: Callable[[Expr], Expr]) -> State:
        """Return the state with a function applied to its expressions."""
        rate, *conditions = map(put, self.expressions)
        return replace(self, rate=rate, switch=Switch(*conditions) if conditions else None)


@dataclass(frozen=True)
class Controller:
    """A sampled controller: inputs and states that change at multiples of a time alone.

    ``every`` is that time, a number or the symbol of a parameter. ``held_inputs`` and ``memory``
    (states of rate 0) are names, each with its next value over the state, inputs and t.
    """

    name: str
    every: Expr
    held_inputs: tuple[tuple[str, Expr], ...]
    memory: tuple[tuple[str, Expr], ...]


@dataclass(frozen=True)
class Coordinate:
    """A generalized coordinate.

    Attributes
    ----------
    name
        Its name in the scene.
    q, v, a
        Independent symbols of q, q̇ and q̈.
    is_angle
        True if it has the unit rad, if it enters positions only through 2π-periodic functions, or,
        entering none, has no unit and enters terms only through such functions or turns a body.
    is_of_quaternion
        True of a part of a quaternion, of length 1.
    unit, description, latex, mark
        Texts of the scene and its place there, None if absent.
    """

    name: str
    q: Symbol
    v: Symbol
    a: Symbol
    is_angle: bool = False
    is_of_quaternion: bool = False
    unit: str | None = None
    description: str | None = None
    latex: str | None = None
    mark: Mark | None = None

    @property
    def is_positive(self) -> bool:
        """True if the scene declares that it stays above zero."""
        return bool(self.q.is_positive)


@dataclass(frozen=True)
class CartesianName:
    """A Cartesian name that the scene writes (``x1``, ``z_bob``).

    Attributes
    ----------
    name
        The name.
    position, velocity
        Its value over (q, t) and its rate over (q, v, t).
    latex
        LaTeX of the scene, None if absent.
    """

    name: str
    position: Expr
    velocity: Expr
    latex: str | None = None


@dataclass(frozen=True)
class BodyForce:
    """A non-conservative force, or a torque, ``on`` a particle, point, body or coordinate.

    ``components`` are along x, y, z, one only on a coordinate; ``generalized`` is Q of each one.
    """

    name: str
    on: str
    components: tuple[Expr, ...]
    generalized: tuple[Expr, ...]
    is_torque: bool = False


@dataclass(frozen=True)
class Closure:
    """A closure equation: a constraint kept beside the coordinates, with its multiplier.

    Between positions, φ(q, t) = 0 with φ̇ = ``gradient``·v + ``rate`` and
    φ̈ = ``gradient``·a + ``bias``. Between velocities, ψ(q, v, t) = 0, not integrable, with
    ψ = ``gradient``·v + ``rate`` and ψ̇ = ``gradient``·a + ``bias``.

    Attributes
    ----------
    name, constraint
        Name of the constraint, numbered if that keeps several equations, and without a number.
    kind
        ``position`` or ``velocity``.
    expression
        φ or ψ: left-hand side − right-hand side.
    gradient
        One entry a coordinate, over q and t; walk it by :func:`.sparse.entries`.
    rate, bias
        Over q and t, and over q, v and t, as above.
    multiplier
        The symbol λ: λ·gradient is the generalized force that the constraint exerts.
    text, mark
        The equation as the scene writes it, and its place.
    integral
        True if the scene states the rate of φ, whose constant the initial state gives.
    """

    name: str
    constraint: str
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
    def coordinate_numbers(self) -> tuple[int, ...]:
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
class InitialState:
    """Initial state at the start time.

    Attributes
    ----------
    positions, velocities, states
        q and v as doubles, in the order of the coordinates, and states in theirs.
    projected
        Largest change made to a given value to satisfy the constraints, 0 if none.
    decimals
        The state vector with 40 digits; empty if only the doubles are known.
    """

    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    projected: float = 0.0
    decimals: tuple[str, ...] = field(default=(), compare=False)
    states: tuple[float, ...] = ()

    @property
    def numbers(self) -> tuple[float, ...]:
        """The state vector."""
        return (*self.positions, *self.velocities, *self.states)


@dataclass(frozen=True)
class ReplacedChart:
    """Coordinates that others have replaced.

    Attributes
    ----------
    coordinates, start
        The former coordinates, and their initial state, None if it is not known.
    places
        The present coordinates over the former ones.
    steady
        Names of former ones whose rates are proven to keep their signs.
    turns
        Angles that quaternions have replaced; all other coordinates stay beside such.
    """

    coordinates: tuple[Coordinate, ...]
    places: tuple[CartesianName, ...]
    start: InitialState | None
    steady: tuple[str, ...] = ()
    turns: tuple[ThreeAngles, ...] = ()


@dataclass(frozen=True)
class System:
    """A system with its equations of motion ``mass_matrix · a = forcing + Σ λ·gradient``.

    Attributes
    ----------
    t
        Symbol of time.
    parameters, coordinates, inputs
        Symbols of the expressions. Those of inputs may stand wherever velocities may, but beside
        them in L.
    particles, cartesian_names
        Positions and velocities over the coordinates.
    kinetic, potential
        T and V in display form; V may hold velocities (a generalized potential U).
    lagrangian, dissipation
        L = T − V, and the dissipation function.
    forces
        Non-conservative forces.
    mass_matrix
        n rows of n entries over q and t, unscaled.
    forcing
        n entries over q, v and t, unscaled.
    energy
        Σ v ∂L/∂v − L, whether conserved or not.
    initial
        Initial state; None if the scene gives none or a parameter lacks its value.
    simulate
        The scene's section ``simulate``.
    functions
        The scene's own functions.
    closures
        Independent equations between the coordinates; none in minimal form.
    contacts
        One-sided constraints, whose λ is zero while the gap is open.
    states
        States of first order. Their symbols may stand wherever those of inputs may.
    controllers
        What sets inputs and states at samples.
    outputs
        Expressions that the scene asks for, by name, over (q, v, t).
    positive
        Names that the scene declares positive, with their expressions over (q, t): the equations
        hold where all of these are above zero.
    chart
        Coordinates that the present ones have replaced, None if there were none.
    sensitivities
        For each number by which the motion is differentiated, the parameters that change with it,
        and their derivatives. Those of the n coordinates stand behind the coordinates, n for
        each; mass matrix and forcing are of the first n alone.
    """

    t: Symbol
    parameters: tuple[Parameter, ...]
    coordinates: tuple[Coordinate, ...]
    particles: tuple[ElementMotion, ...]
    cartesian_names: tuple[CartesianName, ...]
    kinetic: Expr
    potential: Expr
    lagrangian: Expr
    dissipation: Expr
    forces: tuple[BodyForce, ...]
    mass_matrix: tuple[Sequence[Expr], ...]
    forcing: tuple[Expr, ...]
    energy: Expr
    initial: InitialState | None
    simulate: SimulationDefaults
    inputs: tuple[Input, ...] = ()
    states: tuple[State, ...] = ()
    controllers: tuple[Controller, ...] = ()
    functions: tuple[DeclaredFunction, ...] = ()
    closures: tuple[Closure, ...] = ()
    contacts: tuple[Contact, ...] = ()
    outputs: tuple[tuple[str, Expr], ...] = ()
    positive: tuple[tuple[str, Expr], ...] = ()
    chart: ReplacedChart | None = None
    sensitivities: tuple[Mapping[Symbol, Fraction], ...] = ()

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the numbers of the state vector."""
        return self.layout.names([c.name for c in self.coordinates], [s.name for s in self.states])

    @property
    def state_symbols(self) -> tuple[Symbol, ...]:
        """Symbols of the numbers of the state vector."""
        states = (s.symbol for s in self.states)
        return (*(c.q for c in self.coordinates), *(c.v for c in self.coordinates), *states)

    @property
    def external(self) -> tuple[Input | State, ...]:
        """Inputs and states, which virtual displacements leave alone."""
        return (*self.inputs, *self.states)

    @property
    def external_symbols(self) -> frozenset[Symbol]:
        """Symbols of inputs and states."""
        return frozenset(x.symbol for x in self.external)

    @property
    def switches(self) -> tuple[State, ...]:
        """The states with two values."""
        return tuple(state for state in self.states if state.switch is not None)

    @property
    def layout(self) -> StateLayout:
        """Layout of the state vector."""
        return StateLayout(len(self.coordinates), len(self.states))

    @property
    def formulation(self) -> Literal["minimal", "multiplier"]:
        """``multiplier`` if closures or contacts stand beside the coordinates."""
        return "multiplier" if self.closures or self.contacts else "minimal"

    @property
    def pushing(self) -> tuple[Closure, ...]:
        """All that has a multiplier: closures, then the gaps of contacts."""
        return (*self.closures, *(c.closure for c in self.contacts))

    @property
    def multipliers(self) -> tuple[str, ...]:
        """Names of the constraints whose multipliers the equations hold."""
        return tuple(closure.name for closure in self.pushing)
