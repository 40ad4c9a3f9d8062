"""Steps of a derivation as frozen values: the lines that a lecturer writes between r(q, t) and the
equations of motion."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, TypeAlias

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.elements.motion import Turning

#: A way from positions to equations of motion.
Way: TypeAlias = Literal["lagrange", "dalembert", "virtual-work"]


def rate_symbol(name: str) -> Symbol:
    """The symbol of the rate of a Cartesian name that is no coordinate."""
    import sympy

    return sympy.Symbol(f"dot({name})", real=True)


def spin_symbol(body: str, axis: str) -> Symbol:
    """The symbol of a component of the angular velocity of a body."""
    import sympy

    return sympy.Symbol(f"omega_{axis}({body})", real=True)


def moment_symbol(body: str, entry: str) -> Symbol:
    """The symbol of an entry of a body's tensor of inertia about the centre of mass."""
    import sympy

    return sympy.Symbol(f"inertia_{entry}({body})", real=True)


@dataclass(frozen=True)
class Displacement:
    """A virtual displacement: of a coordinate, or a small turn of a body that a quaternion turns.

    Attributes
    ----------
    name
        Name of the coordinate or body.
    axis
        1, 2 or 3: the axis of the body that it turns about; empty of a coordinate.
    rates
        q → its derivative by the displacement; zero ones absent.
    """

    name: str
    axis: str
    rates: tuple[tuple[Symbol, Expr], ...]

    @property
    def symbol(self) -> Symbol:
        """The symbol of the displacement."""
        import sympy

        name = f"phi_{self.axis}({self.name})" if self.axis else self.name
        return sympy.Symbol(f"delta({name})", real=True)


@dataclass(frozen=True)
class ComponentSteps:
    """A Cartesian name along the motion.

    Attributes
    ----------
    name
        The name.
    position
        Its value over q and t.
    partials
        q or t → ∂position/∂q or ∂position/∂t; zero ones absent.
    velocity, acceleration
        Its rates over q, v, t, and over q, v, a, t.
    force
        The applied force along it; zero if a component before has it.
    slopes
        Virtual displacement → derivative of the position by it; zero ones absent, and all of them
        by Lagrange's equations.
    """

    name: str
    position: Expr
    partials: tuple[tuple[Symbol, Expr], ...]
    velocity: Expr
    acceleration: Expr
    force: Expr
    slopes: tuple[tuple[Symbol, Expr], ...] = ()


@dataclass(frozen=True)
class SpinSteps:
    """A component of the angular velocity ω of a body.

    Attributes
    ----------
    axis
        1, 2 or 3 along the axes of the body, x, y or z along those of space; empty in a plane.
    direction
        Its direction in these axes; in a plane that of positive turns.
    spin, rate
        ω over q, v, t, and ω̇ over q, v, a, t.
    partials
        q → ∂ω/∂v, t → what of ω holds no v; zero ones absent.
    law, inertia
        The rate of the angular momentum L about the centre of mass along it, over components of ω
        and their rates, and over q, v, a, t; both over named moments.
    torque
        The applied torque along it.
    slopes
        Virtual displacement → the small turn about it, as of :class:`ComponentSteps`.
    """

    axis: str
    direction: tuple[int, int, int]
    spin: Expr
    rate: Expr
    partials: tuple[tuple[Symbol, Expr], ...]
    law: Expr
    inertia: Expr
    torque: Expr
    slopes: tuple[tuple[Symbol, Expr], ...] = ()


#: Axes along which an angular velocity has its components.
SpinAxes: TypeAlias = Literal["body", "space", "plane"]


@dataclass(frozen=True)
class TurningSteps:
    """The turning of a rigid body.

    Attributes
    ----------
    axes
        The axes of the components; in a plane there is one component, across it.
    turning
        Its rotation, its inertia about the centre of mass, and its turns.
    components
        The components of its angular velocity that do not vanish.
    moments
        Names of moments of inertia that are sums, each with the sum: ``1`` or ``12``, empty in a
        plane.
    energy
        The energy of the turning over components of ω and named moments.
    """

    axes: SpinAxes
    turning: Turning
    components: tuple[SpinSteps, ...]
    moments: tuple[tuple[str, Expr], ...]
    energy: Expr


