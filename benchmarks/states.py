"""Random scenes with states of first order, beside SymPy's equations and SciPy's motions.

Each scene is a text of one or two coordinates, one to three states and perhaps an input. SymPy
reads the same text and differentiates the Lagrangian; SciPy's DOP853 integrates. Compared are
emitted right-hand sides and Jacobians, linear systems with differences, motions at an accuracy of
1e-12, and errors of motions with the accuracy that they promise.

    python benchmarks/states.py --scenes 200 --docs docs/quality/states.md
"""

from __future__ import annotations

import argparse
import random
import shutil
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from lagrange_cli.api.emitters import EMITTERS  # noqa: E402
from lagrange_cli.mechanics.derivation import derive  # noqa: E402
from lagrange_cli.mechanics.equations import Equations  # noqa: E402
from lagrange_cli.scene import read_text  # noqa: E402
from lagrange_cli.simulate import simulate  # noqa: E402
from tests.emit.languages.drivers import Driver  # noqa: E402
from tests.emit.languages.reference import Call  # noqa: E402
from tests.emit.languages.test_languages import DRIVERS  # noqa: E402
from tests.systems.random_states import RandomScene, Reference, random_scene  # noqa: E402

HEAD = """\
# States of first order

Random scenes of one or two coordinates, one to three states and, in every other one, an input,
each beside SymPy's reading of the same text and SciPy's DOP853 at its tightest. This page is the
output of

    python benchmarks/states.py --scenes {scenes} --promise {promise} --in-languages {languages} \\
        --docs docs/quality/states.md

Errors of functions are relative to the largest number of a result, at least 1; those of motions to
the largest magnitude of each coordinate, velocity and state.
"""

#: Random states of a scene at which functions are compared.
POINTS = 3


@dataclass
class Figures:
    """What is counted and measured over scenes."""

    worst: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    wrong: list[str] = field(default_factory=list)

    def note(self, what: str, scene: str, error: float, limit: float) -> None:
        """Take an error, which is wrong beyond its limit."""
        self.worst[what] = max(self.worst.get(what, 0.0), error)
        self.counts[what] = self.counts.get(what, 0) + 1
        if not error <= limit:
            self.wrong.append(f"{scene}: {what} is off by {error:.1e}")


def derived(scene: RandomScene) -> Equations:
    return derive(read_text(scene.text))


def module_of(equations: Equations) -> ModuleType:
    """Load the emitted Python of a scene."""
    options = {"jacobian": True, "linearization": True}
    (text,) = EMITTERS["python"].emit(equations, options).values()
    module = ModuleType(f"emitted_{equations.presentation.name}")
    sys.modules[module.__name__] = module
    exec(compile(text, module.__name__, "exec"), vars(module))
    return module


def points(scene: RandomScene) -> list[tuple[float, Any, Any]]:
    """Times, states and inputs at random."""
    draw = np.random.default_rng(sum(scene.name.encode()))
    shape = len(scene.start), len(scene.inputs)
    return [
        (float(draw.uniform(0, 2)), *(draw.uniform(-1, 1, size) for size in shape))
        for _ in range(POINTS)
    ]


def relative(found: Any, expected: Any) -> float:
    """Return the largest error relative to the largest number, at least 1."""
    if not np.size(expected):
        return 0.0
    return float(np.abs(found - expected).max() / max(1.0, np.abs(expected).max()))


def functions(scene: RandomScene, equations: Equations, figures: Figures) -> None:
    """Compare emitted Python with SymPy's reading."""
    module, reference = module_of(equations), Reference(scene)
    for t, y, u in points(scene):
        given = [lambda t, y, p, u=u: u] if scene.inputs else []
        p = module.DEFAULTS
        call = [t, y, p, *given]
        found = module.rhs(*call)
        figures.note("rhs", scene.name, relative(found, reference.value("rhs", t, y, u)), 1e-13)
        linear = module.linearization(*call)
        for name, matrix in (("jacobian", linear.A), ("jacobian_u", linear.B)):
            if matrix.size:
                expected = reference.value(name, t, y, u)
                figures.note(name, scene.name, relative(matrix, expected), 1e-12)
        h = 1e-3
        steps = h * np.eye(len(y))
        rates = [
            {k: reference.value("rhs", t, y + k * step, u) for k in (-3, -2, -1, 1, 2, 3)}
            for step in steps
        ]
        slopes = [
            (45 * (r[1] - r[-1]) - 9 * (r[2] - r[-2]) + (r[3] - r[-3])) / (60 * h) for r in rates
        ]
        error = relative(linear.A, np.array(slopes).T)
        figures.note("linear system by differences", scene.name, error, 1e-9)


