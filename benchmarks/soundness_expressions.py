"""Expressions drawn at random through their reader: values, places of refusals, seconds.

Sums, products and powers are compared with Python's own grammar in exact arithmetic. Others are
texts of the language with some characters changed, tokens in any order, bytes, and towers of
brackets, signs, powers and digits. All are read as an expression, as an equation or as the key of a
family, and one of twenty in a scene, as text of YAML. Each is understood, or refused at a place in
it. One that takes 20 seconds of a processor is ended and counted. All is drawn from the seed.

    python benchmarks/soundness_expressions.py --expressions 1000000 --seed 1 -j 2

With ``--guided N`` atheris (https://pypi.org/project/atheris) draws N texts that reach further
parts of the grammar.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import random
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from types import FrameType
from typing import Any

from lagrange_cli.errors import InputError, Mark
from lagrange_cli.scene import parse_equation, parse_expression
from lagrange_cli.scene.language.expression import Add, Mul, Name, Neg, Node, Number, Pow
from lagrange_cli.scene.language.grammar import parse_key
from lagrange_cli.scene.reader import read_text

#: Seconds of a processor that one text may take.
PATIENCE = 20

#: Largest power whose value is compared.
LARGEST_POWER = 1000

#: Values of names, with which texts are compared with Python's grammar.
VALUES = {"x": Fraction(3, 7), "y": Fraction(-5, 2), "z1": Fraction(11, 13)}

ATOMS = ("x", "y", "z1", "2", "0.5", "3e-1", ".25", "7.", "1E2", "10", "0")
OPERATORS = ("+", "-", "*", "/", " + ", " - ", " * ", "\t/ ")
POWERS = ("^2", "^3", "^-2", "**2", "^(1 + 1)", "^0", "**2^2")

#: Further texts of the language; ``@`` stands for one of :data:`ATOMS`.
PIECES = (
    *("sin(@)", "atan2(@, @)", "min(@, @, @)", "dot(@)", "ddot(@)", "norm(@, @)", "abs(@)"),
    *("sum(@*i, i=1..3)", "sum(sum(i*j, j=1..i), i=1..4)", "piecewise([@, @ < 1], @)", "pi*t"),
    *("x[1]", "x[i-1]", "x[i=1..n]", "omega_x(top)", "f'(@)", "sqrt(@)^(1/3)", "exp(-@^2)"),
)

#: Whatever may come between, the characters of pasted formulas among them.
TOKENS = (
    *ATOMS,
    *(
        "+",
        "-",
        "*",
        "/",
        "^",
        "**",
        "(",
        ")",
        "[",
        "]",
        ",",
        "=",
        "==",
        "<",
        ">",
        "<=",
        ">=",
        "..",
    ),
    *("sin", "dot", "sum", "piecewise", "omega_x", "min", "norm", "pi", "t", "i=1..n", "lambda_a"),
    *("1e400", "1e-401", "9" * 40, "0x1F", "1..2", ".", "e", "'", '"', "#", ":", "{", "}", "\\"),
    *("θ", "·", "²", "−", "½", "\u202e", "\u0301", "\ufeff", "\x00", "\x1b[2J", "\n", "\U0001d6fc"),
    *("__import__('os')", "lambda: 0", "$(id)", "%s", "{{x}}", "x.y", "x;y", "@", "!", "|", "&"),
)

#: What is put around a text, or before and behind it, again and again.
TOWERS = (
    ("(", ")"),
    ("-", ""),
    ("x^", ""),
    ("sin(", ")"),
    ("min(x, ", ")"),
    ("x[", "]"),
    ("", "9"),
)
TOWERS += (
    ("x+", ""),
    ("2^", ""),
    ("exp(", ")"),
    ("piecewise([x, x<", "], 1)"),
    ("sum(", ", i=1..9)"),
)

KINDS = ("arithmetic", "changed", "tokens", "bytes", "towers")

#: Scenes with a text in them, which stands for ``@`` as a quoted string.
SCENES = (
    "particles: {b: {mass: 1, position: [x, y, 0]}}\ncoordinates: [x, y]\npotentials: {v: @}\n",
    "particles: {b: {mass: @, position: [x, 0, 0]}}\ncoordinates: [x]\n",
    "particles: {b: {mass: 1, position: [x, y, 0]}}\nconstraints: {c: @}\n",
    "sizes: {n: 3}\nparticles: {@: {mass: 1, position: [0, 0, 0]}}\n",
    "parameters: {a: @}\nparticles: {b: {mass: a, position: [x, 0, 0]}}\nsimulate: {until: @}\n",
)

_NUMBER = re.compile(r"(?<![A-Za-z0-9_.])((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)")


# The texts.


def arithmetic(draw: random.Random, leaves: int) -> str:
    """Sums, products and powers of numbers and names, which Python reads as well."""
    if leaves <= 1:
        return draw.choice(ATOMS)
    kind = draw.random()
    if kind < 0.6:
        first = draw.randint(1, leaves - 1)
        left, right = arithmetic(draw, first), arithmetic(draw, leaves - first)
        return f"{left}{draw.choice(OPERATORS)}{right}"
    inner = arithmetic(draw, leaves - 1)
    if kind < 0.75:
        return f"( {inner} )"
    return f"-{inner}" if kind < 0.85 else f"{inner}{draw.choice(POWERS)}"


def written(draw: random.Random) -> str:
    """A text of the language, with functions, sums, pieces and indices."""
    parts = [re.sub("@", lambda _: draw.choice(ATOMS), draw.choice(PIECES)) for _ in range(3)]
    text = draw.choice(OPERATORS).join(parts[: draw.randint(1, 3)])
    relation = draw.choice(("", "", "", "", "", "", " = ", " >= "))
    return text + (relation and relation + arithmetic(draw, 3))


def changed(draw: random.Random) -> str:
    """A valid text with some characters left out, doubled, exchanged or put in."""
    text = written(draw) if draw.random() < 0.7 else arithmetic(draw, 8)
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        start = draw.randint(0, len(text))
        end = min(len(text), start + draw.randint(0, 4))
        put = draw.choice(
            ("", text[start:end] * 2, draw.choice(TOKENS), chr(draw.randint(0, 0x2FF)))
        )
        text = text[:start] + put + text[end:]
    return text


def tower(draw: random.Random) -> str:
    """Brackets, signs, powers or digits, up to and beyond every limit."""
    before, behind = draw.choice(TOWERS)
    height = draw.choice((3, 30, 90, 101, 400, 3000, 20_001))
    return before * height + draw.choice(ATOMS) + behind * draw.choice((height, height, height - 1))


def drawn(number: int, seed: int) -> tuple[str, str]:
    """The kind and the text of a number; the same everywhere."""
    draw = random.Random(f"{seed}/{number}")
    kind = draw.choices(KINDS, (3, 4, 2, 1, 0.02))[0]
    if kind == "arithmetic":
        return kind, arithmetic(draw, draw.randint(1, 12))
    if kind == "changed":
        return kind, changed(draw)
    if kind == "tokens":
        glue = draw.choice(("", " "))
        return kind, glue.join(draw.choices(TOKENS, k=draw.randint(0, 20)))
    if kind == "bytes":
        coding = draw.choice(("latin-1", "utf-8", "utf-16"))
        return kind, draw.randbytes(draw.randint(0, 40)).decode(coding, "replace")
    return kind, tower(draw)


# What becomes of them.


class LateError(BaseException):
    """A text has taken :data:`PATIENCE` seconds."""


def _late(number: int, frame: FrameType | None) -> None:
    raise LateError


class InexactError(ArithmeticError):
    """A value is no fraction, or there is none."""


def power(base: Fraction, exponent: Fraction) -> Fraction:
    if exponent.denominator != 1 or abs(exponent) > LARGEST_POWER or (not base and exponent < 0):
        raise InexactError
    return base ** int(exponent)


class Exact(Fraction):
    """A fraction whose operations are those of :func:`value_of`, for Python to evaluate."""

    def __add__(self, other: Fraction) -> Exact:
        return Exact(Fraction(self) + Fraction(other))

    def __sub__(self, other: Fraction) -> Exact:
        return Exact(Fraction(self) - Fraction(other))

    def __mul__(self, other: Fraction) -> Exact:
        return Exact(Fraction(self) * Fraction(other))

    def __truediv__(self, other: Fraction) -> Exact:
        return Exact(Fraction(self) / Fraction(other))

    def __neg__(self) -> Exact:
        return Exact(-Fraction(self))

    def __pow__(self, other: Fraction) -> Exact:
        return Exact(power(Fraction(self), Fraction(other)))


def python_value(text: str) -> Fraction:
    """The value that Python's grammar gives a text."""
    code = _NUMBER.sub(r"F('\1')", text.replace("^", "**"))
    names = {name: Exact(value) for name, value in VALUES.items()}
    return Fraction(eval(code, {"__builtins__": {}, "F": Exact}, names))


