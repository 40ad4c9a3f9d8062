"""Simulations as JSON: a trajectory, an ensemble, and points of a Poincaré section."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

from lagrange_cli.report.values.json_types import (
    BOOLEAN,
    INTEGER,
    MAYBE_NUMBER,
    NAMES,
    NUMBER,
    REASON,
    TEXT,
    JsonObject,
    Key,
    by_name,
    list_of,
    one_of,
    or_null,
    through,
)

if TYPE_CHECKING:
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.simulate.ensemble.plan.enumeration import Members
    from lagrange_cli.simulate.ensemble.plan.plan import Plan
    from lagrange_cli.simulate.ensemble.store.blocks import Failure, NumberRange
    from lagrange_cli.simulate.ensemble.store.store import Store
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.results.trajectory import Event, Slide
    from lagrange_cli.studies.section.result import Section, SectionPoints

# A trajectory.


@dataclass(frozen=True, slots=True)
class Simulated:
    """The result of a simulation.

    Attributes
    ----------
    trajectory
        The motion.
    model
        Model in the formulation that was asked for; the motion may have been found in another one.
        None if nothing but the motion is known.
    extra
        Names of further columns that were asked for.
    derive_seconds
        Wall clock from the start of the command to the model.
    """

    trajectory: Trajectory
    model: Model | None = None
    extra: Sequence[str] = ()
    derive_seconds: float = 0.0

    @property
    def in_other_form(self) -> bool:
        """True if the motion was found in another formulation than the model's."""
        return self.model is not None and self.trajectory.formulation != self.model.formulation

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the coordinates and outputs."""
        outputs = () if self.model is None else self.model.outputs
        return (*self.trajectory.coordinates, *outputs)

    def further(self) -> dict[str, float]:
        """Return the last values of further columns, those of the state apart."""
        columns = self.trajectory.table(self.extra)
        further_names = [n for n in columns if n != "t" and n not in self.trajectory.columns]
        return {name: float(columns[name][-1]) for name in further_names}


_SCALED: tuple[Key[Any], ...] = (
    Key("requested", MAYBE_NUMBER, "The accuracy asked for; null if a method was chosen."),
    Key("estimated", MAYBE_NUMBER, "The estimated error over the scales; null if there is none."),
    Key("scales", by_name(NUMBER), "Scale of each coordinate and velocity."),
)
_ACCURACY: JsonObject[Trajectory] = JsonObject(
    *_SCALED, Key("exempt", list_of(NUMBER), "Sample times of which nothing is promised.")
)
_EVENT: JsonObject[Event] = JsonObject(
    Key("t", NUMBER, "Its time."),
    Key("name", TEXT, "contact:NAME, release:NAME or zeno:NAME, where bounces become too short."),
    Key("state", by_name(NUMBER), "Every name just after it."),
    Key("before", by_name(NUMBER), "Every name just before it, where velocities jump.", None, True),
)
_SLIDE: JsonObject[Slide] = JsonObject(
    Key("on", TEXT, "The expression that stays zero: an argument, or a difference of arguments."),
    Key("start", NUMBER, "Time from which it does."),
    Key("end", MAYBE_NUMBER, "Time until which it does; null where it does at the last sample."),
)
_MOTION: tuple[Key[Trajectory], ...] = (
    Key("name", TEXT, "Name of the scene."),
    Key(
        "status",
        one_of("ok", "accuracy_not_reached", "stopped", "blow_up"),
        "How it ended; accuracy_not_reached: the result holds until holds_until; blow_up: the"
        " motion ends, with a singularity or an overflow; stopped: by a signal or the budget.",
    ),
    Key("t", NUMBER, "Time of the last sample.", lambda motion: float(motion.t[-1])),
    Key("state", by_name(NUMBER), "Every name at the last sample."),
    Key("accuracy", _ACCURACY, "What is promised of every sample.", lambda motion: motion),
    Key("holds_until", MAYBE_NUMBER, "Time until which the promise holds."),
    Key("energy_drift", MAYBE_NUMBER, "Drift of the energy; null if none is conserved."),
    Key(
        "conserved_drift",
        by_name(MAYBE_NUMBER),
        "Drift of each conserved quantity, with --with conserved.",
        optional=True,
    ),
    Key(
        "constraint_drift",
        MAYBE_NUMBER,
        "Largest drift of constraints beside the coordinates; null without any.",
    ),
    Key("method", TEXT, "The method of integration."),
    Key("implementation", TEXT, "What evaluates the equations and makes the steps."),
    Key("formulation", one_of("minimal", "multiplier"), "The form of the equations that ran."),
    Key("steps", INTEGER, "Number of steps."),
    Key("rhs_evaluations", INTEGER, "Number of right-hand sides."),
    Key(
        "reason",
        REASON,
        "Why the motion ends before its time, with contacts that are in the way; null if not.",
    ),
    Key("remarks", NAMES, "Why another form or chart was taken."),
    Key("events", list_of(_EVENT), "What happens to contacts."),
    Key("slides", list_of(_SLIDE), "Times for which the motion slides along kinks."),
)
#: The motion alone, without the columns and times of a command.
TRAJECTORY = JsonObject(*_MOTION)
SIMULATION: JsonObject[Simulated] = JsonObject(
    *through(lambda simulated: simulated.trajectory, *_MOTION),
    Key(
        "seconds",
        by_name(NUMBER),
        "Wall clock of each part: derive, compile, integrate, estimate, follow.",
        lambda simulated: {"derive": simulated.derive_seconds, **simulated.trajectory.seconds},
    ),
    Key(
        "with",
        by_name(MAYBE_NUMBER),
        "Last values of the further columns of --with.",
        lambda simulated: simulated.further() if simulated.extra else None,
        optional=True,
    ),
)

# An ensemble.


@dataclass(frozen=True, slots=True)
class SimulatedMembers:
    """The results of an ensemble.

    Attributes
    ----------
    plan, members
        The runs that were planned, and the values of all members.
    store
        What is known of all.
    output
        The file with the samples; None if none was asked for.
    seconds
        Wall clock of ``derive`` and ``integrate``.
    """

    plan: Plan
    members: Members
    store: Store
    output: str | None
    seconds: Mapping[str, float]

    def counts(self) -> dict[str, int]:
        """Return status → number of members."""
        return self.store.counts()

    def failed(self, most: int | None = None) -> list[dict[str, Any]]:
        """Return the members that are not ``ok``, or the first ones, as JSON values."""
        return [_FAILED.write(failed) for failed in islice(self.failures(), most)]

    def failures(self) -> Iterator[FailedMember]:
        """Yield the members that are not ``ok``."""
        return (FailedMember(self.members, failure) for failure in self.store.failures())

    def reduced(self) -> dict[str, tuple[NumberRange, float]]:
        """Return reduction, as it was written → range of its numbers, and their largest error."""
        ranges = self.store.ranges()
        names = [n.removeprefix("reduced/") for n in ranges if n.startswith("reduced/")]
        return {n: (ranges[f"reduced/{n}"], ranges[f"reduced_error/{n}"].largest) for n in names}


class FailedMember(NamedTuple):
    """A member that is not ``ok``, with the values of all."""

    members: Members
    failure: Failure


_FAILED: JsonObject[FailedMember] = JsonObject(
    Key("member", INTEGER, "Its number, from 0.", lambda failed: failed.failure.member),
    Key(
        "values",
        by_name(TEXT),
        "Its values.",
        lambda failed: failed.members.values(failed.failure.member),
    ),
    *through(
        lambda failed: failed.failure,
        Key(
            "status",
            one_of("accuracy_not_reached", "stopped", "blow_up", "refused"),
            "How it ended; refused: it cannot be begun.",
        ),
        Key("holds_until", MAYBE_NUMBER, "Time until which it is known; null if it was refused."),
        Key("reason", TEXT, "Why, in words."),
    ),
)
_REDUCED: JsonObject[tuple[NumberRange, float]] = JsonObject(
    *through(
        lambda pair: pair[0],
        Key("least", MAYBE_NUMBER, "Least number; null if no member has one."),
        Key(
            "largest", MAYBE_NUMBER, "Largest number; null if no member has one or it is infinite."
        ),
        Key("known", INTEGER, "Number of members that have one."),
    ),
    Key("error", MAYBE_NUMBER, "Largest error; null without a bound.", lambda pair: pair[1]),
)
ENSEMBLE: JsonObject[SimulatedMembers] = JsonObject(
    Key("name", TEXT, "Name of the scene.", lambda simulated: simulated.plan.model.name),
    Key("members", INTEGER, "Number of members.", lambda simulated: len(simulated.members)),
    Key(
        "finished",
        INTEGER,
        "Number of members that have ended, in whatever way.",
        lambda simulated: sum(simulated.counts().values()),
    ),
    Key("counts", by_name(INTEGER), "Number of members of each status.", lambda s: s.counts()),
    Key("failed", list_of(_FAILED), "Members that are not ok.", lambda s: s.failures()),
    Key(
        "estimated",
        MAYBE_NUMBER,
        "Largest estimated error of all members over the scales; null if there is none.",
        lambda simulated: simulated.store.estimated(),
    ),
    Key("reduced", by_name(_REDUCED), "Range of each --reduce.", lambda s: s.reduced()),
    Key(
        "numbers_alone",
        BOOLEAN,
        "True if members differ in numbers alone: the scene was derived once.",
        lambda simulated: simulated.plan.alone,
    ),
    Key("output", or_null(TEXT), "The file with the samples; null if there is none."),
    Key("seconds", by_name(NUMBER), "Wall clock of derive and integrate."),
)

# Points of a section.

_POINTS: JsonObject[SectionPoints] = JsonObject(
    Key("given", by_name(TEXT), "Values of the member; empty for a single motion."),
    Key(
        "status",
        one_of("ok", "accuracy_not_reached", "stopped", "blow_up", "refused"),
        "How the motion ended; refused: it cannot be begun.",
    ),
    Key("points", INTEGER, "Number of its points.", lambda points: len(points.t)),
    Key("uncertain", INTEGER, "Number of points whose estimate is above the accuracy."),
    Key("open", list_of(NUMBER), "Times at which the number of points is open."),
    Key("t", list_of(NUMBER), "Times of the points."),
    Key("state", by_name(list_of(NUMBER)), "Every name at the points.", lambda p: p.columns),
    Key(
        "error",
        list_of(NUMBER),
        "The estimate for each point, where an accuracy is promised.",
        optional=True,
    ),
    Key("accuracy", JsonObject(*_SCALED), "What is promised of the motion.", lambda p: p),
    Key("holds_until", MAYBE_NUMBER, "Time until which the promise holds."),
    Key("energy_drift", MAYBE_NUMBER, "Drift of the energy; null if none is conserved."),
    Key("method", TEXT, "The method of integration."),
    Key(
        "reason",
        REASON,
        "Why the motion ends before its time, with contacts that are in the way; null if not.",
    ),
    Key("runs", INTEGER, "How often the motion was run."),
    Key("seconds", NUMBER, "Wall clock of all of it."),
)
SECTION: JsonObject[Section] = JsonObject(
    Key("name", TEXT, "Name of the scene."),
    Key("section", TEXT, "The condition.", lambda section: section.condition),
    Key("points", INTEGER, "Number of points of all members.", len),
    Key("members", list_of(_POINTS), "Points of each motion."),
)
