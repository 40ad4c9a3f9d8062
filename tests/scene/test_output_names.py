"""The section outputs: what may stand there, and names that it may take."""

from __future__ import annotations

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.scene import read_text

SCENE = """
parameters: {m: 1, l: 2}
particles:
  bob: {mass: m, position: [x, y, z]}
constraints: {plane: y = 0}
coordinates: [theta]
definitions: {x: l*sin(theta), z: -l*cos(theta), E: m*dot(theta)^2}
outputs:
  OUTPUT
"""


def read(output):
    return read_text(SCENE.replace("OUTPUT", output))


def test_outputs_are_terms_in_the_order_of_the_file():
    outputs = read("b: E + abs(x)\n  a: t*dot(z)").outputs
    assert [(term.name, term.expression.text) for term in outputs] == [
        ("b", "E + abs(x)"),
        ("a", "t*dot(z)"),
    ]


def test_a_family_is_its_members():
    outputs = read("a[i=1..3]: i*theta").outputs
    assert [term.name for term in outputs] == ["a[1]", "a[2]", "a[3]"]


@pytest.mark.parametrize(
    ("output", "message", "column"),
    [
        ("a: thta + 1", "unknown name 'thta' in output 'a'", 6),
        ("a: ddot(theta)", "ddot(...) cannot stand in output 'a'", 6),
        ("a: theta = 1", "expected an expression, found an equation", 12),
        ("a: [theta]", "expected an expression for output 'a'", 6),
        ("theta: 1", "'theta' is an output and also a coordinate", 3),
        ("l: 1", "'l' is an output and also a parameter", 3),
        ("E: 1", "'E' is an output and also a definition", 3),
        ("x: 1", "'x' is an output and also a definition", 3),
        ("y: 1", "'y' stands in a position and is also an output", 32),
        ("z_bob: 1", "'z_bob' is already the z position of 'bob'", 3),
        ("theta_: 1", "'theta_' prints like 'theta'", 3),
        ("sin: 1", "'sin' is reserved", 3),
        ("t: 1", "'t' is reserved", 3),
        ("2a: 1", "expected a name in 'outputs', found '2a'", 3),
        ("a: b\n  b: 1", "unknown name 'b' in output 'a'", 6),
        ("a: 1\n  a: 2", "'a' is given twice", 3),
    ],
)
def test_refusals_are_located(output, message, column):
    with pytest.raises(InputError) as refused:
        read(output)
    (problem,) = refused.value.problems
    assert message in problem.message
    assert problem.mark is not None
    assert problem.mark.column == column
