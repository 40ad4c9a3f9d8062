"""Equilibria and branches whose places, stability and number are known by construction.

Potentials are polynomials in monotone functions of a coordinate, with roots of V′ that are simple,
multiple or clustered, and with none where V′ fades or misses zero by little; a second coordinate is
mixed in. Branches have folds, pitchforks, transcritical points, poles and cusps at known values. A
judge of its own compares V beside each root in 120 digits: the place within the stated
uncertainty, the verdict, the number where *these are all* is said, each marked point within its ±,
and the sign of V″ along each part of a branch.

    python benchmarks/soundness_equilibria.py --systems 500 --seed 1 -j 2
"""

from __future__ import annotations

import argparse
import re
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field

import mpmath
import numpy as np
import sympy as sp
from mpmath import mp, mpf

from lagrange_cli import InputError, loads
from lagrange_cli.analysis.branches.values import Branches
from lagrange_cli.analysis.values import Equilibria

DIGITS = 120

SCENE = """
name: system
parameters: {{p: {start}}}
coordinates: [{names}]
kinetic: {{T: {kinetic}}}
potentials: {{V: '{potential}'}}
near: {{{near}}}
"""

#: Monotone functions of x, as text, with the values that they come close to.
MONOTONE = {
    "x": 20.0,
    "(x + x^3/10)": 20.0,
    "sinh(x)": 20.0,
    "asinh(x)": 3.0,
    "atan(x)": 1.5,
    "tanh(x)": 0.99,
    "(x/sqrt(1 + x^2))": 0.99,
}

GAPS = (0.5, 1e-2, 1e-4, 1e-7, 1e-10, 1e-14)


@dataclass(frozen=True)
class Expected:
    """A system with what is true of it.

    Attributes
    ----------
    kind, potential
        Its family, and V over x, y and p.
    roots
        All equilibria x of V(x), in 120 digits; of endless ones a few of them, and ``endless``.
    turns
        True if x is an angle: roots a turn apart are one.
    near
        Coordinates near which one is.
    mixed
        Coefficients b, c, k of a second coordinate: x becomes s = x + b y, V gains k/2 (y + c s²)².
    marks
        Values of the parameter at which a branch has marks, with the kinds that these may have.
    center
        Middle of the parameter's range; None if equilibria are sought.
    """

    kind: str
    potential: str
    roots: tuple[mpf, ...] = ()
    endless: bool = False
    turns: bool = False
    near: float = 0.1
    mixed: tuple[float, float, float] | None = None
    marks: tuple[tuple[mpf, tuple[str, ...]], ...] = ()
    center: float | None = None

    @property
    def scene(self) -> str:
        names, kinetic, potential = "x", "dot(x)^2/2", self.potential
        near = f"x: {self.near}"
        if self.mixed is not None:
            b, c, k = self.mixed
            s = f"(x + {b}*y)"
            # The letter x stands in exp, too.
            potential = re.sub(r"\bx\b", s, potential) + f" + {k}/2*(y + {c}*{s}^2)^2"
            names, kinetic = "x, y", "(dot(x)^2 + dot(y)^2)/2"
            near += ", y: 0.1"
        start = 0.5 if self.center is None else self.center + 0.3
        return SCENE.format(
            names=names, kinetic=kinetic, potential=potential, near=near, start=start
        )

    def value(self, x: mpf, p: mpf) -> mpf:
        """V in the digits that are set, by a reader of its own."""
        functions = {
            name: getattr(mpmath, name)
            for name in (
                "sin",
                "cos",
                "exp",
                "sinh",
                "asinh",
                "atan",
                "tanh",
                "sqrt",
                "cosh",
                "log",
            )
        }
        text = self.potential.replace("^", "**")
        return mpf(_evaluated(text, {**functions, "x": x, "p": p}))


def _evaluated(text: str, names: dict[str, object]) -> mpf:
    """Evaluate text that this program wrote; all numbers in it become those of 120 digits."""
    exact = re.sub(r"(?<![\w.])(\d+\.?\d*(?:e[+-]?\d+)?)(?![\w.])", r'mpf("\1")', text)
    return eval(exact, {"__builtins__": {}}, {**names, "mpf": mpf})  # its own text


def _decimal(rng: np.random.Generator, low: float, high: float) -> sp.Rational:
    return sp.Rational(round(rng.uniform(low, high) * 100), 100)


def _inverse(function: str, value: mpf) -> mpf:
    inverses: dict[str, Callable[[mpf], mpf]] = {
        "x": lambda y: y,
        "sinh(x)": mpmath.asinh,
        "asinh(x)": mpmath.sinh,
        "atan(x)": mpmath.tan,
        "tanh(x)": mpmath.atanh,
        "(x/sqrt(1 + x^2))": lambda y: y / mpmath.sqrt(1 - y**2),
    }
    if function in inverses:
        return inverses[function](value)
    return mpmath.findroot(lambda x: x + x**3 / 10 - value, value / (1 + abs(value) / 10))


