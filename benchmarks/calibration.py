"""How true the promise of ``--accuracy`` is: shipped scenes at four accuracies, against references.

``--references`` makes the references that are missing or stale (references.py); without it every
scene is simulated at each accuracy and judged by them, in each formulation that it has. The
table of docs/quality/calibration.md is made by ``--docs``.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import calibration_report as report
import numpy as np
from calibration_report import Row
from quadruple import Library
from references import (
    FOLDER,
    SAMPLES,
    SYSTEMS,
    Array,
    Reference,
    content,
    make,
    path_of,
    read,
    scales_of,
    store,
    stored_content,
)
from variants import variant

from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene import read_file
from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.request import resolve
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.simulation import simulate
from lagrange_cli.simulate.system.functions import right_hand_side

ACCURACIES = (1e-3, 1e-6, 1e-9, 1e-12)

FORMULATIONS = ("minimal", "multiplier")

#: The accuracy whose scales steer the steps of references.
STEERING = 1e-6


@dataclass(frozen=True)
class System:
    """A scene in the formulation that was asked for."""

    scene: Path
    formulation: str
    equations: Equations
    model: Model

    @property
    def name(self) -> str:
        return str(self.scene.relative_to(SYSTEMS).with_suffix(""))


def scenes(words: Sequence[str]) -> list[Path]:
    """All shipped scenes, or those whose names begin or are in folders that are named so."""
    found = sorted(p for p in SYSTEMS.rglob("*.yaml") if p.parent.name != "refused")
    if not words:
        return found
    return [p for p in found if any(str(p.relative_to(SYSTEMS)).startswith(word) for word in words)]


def system(scene: Path, formulation: str) -> System:
    """A scene in a formulation.

    Raises
    ------
    InputError
        It has none of that name, or cannot be simulated as it is.
    """
    equations = derive(read_file(str(scene)), formulation=formulation)
    model = model_of(equations)
    sample_times(model)
    return System(scene, formulation, equations, model)


def systems(scene: Path) -> Iterator[System]:
    """A scene in every formulation in which it can be simulated as it is."""
    for formulation in FORMULATIONS:
        with suppress(InputError):
            yield system(scene, formulation)


def sample_times(model: Model) -> Array:
    """The sample times that the scene asks for."""
    return resolve(model, SimulationOptions(accuracy=STEERING)).times


def judged(trajectory: Trajectory, reference: Reference) -> float:
    """The largest error of a trajectory over its scales, of events over the span."""
    names = reference.names
    states = np.column_stack([trajectory.columns[name] for name in names])
    span = reference.span[1] - reference.span[0]
    scales = scales_of(states, reference.kinds, span)
    kept = [k for k, number in enumerate(reference.numbers) if number < len(states)]
    own = states[[reference.numbers[k] for k in kept]]
    errors = np.abs((own - reference.high[kept]) - reference.low[kept]) / scales
    exempt = np.isin(reference.times[kept], trajectory.exempt)
    errors[exempt, len(reference.kinds) :] = 0.0
    return max(float(errors.max()), _of_events(trajectory, reference) / span)


def _of_events(trajectory: Trajectory, reference: Reference) -> float:
    """How far the times of events are apart, of those that both should have."""
    end = min(float(trajectory.t[-1]), float(reference.times[-1]))
    own = [e.t for e in trajectory.events if e.t < end and not e.name.startswith("zeno:")]
    exact = [h for h in reference.happened if h.high < end]
    if not own and not exact:
        return 0.0
    if not own or not exact:
        return np.inf
    of_exact = [min(abs((t - h.high) - h.low) for t in own) for h in exact]
    of_own = [min(abs((t - h.high) - h.low) for h in exact) for t in own]
    return float(max(*of_exact, *of_own))


def measured(system: System, accuracy: float, reference: Reference) -> Row:
    """Simulate at an accuracy and judge the result."""
    blank = Row(
        system.name,
        system.formulation,
        accuracy,
        "refused",
        reference.span[1],
        reference.span[0],
        None,
        None,
        "",
        0,
        0,
    )
    try:
        found = simulate_past_singularities(system.model, SimulationOptions(accuracy=accuracy))
    except InputError as refusal:
        return replace(blank, reason=refusal.problems[0].message)
    if found.t[-1] > reference.times[-1]:
        raise RuntimeError(f"{system.name}: the reference ends at {reference.times[-1]}")
    _, _, arithmetic = found.implementation.partition("compiled C, ")
    wide = f", {arithmetic}" if arithmetic in ("long double", "quadruple") else ""
    return replace(
        blank,
        status=found.status,
        held=float(found.t[-1]),
        error=judged(found, reference),
        estimate=found.estimated,
        method=found.method + wide,
        evaluations=found.rhs_evaluations,
        all_evaluations=found.all_evaluations,
        reason=found.reason,
    )


def reference_of(system: System) -> Reference:
    """The reference of a system, made now."""
    coarse = simulate(system.model, accuracy=STEERING, functions=right_hand_side(system.model))
    names = [*system.model.coordinates, *(f"dot({name})" for name in system.model.coordinates)]
    scales = np.array([coarse.scales[name] for name in names])
    library = Library(system.equations, system.model)
    return make(library, system.model, sample_times(system.model), scales)


def make_references(chosen: Sequence[Path], again: bool) -> None:
    """Make the references that are missing or stale, or all of those chosen."""
    for scene in chosen:
        there = list((FOLDER / scene.relative_to(SYSTEMS)).parent.glob(f"{scene.stem}.*.json"))
        if there and not again and all(stored_content(path) == content(scene) for path in there):
            continue
        for path in there:
            path.unlink()
        for system in systems(scene):
            started = time.perf_counter()
            try:
                found = reference_of(system)
            except InputError as refusal:
                print(f"{system.name}, {system.formulation}: {refusal.problems[0].message}")
                continue
            store(found, scene, system.formulation)
            made = found.made
            print(
                f"{system.name}, {system.formulation}: error {made['error']:.1e},"
                f" {made['evaluations']} right-hand sides,"
                f" {time.perf_counter() - started:.1f} s {made['ends']}",
                flush=True,
            )


def judgements(
    chosen: Sequence[Path], accuracies: Sequence[float], variants: int, seed: int
) -> Iterator[Row]:
    """Every system at every accuracy; with variants, so many of each instead of itself."""
    for scene in chosen:
        for found in systems(scene):
            for other, reference in _varied(found, variants, seed) if variants else _stored(found):
                for accuracy in accuracies:
                    yield measured(other, accuracy, reference)


def _stored(found: System) -> Iterator[tuple[System, Reference]]:
    path = path_of(found.scene, found.formulation)
    if path.exists():
        yield found, read(path)


def _varied(found: System, variants: int, seed: int) -> Iterator[tuple[System, Reference]]:
    """Systems near one with their references, those that can be simulated."""
    for k in range(variants):
        other = replace(found, model=variant(found.model, seed + k))
        try:
            yield other, reference_of(other)
        except InputError as refusal:
            print(f"{found.name}, seed {seed + k}: {refusal.problems[0].message}")


def largest_error() -> float:
    """The largest error of a stored reference."""
    return max(float(read(path).made["error"]) for path in FOLDER.rglob("*.json"))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", help="folders of systems/, or scenes in them; all")
    parser.add_argument("--references", action="store_true", help="make those that are missing")
    parser.add_argument("--again", action="store_true", help="with --references: make all")
    parser.add_argument("--accuracy", type=float, nargs="+", default=ACCURACIES)
    parser.add_argument("--variants", type=int, default=0, help="so many random ones of each scene")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--docs", metavar="FILE", help="write the page with the table")
    parser.add_argument("--json", metavar="FILE", help="write all figures")
    given = parser.parse_args()
    chosen = scenes(given.scenes)
    if given.references:
        make_references(chosen, given.again)
        return 0
    rows = list[Row]()
    for row in judgements(chosen, given.accuracy, given.variants, given.seed):
        rows.append(row)
        print(report.line(row), flush=True)
    print("\n" + "\n".join(report.summary(rows)))
    if given.docs:
        Path(given.docs).write_text(report.page(rows, largest_error(), SAMPLES), encoding="utf-8")
    if given.json:
        Path(given.json).write_text(json.dumps([asdict(row) for row in rows], indent=1))
    return 1 if any(report.wrong(row) for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
