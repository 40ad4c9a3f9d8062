"""Pictures of values: plots of motions, paths, sections, branches, responses, trade-offs.

A value goes in; the bytes of a file come out, by matplotlib or as LaTeX for pgfplots. Values do not
know what draws them: :mod:`.drawing` is the registry of pictures by type, and a module of
:mod:`.drawn` registers those of its value. What is drawn becomes a :class:`.picture.Picture`, which
:mod:`.style` gives its look, the same for all, before one of the two writers writes it. Of the
system itself at its start :mod:`.sketch` makes a sketch. Read :mod:`.picture` first.
"""

from lagrange_cli.pictures.drawing import draw_into, picture_of

__all__ = ["by_matplotlib", "curves", "draw_into", "drawing", "figures", "moving", "picture_of"]