def value_of(node: Node) -> Fraction:
    """The value of a tree of sums, products and whole powers."""
    if isinstance(node, Number):
        return node.value
    if isinstance(node, Name):
        return VALUES[node.name]
    if isinstance(node, Neg):
        return -value_of(node.operand)
    if isinstance(node, Add):
        return sum((value_of(p) if s == "+" else -value_of(p) for s, p in node.terms), Fraction(0))
    if isinstance(node, Pow):
        return power(value_of(node.base), value_of(node.exponent))
    assert isinstance(node, Mul)
    product = Fraction(1)
    for sign, factor in node.factors:
        product = product * value_of(factor) if sign == "*" else product / value_of(factor)
    return product


def has_places(error: InputError) -> bool:
    """Whether each problem says where, in a file of a few lines."""
    marks = [problem.mark for problem in error.problems]
    return all(mark is not None and 1 <= mark.line <= 4 and mark.column >= 1 for mark in marks)


def refused(text: str, error: InputError) -> str:
    """What is wrong with a refusal, or ""."""
    lines = text.splitlines() or [""]
    for problem in error.problems:
        mark = problem.mark
        if mark is None or not problem.message:
            return f"no place: {problem.message}"
        beyond = mark.line < 1 or mark.line > len(lines) + 1
        length = max(map(len, lines)) if beyond or mark.line > len(lines) else len(text)
        if beyond or not 1 <= mark.column <= length + 2:
            return f"a place that is none, {mark.line}:{mark.column}: {problem.message}"
    return ""


