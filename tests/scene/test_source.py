"""YAML text to nodes with places, with the C parser and the Python one."""

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.scene.reading.source import Mapping, Scalar, Sequence, compose, decode

HOSTILE = {
    "aliases": "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n"
    + "".join(f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]\n" for i in range(1, 30)),
    "long alias": "a: &a " + "x" * 100_000 + "\nb: [" + "*a, " * 100 + "]\n",
    "self": "a: &a [1, *a]\n",
    "self key": "&a {*a : 1}\n",
    "flow": "[" * 50_000,
    "flow mappings": "{a: " * 5000 + "1" + "}" * 5000,
    "block": "".join(" " * i + "a:\n" for i in range(200)),
    "dashes": "- " * 5000 + "x\n",
    "two documents": "a: 1\n---\nb: 1\n",
    "second after end": "a: 1\n...\nb: 1\n",
    "tab": "a:\n\tb: 1\n",
    "directive": "%YAML 9.9\n---\na: 1\n",
    "unknown escape": 'a: "\\q"\n',
    "anchor only": "&a\n",
    "null key": "? \n: 1\n",
    "unclosed": "a: [1, 2\n",
    "backtick": "a: `x`\n",
    "next line": "a: 1\x85 b: [\u2028\n",
}


def problems_of(source: str | bytes) -> tuple[Problem, ...]:
    try:
        compose(source if isinstance(source, str) else decode(source, "f"), "f")
    except InputError as error:
        return error.problems
    return ()


@pytest.fixture(params=["C", "Python"])
def _parser(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param == "Python":
        monkeypatch.delattr(yaml, "CSafeLoader", raising=False)
    elif not hasattr(yaml, "CSafeLoader"):
        pytest.skip("PyYAML is built without libyaml")


@pytest.mark.slow
@pytest.mark.usefixtures("_parser")
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_texts_are_refused_at_a_place(name: str) -> None:
    with pytest.raises(InputError) as caught:
        compose(HOSTILE[name], "f")
    for problem in caught.value.problems:
        assert problem.mark is not None
        assert problem.mark.line >= 1
        assert problem.message


@pytest.mark.usefixtures("_parser")
def test_places_of_scalars() -> None:
    text = (
        "a: &n  foo\nb: 'it''s'\nc: \"x + y\" # no\nd: {e: -x, 'f' : *n}\n"
        "g: |\n  two\n  lines\nh: a\n  b\n"
    )
    root = compose(text, "f")
    assert isinstance(root, Mapping)
    values = {key.text: node for key, node in root.entries}
    lines = text.split("\n")
    for key, node in root.entries:
        assert lines[key.mark.line - 1][key.mark.column - 1 :].startswith(key.text)
        if isinstance(node, Scalar) and node.exact:
            assert lines[node.mark.line - 1][node.mark.column - 1 :].startswith(node.text)
    inner = values["d"]
    assert isinstance(inner, Mapping)
    assert [n.text for _, n in inner.entries if isinstance(n, Scalar)] == ["-x", "foo"]
    exact = {key: node.exact for key, node in values.items() if isinstance(node, Scalar)}
    assert exact == {"a": True, "b": False, "c": True, "g": False, "h": False}
    assert values["h"].text == "a b"
    assert (values["c"].plain, values["a"].plain) == (False, True)


@pytest.mark.usefixtures("_parser")
def test_line_breaks_and_byte_order_mark() -> None:
    root = compose(decode("\ufeffa: 1\r\nb: 2\rc: x\n".encode(), "f"), "f")
    assert isinstance(root, Mapping)
    assert [(k.text, k.mark.line, k.mark.text) for k, _ in root.entries] == [
        ("a", 1, "a: 1"),
        ("b", 2, "b: 2"),
        ("c", 3, "c: x"),
    ]


def test_an_anchor_may_be_used_as_often_as_the_limit_allows() -> None:
    root = compose("a: &a [1, 2]\nb: *a\nc: *a\n", "f")
    assert isinstance(root, Mapping)
    nodes = [node for _, node in root.entries]
    assert nodes[0] is nodes[1] is nodes[2]
    assert isinstance(nodes[0], Sequence)


def test_depth_of_64_is_allowed() -> None:
    compose("[" * 64 + "]" * 64, "f")
    with pytest.raises(InputError):
        compose("[" * 65 + "]" * 65, "f")


@given(st.binary(max_size=200))
@settings(max_examples=100, deadline=None)
def test_bytes_compose_or_are_refused(data: bytes) -> None:
    assert all(problem.mark is not None for problem in problems_of(data))


@given(st.text(alphabet="ab: -[]{},&*!|>'\"%@`#?\n\t\\<~.", max_size=60))
@settings(max_examples=200, deadline=None)
def test_yaml_like_texts_compose_or_are_refused(text: str) -> None:
    assert all(problem.mark is not None for problem in problems_of(text))
