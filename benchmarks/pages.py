"""Pages of all shipped scenes in a browser: what they say on its console, and how they move.

Each page is opened in Chromium without a window by ``tests/pages/drive.mjs``, which lets it play,
moves the slider of the first coordinate, and reads back what the page shows. Needs node, chromium
and puppeteer-core (npm install --no-save puppeteer-core).

    python benchmarks/pages.py --docs docs/quality/pages.md
    python benchmarks/pages.py --frames
"""

from __future__ import annotations

import argparse
import json
import shutil
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from lagrange_cli import load
from lagrange_cli.api import open_cache
from lagrange_cli.cache import Cache

ROOT = Path(__file__).parents[1]

HEAD = """\
# Pages

Pages of `lagrange show` of all shipped scenes that move, in Chromium without a window. This page is
the output of

    python benchmarks/pages.py --docs docs/quality/pages.md

The difference is that of the page's motion from the simulated one, over the scales of its numbers,
at the scene's own settings. Where a page cannot continue its motion, or leaves the simulated one by
a thousandth of the scales, it goes on with that and says from when on: it does not follow sliding
along a kink, nor a mechanism through singular configurations. A step is one of the method of Runge
and Kutta of order 4, in CPU time, of emitted JavaScript and of emitted C.

"""


def pages_in(folder: Path, cache: Cache) -> Iterator[Path]:
    """Write the page of each scene that has a start."""
    for scene in sorted((ROOT / "systems").glob("*/*.yaml")):
        if scene.parent.name == "refused":
            continue
        derivation = load(scene).derive(cache=cache)
        if derivation.equations.system.initial is not None:
            page = derivation.page(derivation.simulate(cache=cache))
            file = folder / f"{scene.stem}.html"
            file.write_text(page, encoding="utf-8")
            yield file


def driven_scenes(cache: Cache) -> Iterator[dict[str, Any]]:
    """Yield what the driver finds on the page of each scene, noted on stderr as it comes."""
    with tempfile.TemporaryDirectory() as folder:
        for file in pages_in(Path(folder), cache):
            (row,) = driven([file])
            file.unlink()
            print(json.dumps(row), file=sys.stderr, flush=True)
            yield row


#: Scenes of a hundred particles: a net in space, a chain with multipliers in the plane.
HUNDRED = {"chains/net_of_springs": {"n": "10"}, "chains/chain_of_rods": {"n": "100"}}

FRAMES_HEAD = """\

## Frames

Pages of a hundred particles while they play. A frame has 16.7 ms at 60 frames a second. The first
columns decide on a machine with a graphics processor: the median, and the longest of 19 in 20, of
what the page's own script takes of a frame, and the CPU time of the thread that runs the script,
lays out and paints. The last column is the rate that was reached here, where Chromium renders in
software, on two cores without other work. It is the output of

    python benchmarks/pages.py --frames

"""


def frames_table(cache: Cache) -> list[str]:
    """Return the lines of the table of frames of pages with a hundred particles."""
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for scene, sizes in HUNDRED.items():
            derivation = load(ROOT / f"systems/{scene}.yaml", parameters=sizes).derive(cache=cache)
            files.append(Path(folder, f"{Path(scene).stem}.html"))
            page = derivation.page(derivation.simulate(cache=cache))
            files[-1].write_text(page, encoding="utf-8")
        rows = driven(files)
    lines = ["| scene | script, median | 19 in 20 | CPU of the thread | frames a second |"]
    lines.append("|---|---|---|---|---|")
    for row in rows:
        found = row["frames"]
        times = " | ".join(f"{found[key]:.1f} ms" for key in ("script", "slow", "thread"))
        lines.append(f"| {Path(row['file']).stem} | {times} | {found['perSecond']:.0f} |")
    return lines


