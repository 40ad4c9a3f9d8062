"""Facts and expectations against scenes whose truth is known by construction.

Scenes are made of terms with switching functions, narrow places, tiny coefficients and disguises.
The generator knows of every term on what it depends and whether it does work, and has its
value and slope from formulas of its own; the program sees its text. Counted are facts that are
stated and false, facts that are true and not stated, false expectations that pass, and true ones
that do not. What is stated is judged by numbers as well: at states far away, beside every
surface and within every narrow place, and along trajectories that SciPy integrates from the
generator's forces.
"""

from __future__ import annotations

import argparse
import multiprocessing
import random
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import mpmath as mp
import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp
from soundness_shapes import BOUNDED, CONSTANTS, JUMPS, SHAPES, Shape

from lagrange_cli.check.expectations import CHECKS
from lagrange_cli.errors import InputError, LagrangeError
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene import read_text
from lagrange_cli.scene.conditions import Expect
from lagrange_cli.scene.language.expression import Equation

DIGITS = 150
ZERO = mp.mpf(0)

#: One of so many scenes is judged along a trajectory too, of no more than so many evaluations.
EACH, EVALUATIONS = 4, 2500

#: Steps of a motion do not see what is narrower than this part of its time.
PER_WAY = 600

#: Scene sections of each frame and its coordinates; L and the left sides of its equations where
#: they are not those of free motion.
FRAMES = {
    "line": ("particles: {b: {mass: m, position: [x, 0, 0]}}", ("x",)),
    "plane": ("particles: {b: {mass: m, position: [x, y, 0]}}", ("x", "y")),
    "space": ("particles: {b: {mass: m, position: [x, y, z]}}", ("x", "y", "z")),
    "polar": (
        "particles: {b: {mass: m, position: [r*cos(h), r*sin(h), 0]}}",
        ("r", "h"),
    ),
    "pendulum": ("particles: {b: {mass: m, position: [2*sin(h), 0, -2*cos(h)]}}", ("h",)),
    "rotor": (
        "particles: {b: {mass: m, position: [x, 0, 0]}}\nkinetic: {spin: m/2*dot(p)^2}",
        ("x", "p"),
    ),
}
KINETIC = {
    "polar": "m/2*(dot(r)^2 + r^2*dot(h)^2)",
    "pendulum": "2*m*dot(h)^2",
}
LEFT = {
    ("polar", "r"): "m*ddot(r) - m*r*dot(h)^2",
    ("polar", "h"): "m*r^2*ddot(h) + 2*m*r*dot(r)*dot(h)",
    ("pendulum", "h"): "4*m*ddot(h)",
}


@dataclass(frozen=True)
class Term:
    """c·f(U) with U = Σ a·q + b·t − s, as a potential, a factor of inertia, a force or drag.

    Attributes
    ----------
    kind
        ``potential``; ``inertia``: m/2·c·f·dot(q)² of the coordinate ``on``; ``force`` on ``on``;
        ``drag``: c·f(dot(on)) in the dissipation function; ``gyroscopic``: forces
        c·f·dot(``to``) on ``on`` and the opposite, which do no work.
    weights
        a of each coordinate; ``t`` for b.
    """

    kind: str
    shape: Shape
    coefficient: str
    weights: dict[str, int]
    offset: str
    width: str
    on: str = ""
    to: str = ""

    @property
    def argument(self) -> str:
        if self.kind == "drag":
            return f"(dot({self.on}) - {self.offset})"
        parts = [f"{a}*{q}" for q, a in self.weights.items()]
        return f"({' + '.join(parts)} - {self.offset})"

    def _filled(self, text: str) -> str:
        return text.replace("W", self.width).replace("U", self.argument)

    @property
    def text(self) -> str:
        return f"{self.coefficient}*({self._filled(self.shape.text)})"

    @property
    def slope_text(self) -> str:
        return f"{self.coefficient}*({self._filled(self.shape.slope_text)})"

    def at(self, state: dict[str, mp.mpf]) -> tuple[mp.mpf, mp.mpf]:
        """f(U) and f'(U), with the coefficient."""
        c, w = mp.mpf(self.coefficient), mp.mpf(self.width)
        if self.kind == "drag":
            u = state[f"dot({self.on})"] - mp.mpf(self.offset)
        else:
            u = sum((a * state[q] for q, a in self.weights.items()), -mp.mpf(self.offset))
        return c * self.shape.value(u, w), c * self.shape.slope(u, w)

    @property
    def depends(self) -> set[str]:
        """Coordinates, and t, that L depends on by this term."""
        if self.kind not in ("potential", "inertia") or self.shape.constant:
            return set()
        return set(self.weights)

    @property
    def vanishes(self) -> bool:
        """It is zero everywhere."""
        return self.shape.name in ("both sides", "abs by max")


