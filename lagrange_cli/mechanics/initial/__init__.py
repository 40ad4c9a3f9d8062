"""The initial state, and the section ``simulate`` as numbers.

Values of the scene and equations go in; coordinates and velocities that satisfy closures and gaps
come out, or a refusal with values to paste. Read :mod:`.state` first.
"""

__all__ = [
    "known_inputs",
    "projection",
    "rank_deficient_start",
    "simulation_defaults",
    "state",
    "state_starts",
    "suggestions",
    "written_start",
]
