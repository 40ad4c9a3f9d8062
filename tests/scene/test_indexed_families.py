"""Indexed families: what their members are, where they may stand, and what is refused."""

import sys

import pytest

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.scene import parse_expression, read_text
from lagrange_cli.scene.language.expression import Name, names_in, walk
from lagrange_cli.scene.language.families import MAX_FAMILY, MAX_TERMS
from lagrange_cli.scene.model import Scene
from tests.scene.scene_evaluation import value

CHAIN = """
sizes: {n: 3}
parameters: {m: 1.0, l: 0.01, g: 9.81}
plane: xz
points: {"p[0]": [0, 0, 0]}
particles:
  p[i=1..n]: {mass: m, position: ["x[i]", "y[i]", "z[i]"]}
constraints:
  rod[i=1..n]: {distance: ["p[i-1]", "p[i]"], equals: l*i}
potentials:
  weight: {gravity: g}
initial:
  x[i=1..n]: l*i
  z[i=1..n]: 0
"""

NET = """
sizes: {n: 15, m: 15}
particles:
  p[i=1..n, j=1..m]: {mass: 1, position: ["x[i,j]", "y[i,j]", "z[i,j]"]}
potentials:
  along[i=1..n-1, j=1..m]: {spring: ["p[i,j]", "p[i+1,j]"], stiffness: 2, length: 1}
  across[i=1..n, j=1..m-1]: {spring: ["p[i,j]", "p[i,j+1]"], stiffness: 2, length: 1}
"""


def refused(text: str, **given: dict[str, str]) -> Problem:
    """The one problem of a scene."""
    with pytest.raises(InputError) as caught:
        read_text(text, **given)
    (problem,) = caught.value.problems
    return problem


def coordinates(keys: str, sizes: str = "{n: 3, m: 2}") -> list[str]:
    scene = read_text(f"sizes: {sizes}\ncoordinates: [{keys}]\n")
    assert scene.coordinates is not None
    return [c.name for c in scene.coordinates]


def test_members_of_a_chain() -> None:
    scene = read_text(CHAIN)
    assert [p.name for p in scene.particles] == ["p[1]", "p[2]", "p[3]"]
    assert [e.text for e in scene.particles[1].position] == ["x[2]", "y[2]", "z[2]"]
    assert [c.name for c in scene.constraints] == ["plane", "rod[1]", "rod[2]", "rod[3]"]
    assert [(v.name, v.value.text) for v in scene.initial[:2]] == [("x[1]", "l*1"), ("x[2]", "l*2")]
    places = {f"{axis}_p[{i}]": 10.0 * i + k for i in range(4) for k, axis in enumerate("xyz")}
    rod = scene.constraints[3].equations[0]
    assert value(rod.left.node, places) == 300
    assert value(rod.right.node, {"l": 2.0}) == 36
    assert scene.potentials[0].expression.text == "m*g*z_p[1] + m*g*z_p[2] + m*g*z_p[3]"


def test_no_indices_are_left() -> None:
    scene = read_text(CHAIN)
    for constraint in scene.constraints:
        for equation in constraint.equations:
            for side in (equation.left, equation.right):
                assert not any(n.indices for n in names_in(side.node))


def test_marks_are_on_the_familys_line() -> None:
    scene = read_text(CHAIN)
    assert {c.mark.line for c in scene.constraints[1:]} == {9}
    assert {v.mark.line for v in scene.initial[:3]} == {13}
    entry = scene.particles[2].position[0]
    mark = entry.mark(entry.node.span)
    assert mark.text[mark.column - 1 :][: mark.length] == "x[i]"


@pytest.mark.parametrize(
    ("keys", "names"),
    [
        ('"q[i=1..n]"', ["q[1]", "q[2]", "q[3]"]),
        ('"q[i=0..2*(n-1)/2]"', ["q[0]", "q[1]", "q[2]"]),
        ('"q[i=-1..1]"', ["q[-1]", "q[0]", "q[1]"]),
        ('"q[i=n..n]"', ["q[3]"]),
        ('"q[ i = 1 .. 2 ]"', ["q[1]", "q[2]"]),
        ('"q[i=1..m, j=1..m]"', ["q[1,1]", "q[1,2]", "q[2,1]", "q[2,2]"]),
        ('"q[i=1..n, j=i+1..n]"', ["q[1,2]", "q[1,3]", "q[2,3]"]),
        ('"q[0, j=1..m]"', ["q[0,1]", "q[0,2]"]),
        ('"q[i=1..m, n+1]"', ["q[1,4]", "q[2,4]"]),
        ('"q[n+1]", r, "q[1]"', ["q[4]", "r", "q[1]"]),
        ('"q[i=1..n-3]", r', ["r"]),
    ],
)
def test_names_of_members(keys: str, names: list[str]) -> None:
    assert coordinates(keys) == names


