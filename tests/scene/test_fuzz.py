"""Nothing that is read raises anything but a refusal with places."""

import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from lagrange_cli.errors import InputError, Problem, render
from lagrange_cli.scene import expected_error, read_text
from lagrange_cli.scene.language.expression import names_in
from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.reader import SECTIONS

SCENES = sorted((Path(__file__).parents[2] / "systems").glob("**/*.yaml"))

# fmt: off
KEYS = st.one_of(
    st.sampled_from([
        "mass", "position", "value", "unit", "positive", "latex", "description", "distance",
        "equals", "gravity", "direction", "spring", "stiffness", "length", "on", "force",
        "until", "from", "samples", "step", "method", "dof", "cyclic", "conserved", "equations",
        "lagrangian", "state", "drift", "error", "kind", "contains", "t", "within", "x", "y", "z",
        "a", "b", "m", "dot(x)", "x[1]", "p[i=1..n]", "unilateral", "newton", "<<",
    ]),
    st.text(max_size=6),
)
TEXTS = st.sampled_from([
    "x", "y", "z", "a", "b", "m", "x_a", "z_b", "1", "0.5", "-x", "x+y", "a*x^2", "x=0", "y=a*x",
    "dot(x)", "dot(x)=1", "x>=0", "min(x,y)", "true", "null", "~", ".inf", "1e3", "0x1F", "sin(x)",
    "(x", "x)", "2x", "x[1]", "a=b=c", "q", "1/0", "9^9^9^9", "ddot(x)", "energy", "xz", "xx",
    "t", "pi", "max(1)", "norm(x)", "log(0)", "[a, b]", "{x}", "x_", "_", "p_x", "",
])
# fmt: on
VALUES = st.recursive(
    st.one_of(TEXTS, st.integers(), st.floats(), st.booleans(), st.none(), st.text(max_size=8)),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(KEYS, inner, max_size=4)),
    max_leaves=12,
)
SECTION_NAMES = st.sampled_from([*SECTIONS])


def read(data: bytes | str) -> Scene | None:
    problems: tuple[Problem, ...] = ()
    try:
        expected_error(data)
        return read_text(data)
    except InputError as error:
        problems = error.problems
    assert problems
    for problem in problems:
        assert problem.mark is not None
        assert problem.mark.line >= 1
        assert problem.mark.column >= 1
        # A caret run may be wider than a character; what is printed steers no terminal.
        assert all(
            c == "\n" or unicodedata.category(c) not in ("Cc", "Cf") for c in render(problem)
        )
    return None


@pytest.mark.slow
@given(st.binary(max_size=300))
@settings(max_examples=100, deadline=None)
def test_bytes(data: bytes) -> None:
    read(data)


@pytest.mark.slow
@given(st.dictionaries(SECTION_NAMES, VALUES, max_size=5))
@settings(max_examples=150, deadline=None)
def test_random_sections(tree: dict[str, Any]) -> None:
    read(yaml.safe_dump(tree, allow_unicode=True))


@pytest.mark.slow
@given(
    st.fixed_dictionaries(
        {"particles": st.just({"a": {"mass": "m"}, "b": {"mass": 1, "position": ["x", "y", "z"]}})},
        optional={
            "parameters": st.dictionaries(st.sampled_from("amgklx"), TEXTS, max_size=3),
            "definitions": st.dictionaries(st.sampled_from("xyzuvt"), TEXTS, max_size=3),
            "constraints": st.dictionaries(st.sampled_from("cd"), TEXTS, max_size=2),
            "potentials": st.dictionaries(st.sampled_from("vw"), TEXTS, max_size=2),
            "initial": st.dictionaries(KEYS, TEXTS, max_size=2),
            "expect": st.dictionaries(KEYS, VALUES, max_size=3),
            "forces": st.dictionaries(KEYS, st.fixed_dictionaries({"on": TEXTS, "force": VALUES})),
        },
    )
)
@settings(max_examples=150, deadline=None)
def test_nearly_right_scenes(tree: dict[str, Any]) -> None:
    read(yaml.safe_dump(tree))


