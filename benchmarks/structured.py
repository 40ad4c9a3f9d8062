"""Scenes that a grammar makes: parts that fit each other, each with a random content.

A scene is a base (particles by names, by expressions or by constraints, bodies on each other,
families, a bare kinetic energy) with sections that name what the base declares. Most are valid, so
that commands come to their work; a few have a part changed as in mutants.py. All is drawn from the
seed: the same number and seed make the same scene and command everywhere.
"""

from __future__ import annotations

import contextlib
import random
from collections.abc import Callable
from typing import Any

from mutants import FRAMES, NUMBERS, Command, Mutant, change, given_to

Tree = dict[str, Any]

#: Commands beside those of mutants.py, which name what a structured scene has.
COMMANDS: tuple[Command, ...] = (
    *((("derive",), 6.0), (("derive", "--forces"), 4.0), (("derive", "--steps"), 2.0)),
    *((("derive", "--form", form), 1.5) for form in ("explicit", "first-order", "hamiltonian")),
    *((("derive", "--form", form), 1.5) for form in ("routhian", "small-oscillations")),
    *((("derive", "--form", "multiplier", "--forces", "--json"), 1.5),),
    *((("derive", "--by", way, "--forces"), 1.0) for way in ("dalembert", "virtual-work")),
    *((("derive", "--format", form, "--steps"), 0.7) for form in ("latex", "markdown", "html")),
    *((("derive", "--sections", "sketch,account,result", "-o", "@out.tex"), 0.7),),
    *((("derive", "--format", "typst", "--language", "fr", "--written-out"), 0.7),),
    *((("derive", "--format", "latex", "--style", style), 0.5) for style in ("beamer", "exercise")),
    *((("emit", "--to", language, "-o", "@out"), 0.6) for language in ("c", "cpp", "rust")),
    *((("emit", "--to", language, "-o", "@out"), 0.6) for language in ("fortran", "javascript")),
    *((("emit", "--to", language, "-o", "@out"), 0.6) for language in ("octave", "markdown")),
    *((("emit", "--to", language, "-o", "@out"), 0.6) for language in ("python", "html", "svg")),
    *((("emit", "--to", language, "-o", "@out"), 0.6) for language in ("typst", "tikz", "latex")),
    *(
        (("emit", "--to", "c", "--main", "-o", "@out"), 0.6),
        (("emit", "--to", "fmu", "-o", "@out"), 0.1),
    ),
    *((("emit", "--to", "c", "--with", "jacobian,step", "-o", "@out"), 0.6),),
    *((("emit", "--to", "python", "--with", "linearization", "-o", "@out"), 0.6),),
    *((("analyze",), 2.0), (("analyze", "--steady"), 1.0), (("analyze", "--contacts"), 1.0)),
    *((("analyze", f"--{part}"), 1.5) for part in ("symmetries", "equilibria", "linearization")),
    *((("analyze", "--modes", "--animate", "@out.svg"), 0.7),),
    *((("analyze", "--modes", "--json", "--at", "@x=0.2"), 0.7),),
    *((("analyze", "--branches", "@p=0.5..0.6"), 0.4), (("analyze", "--along", "0.01"), 0.5)),
    *((("analyze", "--response", "1..2", "--plot", "@out.svg"), 0.5),),
    *((("analyze", "--lyapunov", "0.01"), 0.2), (("check",), 3.0), (("check", "--simulate"), 0.5)),
    *((("check", "--format", form), 0.5) for form in ("json", "sarif", "gitlab", "github")),
    *((("check", "--update", "--diff"), 0.7), (("fmt", "--diff"), 3.0), (("fmt",), 3.0)),
    *((("path", "--from", "@from", "--to", "@to", "--starts", "1", "-o", "@out.json"), 0.4),),
    *((("fit", "@data", "--free", "@p", "--accuracy", "1e-3"), 0.3),),
    *((("simulate", "--until", "0.01", "--samples", "3", "--budget", "2"), 0.7),),
    *((("simulate", "--until", "0.02", "--budget", "2", "--section", "@x=0.1"), 0.7),),
    *((("simulate", "--until", "0.01", "--with", "energy,momenta,conserved"), 0.4),),
    *((("tradeoff", "--until", "0.01", "--methods", "RK4,DOP853", "--repeat", "1"), 0.3),),
    *((("show", "--until", "0.01", "-o", "@out.html"), 0.4),),
)


