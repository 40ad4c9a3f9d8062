"""Scenes changed at random: their YAML, numbers, expressions, names and sections.

All is drawn from the seed: the same number and seed make the same mutant everywhere.
"""

from __future__ import annotations

import contextlib
import json
import random
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import yaml

ROOT = Path(__file__).parents[1]

Command: TypeAlias = "tuple[tuple[str, ...], float]"
"""Words of the command line, and how often it is drawn."""

NUMBERS = (
    *("0", "-0", "0.0", "1", "-1", "2", "3", "1/2", "1/3", "0.1", "pi", "1e-3", "1e6"),
    *("1e308", "-1e308", "1.7976931348623157e308", "1e309", "1e400", "-1e400", "1e401", "1e-308"),
    *("4.9e-324", "1e-324", "1e-400", "1e150", "1e-150", "1e16", "9007199254740993", "2^62"),
    *("123456789012345678901234567890", "1" * 200, "9" * 900, "1e100 + 1", "10^300", "2^1000"),
    "1000000007*998244353",
    "(10^57 + 7)*(10^57 + 9)",
    "0.1234567890123456789012345678901234567890",
    *("100", "101", "1e5", "1000000", "n", "t", "true", ".inf", ".nan", "0x1F", "1e-17"),
)

FUNCTIONS = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh"),
    *("atanh", "exp", "log", "sqrt", "abs", "sign", "dot", "ddot"),
)

#: Values of coordinates at the ends of paths.
ENDS = ("0", "0.1", "-0.2", "0.5", "1", "pi/2")

#: What an expression is put into; ``@`` stands for it.
FRAMES = (
    *("min(@, 1/2)", "max(@, 0)", "max(@, t, 1)", "abs(@)", "sign(@)", "norm(@, 1)", "norm(@)"),
    *("(@)^2", "(@)^(1/3)", "(@)^100", "(@)^101", "(@)^(-50)", "(@)^(@)", "2^(@)", "(@)^0.123"),
    *("exp(@)", "exp(exp(@))", "exp(exp(exp(exp(exp(exp(@))))))", "exp(-(@)^2/1e-18)"),
    *("sqrt(@)", "sqrt((@)^2)", "sqrt(1 - (@)^2)", "1/(@)", "1/(1 + (@)^2)", "log(@)", "-(@)"),
    *("atan2(@, 1)", "atan2(@, @)", "acosh(@)", "asin(@)", "tan(@)", "tanh(1e9*(@))"),
    *("sin(1e300*(@))", "(@)*1e-150", "(@) + 1e300", "dot(@)", "sum(sqrt(i), i=1..40)*(@)"),
    *("sum((@)^i, i=1..12)", "((@) + 1)^20", "((@) + x + 1)^60", "(@)*x*y*z", "(@) - (@)"),
    *("(@)*(1000003*999983)^(1/2)", "(@)*(10^40 + 1)^(1/7)", "(((@)^2)^3)^4", "@@", "(@", "@)"),
    *("sin(cos(sin(cos(sin(cos(@))))))", "max(min(@, 1), -1)", "sign(@)*abs(@)^(3/2)", "@ + t"),
)

#: Formats of documents.
DOCUMENTS = ("latex", "markdown", "typst", "html")