@dataclass
class Case:
    """A scene with its truth."""

    frame: str
    terms: list[Term]
    number: int = 0
    names: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        self.names = FRAMES[self.frame][1]

    def kinds(self, *kinds: str) -> list[Term]:
        return [t for t in self.terms if t.kind in kinds]

    # What is true.

    def cyclic(self) -> set[str]:
        held = set().union({"r"} if self.frame == "polar" else (), *(t.depends for t in self.terms))
        return set(self.names) - held

    def forced(self, name: str) -> bool:
        if any(name in (t.on, t.to) and not t.vanishes for t in self.kinds("gyroscopic")):
            return True
        drags = any(t.on == name and not t.shape.constant for t in self.kinds("drag"))
        return drags or self.pushed(name)

    def pushed(self, name: str) -> bool:
        """Whether forces on a coordinate do not vanish; constants may cancel each other."""
        forces = [t for t in self.kinds("force") if t.on == name and not t.vanishes]
        if any(not t.shape.constant for t in forces):
            return True
        with mp.workdps(DIGITS):
            somewhere = dict.fromkeys([*self.names, "t"], mp.mpf(1) / 3)
            return _is_nonzero([t.at(somewhere)[0] for t in forces])

    def conserved(self) -> set[str]:
        names = {f"p_{q}" for q in self.cyclic() if not self.forced(q) and not self._jumps(q)}
        held = set().union(*(t.depends for t in self.terms))
        works = any(map(self.pushed, self.names))
        works = works or any(not t.shape.constant for t in self.kinds("drag"))
        jumps = any(t.shape.jumps for t in self.kinds("potential", "inertia"))
        return names if "t" in held or works or jumps else {*names, "energy"}

    def _jumps(self, name: str) -> bool:
        return any(t.on == name and t.shape.jumps for t in self.kinds("inertia"))

    # What the program sees.

    def kinetic_texts(self) -> list[str]:
        return [f"m/2*({t.text})*dot({t.on})^2" for t in self.kinds("inertia")]

    def lagrangian(self) -> str:
        squares = KINETIC.get(self.frame) or " + ".join(f"m/2*dot({q})^2" for q in self.names)
        kinetic = "".join(f" + {k}" for k in self.kinetic_texts())
        return f"{squares}{kinetic}" + "".join(f" - ({t.text})" for t in self.kinds("potential"))

    def scene(self) -> str:
        sections = [FRAMES[self.frame][0]]
        kinetic = {f"k{n}": text for n, text in enumerate(self.kinetic_texts())}
        if kinetic and self.frame == "rotor":
            kinetic["spin"] = "m/2*dot(p)^2"
            sections[0] = sections[0].split("\n")[0]
        potentials = {f"v{n}": t.text for n, t in enumerate(self.kinds("potential"))}
        drags = {f"d{n}": t.text for n, t in enumerate(self.kinds("drag"))}
        for name, entries in (
            ("kinetic", kinetic),
            ("potentials", potentials),
            ("dissipation", drags),
        ):
            if entries:
                rows = (f'{key}: "{text}"' for key, text in entries.items())
                sections.append(f"{name}: {{{', '.join(rows)}}}")
        if forces := list(self.force_texts()):
            rows = (f'f{n}: {{on: {q}, force: "{f}"}}' for n, (q, f) in enumerate(forces))
            sections.append(f"forces: {{{', '.join(rows)}}}")
        start = ", ".join(f"{q}: {0.3 + 0.1 * k}" for k, q in enumerate(self.names))
        rates = ", ".join(f"dot({q}): {0.5 + 0.1 * k}" for k, q in enumerate(self.names))
        return (
            f"name: case\nparameters: {{m: 1.5}}\ncoordinates: [{', '.join(self.names)}]\n"
            + "\n".join(sections)
            + f"\ninitial: {{{start}, {rates}}}\n"
        )

    def force_texts(self) -> Iterator[tuple[str, str]]:
        for t in self.kinds("force"):
            yield t.on, t.text
        for t in self.kinds("gyroscopic"):
            yield t.on, f"({t.text})*dot({t.to})"
            yield t.to, f"-({t.text})*dot({t.on})"

    def equation(self, name: str) -> str:
        """The equation of motion of a coordinate, by the rules for each kind of term."""
        parts = [LEFT.get((self.frame, name), f"m*ddot({name})")]
        for t in self.kinds("potential"):
            if name in t.weights:
                parts.append(f"{t.weights[name]}*({t.slope_text})")
        for t in self.kinds("inertia"):
            rates = [f"{a}*{'1' if q == 't' else f'dot({q})'}" for q, a in t.weights.items()]
            if name == t.on:
                parts.append(f"m*({t.text})*ddot({name})")
                parts.append(f"m*({t.slope_text})*({' + '.join(rates)})*dot({name})")
            if name in t.weights:
                parts.append(f"-m/2*{t.weights[name]}*({t.slope_text})*dot({t.on})^2")
        parts += [f"-({text})" for on, text in self.force_texts() if on == name]
        parts += [t.slope_text for t in self.kinds("drag") if t.on == name]
        return " + ".join(f"({p})" for p in parts)

    # Numbers: L, its slopes, and generalized forces.

    def lagrangian_at(self, s: dict[str, mp.mpf]) -> mp.mpf:
        m = mp.mpf(3) / 2
        v = {q: s[f"dot({q})"] for q in self.names}
        if self.frame == "polar":
            total = m / 2 * (v["r"] ** 2 + s["r"] ** 2 * v["h"] ** 2)
        else:
            total = m / 2 * sum(x * x for x in v.values()) * (4 if self.frame == "pendulum" else 1)
        for t in self.kinds("inertia"):
            total += m / 2 * t.at(s)[0] * v[t.on] ** 2
        return total - sum((t.at(s)[0] for t in self.kinds("potential")), ZERO)

    def slope_at(self, s: dict[str, mp.mpf], name: str) -> mp.mpf:
        """∂L/∂q, or ∂L/∂t."""
        m = mp.mpf(3) / 2
        total = m * s["r"] * s["dot(h)"] ** 2 if (self.frame, name) == ("polar", "r") else ZERO
        for t in self.kinds("potential", "inertia"):
            a = t.weights.get(name, 0)
            weight = -1 if t.kind == "potential" else m / 2 * s[f"dot({t.on})"] ** 2
            total += weight * a * t.at(s)[1]
        return total

    def force_at(self, s: dict[str, mp.mpf], name: str) -> mp.mpf:
        """Generalized force."""
        total = sum((t.at(s)[0] for t in self.kinds("force") if t.on == name), ZERO)
        for t in self.kinds("gyroscopic"):
            if name == t.on:
                total += t.at(s)[0] * s[f"dot({t.to})"]
            if name == t.to:
                total -= t.at(s)[0] * s[f"dot({t.on})"]
        return total - sum((t.at(s)[1] for t in self.kinds("drag") if t.on == name), ZERO)