def _text(polynomial: sp.Expr, u: sp.Symbol, function: str) -> str:
    terms = sp.Poly(sp.expand(polynomial), u).terms()
    return " + ".join(f"({c})*{function}^{d}" if d else f"({c})" for (d,), c in terms)


def _mixture(rng: np.random.Generator) -> tuple[float, float, float] | None:
    if rng.uniform() < 0.6:
        return None
    b, c, k = (float(_decimal(rng, low, high)) for low, high in ((-1, 1), (-1, 1), (0.5, 3)))
    return b, c, k


def roots(rng: np.random.Generator) -> Expected:
    """Roots of any multiplicity, alone or in clusters, of a polynomial in a monotone function."""
    u, function = sp.Symbol("u"), str(rng.choice(list(MONOTONE)))
    width = min(MONOTONE[function], 2.0) * 0.9
    places = {_decimal(rng, -width, width): int(rng.choice([1, 1, 2, 2, 3, 4])) for _ in range(2)}
    if rng.uniform() < 0.5:
        gap = sp.Rational(str(rng.choice(GAPS)))
        beside = next(iter(places))
        # Towards zero: beyond its bounds a monotone function has no roots.
        places.setdefault(beside - sp.sign(beside) * gap / 2, 1)
    sign = int(rng.choice([-1, 1]))
    slope = sign * sp.prod((u - a) ** m for a, m in places.items())
    numbers = [mpf(a.p) / a.q for a in places]
    found = tuple(sorted(_inverse(function, a) for a in numbers))
    potential = _text(sp.integrate(sp.expand(slope), u), u, function)
    return Expected("roots", potential, found, mixed=_mixture(rng))


def waves(rng: np.random.Generator) -> Expected:
    """z − sin z, with double roots a turn apart."""
    c, k = _decimal(rng, -1, 1), _decimal(rng, 0.5, 2)
    z = f"({k}*(x - ({c})))"
    places = [mpf(c.p) / c.q + 2 * mpmath.pi * n * mpf(k.q) / k.p for n in range(-400, 401)]
    return Expected("waves", f"{z} - sin({z})", tuple(places), endless=True, near=float(c) + 0.1)


def turns(rng: np.random.Generator) -> Expected:
    """sin(x − a), or a product of three, for V′ of an angle: roots a, b, c and half a turn on."""
    a, b, c = (_decimal(rng, -2, 2) for _ in range(3))
    if rng.uniform() < 0.3:
        b = a
    places, potential = [a], f"-cos(x - ({a}))"
    if rng.uniform() < 0.7:
        places = list(dict.fromkeys([a, b, c]))
        shifts = (a + b - c, a - b + c, b + c - a)
        potential = " ".join(f"- cos(x - ({s}))" for s in shifts) + f" + cos(3*x - ({a + b + c}))/3"
    numbers = [mpf(x.p) / x.q + half * mpmath.pi for x in places for half in (0, 1)]
    return Expected("turns", potential, tuple(numbers), turns=True)


def remainders(rng: np.random.Generator) -> Expected:
    """What is left of cos, sinh or cosh beyond their first terms: one root of a high order."""
    c, terms = _decimal(rng, -1, 1), int(rng.integers(1, 4))
    z, sign = f"(x - ({c}))", str(rng.choice(["", "-"]))
    function, first, alternate = [("cos", 0, -1), ("sinh", 1, 1), ("cosh", 0, 1)][rng.integers(3)]
    series = " ".join(
        f"- ({sp.Rational(alternate**j, sp.factorial(2 * j + first))})*{z}^{2 * j + first}"
        for j in range(terms + 1)
        if 2 * j + first
    )
    place = mpf(c.p) / c.q
    return Expected(
        "remainders", f"{sign}({function}({z}) {series})", (place,), near=float(c) + 0.1
    )


def fading(rng: np.random.Generator) -> Expected:
    """Forces that fade: one root, and none however far away."""
    c = _decimal(rng, -1, 1)
    z, sign = f"(x - ({c}))", str(rng.choice(["", "-"]))
    forms = ["tanh(Z)^2", "exp(-Z^2)", "1/cosh(Z)", "Z^2/(1 + Z^2)", "atan(Z)^2", "atan(Z^2)"]
    form = str(rng.choice(forms)).replace("Z", z).replace("-(", "-1*(")
    place = mpf(c.p) / c.q
    return Expected("fading", f"{sign}{form}", (place,), mixed=_mixture(rng))


