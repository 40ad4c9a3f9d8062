"""Descriptions of robots, URDF and MJCF, → text of a scene.

:mod:`.xml_reader` reads XML within bounds; :mod:`.urdf` and :mod:`.mjcf` make a
:class:`~.robot.Robot` of it, a tree of links and joints; :mod:`.placing` makes frames, bodies and
coordinates of that, and :mod:`.scene_text` writes them as a person would. Numbers are decimals as
written (:mod:`.quantities`). Read :mod:`.importing` first.
"""

__all__ = ["importing"]