def generated(seed: int, number: int) -> Case:
    """A scene of one to four terms."""
    source = random.Random(f"{seed} {number}")
    case = Case(source.choice(list(FRAMES)), [], number)
    for _ in range(source.randint(1, 4)):
        case.terms.append(_term(source, case))
    return case


def _term(source: random.Random, case: Case) -> Term:
    kinds = ["potential"] * 5 + ["inertia", "force", "force", "drag"]
    kind = source.choice([*kinds, "gyroscopic"] if len(case.names) > 1 else kinds)
    names = source.sample([*case.names, "t"], 2)
    if source.random() < 0.7 or kind == "drag":
        names = [source.choice(case.names if source.random() < 0.85 else ["t"])]
    weights = {q: source.choice([1, 1, 1, -1, 2, 3]) for q in names}
    pool: Sequence[Shape] = SHAPES
    if kind == "inertia":
        pool = BOUNDED
    chance = source.random()
    if chance < 0.25:
        pool = CONSTANTS
    elif chance < 0.33 and kind in ("potential", "force"):
        pool = JUMPS
    on, to = source.sample(case.names, 2) if len(case.names) > 1 else (case.names[0], "")
    return Term(
        kind,
        source.choice([s for s in pool if not (kind == "inertia" and s.name == "half circle")]),
        source.choice(["1", "0.7", "3", "1e-6", "1e-9", "1e-30", "1e-60"]),
        weights,
        source.choice(["3", "5.9", "0.25", "100", "7.5"]),
        source.choice(["0.1", "1e-3", "1e-6", "1e-9"]),
        on,
        to if kind == "gyroscopic" else "",
    )


