"""Whether motions through kinks that meet, and along surfaces that hold them, are right.

Linear oscillators are driven by steps into saturated controllers, held by dry friction, moved by
a belt, controlled by relays, slide along one surface or two. The exact motion is made of pieces,
each the exponential of a matrix in 40 digits; the modes behind an event are all those whose
surfaces agree with their own flow to every order, found by trying all (a lexicographic test of
derivatives, which shares nothing with the program's rates and corners). What is kept may not be
wrong; where no mode, or more than one, agrees, a run may not go on.

    python benchmarks/soundness_sliding.py --runs 1000 --seed 1 -j 2
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import product

import numpy as np
from mpmath import mp, mpf

from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from lagrange_cli.simulate import Trajectory, simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model, ModelParameter

ACCURACIES = (1e-3, 1e-6, 1e-9)

#: Decimal digits of exact motions, and below which numbers are zero.
DIGITS, ZERO = 40, mpf(10) ** -24

SCENE = """
name: {name}
parameters: {{{parameters}}}
particles: {{p: {{mass: 1, position: [{positions}]}}}}
coordinates: [{coordinates}]
forces: {{f: {{on: p, force: [{forces}]}}}}
initial: {{{initial}}}
simulate: {{until: {until}, samples: 9}}
"""

#: Seconds after which a run is given up; it then counts as ended early.
BUDGET = 60.0

#: The time of steps: a number that doubles have, so that kinks meet exactly.
STEP = 1.0


# Expressions, linear in x, y, their rates, t and 1 on each side of each kink.


@dataclass(frozen=True)
class Linear:
    """A sum of names ``x``, ``y``, ``u``, ``v`` (their rates), ``t`` and ``1`` with numbers or
    names of parameters as factors."""

    terms: tuple[tuple[str, float | str], ...]


@dataclass(frozen=True)
class Kink:
    """A function ``sign``, ``abs``, ``max`` or ``min`` of one argument or two."""

    kind: str
    arguments: tuple[Sum, ...]


@dataclass(frozen=True)
class Sum:
    """A linear part, and kinks with their factors."""

    linear: Linear
    kinks: tuple[tuple[float | str, Kink], ...] = ()


def line(**terms: float | str) -> Sum:
    """A sum without kinks; ``one`` is the constant."""
    return Sum(Linear(tuple(("1" if n == "one" else n, x) for n, x in terms.items())))


def total(first: Sum, *kinks: tuple[float | str, Kink]) -> Sum:
    """A sum and further kinks."""
    return Sum(first.linear, (*first.kinks, *kinks))


def sign(argument: Sum) -> Kink:
    return Kink("sign", (argument,))


def clip(bound: str, argument: Sum) -> Kink:
    """max(−bound, min(bound, argument))."""
    inner = Kink("min", (line(one=bound), argument))
    return Kink("max", (line(one="-" + bound), total(line(), (1.0, inner))))


def written(part: Sum) -> str:
    """The expression in the scene's language."""
    names = {"u": "dot(x)", "v": "dot(y)"}
    terms = [
        f"({factor})" if name == "1" else f"({factor})*{names.get(name, name)}"
        for name, factor in part.linear.terms
    ]
    for factor, kink in part.kinks:
        terms.append(f"({factor})*{kink.kind}({', '.join(map(written, kink.arguments))})")
    return " + ".join(terms) or "0"


def kinks_of(part: Sum) -> list[Kink]:
    """All kinks of an expression, inner ones first, each once."""
    found: dict[Kink, None] = {}
    for _, kink in part.kinks:
        for argument in kink.arguments:
            found |= dict.fromkeys(kinks_of(argument))
        found[kink] = None
    return list(found)


# Exact motions.


