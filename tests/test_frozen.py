"""The decorator of frozen data classes does what the standard one does."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, asdict, field, fields, replace
from functools import cached_property
from typing import Any, ClassVar

import pytest

import lagrange_cli.frozen
from lagrange_cli.errors import Mark, Problem

DECORATORS = [dataclasses.dataclass, lagrange_cli.frozen.dataclass]


def classes(dataclass: Callable[..., Any]) -> dict[str, type]:
    """Classes of all the kinds that there are, by their names."""

    @dataclass(frozen=True)
    class Empty:
        """Nothing."""

    @dataclass(frozen=True)
    class One:
        """A field whose comparison is that of a tuple: what is not equal to itself is here."""

        number: float

    @dataclass(frozen=True)
    class Several:
        """Defaults, a default that is made, fields that do not count."""

        known: ClassVar[int] = 7
        name: str
        values: tuple[float, ...] = (1.0,)
        made: list[int] = field(default_factory=list, compare=False)
        quiet: int = field(default=3, repr=False)
        within: int = field(default=4, init=False)
        own: list[str] = field(default_factory=lambda: ["own"], init=False, compare=False)

        @cached_property
        def length(self) -> int:
            return len(self.values)

    @dataclass(frozen=True)
    class Derived(Several):
        """More fields after those of another class."""

        more: int = 5

    @dataclass(frozen=True, kw_only=True)
    class Keywords:
        """By keywords alone, in any order of defaults."""

        first: int = 1
        second: str

    @dataclass(frozen=True)
    class Checked:
        """Refuses values, and has methods of its own."""

        size: int
        other: int = 0

        def __post_init__(self) -> None:
            if self.size < 0:
                raise ValueError("negative")

        def __eq__(self, other: object) -> bool:
            return isinstance(other, Checked) and self.size == other.size

        def __repr__(self) -> str:
            return "checked"

    @dataclass(frozen=True)
    class Hashed:
        """With a hash of its own."""

        values: list[int]

        def __hash__(self) -> int:
            return 42

    @dataclass(frozen=True, repr=False)
    class Unshown:
        """Shown as any object."""

        number: int

    made = (Empty, One, Several, Derived, Keywords, Checked, Hashed, Unshown)
    return {made_class.__name__: made_class for made_class in made}


STANDARD, OURS = map(classes, DECORATORS)

#: Arguments that make values of each class, some of them equal.
NAN = float("nan")
ARGUMENTS: list[tuple[str, tuple[Any, ...], dict[str, Any]]] = [
    ("Empty", (), {}),
    *(("One", (x,), {}) for x in (1.0, NAN, 0.0)),
    ("Several", ("a",), {}),
    ("Several", ("a", (1.0,)), {"made": [9]}),
    ("Several", ("b",), {"quiet": 8}),
    ("Derived", ("a", (1.0,), [2], 3), {"more": 1}),
    ("Keywords", (), {"second": "x", "first": 2}),
    ("Checked", (1,), {}),
    ("Checked", (1, 5), {}),
    ("Hashed", ([1],), {}),
]


@pytest.mark.parametrize(("name", "words", "keywords"), ARGUMENTS)
def test_values_are_those_of_the_standard_decorator(name, words, keywords):
    theirs, ours = (made[name](*words, **keywords) for made in (STANDARD, OURS))
    assert asdict(ours) == asdict(theirs) or words == (NAN,)
    assert vars(ours).keys() == vars(theirs).keys()
    assert repr(ours) == repr(theirs)
    assert hash(ours) == hash(theirs)
    assert str(inspect.signature(type(ours))) == str(inspect.signature(type(theirs)))
    assert type(ours).__match_args__ == type(theirs).__match_args__
    names = [[f.name for f in fields(value)] for value in (ours, theirs)]
    assert names[0] == names[1]


@pytest.mark.parametrize("one", ARGUMENTS, ids=str)
def test_the_same_values_are_equal(one):
    for other in ARGUMENTS:
        theirs, ours = (
            made[one[0]](*one[1], **one[2]) == made[other[0]](*other[1], **other[2])
            for made in (STANDARD, OURS)
        )
        assert ours == theirs
    name, words, keywords = one
    assert OURS[name](*words, **keywords) != STANDARD[name](*words, **keywords)


@pytest.mark.parametrize("made", [STANDARD, OURS])
def test_values_cannot_be_changed(made):
    value = made["Several"]("a")
    for name in ("name", "within", "another"):
        with pytest.raises(FrozenInstanceError, match=f"cannot assign to field '{name}'"):
            setattr(value, name, 1)
    with pytest.raises(FrozenInstanceError, match="cannot delete field 'name'"):
        del value.name
    assert (value.length, value.own, value.known) == (1, ["own"], 7)
    assert value.made is not made["Several"]("a").made
    assert replace(value, name="b") == made["Several"]("b")
    assert copy.deepcopy(value) == value


@pytest.mark.parametrize("made", [STANDARD, OURS])
def test_wrong_arguments_are_refused(made):
    with pytest.raises(ValueError, match="negative"):
        made["Checked"](-1)
    with pytest.raises(TypeError, match=r"One.__init__\(\) missing 1 required"):
        made["One"]()
    with pytest.raises(TypeError, match="unexpected keyword argument 'within'"):
        made["Several"]("a", within=1)
    assert "object at 0x" in repr(made["Unshown"](1))


def test_a_value_that_holds_itself_is_shown():
    value = OURS["Hashed"]([])
    value.values.append(value)
    assert repr(value).endswith("Hashed(values=[...])")


@pytest.mark.parametrize("options", [{}, {"frozen": True, "slots": True}, {"eq": False}])
def test_other_classes_are_left_to_the_standard_decorator(options):
    @lagrange_cli.frozen.dataclass(**options)
    class Value:
        number: int

    value = Value(1)
    if options.get("frozen"):
        with pytest.raises(FrozenInstanceError):
            value.number = 2
    else:
        value.number = 2
    assert (value == Value(value.number)) == options.get("eq", True)


def test_values_of_the_package_can_be_sent():
    value = Problem("wrong", Mark("scene.yaml", 3, 1), rule="output")
    assert pickle.loads(pickle.dumps(value)) == value
    assert dataclasses.is_dataclass(value)