# Numbers that judge what is stated.


def states(case: Case, source: random.Random, number: int) -> Iterator[dict[str, mp.mpf]]:
    """States far away, and on both sides of every surface, within every narrow place."""

    def drawn(size: float) -> dict[str, mp.mpf]:
        names = [*case.names, "t", *(f"dot({q})" for q in case.names)]
        return {n: mp.mpf(source.uniform(-1, 1)) * mp.mpf(size) for n in names}

    for k in range(number):
        yield drawn(10.0 ** (k % 5 - 1))
    for t in case.terms:
        for away in (-2, -0.7, 0.3, 0.6, 1.5):
            state = drawn(3)
            near = mp.mpf(t.width) * away if t.shape.narrow else mp.mpf(away)
            if t.kind == "drag":
                state[f"dot({t.on})"] = mp.mpf(t.offset) + near
            else:
                name, a = next(iter(t.weights.items()))
                others = sum(b * state[q] for q, b in t.weights.items() if q != name)
                state[name] = (mp.mpf(t.offset) + near - others) / a
            yield state


def false_facts(case: Case, equations: Equations, source: random.Random) -> Iterator[str]:
    """Facts that are stated and that a state shows to be false."""
    conserved = {c.name for c in equations.derivation.conserved}
    tiny = mp.mpf(10) ** -100
    for s in states(case, source, 10):
        for name in equations.derivation.cyclic:
            other = next(iter(states(case, source, 1)))
            moved = {**s, name: other[name]}
            size = abs(case.lagrangian_at(s)) + 1
            if abs(case.lagrangian_at(moved) - case.lagrangian_at(s)) > tiny * size:
                yield f"cyclic {name}"
        for name in case.names:
            rate = case.slope_at(s, name), case.force_at(s, name)
            if f"p_{name}" in conserved and _is_nonzero(rate):
                yield f"p_{name}"
        work = [case.force_at(s, q) * s[f"dot({q})"] for q in case.names]
        if conserved & {"energy", "jacobi"} and _is_nonzero([*work, -case.slope_at(s, "t")]):
            yield "energy"


def _is_nonzero(parts: Sequence[mp.mpf]) -> bool:
    return bool(abs(sum(parts)) > mp.mpf(10) ** -100 * sum(map(abs, parts)))


