"""Gaps, events and modes of a system with contacts, and a right-hand side for each mode.

:mod:`.contact_motion` follows such a motion; what it needs of a system stands here.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.events import TerminalEvents
from lagrange_cli.simulate.integrators.right_hand_side import Rhs, StructuredRhs

#: For each contact whether it is closed.
ContactMode: TypeAlias = tuple[bool, ...]

#: Events of a contact: it closes, for an instant or for longer; it opens; it closes since
#: its bounces have become too short.
ContactEventKind: TypeAlias = Literal["contact", "release", "zeno"]

#: A gap is zero below this part of what it is the difference of.
TOUCHING = 1e-12


@dataclass(frozen=True)
class ModeChange:
    """An event of a contact.

    Attributes
    ----------
    t
        Its time.
    contact
        Number of the contact.
    kind
        What the contact does.
    before, after
        States on both sides of it, shape (2n,).
    flags
        Contacts that are closed behind it.
    """

    t: float
    contact: int
    kind: ContactEventKind
    before: Array
    after: Array
    flags: ContactMode

    @property
    def jumps(self) -> bool:
        """Velocities changed."""
        return not np.array_equal(self.before, self.after)


@dataclass(frozen=True)
class NearContact:
    """A gap that comes close to zero and opens again, by itself or since it was struck.

    Attributes
    ----------
    t, contact
        Its time, and the number of the contact.
    least
        Its least value; negative where it was struck: the one it would have had without.
    bend
        φ̈ there.
    size
        Magnitude of the terms that the gap is the difference of.
    gradient
        ∂φ/∂q there, shape (n,).
    y, closed
        The state there, shape (2n,), and the contacts that are closed.
    """

    t: float
    contact: int
    least: float
    bend: float
    size: float
    gradient: Array
    y: Array
    closed: ContactMode


@dataclass(frozen=True)
class Stuck:
    """Why a motion cannot be continued, and the contacts that are in the way."""

    reason: str
    contacts: tuple[int, ...]


@dataclass(frozen=True)
class Gaps:
    """Gaps φ of all contacts at a state.

    Attributes
    ----------
    values, sizes
        φ, and the sizes of what it is the difference of, shape (U,).
    gradients
        ∂φ/∂q, shape (U, n).
    rates, biases
        ∂φ/∂t, and φ̈ − ∂φ/∂q·q̈, shape (U,).
    """

    values: Array
    sizes: Array
    gradients: Array
    rates: Array
    biases: Array

    @property
    def touching(self) -> ContactMode:
        """For each contact whether its gap is zero but for rounding."""
        return tuple((np.abs(self.values) <= TOUCHING * self.sizes).tolist())

    @property
    def coordinates(self) -> int:
        """The number of coordinates."""
        return int(self.gradients.shape[1])

    def speeds_at(self, y: Array) -> tuple[Array, Array]:
        """Return :meth:`speeds` at a state."""
        return self.speeds(y[self.coordinates : 2 * self.coordinates])

    def speeds(self, velocities: Array) -> tuple[Array, Array]:
        """Return the rates of the gaps, and the sizes of the sums behind them, both (U,)."""
        products = self.gradients * velocities
        sizes = np.abs(products).sum(axis=1) + np.abs(self.rates)
        return products.sum(axis=1) + self.rates, sizes

    def noise(self, errors: Array) -> Array:
        """Bound the errors of the gaps by those of the coordinates, shapes (n,) → (U,)."""
        return np.abs(self.gradients) @ errors + TOUCHING * self.sizes


class HybridRhs(StructuredRhs):
    """Right-hand sides for every set of closed contacts; called like one, it is that of none."""

    #: No contact closed.
    free: ContactMode

    @abstractmethod
    def project(self, t: float, y: Array) -> Array:
        """Move a state onto the constraints that hold without contacts."""

    @abstractmethod
    def __call__(self, t: float, y: Array) -> Array:
        """Evaluate y' with no contact closed."""

    @abstractmethod
    def side(self, closed: ContactMode) -> Rhs:
        """Return the right-hand side with these contacts closed, with a projection onto them."""

    @abstractmethod
    def terminal_events(
        self,
        closed: ContactMode,
        signs: tuple[float, ...],
        noise: tuple[float, ...],
        reach: tuple[float, ...] = (),
    ) -> TerminalEvents:
        """Return the event functions: multipliers of closed contacts and gaps of open ones."""

    @abstractmethod
    def gaps(self, t: float, y: Array) -> Gaps:
        """Evaluate the gaps at a state."""

    @abstractmethod
    def reset(
        self, t: float, y: Array, closed: ContactMode, event: int, bounce: float
    ) -> tuple[Array | None, ContactMode]:
        """Return the state and the closed contacts after the event of a contact.

        The state is None if no motion follows; then the contacts are those that together leave
        none, or none of them if that is not the reason. ``bounce`` multiplies the coefficients
        of restitution.
        """


def in_mode(rhs: Rhs, closed: ContactMode) -> Rhs:
    """Return a right-hand side with these contacts closed; itself if there are none to close."""
    return rhs.side(closed) if closed and isinstance(rhs, HybridRhs) else rhs
