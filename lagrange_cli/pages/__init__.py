"""Pages on which a system moves: HTML files that integrate the equations while they are looked at.

Equations and the trajectory of a simulation go in; the text of one HTML file comes out, without
anything that it would load. :mod:`.stage` says what is drawn, as values that the page reads;
:mod:`.page` writes the file, and :mod:`.server` serves it while a scene is written. The folder
``player`` holds the page's own JavaScript. Read :mod:`.page` first.
"""

__all__ = ["page"]
