"""Systems with contacts, written by hand: their right-hand sides, events and resets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.events import TerminalEvents
from lagrange_cli.simulate.integrators.hybrid.contact_system import ContactMode, Gaps, HybridRhs
from lagrange_cli.simulate.integrators.right_hand_side import Rhs

G = 9.81


@dataclass(frozen=True)
class OneContact(HybridRhs):
    """One particle of mass 1 in the xz plane under gravity beside one contact.

    ``gap`` and ``push`` (the multiplier) at y = [x, z, ẋ, ż]; ``held`` gives accelerations in
    contact; ``normal`` the gradient of the gap.
    """

    gap: Callable[[Array], float]
    normal: Callable[[Array], Array]
    push: Callable[[Array], float]
    held: Callable[[Array], Array]
    restitution: float = 0.0

    free = (False,)

    def __call__(self, t: float, y: Array) -> Array:
        return np.array([y[2], y[3], 0.0, -G])

    def project(self, t: float, y: Array) -> Array:
        return np.array(y)

    def side(self, closed: ContactMode) -> Rhs:
        if not closed[0]:
            return lambda t, y: self(t, y)
        return lambda t, y: np.concatenate([y[2:], self.held(y)])

    def terminal_events(
        self,
        closed: ContactMode,
        signs: tuple[float, ...],
        noise: tuple[float, ...],
        reach: tuple[float, ...] = (),
    ) -> TerminalEvents:
        of = self.push if closed[0] else self.gap
        return TerminalEvents(lambda t, y: np.array([of(y)]), signs, noise, reach=reach)

    def gaps(self, t: float, y: Array) -> Gaps:
        gap, size, normal = [self.gap(y)], [1.0], [self.normal(y)]
        return Gaps(np.array(gap), np.array(size), np.array(normal), np.zeros(1), self.bias(y))

    def bias(self, y: Array) -> Array:
        """What φ̈ is beside gradient·q̈: of gradients that are linear in the coordinates."""
        turn = self.normal(y + np.concatenate([y[2:], y[2:]])) - self.normal(y)
        return np.array([turn @ y[2:]])

    def reset(
        self, t: float, y: Array, closed: ContactMode, event: int, bounce: float
    ) -> tuple[Array | None, ContactMode]:
        y, normal = np.array(y), self.normal(y)
        if event == 0 and closed[0]:
            return y, (False,)
        if event < 0 and not self.gaps(t, y).touching[0]:
            return y, (False,)
        approach = float(normal @ y[2:])
        if approach < -1e-12:
            y[2:] -= (1 + bounce * self.restitution) * approach * normal / (normal @ normal)
        return y, (float(normal @ y[2:]) < 1e-12 and self.push(y) > 0,)


def ball(restitution: float) -> OneContact:
    """A ball over the floor z = 0."""
    return OneContact(
        gap=lambda y: float(y[1]),
        normal=lambda y: np.array([0.0, 1.0]),
        push=lambda y: G,
        held=lambda y: np.zeros(2),
        restitution=restitution,
    )


def on_sphere(radius: float = 1.0) -> OneContact:
    """A particle outside of a circle about the origin: φ = x² + z² − R²."""

    def push(y: Array) -> float:
        return float((G * y[1] - y[2:] @ y[2:]) / (2 * y[:2] @ y[:2]))

    return OneContact(
        gap=lambda y: float(y[:2] @ y[:2] - radius**2),
        normal=lambda y: 2 * y[:2],
        push=push,
        held=lambda y: np.array([0.0, -G]) + 2 * push(y) * y[:2],
    )