def misses(rng: np.random.Generator) -> Expected:
    """V′ that misses zero by little: there is no equilibrium."""
    c, size = _decimal(rng, -1, 1), f"1e-{int(rng.integers(3, 31))}"
    z = f"(x - ({c}))"
    forms = ["Z^3/3 + E*x", "Z - sin(Z) + E*x", "sinh(Z) - Z - Z^3/6 + E*x - Z + Z", "Z^5 + E*x"]
    form = str(rng.choice(forms[:2] + forms[3:])).replace("Z", z).replace("E", size)
    return Expected("misses", form, near=float(c) + 0.1)


#: Families of branches: V over z and q, and marks at q with the kinds that they may have.
BRANCHES: dict[str, tuple[str, tuple[tuple[str, tuple[str, ...]], ...]]] = {
    "pitchfork": ("Z^4/4 - Q*Z^2/2", (("0", ("pitchfork",)),)),
    "transcritical": ("Z^3/3 - Q*Z^2/2", (("0", ("transcritical",)),)),
    "fold": ("Z^3/3 - Q*Z", (("0", ("fold",)),)),
    "flat fold": ("Z^5/5 - Q*Z", (("0", ("fold",)),)),
    "flat pitchfork": ("Z^6/6 - Q*Z^2/2", (("0", ("pitchfork", "branch point")),)),
    "imperfect": ("Z^4/4 - Q*Z^2/2 + E*Z", (("3*(E/2)**(mpf(2)/3)", ("fold",)),)),
    "pole": ("Z^2/Q", ()),
    "steep pole": ("Z^2/Q^3 + Z^4", (("0", ()),)),
    "cusp": ("Q^3*Z - Z^3/3", ()),
    "wide cusp": ("Q^5*Z - Z^3/3", ()),
}


def branches(rng: np.random.Generator) -> Expected:
    """One parameter, with a mark of a known kind at a known value, or none."""
    name = str(rng.choice(list(BRANCHES)))
    form, marks = BRANCHES[name]
    a, c, size = _decimal(rng, -1, 1), _decimal(rng, -1, 1), f"1e-{int(rng.integers(2, 7))}"
    z, q = f"(x - ({c}))", f"(p - ({a}))"
    center = mpf(a.p) / a.q
    values = tuple(
        (center + _evaluated(text.replace("E", size), {}), kinds) for text, kinds in marks
    )
    potential = form.replace("E", size).replace("Z", z).replace("Q", q)
    return Expected(
        f"branches: {name}", potential, near=float(c) + 0.1, marks=values, center=float(a)
    )


KINDS = (roots, roots, waves, turns, remainders, fading, misses, branches, branches)


@dataclass
class Outcome:
    """Counts of statements of one system, and the false ones."""

    scene: str
    kind: str
    counts: Counter[str] = field(default_factory=Counter)
    false: list[str] = field(default_factory=list)


def outcome(seed: Sequence[int]) -> Outcome:
    """Analyze one random system, and judge what is said of it."""
    rng = np.random.default_rng(seed)
    with mp.workdps(DIGITS):
        expected = KINDS[seed[-1] % len(KINDS)](rng)
    result = Outcome(expected.scene, expected.kind)
    result.counts["systems"] += 1
    try:
        derivation = loads(expected.scene).derive()
        if expected.center is None:
            found = derivation.analyze("equilibria").equilibria
        else:
            ends = expected.center - 1.03, expected.center + 1.31
            found = derivation.analyze(branches={"p": ends}).branches
    except InputError:
        result.counts["refused"] += 1
        return result
    with mp.workdps(DIGITS):
        if isinstance(found, Equilibria):
            _judge_equilibria(expected, found, result)
        elif found is not None:
            _judge_branches(expected, found, result)
    return result


def _judge_equilibria(expected: Expected, found: Equilibria, result: Outcome) -> None:
    counts, matched = result.counts, list[int]()
    counts["equilibria told"] += len(found.points)
    counts["told as not proven"] += len(found.unproven)
    for point in found.points:
        numbers = list(map(mpf, point.position or ()))
        b, c, _ = expected.mixed or (0.0, 0.0, 0.0)
        b, c = mpf(str(b)), mpf(str(c))
        s = numbers[0] + (b * numbers[1] if expected.mixed else 0)
        gaps = [_gap(expected, root, s) for root in expected.roots]
        nearest = min(range(len(gaps)), key=gaps.__getitem__, default=None)
        room = 20 * max(mpf(point.uncertainty), mpf(10) ** -45) * max(1, abs(s))
        off_curve = expected.mixed and abs(numbers[1] + c * s**2) > room * 20
        if nearest is None or gaps[nearest] > room or off_curve:
            result.false.append(f"no equilibrium at {mpmath.nstr(s, 20)}")
            continue
        if nearest in matched:
            result.false.append(f"twice at {mpmath.nstr(s, 20)}")
        matched.append(nearest)
        verdict = point.stability.verdict if point.stability else "undecided"
        stable = _is_minimum(expected, nearest)
        counts["verdicts"] += 1
        counts["undecided"] += verdict in ("undecided", "stable in the linear approximation")
        if verdict in ("stable", "asymptotically stable") and not stable:
            result.false.append(f"stable at {mpmath.nstr(s, 20)}")
        if verdict == "unstable" and stable:
            result.false.append(f"unstable at {mpmath.nstr(s, 20)}")
        if not point.isolated:
            result.false.append(f"a continuum at {mpmath.nstr(s, 20)}")
    counts["true equilibria not told"] += (
        0 if expected.endless else len(expected.roots) - len(set(matched))
    )
    if found.complete:
        counts["these are all"] += 1
        if expected.endless or len(set(matched)) != len(expected.roots):
            result.false.append("these are all")


