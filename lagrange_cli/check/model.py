"""The outcomes of a check of scenes, as frozen values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from lagrange_cli.drawn import Reported
from lagrange_cli.errors import Edit, Mark, Problem
from lagrange_cli.scene.language.expression import Expression

SceneOutcome: TypeAlias = Literal["pass", "fail", "invalid", "timeout", "crash"]

#: All outcomes, in the order in which summaries list them.
_OUTCOMES: tuple[SceneOutcome, ...] = ("pass", "fail", "invalid", "timeout", "crash")

#: The motions that are integrated: those that expectations need alone, or that of each scene with
#: ``until`` as well, for a short span or in full.
CheckedMotions: TypeAlias = Literal["expected", "short", "full"]


@dataclass(frozen=True, slots=True)
class CheckOptions:
    """Options of a check that its outcome depends on.

    Attributes
    ----------
    parameters
        Values that replace those of the scenes.
    strict
        Warnings make a scene invalid.
    motions
        The motions that are integrated.
    """

    parameters: Mapping[str, str] = field(default_factory=dict)
    strict: bool = False
    motions: CheckedMotions = "expected"


@dataclass(frozen=True, slots=True)
class Limits:
    """The most that the check of one scene may take; None for no limit.

    Attributes
    ----------
    seconds
        Wall clock.
    memory
        Bytes of the memory of its process.
    """

    seconds: float | None = None
    memory: int | None = None

    def __bool__(self) -> bool:
        return self.seconds is not None or self.memory is not None


@dataclass(frozen=True, slots=True)
class SceneReport:
    """The outcome for one scene.

    Attributes
    ----------
    path
        The scene as it was named, or found in a folder.
    outcome
        ``pass``; ``fail``: an expectation does not hold; ``invalid``: the scene is refused;
        ``timeout``: its check reached a limit of time or memory; ``crash``: the program failed
        on it.
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
    """The outcomes for all scenes, in the order in which they were named.

    Attributes
    ----------
    scenes
        Those that were checked.
    unchecked
        Number of scenes that were not, since an earlier one did not pass.
    slowest
        Number of the slowest scenes that are listed for a person.
    brief
        True if scenes that pass are not listed for a person.
    """

    scenes: tuple[SceneReport, ...]
    unchecked: int = 0
    slowest: int = 0
    brief: bool = False

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


def edits_at(place: Expression | Mark | None, text: str) -> tuple[Edit, ...]:
    """Replace what is expected at a place; nothing where it does not stand in the file so."""
    if isinstance(place, Expression):
        place = place.mark() if place.exact else None
    return () if place is None else (Edit(place, text),)