@dataclass(frozen=True)
class BodySteps:
    """A particle, a rigid body at its centre of mass, or a point that a force pulls at.

    Attributes
    ----------
    name, mass
        Its name and mass; None for a point.
    components
        Its x, y and z.
    square
        v² over q, v, t; None for a point, or if it has no short form.
    turning
        The turning of a rigid body that turns, None for others.
    """

    name: str
    mass: Expr | None
    components: tuple[ComponentSteps, ComponentSteps, ComponentSteps]
    square: Expr | None
    turning: TurningSteps | None = None


@dataclass(frozen=True)
class TermSteps:
    """A kinetic term or a potential of the scene.

    Attributes
    ----------
    name
        Its name.
    written, resolved
        The term over Cartesian names and their rates, and over q, v, t.
    """

    name: str
    written: Expr
    resolved: Expr


@dataclass(frozen=True)
class ForceSteps:
    """The virtual work of a force.

    Attributes
    ----------
    name, on
        Its name, and what it acts on.
    components
        Cartesian name, or the coordinate it acts on → component; zero ones absent. Of a torque
        the axis of a component of the angular velocity → component.
    generalized
        q → Q = Σ F·∂r/∂q, of a torque Σ M·∂ω/∂v; zero ones absent.
    is_torque
        True of a torque on a body.
    """

    name: str
    on: str
    components: tuple[tuple[str, Expr], ...]
    generalized: tuple[tuple[Symbol, Expr], ...]
    is_torque: bool = False


@dataclass(frozen=True)
class CoordinateSteps:
    """Lagrange's equation of one coordinate, part by part.

    Attributes
    ----------
    momentum, momentum_rate
        ∂L/∂v over q, v, t; its total time derivative over q, v, a, t.
    slope
        ∂L/∂q.
    drag
        ∂D/∂v of the dissipation function.
    terms
        Terms of the equation before a factor is divided out, in the order of the shown one: pairs
        of coefficient and factor.
    """

    momentum: Expr
    momentum_rate: Expr
    slope: Expr
    drag: Expr
    terms: tuple[tuple[Expr, Expr], ...]

    @property
    def residual(self) -> Expr:
        """The sum of the terms: zero along a motion."""
        import sympy

        return sympy.Add(*(coefficient * factor for coefficient, factor in self.terms))

    def ungathered_terms(
        self,
        speeds: Collection[Symbol],
        accelerations: Collection[Symbol],
        multipliers: Collection[Symbol],
        force: Expr,
    ) -> tuple[tuple[Expr, Expr], ...]:
        """Terms of d/dt ∂L/∂v − ∂L/∂q + ∂D/∂v − Q as its parts have them, before like ones are
        collected; none if the rate of the momentum and ∂L/∂q share no product of ``speeds``.

        ``force``: the generalized force Q. Terms with ``accelerations`` and ``multipliers`` are
        those of the equation.
        """
        import sympy

        add, mul = sympy.Add.make_args, sympy.Mul.make_args
        accelerated = [e for e in add(self.momentum_rate) if e.free_symbols & {*accelerations}]
        if any({*accelerations}.isdisjoint(mul(e)) for e in accelerated):
            return ()  # a rate that is too long to be multiplied out
        rates = _split((e for e in add(self.momentum_rate) if e not in accelerated), speeds)
        slopes = _split((-e for e in add(self.slope)), speeds)
        if not {p for _, p in rates} & {p for _, p in slopes} - {sympy.S.One}:
            return ()
        forces = _split((*add(self.drag), *(-e for e in add(force))), speeds)
        pairs = sorted((*rates, *slopes, *forces), key=lambda pair: pair[1] == 1)
        inertia = (pair for pair in self.terms if pair[1] in accelerations)
        pushes = (pair for pair in self.terms if pair[1].free_symbols & {*multipliers})
        return (*inertia, *pairs, *pushes)


def _split(terms: Iterable[Expr], speeds: Collection[Symbol]) -> list[tuple[Expr, Expr]]:
    """Coefficient and product of powers of speeds of each term that is not zero."""
    import sympy

    pairs = []
    for term in terms:
        factors = sympy.Mul.make_args(term)
        product = sympy.Mul(*(f for f in factors if f.as_base_exp()[0] in speeds))
        if term != 0:
            pairs.append((term / product, product))
    return pairs


