"""Stiff scenes by implicit methods: seconds, right-hand sides, and the part of Jacobians in them.

Each scene is derived and compiled, then run by each method at a tolerance; minima of some
repetitions count. With another checkout of the program both versions take turns, each in a process
of its own that has one scene warm, and their last states are compared.

    python benchmarks/stiff.py
    python benchmarks/stiff.py --beside ../before --scenes net beads --methods BDF
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stiff_scenes import SCENES

#: Methods with their options.
METHODS: dict[str, dict[str, Any]] = {
    "auto": {"accuracy": 1e-6},
    "Radau": {"method": "Radau", "rtol": 1e-6},
    "BDF": {"method": "BDF", "rtol": 1e-6},
}

_HERE = Path(__file__).resolve().parent.parent


def run(text: str, options: Mapping[str, Any], repeat: int, budget: float) -> dict[str, Any]:
    """Run a scene; seconds of the fastest run, counts and the last state."""
    from lagrange_cli import loads

    derivation = loads(text).derive()
    runs = [derivation.simulate(budget=budget, **options) for _ in range(repeat)]
    # The first run compiles too; it is not the fastest.
    seconds = [r.seconds["integrate"] + r.seconds.get("estimate", 0.0) for r in runs]
    first = runs[0]
    state = {name: float(first.columns[name][-1]) for name in first.scales}
    return {
        "coordinates": len(derivation.equations.system.coordinates),
        "status": first.status,
        "seconds": min(seconds),
        "steps": first.steps,
        "evaluations": first.all_evaluations,
        "state": [x / first.scales[name] for name, x in state.items()],
    }


def measured(root: Path, scene: str, method: str, repeat: int, budget: float) -> dict[str, Any]:
    """The same by the program of a checkout, in a process of its own."""
    command = [sys.executable, __file__, "--worker", scene, method]
    command += ["--repeat", str(repeat), "--budget", str(budget)]
    # One thread: small matrices are factored no faster by several, which disturb each other.
    environment = {
        **os.environ,
        "PYTHONPATH": str(root),
        "OPENBLAS_NUM_THREADS": "1",
    }
    answer = subprocess.run(
        command, env=environment, cwd=root, capture_output=True, text=True, check=True
    )
    figures: dict[str, Any] = json.loads(answer.stdout)
    return figures


def row(scene: str, method: str, versions: list[dict[str, Any]]) -> str:
    """A row of the table, for one version or two."""
    cells = [scene, str(versions[0]["coordinates"]), method]
    for figures in versions:
        seconds = f"{figures['seconds']:.4f}"
        stopped = f"not in {figures['seconds']:.0f} s"
        cells.append(seconds if figures["status"] == "ok" else stopped)
        cells.append(f"{figures['evaluations']:,}")
    if len(versions) > 1:
        one, two = (figures["state"] for figures in versions)
        whole = all(figures["status"] == "ok" for figures in versions)
        apart = max(abs(x - y) for x, y in zip(one, two, strict=True))
        cells.append(f"{versions[0]['seconds'] / versions[1]['seconds']:.2f}")
        cells.append(f"{apart:.0e}" if whole else "–")
    return f"| {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--beside", type=Path, metavar="CHECKOUT", help="the version before")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES))
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--turns", type=int, default=2)
    parser.add_argument("--budget", type=float, default=10.0, help="seconds a run may take")
    parser.add_argument("--worker", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        scene, method = options.worker
        figures = run(SCENES[scene], METHODS[method], options.repeat, options.budget)
        print(json.dumps(figures))
        return
    roots = [_HERE] if options.beside is None else [options.beside.resolve(), _HERE]
    names = ["seconds", "right-hand sides"] * len(roots)
    compared = ["times faster", "apart"] if len(roots) > 1 else []
    names = ["scene", "n", "method", *names, *compared]
    print(f"| {' | '.join(names)} |\n|{'---|' * len(names)}")
    for scene in options.scenes:
        for method in options.methods:
            turns = [
                [measured(root, scene, method, options.repeat, options.budget) for root in roots]
                for _ in range(options.turns)
            ]
            best = [min(of, key=lambda f: f["seconds"]) for of in zip(*turns, strict=True)]
            print(row(scene, method, best), flush=True)


if __name__ == "__main__":
    main()