def mutations(text: str, draw: Callable[[st.SearchStrategy[Any]], Any]) -> str:
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(text)))
        end = draw(st.integers(start, min(len(text), start + 20)))
        new = draw(st.text(alphabet="xyz01 :,[]{}()*^-=#&'\"\n", max_size=6))
        text = text[:start] + new + text[end:]
    return text


@pytest.mark.slow
@given(st.data())
@settings(max_examples=150, deadline=None)
def test_mutated_scenes(data: st.DataObject) -> None:
    path = data.draw(st.sampled_from(SCENES))
    read(mutations(path.read_text(encoding="utf-8"), data.draw))


@pytest.mark.slow
def test_shipped_scenes_are_read_or_expect_their_refusal() -> None:
    assert len(SCENES) >= 20
    for path in SCENES:
        text = path.read_bytes()
        # A table is read with its scene, from the folder of the scene.
        is_read = b"\nfunctions:" in text or read(text) is not None
        assert is_read or expected_error(text) is not None, path


INDICES = st.sampled_from([
    "i=1..n", "i=1..3", "j=1..i", "j=i..n", "i=n..1", "i=0..n/2", "i=-1..1", "1", "n", "n+1", "i",
    "i-1", "2*i", "1/2", "1/0", "x", "-1", "i=1..999999", "t=1..2", "i=1", "1..2", "",
    "sum(1,i=1..2)", "i=1..i", "(n)", "x[1]", "1e400", "i^2",
])  # fmt: skip
MEMBERS = st.builds(
    lambda name, indices, end: f"{name}[{', '.join(indices)}{end}",
    st.sampled_from(["x", "p", "x_p", "n", "sin", "t", "", "x y", "sum"]),
    st.lists(INDICES, max_size=3),
    st.sampled_from(["]", "]", "]", "", ")", "]]", "]+1"]),
)
FORMULAS = st.builds(
    lambda parts: "".join(parts),
    st.lists(
        st.one_of(
            MEMBERS,
            st.sampled_from(["+", "*", "^2", "dot(", ")", "sum(", ",i=1..n)", "i", "2", "=0"]),
        ),
        max_size=5,
    ),
)


@pytest.mark.slow
@given(
    st.fixed_dictionaries(
        {"sizes": st.just({"n": 3})},
        optional={
            "particles": st.dictionaries(
                MEMBERS,
                st.fixed_dictionaries(
                    {"mass": FORMULAS},
                    optional={"position": st.lists(FORMULAS, min_size=3, max_size=3)},
                ),
                max_size=2,
            ),
            "coordinates": st.lists(MEMBERS, max_size=3),
            "definitions": st.dictionaries(MEMBERS, FORMULAS, max_size=3),
            "constraints": st.dictionaries(
                MEMBERS,
                st.one_of(
                    FORMULAS,
                    st.fixed_dictionaries(
                        {
                            "distance": st.lists(MEMBERS, min_size=2, max_size=2),
                            "equals": FORMULAS,
                        }
                    ),
                ),
                max_size=2,
            ),
            "kinetic": st.dictionaries(MEMBERS, FORMULAS, max_size=2),
            "forces": st.dictionaries(
                MEMBERS,
                st.fixed_dictionaries({"on": MEMBERS, "force": FORMULAS}),
                max_size=2,
            ),
            "initial": st.dictionaries(
                st.one_of(MEMBERS, MEMBERS.map("dot({})".format)), FORMULAS, max_size=2
            ),
            "expect": st.fixed_dictionaries(
                {},
                optional={
                    "dof": FORMULAS,
                    "cyclic": st.lists(MEMBERS, max_size=2),
                    "equations": st.dictionaries(MEMBERS, FORMULAS, max_size=2),
                },
            ),
        },
    )
)
@settings(max_examples=120, deadline=None)
def test_random_families(tree: dict[str, Any]) -> None:
    scene = read(yaml.safe_dump(tree, allow_unicode=True))
    if scene is not None:
        expressions = [d.expression for d in scene.definitions]
        expressions += [
            side for c in scene.constraints for e in c.equations for side in (e.left, e.right)
        ]
        assert not any(n.indices for e in expressions for n in names_in(e.node))
