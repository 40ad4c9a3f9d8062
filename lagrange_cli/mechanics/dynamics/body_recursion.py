"""M and f of trees of bodies by recursion over their frames: composite bodies, and their bias.

Positions of a long chain are nested products, and each of their derivatives is as long as they are.
Velocities follow from frame to frame instead, and so do accelerations of the motion without q̈;
masses, first moments and tensors of inertia of all that a frame carries are added up from its end:

    ω = ω' + Σ n α̇,   v = v' + ω' × d + Σ e ẋ,
    M_kl = n_k · (J n_l),   h_k = n_k · N  (turns; e · F of displacements)

where a frame stands at d from the one below it, N and F are the moment and force of inertia of what
it carries, and J its tensor about the frame's origin (R. Featherstone, Rigid Body Dynamics
Algorithms, 2008, sections 5.3 and 6.2; here along the axes of space, moments about each frame's own
origin, so that nothing of the size of the chain cancels). Code for f and for what M is made of
grows with the length of a chain, that for M with its square.

Angles and displacements e(q, t) may be any expressions: with E = ∂e/∂q, M becomes EᵀM E. A turn by
a quaternion is three about axes that stand on the frame below, whose rates are components of ω and
whose E is ∂ω/∂q̇. Along the gradient of its length there is no motion: f differs from that of L, by
a force that its multiplier takes up, and M has an inertia so that it is regular.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, combinations_with_replacement

import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.polynomials import term_count
from lagrange_cli.mechanics.dynamics.inertia import CarryingFrame, TreeInertia, UnitMotion
from lagrange_cli.mechanics.dynamics.shared_vectors import NO_VECTOR, Shared, Vector
from lagrange_cli.mechanics.elements.tree import ENTRIES, BodyTree, TreeFrame, TreeMotion
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.scene.bodies import Body, Frame, FreeTurn, Motion
from lagrange_cli.scene.language.expression import Expression

_ZERO, _ONE, _MINUS = sp.S.Zero, sp.S.One, sp.S.NegativeOne

#: Terms of the longest position of a body that is multiplied out: those of longer chains double
#: with every joint or two. A spatial chain of six bodies has 20, and is the longest whose equations
#: are collected within :data:`.lagrange.MOST_COLLECTED_PRODUCTS`.
CHAIN_TERMS = 25

#: Part of the trace of inertia that a quaternion has along its length, as across it where moments
#: are equal.
_EVEN = sp.Rational(4, 3)


@dataclass(frozen=True)
class _Amount:
    """An angle or displacement e(q, t), or a turn with a rate alone, with its axis.

    Attributes
    ----------
    axis
        Unit vector along the axes of space.
    is_turn
        True of a turn.
    slopes
        Coordinate number → ∂e/∂q, or ∂ω/∂q̇ of a turn with the rate ω alone.
    rate, bias
        ė or ω, and its rate without accelerations.
    """

    axis: Vector
    is_turn: bool
    slopes: Mapping[int, sp.Expr]
    rate: sp.Expr
    bias: sp.Expr


@dataclass
class _Link:
    """A frame with its motion, and the body at it if there is one.

    Attributes
    ----------
    parent
        The link below it; None for space.
    step
        Its origin from that of the parent.
    amounts
        Its angles and displacements.
    place
        Its origin.
    spin, change
        ω, and ω̇ without accelerations.
    velocity, acceleration
        Those of its origin, the latter without accelerations of coordinates.
    quaternions
        Numbers of the coordinates that are its quaternions.
    mass, moment, inertia
        Of all that it carries: mass, first moment and tensor about its origin.
    force, torque
        Force and moment of inertia about its origin, of all that it carries, less what acts on it.
    """

    parent: _Link | None
    step: Vector
    amounts: tuple[_Amount, ...]
    place: Vector
    spin: Vector = NO_VECTOR
    change: Vector = NO_VECTOR
    velocity: Vector = NO_VECTOR
    acceleration: Vector = NO_VECTOR
    mass: list[sp.Expr] = field(default_factory=list)
    moment: list[Vector] = field(default_factory=list)
    inertia: list[Sequence[sp.Expr]] = field(default_factory=list)
    quaternions: list[list[int]] = field(default_factory=list)
    force: list[Vector] = field(default_factory=list)
    torque: list[Vector] = field(default_factory=list)

    @property
    def below(self) -> Iterator[_Link]:
        """Yield it, then the links that it stands on."""
        link: _Link | None = self
        while link is not None:
            yield link
            link = link.parent


def has_long_chain(reduced: Reduced) -> bool:
    """Tell whether a body stands on so many frames that its position is not multiplied out.

    Multiplied out, its terms double with every joint or two; as they stand, they share the axes of
    the frames below them.
    """
    elements = zip(reduced.scene.particles, reduced.names.particle_symbols, strict=True)
    return any(
        term_count(reduced.resolved[s]) > CHAIN_TERMS
        for particle, centre in elements
        if isinstance(particle, Body) and not particle.planar
        for s in centre
    )


def recursion_of(reduced: Reduced) -> BodyRecursion | None:
    """Return the recursion over the bodies of a scene; None for short chains and beside closures.

    With closures a chain is no longer than its equations are when they are left factored. Those
    that keep the lengths of quaternions hold no places of bodies.
    """
    is_open = all(closure.name in reduced.scene.lengths for closure in reduced.closures)
    return BodyRecursion(reduced) if is_open and has_long_chain(reduced) else None


class BodyRecursion:
    """The inertia of bodies, by recursion over the tree of their frames.

    Attributes
    ----------
    position, velocity
        Raw symbol of a centre of mass → its position, and its velocity.
    """

    def __init__(self, reduced: Reduced) -> None:
        self._reduced = reduced
        self._shared = Shared()
        self._q = [c.q for c in reduced.coordinates]
        self._v = [c.v for c in reduced.coordinates]
        self._links: dict[str, _Link] = {}
        self._arms: dict[str, Vector] = {}
        self._places: dict[sp.Symbol, tuple[str, int]] = {}
        self.position: dict[sp.Symbol, sp.Expr] = {}
        self.velocity: dict[sp.Symbol, sp.Expr] = {}
        elements = zip(
            reduced.scene.particles, reduced.names.particle_symbols, reduced.masses, strict=True
        )
        for body, centre, mass in elements:
            if isinstance(body, Body):
                self._add(body, centre, mass)

    def moves(self, symbol: sp.Symbol) -> bool:
        """Tell whether a raw symbol is a component of a centre of mass."""
        return symbol in self._places

    def holds(self, name: str) -> bool:
        """Tell whether a body of this name is among these."""
        return name in self._arms

    # Forward: motions of frames, inertia of bodies.

    def _resolved(self, expressions: Iterable[Expression]) -> list[sp.Expr]:
        return [self._reduced.resolve(self._reduced.convert(e)) for e in expressions]

    def _placed(self, expressions: Sequence[Expression]) -> Vector:
        x, y, z = self._resolved(expressions)
        return x, y, z

    def _link(self, frame: Frame) -> _Link:
        if frame.name not in self._links:
            shared = self._shared
            parent = None if frame.parent is None else self._link(frame.parent)
            motions = [self._amounts(motion) for motion in frame.motions]
            moving = [[a for a in some if a.slopes or a.rate is not _ZERO] for some in motions]
            step = self._placed(frame.step)
            below = NO_VECTOR if parent is None else parent.place
            link = _Link(parent, step, tuple(chain(*moving)), shared.total((below, step)))
            if parent is not None:
                spin = parent.spin
                carried = shared.cross(spin, step)
                link.spin, link.change = spin, parent.change
                link.velocity = shared.total((parent.velocity, carried))
                link.acceleration = shared.total(
                    (
                        parent.acceleration,
                        shared.cross(parent.change, step),
                        shared.cross(spin, carried),
                    )
                )
            for amounts in moving:
                spin = link.spin
                for amount in amounts:
                    self._move(link, amount, spin)
            free = (motion for motion in frame.motions if isinstance(motion, FreeTurn))
            link.quaternions += ([*map(self._q.index, self._resolved(m.parts))] for m in free)
            self._links[frame.name] = link
        return self._links[frame.name]

    def _move(self, link: _Link, amount: _Amount, spin: Vector) -> None:
        """Add a motion of a frame along or about an axis that turns by ``spin``."""
        shared = self._shared
        added = shared.scaled(amount.rate, amount.axis)
        biased = shared.scaled(amount.bias, amount.axis)
        turning = shared.cross(spin, added)
        if amount.is_turn:
            link.change = shared.total((link.change, turning, biased))
            link.spin = shared.total((link.spin, added))
        else:
            twice = shared.scaled(sp.Integer(2), turning)
            link.acceleration = shared.total((link.acceleration, twice, biased))
            link.velocity = shared.total((link.velocity, added))

    def _amounts(self, motion: Motion | FreeTurn) -> list[_Amount]:
        """Return what a frame moves by: one angle or displacement, or three turns without angle."""
        if isinstance(motion, Motion):
            return [self._amount(motion)]
        return [self._rate(*turn) for turn in zip(motion.axes, motion.spin, strict=True)]

    def _rate(self, axis: Sequence[Expression], component: Expression) -> _Amount:
        """Return a turn by its rate ω = 2 vec(q̇ q̄), which has no bias: vec(q̇ q̇*) = 0."""
        (omega,) = self._resolved([component])
        present = symbols_in(omega)
        slopes = {j: derivative(omega, v) for j, v in enumerate(self._v) if v in present}
        return _Amount(self._placed(axis), True, slopes, omega, _ZERO)

    def _amount(self, motion: Motion) -> _Amount:
        reduced, shared = self._reduced, self._shared
        e = reduced.resolve(reduced.convert(motion.amount))
        t = reduced.names.t
        slopes = {j: derivative(e, q) for j, q in enumerate(self._q) if q in symbols_in(e)}
        parts = [(slope, self._v[j]) for j, slope in slopes.items()]
        if t in symbols_in(e):
            parts.append((derivative(e, t), _ONE))
        bias = []
        for slope, speed in parts:
            present = symbols_in(slope)
            for q, v in zip(self._q, self._v, strict=True):
                if q in present:
                    bias.append(shared.multiply(derivative(slope, q), speed, v))
            if t in present:
                bias.append(shared.multiply(derivative(slope, t), speed))
        rate = shared.add(*(shared.multiply(*pair) for pair in parts))
        return _Amount(self._placed(motion.axis), motion.is_turn, slopes, rate, shared.add(*bias))

    def _add(self, body: Body, centre: Sequence[sp.Symbol], mass: sp.Expr) -> None:
        shared, link = self._shared, self._link(body.frame)
        arm = self._arm(body)
        spin = link.spin
        carried = shared.cross(spin, arm)
        velocity = shared.total((link.velocity, carried))
        acceleration = shared.total(
            (link.acceleration, shared.cross(link.change, arm), shared.cross(spin, carried))
        )
        tensor = self._in_space(body)
        force = shared.scaled(mass, acceleration)
        torque = shared.total(
            (
                shared.times(tensor, link.change),
                shared.cross(spin, shared.times(tensor, spin)),
                shared.cross(arm, force),
            )
        )
        moment = shared.scaled(mass, arm)
        link.mass.append(mass)
        link.moment.append(moment)
        link.inertia += [tensor, shared.moved(moment, arm)]
        link.force.append(force)
        link.torque.append(torque)
        self._arms[body.name] = arm
        position = shared.total((link.place, arm))
        for k, symbol in enumerate(centre):
            self._places[symbol] = body.name, k
            self.position[symbol] = position[k]
            self.velocity[symbol] = velocity[k]

    def _arm(self, body: Body) -> Vector:
        """Return the centre of mass from the origin, along the axes of space."""
        if body.centre is None:
            return NO_VECTOR
        centre = self._placed(body.centre)
        rows = [self._placed(body.rotation[3 * i : 3 * i + 3]) for i in range(3)]
        x, y, z = (self._shared.dot(row, centre) for row in rows)
        return x, y, z

    def _in_space(self, body: Body) -> list[sp.Expr]:
        """Return the tensor R I Rᵀ of a body about its centre, along the axes of space."""
        shared = self._shared
        entries = [self._placed(body.rotation[3 * i : 3 * i + 3]) for i in range(3)]
        inertia = [self._placed(row) for row in body.inertia]
        turned = [[shared.dot(row, column) for column in inertia] for row in entries]
        tensor = []
        for i, j in ENTRIES:
            x, y, z = turned[i]
            tensor.append(shared.dot((x, y, z), entries[j]))
        return tensor

    # Loads.

    def push(self, symbol: sp.Symbol, force: sp.Expr) -> None:
        """Add a force along a component of a centre of mass."""
        name, k = self._places[symbol]
        load = [_ZERO, _ZERO, _ZERO]
        load[k] = force
        self._load(name, (load[0], load[1], load[2]), NO_VECTOR)

    def _load(self, name: str, force: Vector, torque: Vector) -> Vector:
        """Add a force at a centre of mass and a torque; return the moment about the origin."""
        shared, link = self._shared, self._links[name]
        about = shared.total((torque, shared.cross(self._arms[name], force)))
        link.force.append(shared.scaled(_MINUS, force))
        link.torque.append(shared.scaled(_MINUS, about))
        return about

    def load(
        self, name: str, components: Sequence[sp.Expr], *, is_torque: bool
    ) -> tuple[sp.Expr, ...]:
        """Add a force at a centre of mass, or a torque, and return its generalized forces."""
        shared = self._shared
        x, y, z = components
        force, torque = (NO_VECTOR, (x, y, z)) if is_torque else ((x, y, z), NO_VECTOR)
        about = self._load(name, force, torque)
        rows: list[list[sp.Expr]] = [[] for _ in self._q]
        for link in self._links[name].below:
            self._add_work(link, force, about, rows)
            about = shared.total((about, shared.cross(link.step, force)))
        return tuple(shared.add(*row) for row in rows)

    def _add_work(
        self, link: _Link, force: Vector, torque: Vector, rows: Sequence[list[sp.Expr]]
    ) -> None:
        for amount in link.amounts:
            along = self._shared.dot(amount.axis, torque if amount.is_turn else force)
            for j, slope in amount.slopes.items():
                if along is not _ZERO:
                    rows[j].append(self._shared.multiply(slope, along))

    # Backward: composite bodies.

    def tree(self, further: Mapping[tuple[int, int], Sequence[sp.Expr]]) -> BodyTree:
        """Return the frames with the bodies at them, before they carry those that stand on them."""
        shared = self._shared
        number = {id(link): k for k, link in enumerate(self._links.values())}
        frames = tuple(
            TreeFrame(
                None if link.parent is None else number[id(link.parent)],
                link.step,
                tuple(map(self._motion, link.amounts)),
                shared.add(*link.mass),
                shared.total(link.moment),
                tuple(shared.add(*(tensor[k] for tensor in link.inertia)) for k in range(6)),
            )
            for link in self._links.values()
        )
        return BodyTree(frames, {place: shared.add(*terms) for place, terms in further.items()})

    def _motion(self, amount: _Amount) -> TreeMotion:
        slopes = [*amount.slopes.values()]
        direction = self._shared.scaled(slopes[0], amount.axis) if slopes else amount.axis
        return TreeMotion(tuple(amount.slopes), direction, amount.is_turn)

    def equations(
        self,
        further: Mapping[tuple[int, int], Sequence[sp.Expr]],
        forcing: Sequence[Sequence[sp.Expr]],
    ) -> tuple[TreeInertia, list[sp.Expr]]:
        """Return M and f with the terms of all else."""
        shared = self._shared
        entries = {place: [*terms] for place, terms in further.items()}
        rows: list[list[sp.Expr]] = [[] for _ in self._q]
        number = {id(link): k for k, link in enumerate(self._links.values())}
        frames: list[CarryingFrame] = []
        for link in reversed(self._links.values()):
            mass = shared.add(*link.mass)
            moment, force, torque = map(shared.total, (link.moment, link.force, link.torque))
            inertia = [shared.add(*(t[k] for t in link.inertia)) for k in range(6)]
            self._add_work(link, force, torque, rows)
            motions = tuple(
                UnitMotion(a.axis, a.is_turn, a.slopes, *self._momentum(a, mass, moment, inertia))
                for a in link.amounts
            )
            parent = None if link.parent is None else number[id(link.parent)]
            frames.append(CarryingFrame(parent, link.step, motions))
            for numbers in link.quaternions:
                size = shared.multiply(_EVEN, shared.add(*inertia[:3]))
                for j, k in combinations_with_replacement(sorted(numbers), 2):
                    value = shared.multiply(size, self._q[j], self._q[k])
                    entries.setdefault((j, k), []).append(value)
            if link.parent is not None:
                self._carry(link, (mass, moment, inertia, force, torque))
        terms = {place: tuple(parts) for place, parts in entries.items()}
        pairs = zip(rows, forcing, strict=True)
        return (
            TreeInertia(len(self._q), tuple(reversed(frames)), terms),
            [shared.add(shared.minus(shared.add(*row)), *terms) for row, terms in pairs],
        )

    def _momentum(
        self, amount: _Amount, mass: sp.Expr, moment: Vector, inertia: Sequence[sp.Expr]
    ) -> tuple[Vector, Vector]:
        """Return momentum and moment of momentum of what a frame carries in a unit motion."""
        shared = self._shared
        if amount.is_turn:
            return shared.cross(amount.axis, moment), shared.times(inertia, amount.axis)
        return shared.scaled(mass, amount.axis), shared.cross(moment, amount.axis)

    def _carry(
        self,
        link: _Link,
        whole: tuple[sp.Expr, Vector, Sequence[sp.Expr], Vector, Vector],
    ) -> None:
        """Add what a frame carries to what that below it carries."""
        shared, parent, step = self._shared, link.parent, link.step
        assert parent is not None
        mass, moment, inertia, force, torque = whole
        shift = shared.scaled(mass, step)
        parent.mass.append(mass)
        parent.moment += [moment, shift]
        # About the other origin: J + (2 m·d + M d·d) 1 − m dᵀ − d mᵀ − M d dᵀ.
        doubled = shared.total((shift, moment))
        parent.inertia.append(inertia)
        parent.inertia.append(shared.moved_both(moment, doubled, step))
        parent.force.append(force)
        parent.torque += [torque, shared.cross(step, force)]
