"""Minimal form of a scene whose declared coordinates are related by integrated rates.

``a*dot(phi) = (R + a)*dot(theta)`` is kept beside the coordinates with a multiplier, since both
were asked for. Where as few coordinates as degrees of freedom are asked for instead, its integral
gives one of them by the other.
"""

from __future__ import annotations

from dataclasses import replace

from lagrange_cli.mechanics.elimination.solve_equation import linear_parts, solves_everywhere
from lagrange_cli.mechanics.reduction.reduce import reduce
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.yaml_snippets import must_stay


def minimal_form(reduced: Reduced) -> Reduced:
    """Eliminate declared coordinates that closures give by others at all configurations.

    Raises
    ------
    InputError
        As :func:`.reduce.reduce`.
    """
    while (name := _given_by_others(reduced)) is not None:
        scene = reduced.scene
        kept = tuple(c for c in scene.coordinates or () if c.name != name)
        reduced = reduce(replace(scene, coordinates=kept, eliminated=(*scene.eliminated, name)))
    return reduced


def _given_by_others(reduced: Reduced) -> str | None:
    """A declared coordinate that a closure is linear in, and that no force acts on.

    The last declared, those that the scene asks for only where there are no others.
    """
    scene, names = reduced.scene, reduced.names
    constants = frozenset(names.parameters.values())
    forced = {force.on for force in scene.forces}
    candidates = []
    for closure in reduced.closures:
        phi = closure.left - closure.right
        if closure.kind != "position" or any(
            c.q in phi.free_symbols for c in reduced.coordinates if c.name not in names.coordinates
        ):
            continue  # what is not declared is to be eliminated, not what is
        for name, q in names.coordinates.items():
            parts = linear_parts(phi, q) if q in phi.free_symbols and name not in forced else None
            if parts is not None and solves_everywhere(*parts, constants):
                candidates.append(name)
    candidates.sort(key=lambda name: (not must_stay(scene, name), [*names.coordinates].index(name)))
    return candidates[-1] if candidates else None
