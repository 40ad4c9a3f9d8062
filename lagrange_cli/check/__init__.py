"""Many scenes: check each against its own expectations, and report.

Paths of files and folders go in, a :class:`Report` comes out. Read :mod:`.check` first.
"""

from lagrange_cli.check.check import check_paths, check_scene
from lagrange_cli.check.model import CheckedMotions, CheckOptions, Limits, Report, SceneReport
from lagrange_cli.check.selection import Selection, note_outcomes
from lagrange_cli.check.update import Update, update_of
from lagrange_cli.check.walk import files_of, scenes_in

__all__ = [
    "CheckOptions",
    "CheckedMotions",
    "Limits",
    "Report",
    "SceneReport",
    "Selection",
    "Update",
    "check_paths",
    "check_scene",
    "files_of",
    "note_outcomes",
    "scenes_in",
    "update_of",
]
