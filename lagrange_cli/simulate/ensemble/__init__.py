"""Many motions of one scene, that differ in parameters and initial values.

A scene and values of its members go in; a result with an accuracy of its own for each comes out,
stepped side by side in vectors where that is faster. Read :mod:`.plan`, then :mod:`.run`.
"""

__all__ = [
    "cluster",
    "enumeration",
    "input_file",
    "kept",
    "members",
    "opening",
    "plan",
    "planes",
    "planning",
    "result",
    "run",
    "sampling",
    "store",
    "summaries",
    "variants",
]
