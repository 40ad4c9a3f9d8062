"""Many scenes: check each against what it expects, and report."""

from lagrange_cli.check.check import check_paths, check_scene
from lagrange_cli.check.model import Report, SceneReport
from lagrange_cli.check.walk import scenes_in

__all__ = ["Report", "SceneReport", "check_paths", "check_scene", "scenes_in"]