@pytest.mark.parametrize(
    ("text", "result"),
    [
        ("sum(i, i=1..4)", 10),
        ("sum(i*j, i=1..3, j=i..3)", 1 + 2 + 3 + 4 + 6 + 9),
        ("sum(sum(i^j, j=1..2), i=1..3)", 2 + 6 + 12),
        ("sum(x[i], i=1..3)", 60),
        ("2*sum(x[i+1] - x[i], i=1..2)^2", 800),
        ("sum(x[1], i=3..n)", 0),
        ("sum(-i^2, i=-2..-1)", -5),
        ("1 - sum(n/2, i=1..n)", -1),
        ("norm(sum(x[i], i=1..2), x[n]*2)", 50),
    ],
)
def test_sums(text: str, result: float) -> None:
    scene = read_text(
        'sizes: {n: 2}\ncoordinates: ["x[i=1..3]"]\npotentials:\n  v: "' + text + '"\n'
    )
    names = {"x[1]": 10.0, "x[2]": 20.0, "x[3]": 30.0}
    expression = scene.potentials[0].expression
    assert value(expression.node, names) == result
    assert value(parse_expression(expression.text, expression.origin).node, names) == result


def test_names_with_numbers_are_plain_names_anywhere() -> None:
    node = parse_expression("dot(x[1, 2]) + x_p[3]", read_text(CHAIN).particles[0].mark).node
    assert [n.name for n in names_in(node)] == ["x[1,2]", "x_p[3]"]
    assert all(isinstance(n, Name) and not n.indices for n in walk(node) if isinstance(n, Name))


def test_every_section_takes_families() -> None:
    scene = read_text("""
sizes: {n: 2}
parameters:
  c[i=1..n]: {value: i, unit: kg}
particles: {"p[i=1..n]": {mass: "c[i]"}}
points: {"o[i=1..n]": [i, 0, 0]}
coordinates: {"x_p[i=1..n]": {unit: m}, "y_p[i=1..n]": {}, "z_p[i=1..n]": {}}
definitions: {"d[i=1..n]": "x_p[i] - i"}
constraints: {"c[i=1..n]": "y_p[i] + z_p[i] = n"}
potentials: {"v[i=1..n]": "d[i]^2"}
kinetic: {"k[i=1..n]": "dot(d[i])^2"}
forces: {"f[i=1..n]": {on: "p[i]", force: [i, 0, 0]}, "h[i=1..n]": {on: "x_p[i]", force: n}}
dissipation: {"r[i=1..n]": "dot(y_p[n+1-i])^2"}
initial: {"x_p[i=1..n]": i, "dot(x_p[i=1..n])": -i}
near: {"y_p[i=1..n]": i}
expect:
  dof: 2*n
  cyclic: ["z_p[i=1..n]"]
  conserved: [energy, "p_x_p[i=1..n]"]
  equations: {"e[i=1..n]": "ddot(x_p[i]) = 0"}
  state: {t: 1, "x_p[i=1..n]": i, within: 1e-8}
""")
    assert [p.name for p in scene.parameters] == ["c[1]", "c[2]"]
    assert [f.on for f in scene.forces] == ["p[1]", "p[2]", "x_p[1]", "x_p[2]"]
    assert [(v.name, v.order) for v in scene.initial] == [
        *(("x_p[1]", 0), ("x_p[2]", 0)),
        *(("x_p[1]", 1), ("x_p[2]", 1)),
    ]
    assert scene.expect.dof == 4
    assert scene.expect.conserved == ("energy", "p_x_p[1]", "p_x_p[2]")
    assert scene.expect.equations is not None
    assert [e.text for e in scene.expect.equations] == ["ddot(x_p[1]) = 0", "ddot(x_p[2]) = 0"]
    sections = ("points", "definitions", "constraints", "potentials", "kinetic", "dissipation")
    assert all(len(getattr(scene, section)) == 2 for section in sections)


def test_sizes_and_members_are_set_beside_the_scene() -> None:
    scene = read_text(
        CHAIN, parameters={"n": "2.0", "l": "n/4"}, initial={"x[2]": "-n", "dot( z[1] )": "1"}
    )
    assert [(s.name, s.value) for s in scene.sizes] == [("n", 2)]
    assert len(scene.particles) == 2
    assert [p.value.text for p in scene.parameters if p.value and p.name == "l"] == ["2/4"]
    given = {(v.name, v.order): v.value.text for v in scene.initial}
    assert (given["x[2]", 0], given["z[1]", 1]) == ("-2", "1")