def _gap(expected: Expected, root: mpf, x: mpf) -> mpf:
    gap = abs(root - x)
    turn = 2 * mpmath.pi
    return abs(gap - turn * mpmath.nint(gap / turn)) if expected.turns else gap


def _is_minimum(expected: Expected, number: int) -> bool:
    """Say whether V is larger on both sides of a root, nearer than the next ones."""
    x = expected.roots[number]
    others = [_gap(expected, r, x) for k, r in enumerate(expected.roots) if k != number]
    step = min([mpf("0.001"), *(gap / 4 for gap in others)])
    here = expected.value(x, mpf(0))
    return all(expected.value(x + side * step, mpf(0)) > here for side in (-1, 1))


def _judge_branches(expected: Expected, found: Branches, result: Outcome) -> None:
    counts, met, along = result.counts, set[int](), expected.value
    counts["marked points told"] += len(found.marks)
    for mark in found.marks:
        near = [
            k
            for k, (value, kinds) in enumerate(expected.marks)
            if mark.kind in kinds and abs(mpf(mark.value) - value) <= mpf(mark.error) * (1 + 1e-9)
        ]
        met |= set(near)
        if not near:
            result.false.append(f"{mark.kind} at {mark.value!r} ± {mark.error:.1g}")
    true = [k for k, (_, kinds) in enumerate(expected.marks) if kinds]
    counts["true marks not told"] += len(set(true) - met)
    for branch in found.branches:
        for stretch in branch.stretches:
            counts["parts of branches"] += 1
            verdict = stretch.stability.verdict
            counts["parts undecided"] += verdict == "undecided"
            inner = range(stretch.first + 1, stretch.last)
            for k in list(inner)[:: max(1, len(inner) // 6)]:
                x, p = mpf(float(branch.positions[k, 0])), mpf(float(branch.values[k]))
                slope, bend = (mpmath.diff(along, (x, p), (n, 0)) for n in (1, 2))
                if abs(slope) > mpf(10) ** -11 * max(1, abs(bend)) + _rounded(along, 1, x, p):
                    result.false.append(f"no equilibrium at x = {x}, p = {p}")
                certain = abs(bend) > _rounded(along, 2, x, p)
                if certain and verdict == ("stable" if bend < 0 else "unstable"):
                    result.false.append(f"{verdict} at x = {x}, p = {p}")


def _rounded(value: Callable[[mpf, mpf], mpf], order: int, x: mpf, p: mpf) -> mpf:
    """Return what ∂ⁿV/∂xⁿ changes by if x and p are rounded to doubles: much beside a pole."""
    changes = (
        size * mpmath.diff(value, (x, p), (order + by_x, 1 - by_x))
        for size, by_x in ((x, 1), (p, 0))
    )
    return sum(map(abs, changes), mpf(0)) * mpf(2) ** -52


def results(systems: int, seed: int, jobs: int = 1) -> list[Outcome]:
    """Return what became of random systems."""
    seeds = [(seed, k) for k in range(systems)]
    if jobs == 1:
        return [outcome(one) for one in seeds]
    with ProcessPoolExecutor(jobs) as pool:
        return list(pool.map(outcome, seeds, chunksize=4))


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Equilibria and branches that are known.")
    parser.add_argument("--systems", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    given = parser.parse_args(arguments)
    outcomes = results(given.systems, given.seed, given.jobs)
    total = sum((o.counts for o in outcomes), Counter[str]())
    false = [(o, text) for o in outcomes for text in o.false]
    for o, text in false:
        print(f"{o.kind}: {text}{o.scene}", file=sys.stderr)
    print("| counted | number |\n|---|---|")
    for name in ("systems", "refused"):
        print(f"| {name} | {total[name]} |")
    print(f"| **false statements** | {len(false)} |")
    for name in (
        *("equilibria told", "told as not proven", "true equilibria not told", "verdicts"),
        *("undecided", "these are all", "marked points told", "true marks not told"),
        *("parts of branches", "parts undecided"),
    ):
        print(f"| {name} | {total[name]} |")
    return int(bool(false))


if __name__ == "__main__":
    sys.exit(main())
