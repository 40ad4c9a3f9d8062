"""Extremes: exact motions at the edge of what can be computed, and shipped scenes under stress.

The first part runs all cases of tests/extremes, also those that take long, against motions in 40
digits and more; the second is ``lagrange stress`` on shipped scenes.
``--docs docs/quality/extremes.md`` writes the table.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import nullcontext
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from lagrange_cli.files import read_bytes
from lagrange_cli.report.contents.stress import outcomes_counted, setting
from lagrange_cli.report.inlines import Lettering
from lagrange_cli.report.phrases.language import ENGLISH
from lagrange_cli.report.values.studies import STRESS
from lagrange_cli.report.writers.terminal.letters import UnicodeLetters
from lagrange_cli.scene import SceneText
from lagrange_cli.simulate.cluster.tasks import Cluster, connected
from lagrange_cli.simulate.ensemble.plan.recipe import Recipe
from lagrange_cli.studies.stress.measure import Stress, stress
from lagrange_cli.studies.stress.runs import StressRun

ROOT = Path(__file__).resolve().parents[1]
SYSTEMS = ROOT / "systems"

#: Scenes of different character.
SCENES = (
    *("pendulums/pendulum", "pendulums/double_pendulum", "pendulums/spherical_pendulum"),
    *("pendulums/elastic_pendulum", "pendulums/pendulum_on_cart", "pulleys/atwood"),
    *("pulleys/swinging_atwood", "celestial/kepler", "celestial/two_bodies"),
    *("oscillators/coupled_oscillators", "oscillators/relativistic_oscillator"),
    *("lecture/bead_on_parabola", "lecture/masses_through_hole", "surfaces/particle_on_cone"),
    *("constraints/four_bar_linkage", "constraints/slider_crank", "rigid/heavy_top"),
    *("rolling/chaplygin_sleigh", "rolling/rolling_disk", "rolling/snakeboard"),
    *("contact/bouncing_ball", "contact/particle_leaving_sphere"),
    "sliding/block_on_wedge",
)

#: Seconds that a point of a scene may take.
BUDGET = 2.0

#: Characters of a reason.
REASON = 150

HEAD = """\
# Extremes

Results at the edge of what can be computed are right to the accuracy that was asked for, kept as
far as they are right, or refused with a reason. This page is the output of

    python benchmarks/extremes.py --docs docs/quality/extremes.md

- {total}

Measured on {machine}.
"""

CASES_HEAD = """\

## Exact motions

