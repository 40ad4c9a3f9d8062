"""Many motions of one scene, that differ in parameters and initial values.

A scene and values of its members go in; a result with an accuracy of its own for each comes out,
stepped side by side in vectors where that is faster. Read :mod:`.run` first.
"""

__all__ = ["input_file", "members", "planning", "result", "run", "store", "variants"]
