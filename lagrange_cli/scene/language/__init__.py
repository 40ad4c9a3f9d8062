"""The language of expressions in scenes, and of families of names.

Text goes in; syntax trees of :mod:`.expression` come out, every node with its place, bounded in
size and depth, or problems located to the character. Nothing here knows which sections a scene
has. Read :mod:`.expression`, then :mod:`.grammar`.
"""

__all__ = [
    "bounds",
    "expression",
    "families",
    "grammar",
    "problems",
    "rotations",
    "templates",
    "tokens",
    "written_text",
]