@dataclass
class Mechanism:
    """Forces on x and y with numbers for their parameters; z = (x, y, u, v, t, 1)."""

    forces: tuple[Sum, Sum]
    numbers: Mapping[str, float]
    kinks: list[Kink] = field(init=False)

    def __post_init__(self) -> None:
        self.kinks = list(dict.fromkeys(k for force in self.forces for k in kinks_of(force)))

    def number(self, factor: float | str) -> mpf:
        if isinstance(factor, str):
            sign_of = -1 if factor.startswith("-") else 1
            return sign_of * mpf(self.numbers[factor.lstrip("-")])
        return mpf(factor)

    def row(self, part: Sum, modes: Mapping[Kink, int]) -> mp.matrix:
        """The row of an expression on some sides."""
        found = mp.zeros(1, 6)
        for name, factor in part.linear.terms:
            found[["x", "y", "u", "v", "t", "1"].index(name)] += self.number(factor)
        for factor, kink in part.kinks:
            found += self.number(factor) * self.kink_row(kink, modes)
        return found

    def kink_row(self, kink: Kink, modes: Mapping[Kink, int]) -> mp.matrix:
        side, first = modes[kink], self.row(kink.arguments[0], modes)
        if kink.kind == "sign":
            found = mp.zeros(1, 6)
            found[5] = mpf(side)
            return found
        if kink.kind == "abs":
            return side * first
        second = self.row(kink.arguments[1], modes)
        return first if (side > 0) == (kink.kind == "max") else second

    def surface(self, kink: Kink, modes: Mapping[Kink, int]) -> mp.matrix:
        """The row whose sign is the side of a kink."""
        first = self.row(kink.arguments[0], modes)
        return first if len(kink.arguments) == 1 else first - self.row(kink.arguments[1], modes)

    def flow(self, modes: Mapping[Kink, int]) -> mp.matrix:
        """F of z′ = F z."""
        found = mp.zeros(6, 6)
        found[0, 2] = found[1, 3] = found[4, 5] = mpf(1)
        found[2, :], found[3, :] = (self.row(force, modes) for force in self.forces)
        return found


@dataclass(frozen=True)
class Mode:
    """A flow, with rows that are positive as long as it holds."""

    flow: mp.matrix
    watched: tuple[mp.matrix, ...]
    slides: int = 0


class UndeterminedError(Exception):
    """No mode, or more than one, goes on."""


def leading(row: mp.matrix, flow: mp.matrix, z: mp.matrix) -> int:
    """Sign of the first derivative of a row along a flow that is not zero; 0 if there is none."""
    for _ in range(8):
        value = (row * z)[0]
        size = mp.fsum(abs(row[j] * z[j]) for j in range(6))
        if abs(value) > ZERO * max(size, mpf(1)):
            return int(mp.sign(value))
        row = row * flow
    return 0


def clearly(row: mp.matrix, z: mp.matrix) -> int:
    """Sign of a row at a state, 0 if it vanishes."""
    value = (row * z)[0]
    return 0 if abs(value) <= ZERO else int(mp.sign(value))


def possible_sides(of: Mechanism, z: mp.matrix) -> Iterator[dict[Kink, int]]:
    """Sides that agree with what clearly is not zero; inner kinks are chosen first."""

    def further(chosen: dict[Kink, int], left: list[Kink]) -> Iterator[dict[Kink, int]]:
        if not left:
            yield dict(chosen)
            return
        kink = left[0]
        known = clearly(of.surface(kink, chosen), z)
        for side in (known,) if known else (1, -1):
            yield from further({**chosen, kink: side}, left[1:])

    yield from further({}, of.kinks)


def modes(of: Mechanism, z: mp.matrix) -> list[Mode]:
    """All modes in which the motion may go on from a state."""
    sides, found = list(possible_sides(of, z)), []
    for chosen in sides:
        flow = of.flow(chosen)
        watched = [chosen[k] * of.surface(k, chosen) for k in of.kinks]
        if all(leading(row, flow, z) >= 0 for row in watched):
            found.append(Mode(flow, tuple(watched)))
    jumps = [
        k
        for k in of.kinks
        if k.kind == "sign" and {s[k] for s in sides} == {1, -1} and _at_zero(of, k, sides, z)
    ]
    for kink in jumps:
        for upper, lower in product(
            [s for s in sides if s[kink] == 1], [s for s in sides if s[kink] == -1]
        ):
            found += slides(of, z, kink, upper, lower)
    for first, second in [(a, b) for n, a in enumerate(jumps) for b in jumps[n + 1 :]]:
        for chosen in sides:
            if chosen[first] == chosen[second] == 1:
                found += slides_along_two(of, z, (first, second), chosen)
    return found


