"""Checks of a whole scene: names, their dependencies, and the expressions that use them.

A model goes in; problems with their places come out, none where the scene is in order. Read
:mod:`.names` first.
"""

__all__ = ["external", "names", "table"]
