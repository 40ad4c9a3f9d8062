"""One-sided constraints and expected events as the scene states them."""

from __future__ import annotations

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.scene import parse_equation, read_text
from lagrange_cli.scene.language.expression import Name
from lagrange_cli.scene.model import Scene

BASE = """\
parameters: {m: 1, e: 0.5}
particles:
  p: {mass: m, position: [x, y, z]}
constraints:
"""


def read(constraints: str, rest: str = "", **given: dict[str, str]) -> Scene:
    return read_text(BASE + constraints + "\n" + rest, **given)


def refused(constraints: str, rest: str = "") -> str:
    with pytest.raises(InputError) as error:
        read(constraints, rest)
    return error.value.problems[0].message


@pytest.mark.parametrize(
    ("text", "relation"),
    [("z >= 0", ">="), ("0 <= z", "<="), ("'z>=0'", ">="), ("z>=-1", ">="), ("-z <= 2*x", "<=")],
)
def test_inequality(text: str, relation: str) -> None:
    scene = read(f"  floor: {text}")
    assert scene.constraints == ()
    (floor,) = scene.unilateral
    assert (floor.name, floor.inequality.relation, floor.restitution) == ("floor", relation, None)
    assert floor.inequality.text == text.strip("'")
    assert floor.mark.line == 5


def test_helper() -> None:
    (floor,) = read("  floor: {restitution: e, unilateral: z >= 0}").unilateral
    assert isinstance(floor.restitution.node, Name)
    assert floor.restitution.node.name == "e"
    assert floor.inequality.relation == ">="


def test_equations_stay_equations() -> None:
    scene = read("  plane: y = 0\n  floor: z >= 0")
    assert [c.name for c in scene.constraints] == ["plane"]
    assert [u.name for u in scene.unilateral] == ["floor"]
    assert scene.constraints[0].equations[0].relation == "="


def test_a_list_is_numbered() -> None:
    scene = read("  box: [x >= 0, x <= 1, z >= 0]\n  box_2: y >= 0")
    assert [u.name for u in scene.unilateral] == ["box_1", "box_2_", "box_3", "box_2"]


def test_a_list_of_one_is_not() -> None:
    assert [u.name for u in read("  floor: [z >= 0]").unilateral] == ["floor"]


def test_families() -> None:
    text = """
    sizes: {n: 3}
    particles:
      p[i=1..n]: {mass: 1, position: ["x[i]", 0, "z[i]"]}
    constraints:
      floor[i=1..n]: {unilateral: "z[i] >= i/10", restitution: 1/i}
      apart[i=2..n]: "x[i] - x[i-1] >= 0"
    """
    scene = read_text(text)
    names = ["floor[1]", "floor[2]", "floor[3]", "apart[2]", "apart[3]"]
    assert [u.name for u in scene.unilateral] == names
    assert [u.inequality.text for u in scene.unilateral][::3] == [
        "z[1] >= 1/10",
        "x[2] - x[1] >= 0",
    ]
    assert len(read_text(text, parameters={"n": "5"}).unilateral) == 9


def test_in_a_block_scalar() -> None:
    (floor,) = read("  floor: >\n    z\n    >= 0").unilateral
    assert floor.inequality.relation == ">="


@pytest.mark.parametrize("value", ["0", "1", "0.5", "1/3", "2/2", "1 - 1"])
def test_restitution_within_its_range(value: str) -> None:
    assert read(f"  f: {{unilateral: z >= 0, restitution: {value}}}").unilateral


@pytest.mark.parametrize(
    "entry",
    [
        "constraints: {f: {unilateral: z >= 0, restitution: @}}",
        "potentials: {w: {gravity: 9.81, direction: [0, @, 1]}}",
    ],
)
def test_a_sum_that_is_too_large_once_it_is_written_out(entry: str) -> None:
    """Its constants are within the limits as long as the index is a letter."""
    text = BASE.replace("constraints:\n", entry.replace("@", "'sum((1e100)^i, i=1..12)'"))
    with pytest.raises(InputError) as error:
        read_text(text)
    (problem,) = error.value.problems
    assert problem.message == "this constant is too large"
    assert problem.mark is not None
    assert problem.mark.line == 4


