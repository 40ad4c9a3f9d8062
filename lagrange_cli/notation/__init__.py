"""Expressions as a person writes them: Unicode, LaTeX, Typst, MathML, the language of scenes.

SymPy expressions go in; an ordered display tree is built of them once (:mod:`.build`), and
printers that decide nothing about order write it. Read :mod:`.tree` first.
"""

__all__ = [
    "build",
    "families",
    "labels",
    "layout",
    "ordering",
    "page",
    "scene_language",
    "symbols",
    "tree",
    "vocabulary",
]