@dataclass(frozen=True)
class VirtualWork:
    """The coefficient of one −δq in Σ (F − m r̈)·δr + Σ (M − L̇)·δφ, part by part.

    Those of a small turn are over the angular velocity of its body.

    Attributes
    ----------
    displacement
        The displacement.
    inertia, work
        Σ m r̈·∂r/∂q and Σ F·∂r/∂q.
    turning, torques
        Σ L̇·∂ω/∂v, over named moments, and Σ M·∂ω/∂v.
    coordinates
        Inertia less forces of terms that are written in coordinates and act on no particle.
    terms
        Of a small turn pairs of coefficient and factor whose sum vanishes along a motion: these
        parts and the forces of multipliers together. None of a coordinate, which has an equation.
    """

    displacement: Displacement
    inertia: Expr
    work: Expr
    turning: Expr
    torques: Expr
    coordinates: Expr
    terms: tuple[tuple[Expr, Expr], ...] = ()

    @property
    def coefficient(self) -> Expr:
        """The sum of the parts."""
        return self.inertia - self.work + self.turning - self.torques + self.coordinates

    @property
    def whole(self) -> Expr:
        """The sum of the terms of a small turn."""
        import sympy

        return sympy.Add(*(coefficient * factor for coefficient, factor in self.terms))


@dataclass(frozen=True)
class DerivationSteps:
    """The steps of a derivation, each compared with the derivation in high precision.

    Attributes
    ----------
    way
        The way they lead: by Lagrange's equations, by d'Alembert's principle, or by the principle
        of virtual work to equations of equilibrium.
    bodies
        Positions and their rates.
    kinetic, potentials
        Terms of the scene beside the ½ m v² of particles and the energies of the turning of bodies.
    forces
        The virtual work of each force.
    coordinates
        Parts of Lagrange's equations, one of each coordinate.
    balances
        Parts of d'Alembert's principle, one of each displacement; none by Lagrange's equations.
    in_coordinates
        Names of terms that are written in coordinates and act on no particle.
    states
        Number of random states at which they were compared.
    mismatch
        Largest relative mismatch of a line.
    difference
        Largest relative difference of d'Alembert's coefficients from Lagrange's.
    """

    way: Way
    bodies: tuple[BodySteps, ...]
    kinetic: tuple[TermSteps, ...]
    potentials: tuple[TermSteps, ...]
    forces: tuple[ForceSteps, ...]
    coordinates: tuple[CoordinateSteps, ...]
    balances: tuple[VirtualWork, ...]
    in_coordinates: tuple[str, ...]
    states: int = 0
    mismatch: float = 0.0
    difference: float = 0.0

    def generalized_force(self, place: Symbol) -> Expr:
        """Return Q of the coordinate whose symbol is ``place``: the sum over all forces."""
        import sympy

        return sympy.Add(*(dict(f.generalized).get(place, 0) for f in self.forces))

    @property
    def named_moments(self) -> dict[Symbol, Expr]:
        """The symbols of moments of inertia that are sums, each with the sum."""
        return {
            moment_symbol(body.name, name): moment
            for body in self.bodies
            if body.turning is not None
            for name, moment in body.turning.moments
        }

    def over_parameters(self) -> DerivationSteps:
        """Return the steps with the sums that named moments of inertia are."""
        moments = self.named_moments
        if not moments:
            return self
        bodies = []
        for body in self.bodies:
            turning = body.turning
            if turning is not None:
                parts = (
                    replace(c, inertia=c.inertia.xreplace(moments)) for c in turning.components
                )
                turning = replace(turning, components=tuple(parts))
            bodies.append(replace(body, turning=turning))
        balances = (replace(b, turning=b.turning.xreplace(moments)) for b in self.balances)
        return replace(self, bodies=tuple(bodies), balances=tuple(balances))

    @property
    def of_motion(self) -> bool:
        """True if they lead to equations of motion, False if to those of equilibrium."""
        return self.way != "virtual-work"