def driven(files: list[Path]) -> list[dict[str, Any]]:
    """Return what the driver finds on each page."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        sys.exit("chromium was not found")
    command = ["node", str(ROOT / "tests/pages/drive.mjs"), browser, "1000", *map(str, files)]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    return [json.loads(line) for line in done.stdout.splitlines()]


#: Steps of the method of Runge and Kutta by which emitted C and JavaScript are compared.
STEPS = 1_000_000

C_STEPS = """\
#include <stdio.h>
#include <time.h>
#include "double_pendulum.h"
int main(void) {
    double_pendulum_params p;
    double work[double_pendulum_WORK + 1], y[4] = {1.5, 2.0, 0.0, 0.0}, k[4][4], z[4];
    const double h = 1e-4;
    double_pendulum_defaults(&p);
    clock_t begin = clock();
    for (long i = 0; i < @STEPS@; i++) {
        for (int s = 0; s < 4; s++) {
            const double c = s == 0 ? 0.0 : s == 3 ? h : h / 2;
            for (int j = 0; j < 4; j++) z[j] = s ? y[j] + c * k[s - 1][j] : y[j];
            double_pendulum_rhs(0.0, z, 0, &p, work, k[s]);
        }
        for (int j = 0; j < 4; j++) y[j] += h / 6 * (k[0][j] + 2 * (k[1][j] + k[2][j]) + k[3][j]);
    }
    printf("%g %g", (double)(clock() - begin) / CLOCKS_PER_SEC, y[0]);
}
"""

JAVASCRIPT_STEPS = """\
import { rhs } from "./double_pendulum.mjs";
const h = 1e-4, y = [1.5, 2, 0, 0], z = [0, 0, 0, 0], k = [];
const begin = process.cpuUsage();
for (let i = 0; i < @STEPS@; i++) {
  for (let s = 0; s < 4; s++) {
    const c = s === 0 ? 0 : s === 3 ? h : h / 2;
    for (let j = 0; j < 4; j++) z[j] = s ? y[j] + c * k[s - 1][j] : y[j];
    k[s] = rhs(0, z);
  }
  for (let j = 0; j < 4; j++) y[j] += (h / 6) * (k[0][j] + 2 * (k[1][j] + k[2][j]) + k[3][j]);
}
const used = process.cpuUsage(begin);
console.log((used.user + used.system) / 1e6, y[0]);
"""


def step_seconds() -> tuple[float, float]:
    """Return CPU seconds of a step of the double pendulum in JavaScript (V8) and in C (gcc -O2)."""
    derivation = load(ROOT / "systems/pendulums/double_pendulum.yaml").derive()
    with tempfile.TemporaryDirectory() as folder:
        files = {**derivation.emit("c"), **derivation.emit("javascript")}
        files |= {"steps.c": C_STEPS, "steps.mjs": JAVASCRIPT_STEPS}
        for name, text in files.items():
            Path(folder, name).write_text(text.replace("@STEPS@", str(STEPS)), encoding="utf-8")
        compiled = ["gcc", "-O2", "-o", "steps", "steps.c", "double_pendulum.c", "-lm"]
        subprocess.run(compiled, cwd=folder, check=True)
        in_v8, in_c = (
            float(subprocess.check_output(command, cwd=folder, text=True).split()[0]) / STEPS
            for command in (["node", "steps.mjs"], ["./steps"])
        )
    return in_v8, in_c


def table(rows: list[dict[str, Any]]) -> list[str]:
    """Return the lines of the table."""
    shown = [row for row in rows if "failure" not in row]
    whole = [row for row in shown if row["usual"]["status"] == "done"]
    empty = [r for r in shown if min(r["canvases"][k] for k in ("series", "phase", "drift")) == 0]
    worst = max(whole, key=lambda row: row["usual"]["largest"])
    stuck = [Path(row["file"]).stem for row in shown if row["usual"]["status"] != "done"]
    still = [row for row in shown if row["moved"] and row["moved"]["end"] == row["usual"]["end"]]
    in_v8, in_c = step_seconds()
    counts = {
        "pages": len(rows),
        "that could not be driven": len(rows) - len(shown),
        "with a message on the console, or a request": sum(bool(r["messages"]) for r in shown),
        "with an empty plot": len(empty),
        "whose motion a slider does not change": len(still),
        "continued as simulated": f"{len(stuck)} {', '.join(stuck)}",
        "largest difference of the others": (
            f"{worst['usual']['largest']:.1e} {Path(worst['file']).stem}"
        ),
        "median difference": f"{statistics.median(r['usual']['largest'] for r in whole):.1e}",
        "step of the double pendulum in V8, in C": f"{in_v8 * 1e9:.0f} ns, {in_c * 1e9:.0f} ns",
    }
    return ["| counted | |", "|---|---|", *(f"| {k} | {v} |" for k, v in counts.items())]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--docs", type=Path, help="the page to write")
    parser.add_argument("--frames", action="store_true", help="only the pages of 100 particles")
    asked = parser.parse_args()
    cache = open_cache()
    if asked.frames:
        print(FRAMES_HEAD + "\n".join(frames_table(cache)))
        return 0
    rows = [*driven_scenes(cache)]
    text = HEAD + "\n".join(table(rows)) + "\n"
    text += FRAMES_HEAD + "\n".join(frames_table(cache)) + "\n"
    print(text)
    if asked.docs is not None:
        asked.docs.write_text(text, encoding="utf-8")
    return int(any("failure" in row or row["messages"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
