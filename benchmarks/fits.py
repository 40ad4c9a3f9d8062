"""Fits from starts far from the truth: values that are right, or findings that say what is wrong.

Records of motions of several systems: the true values, the length of the record, the number of
measurements, which columns are measured, their noise (0.3 to 10 % of a column's deviation) and
whether it is stated are drawn at random. The fit begins with each value within a factor of 4 of the
truth, either way. It is right if its status is ``ok`` and every value is within 5 of its standard
errors of the truth; it is told if its exit code is not 0, refused if there is no fit. A status
``ok`` of values that are not right is false, and there must be none: the exit code is 1 then.

A record ends where its motion does: a ball that bounces ever faster comes to rest.

    python benchmarks/fits.py --records 100 --seed 1 --docs docs/quality/fits.md
"""

from __future__ import annotations

import argparse
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from types import FrameType

import numpy as np

from lagrange_cli import load, loads
from lagrange_cli.api import Derivation
from lagrange_cli.errors import LagrangeError
from lagrange_cli.studies.fit.result import Fit

SYSTEMS = Path(__file__).parents[1] / "systems"

HEAD = """\
# Fits

Records of motions of eleven systems, with noise of 0.3 to 10 % of a column's deviation, which is
stated in half of them, and fits that begin with each value within a factor of 4 of the truth. A fit
is right if its status is `ok` and each value is within 5 of its standard errors of the truth; it is
told if its status is another one, refused if there is no motion to begin with, out of time after
{limit} seconds of the processor. A status `ok` of other values is false. This page is the output of

    python benchmarks/fits.py --records {records} --seed {seed} --docs docs/quality/fits.md
"""

#: Largest factor between the truth and the first values.
FACTOR = 4.0

#: Standard errors within which a value is right.
ERRORS = 5.0

#: Most seconds of the processor for a fit.
LIMIT = 30.0

#: The outcomes of fits.
OUTCOMES = "right", "told", "refused", "out of time", "false"

#: First values of these are at most so large: a restitution is below 1.
LARGEST = {"e": 0.99}

#: Noise over the standard deviation of a column, least and most.
NOISE = 0.003, 0.1

OSCILLATOR = """
name: oscillator
parameters: {m: 1, k: 4, c: 0.2, b: 0}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2 + b*x^4/4}
dissipation: {damper: c*dot(x)^2/2}
initial: {x: 1, dot(x): 0}
simulate: {until: 10}
"""

DRIVEN = """
name: driven
parameters: {m: 1, k: 3, c: 0.3, A: 0.8, w: 2.5}
inputs: {F: A*sin(w*t)}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
forces: {drive: {on: x, force: F}}
dissipation: {damper: c*dot(x)^2/2}
initial: {x: 0.2, dot(x): 0}
simulate: {until: 15}
"""

SLIDING = """
name: sliding
parameters: {m: 1, k: 6, F: 0.3}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
forces: {friction: {on: x, force: -F*sign(dot(x))}}
initial: {x: 1, dot(x): 0}
simulate: {until: 5}
"""


@dataclass(frozen=True, eq=False)
class System:
    """A scene of which records are made.

    Attributes
    ----------
    name
        Its name in tables.
    scene
        A path below ``systems``, or the text of a scene.
    free
        What may be fitted → the range of its true values.
    columns
        What may be measured.
    until
        Range of the lengths of records.
    fixed
        Other values than the scene's.
    """

    name: str
    scene: str
    free: Mapping[str, tuple[float, float]]
    columns: tuple[str, ...]
    until: tuple[float, float]
    fixed: Mapping[str, float] = field(default_factory=dict)