def _at_zero(of: Mechanism, kink: Kink, sides: Sequence[Mapping[Kink, int]], z: mp.matrix) -> bool:
    return all(clearly(of.surface(kink, chosen), z) == 0 for chosen in sides)


def slides(
    of: Mechanism,
    z: mp.matrix,
    kink: Kink,
    upper: dict[Kink, int],
    lower: dict[Kink, int],
) -> list[Mode]:
    """Motion along one surface, between two sides that may differ in other kinks."""
    plus, minus = of.flow(upper), of.flow(lower)
    row = of.surface(kink, upper)
    for _ in range(2):
        if any(abs(x) > ZERO for x in row * (plus - minus)):
            break
        if clearly(row, z):
            return []
        row = row * plus
    apart = row * (plus - minus)
    if clearly(row, z) or all(abs(x) <= ZERO for x in apart):
        return []
    jump = plus - minus
    if any(abs(jump[i, j]) > ZERO for i in range(6) for j in range(5)):
        if (apart * z)[0] < 0:
            raise NotClosedError
        return []
    part = -(row * (plus + minus)) / apart[5]
    flow = (plus + minus) / 2 + jump[:, 5] * part / 2
    watched = [_one() - part, _one() + part]
    for k in of.kinks:
        if k is not kink and k != kink:
            watched += [chosen[k] * of.surface(k, chosen) for chosen in (upper, lower)]
    if not all(leading(w, flow, z) >= 0 for w in watched):
        return []
    if any(leading(w, flow, z) == 0 for w in watched[:2]):
        return []  # it is the motion on one side
    return [Mode(flow, tuple(watched), 1)]


class NotClosedError(Exception):
    """Motion along a surface whose parts are no linear functions: it has no closed form here."""


def _one() -> mp.matrix:
    found = mp.zeros(1, 6)
    found[5] = mpf(1)
    return found


def slides_along_two(
    of: Mechanism, z: mp.matrix, kinks: tuple[Kink, Kink], chosen: dict[Kink, int]
) -> list[Mode]:
    """Motion along two surfaces of rates."""
    first, second = kinks
    corner = {s: {**chosen, first: s[0], second: s[1]} for s in product((1, -1), repeat=2)}
    flows = {s: of.flow(c) for s, c in corner.items()}
    jumps = [(flows[1, 1] - flows[-1, 1]) / 2, (flows[1, 1] - flows[1, -1]) / 2]
    mixed = flows[1, 1] - flows[-1, 1] - flows[1, -1] + flows[-1, -1]
    rows = [of.surface(k, chosen) for k in kinks]
    if any({leading(row * f, f, z) for f in flows.values()} in ({1}, {-1}) for row in rows):
        return []  # one of them is passed
    matrix = mp.matrix(2, 2)
    for i, j in product(range(2), repeat=2):
        matrix[i, j] = (rows[i] * jumps[j])[5]
    for jump in (*jumps, mixed):
        if any(abs(jump[i, j]) > ZERO for i in range(6) for j in range(5)):
            raise NotClosedError
    if any(abs(x) > ZERO for x in mixed) or abs(mp.det(matrix)) <= ZERO:
        if not _surround_zero([[(row * f * z)[0] for row in rows] for f in flows.values()]):
            return []
        raise UndeterminedError
    middle = flows[1, 1] - jumps[0] - jumps[1]
    rates = mp.matrix(2, 6)
    for i in range(2):
        rates[i, :] = rows[i] * middle
    parts = -(matrix**-1) * rates
    flow = middle + sum((jumps[i][:, 5] * parts[i, :] for i in range(2)), mp.zeros(6, 6))
    watched = [_one() + s * parts[i, :] for i in range(2) for s in (1, -1)]
    watched += [chosen[k] * of.surface(k, chosen) for k in of.kinks if k not in kinks]
    if not all(leading(w, flow, z) > 0 for w in watched[:4]):
        return []
    if not all(leading(w, flow, z) >= 0 for w in watched[4:]):
        return []
    # Motions may spiral out where the rates are no P-matrix of the sides.
    if not (matrix[0, 0] < 0 and matrix[1, 1] < 0 and mp.det(matrix) > 0):
        raise UndeterminedError
    return [Mode(flow, tuple(watched), 2)]


