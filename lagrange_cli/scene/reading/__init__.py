"""The sections of a scene file: from YAML to the values of the model.

YAML with positions goes in; declarations, physics, initial and simulated values come out, helpers
written out. Read :mod:`.source` for how places are kept, then :mod:`.declarations`.
"""

__all__ = [
    "conditions",
    "declarations",
    "entries",
    "frames",
    "helpers",
    "overrides",
    "physics",
    "quaternions",
    "source",
]
