"""Equations → a picture of the system at its start: TikZ, SVG.

:mod:`.configurations` evaluates positions at the start and around it; :mod:`.angles`,
:mod:`.links`, :mod:`.wheels` and :mod:`.guides` find what can be drawn and verify it there;
:mod:`.outlines` has the shapes of rigid bodies;
:mod:`.composition` lays it out as a :class:`~.sketch.Sketch`, which :mod:`.tikz` and :mod:`.svg`
print; :mod:`.displaced` draws shapes of modes. Read :mod:`.sketch` first.
"""

__all__ = [
    "configurations",
    "displaced",
    "findings",
    "guides",
    "links",
    "outlines",
    "sketch",
    "svg",
    "tikz",
    "view",
    "wheels",
]