def drifting(case: Case, equations: Equations) -> Iterator[str]:
    """Conserved quantities that change along a motion which crosses a surface."""
    if case.number % EACH or case.kinds("inertia") or not equations.derivation.conserved:
        return
    t0, span, y0 = _crossing(case)
    if any(t.shape.narrow and float(t.width) < span / PER_WAY for t in case.terms):
        return  # steps would go over it; states within it are looked at by false_facts
    np.seterr(all="ignore")  # motions that end in infinity are not judged
    left = iter(range(EVALUATIONS))

    def rates(t: float, y: np.ndarray) -> list[float]:
        next(left)
        return _rates(case, t, y)

    with mp.workdps(15), suppress(StopIteration):
        result = solve_ivp(
            rates,
            (t0, t0 + span),
            y0,
            method="DOP853",
            rtol=1e-9,
            atol=1e-12,
            max_step=span / 60,
            t_eval=np.linspace(t0, t0 + span, 9),
        )
        yield from _changed(equations, result.t, result.y)


def _changed(equations: Equations, times: np.ndarray, states: np.ndarray) -> Iterator[str]:
    n = len(equations.system.coordinates)
    if len(times) < 2 or not np.isfinite(states).all() or abs(states).max() > 1e6:
        return
    symbols = [
        equations.system.t,
        *(c.q for c in equations.system.coordinates),
        *(c.v for c in equations.system.coordinates),
    ]
    values = {p.symbol: sp.Rational(p.value) for p in equations.system.parameters}
    for quantity in equations.derivation.conserved:
        function = sp.lambdify(symbols, quantity.expression.subs(values), "mpmath")
        with mp.workdps(DIGITS):
            seen = [float(function(t, *y)) for t, y in zip(times, states.T, strict=True)]
        size = 1 + max(map(abs, seen)) + float(abs(states[n:]).max()) ** 2
        if max(seen) - min(seen) > 1e-5 * size:
            yield quantity.name


def _crossing(case: Case) -> tuple[float, float, list[float]]:
    """A start before a surface of a potential or force, a time after which it is passed."""
    term = next(iter(case.kinds("potential", "force", "gyroscopic")), None)
    positions = {q: 0.4 + 0.3 * k for k, q in enumerate(case.names)}
    rates = {q: 1.0 + 0.2 * k for k, q in enumerate(case.names)}
    if term is None or "t" in term.weights:
        return 0.0, 4.0, [*positions.values(), *rates.values()]
    width = float(term.width) if term.shape.narrow else 0.5
    name, a = next(iter(term.weights.items()))
    others = sum(b * positions[q] for q, b in term.weights.items() if q != name)
    positions[name] = (float(term.offset) - 3 * width - others) / a
    speed = sum(b * rates[q] for q, b in term.weights.items())
    if speed < 0.2:
        rates[name] = (1 - speed) / a + rates[name]
        speed = 1.0
    return 0.0, 8 * width / speed, [*positions.values(), *rates.values()]


def _rates(case: Case, t: float, y: np.ndarray) -> list[float]:
    n = len(case.names)
    s = {"t": mp.mpf(t)}
    s.update((q, mp.mpf(float(x))) for q, x in zip(case.names, y[:n], strict=True))
    s.update((f"dot({q})", mp.mpf(float(x))) for q, x in zip(case.names, y[n:], strict=True))
    force = {q: float(case.slope_at(s, q) + case.force_at(s, q)) / 1.5 for q in case.names}
    if case.frame == "polar":
        r, dr, dh = float(y[0]), float(y[2]), float(y[3])
        force["h"] = (force["h"] - 2 * r * dr * dh) / r**2
    if case.frame == "pendulum":
        force["h"] /= 4
    return [*map(float, y[n:]), *(force[q] for q in case.names)]


# Expectations.


@dataclass(frozen=True)
class Wanted:
    """An expectation: ``equation``, ``lagrangian``, ``cyclic`` or ``conserved``; its truth."""

    kind: str
    value: str | tuple[str, ...]
    true: bool
    why: str


