"""Masses of particles over parameters, checked to be constant and positive."""

from __future__ import annotations

import sympy as sp

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.values import ParameterValues
from lagrange_cli.scene.model import Particle


def particle_mass(names: Names, values: ParameterValues, particle: Particle) -> sp.Expr:
    """Convert the mass of a particle to an expression over parameters.

    Raises
    ------
    InputError
        It is not constant, or not positive.
    """
    mass = names.convert(particle.mass)
    if not mass.free_symbols <= set(names.parameters.values()):
        raise InputError(
            Problem(
                f"the mass of '{particle.name}' may hold numbers and parameters only",
                particle.mass.mark(),
                rule="mass",
            )
        )
    value = values.number(particle.mass)
    if value is not None and not value.is_positive:
        raise InputError(
            Problem(
                f"the mass of '{particle.name}' must be positive, found {particle.mass.text}"
                + ("" if value.is_Integer and particle.mass.text == str(value) else f" = {value}"),
                particle.mass.mark(),
                hint="a position without mass is written under 'points'",
                rule="mass",
            )
        )
    return mass