def _surround_zero(rates: Sequence[Sequence[mpf]]) -> bool:
    """Whether a combination of pairs of rates is zero: no half-plane has all within it."""
    if any(max(map(abs, pair)) <= ZERO for pair in rates):
        return True
    angles = sorted(mp.atan2(second, first) for first, second in rates)
    gaps = [b - a for a, b in zip(angles, [*angles[1:], angles[0] + 2 * mp.pi], strict=True)]
    return max(gaps) <= mp.pi + ZERO


def same_motion(one: Mode, other: Mode, z: mp.matrix) -> bool:
    first, second = z, z
    for _ in range(6):
        first, second = one.flow * first, other.flow * second
        if max(abs(first[i] - second[i]) for i in range(6)) > ZERO:
            return False
    return True


def next_mode(of: Mechanism, z: mp.matrix) -> Mode:
    """The mode in which the motion goes on; of modes with one motion that which holds longest."""
    ways = modes(of, z)
    if not ways or not all(same_motion(ways[0], way, z) for way in ways):
        raise UndeterminedError
    return max(ways, key=lambda way: way.slides)


def first_end(mode: Mode, z: mp.matrix, span: mpf) -> mpf | None:
    """When the first watched row falls below zero; None if none does within the span."""
    flow = np.array(mode.flow.tolist(), dtype=float)
    rows = [np.array(row.tolist(), dtype=float)[0] for row in mode.watched]
    speed = max(1.0, float(np.abs(np.linalg.eigvals(flow)).max()))
    count = int(np.ceil(float(span) * speed * 16)) + 1
    h = float(span) / count
    power = _exponential(flow * h)
    states = [np.array(z.tolist(), dtype=float)[:, 0]]
    for _ in range(count):
        states.append(power @ states[-1])
    values = np.array(states) @ np.array(rows).T
    slopes = np.array(states) @ flow.T @ np.array(rows).T
    found: list[mpf] = []
    for k, row in enumerate(mode.watched):
        if leading(row, mode.flow, z) == 0:
            continue  # it stays zero
        for j in range(count):
            a, b = values[j, k], values[j + 1, k]
            tiny = 1e-11 * max(1.0, float(np.abs(values[:, k]).max()))
            dips = slopes[j, k] < 0 < slopes[j + 1, k] and a > 0 and b > 0
            if b < tiny or dips:
                end = _zero_within(mode, row, z, mpf(h) * j, mpf(h) * (j + 1), first=j == 0)
                if end is not None:
                    found.append(end)
                    break
    return min(found, default=None)


def _exponential(matrix: np.ndarray) -> np.ndarray:
    from scipy.linalg import expm

    return np.asarray(expm(matrix))


def after(flow: mp.matrix, z: mp.matrix, t: mpf) -> mp.matrix:
    """The state after a time: a series in steps short enough for it."""
    size = max(mp.fsum(abs(flow[i, j]) for j in range(6)) for i in range(6))
    steps = max(1, int(mp.ceil(abs(t) * size / 4)))
    h = t / steps
    for _ in range(steps):
        term, found, k = z.copy(), z.copy(), 1
        while k < 200:
            term = flow * term * (h / k)
            found += term
            k += 1
            if max(abs(x) for x in term) < mpf(10) ** (-DIGITS):
                break
        z = found
    return z


def _zero_within(
    mode: Mode, row: mp.matrix, z: mp.matrix, a: mpf, b: mpf, first: bool
) -> mpf | None:
    """The first fall of a row through zero between two times, None if there is none."""
    start = after(mode.flow, z, a)

    def value(t: mpf) -> mpf:
        return (row * after(mode.flow, start, t))[0]

    low, high = mpf(0), b - a
    if value(high) >= 0:
        # A least value between, if there is one, decides.
        slope = row * mode.flow
        left, right = low, high
        if not (slope * after(mode.flow, start, right))[0] > 0:
            return None
        for _ in range(70):
            middle = (left + right) / 2
            if (slope * after(mode.flow, start, middle))[0] < 0:
                left = middle
            else:
                right = middle
        high = right
        least = value(high)
        if abs(least) < mpf(10) ** -13:
            raise GrazeError
        if least >= 0:
            return None
    if first:
        # It begins at zero, perhaps, and rises: go back to where it is positive.
        low = high
        for _ in range(120):
            low /= 2
            if value(low) > 0:
                break
            high = low
        else:
            return mpf(0)
    for _ in range(130):
        middle = (low + high) / 2
        if value(middle) > 0:
            low = middle
        else:
            high = middle
    return a + high