@pytest.mark.slow
def test_expected_equations_that_grow_too_long_with_other_sizes_are_left_out() -> None:
    text = """\
sizes: {n: 3}
coordinates: ["x[i=1..n]"]
kinetic: {T: "sum(dot(x[i])^2, i=1..n)/2"}
expect:
  equations:
    e[i=1..n]: "ddot(x[i]) + sum(0*x[j], j=1..n) = 0"
"""
    assert len(read_text(text, parameters={"n": "4"}).expect.equations or ()) == 4
    scene = read_text(text, parameters={"n": "400"})
    assert scene.expect.equations is None
    (warning,) = scene.warnings
    assert (warning.mark and warning.mark.line, warning.rule) == (6, "limit")


def test_expected_states_are_those_of_the_files_sizes() -> None:
    text = CHAIN + "expect: {dof: n, state: {t: 1, 'x[3]': 0, within: 1}}\n"
    assert len(read_text(text).expect.states) == 1
    assert (
        read_text(text, parameters={"n": "2"}).expect.dof,
        read_text(text, parameters={"n": "2"}).expect.states,
    ) == (2, ())


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("1/2", "size 'n' is a whole number, found 1/2"),
        ("-1", "size 'n' is negative"),
        ("m", "'m' is neither an index here nor a size"),
        ("123456", "a range of more than 100000 values"),
        ("sin(1)", "this is no index"),
        ("1e100", "size 'n' beyond 1000000000"),
    ],
)
def test_refused_sizes(value: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        read_text(CHAIN, parameters={"n": value})
    assert message in [problem.message for problem in caught.value.problems]


def test_problems_name_the_first_member_and_stand_on_the_familys_line() -> None:
    problem = refused(CHAIN.replace("equals: l*i", "equals: l*k"))
    assert problem.message == "unknown name 'k' in constraint 'rod[1]'"
    assert problem.mark is not None
    assert (problem.mark.line, problem.mark.text[problem.mark.column - 1 :]) == (9, "k}")
    problem = refused(CHAIN.replace('"p[i]"], eq', '"p[i+1]"], eq'))
    assert (
        problem.message == "unknown particle or point 'p[4]' in 'distance' of constraint 'rod[3]'"
    )
    problem = refused(CHAIN + "kinetic:\n  k[i=1..n]: dot(x[i+1])^2\n")
    assert problem.message == "unknown name 'x[4]' in kinetic energy 'k[3]'"
    assert problem.hint == "known are 'x[1]' to 'x[3]'"
    problem = refused(CHAIN + "kinetic:\n  k[i=1..n]: 1/(i-2)\n")
    assert problem.message == "division by zero in kinetic energy 'k[2]'"
    problem = refused(CHAIN + "kinetic:\n  k[i=1..n]: dot(x[i/2])^2\n")
    assert problem.message == "an index is a whole number, found 1/2 in kinetic energy 'k[1]'"


@pytest.mark.parametrize(
    ("addition", "message"),
    [
        ('coordinates: ["q[i=1..3]", "q[2]"]', "'q[2]' is given twice"),
        ('coordinates: ["q[1]", q_1]', "'q_1' prints like 'q[1]'"),
        ('coordinates: ["q[1]", q1]', "'q1' prints like 'q[1]'"),
        ('coordinates: ["q[1,2]", q_1_2]', "'q_1_2' prints like 'q[1,2]'"),
        ('coordinates: ["q[i=1..3]", i]', "'i' is a coordinate and also an index"),
        ("coordinates: [n]", "'n' is a coordinate and also a size"),
        ('coordinates: ["q[i=1..n, i=1..n]"]', "'i' is an index or a size already"),
        ('coordinates: ["q[n=1..3]"]', "'n' is an index or a size already"),
        ('coordinates: ["q[t=1..3]"]', "'t' cannot be an index"),
        ('coordinates: ["q[i=1..3/2]"]', "the end of a range is a whole number, found 3/2"),
        ('coordinates: ["q[i=3..1]"]', "this range runs backwards"),
        ('coordinates: ["q[i=1..k]"]', "'k' is neither an index here nor a size"),
        ('coordinates: ["q[i=1..10^9]"]', "this is no index"),
        ('coordinates: ["q[i=1..2, j=1..2, k=1..2]"]', "more than 2 indices"),
        ('coordinates: ["q[1,2,3]"]', "more than 2 indices"),
        ('coordinates: ["q[i=1]"]', "a range has two ends, as in i=1..n"),
        ('coordinates: ["q[1..3]"]', "'..' stands between the ends of a range"),
        ('coordinates: ["q[]"]', "expected an expression after '[', found ']'"),
        ('coordinates: ["q[1"]', "this '[' is never closed"),
        ('coordinates: ["q[1)"]', "this '[' is never closed"),
        ('coordinates: ["q[1] + 2"]', "expected a name with indices, as in x[i=1..n]"),
        ('coordinates: ["sin[1]"]', "'sin' is reserved and cannot be declared in 'coordinates'"),
        ('coordinates: ["2q[1]"]', "expected a name in 'coordinates', found '2q[1]'"),
        ("kinetic: {v: 'x[i]'}", "'i' is neither an index here nor a size"),
        ("kinetic: {v: 'x[1.5]'}", "an index is a whole number, found 3/2"),
        ("kinetic: {v: 'x[1/0]'}", "division by zero"),
        ("kinetic: {v: 'x[i=1..3]'}", "expected an expression, found an equation"),
        ("kinetic: {v: 'x[x[1]]'}", "this is no index"),
        ("kinetic: {v: 'x[1'}", "this '[' is never closed"),
        ("kinetic: {v: 'x[1))'}", "this '[' is never closed"),
        ("kinetic: {v: x]}", None),
        ("kinetic: {v: 'pi[1]'}", "'pi' has no index"),
        ("kinetic: {v: 'sum(x[1])'}", "sum(...) takes an expression and ranges"),
        ("kinetic: {v: 'sum(i=1..3)'}", "expected an expression, found an equation"),
        ("kinetic: {v: 'sum(n, n=1..3)'}", "'n' is an index or a size already"),
        ("kinetic: {v: 'sum(x[9], i=1..3)'}", "unknown name 'x[9]' in kinetic energy 'v'"),
        ("kinetic: {v: 'sum(i..2, i=1..3)'}", "'..' stands between the ends of a range"),
        ("kinetic: {v: 'max(1, i=1..3)'}", "expected an expression, found an equation"),
        ("forces: {f: {on: 'p[i]', force: [1, 2, 3]}}", "'i' is neither an index here nor a size"),
        ("forces: {f: {on: 'p[i=1..2]', force: [1, 2, 3]}}", "a range cannot stand here"),
    ],
)
def test_refused(addition: str, message: str | None) -> None:
    with pytest.raises(InputError) as caught:
        read_text(CHAIN + addition + "\n")
    if message:
        assert caught.value.problems[0].message == message


def test_a_name_of_a_position_that_is_an_index_is_refused() -> None:
    problem = refused(
        "particles: {'p[i=1..2]': {mass: 1, position: ['x[i]', 0, 0]}}\npoints: {o: [i, 0, 0]}\n"
    )
    assert problem.message == "'i' stands in a position and is also an index"


@pytest.mark.slow
def test_large_families_are_read() -> None:
    scene = read_text(CHAIN, parameters={"n": "300"})
    assert (len(scene.particles), len(scene.constraints), len(scene.initial)) == (300, 301, 600)
    scene = read_text(NET)
    assert (len(scene.particles), len(scene.potentials)) == (225, 420)
    assert coordinates('"q[i=1..n]"', "{n: 100000}")[-1] == "q[100000]"


@pytest.mark.slow
def test_work_grows_as_the_family_does() -> None:
    def calls(n: int) -> int:
        found = 0

        def count(frame: object, event: str, argument: object) -> None:
            nonlocal found
            found += event == "call"

        sys.setprofile(count)
        try:
            read_text(CHAIN, parameters={"n": str(n)})
        finally:
            sys.setprofile(None)
        return found

    small, large = calls(50), calls(200)
    assert large <= 4.2 * small


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [
        "coordinates: ['q[i=1..400, j=1..400]']\n",
        "coordinates: ['q[i=1..100000, j=i..100000]']\n",
        "coordinates: ['q[i=1..100000]', 'r[i=1..100001]']\n",
        "potentials: {v: 'sum(1, i=1..1001, j=1..1000)'}\n",
        "potentials: {v: 'sum(sum(sum(1, i=1..1000), j=1..1000), k=1..1000)'}\n",
        "sizes: {n: 2}\npotentials: {v: 'sum(sum(1, i=n..1, j=1..2), k=1..100000, l=1..100000)'}\n",
        "potentials: {'v[i=1..90000]': '" + "+".join(["i"] * 5000) + "'}\n",
        "particles: {'p[i=1..2000]': {mass: 1}}\npotentials: {'g[i=1..2000]': {gravity: 1}}\n",
    ],
)
def test_what_grows_too_large_is_refused_before_it_is_made(text: str) -> None:
    problem = refused(text)
    assert problem.rule == "limit"
    assert any(str(n) in problem.message for n in (MAX_FAMILY, MAX_TERMS))


def test_same_text_gives_equal_scenes() -> None:
    first, second = read_text(CHAIN), read_text(CHAIN)
    assert isinstance(first, Scene)
    assert first == second