def _parser(kind: str, number: int) -> Callable[[str, Mark], Any]:
    if number % 20 == 19:
        scene = SCENES[number // 20 % len(SCENES)]
        return lambda text, mark: read_text(scene.replace("@", json.dumps(text)), mark.file)
    parsers = (parse_key, parse_equation, parse_expression)
    return parse_expression if kind == "arithmetic" else parsers[min(number % 5, 2)]


def _read(kind: str, text: str, number: int) -> tuple[str, str]:
    """Read a text; return whether it is understood, and what is wrong."""
    parser = _parser(kind, number)
    try:
        result = parser(text, Mark("f", 1, 1, text))
    except InputError as error:
        # Of scenes that hold the text several times a place may be beyond it.
        return "refused", "" if number % 20 == 19 and has_places(error) else refused(text, error)
    if kind != "arithmetic" or number % 20 == 19:
        return "understood", ""
    try:
        wrong = value_of(result.node) != python_value(text)
    except ArithmeticError:
        return "understood", ""  # 1/0, or no fraction
    return "understood", "another value than in Python" if wrong else ""


def judged(kind: str, text: str, number: int) -> tuple[str, str]:
    """Read a text within its time; see :func:`_read`."""
    signal.signal(signal.SIGPROF, _late)
    signal.setitimer(signal.ITIMER_PROF, PATIENCE)
    try:
        return _read(kind, text, number)
    except LateError:
        return "ended", f"late: more than {PATIENCE} s"
    except Exception as error:
        return "raised", f"raised {type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


# The counts.


@dataclass
class Tally:
    """What is counted: kind and outcome, the longest time, and what is wrong."""

    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    longest: float = 0.0
    wrong: list[tuple[int, str, str]] = field(default_factory=list)

    def add(self, number: int, kind: str, text: str) -> None:
        started = time.process_time()
        outcome, problem = judged(kind, text, number)
        self.longest = max(self.longest, time.process_time() - started)
        self.counts[kind, outcome] += 1
        if problem:
            self.wrong.append((number, problem, text[:300]))

    def join(self, other: Tally) -> None:
        self.counts += other.counts
        self.longest = max(self.longest, other.longest)
        self.wrong += other.wrong


def _part(job: tuple[int, int, int]) -> Tally:
    first, behind, seed = job
    tally = Tally()
    for number in range(first, behind):
        tally.add(number, *drawn(number, seed))
    return tally


def tallies(count: int, first: int, seed: int, jobs: int) -> Iterator[Tally]:
    """The counts of parts of the texts, as they come."""
    size = 2000
    end = first + count
    work = [(start, min(start + size, end), seed) for start in range(first, end, size)]
    if jobs == 0:
        yield from map(_part, work)
        return
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        yield from pool.imap_unordered(_part, work)


def table(tally: Tally) -> str:
    """The counts as Markdown."""
    lines = [
        "| texts | number | understood | refused | raised | beyond 20 s | wrong place or value |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    kinds = list(dict.fromkeys(kind for kind in (*KINDS, *(k for k, _ in tally.counts))))
    for kind in [*kinds, "all"]:
        of_kind = Counter[str]()
        for (one, outcome), number in tally.counts.items():
            if kind in (one, "all"):
                of_kind[outcome] += number
        ends = [of_kind[end] for end in ("understood", "refused", "raised", "ended")]
        if sum(ends):
            lines.append(f"| {kind} | {sum(ends):,} | {' | '.join(f'{n:,}' for n in ends)} | |")
    others = sum(not p.startswith(("raised", "late")) for _, p, _ in tally.wrong)
    lines[-1] = lines[-1][:-2] + f" {others:,} |"
    return "\n".join([*lines, "", f"The longest took {tally.longest:.2f} s of a processor."])


#: Coverage is measured of what is imported under ``instrument_imports``.
_GUIDED = """\
import sys
import atheris
with atheris.instrument_imports(include=["lagrange_cli"]):
    import soundness_expressions as campaign
tally, runs = campaign.Tally(), int(sys.argv.pop())
def read(data):
    text = data[1:].decode("utf-8", "replace")
    tally.add(data[0] % 19 if data else 0, "guided", text)
    if tally.wrong or sum(tally.counts.values()) == runs:
        print(tally.wrong or campaign.table(tally), flush=True)
    assert not tally.wrong
atheris.Setup([*sys.argv, f"-runs={runs}", "-max_len=200", "-verbosity=0"], read)
atheris.Fuzz()
"""


def guided(count: int) -> int:
    """Let atheris draw texts, in a process that it ends."""
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path[1:]])
    return subprocess.run(
        [sys.executable, "-c", _GUIDED, str(count)],
        env={**os.environ, "PYTHONPATH": path},
        check=False,
    ).returncode


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--expressions", type=int, default=1_000_000)
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=2)
    parser.add_argument("--guided", type=int, metavar="N", help="texts that atheris draws")
    given = parser.parse_args()
    if given.guided is not None:
        return guided(given.guided)
    tally = Tally()
    for done in tallies(given.expressions, given.first, given.seed, given.jobs):
        tally.join(done)
        for number, problem, text in done.wrong:
            print(f"{number}: {problem}: {text!r}", file=sys.stderr)
    print(table(tally))
    return int(bool(tally.wrong))


if __name__ == "__main__":
    sys.exit(main())
