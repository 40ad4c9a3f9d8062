"""Tuned numbers of the accuracy controller: each with its meaning and what set it."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class ScheduleTuning:
    """Tuned numbers of the schedule of attempts.

    Those without a measurement trade attempts that are made in vain against accuracies that are
    not reached.

    Attributes
    ----------
    first
        First tolerance as a part of eps: errors are 5 tolerances in the median of the shipped
        scenes, 500 in one of twenty (benchmarks/tolerances.py).
    first_gauss
        The same for Gauss16, whose errors are one tolerance in the median, 14 in one of twenty.
    read_off
        Further part if coordinates are read off positions later, which may take digits.
    largest
        Largest first tolerance: differences of coarser runs say little of their errors.
    near_smallest
        A first tolerance of no more than this many smallest ones is the smallest.
    smallest_explicit, smallest_implicit
        Smallest useful tolerance of an explicit (compensated) and of an implicit run.
    most_attempts
        Attempts in one arithmetic.
    first_wider
        Largest first tolerance in wider arithmetic: a larger one was not enough in doubles.
    most_excess_wider
        Largest factor by which the first tolerance in wider arithmetic is below the last one.
    worthwhile
        Factor of samples by which each attempt in wider arithmetic must exceed the one before, if
        its error is not smaller
    closer
        by this factor.
    """

    first: float = 1e-4
    first_gauss: float = 1e-3
    read_off: float = 0.1
    largest: float = 1e-6
    near_smallest: float = 10.0
    smallest_explicit: float = 1e-16
    smallest_implicit: float = 1e-13
    most_attempts: int = 5
    first_wider: float = 1e-15
    most_excess_wider: float = 10.0
    worthwhile: float = 1.05
    closer: float = 5.0


@dataclass(frozen=True)
class AttemptTuning:
    """Tuned numbers of one attempt: its companions, and when it is given up.

    Chosen so that tests/simulate/accuracy/test_calibration.py finds no error above its
    estimate and test_cost_of_estimates.py no estimate dearer than five runs.

    Attributes
    ----------
    looser
        Tolerance of the looser companion, as a multiple of the run's.
    shorter
        Factor by which the longest step shrinks from attempt to attempt: companions may differ
        because one passed over something sharp. If they differ little, none did.
    perturbed, perturbed_step
        Tolerance and longest step of the perturbed companion, as multiples of the run's: so its
        steps fall on other times, and it meets what lies between the steps of the run.
    reused, reused_in_other_arithmetic
        Excess up to which a run is the looser companion of the next attempt: its own error is
        smaller than the estimate, in other arithmetic less so.
    hopeless
        Excess at which an attempt is given up.
    missed, early
        Excess at which it is given up before the part ``early`` of the samples, if another may
        follow: most errors grow as the time or its square.
    most_excess
        Largest excess by which the next tolerance is chosen.
    looser_weight
        Weight of the distance of the looser companion, which chance may bring close to the run.
    rounding_weight
        Weight of the distance of the perturbed companion, one draw of chance: rounding may be
        this much worse.
    only_rounding_weight
        The same if the looser companion is not perturbed: draws that count 2 and 3 are spread as
        one that counts 3.6.
    block, most_blocks
        Least number of samples between two looks at the errors, and the largest number of looks.
    block_wider
        The same least number in wider arithmetic, whose steps take longer than a look.
    look
        Right-hand sides of a run, as the coarse run lets expect them, for which a look is made.
    close
        Time before the end in which an event that only some runs see is not missing, as a part of
        the error that its time may have.
    same_end
        Part of the span within which runs that end do so for the same reason.
    lost
        Right-hand sides, as a multiple of what the coarse run lets expect, that show a run to be
        lost in its own rounding.
    gauss
        Right-hand sides that a step of Gauss16 may take, as a multiple of one of DOP853: it takes
        some 40 beside 12 to 15.
    few_evaluations
        Right-hand sides that are expected at least: a coarse run at rest takes next to none, and
        perturbed runs do not rest.
    """

    looser: float = 10.0
    shorter: float = 3.0
    perturbed: float = 2.0
    perturbed_step: float = 0.9
    reused: float = 7.0
    reused_in_other_arithmetic: float = 3.0
    hopeless: float = 10.0
    missed: float = 1.2
    early: float = 0.6
    most_excess: float = 100.0
    looser_weight: float = 2.0
    rounding_weight: float = 3.0
    only_rounding_weight: float = 4.0
    block: int = 64
    most_blocks: int = 2**14
    block_wider: int = 4
    look: int = 5000
    close: float = 0.01
    same_end: float = 1e-3
    lost: float = 4.0
    gauss: float = 4.0
    few_evaluations: int = 500


@dataclass(frozen=True)
class BatchedTuning:
    """Tuned numbers of batched runs, whose members are lanes of vectors.

    Attributes
    ----------
    schedule, attempt
        Those that single runs have as well.
    second
        Tolerance of the second attempt in doubles, as a part of eps.
    wider
        Tolerance in wider arithmetic: the error that remains is what the last place of the start
        causes.
    lowest_order, highest_order
        Orders of the Taylor series.
    above
        Orders above the one whose coefficients are the cheapest for a tolerance (Jorba and Zou):
        steps cost more than their coefficients.
    most_steps
        Steps of a run after which a member is left to a single run, which asks whether it is stiff.
    glances, glances_driven
        Slopes within the whole time that are compared with the right-hand side, and their number if
        a function depends on time.
    forgiven, least_forgiven
        Error of slopes that a step forgives, as a part of the accuracy, and its lower bound.
    only_weight
        Weight of the distance of the looser companion where there is no other: by chance it may
        have come to the same place as the run.
    pattern_weight
        Weight of each distance where eight companions have been perturbed by different patterns:
        eight hardly come where only the run has gone.
    more_patterns
        Patterns of the six further companions of a run at the smallest tolerance, where rounding is
        all that makes runs differ. They fill the lanes of one register, so that they take as long
        as one.
    least_of_one
        Smallest tolerance at which one companion may decide: below it rounding may be what moves
        the run.
    """

    schedule: ScheduleTuning
    attempt: AttemptTuning
    second: float = 1e-7
    wider: float = 1e-17
    lowest_order: int = 6
    highest_order: int = 24
    above: int = 2
    most_steps: int = 20_000
    glances: int = 768
    glances_driven: int = 3072
    forgiven: float = 1e-2
    least_forgiven: float = 1e-13
    only_weight: float = 20.0
    pattern_weight: float = 0.25
    more_patterns: tuple[int, ...] = tuple(range(3, 9))
    least_of_one: float = 1e-15

    def weights(self, companions: int) -> tuple[float, ...]:
        """Return the weights of the distances from 1, 2 or 8 companions."""
        if companions == 1:
            return (self.only_weight,)
        if companions == 2:
            return self.attempt.looser_weight, self.attempt.rounding_weight
        return (self.pattern_weight,) * companions


#: Tuned numbers of single runs.
SCHEDULE, ATTEMPT = ScheduleTuning(), AttemptTuning()

#: Tuned numbers of batched runs: those of single runs but for four, with which
#: benchmarks/member_calibration.py finds no member above its accuracy.
#:
#: ``first`` is smaller, since no coarse run tells what a motion loses, a second attempt leaves most
#: lanes empty, and a Taylor series reaches a smaller tolerance by its order, at little cost.
#: ``looser`` is smaller, since the weight of an only companion multiplies its distance: some three
#: errors of the run instead of nine. The ``perturbed`` companion is more accurate than the run
#: instead of less, and its ``perturbed_step`` shorter: only members that one companion does not
#: decide have it, so that its cost matters less than its own error; of one order more, it would
#: otherwise step at nearly the run's times.
BATCHED = BatchedTuning(
    replace(SCHEDULE, first=1e-5),
    replace(ATTEMPT, looser=4.0, perturbed=0.5, perturbed_step=0.8),
)
