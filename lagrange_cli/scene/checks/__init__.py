"""Checks of a whole scene: names, what depends on what, what is used.

A model goes in; problems with their places come out, none where the scene is in order. Read
:mod:`.names` first.
"""

__all__ = ["names", "table"]
