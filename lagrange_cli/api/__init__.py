"""The Python interface: the pipeline's values, with the steps between them as methods.

``load("scene.yaml").derive().simulate(accuracy=1e-9)`` returns the results of the commands. Every
value is frozen; the modules behind a name are imported when it is used, those behind a step when
it is taken.

Read :mod:`.scenes` first, then :mod:`.derivation`: its methods are functions in :mod:`.analysis`,
:mod:`.motion` and :mod:`.studies`, or stand there. :mod:`.remembered_scene` answers from the cache
what was asked before, as the commands do; :mod:`.simulations` and :mod:`.ensembles` write and draw
the motions that are asked for on the way.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lagrange_cli.api.derivation import Derivation
    from lagrange_cli.api.motion import cluster_at, methods, sampled
    from lagrange_cli.api.scenes import LoadedScene, load, loads
    from lagrange_cli.api.starter import imported_scene, starter_scene
    from lagrange_cli.cache import Cache, Removed, open_cache
    from lagrange_cli.check import (
        CheckedMotions,
        CheckOptions,
        Limits,
        Report,
        SceneReport,
        Selection,
        check_paths,
        files_of,
        note_outcomes,
        scenes_in,
        update_of,
    )
    from lagrange_cli.mechanics.step_values import Way
    from lagrange_cli.report.values.reports import REPORTS, report_schema, report_values
    from lagrange_cli.scene import laid_out
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.scene.schema import scene_schema
    from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint
    from lagrange_cli.simulate.cluster.tasks import Cluster
    from lagrange_cli.simulate.ensemble.plan.enumeration import Members
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.model.requested_outputs import Reduction
    from lagrange_cli.simulate.options import SimulationOptions
    from lagrange_cli.simulate.results.trajectory import Trajectory
    from lagrange_cli.studies.section.result import Section

__all__ = [
    "REPORTS",
    "Cache",
    "CheckOptions",
    "CheckedMotions",
    "Checkpoint",
    "Cluster",
    "Derivation",
    "Formulation",
    "Limits",
    "LoadedScene",
    "Members",
    "Model",
    "Reduction",
    "Removed",
    "Report",
    "SceneReport",
    "Section",
    "Selection",
    "SimulationOptions",
    "Trajectory",
    "Way",
    "check_paths",
    "cluster_at",
    "files_of",
    "imported_scene",
    "laid_out",
    "load",
    "loads",
    "methods",
    "note_outcomes",
    "open_cache",
    "report_schema",
    "report_values",
    "sampled",
    "scene_schema",
    "scenes_in",
    "starter_scene",
    "update_of",
]

#: Module → the names that it offers here.
_OFFERED = {
    "api.derivation": ("Derivation",),
    "api.motion": ("cluster_at", "methods", "sampled"),
    "api.scenes": ("LoadedScene", "load", "loads"),
    "api.starter": ("imported_scene", "starter_scene"),
    "cache": ("Cache", "Removed", "open_cache"),
    "check.answers": ("judged_answers",),
    "check": (
        *("CheckedMotions", "CheckOptions", "Limits", "Report", "SceneReport", "Selection"),
        *("check_paths", "files_of", "note_outcomes", "scenes_in", "update_of"),
    ),
    "mechanics.step_values": ("Way",),
    "pages.server": ("PageServer", "message_page"),
    "report.values.reports": ("REPORTS", "report_schema", "report_values"),
    "scene": ("laid_out",),
    "scene.conditions": ("Formulation",),
    "scene.schema": ("scene_schema",),
    "simulate.checkpoint.checkpoint": ("Checkpoint",),
    "simulate.cluster.tasks": ("Cluster",),
    "simulate.ensemble.plan.enumeration": ("Members",),
    "simulate.model.model": ("Model",),
    "simulate.model.requested_outputs": ("Reduction",),
    "simulate.options": ("SimulationOptions",),
    "simulate.results.trajectory": ("Trajectory",),
    "studies.section.result": ("Section",),
}

_MODULES = {name: f"lagrange_cli.{module}" for module, names in _OFFERED.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a name when it is used: the command line does without most of them."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
