"""The outcomes of a check of scenes, as frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

from lagrange_cli.drawn import Reported
from lagrange_cli.errors import Problem

SceneOutcome: TypeAlias = Literal["pass", "fail", "invalid", "crash"]

#: All outcomes, in the order in which summaries list them.
_OUTCOMES: tuple[SceneOutcome, ...] = ("pass", "fail", "invalid", "crash")


@dataclass(frozen=True, slots=True)
class SceneReport:
    """The outcome for one scene.

    Attributes
    ----------
    path
        The scene as it was named, or found in a folder.
    outcome
        ``pass``; ``fail``: an expectation does not hold; ``invalid``: the scene is refused;
        ``crash``: the program failed on it.
    seconds
        Wall clock of its check.
    problems
        The reasons why it did not pass.
    trace
        Traceback of a crash, else empty.
    """

    path: str
    outcome: SceneOutcome
    seconds: float
    problems: tuple[Problem, ...] = ()
    trace: str = ""


@dataclass(frozen=True, slots=True)
class Report(Reported):
    """The outcomes for all scenes, in the order in which they were named."""

    scenes: tuple[SceneReport, ...]

    @property
    def summary(self) -> dict[str, int]:
        """Return the number of scenes of each outcome; ``pass`` and ``fail`` are always there."""
        counts = {o: sum(s.outcome == o for s in self.scenes) for o in _OUTCOMES}
        return {o: n for o, n in counts.items() if n or o in ("pass", "fail")}

    @property
    def exit_code(self) -> int:
        """Return 3 if a scene crashed, else 1 if one failed or is invalid, else 0."""
        outcomes = {scene.outcome for scene in self.scenes}
        if "crash" in outcomes:
            return 3
        return 1 if outcomes - {"pass"} else 0
