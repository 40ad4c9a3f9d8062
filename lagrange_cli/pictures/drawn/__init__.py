"""Pictures of the values of other rooms, a module for each of them.

A value goes in, a :class:`~lagrange_cli.pictures.picture.Picture` comes out; modes alone, which are
sketches that move, draw themselves. Read :mod:`.motions` first.
"""

__all__ = ["branches", "families", "maps", "modes", "responses"]