#: Commands with their options; the scene stands after the first word. ``@x`` and ``@p`` stand for
#: a coordinate and a parameter that are drawn, ``@from`` and ``@to`` for ends of paths, and other
#: words that begin with ``@`` for files, ``@data`` for measurements.
COMMANDS: tuple[Command, ...] = (
    *((("derive",), 4.0), (("derive", "--forces"), 4.0), (("derive", "--form", "explicit"), 2.0)),
    *((("derive", "--form", "multiplier"), 2.0), (("derive", "--format", "latex"), 1.0)),
    *((("derive", "--json", "--forces"), 1.0), (("derive", "--ascii"), 0.5)),
    *((("derive", "--digits", "60"), 0.5), (("derive", "--strict"), 0.3)),
    *((("derive", "--form", "first-order"), 1.0), (("derive", "--form", "routhian"), 1.0)),
    *((("derive", "--form", "hamiltonian", "--bracket", "p_@x, @x^2"), 1.0),),
    *((("derive", "--form", "small-oscillations", "--json"), 1.0), (("derive", "--steps"), 1.0)),
    *((("derive", "--by", way, "--forces"), 1.0) for way in ("dalembert", "virtual-work")),
    *((("derive", "--form", "routhian", "--format", "latex", "--plot", "@out.svg"), 0.5),),
    *((("derive", "--steps", "--format", form, "--language", "de"), 0.5) for form in DOCUMENTS),
    *((("emit", "--to", "c", "-o", "@out"), 2.0), (("emit", "--to", "python", "-o", "@out"), 2.0)),
    *((("emit", "--to", "latex", "-o", "@out"), 1.0), (("check",), 3.0)),
    *((("emit", "--to", language, "-o", "@out"), 0.5) for language in ("typst", "tikz", "svg")),
    *((("analyze",), 4.0), (("analyze", "--steady"), 1.5), (("analyze", "--modes", "--json"), 1.0)),
    *((("analyze", f"--{part}"), 1.0) for part in ("symmetries", "equilibria", "contacts")),
    *((("analyze", "--linearization", "--at", "@x=0.3", "-o", "@out.npz"), 1.0),),
    *((("analyze", "--branches", "@p=0..2", "--plot", "@out.svg", "--loci", "@loci.svg"), 1.5),),
    *((("analyze", "--lyapunov", "0.1"), 0.5), (("analyze", "--along", "0.1"), 0.7)),
    *((("analyze", "--response", "0.1..10", "--plot", "@out.svg"), 1.0),),
    *((("analyze", "--format", form, "--language", "fr"), 0.5) for form in DOCUMENTS),
    *((("path", "--from", "@from", "--to", "@to", "--starts", "4", "-o", "@out.json"), 4.0),),
    *((("fit", "@data", "--free", names, "--accuracy", "1e-6"), 2.0) for names in ("@p", "@p,@x")),
    (("simulate", "--until", "0.01", "--samples", "3", "--budget", "5"), 0.7),
    (("simulate", "--until", "0.01", "--samples", "3", "--budget", "5", "--with", "forces"), 0.2),
    (("simulate", "--until", "2", "--budget", "5", "--section", "@x=0.1, dot(@x)>0"), 4.0),
)

_NUMBER = re.compile(r"(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?![\w.])")
_FUNCTION = re.compile(r"\b(" + "|".join(FUNCTIONS) + r"|min|max|norm|atan2)\(")
_NAME = re.compile(r"\b[A-Za-z_]\w*\b")
_FAMILY = re.compile(r"\[\w+ *= *1 *\.\. *\w+\]$")
_PLACEHOLDER = re.compile(r"@(?:x|p|from|to)(?!\w)")