RECORDED = (
    System(
        "pendulum on a cart",
        "pendulums/pendulum_on_cart.yaml",
        {"l": (0.3, 1.2), "m1": (1, 4), "phi": (0.5, 2.5)},
        ("x", "phi"),
        (3, 10),
        {"dot(x)": 0.0},
    ),
    System(
        "damped oscillator",
        OSCILLATOR,
        {"k": (2, 30), "c": (0.05, 0.6), "x": (0.5, 2)},
        ("x", "dot(x)"),
        (5, 20),
    ),
    System(
        "driven oscillator",
        DRIVEN,
        {"k": (2, 8), "c": (0.1, 0.5), "A": (0.5, 2), "w": (1, 4)},
        ("x",),
        (10, 30),
    ),
    System(
        "double pendulum",
        "pendulums/double_pendulum.yaml",
        {"l1": (0.5, 1.5), "l2": (0.5, 1.5), "m2": (0.5, 2), "theta1": (0.3, 1.2)},
        ("theta1", "theta2"),
        (2, 6),
        {"theta2": 0.5},
    ),
    System(
        "Duffing oscillator",
        "oscillators/duffing_oscillator.yaml",
        {"delta": (0.1, 0.4), "gamma": (0.2, 0.5), "omega": (0.7, 1.6)},
        ("x", "dot(x)"),
        (10, 25),
    ),
    System(
        "van der Pol oscillator",
        "oscillators/van_der_pol_oscillator.yaml",
        {"mu": (0.3, 3), "x": (0.5, 3)},
        ("x",),
        (10, 30),
    ),
    System(
        "swinging Atwood machine",
        "pulleys/swinging_atwood.yaml",
        {"M": (2, 5), "theta": (0.5, 1.6), "g": (6, 12)},
        ("r", "theta"),
        (2, 5),
    ),
    System(
        "elastic pendulum",
        "pendulums/elastic_pendulum.yaml",
        {"k": (15, 60), "l": (0.3, 0.9), "theta": (0.2, 1.0), "x": (0.05, 0.2)},
        ("x", "theta"),
        (3, 10),
    ),
    System(
        "coupled pendulums",
        "pendulums/coupled_pendulums.yaml",
        {"k": (0.5, 3), "l": (0.3, 1), "theta1": (0.2, 0.8)},
        ("theta1", "theta2"),
        (5, 20),
    ),
    System(
        "block that slides to and fro",
        SLIDING,
        {"k": (3, 12), "F": (0.1, 0.5)},
        ("x",),
        (2, 5),
    ),
    System(
        "bouncing ball",
        "contact/bouncing_ball.yaml",
        {"e": (0.6, 0.95), "h": (0.7, 2)},
        ("z",),
        (1, 3),
    ),
)


@dataclass(frozen=True)
class Record:
    """A record of one motion, and how it is fitted.

    Attributes
    ----------
    system
        What moved.
    truth, first
        True values, and those that the fit begins with.
    columns
        The columns of the table.
    """

    system: System
    truth: Mapping[str, float]
    first: Mapping[str, float]
    columns: Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Outcome:
    """The outcome of a fit, one of :data:`OUTCOMES`, and what was said.

    Attributes
    ----------
    farthest
        Largest distance of a value from the truth in its standard errors; infinite without a fit.
    seconds
        Seconds of the processor.
    """

    record: int
    system: str
    outcome: str
    seconds: float
    status: str = ""
    starts: int = 0
    runs: int = 0
    farthest: float = np.inf
    said: str = ""

    def __str__(self) -> str:
        return (
            f"{self.record} {self.system}: {self.outcome} ({self.status}), starts {self.starts}, "
            f"runs {self.runs}, {self.seconds:.2f} s, {self.farthest:.1f} errors. {self.said}"
        )


@cache
def derived(system: System) -> Derivation:
    """Derive the scene of a system."""
    text = system.scene
    return (loads(text) if "\n" in text else load(SYSTEMS / text)).derive()


def drawn_record(number: int, seed: int) -> Record:
    """Draw a record."""
    generator = np.random.default_rng([seed, number])
    system = RECORDED[number % len(RECORDED)]
    names = [n for n in system.free if generator.random() < 0.7] or [next(iter(system.free))]
    truth = {n: _logarithmic(generator, *system.free[n]) for n in names}
    factors = np.exp(generator.uniform(-1, 1, len(names)) * np.log(FACTOR))
    measured = [c for c in system.columns if generator.random() < 0.7] or [system.columns[0]]
    until = generator.uniform(*system.until)
    count = int(_logarithmic(generator, 25, 400))
    even = generator.random() < 0.5
    times = np.linspace(0, until, count) if even else np.sort(generator.uniform(0, until, count))
    motion = _motion(system, {**system.fixed, **truth}, times)
    columns = {"t": motion["t"]}
    is_stated = generator.random() < 0.5
    for name in measured:
        deviation = float(np.std(motion[name])) * _logarithmic(generator, *NOISE)
        columns[name] = motion[name] + deviation * generator.standard_normal(len(motion["t"]))
        if is_stated:
            columns[f"sigma({name})"] = np.full(len(motion["t"]), deviation)
    first = {
        n: min(x * factor, LARGEST.get(n, np.inf))
        for (n, x), factor in zip(truth.items(), factors, strict=True)
    }
    return Record(system, truth, first, columns)


def _logarithmic(generator: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(generator.uniform(np.log(low), np.log(high))))


def _divided(system: System, values: Mapping[str, float]) -> tuple[dict[str, float], ...]:
    """Divide values into those of parameters and of starts."""
    parameters = {p.name for p in derived(system).equations.system.parameters}
    return (
        {n: x for n, x in values.items() if n in parameters},
        {n: x for n, x in values.items() if n not in parameters},
    )


def _motion(
    system: System, values: Mapping[str, float], times: np.ndarray
) -> Mapping[str, np.ndarray]:
    """Return the columns of a motion at times, as far as it goes."""
    parameters, initial = _divided(system, values)
    at = np.unique(np.concatenate([[0.0], times]))
    motion = derived(system).simulate(
        parameters=parameters, initial=initial, times=at.tolist(), accuracy=1e-10
    )
    places = np.searchsorted(at, times[times <= motion.t[-1]])
    columns = {"t": motion.t, **motion.columns}
    return {name: column[places] for name, column in columns.items()}


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise ``TimeoutError`` after so many seconds of the processor."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise TimeoutError

    former = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, former)


