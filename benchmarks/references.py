"""References that simulations are judged by: made in 113 binary digits, stored as decimals.

A file holds, for one scene in one formulation, coordinates and velocities at some of the sample
times that ``simulate`` takes, the events of contacts, and how all this was made. It is stale
where what it was made of has changed: then it has to be made again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal, localcontext
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from quadruple import TOO_MANY, EndedError, Happening, Library, Motion

from lagrange_cli.simulate.model.model import Model

Array = NDArray[np.float64]

ROOT = Path(__file__).parents[1]
SYSTEMS = ROOT / "systems"
FOLDER = ROOT / "tests" / "references"

METHOD = (
    "modified midpoint rule of Gragg, extrapolated by Neville's rule up to order 28, steps from"
    " sample to sample; the same equations as emitted C, of __float128 with 113 binary digits"
)

#: Tolerances of the two runs, in parts of the scales; pairs are tried from the first on.
TOLERANCES = ((1e-31, 1e-27), (1e-28, 1e-24), (1e-25, 1e-21))

#: Right-hand sides of a run beyond which the next pair is tried, and those of the last.
MOST, LAST_MOST = 4_000_000, 50_000_000

#: A reference ends where its error is larger.
WORST = 1e-16

#: Samples that are kept, evenly distributed, and how many numbers at most.
SAMPLES, NUMBERS = 41, 1600

#: Digits of the stored numbers.
DIGITS = 22

#: Sections of a scene that no motion depends on.
WORDS = ("title", "description", "source", "expect")

#: What the sample times depend on.
TIMES = ("from", "until", "samples", "step")

#: The smallest part of the largest scale of a kind that a coordinate is measured by.
SMALL = 1e-3


@dataclass(frozen=True)
class Reference:
    """What a motion is compared with.

    ``high`` + ``low`` are the states, shape (samples, 2n), at ``times``, the samples of those
    ``numbers``; ``span`` the first and the last time of all; ``scales`` those of all samples,
    shape (2n,); ``happened`` the events of contacts; ``made`` says how: the method, its
    tolerances, its own ``error`` over the scales, right-hand sides, and why it ends before the
    samples do, if it does.
    """

    coordinates: tuple[str, ...]
    kinds: tuple[str, ...]
    span: tuple[float, float]
    numbers: tuple[int, ...]
    times: Array
    high: Array
    low: Array
    scales: Array
    happened: tuple[Happening, ...]
    made: Mapping[str, Any]

    @property
    def names(self) -> list[str]:
        """Those of the numbers of a state."""
        return [*self.coordinates, *(f"dot({name})" for name in self.coordinates)]


def scales_of(states: Array, kinds: Sequence[str], span: float) -> Array:
    """The scales that errors are stated in, of all these samples (docs/accuracy.md)."""
    n = len(kinds)
    moved = np.abs(states[:, :n] - states[0, :n]).max(axis=0)
    moved[[kind == "angle" for kind in kinds]] = 1.0
    largest = {kind: max(moved[[k == kind for k in kinds]]) for kind in set(kinds)}
    of_kind = np.array([largest[kind] for kind in kinds])
    scales = np.where(of_kind == 0, 1.0, np.maximum(moved, SMALL * of_kind))
    fastest = np.abs(states[:, n:]).max(axis=0)
    return np.concatenate([scales, np.maximum(fastest, scales / span)])


# Making.


@dataclass(frozen=True)
class _Run:
    high: Array
    low: Array
    happened: tuple[Happening, ...]
    evaluations: int
    ended: str


def make(library: Library, model: Model, times: Array, scales: Array) -> Reference:
    """The reference of a model at sample times, with scales of about these."""
    for pair in TOLERANCES:
        most = MOST if pair is not TOLERANCES[-1] else LAST_MOST
        tight, loose = (_run(library, model, times, scales, x, most) for x in pair)
        if TOO_MANY not in (tight.ended, loose.ended):
            break
    exact = scales_of(tight.high, model.kinds, float(times[-1] - times[0]))
    errors = _apart(tight, loose, times) / exact
    errors = np.maximum.accumulate(errors.max(axis=1))
    kept = int(np.count_nonzero(errors <= WORST))
    numbers = _chosen(tight.high[:kept])
    made = {
        "method": METHOD,
        "tolerances": pair,
        "error": max(float(errors[kept - 1]), 10.0 ** (1 - DIGITS)),
        "evaluations": tight.evaluations,
        "ends": tight.ended if kept == len(tight.high) else "its error is too large",
    }
    happened = [h for h in tight.happened if h.high <= times[kept - 1]]
    return Reference(
        tuple(model.coordinates),
        tuple(model.kinds),
        (float(times[0]), float(times[-1])),
        tuple(numbers.tolist()),
        times[numbers],
        tight.high[numbers],
        tight.low[numbers],
        exact,
        tuple(happened),
        made,
    )


def _run(
    library: Library, model: Model, times: Array, scales: Array, tolerance: float, most: int
) -> _Run:
    motion = Motion(library, model, scales, tolerance, most)
    states: list[tuple[Array, Array]] = []
    ended = ""
    try:
        states.extend(motion.through(times))
    except EndedError as error:
        ended = str(error)
    high, low = (np.array(part) for part in zip(*states, strict=True))
    return _Run(high, low, tuple(motion.happened), motion.evaluations, ended)


def _apart(tight: _Run, loose: _Run, times: Array) -> Array:
    """How far the states of two runs are apart; infinitely where other things happen."""
    common = min(len(tight.high), len(loose.high))
    high = tight.high[:common] - loose.high[:common]
    apart = np.abs(high + (tight.low[:common] - loose.low[:common]))
    for one, other in zip_longest(tight.happened, loose.happened):
        if one is None or other is None or one.name != other.name:
            first = min(h.high for h in (one, other) if h is not None)
            apart[times[:common] >= first] = np.inf
            break
    return apart


def _chosen(states: Array) -> NDArray[np.int64]:
    """Samples to keep: evenly distributed ones, and of each number where it changes fastest."""
    count, width = states.shape
    even = min(SAMPLES, max(NUMBERS // width, 5), count)
    chosen = np.linspace(0, count - 1, even).round().astype(int)
    if count > 2:
        fastest = np.abs(np.diff(states, axis=0)).argmax(axis=0) + 1
        chosen = np.union1d(chosen, fastest[: NUMBERS // width])
    return np.unique(chosen)


# Storing.


def path_of(scene: Path, formulation: str) -> Path:
    """Where the reference of a scene in a formulation is stored."""
    relative = scene.relative_to(SYSTEMS)
    return FOLDER / relative.parent / f"{relative.stem}.{formulation}.json"


def content(scene: Path) -> str:
    """The hash of what the motion of a scene depends on."""
    sections = yaml.load(scene.read_text(encoding="utf-8"), yaml.CBaseLoader)
    kept = {name: value for name, value in sections.items() if name not in WORDS}
    wanted = kept.get("simulate") or {}
    kept["simulate"] = {
        k: v for k, v in wanted.items() if k in ("from", "until", "samples", "step")
    }
    hashed = hashlib.sha256(json.dumps(kept, sort_keys=True, default=str).encode())
    for recording in sorted(scene.parent.glob(f"{scene.stem}*.csv")):
        hashed.update(recording.read_bytes())
    return hashed.hexdigest()


def _decimals(high: Array, low: Array) -> list[str]:
    with localcontext() as context:
        context.prec = 2 * DIGITS
        exact = [Decimal(h) + Decimal(x) for h, x in zip(high.tolist(), low.tolist(), strict=True)]
    return [f"{value:.{DIGITS - 1}e}" for value in exact]


def _halves(texts: Sequence[str]) -> tuple[list[float], list[float]]:
    with localcontext() as context:
        context.prec = 2 * DIGITS
        high = [float(text) for text in texts]
        low = [float(Decimal(text) - Decimal(h)) for text, h in zip(texts, high, strict=True)]
    return high, low


def store(reference: Reference, scene: Path, formulation: str) -> Path:
    """Write a reference to its file."""
    head = {
        "scene": str(scene.relative_to(SYSTEMS)),
        "content": content(scene),
        "formulation": formulation,
        "made": reference.made,
        "coordinates": reference.coordinates,
        "kinds": reference.kinds,
        "span": reference.span,
        "scales": reference.scales.tolist(),
        "happened": [
            [h.name, *_decimals(np.array([h.high]), np.array([h.low]))] for h in reference.happened
        ],
    }
    rows = [
        json.dumps([number, time, *_decimals(high, low)])
        for number, time, high, low in zip(
            reference.numbers, reference.times.tolist(), reference.high, reference.low, strict=True
        )
    ]
    text = json.dumps(head, indent=1, ensure_ascii=False)[:-2]
    path = path_of(scene, formulation)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text + ',\n "samples": [\n' + ",\n".join(rows) + "\n]}\n", encoding="utf-8")
    return path


def stored_content(path: Path) -> str:
    """The hash of what the reference in a file was made of."""
    return str(json.loads(path.read_text(encoding="utf-8"))["content"])


def read(path: Path) -> Reference:
    """The reference in a file."""
    found = json.loads(path.read_text(encoding="utf-8"))
    halves = [_halves(row[2:]) for row in found["samples"]]
    happened = []
    for name, text in found["happened"]:
        (high,), (low,) = _halves([text])
        happened.append(Happening(high, low, name))
    return Reference(
        tuple(found["coordinates"]),
        tuple(found["kinds"]),
        (found["span"][0], found["span"][1]),
        tuple(row[0] for row in found["samples"]),
        np.array([row[1] for row in found["samples"]]),
        np.array([high for high, _ in halves]),
        np.array([low for _, low in halves]),
        np.array(found["scales"]),
        tuple(happened),
        found["made"],
    )
