"""Values given beside a scene."""

import pytest

from lagrange_cli.errors import InputError, render
from lagrange_cli.scene import read_text
from tests.scene.scene_evaluation import value

SCENE = """
parameters: {m: 1, k: {unit: N/m}, b: 2*m}
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: [x, y, z]
initial: {x: 1, dot(x): 2}
"""


def test_parameters_are_replaced() -> None:
    scene = read_text(SCENE, parameters={"k": "2*b + 1e-3", "m": "3"})
    values = {p.name: p for p in scene.parameters}
    assert list(values) == ["m", "k", "b"]
    assert value(values["k"].value.node, {"b": 6.0}) == 12.001
    assert values["k"].unit == "N/m"
    assert values["m"].value.text == "3"


def test_initial_values_are_replaced_and_added() -> None:
    scene = read_text(SCENE, initial={"x": "-m", "dot(y)": "pi/2", "z_bob": "0"})
    assert [(v.name, v.order, v.value.text) for v in scene.initial] == [
        ("x", 0, "-m"),
        ("x", 1, "2"),
        ("y", 1, "pi/2"),
        ("z_bob", 0, "0"),
    ]


def test_digest_is_that_of_the_text() -> None:
    assert read_text(SCENE).digest == read_text(SCENE, parameters={"m": "2"}).digest


@pytest.mark.parametrize(
    ("option", "text"),
    [
        (
            {"parameters": {"mm": "2"}},
            "-p mm:1:1: unknown parameter 'mm'\n    1 | mm=2\n      | ^^\n   did you mean 'm'?",
        ),
        (
            {"parameters": {"m": "2*(k"}},
            "-p m:1:5: this '(' is never closed\n    1 | m=2*(k\n      |     ^",
        ),
        (
            {"parameters": {"m": ""}},
            "-p m:1:3: expected an expression, found nothing\n    1 | m=\n      |   ^",
        ),
        (
            {"parameters": {"m": "q"}},
            "-p m:1:3: unknown name 'q' in parameter 'm'\n    1 | m=q\n      |   ^\n"
            "   declare it in 'parameters', 'coordinates' or 'definitions'",
        ),
        (
            {"parameters": {"k": "9.81 N/m"}},
            "-p k:1:3: '9.81 N/m' is a number with a unit\n    1 | k=9.81 N/m\n"
            "      |   ^^^^^^^^\n   write -p k=9.81, in the units of the scene",
        ),
        (
            {"parameters": {"m": "b"}},
            "<text>:2:14: parameters go in a circle: m -> b -> m\n"
            "    2 | parameters: {m: 1, k: {unit: N/m}, b: 2*m}\n      |              ^",
        ),
        (
            {"initial": {"xx": "2"}},
            "-i xx:1:1: unknown name 'xx' in 'initial'\n    1 | xx=2\n      | ^^\n"
            "   did you mean 'x'?",
        ),
        (
            {"initial": {"dot(x)": "y"}},
            "-i dot(x):1:8: 'y' in 'initial' is not a parameter\n    1 | dot(x)=y\n"
            "      |        ^\n   only parameters and pi can stand here",
        ),
    ],
)
def test_refusals(option: dict[str, dict[str, str]], text: str) -> None:
    with pytest.raises(InputError) as caught:
        read_text(SCENE, **option)
    assert render(caught.value.problems[0]) == text


def test_hostile_values_are_refused() -> None:
    calls = ("__import__('os')", "9^9^9^9", "1e999999999")
    for hostile in (*calls, "(" * 10_000, "\x1b[31m", "x" * 10**6):
        with pytest.raises(InputError):
            read_text(SCENE, parameters={"m": hostile})
        with pytest.raises(InputError):
            read_text(SCENE, initial={hostile: "1"})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("-1", "size 'n' is negative"),
        ("3/2", "size 'n' is a whole number, found 3/2"),
        ("x", "'x' is neither an index here nor a size"),
        ("2 +", "expected an expression after '+', found the end"),
    ],
)
def test_a_size_that_cannot_be_is_one_error(given: str, message: str) -> None:
    chain = """
sizes: {n: 3}
plane: xz
particles:
  p[i=1..n]: {mass: i, position: ["x[i]", "y[i]", "z[i]"]}
potentials: {weight: {gravity: 9.81}}
initial: {"x[i=1..n]": i/n}
expect: {dof: 2*n}
"""
    with pytest.raises(InputError) as refused:
        read_text(chain, parameters={"n": given})
    (problem,) = refused.value.problems
    assert problem.message == message
    assert problem.mark is not None
    assert problem.mark.file == "-p n"
