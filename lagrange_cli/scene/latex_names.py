"""Names of a scene that it says how to print in LaTeX."""

from __future__ import annotations

from collections.abc import Iterator

from lagrange_cli.errors import Mark
from lagrange_cli.scene.model import Constraint, Particle, Point, Scene, Unilateral

_AXES = ("x", "y", "z")


def latex_names(scene: Scene) -> Iterator[tuple[str, str, Mark]]:
    """Yield names beside those of parameters and coordinates with their LaTeX and their places.

    The components of a particle or point have its LaTeX below them.
    """
    for definition in scene.definitions:
        if definition.latex is not None:
            yield definition.name, definition.latex, definition.mark
    bodies: tuple[Particle | Point, ...] = (*scene.particles, *scene.points)
    for body in bodies:
        if body.latex is not None:
            for axis in _AXES:
                yield f"{axis}_{body.name}", f"{axis}_{{{body.latex}}}", body.mark


def constraints(scene: Scene) -> tuple[Constraint | Unilateral, ...]:
    """All constraints, those by inequalities last."""
    return (*scene.constraints, *scene.unilateral)


def stating(scene: Scene, equation: str) -> tuple[Constraint | Unilateral, str] | None:
    """Find the constraint that an equation is called by, and its number among several of it.

    ``equation``: name of a closure equation or gap, such as ``rod`` or ``plumb_2``.
    """
    entries = {entry.name: entry for entry in constraints(scene)}
    if equation in entries:
        return entries[equation], ""
    name, _, number = equation.rstrip("_").rpartition("_")
    return (entries[name], number) if name in entries else None