def motion(scene: RandomScene, equations: Equations, accuracy: float) -> float | None:
    """Return the largest error of a motion over its scale; None if it is refused."""
    trajectory = simulate(equations, accuracy=accuracy)
    if trajectory.status != "ok":
        return None
    exact = Reference(scene).motion(trajectory.t)
    columns = zip(equations.system.state_names, exact, strict=True)
    return max(
        float(np.abs(trajectory.columns[name] - row).max() / max(np.abs(row).max(), 1e-300))
        for name, row in columns
    )


def calls(scene: RandomScene) -> list[Call]:
    """Right-hand sides and Jacobians by SymPy, for the drivers of languages."""
    reference, listed = Reference(scene), []
    p = tuple(scene.parameters.values())
    for t, y, u in points(scene):
        names = ["rhs", "jacobian", *(["jacobian_u"] if scene.inputs else [])]
        for name in names:
            expected = reference.value(name, t, y, u)
            size = max(1.0, float(np.abs(expected).max()))
            values = tuple(map(float, expected.ravel()))
            given = tuple(map(float, y)), p, tuple(map(float, u))
            listed.append(Call(name, t, *given, values, (size,) * len(values)))
    return listed


def language(driver: Driver, scenes: Sequence[RandomScene], figures: Figures) -> None:
    """Compare the emitted code of a language."""
    with tempfile.TemporaryDirectory() as name:
        folder, equations = Path(name), [derived(scene) for scene in scenes]
        modules = [
            driver.emitted(e, folder / e.presentation.name, jacobian=True) for e in equations
        ]
        rows = [calls(scene) for scene in scenes]
        results = driver.results(folder, modules, rows)
    for scene, expected, found in zip(scenes, rows, results, strict=True):
        for call, numbers in zip(expected, found, strict=True):
            error = max(call.errors(numbers))
            figures.note(f"emitted {driver.language}", scene.name, error, 1e-13)


def promised(scenes: Sequence[RandomScene], figures: Figures) -> list[str]:
    """Compare errors with promised accuracies; return the lines of a table."""
    ratios: dict[int, list[float]] = {}
    refused = 0
    for scene in scenes:
        accuracy = 10.0 ** -random.Random(scene.name).uniform(3, 11)
        error = motion(scene, derived(scene), accuracy)
        if error is None:
            refused += 1
            continue
        figures.note("error over promise", scene.name, error / accuracy, 1.0)
        decade = int(-np.floor(np.log10(accuracy)))
        ratios.setdefault(decade, []).append(error / accuracy)
    lines = ["| accuracy | motions | largest error over accuracy | median |", "|---|---|---|---|"]
    for decade, values in sorted(ratios.items()):
        bounds = f"1e-{decade} to 1e-{decade - 1}"
        lines.append(f"| {bounds} | {len(values)} | {max(values):.1e} | {np.median(values):.1e} |")
    return [
        *lines,
        "",
        f"Refused: {refused}. Beyond the promise, with status ok: "
        + str(sum(ratio > 1 for values in ratios.values() for ratio in values))
        + ".",
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=200, help="scenes of functions and motions")
    parser.add_argument("--promise", type=int, default=60, help="scenes at other accuracies")
    parser.add_argument("--in-languages", type=int, default=20, help="scenes in all languages")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first scene")
    parser.add_argument("--docs", type=Path, help="the page to write")
    chosen = parser.parse_args(arguments)
    figures = Figures()
    scenes = [random_scene(chosen.seed + k) for k in range(chosen.scenes)]
    for scene in scenes:
        equations = derived(scene)
        functions(scene, equations, figures)
        error = motion(scene, equations, 1e-12)
        if error is not None:
            figures.note("motion at 1e-12", scene.name, error, 1e-12)
    listed = scenes[: chosen.in_languages]
    for driver in DRIVERS.values():
        if listed and all(map(shutil.which, driver.programs)):
            language(driver, listed, figures)
    others = [random_scene(chosen.seed + 10_000 + k) for k in range(chosen.promise)]
    promise = promised(others, figures)
    head = HEAD.format(scenes=chosen.scenes, promise=chosen.promise, languages=chosen.in_languages)
    table = ["| compared | values | largest error |", "|---|---|---|"]
    table += [f"| {what} | {figures.counts[what]} | {x:.1e} |" for what, x in figures.worst.items()]
    wrong = [f"Wrong: {len(figures.wrong)}.", *(f"- {text}" for text in figures.wrong)]
    page = "\n".join([head, *table, "", "## The promise", "", *promise, "", *wrong, ""])
    if chosen.docs:
        chosen.docs.write_text(page, encoding="utf-8")
    else:
        print(page)
    return bool(figures.wrong)


if __name__ == "__main__":
    sys.exit(main())