class Grammar:
    """Draws a scene.

    Attributes
    ----------
    draw
        The source of all that is random.
    tree
        The scene as far as it is made.
    coordinates, parameters, places
        Names of coordinates, of parameters, and of particles and bodies on which forces act.
    rest
        Names of inputs and states.
    """

    def __init__(self, draw: random.Random) -> None:
        self.draw = draw
        self.tree: Tree = {}
        self.coordinates: list[str] = []
        self.parameters: list[str] = []
        self.places: list[str] = []
        self.rest: list[str] = []

    # Words.

    def may(self, part: float) -> bool:
        return self.draw.random() < part

    def number(self) -> str:
        """A number, one of ten a hostile one."""
        if self.may(0.05):
            return self.draw.choice(NUMBERS)
        return self.draw.choice(("1", "2", "0.5", "1/3", "3", "0.25", "1.5", "pi/4"))

    def parameter(self) -> str:
        return self.draw.choice(self.parameters) if self.may(0.8) else self.number()

    def atom(self, rates: bool) -> str:
        """A name or a number."""
        kind = self.draw.random()
        if kind < 0.45:
            return self.draw.choice(self.coordinates)
        if rates and kind < 0.65:
            return f"dot({self.draw.choice(self.coordinates)})"
        if kind < 0.75 and self.rest:
            return self.draw.choice(self.rest)
        return "t" if kind > 0.97 else self.parameter()

    def expression(self, depth: int = 2, rates: bool = False) -> str:
        """An expression in what is declared."""
        if depth == 0 or self.may(0.15):
            return self.atom(rates)
        left, right = (self.expression(depth - 1, rates) for _ in range(2))
        kind = self.draw.random()
        if kind < 0.3:
            return f"{left} {self.draw.choice('+-')} {right}"
        if kind < 0.6:
            return f"{self.factor(left)}*{self.factor(right)}"
        if kind < 0.7:
            return f"{self.factor(left)}^{self.draw.choice(('2', '2', '3', '4', '(-1)', '(1/2)'))}"
        if kind < 0.76:
            return f"{self.factor(left)}/(1 + {self.factor(right)}^2)"
        if kind < 0.92:
            return f"{self.draw.choice(('sin', 'cos', 'sin', 'cos', 'exp', 'tanh'))}({left})"
        if kind < 0.96:
            name = self.draw.choice(("abs", "sign", "heaviside", "sqrt", "log", "atan", "tan"))
            return f"{name}({left})"
        if kind < 0.98:
            return f"{self.draw.choice(('min', 'max', 'norm', 'atan2'))}({left}, {right})"
        return self.draw.choice(FRAMES).replace("@", self.factor(left))

    def factor(self, text: str) -> str:
        return f"({text})" if any(sign in text for sign in "+-*/ ^") else text

    # Bases.

    def base(self) -> None:
        """Masses and coordinates."""
        for name in ("m", "l", "k", "g", "c"):
            self.parameters.append(name)
        values: Tree = {"m": 1.5, "l": 0.7, "k": 3, "g": 9.81, "c": 0.2}
        for name in values:
            if self.may(0.15):
                values[name] = {"value": values[name], "positive": True}
            elif self.may(0.05):
                values[name] = {} if self.may(0.5) else self.number()
            elif self.may(0.05):
                values[name] = {"value": values[name], "latex": rf"\hat{{{name}}}", "unit": "kg"}
        self.tree["parameters"] = values
        self.draw.choice(BASES)(self)

    def free(self) -> None:
        """A particle by its Cartesian names, on a curve or not."""
        self.tree |= {"plane": "xz", "particles": {"b": {"mass": "m", "position": ["x", 0, "z"]}}}
        self.coordinates, self.places = ["x", "z"], ["b"]
        if self.may(0.5):
            self.tree["constraints"] = {"wire": f"z = {self.draw.choice(CURVES)}"}
            self.coordinates = ["x"]
        if self.may(0.7):
            self.tree["coordinates"] = list(self.coordinates)

    def polar(self) -> None:
        self.tree |= {
            "plane": "xy",
            "particles": {"b": {"mass": "m", "position": ["x", "y", 0]}},
            "definitions": {"x": "r*cos(phi)", "y": "r*sin(phi)"},
            "coordinates": {"r": {"positive": True} if self.may(0.5) else {}, "phi": {}},
        }
        self.coordinates, self.places = ["r", "phi"], ["b"]

    def pendulums(self) -> None:
        """Rods one below the other, by positions or by constraints."""
        number = self.draw.choice((1, 1, 2, 2, 3))
        names = [f"q{i}" for i in range(1, number + 1)]
        x = z = ""
        particles: Tree = {}
        for i, name in enumerate(names, 1):
            x, z = f"{x} + l*sin({name})".strip(" +"), f"{z} - l*cos({name})".strip()
            particles[f"b{i}"] = {"mass": "m", "position": [x, 0, z]}
        self.tree |= {"plane": "xz", "particles": particles, "coordinates": names}
        self.coordinates, self.places = names, list(particles)

    def rods(self) -> None:
        """A particle on a rod, in Cartesian names, the coordinate chosen or declared."""
        self.tree |= {
            "plane": "xz",
            "points": {"o": ["0" if self.may(0.7) else "sin(t)/10", 0, 0]},
            "particles": {"b": {"mass": "m", "position": ["x", 0, "z"]}},
            "constraints": {"rod": {"distance": ["o", "b"], "equals": "l"}},
            "near": {"x": "l/4", "z": "-l"},
        }
        if self.may(0.6):
            self.tree["coordinates"] = ["x"]
        self.coordinates, self.places = ["x"], ["b"]

    def bodies(self) -> None:
        """One or two bodies in a plane or in space."""
        planar, two = self.may(0.6), self.may(0.4)
        shape = self.draw.choice(({"rod": "l"}, {"disk": "l"}, {"sphere": "l"}, {"box": [1, 2, 1]}))
        turn: Any = "a" if planar else [{"z": "a"}, {"x": "b"}][: self.draw.choice((1, 2))]
        body = {"turn": turn, "mass": "m", "centre": [0, 0, "-l/2"], "inertia": shape}
        self.coordinates = ["a"] if planar else ["a", "b"][: len(turn)]
        if self.may(0.3):
            body["at"] = ["s", 0, 0]
            self.coordinates.insert(0, "s")
        self.tree |= {"bodies": {"A": body}} | ({"plane": "xz"} if planar else {})
        if two:
            joint = "d" if planar else {self.draw.choice("xyz"): "d"}
            lower = {"on": "A", "at": [0, 0, "-l"], "turn": joint, "mass": 1, "inertia": shape}
            self.tree["bodies"]["B"] = lower
            self.coordinates.append("d")
        self.tree["coordinates"] = list(self.coordinates)
        self.places = ["A"]

    def bare(self) -> None:
        """A kinetic energy without particles."""
        self.coordinates = ["x", "y"][: self.draw.choice((1, 2))]
        squares = [f"({self.draw.choice(INERTIAS)})*dot({q})^2/2" for q in self.coordinates]
        self.tree |= {"coordinates": list(self.coordinates), "kinetic": {"T": " + ".join(squares)}}

    def family(self) -> None:
        """A chain or a ring of equal masses."""
        end = {"q[0]": "q[n]"} if self.may(0.5) else {"q[0]": 0}
        stretch = self.draw.choice(("(q[i] - q[i-1])^2/2", "exp(q[i] - q[i-1])", "1 - cos(q[i])"))
        self.tree |= {
            "sizes": {"n": self.draw.choice((1, 2, 3, 5))},
            "coordinates": ["q[i=1..n]"],
            "definitions": end,
            "kinetic": {"T": "sum(m*dot(q[i])^2, i=1..n)/2"},
            "potentials": {"V": f"sum(k*({stretch}), i=1..n)"},
        }
        self.coordinates = ["q[1]"]
        self.tree["initial"] = {"q[i=2..n]": "i/10"}

    def rolling(self) -> None:
        """A wheel or a skate: constraints between velocities."""
        skate = self.may(0.5)
        rule = "dot(x)*sin(a) = dot(y)*cos(a)" if skate else "dot(x) = l*dot(a)"
        self.tree |= {
            "plane": "xy",
            "particles": {"b": {"mass": "m", "position": ["x", "y", 0]}},
            "kinetic": {"turn": "m*l^2*dot(a)^2/4"},
            "constraints": {"roll": rule} | ({} if skate else {"line": "y = x/2"}),
            "coordinates": ["x", "y", "a"] if skate else ["x", "a"],
        }
        self.coordinates, self.places = list(self.tree["coordinates"]), ["b"]

    # Sections.

    def into(self, section: str, name: str, entry: Any) -> None:
        self.tree.setdefault(section, {})[name] = entry

    def driven(self) -> None:
        """Inputs, states with rates and with two values, controllers."""
        q = self.coordinates[0]
        if self.may(0.3):
            self.into("inputs", "u", self.draw.choice(("0", "sin(t)", "heaviside(t - 1)", {})))
            self.rest.append("u")
            if self.may(0.3):
                self.tree["inputs"]["u"] = {}
                self.tree["controllers"] = {
                    "every": self.draw.choice(("0.01", "c", "1/7")),
                    "hold": {"u": self.expression(1, rates=True)},
                }
                if self.may(0.5):
                    self.tree["controllers"]["memory"] = {"e": f"e + {q}"}
                    self.into("initial", "e", 0)
        if self.may(0.2):
            self.into("states", "s1", f"{self.expression(1, rates=True)} - s1")
            self.into("initial", "s1", self.number())
            self.rest.append("s1")
        if self.may(0.07):
            self.into("states", "on1", {"on": f"{q} <= 0", "off": f"{q} >= 1"})
            self.into("initial", "on1", self.draw.choice((0, 1)))
            self.into("forces", "relay", {"on": q, "force": "on1*k"})

    def potentials(self) -> None:
        for number in range(self.draw.choice((0, 1, 1, 2))):
            self.into("potentials", f"V{number}", self.expression())
        if self.places and self.may(0.5):
            self.into("potentials", "weight", {"gravity": "g"})
        if self.places and self.may(0.2):
            self.into("points", "p", ["0", "0", "0" if self.may(0.8) else "sin(t)"])
            spring = {"spring": ["p", self.places[-1]], "stiffness": "k", "length": self.number()}
            self.into("potentials", "spring", spring)
        if self.may(0.07):
            q = self.draw.choice(self.coordinates)
            self.tree["functions"] = {"f": {"of": q, "equals": f"{q}^2"} if self.may(0.5) else q}
            self.into("potentials", "unknown", f"f({q})")

    def loads(self) -> None:
        for number in range(self.draw.choice((0, 0, 1, 2))):
            on: Any = self.draw.choice(self.coordinates)
            force: Any = self.expression(2, rates=True)
            if self.places and self.may(0.3):
                on, force = self.draw.choice(self.places), [self.expression(1), 0, "c"]
            self.into("forces", f"F{number}", {"on": on, "force": force})
        if self.may(0.2):
            on = self.draw.choice(self.places or self.coordinates)
            self.into("forces", "air", {"drag": "c", "on": on})
        if self.may(0.25):
            rate = f"dot({self.draw.choice(self.coordinates)})"
            self.into("dissipation", "D", self.draw.choice((f"c*{rate}^2/2", f"c*abs({rate})^3")))

    def contacts(self) -> None:
        if self.may(0.15):
            q = self.draw.choice(self.coordinates)
            gap = self.draw.choice((f"{q} >= -1", f"{q} <= 2", f"{q} >= -1 + sin(t)/10"))
            entry = {"unilateral": gap, "restitution": self.draw.choice(("0", "1/2", "1"))}
            self.into("constraints", "floor", gap if self.may(0.3) else entry)

    def results(self) -> None:
        """Outputs, the start, the simulation and what is expected."""
        if self.may(0.3):
            self.into("outputs", "o1", self.expression(2, rates=True))
        started = self.may(0.9) and "near" not in self.tree
        for q in self.coordinates:
            if started or self.may(0.1):
                self.into("initial", q, self.draw.choice(("0.3", "0", "0.1", "0.6", self.number())))
            if self.may(0.3):
                self.into("initial", f"dot({q})", self.number())
        if self.may(0.4):
            self.tree["simulate"] = {"until": "0.02", "accuracy": "1e-5", "samples": 3}
        for key, value in (
            ("dof", self.draw.choice((1, 2, 3))),
            ("conserved", self.draw.choice((["energy"], [], ["jacobi"]))),
            ("cyclic", [self.draw.choice(self.coordinates)]),
            ("equations", [f"ddot({self.coordinates[0]}) = {self.expression(1, rates=True)}"]),
            ("lagrangian", self.expression(2, rates=True)),
            ("equilibria", [{self.coordinates[0]: 0, "stability": "stable"}]),
            ("frequencies", ["sqrt(k/m)"]),
        ):
            if self.may(0.08):
                self.into("expect", key, value)

    def scene(self) -> Tree:
        self.base()
        for part in (self.driven, self.potentials, self.loads, self.contacts, self.results):
            part()
        return self.tree


CURVES = ("k*x^2/10", "cos(x)", "x", "l*cosh(x/l)", "x^4/4 - x^2/2", "k*x^2/10 + sin(t)", "exp(-x)")

INERTIAS = ("1", "m", "1 + x^2", "m*l^2", "2 + cos(x)", "exp(x)")

BASES: tuple[Callable[[Grammar], None], ...] = (
    *(Grammar.free, Grammar.polar, Grammar.pendulums, Grammar.rods, Grammar.bodies),
    *(Grammar.bare, Grammar.bare, Grammar.family, Grammar.rolling),
)


def structured(number: int, seed: int) -> Mutant:
    """The scene of a number with its command: the same one in every run of a seed."""
    draw = random.Random(f"structured {seed} {number}")
    grammar = Grammar(draw)
    tree = grammar.scene()
    if draw.random() < 0.1:
        with contextlib.suppress(IndexError, KeyError, TypeError, AttributeError):
            change(tree, draw)
    return given_to(number, tree, draw, COMMANDS)