Motions in closed form (elliptic functions, Kepler's equation, normal modes), or extrapolated in
{digits} digits from the textbook's equations (`tests/extremes`): nothing of the program is in them.
{said}

| axis | case | accuracy | outcome | error | estimate | what is said |
|---|---|---|---|---|---|---|
"""

STRESS_HEAD = """\

## Scenes under stress

`lagrange stress SCENE --budget {budget:g}` on scenes of different character, the error of each
point measured against long doubles and another method ([how](../accuracy.md#extremes)).
{said}

| scene | runs | right | degraded | refused | silently wrong | nothing to compare with |
|---|---|---|---|---|---|---|
"""

AXES_HEAD = """\

The same by axis, with the largest error and the largest ratio of error to estimate:

| axis | runs | right | degraded | refused | silently wrong | error / accuracy | error / estimate |
|---|---|---|---|---|---|---|---|
"""

REASONS_HEAD = """\

Why points were degraded or refused:

| reason | points | for example |
|---|---|---|
"""

#: Beginnings of reasons and what they are counted as, in this order.
KINDS = (
    ("stopped", "the budget was spent"),
    ("is below what double precision", "the accuracy is below what double precision can hold"),
    ("must be positive", "a mass or a positive parameter vanishes"),
    ("no configuration", "the constraints have no configuration there"),
    ("cannot hold", "the constraints have no configuration there"),
    ("cannot be continued", "the motion ends (singularity, edge, overflow)"),
    ("infinitely many", "bounces become infinitely many"),
    ("is disproved", "the energy shows that the promise would not be kept"),
    ("can be held", "rounding of the start grows past the accuracy"),
    ("holds until", "rounding of the start grows past the accuracy"),
    ("no accelerations", "the start is at a singular place"),
    ("not independent", "coordinates do not move anything"),
    ("not on the constraints", "the start is on the constraints to too few digits"),
    ("initial velocities violate", "the start is on the constraints to too few digits"),
    ("does not hold", "the constraints have no configuration there"),
    ("restitution", "a value is outside of its range"),
    ("division by zero", "a value is outside of its range"),
    ("not finite real", "a value is outside of its range"),
)

COUNTED = ("holds", "degraded", "refused", "wrong")


def number(value: float | None) -> str:
    return "" if value is None else f"{value:.0e}"


def cut(text: str) -> str:
    """The first line of a reason, short and safe in a table."""
    line = next((line for line in text.splitlines() if line.strip()), "").replace("|", "\\|")
    line = line.replace(f"{SYSTEMS}/", "")
    return line if len(line) <= REASON else line[: REASON - 3] + "..."


def cases(long: bool) -> Iterator[Any]:
    """The exact motions, each as it is found."""
    sys.path.insert(0, str(ROOT))
    module = import_module("tests.extremes.extreme_cases")
    for case in module.CASES:
        if long or not case.long:
            started = time.perf_counter()
            result = module.found(case)
            spent = time.perf_counter() - started
            print(f"{case.name}: {result.outcome} ({spent:.1f} s)", file=sys.stderr)
            yield result


def case_row(result: Any) -> str:
    case = result.case
    return (
        f"| {case.axis} | {case.title} | {case.accuracy:.0e} | {result.outcome} |"
        f" {number(result.error)} | {number(result.estimated)} | {cut(result.reason)} |"
    )


def counts_of_cases(results: Sequence[Any]) -> dict[str, int]:
    """What :attr:`.Stress.counts` is for scenes."""
    of = Counter(result.outcome for result in results)
    below = sum(
        r.error > r.estimated for r in results if r.error is not None and r.estimated is not None
    )
    found = {outcome: of[outcome] for outcome in COUNTED}
    return {"runs": len(results), **found, "unchecked": 0, "underestimated": below}


def counted_outcomes(counts: dict[str, int]) -> str:
    """Sum up the outcomes of runs in one sentence."""
    return Lettering(UnicodeLetters(), ENGLISH).text(outcomes_counted(counts))


def added(counts: Iterable[dict[str, int]]) -> dict[str, int]:
    total: Counter[str] = Counter()
    for one in counts:
        total.update(one)
    keys = ("runs", *COUNTED, "unchecked", "underestimated")
    return {key: total[key] for key in keys}


def scene_row(found: Stress) -> str:
    c = found.counts
    cells = [found.name, c["runs"], *(c[outcome] for outcome in COUNTED), c["unchecked"]]
    return "| " + " | ".join(map(str, cells)) + " |"


def axis_rows(runs: Sequence[StressRun]) -> Iterator[str]:
    for axis in dict.fromkeys(run.point.axis for run in runs):
        own = [run for run in runs if run.point.axis == axis]
        of = Counter(run.outcome for run in own)
        errors = [(run, run.error) for run in own if run.error is not None]
        over = [max(e - r.uncertainty, 0.0) / r.requested for r, e in errors if r.requested]
        ratios = [max(e - r.uncertainty, 0.0) / r.estimated for r, e in errors if r.estimated]
        counted = " | ".join(str(of[outcome]) for outcome in COUNTED)
        most = " | ".join(f"{max(x, default=0.0):.2g}" for x in (over, ratios))
        yield f"| {axis} | {len(own)} | {counted} | {most} |"


def kind(reason: str) -> str:
    return next((said for part, said in KINDS if part in reason), cut(reason))


def reason_rows(found: Sequence[Stress]) -> Iterator[str]:
    """Reasons with how often they were given, the most frequent first, and an example."""
    given: dict[str, list[str]] = {}
    for one in found:
        for run in one.runs:
            if run.outcome in ("degraded", "refused") and run.reason:
                said = f"{one.name}, {run.point.axis}: {setting(run.point)[:60]}"
                given.setdefault(kind(run.reason), []).append(said)
    for reason, examples in sorted(given.items(), key=lambda item: -len(item[1])):
        yield f"| {reason} | {len(examples)} | {examples[0]} |"


def page(results: Sequence[Any], found: Sequence[Stress], budget: float, digits: int) -> str:
    """The page of docs."""
    runs = [run for one in found for run in one.runs]
    of_cases = counts_of_cases(results)
    of_scenes = added(one.counts for one in found)
    machine = f"{platform.machine()}, Python {platform.python_version()}"
    parts = [
        HEAD.format(total=counted_outcomes(added([of_cases, of_scenes])), machine=machine),
        CASES_HEAD.format(said=counted_outcomes(of_cases), digits=digits),
        *(case_row(result) + "\n" for result in results),
        STRESS_HEAD.format(said=counted_outcomes(of_scenes), budget=budget),
        *(scene_row(one) + "\n" for one in found),
        AXES_HEAD,
        *(row + "\n" for row in axis_rows(runs)),
        REASONS_HEAD,
        *(row + "\n" for row in reason_rows(found)),
    ]
    return "".join(parts)


def stressed(
    scene: str,
    axes: Sequence[str] | None,
    budget: float,
    jobs: int | None,
    cluster: Cluster | None = None,
) -> Stress:
    path = SYSTEMS / f"{scene}.yaml"
    started = time.perf_counter()
    recipe = Recipe(SceneText(str(path), read_bytes(str(path))))
    found = stress(recipe, axes=axes, budget=budget, jobs=jobs, cluster=cluster)
    spent = time.perf_counter() - started
    print(f"{scene}: {counted_outcomes(found.counts)} ({spent:.0f} s)", file=sys.stderr)
    return found


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", help="names in systems/; by default some of each kind")
    parser.add_argument("--axes", help="of scenes, with commas between them; by default all")
    parser.add_argument("--budget", type=float, default=BUDGET, help="seconds of a point")
    parser.add_argument("-j", "--jobs", type=int, default=1, help="points at a time")
    parser.add_argument("--on", metavar="tcp://HOST:PORT", help="points on this Dask cluster")
    parser.add_argument("--quick", action="store_true", help="without the cases that take long")
    parser.add_argument("--json", help="write every point to this file")
    parser.add_argument("--docs", help="write the page to this file")
    asked = parser.parse_args(words)
    results = list(cases(not asked.quick))
    axes = asked.axes.split(",") if asked.axes else None
    scenes = asked.scenes or SCENES
    with connected(asked.on) if asked.on else nullcontext() as client:
        cluster = None if client is None else Cluster(client, partial(print, file=sys.stderr))
        found = [stressed(scene, axes, asked.budget, asked.jobs, cluster) for scene in scenes]
    digits = import_module("tests.extremes.extreme_exact").DIGITS
    text = page(results, found, asked.budget, digits)
    if asked.json:
        Path(asked.json).write_text(json.dumps([STRESS.write(one) for one in found], indent=1))
    if asked.docs:
        Path(asked.docs).write_text(text, encoding="utf-8")
    else:
        print(text)
    wrong = added([counts_of_cases(results), *(one.counts for one in found)])["wrong"]
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