def texts_in(node: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of the scalars of a tree."""
    if isinstance(node, dict):
        for key, value in node.items():
            yield from texts_in(value, (*path, key))
    elif isinstance(node, list):
        for number, value in enumerate(node):
            yield from texts_in(value, (*path, number))
    else:
        yield path


def branches_in(node: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all parts of a tree but the root."""
    entries = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in entries:
        yield (*path, key)
        if isinstance(value, (dict, list)):
            yield from branches_in(value, (*path, key))


def at(tree: Any, path: Sequence[Any]) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def put(tree: Any, path: Sequence[Any], value: Any) -> None:
    at(tree, path[:-1])[path[-1]] = value


#: Sections whose texts are words and not expressions.
_WORDS = ("name", "title", "description", "unit", "latex", "method", "formulation", "kind")


def _expression_paths(tree: Any) -> list[tuple[Any, ...]]:
    return [p for p in texts_in(tree) if p and not any(key in _WORDS for key in p)]


def change_number(tree: Any, draw: random.Random) -> None:
    """Another number where one stands, also within an expression."""
    paths = [p for p in _expression_paths(tree) if _NUMBER.search(str(at(tree, p)))]
    if not paths:
        return
    path = draw.choice(paths)
    text = str(at(tree, path))
    match = draw.choice(list(_NUMBER.finditer(text)))
    new = draw.choice(NUMBERS)
    if match.span() != (0, len(text)):
        new = f"({new})"
    put(tree, path, text[: match.start()] + new + text[match.end() :])


def frame_expression(tree: Any, draw: random.Random) -> None:
    """An expression, or a name or a number in it, within a function or an operation."""
    paths = _expression_paths(tree)
    path = draw.choice(paths)
    text = str(at(tree, path))
    inner = list(_NAME.finditer(text)) + list(_NUMBER.finditer(text))
    frame = draw.choice(FRAMES)
    if inner and draw.random() < 0.6:
        match = draw.choice(inner)
        framed = f"({frame.replace('@', match.group())})"
        put(tree, path, text[: match.start()] + framed + text[match.end() :])
    elif "=" in text:
        left, sign, right = text.rpartition("=")
        put(tree, path, f"{left}{sign} {frame.replace('@', right.strip())}")
    else:
        put(tree, path, frame.replace("@", text))


def exchange_function(tree: Any, draw: random.Random) -> None:
    paths = [p for p in _expression_paths(tree) if _FUNCTION.search(str(at(tree, p)))]
    if not paths:
        return
    path = draw.choice(paths)
    text = str(at(tree, path))
    match = draw.choice(list(_FUNCTION.finditer(text)))
    new = draw.choice(FUNCTIONS)
    put(tree, path, text[: match.start(1)] + new + text[match.end(1) :])


def exchange_name(tree: Any, draw: random.Random) -> None:
    """A name that stands somewhere in the place of another one."""
    texts = [str(at(tree, p)) for p in _expression_paths(tree)]
    names = sorted({name for text in texts for name in _NAME.findall(text)}) or ["x"]
    paths = [p for p in _expression_paths(tree) if _NAME.search(str(at(tree, p)))]
    if not paths:
        return
    path = draw.choice(paths)
    text = str(at(tree, path))
    match = draw.choice(list(_NAME.finditer(text)))
    put(tree, path, text[: match.start()] + draw.choice(names) + text[match.end() :])


def drop(tree: Any, draw: random.Random) -> None:
    path = draw.choice(list(branches_in(tree)))
    parent = at(tree, path[:-1])
    if len(path) > 1 or draw.random() < 0.5:
        del parent[path[-1]]


def graft(tree: Any, draw: random.Random) -> None:
    """A part of the tree in the place of another one."""
    paths = list(branches_in(tree))
    source, target = draw.choice(paths), draw.choice(paths)
    put(tree, target, json.loads(json.dumps(at(tree, source), default=str)))


def duplicate(tree: Any, draw: random.Random) -> None:
    """An entry once more, under another name."""
    paths = [p for p in branches_in(tree) if isinstance(p[-1], str)]
    if not paths:
        return
    path = draw.choice(paths)
    parent = at(tree, path[:-1])
    parent[f"{path[-1]}_2"] = json.loads(json.dumps(parent[path[-1]], default=str))


#: Sections and entries that are added.
ADDED: tuple[tuple[str, Any], ...] = (
    ("kinetic", {"extra": "min(x, 1/2)"}),
    ("kinetic", {"extra": "dot(x)^2/2"}),
    ("potentials", {"kink": "max(0, x - 3)^2"}),
    ("potentials", {"pull": {"gravity": "9.81", "direction": ["1", "0", "x"]}}),
    ("dissipation", {"drag": "abs(dot(x))^3"}),
    ("outputs", {"o": "ddot(x)*sign(x)"}),
    ("constraints", {"gap": {"unilateral": "z >= 0", "restitution": "1/2"}}),
    ("constraints", {"slide": "dot(x) = t*y"}),
    ("initial", {"dot(x)": "1e-300"}),
    ("simulate", {"until": "1", "samples": "1e150"}),
    ("simulate", {"until": "-1"}),
    ("simulate", {"until": "1e308", "step": "1e-308"}),
    ("sizes", {"n": "4"}),
    ("coordinates", ["x[i=1..4]"]),
    ("expect", {"state": {"t": "0.01", "x": "0.3", "within": "1"}}),
    ("expect", {"equations": {"m": "ddot(x) = max(0, x)"}}),
    ("expect", {"lagrangian": "abs(dot(x)) - x", "conserved": ["energy"]}),
)


def add(tree: Any, draw: random.Random) -> None:
    section, entry = draw.choice(ADDED)
    known = tree.get(section)
    if isinstance(known, dict) and isinstance(entry, dict):
        known.update(entry)
    else:
        tree[section] = json.loads(json.dumps(entry))


CHANGES: tuple[tuple[Callable[[Any, random.Random], None], float], ...] = (
    (frame_expression, 6.0),
    (change_number, 4.0),
    (exchange_function, 1.5),
    (exchange_name, 1.0),
    (drop, 0.7),
    (graft, 0.5),
    (duplicate, 0.4),
    (add, 1.0),
)


def _text(tree: Any, draw: random.Random) -> str:
    """The YAML of a tree, now and then with some of its characters changed."""
    text = yaml.safe_dump(tree, sort_keys=False, allow_unicode=True)
    if draw.random() < 0.03:
        start = draw.randrange(len(text))
        new = "".join(draw.choices("xyz01 :,[]{}()*^-=#&'\"\n", k=draw.randrange(4)))
        text = text[:start] + new + text[start + draw.randrange(8) :]
    return text


#: Small scenes from which grammar mutations reach the mathematics more often.
SEEDS = (
    """
name: plane
parameters: {g: 9.81, l: 0.5, k: 2}
plane: xz
particles: {b: {mass: 1, position: [x, 0, z]}}
coordinates: [x, z]
points: {o: [0, 0, 0]}
potentials: {v: k*x^2/2, c: {spring: [o, b], stiffness: 3, length: l}}
forces: {f: {on: x, force: -k*dot(x)}}
initial: {x: 0.3, z: 0.2, dot(x): 0.1, dot(z): -0.2}
simulate: {until: 0.01, accuracy: 1e-5, samples: 3}
""",
    """
name: rolling
parameters: {m: 1, R: 0.5, g: 9.81}
particles: {b: {mass: m, position: [s, 0, z]}}
coordinates: [s, z, th]
kinetic: {turn: m*R^2*dot(th)^2/4}
constraints: {r: dot(s) = R*dot(th), gap: {unilateral: z >= 0, restitution: 1/2}}
potentials: {w: {gravity: g}}
initial: {s: 0, z: 1, dot(th): 1}
simulate: {until: 0.01, accuracy: 1e-5, samples: 3}
""",
    """
name: rods
parameters: {l: 1, g: 9.81}
plane: xz
particles: {a: {mass: 1}, b: {mass: 2}}
points: {o: [0, 0, 0]}
constraints:
  u: {distance: [o, a], equals: l}
  v: {distance: [a, b], equals: l*(1 + sin(t)/10)}
coordinates: [p, q]
definitions: {x_a: l*sin(p), z_a: -l*cos(p), x_b: x_a + l*(1 + sin(t)/10)*sin(q)}
near: {z_b: -1.5}
potentials: {w: {gravity: g}}
initial: {p: 0.5, q: 0.3}
""",
    """
name: bare
coordinates: [x, y]
kinetic: {k: dot(x)^2/2 + (1 + x^2)*dot(y)^2/2}
inputs: {u: sin(t)}
potentials: {v: exp(-x^2) + log(1 + y^2) - u*x, w: 2*x^2}
dissipation: {d: dot(x)^2/2}
outputs: {o: x + u}
initial: {x: 0.3, y: 0.2, dot(x): 0.1}
simulate: {until: 0.01, accuracy: 1e-5, samples: 3}
expect: {dof: 2, equations: {a: ddot(x) = x*dot(y)^2 + 2*x*exp(-x^2) - dot(x) + u - 4*x}}
""",
    """
name: ring
sizes: {n: 3}
coordinates: ["q[i=1..n]"]
definitions: {"q[0]": "q[n]"}
kinetic: {k: "sum(dot(q[i])^2, i=1..n)/2"}
potentials: {v: "sum(exp(q[i] - q[i-1]), i=1..n)"}
initial: {"q[i=1..n]": sin(i)}
simulate: {until: 0.01, accuracy: 1e-5, samples: 3}
""",
)

#: Larger scenes take longer than what is asked for here.
_LARGEST = 2_500


def sources() -> list[Any]:
    """The trees that are changed: shipped scenes that are small, and those above, more often."""
    trees = []
    for path in sorted((ROOT / "systems").rglob("*.yaml")):
        text = path.read_text(encoding="utf-8")
        if len(text) <= _LARGEST and "recorded" not in text:
            trees.append(yaml.safe_load(text))
    small = [yaml.safe_load(text) for text in SEEDS]
    return trees + small * (4 * len(trees) // len(small))


@dataclass(frozen=True)
class Mutant:
    """A scene's text, the words of the command that it is given to, and measurements of it."""

    number: int
    words: tuple[str, ...]
    text: str
    measured: str = ""


def mutant(
    number: int, seed: int, trees: Sequence[Any], commands: Sequence[Command] = COMMANDS
) -> Mutant:
    """The mutant of a number: the same one in every run of a seed."""
    draw = random.Random(f"{seed} {number}")
    # YAML 1.1 reads the key ``on`` as true.
    tree = json.loads(json.dumps(draw.choice(trees), default=str).replace('"true":', '"on":'))
    for _ in range(draw.choice((0, 1, 1, 1, 1, 2, 2, 3))):
        # A tree may have lost what a change looks for.
        with contextlib.suppress(IndexError, KeyError, TypeError, AttributeError):
            change(tree, draw)
    return given_to(number, tree, draw, commands)


def change(tree: Any, draw: random.Random) -> None:
    """Change a tree in one of the ways of :data:`CHANGES`."""
    changes, weights = zip(*CHANGES, strict=True)
    (chosen,) = draw.choices(changes, weights)
    chosen(tree, draw)


def given_to(
    number: int, tree: Any, draw: random.Random, commands: Sequence[Command] = COMMANDS
) -> Mutant:
    """The scene of a tree with one of the commands, its names filled in."""
    words, weights = zip(*commands, strict=True)
    (chosen,) = draw.choices(words, weights)
    if chosen[0] not in ("check", "fmt") and draw.random() < 0.1:
        chosen += ("-p", f"@p={draw.choice(NUMBERS)}")
    text, meaning = _text(tree, draw), _placeholders(tree, draw)
    filled = [_PLACEHOLDER.sub(lambda match: meaning[match.group()], word) for word in chosen]
    measured = f"t,{meaning['@x']}\n0,0.3\n0.1,0.31\n0.2,0.29\n0.3,\n0.4,0.35\n"
    return Mutant(number, tuple(filled), text, measured)


def _names(tree: Any, section: str, known: Sequence[str]) -> list[str]:
    """Names that a section declares, families written out for three members."""
    declared = tree.get(section) if isinstance(tree, dict) else None
    words = [str(word) for word in declared] if isinstance(declared, (list, dict)) else []
    members = [_FAMILY.sub(f"[{i}]", word) for word in words for i in (1, 2, 3)]
    return list(dict.fromkeys(members)) or list(known)


def _placeholders(tree: Any, draw: random.Random) -> dict[str, str]:
    """The words of a command that name what the scene declares."""
    coordinates = _names(tree, "coordinates", "x")
    values = NUMBERS if draw.random() < 0.1 else ENDS
    ends = [", ".join(f"{x}={draw.choice(values)}" for x in coordinates) for _ in range(2)]
    return {
        "@x": draw.choice(coordinates),
        "@p": draw.choice(_names(tree, "parameters", "g")),
        "@from": f"{ends[0]}, t=0",
        "@to": f"{ends[1]}, t=0.5",
    }
