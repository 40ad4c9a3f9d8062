"""The text of a scene to begin with: a starter, or one from the description of a robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Problem

if TYPE_CHECKING:
    from lagrange_cli.robots.importing import ImportedScene

_STARTER = """\
# A scene of lagrange. Change it line by line; these say what it is, and what is wrong with it:
#   lagrange derive {name}.yaml
#   lagrange check {name}.yaml
#   lagrange simulate {name}.yaml --plot {name}.pdf
name: {name}
title: Pendulum

# Constants. Units are checked. One without a value, k: {{}}, stays a symbol until -p k=3.
parameters:
  m: {{value: 1, unit: kg, description: mass of the bob}}
  l: {{value: 2, unit: m, positive: true, description: length of the rod}}
  g: {{value: 9.81, unit: m/s^2, description: gravitational acceleration}}

# Every particle stays in this plane; z points up.
plane: xz

# Point masses. Bare names in a position are their Cartesian coordinates: 3 for each.
particles:
  bob: {{mass: m, position: [x, y, z]}}

# Equations that always hold, each takes a degree of freedom; an inequality >= takes none.
constraints:
  rod: x^2 + z^2 = l^2

# The coordinates that you want, and what tells how they describe the motion.
coordinates: [theta]
definitions:
  x: l*sin(theta)
  z: -l*cos(theta)

# Nothing acts that is not written. Terms of V; {{gravity: g}} is the weight of every particle.
potentials:
  weight: {{gravity: g}}
  # spring: {{spring: [origin, bob], stiffness: k, length: l0}}

# Forces without a potential, and Rayleigh's dissipation function.
# forces:
#   wind: {{on: bob, force: [F*cos(t), 0, 0]}}
# dissipation:
#   hinge: c/2*dot(theta)^2

initial: {{theta: pi/3, dot(theta): 0}}
simulate: {{until: 10, accuracy: 1e-9}}

# What must come out: lagrange check compares.
expect:
  dof: 1
  conserved: [energy]
  equations: [l*ddot(theta) + g*sin(theta) = 0]
"""


def starter_scene(name: str) -> str:
    """Return the text of a commented scene of this name.

    Raises
    ------
    InputError
        The name is no identifier.
    """
    from lagrange_cli.scene.language.tokens import IDENTIFIER

    if not IDENTIFIER.fullmatch(name):
        hint = "letters, digits and _, beginning with a letter: lagrange new pendulum"
        raise InputError(Problem(f"'{name}' is no name of a scene", hint=hint, rule="name"))
    return _STARTER.format(name=name)


def imported_scene(robot: str, *, limits: bool = False, floating: bool = False) -> ImportedScene:
    """Return the scene of a robot from a file of URDF or MJCF, ``-`` for standard input.

    Parameters
    ----------
    limits
        True for limits of joints as one-sided constraints.
    floating
        True if the root of the robot, which otherwise is fixed in space, moves freely.

    Returns
    -------
    ImportedScene
        Its ``text``, and in ``warnings`` and ``remarks`` what it does not say and other names.

    Raises
    ------
    InputError
        Located: the file is no description of a robot, or says something that no scene can.
    """
    from lagrange_cli.robots.importing import import_robot

    return import_robot(robot, limits=limits, floating=floating)
