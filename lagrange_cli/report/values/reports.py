"""The reports by name: the command of each, and its JSON Schema."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lagrange_cli.report.registry import json_of
from lagrange_cli.report.values.json_types import DRAFT, JsonObject, Schema

if TYPE_CHECKING:
    from lagrange_cli.check import Report
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.studies.fit.result import Fit
    from lagrange_cli.studies.path.result import Paths
    from lagrange_cli.studies.section.result import Section
    from lagrange_cli.studies.stress.measure import Stress
    from lagrange_cli.studies.tradeoff.result import Trade

#: Name of a report → the command that writes it.
REPORTS = {
    "derive": "lagrange derive --json",
    "analyze": "lagrange analyze --json",
    "simulate": "lagrange simulate --json",
    "ensemble": "lagrange simulate --ensemble FILE --json",
    "section": "lagrange simulate --section CONDITION --json",
    "path": "lagrange path --json",
    "fit": "lagrange fit --json",
    "tradeoff": "lagrange tradeoff --json",
    "stress": "lagrange stress --json",
    "check": "lagrange check --json",
    "cache": "lagrange cache --json",
}


def report_schema(name: str) -> Schema:
    """Return the JSON Schema of one of :data:`REPORTS`, draft 2020-12.

    >>> report_schema("check")["required"]
    ['scenes', 'summary']
    """
    return {"$schema": DRAFT, "title": REPORTS[name], **_types()[name].schema}


def _types() -> dict[str, JsonObject[Any]]:
    """Return the types of all reports, imported when a schema is asked for."""
    from lagrange_cli.report.values.analysis import ANALYSIS
    from lagrange_cli.report.values.check import CACHE, CHECK
    from lagrange_cli.report.values.derivation import derivation_type
    from lagrange_cli.report.values.simulation import ENSEMBLE, SECTION, SIMULATION
    from lagrange_cli.report.values.studies import FIT, PATHS, STRESS, TRADE

    return {
        "derive": derivation_type(),
        "analyze": ANALYSIS,
        "simulate": SIMULATION,
        "ensemble": ENSEMBLE,
        "section": SECTION,
        "path": PATHS,
        "fit": FIT,
        "tradeoff": TRADE,
        "stress": STRESS,
        "check": CHECK,
        "cache": CACHE,
    }


def report_values(
    result: Trajectory | Section | Paths | Fit | Trade | Stress | Report,
) -> dict[str, Any]:
    """Return a result as values that JSON can hold, as ``--json`` writes them.

    A trajectory is without the times that the command took. Derivations and analyses have a
    method ``report``.
    """
    values: dict[str, Any] = json_of(result)
    return values