class GrazeError(Exception):
    """A surface is touched within what can be told."""


def exact_motion(
    of: Mechanism, start: Sequence[float], times: Sequence[float]
) -> tuple[list[mp.matrix], Counter[str], mpf]:
    """The states at some times, until the motion is not determined; events and where it ends."""
    z = mp.matrix([*map(mpf, start), mpf(0), mpf(1)])
    states: list[mp.matrix] = []
    counts: Counter[str] = Counter()
    end = mpf(times[-1])
    for _ in range(400):
        t = z[4]
        try:
            mode = next_mode(of, z)
        except UndeterminedError:
            counts["undetermined"] += 1
            return states, counts, t
        counts["slides"] += mode.slides == 1
        counts["slides along two"] += mode.slides == 2
        until = first_end(mode, z, end - t + mpf("0.01"))
        last = mp.inf if until is None else t + until
        while len(states) < len(times) and times[len(states)] <= last:
            states.append(after(mode.flow, z, mpf(times[len(states)]) - t))
        if len(states) == len(times) or until is None:
            return states, counts, end
        counts["events"] += 1
        z = after(mode.flow, z, until)
        _on_surfaces(of, z)
    counts["endless"] += 1
    return states, counts, z[4]


def _on_surfaces(of: Mechanism, z: mp.matrix) -> None:
    """Times of steps are exact."""
    if abs(z[4] - mpf(STEP)) < ZERO:
        z[4] = mpf(STEP)


# What is run.


@dataclass(frozen=True)
class Family:
    """Mechanisms of a kind: forces, and numbers at random.

    ``draw`` makes numbers of parameters and a start.
    """

    forces: tuple[Sum, Sum]
    draw: Callable[[np.random.Generator], tuple[dict[str, float], tuple[float, ...]]]
    plane: bool = False
    until: float = 4.0


def _spring(**further: float | str) -> Sum:
    return line(x="-k", u="-c", **further)


def _drawn(*names: str, low: float = 0.2, high: float = 3.0, **own: tuple[float, float]):
    def draw(rng: np.random.Generator) -> tuple[dict[str, float], tuple[float, ...]]:
        numbers = {name: _round(rng.uniform(*own.get(name, (low, high)))) for name in names}
        rest = rng.uniform() < 0.3
        start = [0.0 if rest else _round(rng.uniform(-2, 2)) for _ in range(4)]
        if rng.uniform() < 0.5:
            start[2] = start[3] = 0.0
        return numbers, tuple(start)

    return draw


def _round(x: float) -> float:
    """Eighths: kinks meet exactly in many of the runs."""
    return float(np.round(8 * x) / 8)


def _step_at_one() -> Kink:
    return sign(line(t=1.0, one=-STEP))


def _friction(force: Sum, *, size: str = "m") -> Sum:
    return total(force, ("-" + size, sign(line(u=1.0))))