@pytest.mark.parametrize("value", ["-0.1", "1.0001", "2/1.9", "1e300", "-1e-300", "0 - 1"])
def test_restitution_outside_its_range(value: str) -> None:
    message = refused(f"  f: {{unilateral: z >= 0, restitution: {value}}}")
    assert message == f"a restitution is from 0 to 1, found {value}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("z > 0", "an inequality has '>='"),
        ("z < 0", "an inequality has '<='"),
        ("z => 0", "an inequality has '>='"),
        ("z =< 0", "an inequality has '<='"),
        ("0 <= z <= 1", "an inequality has one '>=' or '<='"),
        ("0 = z >= 1", "an inequality has one '>=' or '<='"),
        ("z >= 0 = x", "an inequality has one '>=' or '<='"),
        ("z >=", "expected an expression, found nothing"),
        ("<= z", "expected an expression, found nothing"),
        ("sin(z >= 0)", "this '(' is never closed"),
        ("{unilateral: [z >= 0]}", "expected an inequality for constraint 'f', found a list of 1"),
        ("{unilateral: z}", "expected an inequality, found no '>=' or '<='"),
        ("{unilateral: true}", "expected an inequality for constraint 'f', found 'true'"),
        ("{unilateral: z >= 0, restitution: [1]}", "expected an expression for 'restitution' of"),
    ],
)
def test_refusals(text: str, message: str) -> None:
    assert refused(f"  f: {text}").startswith(message)


@pytest.mark.parametrize("where", ["potentials: {v: x >= 1}", "initial: {x: 1 <= 2}"])
def test_no_expression_holds_one(where: str) -> None:
    assert refused("  f: z >= 0", where) == "expected an expression, found an inequality"


@pytest.mark.parametrize("where", ["expect: {equations: [ddot(x) >= 0]}"])
def test_no_expected_equation_is_one(where: str) -> None:
    assert refused("  f: z >= 0", where) == "expected an equation, found an inequality"


def test_an_inequality_is_no_equation() -> None:
    with pytest.raises(InputError, match="expected an equation, found an inequality"):
        parse_equation("x >= 0", read("  f: z >= 0").unilateral[0].mark)


# Expected events.


def test_events() -> None:
    listed = (
        "expect:\n  events:\n    - {name: contact:f, t: 2*m, within: 1e-9}\n"
        "    - {name: 'release:f'}\n    - {name: zeno:f, t: 3}\n"
    )
    first, second, third = read("  f: z >= 0", listed).expect.events
    assert (first.name, first.time.text, first.within.text) == ("contact:f", "2*m", "1e-9")
    assert (second.name, second.time, second.within) == ("release:f", None, None)
    assert (third.name, third.within) == ("zeno:f", None)
    assert (first.mark.line, first.mark.column) == (8, 14)


def test_events_are_those_of_the_sizes_in_the_file() -> None:
    text = "sizes: {n: 1}\nexpect: {events: [{name: contact:f}]}\n"
    assert len(read("  f: z >= 0", text).expect.events) == 1
    assert read("  f: z >= 0", text, parameters={"n": "2"}).expect.events == ()


@pytest.mark.parametrize(
    ("event", "message"),
    [
        ("{name: contact:g}", "unknown event 'contact:g' in 'expect'"),
        ("{name: floor}", "unknown event 'floor' in 'expect'"),
        ("{name: 'contact:f', t: x}", "'x' in 'events' of 'expect' is not a parameter"),
        ("{t: 1}", "'events' in 'expect' has no 'name'"),
        ("{name: contact:f, within: 1}", "'within' in 'events' in 'expect' without 't'"),
        ("contact:f", "expected a mapping {name, t, within} for 'events' in 'expect'"),
        ("{name: {a: 1}}", "expected a text for 'name' in 'events' in 'expect'"),
    ],
)
def test_events_refused(event: str, message: str) -> None:
    assert refused("  f: z >= 0", f"expect: {{events: [{event}]}}").startswith(message)


def test_events_are_a_list() -> None:
    message = refused("  f: z >= 0", "expect: {events: {name: contact:f}}")
    assert message.startswith("expected a list of events {name, t, within} for 'events'")


def test_no_events_without_contacts() -> None:
    with pytest.raises(InputError) as error:
        read("  f: z = 0", "expect: {events: [{name: contact:f}]}")
    assert error.value.problems[0].hint == "no constraint is one-sided here"
