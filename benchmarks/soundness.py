"""All campaigns that look for false statements, wrong runs, internal errors and lost files.

Each is a program of its own, which this one runs in full, one after the other, and whose last
table it writes into a page. CI runs a slice of each (tests/soundness).

    python benchmarks/soundness.py -j 2 --docs docs/quality/soundness.md
    python benchmarks/soundness.py --only grazes kills
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent

INTRODUCTION = """\
# Soundness

Campaigns over generated scenes, hostile texts and killed processes look for false statements. All
counts that should be zero are; exceptions are listed. This page is the output of

    python benchmarks/soundness.py -j 2 --docs docs/quality/soundness.md

Each part can be run alone (`--only NAME`), and CI runs a seeded slice of each.
"""


@dataclass(frozen=True)
class Part:
    """One campaign.

    Attributes
    ----------
    name
        The program is soundness_NAME.py.
    title, text
        The heading of its table, and what it tries.
    arguments
        With which it is run in full.
    parallel
        The option for the number of processes, None where there is none.
    """

    name: str
    title: str
    text: str
    arguments: tuple[str, ...]
    parallel: str | None = "-j"


PARTS = (
    Part(
        "facts",
        "Facts and expectations",
        "Scenes of terms with known dependence and work: kinked, narrow, tiny, tangled, disguised."
        " Stated facts are judged at states far away, beside every surface, and along accurate"
        " trajectories; expectations are true ones, and the same off by one term.",
        ("--scenes", "20000"),
    ),
    Part(
        "motions",
        "Right runs disproved, wrong runs passed",
        "Scenes of one or two coordinates with random strengths, places and widths, at accuracies"
        " from 1e-3 to 1e-9. Disproved runs, and a part of what is ok, are compared with short"
        " steps of SciPy's DOP853.",
        ("--scenes", "20000"),
    ),
    Part(
        "narrow",
        "Narrow forces",
        "Boxes, triangles and steps by sign, abs, max and min, smooth pulses, of position and of"
        " time, 1e-2 to 1e-9 of the way wide, against closed forms.",
        ("--runs", "1000"),
    ),
    Part(
        "sliding",
        "Kinks that meet, motion along surfaces",
        "Steps into saturated controllers, dry friction, belts, relays and sliding along one"
        " surface or two, with numbers by which kinks meet exactly, against matrix exponentials in"
        " 40 digits between events whose modes are found by trying all.",
        ("--runs", "1000"),
    ),
    Part(
        "equilibria",
        "Equilibria and branches",
        "Potentials with multiple, clustered and asymptotic roots, roots that are all but missed,"
        " and a second coordinate; branches with folds, pitchforks, transcritical points, poles"
        " and cusps. Places, verdicts, *these are all*, marked points and parts of branches are"
        " judged in 120 digits.",
        ("--systems", "20000"),
    ),
    Part(
        "grazes",
        "Grazes of contacts",
        "Starts within 10,000 units in the last place of an exact graze, on both sides.",
        ("--runs", "500"),
    ),
    Part(
        "passages",
        "Passages of singular places",
        "Straight lines past the pole of polar and spherical coordinates at distances down to the"
        " smallest doubles.",
        ("--runs", "100"),
        None,
    ),
    Part(
        "reductions",
        "Numbers of --reduce",
        "First times, extrema and means along oscillators, of expressions with kinks, steps and"
        " peaks down to 1e-9 of the way wide, against closed forms in 40 digits. Open ones are"
        " stated as not known.",
        ("--members", "6"),
        None,
    ),
    Part(
        "steps",
        "Printed steps",
        "Steps of all shipped scenes and of generated ones, by Lagrange's equations, by"
        " d'Alembert's principle, and by virtual work, are read back from their text; each formula"
        " is derived anew from the lines printed above it.",
        ("--scenes", "300"),
    ),
    Part(
        "mutants",
        "Mutated scenes and expressions",
        "Through derive, emit, check, analyze, path, fit and simulate: exit codes, places of"
        " refusals, and seconds.",
        ("--mutants", "30000"),
    ),
    Part(
        "mutants",
        "Scenes that a grammar makes",
        "Particles, bodies, families, constraints, contacts, states, controllers and loads that fit"
        " each other, most of them valid, through every command: exit codes, places of refusals,"
        " files that no option named, and seconds.",
        ("--structured", "--mutants", "20000", "--longest", "10"),
    ),
    Part(
        "expressions",
        "Expressions",
        "Sums, products and powers, compared with Python's own grammar in exact arithmetic; texts"
        " of the language with characters changed, tokens in any order, bytes, and towers up to"
        " and beyond each limit. Each is understood, or refused at a place in it.",
        ("--expressions", "1000000"),
    ),
    Part(
        "editing",
        "Scenes in the making",
        "Mutated scenes, half of them with a part cut out, through fmt and each answer of the"
        " language server at a random place.",
        ("--scenes", "20000"),
    ),
    Part(
        "kills",
        "Killed processes, full disks, folders that cannot be written",
        "After each, the old or the new content is there, whole, and the next run goes on.",
        ("--kills", "300"),
        "--jobs",
    ),
)


def command(part: Part, seed: int, jobs: int) -> list[str]:
    """What runs a campaign in full."""
    program = str(FOLDER / f"soundness_{part.name}.py")
    parallel = [] if part.parallel is None else [part.parallel, str(jobs)]
    return [sys.executable, program, *part.arguments, "--seed", str(seed), *parallel]


def section(part: Part, printed: str, seconds: float, seed: int) -> str:
    """The part of the page about one campaign."""
    given = " ".join(["python", f"benchmarks/soundness_{part.name}.py", *part.arguments])
    return "\n".join(
        [
            f"## {part.title}",
            "",
            f"{part.text} `{given} --seed {seed}`, {seconds / 60:.0f} minutes.",
            "",
            printed.strip(),
            "",
        ]
    )


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    names = list(dict.fromkeys(part.name for part in PARTS))
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="NAME")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    parser.add_argument("--docs", type=Path, help="write the page to this file")
    given = parser.parse_args(arguments)
    sections, failed = [INTRODUCTION], False
    for part in PARTS:
        if part.name in given.only:
            started = time.perf_counter()
            run = subprocess.run(
                command(part, given.seed, given.jobs),
                stdout=subprocess.PIPE,
                text=True,
                check=False,
            )
            failed = failed or run.returncode != 0
            told = section(part, run.stdout, time.perf_counter() - started, given.seed)
            print(told, flush=True)
            sections.append(told)
    if given.docs is not None:
        given.docs.write_text("\n".join(sections), encoding="utf-8")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