def fit_of(record: Record) -> Fit:
    """Fit a record from its first values, as a user's table."""
    scene = record.system.scene
    parameters, initial = _divided(record.system, {**record.system.fixed, **record.first})
    given = {
        "parameters": {n: repr(float(x)) for n, x in parameters.items()},
        "initial": {n: repr(float(x)) for n, x in initial.items()},
    }
    rows = zip(*record.columns.values(), strict=True)
    lines = [",".join(record.columns), *(",".join(repr(float(x)) for x in row) for row in rows)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "record.csv"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        read = loads(scene, **given) if "\n" in scene else load(SYSTEMS / scene, **given)
        return read.derive().fit(path, list(record.truth))


def outcome_of(number: int, seed: int) -> Outcome:
    """Fit a record and compare the values with the truth."""
    record = drawn_record(number, seed)
    name, begun = record.system.name, time.process_time()
    try:
        with limited(LIMIT):
            fitted = fit_of(record)
    except LagrangeError as refusal:
        seconds = time.process_time() - begun
        return Outcome(number, name, "refused", seconds, said=str(refusal))
    except TimeoutError:
        return Outcome(number, name, "out of time", time.process_time() - begun)
    seconds = time.process_time() - begun
    farthest = max(
        abs(v.value - record.truth[v.name]) / v.error if v.error else np.inf for v in fitted.values
    )
    is_right = farthest <= ERRORS
    outcome = "told" if fitted.exit_code else "right" if is_right else "false"
    found = [
        f"{v.name} {record.truth[v.name]:.4g}: {v.start:.4g} → {v.value:.5g} ± {v.error or 0:.2g}"
        for v in fitted.values
    ]
    said = [*(finding.text for finding in fitted.findings), *(found if outcome != "right" else ())]
    return Outcome(
        number,
        name,
        outcome,
        seconds,
        fitted.status,
        fitted.starts,
        fitted.runs,
        farthest,
        "; ".join(map(str, said)),
    )


def results(records: int, seed: int, jobs: int) -> Iterator[Outcome]:
    """Yield the outcomes of records."""
    work = partial(outcome_of, seed=seed)
    if jobs == 1:
        yield from map(work, range(records))
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(work, range(records))


def table(outcomes: Sequence[Outcome]) -> str:
    """Write what became of the records of each system, and of all."""
    rows = [
        "| system | records | " + " | ".join(OUTCOMES) + " | median starts | median runs |",
        "|---" * (len(OUTCOMES) + 4) + "|",
    ]
    for name in [*(system.name for system in RECORDED), "all"]:
        own = [o for o in outcomes if name in (o.system, "all")]
        fits = [o for o in own if o.starts]
        if not own:
            continue
        counts = Counter(o.outcome for o in own)
        medians = (
            [f"{np.median([o.starts for o in fits]):g}", f"{np.median([o.runs for o in fits]):g}"]
            if fits
            else ["–", "–"]
        )
        cells = [name, len(own), *(counts[outcome] for outcome in OUTCOMES), *medians]
        rows.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(rows)


def summary(outcomes: Sequence[Outcome]) -> str:
    """Say what was told, how far right values are from the truth, and how long fits took."""
    statuses = Counter(o.status for o in outcomes if o.outcome == "told")
    told = ", ".join(f"`{status}` {count}" for status, count in sorted(statuses.items())) or "none"
    near = sum(o.outcome == "told" and o.farthest <= ERRORS for o in outcomes)
    farthest = max((o.farthest for o in outcomes if o.outcome == "right"), default=0.0)
    return "\n".join(
        [
            f"Told: {told}; of these, {near} have values within {ERRORS:g} standard errors of "
            "the truth.",
            "",
            f"Of fits that are right, the value farthest from the truth is {farthest:.1f} of its "
            "standard errors away.",
            "",
            f"False: {sum(o.outcome == 'false' for o in outcomes)}.",
        ]
    )


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--records", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    parser.add_argument("--docs", type=Path, help="page that is written")
    asked = parser.parse_args()
    outcomes = []
    for outcome in results(asked.records, asked.seed, asked.jobs):
        outcomes.append(outcome)
        print(outcome, flush=True)
    print(table(outcomes), summary(outcomes), sep="\n\n")
    if asked.docs is not None:
        head = HEAD.format(records=asked.records, seed=asked.seed, limit=f"{LIMIT:g}")
        page = "\n".join([head, table(outcomes), "", summary(outcomes), ""])
        asked.docs.write_text(page, encoding="utf-8")
    return int(any(o.outcome == "false" for o in outcomes))


if __name__ == "__main__":
    sys.exit(main())
