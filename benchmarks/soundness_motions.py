"""Whether right runs are disproved, and wrong ones pass, over generated scenes.

Scenes of one or two coordinates are put together from a library of potentials and forces: smooth
ones, stops, boxes, wells, dry friction, pulses, terms of 1e-40. Each structure is derived and
compiled once and simulated with many random numbers. Where a conserved energy disproves a run, the
same run without that proof is compared with SciPy's DOP853 at steps far below every width: it must
be wrong. Ends that the program tells (a motion that is not unique, an accuracy that cannot be
held) are counted beside.

    python benchmarks/soundness_motions.py --scenes 20000 --seed 1 -j 2
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import solve_ivp

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.system.functions import RightHandSide, right_hand_side

#: Potentials of a coordinate c with strength k, place a, width w: what is conserved with them.
POTENTIALS = (
    "k*{c}^2/2",
    "k*cos({c} - a)",
    "k*{c}^4/4",
    "k*max(0, {c} - a)^2/2",
    "k*abs({c} - a)",
    "k*max(0, abs({c} - a) - w)^2",
    "k*min({c}, a)^2/2",
    "k*exp(-(({c} - a)/w)^2)",
    "k*tanh(({c} - a)/w)",
    "k/(1 + (({c} - a)/w)^2)",
    "k*max(0, 1 - (({c} - a)/w)^2)",
    "1e-40*k*{c}^3",
)

#: Forces beside them.
FORCES = (
    "-k*{v}/10",
    "-k*sign({v})/10",
    "k*sin(3*t)",
    "k*max(0, 1 - abs((t - a)/w))",
    "k*(sign({c} - a + w) - sign({c} - a - w))",
    "1e-40*k*{c}",
)

COUPLINGS = ("k*(x - y)^2/2", "k*max(0, abs(x - y) - w)^2", "k*abs(x - y)", "0")

UNTIL, SAMPLES = 2.0, 11

#: Outcomes of which there must be none.
BAD = ("right and disproved", "ok and wrong")

#: What is asked for.
ACCURACIES = (1e-3, 1e-6, 1e-9)

#: Scenes of one structure.
EACH = 50

#: The part of what is ok that is compared, where steps without events resolve everything, and how
#: exact these are at kinks.
COMPARED, RESOLVED = 0.3, 1e-6


@dataclass(frozen=True)
class Outcome:
    """How one scene ended: a word of the table, and the scene where it should not be there."""

    word: str
    scene: str = ""


def structures(rng: np.random.Generator) -> Iterator[str]:
    """Scenes over the parameters k0, a0, w0, k1, …, one a term."""
    while True:
        names = ["x", "y"][: int(rng.integers(1, 3))]
        potentials, forces, count = [], [], 0

        def numbered(text: str, number: int) -> str:
            for letter in "kaw":
                text = _word(text, letter, f"{letter}{number}")
            return text

        for name in names:
            for _ in range(int(rng.integers(1, 3))):
                text = str(rng.choice(POTENTIALS)).format(c=name)
                potentials.append(numbered(text, count))
                count += 1
            if rng.random() < 0.35:
                text = str(rng.choice(FORCES)).format(c=name, v=f"dot({name})")
                forces.append((name, numbered(text, count)))
                count += 1
        if len(names) == 2:
            potentials.append(numbered(str(rng.choice(COUPLINGS)), count))
            count += 1
        yield _scene(names, potentials, forces, count)


def _word(text: str, word: str, other: str) -> str:
    letters = list(text)
    for k, letter in enumerate(letters):
        alone = not any(
            0 <= j < len(letters) and (letters[j].isalnum() or letters[j] == "_")
            for j in (k - 1, k + 1)
        )
        if letter == word and alone:
            letters[k] = other
    return "".join(letters)


def _scene(
    names: Sequence[str], potentials: Sequence[str], forces: Sequence[tuple[str, str]], count: int
) -> str:
    parameters = ", ".join(f"{letter}{k}: 1" for k in range(count) for letter in "kaw")
    particles = "\n".join(f"  p_{n}: {{mass: 1, position: [{n}, 0, 0]}}" for n in names)
    listed = "\n".join(f'  v{k}: "{text}"' for k, text in enumerate(potentials))
    loads_ = "\n".join(f'  f{k}: {{on: {n}, force: "{t}"}}' for k, (n, t) in enumerate(forces))
    return "\n".join(
        [
            "name: generated",
            f"parameters: {{{parameters}}}",
            f"particles:\n{particles}",
            f"coordinates: [{', '.join(names)}]",
            f"potentials:\n{listed}",
            *([f"forces:\n{loads_}"] if forces else []),
            "initial: {" + ", ".join(f"{n}: 0" for n in names) + "}",
            f"simulate: {{until: {UNTIL}, samples: {SAMPLES}}}",
        ]
    )


def outcomes(structure: str, count: int, seed: int) -> list[Outcome]:
    """What becomes of scenes of one structure."""
    rng = np.random.default_rng(seed)
    try:
        model = model_of(loads(structure).derive().equations)
    except InputError:
        return [Outcome("refused when derived")] * count
    functions = right_hand_side(model)
    return [_outcome(structure, model, rng) for _ in range(count) if functions.native]


def _outcome(structure: str, model: Model, rng: np.random.Generator) -> Outcome:
    chosen = _with_numbers(model, rng)
    accuracy = float(rng.choice(ACCURACIES))
    try:
        found = simulate(chosen, accuracy=accuracy)
    except InputError:
        return Outcome("refused")
    told = f"{structure}\n# {[(p.name, p.value) for p in chosen.parameters]} {chosen.initial}"
    if found.status == "ok":
        if rng.random() > COMPARED or not _is_comparable(structure, chosen):
            return Outcome("ok")
        right = _agrees(chosen, found, max(accuracy, RESOLVED))
        return Outcome("ok and right, as compared") if right else Outcome("ok and wrong", told)
    if "disproved" not in found.reason:
        return Outcome("ended with another reason")
    if _is_right(chosen, accuracy):
        return Outcome("right and disproved", told)
    return Outcome("wrong and disproved", told)


def _with_numbers(model: Model, rng: np.random.Generator) -> Model:
    """The same system with random strengths, places, widths and start."""

    def value(name: str) -> float:
        if name.startswith("k"):
            return float(rng.choice((-1, 1)) * 10 ** rng.uniform(-2, 1))
        return float(rng.uniform(-1, 1) if name.startswith("a") else 10 ** rng.uniform(-6, 0))

    parameters = tuple(replace(p, value=value(p.name)) for p in model.parameters)
    initial = tuple(rng.uniform(-1, 1, 2 * len(model.coordinates)).tolist())
    return replace(model, parameters=parameters, initial=initial)


def _is_right(model: Model, accuracy: float) -> bool:
    """Whether a run without the proof agrees with a reference of short steps."""
    run = simulate(replace(model, conserved=()), accuracy=accuracy)
    return run.status == "ok" and _agrees(model, run, accuracy)


def _is_comparable(structure: str, model: Model) -> bool:
    """Whether short steps resolve what acts: jumps, where steps chatter, they do not."""
    return "sign" not in structure and _narrowest(model) > 3e-3


def _narrowest(model: Model) -> float:
    return min([1.0, *(p.value or 1.0 for p in model.parameters if p.name.startswith("w"))])


def _agrees(model: Model, run: Trajectory, within: float) -> bool:
    """Whether a run is within a part of its scales of a reference of short steps."""
    step = max(_narrowest(model) / 20, 1e-5)
    states = _reference(right_hand_side(model), np.array(model.initial), run, step)
    names = [*model.coordinates, *(f"dot({n})" for n in model.coordinates)]
    errors = [np.abs(run.columns[n] - states[k]).max() / run.scales[n] for k, n in enumerate(names)]
    return max(errors) <= 2 * within


def _reference(
    functions: RightHandSide, start: np.ndarray, run: Trajectory, step: float
) -> np.ndarray:
    plain: Callable[[float, np.ndarray], np.ndarray] = functions.rhs
    span = (float(run.t[0]), float(run.t[-1]))
    solved = solve_ivp(plain, span, start, "DOP853", run.t, rtol=1e-10, atol=1e-12, max_step=step)
    return np.asarray(solved.y)


def campaign(scenes: int, seed: int, jobs: int, each: int = EACH) -> Iterator[Outcome]:
    """The outcomes of so many scenes."""
    rng, made = np.random.default_rng(seed), structures(np.random.default_rng(seed))
    work = [(next(made), int(rng.integers(2**31))) for _ in range(math.ceil(scenes / each))]
    if jobs == 1:
        for structure, number in work:
            yield from outcomes(structure, each, number)
        return
    with ProcessPoolExecutor(jobs) as pool:
        tasks = [pool.submit(outcomes, text, each, number) for text, number in work]
        for task in tasks:
            yield from task.result()


def table(counts: Counter[str]) -> str:
    """A Markdown table of how many scenes ended how."""
    rows = [f"| {word} | {number} |" for word, number in counts.most_common()]
    return "\n".join(["| outcome | scenes |", "|---|---|", *rows])


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--scenes", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    given = parser.parse_args(arguments)
    counts: Counter[str] = Counter()
    for outcome in campaign(given.scenes, given.seed, given.jobs):
        counts[outcome.word] += 1
        if outcome.word in BAD:
            print(outcome.scene, file=sys.stderr)
    print(table(counts))
    return int(any(counts[word] for word in BAD))


if __name__ == "__main__":
    sys.exit(main())