FAMILIES: dict[str, Family] = {
    "step into a saturated controller": Family(
        (
            total(
                line(),
                (1.0, clip("b", total(line(x="-k", u="-c", one="r"), ("r", _step_at_one())))),
            ),
            line(),
        ),
        _drawn("k", "c", "b", "r", k=(0.5, 12)),
    ),
    "step, saturation and dry friction": Family(
        (
            total(
                line(),
                ("-m", sign(line(u=1.0))),
                (1.0, clip("b", total(line(x="-k", u="-c", one="r"), ("r", _step_at_one())))),
            ),
            line(),
        ),
        _drawn("k", "c", "b", "r", "m", k=(0.5, 12), m=(0.1, 1.5)),
    ),
    "dry friction on a spring, steps": Family(
        (total(_friction(_spring()), ("r", _step_at_one())), line()),
        _drawn("k", "c", "r", "m", c=(0, 0.5), m=(0.1, 2)),
    ),
    "belt": Family(
        (total(_spring(), ("-m", sign(line(u=1.0, one="-w")))), line()),
        _drawn("k", "c", "w", "m", c=(-0.3, 0.5), w=(-1, 1)),
    ),
    "belt that stops": Family(
        (
            total(
                _spring(),
                ("-m", sign(total(line(u=1.0, one="-w"), ("w", _step_at_one())))),
            ),
            line(),
        ),
        _drawn("k", "c", "w", "m", c=(0, 0.5), w=(-1, 1)),
    ),
    "sliding mode control under a load": Family(
        (
            total(_spring(one="r", t="d"), ("-m", sign(line(u=1.0, x="s")))),
            line(),
        ),
        _drawn("k", "c", "r", "d", "m", "s", r=(-2, 2), d=(-1, 1), k=(-1, 2)),
    ),
    "bounded relay under a load": Family(
        (
            total(
                line(one="r", t="d"),
                (1.0, clip("b", total(line(), ("-m", sign(line(u=1.0, x="s")))))),
            ),
            line(),
        ),
        _drawn("b", "r", "d", "m", "s", r=(-1, 1), d=(-1, 1), m=(0.2, 6)),
    ),
    "dead zone and backstop": Family(
        (
            total(
                _spring(),
                ("-g", Kink("max", (line(), line(x=1.0, one=-0.5)))),
                ("g", Kink("max", (line(), line(x=-1.0, one=-0.5)))),
                ("-m", sign(line(u=1.0))),
            ),
            line(),
        ),
        _drawn("k", "c", "g", "m", m=(0.1, 1), g=(1, 20)),
    ),
    "two rubbing bodies": Family(
        (
            total(line(x="-k"), ("-m", sign(line(u=1.0))), ("-n", sign(line(u=1.0, v=-1.0)))),
            total(line(y="-k", one="r"), ("n", sign(line(u=1.0, v=-1.0)))),
        ),
        _drawn("k", "m", "n", "r", m=(0.1, 1.5), n=(0.1, 1.5), r=(-2, 2)),
        plane=True,
    ),
    "two coupled relays": Family(
        (
            total(line(x=-1.0), ("-m", sign(line(u=1.0))), ("a", sign(line(v=1.0)))),
            total(line(y=-1.0), ("-n", sign(line(v=1.0))), ("b", sign(line(u=1.0)))),
        ),
        _drawn("m", "n", "a", "b", a=(-1.5, 1.5), b=(-1.5, 1.5), m=(-0.3, 2)),
        plane=True,
    ),
    "relay of the position": Family(
        (total(line(u="-c", one="r"), ("-m", sign(line(x=1.0))), ("r", _step_at_one())), line()),
        _drawn("c", "m", "r", c=(0, 0.5), r=(-0.6, 0.6)),
    ),
    "repelling switch": Family(
        (total(_spring(one="r"), ("m", sign(line(u=1.0, x="s")))), line()),
        _drawn("k", "c", "r", "m", "s", r=(-2, 2)),
    ),
}


@dataclass(frozen=True)
class Start:
    """One run: a family with its numbers."""

    family: str
    numbers: Mapping[str, float]
    start: tuple[float, ...]
    accuracy: float


@cache
def model(name: str) -> Model:
    """The model of a family; its code is compiled once, parameters are numbers at run time."""
    family = FAMILIES[name]
    numbers, _ = family.draw(np.random.default_rng(0))
    both = "x: 0, dot(x): 0" + (", y: 0, dot(y): 0" if family.plane else "")
    text = SCENE.format(
        name="a",
        parameters=", ".join(f"{p}: {x}" for p, x in numbers.items()),
        positions="x, y, 0" if family.plane else "x, 0, 0",
        coordinates="x, y" if family.plane else "x",
        forces=", ".join(f'"{written(force)}"' for force in family.forces) + ", 0",
        initial=both,
        until=family.until,
    )
    return model_of(derive(read_text(text)))