def expectations(case: Case, source: random.Random) -> Iterator[Wanted]:
    """True expectations, and those that are off by one thing."""
    name = source.choice(case.names)
    factor = source.choice(["1", "-3", "m", f"(1 + {name}^2)", f"exp({name})", f"{name}"])
    true = case.equation(name)
    yield Wanted("equation", f"{factor}*({true})", True, f"times {factor}")
    yield Wanted("equation", f"max(0, {name} - 30)*({true})", False, "zero on a side")
    for k, term in enumerate(case.terms):
        for other, why in source.sample(list(variants(term, source)), 2):
            terms = [*case.terms[:k], *([other] if other else []), *case.terms[k + 1 :]]
            wrong = Case(case.frame, terms)
            if _acts(term, name):
                yield Wanted("equation", wrong.equation(name), False, why)
            if term.kind in ("potential", "inertia") and not _is_number(term):
                yield Wanted("lagrangian", wrong.lagrangian(), False, why)
    gauge = source.choice(
        ["0", f"{name}*dot({name})", f"dot({name})*cos({name})", f"2*t*{name} + t^2*dot({name})"]
    )
    yield Wanted("lagrangian", f"{case.lagrangian()} + {gauge}", True, f"with {gauge}")
    yield from _lists(case)


def variants(term: Term, source: random.Random) -> Iterator[tuple[Term | None, str]]:
    """A term dropped, with its sign changed, with a coefficient that is off, and shifted."""
    yield None, "dropped"
    yield replace(term, coefficient=f"(-{term.coefficient})"), "sign"
    off = source.choice(["1.000000000001", "0.999999999999"])
    yield replace(term, coefficient=f"{off}*{term.coefficient}"), "coefficient"
    if not term.shape.constant:
        yield replace(term, offset=f"{term.offset}*(1 + 1e-9)"), "shifted"


def _is_number(term: Term) -> bool:
    """What it adds to L is a number, or depends on t alone, which no equation shows."""
    alone = term.shape.constant or set(term.weights) == {"t"}
    return (alone and term.kind == "potential") or term.vanishes


def _acts(term: Term, name: str) -> bool:
    """Whether the equation of a coordinate holds a term."""
    if term.vanishes:
        return False
    if term.kind == "potential":
        return name in term.depends and not term.shape.jumps
    if term.kind == "inertia":
        # A constant one is no more than a factor where the equation has no other term.
        return not term.shape.constant and name in {term.on, *term.depends}
    if term.kind == "drag":
        return name == term.on and not term.shape.constant
    return name in (term.on, term.to)


def _lists(case: Case) -> Iterator[Wanted]:
    cyclic, conserved = case.cyclic(), case.conserved()
    yield Wanted("cyclic", tuple(sorted(cyclic)), True, "as it is")
    for name in case.names:
        yield Wanted("cyclic", tuple(sorted(cyclic ^ {name})), False, f"{name} wrong")
    yield Wanted("conserved", tuple(sorted(conserved)), True, "as it is")
    if conserved:
        yield Wanted("conserved", (), False, "none")
    for name in {"energy", *(f"p_{q}" for q in case.names)} - conserved:
        yield Wanted("conserved", (name,), False, f"{name} wrong")


def passes(wanted: Wanted, parsed: Equation | None, equations: Equations) -> bool:
    """Whether ``check`` would pass an expectation."""
    expect = Expect()
    if wanted.kind == "equation" and parsed is not None:
        expect = replace(expect, equations=(parsed,))
        return not list(CHECKS["equations"](expect, equations))
    if wanted.kind == "lagrangian" and parsed is not None:
        expect = replace(expect, lagrangian=parsed.left)
        return not list(CHECKS["lagrangian"](expect, equations))
    expect = replace(expect, **{wanted.kind: wanted.value})
    return not list(CHECKS[wanted.kind](expect, equations))


# The campaign.


