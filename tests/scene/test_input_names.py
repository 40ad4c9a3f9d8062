"""The section inputs: what may stand there, and where inputs may stand."""

from __future__ import annotations

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.scene import read_text

SCENE = """
parameters: {m: 1, k: 2, A: 3}
inputs: {u: A*sin(t)}
particles:
  bob: {mass: m, position: [x, y, z]}
constraints: {rail: [y = 0, z = 0]}
coordinates: [x]
definitions: {pull: k*u}
potentials: {spring: k*x^2/2 - x*u}
forces: {push: {on: x, force: pull}}
initial: {x: 1}
"""


def test_inputs_are_terms_in_the_order_of_the_file():
    inputs = read_text(SCENE.replace("{u:", "{c: exp(-t), u:")).inputs
    assert [(term.name, term.expression.text) for term in inputs] == [
        ("c", "exp(-t)"),
        ("u", "A*sin(t)"),
    ]


def test_a_list_gives_names_of_inputs_that_are_zero():
    inputs = read_text(SCENE.replace("{u: A*sin(t)}", '[u, "w[i=1..2]"]')).inputs
    assert [(term.name, term.expression.text) for term in inputs] == [
        ("u", "0"),
        ("w[1]", "0"),
        ("w[2]", "0"),
    ]


@pytest.mark.parametrize(
    ("before", "after", "message", "place"),
    [
        ("A*sin(t)", "A*sin(x)", "'x' in input 'u' is not a function of t alone", (3, 19)),
        ("A*sin(t)", "pull", "'pull' in input 'u' is not a function of t alone", (3, 13)),
        ("A*sin(t)", "sin(tt)", "unknown name 'tt' in input 'u'", (3, 17)),
        ("A*sin(t)", "dot(t)", "dot(...) cannot stand in input 'u'", (3, 13)),
        ("A*sin(t)", "{file: u.csv}", "input 'u' has no 'column'", (3, 13)),
        ("A*sin(t)", "{file: /u, column: u}", "'file' of input 'u' is not relative", (3, 20)),
        ("A*sin(t)", "[1, 2]", "expected an expression for input 'u'", (3, 13)),
        ("{u: A*sin(t)}", "[u, u]", "'u' is given twice", (3, 13)),
        ("A: 3", "A: 3, u: 1", "'u' is an input and also a parameter", (3, 10)),
        ("A: 3", "A: u", "'u' in parameter 'A' is not a parameter", (2, 29)),
        ("A*sin(t)}", "1, bob_x: 2, x_bob: 1}", "'x_bob' is already the x position", (3, 26)),
        ("mass: m", "mass: u", "'u' in the mass of particle 'bob' is not constant", (5, 15)),
        ("initial: {x: 1}", "initial: {u: 1}", "'u' in 'initial' is not a coordinate", (11, 11)),
        ("initial: {x: 1}", "initial: {x: u}", "'u' in 'initial' is not a parameter", (11, 14)),
    ],
)
def test_refusals_are_located(before, after, message, place):
    assert before in SCENE
    with pytest.raises(InputError) as refused:
        read_text(SCENE.replace(before, after))
    problem = refused.value.problems[0]
    assert message in problem.message
    assert problem.mark is not None
    assert (problem.mark.line, problem.mark.column) == place


@pytest.mark.parametrize(
    ("before", "after", "message", "place"),
    [
        ("[x, y, z]", "[x + u, y, z]", "the input 'u' cannot stand in the x position", (5, 33)),
        ("y = 0", "y = u", "the input 'u' cannot stand in constraint 'rail'", (6, 26)),
        ("y = 0", "y = pull", "the input 'u' cannot stand in constraint 'rail'", (6, 26)),
        ("y = 0", "dot(y) = u", "the input 'u' cannot stand in constraint 'rail'", (6, 31)),
        ("x*u}", "dot(u)}", "cannot stand in dot(...) in potential 'spring'", (9, 36)),
        ("x*u}", "dot(x*pull)}", "cannot stand in dot(...) in potential 'spring'", (9, 38)),
    ],
)
def test_inputs_without_rates_are_refused_where_these_are_needed(before, after, message, place):
    assert before in SCENE
    changed = SCENE.replace(before, after)
    assert not read_text(changed).warnings
    for value, reason in (
        ("abs(sin(t))", "abs(...) has none everywhere"),
        ("{file: u.csv, column: u}", "write 'interpolation: cubic'"),
    ):
        with pytest.raises(InputError) as refused:
            read_text(changed.replace("A*sin(t)", value).replace(", A: 3", ""))
        problem = refused.value.problems[0]
        assert message in problem.message
        assert reason in problem.hint
        assert problem.mark is not None
        assert (problem.mark.line, problem.mark.column) == place


def test_an_empty_mapping_is_an_input_that_is_zero():
    (driven,) = read_text(SCENE.replace("A*sin(t)", "{}").replace(", A: 3", "")).inputs
    assert driven.expression.text == "0"