def moved(start: Start) -> Trajectory:
    """The run of the program."""
    of, plane = model(start.family), FAMILIES[start.family].plane
    parameters = tuple(
        ModelParameter(p.name, start.numbers.get(p.name, p.value), p.used) for p in of.parameters
    )
    places = (0, 1, 2, 3) if plane else (0, 2)
    initial = tuple(start.start[k] for k in places)
    changed = replace(of, parameters=parameters, initial=initial, initial_decimals=())
    return simulate(changed, accuracy=start.accuracy, budget=BUDGET)


def starts(runs: int, rng: np.random.Generator) -> list[Start]:
    """Random runs, families by turns."""
    names = list(FAMILIES)
    found = []
    for k in range(runs):
        family = names[k % len(names)]
        numbers, start = FAMILIES[family].draw(rng)
        if not FAMILIES[family].plane:
            start = (start[0], 0.0, start[2], 0.0)
        found.append(Start(family, numbers, start, float(rng.choice(ACCURACIES))))
    return found


@dataclass(frozen=True)
class Result:
    """A run with its status, the largest error in accuracies, and what the exact motion has."""

    start: Start
    status: str
    reason: str
    excess: float
    counts: Counter[str]
    kept_too_long: bool

    @property
    def wrong(self) -> bool:
        """Kept, and not what the motion does."""
        return not self.excess <= 1 or self.kept_too_long


def judged(start: Start) -> Result:
    """One run beside the exact motion."""
    run = moved(start)
    of = Mechanism(FAMILIES[start.family].forces, start.numbers)
    with mp.workdps(DIGITS):
        try:
            exact, counts, end = exact_motion(of, start.start, run.t.tolist())
        except (NotClosedError, GrazeError) as error:
            return Result(start, type(error).__name__, run.reason, 0.0, Counter(), False)
    names = {"x": 0, "dot(x)": 2} | ({"y": 1, "dot(y)": 3} if FAMILIES[start.family].plane else {})
    worst = 0.0
    for name, place in names.items():
        own = run.columns[name]
        errors = [abs(float(mpf(float(a)) - z[place])) for a, z in zip(own, exact, strict=False)]
        # Of a body that stays at rest the 40 digits leave rounding, which is no motion.
        worst = max(worst, max(errors, default=0.0) / max(run.scales[name], float(ZERO)))
    too_long = len(exact) < len(run.t) and float(run.t[len(exact)]) > float(end) + 1e-6
    return Result(start, run.status, run.reason, worst / start.accuracy, counts, too_long)


def table(results: Sequence[Result]) -> str:
    """Runs of each family, kept whole, ended early, wrong, with what the exact motions pass."""
    lines = [
        "| mechanism | runs | ok | ended early | exact one not determined | wrong | events |"
        " slides | along two |",
        "|---" * 9 + "|",
    ]
    for family in [*FAMILIES, ""]:
        of = [r for r in results if family in ("", r.start.family)]
        counts = sum((r.counts for r in of), Counter())
        ok = sum(r.status == "ok" for r in of)
        cells = [
            family or "all",
            len(of),
            ok,
            len(of) - ok,
            sum(r.counts["undetermined"] + r.counts["endless"] > 0 for r in of),
            sum(r.wrong for r in of),
            counts["events"],
            counts["slides"],
            counts["slides along two"],
        ]
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Kinks that meet and surfaces that hold.")
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", dest="processes", type=int, default=1)
    parser.add_argument("--family", help="this one alone")
    given = parser.parse_args(arguments)
    todo = starts(given.runs, np.random.default_rng(given.seed))
    todo = [s for s in todo if given.family in (None, s.family)]
    if given.processes == 1:
        results = list(map(judged, todo))
        for bad in (r for r in results if r.wrong):
            print(bad, file=sys.stderr)
    else:
        with ProcessPoolExecutor(given.processes) as pool:
            results = []
            for result in pool.map(judged, todo, chunksize=4):
                results.append(result)
                if result.wrong:
                    print(result, file=sys.stderr, flush=True)
    for reason, number in Counter(r.reason for r in results if r.reason).most_common(8):
        print(f"{number} × {reason}", file=sys.stderr)
    print(table(results))
    return 1 if any(r.wrong for r in results) else 0


if __name__ == "__main__":
    sys.exit(main())
