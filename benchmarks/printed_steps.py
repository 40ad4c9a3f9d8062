"""A judge of printed steps: it reads the text back and derives each line from those above it.

It knows nothing of the derivation but its text in plain ASCII, the masses, coordinates and
functions of the scene. Labels such as ``d(L)/d(dot(r))`` say what a line claims to be; the judge
differentiates the lines that were printed before, and compares in 40 digits at random values of
all letters. A line that it cannot read counts as unread, which is a failure as well.
"""

from __future__ import annotations

import random
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import mpmath
import sympy as sp

#: Digits of the comparison, values of the letters that are tried, and the largest difference.
DIGITS, TRIALS, LARGEST = 40, 3, mpmath.mpf("1e-25")

_FUNCTIONS = {name: getattr(sp, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")}
_FUNCTIONS |= {name: getattr(sp, name) for name in ("asin", "acos", "atan", "atan2", "exp", "log")}
_FUNCTIONS |= {"sqrt": sp.sqrt, "abs": sp.Abs, "sign": sp.sign, "min": sp.Min, "max": sp.Max}
_FUNCTIONS |= {"ln": sp.log, "asinh": sp.asinh, "acosh": sp.acosh, "atanh": sp.atanh}
_FUNCTIONS |= {"heaviside": lambda x: sp.Heaviside(x, sp.Rational(1, 2))}

_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_NAME = re.compile(r"[A-Za-z_]\w*(?:\[[^\]]*\])?'*")
_INSIDE = r"((?:[^()]|\([^()]*\))*)"
_PARTIAL = re.compile(rf"d\({_INSIDE}\)/d\({_INSIDE}\)")
_RATE = re.compile(r"(d?dot|delta)\(([^()]*)\)")


class UnreadError(Exception):
    """A text that is no formula of the kinds that steps have."""


def symbol(name: str) -> sp.Symbol:
    return sp.Symbol(name)


class _Parser:
    """Reads one formula in the scene language, with partial derivatives as letters."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0

    def whole(self) -> sp.Expr:
        value = self.sum()
        if self.at != len(self.text):
            raise UnreadError(self.text)
        return value

    def takes(self, token: str) -> bool:
        while self.text.startswith(" ", self.at):
            self.at += 1
        if self.text.startswith(token, self.at):
            self.at += len(token)
            return True
        return False

    def match(self, pattern: re.Pattern[str]) -> re.Match[str] | None:
        while self.text.startswith(" ", self.at):
            self.at += 1
        found = pattern.match(self.text, self.at)
        self.at = found.end() if found else self.at
        return found

    def sum(self) -> sp.Expr:
        terms = [-self.product() if self.takes("-") else self.product()]
        while True:
            if self.takes("+"):
                terms.append(self.product())
            elif self.takes("-"):
                terms.append(-self.product())
            else:
                return sp.Add(*terms)

    def product(self) -> sp.Expr:
        value = self.power()
        while True:
            if self.takes("*"):
                value = value * self.power()
            elif self.takes("/"):
                value = value / self.power()
            else:
                return value

    def power(self) -> sp.Expr:
        if self.takes("-"):
            return -self.power()
        base = self.primary()
        return base ** self.power() if self.takes("^") else base

    def primary(self) -> sp.Expr:
        if self.takes("("):
            value = self.sum()
            self._close()
            return value
        number = self.match(_NUMBER)
        if number:
            return sp.Rational(number[0])
        named = self.match(_PARTIAL) or self.match(_RATE)
        if named:
            return symbol(named[0])
        name = self.match(_NAME)
        if name is None:
            raise UnreadError(self.text)
        if not self.takes("("):
            return sp.pi if name[0] == "pi" else symbol(name[0])
        arguments = [self.sum()]
        while self.takes(","):
            arguments.append(self.sum())
        self._close()
        stem = name[0].rstrip("'")
        if stem in _FUNCTIONS:
            return _FUNCTIONS[stem](*arguments)
        # A function of the scene without an expression: any smooth one will do.
        x = sp.Dummy()
        body = sp.sin((1 + sp.Rational(len(stem), 7)) * x + 1) * sp.exp(x / 3)
        return sp.diff(body, x, len(name[0]) - len(stem)).subs(x, arguments[0])

    def _close(self) -> None:
        if not self.takes(")"):
            raise UnreadError(self.text)


def parsed(text: str) -> sp.Expr:
    """The formula that a text is."""
    return _Parser(text.strip()).whole()


def equal(first: sp.Expr, second: sp.Expr) -> bool:
    """Whether two expressions agree at random values of their letters, complex ones included."""
    difference = first - second
    if difference == 0:
        return True
    letters = sorted(first.free_symbols | second.free_symbols, key=str)
    value = sp.lambdify(letters, [first, second], "mpmath")
    rng = random.Random(7)
    with mpmath.workdps(DIGITS):
        for _ in range(TRIALS):
            point = [mpmath.mpf(rng.randrange(10**9, 4 * 10**9)) / 10**9 for _ in letters]
            one, other = (mpmath.mpmathify(x) for x in value(*point))
            if not abs(one - other) <= LARGEST * (1 + abs(one) + abs(other)):
                return False
    return True


@dataclass(frozen=True)
class Line:
    """One printed line: where it stands, its label, and what is said to equal it."""

    section: str
    title: str
    label: str
    chain: tuple[str, ...]
    words: bool = False


def lines_of(text: str) -> Iterator[Line]:
    """The lines of a derivation, which was printed in one column without an end."""
    section = title = ""
    for row in text.splitlines():
        if not row.strip():
            continue
        if not row.startswith(" "):
            section, title = row.split("   ")[0], ""
            continue
        body = row.strip()
        if not row.startswith("    ") and section not in ("Abbreviations", "Constraint forces"):
            title = body
            yield Line(section, title, "", (body,), words=True)
            continue
        label, *chain = body.split(" = ")
        yield Line(section, title, label, tuple(chain))


_ZERO = sp.S.Zero


@dataclass
class Judge:
    """Derives each line from the ones before it.

    Attributes
    ----------
    coordinates, masses
        Names of the coordinates; the mass of each particle's Cartesian names, as text.
    wrong, unread
        Lines that do not follow, and those that cannot be read.
    checked
        Number of formulas that follow.
    """

    coordinates: Sequence[str]
    masses: Mapping[str, str]
    wrong: list[str] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)
    checked: int = 0

    def __post_init__(self) -> None:
        #: Cartesian name → position, velocity, acceleration, applied force.
        self.places: dict[str, sp.Expr] = {}
        self.rates: dict[str, sp.Expr] = {}
        self.bent: dict[str, sp.Expr] = {}
        self.force: dict[str, sp.Expr] = {}
        #: Label → L, D and constraints; other letters, such as abbreviations and terms.
        self.functions: dict[str, sp.Expr] = {}
        self.letters: dict[str, sp.Expr] = {}
        #: Coordinate → generalized forces, parts of its equation, the equation.
        self.loads: dict[str, list[sp.Expr]] = {}
        self.parts: dict[str, dict[str, sp.Expr]] = {}
        self.residuals: dict[str, sp.Expr] = {}
        self.partials: set[tuple[str, str]] = set()
        self.energies: dict[str, sp.Expr] = {}
        self.whole = self.drag = self.now = ""
        self.factor: tuple[int, str] | None = None
        self.multipliers: dict[str, tuple[str, int]] = {}

    def read(self, text: str) -> Judge:
        """Judge all lines of a text."""
        lines = list(lines_of(text))
        for line in lines:
            if line.section == "Abbreviations":
                self.letters[line.label] = parsed(line.chain[0])
        for line in lines:
            judge = _SECTIONS.get(line.section)
            if judge is None:
                continue
            try:
                judge(self, line)
            except (UnreadError, KeyError, TypeError, RecursionError) as error:
                shown = " = ".join([line.label, *line.chain])
                self.unread.append(f"{line.section}, {line.title} {shown}: {error!r}")
        return self

    # -- values ----------------------------------------------------------------------

    def value(self, text: str) -> sp.Expr:
        """A formula over coordinates, their rates, parameters and multipliers."""
        return self.resolved(parsed(text))

    def resolved(self, value: sp.Expr) -> sp.Expr:
        own = set(self.coordinates)
        known = {symbol(n): e for n, e in self.letters.items()}
        known |= {symbol(n): e for n, e in self.force.items()}
        known |= {symbol(n): e for n, e in self.places.items() if n not in own}
        known |= {symbol(f"dot({n})"): e for n, e in self.rates.items() if n not in own}
        known |= {symbol(f"ddot({n})"): e for n, e in self.bent.items() if n not in own}
        while True:
            present = {s: known[s] for s in value.free_symbols & known.keys()}
            present |= {s: self.partial(s.name) for s in value.free_symbols if "/d(" in s.name}
            if not present:
                return value
            value = value.xreplace(present)

    def partial(self, name: str) -> sp.Expr:
        """∂A/∂b of a label ``d(A)/d(b)``."""
        found = _PARTIAL.fullmatch(name)
        assert found is not None
        above = self.functions.get(found[1])
        return sp.diff(
            self.resolved(symbol(found[1]) if above is None else above), symbol(found[2])
        )

    def along(self, expression: sp.Expr) -> sp.Expr:
        """The rate of an expression along any motion."""
        rate = sp.diff(expression, symbol("t"))
        for c in self.coordinates:
            q, v, a = (symbol(text) for text in (c, f"dot({c})", f"ddot({c})"))
            rate += sp.diff(expression, q) * v + sp.diff(expression, v) * a
        return rate

    def require(self, line: Line, expected: sp.Expr | None, chain: Sequence[str] = ()) -> sp.Expr:
        """Require that all members of a chain are as expected; the last one is returned.

        ``expected``: None if the line defines what its label is.
        """
        chain = chain or line.chain
        last = self.value(chain[-1])
        if expected is None:
            expected = last
        for printed in chain:
            if equal(self.value(printed), expected):
                self.checked += 1
            else:
                shown = " = ".join([line.label, *line.chain])
                self.wrong.append(f"{line.section}, {line.title} {shown}")
        return last

    # -- kinematics --------------------------------------------------------------------

    def positions(self, line: Line) -> None:
        if not line.words:
            self.places[line.label] = self.require(line, None)

    def velocities(self, line: Line) -> None:
        if line.words or "r_i" in line.label:
            return
        found = _PARTIAL.fullmatch(line.label)
        if found:
            self.partials.add((found[1], found[2]))
            self.require(line, self.partial(line.label))
            return
        name = line.label.removeprefix("dot(").removesuffix(")")
        for by in (*self.coordinates, "t"):
            slope = sp.diff(self.places[name], symbol(by))
            if (name, by) not in self.partials and not equal(slope, _ZERO):
                self.wrong.append(f"d({name})/d({by}) is not written and does not vanish")
        self.rates[name] = self.require(line, self.along(self.places[name]))

    def accelerations(self, line: Line) -> None:
        if not line.words:
            name = line.label.removeprefix("ddot(").removesuffix(")")
            self.bent[name] = self.require(line, self.along(self.rates[name]))

    def displacements(self, line: Line) -> None:
        if line.words or "r_i" in line.label:
            return
        place = self.places[line.label.removeprefix("delta(").removesuffix(")")]
        moved = [sp.diff(place, symbol(c)) * symbol(f"delta({c})") for c in self.coordinates]
        self.require(line, sp.Add(*moved))

    # -- energies ------------------------------------------------------------------------

    def kinetic(self, line: Line) -> None:
        if line.label.startswith("dot("):
            self.require(line, self.value(line.label))
        else:
            self.energies["T"] = self.letters_of(line)

    def potential(self, line: Line) -> None:
        total = sp.Add(*(self.letters[n] for n in self.parts.get("V", {})))
        is_sum = bool(self.parts.get("V")) and equal(total, self.value(line.chain[-1]))
        self.energies["V"] = self.letters_of(line)
        if is_sum and len(self.parts["V"]) > 1:
            return
        self.parts.setdefault("V", {})[line.label] = self.energies["V"]

    def letters_of(self, line: Line) -> sp.Expr:
        """Take a line as the definition of its label."""
        value = self.require(line, None)
        self.letters[line.label] = value
        return value

    def lagrangian(self, line: Line) -> None:
        if line.words:
            return
        self.whole = line.label
        self.functions[line.label] = self.require(line, self.energies["T"] - self.energies["V"])

    def dissipation(self, line: Line) -> None:
        self.drag = line.label
        self.functions[line.label] = self.require(line, None)

    def generalized(self, line: Line) -> None:
        if line.words or "sum_" in " ".join(line.chain) or line.label == "Q_j":
            return
        if not line.label.startswith("Q_"):
            self.force[line.label] = self.require(line, None)
            return
        name = line.label.removeprefix("Q_")
        if line.title == "Together:":
            self.require(line, sp.Add(*self.loads[name]))
        else:
            self.loads.setdefault(name, []).append(self.require(line, None))

    def constraints(self, line: Line) -> None:
        if line.words:
            return
        found = _PARTIAL.fullmatch(line.label)
        if found:
            self.require(line, self.partial(line.label))
            order = int(found[2].startswith("dot("))
            known = self.multipliers.get(found[1], ("", 0))[1]
            self.multipliers[found[1]] = (_multiplier(found[1]), max(order, known))
        else:
            self.functions[line.label] = self.require(line, None)
            self.multipliers[line.label] = (_multiplier(line.label), 0)

    def pushes(self, name: str) -> sp.Expr:
        """Σ λ ∂φ/∂q of a coordinate."""
        return sp.Add(
            *(
                symbol(multiplier)
                * sp.diff(self.functions[gap], symbol(f"dot({name})" if order else name))
                for gap, (multiplier, order) in self.multipliers.items()
            )
        )

    # -- equations --------------------------------------------------------------------------

    def lagrange(self, line: Line) -> None:
        if line.words:
            found = re.fullmatch(r"For (.*):", line.title)
            if found:
                self.now = found[1]
                self.parts[self.now] = {}
            self.factor = _factor(line.title)
            return
        if "q_j" in line.label:
            return
        q, v = self.now, f"dot({self.now})"
        parts, whole = self.parts[q], self.whole
        slopes = {f"d({whole})/d({v})": "p", f"d({whole})/d({q})": "slope"}
        if self.drag:
            slopes[f"d({self.drag})/d({v})"] = "drag"
        if line.label in slopes:
            parts[slopes[line.label]] = self.require(line, self.partial(line.label))
        elif line.label == f"d/dt d({whole})/d({v})":
            parts["rate"] = self.require(line, self.along(parts["p"]))
        else:
            self.equation(line, self.lagranges(parts) - self.others(q))

    def lagranges(self, parts: Mapping[str, sp.Expr]) -> sp.Expr:
        return parts["rate"] - parts["slope"] + parts.get("drag", _ZERO)

    def others(self, q: str) -> sp.Expr:
        return sp.Add(*self.loads.get(q, ())) + self.pushes(q)

    def equation(self, line: Line, residual: sp.Expr) -> None:
        """``residual = 0``, or the same divided by a factor or multiplied."""
        if line.chain != ("0",):
            raise UnreadError(line.label)
        if self.factor is not None:
            residual = self.residuals[self.now] * self.value(self.factor[1]) ** self.factor[0]
        value = self.require(line, residual, (line.label,))
        self.residuals.setdefault(self.now, value)

    def applied(self, line: Line) -> None:
        if not line.words:
            self.force[line.label] = self.require(line, None)

    def dalembert(self, line: Line) -> None:
        if line.words:
            found = re.fullmatch(r"For delta\((.*)\):", line.title)
            if found:
                self.now = found[1]
                self.parts[self.now] = {}
            self.factor = _factor(line.title)
            return
        if "r_i" in line.label and f"d(r_i)/d({self.now})" not in line.label:
            return
        parts = self.parts[self.now]
        if line.label.startswith("sum_i"):
            kind = "inertia" if "ddot" in line.label else "work"
            parts[kind] = self.require(line, self.moved(kind))
        elif line.chain == ("0",):
            residual = parts.get("inertia", _ZERO) - parts.get("work", _ZERO)
            self.equation(line, residual + parts.get("alone", _ZERO) - self.pushes(self.now))
        else:
            parts["alone"] = self.require(line, None)

    def moved(self, kind: str) -> sp.Expr:
        """Σ m r̈·∂r/∂q, or Σ F·∂r/∂q."""
        if kind == "work":
            along = {label.partition("_")[2]: force for label, force in self.force.items()}
        else:
            along = {name: parsed(mass) * self.bend(name) for name, mass in self.masses.items()}
        places = {name: self.places.get(name, symbol(name)) for name in along}
        return sp.Add(*(along[n] * sp.diff(places[n], symbol(self.now)) for n in along))

    def bend(self, name: str) -> sp.Expr:
        """The acceleration of a Cartesian name."""
        place = self.places.get(name, symbol(name))
        return self.bent[name] if name in self.bent else self.along(self.along(place))

    def virtual_work(self, line: Line) -> None:
        """Q of each coordinate at rest, and what vanishes with it."""
        if line.words:
            found = re.fullmatch(r"For delta\((.*)\):", line.title)
            if found:
                self.now, self.parts[found[1]] = found[1], {}
            return
        if "_j" in line.label or "delta(" in line.label:
            return
        parts = self.parts[self.now]
        chain = [e for e in line.chain if not e.startswith("sum_i")]
        if line.chain == ("0",):
            balance = parts["work"] - parts.get("inertia", _ZERO) - parts.get("alone", _ZERO)
            self.require(line, self.rest(balance + self.pushes(self.now)), (line.label,))
        elif line.label.startswith("sum_i") and "ddot" in line.label:
            parts["inertia"] = self.require(line, self.rest(self.moved("inertia")))
        elif line.label == f"Q_{self.now}":
            formulas = chain[:-1] if len(chain) > 1 and chain[-1] == "0" else chain
            parts["work"] = self.require(line, self.rest(self.moved("work")), formulas)
        else:
            parts["alone"] = self.require(line, None)

    def rest(self, expression: sp.Expr) -> sp.Expr:
        """An expression at rest."""
        rates = (symbol(f"{d}({c})") for c in self.coordinates for d in ("dot", "ddot"))
        return expression.xreplace(dict.fromkeys(rates, _ZERO))

    def comparison(self, line: Line) -> None:
        if line.words or "q_j" in line.label:
            return
        if len(self.energies) < 2:
            self.energies["V" if self.energies else "T"] = self.letters_of(line)
        else:
            self.lagrangian(line)

    def newton(self, line: Line) -> None:
        if line.words or "r_i" in line.label:
            return
        if line.label.startswith("F_"):
            known = self.force.get(line.label)
            self.force[line.label] = self.require(line, known)
            return
        bent = {symbol(f"ddot({n})"): self.along(self.rates[n]) for n in self.rates}
        self.require(line, self.resolved(parsed(line.label).xreplace(bent)))

    # -- what is conserved ----------------------------------------------------------------

    def conclusions(self, line: Line) -> None:
        if line.words:
            self.claims(line.title)
            return
        whole = self.functions[self.whole]
        if line.label.startswith("d/dt "):
            self.changing(line)
        elif "sum_j" in line.chain[0]:
            speeds = [symbol(f"dot({c})") for c in self.coordinates]
            energy = sp.Add(*(v * sp.diff(whole, v) for v in speeds)) - whole
            self.energies["E"] = self.require(line, energy, line.chain[1:])
        elif line.label.startswith("sum_j"):
            speeds = [symbol(f"dot({c})") for c in self.coordinates]
            energy = sp.Add(*(v * sp.diff(whole, v) for v in speeds)) - whole
            self.energies["E"] = self.require(line, energy)
        else:
            self.require(line, self.value(line.chain[0]))

    def changing(self, line: Line) -> None:
        """dE/dt, by the equations of motion: λ φ̇ vanishes where φ does all along."""
        lacking = [self.residuals[c] * symbol(f"dot({c})") for c in self.coordinates]
        rate = self.along(self.energies["E"]) - sp.Add(*lacking)
        for gap, (name, order) in self.multipliers.items():
            drift = self.functions[gap] if order else self.along(self.functions[gap])
            push = symbol(name)
            if equal(sp.diff(rate - self.value(line.chain[-1]), push), drift):
                rate -= push * drift
        self.require(line, rate)

    def claims(self, words: str) -> None:
        """Derivatives that sentences call zero, and an energy that is T + V."""
        whole = self.functions[self.whole]
        zeros = [self.partial(m[0]) for m in re.finditer(rf"{_PARTIAL.pattern}(?= = 0)", words)]
        if "it is T + V" in words:
            zeros.append(self.energies["E"] - self.energies["T"] - self.energies["V"])
        if "depends on every coordinate" in words:
            for c in self.coordinates:
                if equal(sp.diff(whole, symbol(c)), _ZERO):
                    self.wrong.append(f"{c}: {words}")
        for zero in zeros:
            if equal(zero, _ZERO):
                self.checked += 1
            else:
                self.wrong.append(words)


def _multiplier(gap: str) -> str:
    return f"lambda_{gap.partition('_')[2]}"


def _factor(words: str) -> tuple[int, str] | None:
    """A factor that an equation is divided by or multiplied with."""
    found = re.fullmatch(r"and, (divided|multiplied) by (.*),", words)
    return (1 if found[1] == "multiplied" else -1, found[2]) if found else None


_SECTIONS = {
    "Positions": Judge.positions,
    "Velocities": Judge.velocities,
    "Accelerations": Judge.accelerations,
    "Virtual displacements": Judge.displacements,
    "Kinetic energy": Judge.kinetic,
    "Lagrangian without potential": Judge.kinetic,
    "Potential energy": Judge.potential,
    "Generalized potential": Judge.potential,
    "Lagrangian": Judge.lagrangian,
    "Dissipation function": Judge.dissipation,
    "Generalized forces": Judge.generalized,
    "Constraints with multipliers": Judge.constraints,
    "Lagrange's equations": Judge.lagrange,
    "Applied forces": Judge.applied,
    "d'Alembert's principle": Judge.dalembert,
    "Principle of virtual work": Judge.virtual_work,
    "The same by Lagrange's equations": Judge.comparison,
    "Newton's equations": Judge.newton,
    "Cyclic coordinates, momenta and energy": Judge.conclusions,
}
