"""Systems that no shipped scene is like: hostile names, every function, large systems."""

from __future__ import annotations

import functools
import itertools
import re

import sympy as sp

from lagrange_cli import loads
from lagrange_cli.emit.languages.cpp import Cpp
from lagrange_cli.emit.languages.fortran import Fortran
from lagrange_cli.emit.languages.javascript import JavaScript
from lagrange_cli.emit.languages.octave import Octave
from lagrange_cli.emit.languages.rust import Rust
from tests.emit import emit_closures as closures
from tests.emit import emit_systems as systems
from tests.emit.test_c import HOSTILE, LARGE, ROWS, hostile
from tests.parts import changed
from tests.program.test_large_systems import tree
from tests.program.test_program import one_coordinate
from tests.systems.shipped import SCENES

#: Words that some language reserves.
RESERVED = sorted(
    frozenset().union(*(language.reserved for language in (Cpp, Fortran, JavaScript, Octave, Rust)))
)

#: Names that a language may take for others: in capitals, alike in their first letters, not ASCII.
ALIKE = ["theta", "Theta", "THETA", "w0", "W0", "long" * 20, "long" * 20 + "er", "θ", "x[1]", "x_1"]

COORDINATES = ["End", "if", "sin", "Out", "status", "do", "integrate", "data", "t_", "matrix"]


def words():
    """Every reserved word as a parameter, some as coordinates and outputs."""
    names = [name for name in [*ALIKE, *RESERVED] if name not in {*COORDINATES, "t", "print"}]
    parameters = [systems.parameter(n, 1 + k / 99, description=n) for k, n in enumerate(names)]
    coordinates = [systems.coordinate(n, description=HOSTILE) for n in COORDINATES]
    stiffness = sp.Add(*(p.symbol for p in parameters))
    potential = stiffness * sp.Add(*(c.q**4 for c in coordinates))
    kinetic = sp.Add(*((1 + c.q**2) * c.v**2 for c in coordinates)) / 2
    outputs = tuple((name, stiffness * c.v) for name, c in zip(names, coordinates, strict=False))
    system = systems.build(
        "module", parameters, coordinates, [], potential, kinetic=kinetic, title=HOSTILE
    )
    return changed(system, outputs=outputs)


def _resized(name, **sizes):
    """A shipped scene of another size."""
    text = SCENES[name].read_text(encoding="utf-8")
    for letter, size in sizes.items():
        text = re.sub(rf"(sizes: {{.*?\b{letter}): \d+", rf"\1: {size}", text)
    text = text[: text.index("\nexpect:")] + "\n" if "\nexpect:" in text else text
    return loads(text).derive().equations


def advancing():
    """Coupled pendulums whose stiffnesses advance, up and down: loops count them."""
    n = 24
    angles = [systems.coordinate(f"phi{k}") for k in range(n)]
    k, m = systems.parameter("k", 1.25), systems.parameter("m", 0.75)
    pairs = enumerate(itertools.pairwise(angles))
    potential = sum((n + 1 - i) * k.symbol * sp.cos(a.q - b.q) for i, (a, b) in pairs)
    potential += sum((i + 2) * k.symbol * sp.exp(a.q) for i, a in enumerate(angles))
    kinetic = sum((2 * i + 3) * m.symbol * a.v**2 for i, a in enumerate(angles)) / 2
    return systems.build("advancing", [k, m], angles, [], potential, kinetic=kinetic)


#: Cases that the suite leaves to campaigns, since others are of their kind.
MORE = ("closures", "chain", "springs")

#: Name → how its equations are made.
CASES = {
    "hostile": hostile,
    "words": words,
    "functions": lambda: one_coordinate(*ROWS.values()),
    "closures": lambda: closures.chain(8),
    "driven closure": closures.moving_circle,
    **LARGE,
    "band": functools.partial(_resized, "chain_of_rods", n=16),
    "springs": functools.partial(_resized, "net_of_springs", n=10),
    "tree": lambda: tree(40, 1),
    "advancing": advancing,
}


@functools.cache
def built(name):
    """The equations of a case, made once."""
    return CASES[name]()
