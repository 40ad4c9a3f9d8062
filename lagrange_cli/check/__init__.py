"""Many scenes: check each against its own expectations, and report.

Paths of files and folders go in, a :class:`Report` comes out. Read :mod:`.check` first.
"""

from lagrange_cli.check.check import check_paths, check_scene
from lagrange_cli.check.model import Report, SceneReport
from lagrange_cli.check.walk import scenes_in

__all__ = ["Report", "SceneReport", "check_paths", "check_scene", "scenes_in"]
