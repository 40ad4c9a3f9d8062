"""Conserved momenta of angles that are components of the angular momentum Σ m r × ṙ + R I ω."""

from __future__ import annotations

import sympy as sp

from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.findings import Conserved
from lagrange_cli.mechanics.proofs.zero_test import vanish

#: Particles up to which the sum is formed.
_MOST_PARTICLES = 12


def angular_momentum_axis(equations: Equations, quantity: Conserved) -> str | None:
    """Axis through the origin about which a momentum is proven to be the angular momentum."""
    angles = {c.name for c in equations.system.coordinates if c.is_angle}
    particles = equations.system.particles
    if quantity.coordinate not in angles or not 0 < len(particles) <= _MOST_PARTICLES:
        return None
    for k, axis in enumerate("xyz"):
        turns = [p.angular_momentum[k] for p in particles]
        if vanish(quantity.expression - sp.Add(*turns)):
            return axis
    return None