def judged(seed: int, number: int) -> tuple[Counter[str], list[str]]:
    """What one scene adds to the counts, and lines about what is not as it should be."""
    case, source = generated(seed, number), random.Random(f"{seed} {number} judge")
    counts, lines = Counter({"scenes": 1}), []
    try:
        equations = derive(read_text(case.scene()))
    except LagrangeError as error:
        what = "refused" if isinstance(error, InputError) else "internal errors"
        return Counter({what: 1}), [f"{number} {what}: {error.problems[0].message}"]

    def note(what: str, text: str) -> None:
        counts[what] += 1
        lines.append(f"{number} {what}: {text}")

    stated = {f"cyclic {n}" for n in equations.derivation.cyclic} | {
        c.name for c in equations.derivation.conserved
    }
    true = {f"cyclic {n}" for n in case.cyclic()} | case.conserved()
    counts["facts stated"] += len(stated)
    with mp.workdps(DIGITS):
        wrong = (stated - true) | set(false_facts(case, equations, source))
    for fact in sorted(wrong | set(drifting(case, equations))):
        note("facts stated and false", fact)
    for fact in sorted(true - stated):
        note("facts true and not stated", fact)
    wanted = list(expectations(case, source))
    parsed = _parsed(case, wanted)
    for k, one in enumerate(wanted):
        counts["true expectations" if one.true else "false expectations"] += 1
        if passes(one, parsed.get(k), equations) != one.true:
            what = "true expectations failed" if one.true else "false expectations passed"
            note(what, f"{one.kind} {one.why}: {one.value}")
    return counts, lines


def _parsed(case: Case, wanted: Sequence[Wanted]) -> dict[int, Equation]:
    """Equations, and Lagrangians as left sides, by their places in the list."""
    places = [k for k, one in enumerate(wanted) if isinstance(one.value, str)]
    rows = "".join(f'\n    - "{wanted[k].value} = 0"' for k in places)
    scene = read_text(f"{case.scene()}expect:\n  equations:{rows}\n")
    return dict(zip(places, scene.expect.equations or (), strict=True))


def _one(job: tuple[int, int]) -> tuple[Counter[str], list[str]]:
    return judged(*job)


ROWS = (
    *(
        "scenes",
        "refused",
        "internal errors",
        "facts stated",
        "facts stated and false",
        "facts true and not stated",
    ),
    *("false expectations", "false expectations passed"),
    *("true expectations", "true expectations failed"),
)


#: Rows that must count nothing.
NONE = ("internal errors", "facts stated and false", "false expectations passed")


def campaign(scenes: int, seed: int, jobs: int = 1) -> tuple[Counter[str], list[str]]:
    """Counts over all scenes, and what is not as it should be."""
    counts: Counter[str] = Counter()
    lines: list[str] = []
    work = [(seed, n) for n in range(scenes)]
    with multiprocessing.Pool(jobs) if jobs > 1 else _Inline() as pool:
        for found, notes in pool.imap_unordered(_one, work, 20):
            counts += found
            lines += notes
    return counts, sorted(lines)


class _Inline:
    """As a pool, in this process."""

    def __enter__(self) -> _Inline:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def imap_unordered(
        self, function: object, jobs: Sequence[tuple[int, int]], chunk: int
    ) -> Iterator[tuple[Counter[str], list[str]]]:
        return map(_one, jobs)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=1)
    parser.add_argument("--lines", action="store_true", help="what is not as it should be")
    options = parser.parse_args()
    started = time.perf_counter()
    counts, lines = campaign(options.scenes, options.seed, options.jobs)
    seconds = time.perf_counter() - started
    print("| counted | number |\n|---|---|")
    for row in ROWS:
        print(f"| {row} | {counts[row]} |")
    print(f"\n{options.scenes} scenes, seed {options.seed}, {seconds:.0f} s")
    if options.lines:
        print("\n".join(lines))
    return int(any(counts[row] for row in NONE))


if __name__ == "__main__":
    sys.exit(main())
