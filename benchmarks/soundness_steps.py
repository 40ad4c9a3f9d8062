"""Whether each printed line of `derive --steps` follows from the lines above it.

Steps of all shipped scenes that have some, and of generated ones, are read back from their text
and derived anew, line by line, from what is printed above: positions, velocities, T, V, L, forces,
equations, momenta, the energy function and its rate, by Lagrange's equations, by d'Alembert's
principle, and by virtual work. Generated scenes have constants and functions of time in T and V,
moving supports, friction, forces, potentials and inertia over names and over coordinates, and
constraints that keep multipliers. The judge (printed_steps.py) knows the text, the masses and the
coordinates alone.

    python benchmarks/soundness_steps.py --scenes 500 --seed 1
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from printed_steps import Judge

from lagrange_cli import load, loads
from lagrange_cli.api.derivation import Derivation
from lagrange_cli.api.scenes import LoadedScene
from lagrange_cli.errors import InputError, InternalError

SYSTEMS = Path(__file__).parents[1] / "systems"

WAYS = ("lagrange", "dalembert", "virtual-work")

#: Rules of refusals that are no steps at all.
WITHOUT = "steps-too-long"

#: Columns of a line: formulas are not broken.
WIDTH = 10**6

POSITIONS = (
    "[q, 0, a*q^2]",
    "[q + X, 0, b]",
    "[a*cos(q), 0, a*sin(q) + b]",
    "[(a + q)*cos(w*t), (a + q)*sin(w*t), b*q]",
    "[b + q, c*t, c*sin(w*t)]",
    "[q*cos(u), q*sin(u), b]",
    "[X + a*sin(q), 0, Z - a*cos(q)]",
)

POTENTIALS = (
    "{gravity: g}",
    "k/2*(q - b)^2",
    "m*g*(q + b) + c",
    "k*b^2 - c*cos(w*t)",
    "k*(q - b*sin(w*t))^2/2",
    "c*t*b",
    "k*q*t + g*t^2",
    "k/2*(q^2 + b^2)",
    "-c*q*dot(q)*t",
)

KINETIC = ("c/2*dot(q)^2", "c/2*(dot(q) + w)^2", "b*dot(q)*sin(w*t)", "c/2*(w*t)^2 + c*dot(q)^2/2")

FORCES = ("{on: q, force: b*cos(w*t)}", "{on: P, force: [c*t, 0, b]}", "{on: P, force: [b, c, a]}")

CONSTRAINTS = ("q + a*sin(q) = u - b*u^3", "dot(q) = q*dot(u)", "q = u + a*sin(u - q) + c*t")


@dataclass(frozen=True)
class Judged:
    """The lines of one derivation.

    Attributes
    ----------
    kind
        Where the scene is from, and the way.
    outcome
        ``read``, ``without steps`` or ``refused``.
    checked, wrong, unread
        Number of formulas that follow; lines that do not, and lines that no judge can read.
    text
        The scene, if it was generated.
    """

    kind: str
    outcome: str = "read"
    checked: int = 0
    wrong: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()
    text: str = ""


def generated(seed: int) -> str:
    """A scene of one or two coordinates."""
    rng = np.random.default_rng(seed)
    place = str(rng.choice(POSITIONS))
    moving = str(rng.choice(["c*sin(w*t)", "b*t^2/2", "b"]))
    place = place.replace("X", moving).replace("Z", moving)
    constraint = str(rng.choice(CONSTRAINTS)) if rng.random() < 0.25 else ""
    two = "u" in place or bool(constraint)
    kinetic = [str(t) for t in rng.choice(KINETIC, rng.integers(0, 3), replace=False)]
    if two and "u" not in place:
        kinetic.append("a*dot(u)^2/2 + b*dot(q)*dot(u)/3")
    potentials = [str(t) for t in rng.choice(POTENTIALS, rng.integers(1, 4), replace=False)]
    forces = [str(t) for t in rng.choice(FORCES, rng.integers(0, 3), replace=False)]
    lines = [
        f"name: generated_{seed}",
        "parameters: {m: 2, a: 0.7, b: {value: 0.4, positive: true}, c: 0.3, k: 5, w: 1.3, g: 9.8}",
        f"particles: {{P: {{mass: m, position: {place}}}}}",
        f"coordinates: [{'q, u' if two else 'q'}]",
    ]
    for section, terms, letter in (
        ("kinetic", kinetic, "T"),
        ("potentials", potentials, "V"),
        ("forces", forces, "F"),
    ):
        lines += [f"{section}:"] * bool(terms)
        lines += [f"  {letter}{n}: {term}" for n, term in enumerate(terms)]
    if rng.random() < 0.3:
        lines.append("dissipation: {drag: c/2*dot(q)^2}")
    if constraint:
        lines.append(f"constraints: {{tie: {constraint}}}")
    start = "{q: 0.3, u: 0.2}" if two else "{q: 0.3, dot(q): 0.2}"
    lines.append(f"initial: {start}" if not constraint else f"near: {start}")
    return "\n".join(lines) + "\n"


def judged(derivation: Derivation) -> Judge:
    """Judge the text of a derivation with steps."""
    system = derivation.equations.system
    masses: dict[str, str] = {}
    for particle in system.particles:
        for name in particle.components:
            mass = str(particle.mass).replace("**", "^")
            masses[name] = f"{masses[name]} + {mass}" if name in masses else mass
    names = [c.name for c in system.coordinates]
    return Judge(names, masses).read(derivation.text(ascii=True, width=WIDTH))


def verdict(kind: str, scene: LoadedScene, way: str, text: str = "") -> Judged:
    """Derive a scene and judge its steps."""
    kind = f"{kind}, by {way}"
    try:
        judge = judged(scene.derive(steps=way, forces=way == "dalembert"))
    except InputError as error:
        rules = {problem.rule for problem in error.problems}
        return Judged(kind, "without steps" if rules == {WITHOUT} else "refused", text=text)
    except InternalError as error:
        return Judged(kind, "internal error", wrong=(f"{scene.scene.name}: {error!r}",), text=text)
    name = scene.scene.name
    wrong = tuple(f"{name}: {line}" for line in judge.wrong)
    unread = tuple(f"{name}: {line}" for line in judge.unread)
    return Judged(kind, "read", judge.checked, wrong, unread, text)


def shipped(path: str, way: str) -> Judged:
    return verdict("shipped", load(path), way)


def made(seed: int, way: str) -> Judged:
    text = generated(seed)
    try:
        scene = loads(text)
    except InputError:
        return Judged(f"generated, by {way}", "refused", text=text)
    return verdict("generated", scene, way, text)


def scene_paths() -> list[str]:
    """Shipped scenes that are no refusals."""
    paths = sorted(SYSTEMS.glob("*/*.yaml"))
    return [str(p) for p in paths if p.parent.name != "refused" and p.stem != "bicycle"]


def results(scenes: int, seed: int, processes: int, ways: Sequence[str] = WAYS) -> Iterator[Judged]:
    """Judge all shipped scenes and some generated ones."""
    paths, seeds = scene_paths(), range(seed * 10**6, seed * 10**6 + scenes)
    if processes == 1:
        for way in ways:
            yield from (shipped(path, way) for path in paths)
            yield from (made(number, way) for number in seeds)
        return
    with ProcessPoolExecutor(processes) as pool:
        for way in ways:
            yield from pool.map(partial(shipped, way=way), paths, chunksize=2)
            yield from pool.map(partial(made, way=way), seeds, chunksize=8)


def table(judgements: Sequence[Judged]) -> str:
    """Counts by kind, as Markdown."""
    heads = ("scenes and way", "scenes", "too long for steps", "refused", "formulas that follow")
    lines = [f"| {' | '.join([*heads, 'that do not', 'unread'])} |", "|---" * 7 + "|"]
    for kind in dict.fromkeys(j.kind for j in judgements):
        of_kind = [j for j in judgements if j.kind == kind]
        outcomes = Counter(j.outcome for j in of_kind)
        counts = (
            len(of_kind),
            outcomes["without steps"],
            outcomes["refused"],
            sum(j.checked for j in of_kind),
            sum(len(j.wrong) for j in of_kind),
            sum(len(j.unread) for j in of_kind),
        )
        lines.append(f"| {kind} | {' | '.join(f'{count:,}' for count in counts)} |")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--processes", type=int, default=1)
    given = parser.parse_args(arguments)
    judgements = list(results(given.scenes, given.seed, given.processes))
    print(table(judgements))
    failures = [line for j in judgements for line in (*j.wrong, *j.unread)]
    for line in failures:
        print(line, file=sys.stderr)
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
