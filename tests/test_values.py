"""The frozen data classes of the package are those of the standard library."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import operator
import pickle
import re
import sys
from collections.abc import Callable
from dataclasses import FrozenInstanceError, field
from functools import cached_property
from importlib import import_module
from itertools import product
from pkgutil import walk_packages
from typing import Any

import pytest

import lagrange_cli
from lagrange_cli import values


def _classes(dataclass: Any, prefix: str) -> dict[str, type]:
    """Make some frozen classes with a decorator, named alike."""

    @dataclass(frozen=True)
    class Empty:
        pass

    @dataclass(frozen=True)
    class Single:
        x: float

    @dataclass(frozen=True)
    class Several:
        x: float
        y: list[int] = field(default_factory=list)
        z: str = field(default="z", compare=False)

        @cached_property
        def twice(self) -> float:
            return 2 * self.x

    @dataclass(frozen=True, slots=True)
    class Slotted:
        x: float
        y: tuple[int, ...] = ()

    @dataclass(frozen=True, kw_only=True)
    class Named:
        y: int
        x: float = 1.0

    @dataclass(frozen=True)
    class Mixed:
        x: float = field(kw_only=True)
        y: int

    @dataclass(frozen=True)
    class Own:
        x: float

        def __eq__(self, other: object) -> bool:
            return True

        def __repr__(self) -> str:
            return "own"

    made = (Empty, Single, Several, Slotted, Named, Mixed, Own)
    for cls in made:
        # Where pickle looks for them.
        cls.__qualname__ = f"{prefix}{cls.__name__}"
        setattr(sys.modules[__name__], cls.__qualname__, cls)
    return {cls.__name__: cls for cls in made}


QUICK, STANDARD = _classes(values.dataclass, "Quick"), _classes(dataclasses.dataclass, "Standard")

#: Arguments that the classes take, or refuse.
ARGUMENTS: list[tuple[tuple[Any, ...], dict[str, Any]]] = [
    ((), {}),
    ((1.0,), {}),
    ((2.0,), {}),
    ((float("nan"),), {}),
    ((1.0, (3,)), {}),
    ((1.0, [3], "w"), {}),
    ((1, 2, 3, 4), {}),
    ((), {"x": 1.0, "y": 2}),
    ((), {"y": 2}),
    ((2,), {"x": 1.0}),
    ((), {"w": 1}),
]


def _said(work: Callable[..., object], *positional: Any, **named: Any) -> str:
    """Return the result of some work, or its refusal, in words that name no class."""
    try:
        result = repr(work(*positional, **named))
    except (TypeError, FrozenInstanceError, AttributeError) as error:
        result = f"{type(error).__name__}: {error}"
    return result.replace("Quick", "").replace("Standard", "")


def _signature(cls: type) -> str:
    """Return the signature of a class; of defaults that are made only that they are."""
    return re.sub(r"<object object at \w+>", "<factory>", str(inspect.signature(cls)))


def _objects(classes: dict[str, type], name: str) -> list[Any]:
    made = []
    for positional, named in ARGUMENTS:
        try:
            made.append(classes[name](*positional, **named))
        except TypeError:
            continue
    return made


@pytest.mark.parametrize("name", QUICK)
def test_objects_are_made_and_shown_alike(name):
    quick, standard = QUICK[name], STANDARD[name]
    for positional, named in ARGUMENTS:
        assert _said(quick, *positional, **named) == _said(standard, *positional, **named)
    assert _signature(quick) == _signature(standard)
    assert quick.__match_args__ == standard.__match_args__


@pytest.mark.parametrize("name", QUICK)
def test_objects_compare_and_hash_alike(name):
    quick, standard = _objects(QUICK, name), _objects(STANDARD, name)
    assert len(quick) == len(standard) > 0
    for i, j in product(range(len(quick)), repeat=2):
        assert (quick[i] == quick[j]) == (standard[i] == standard[j])
        assert _said(operator.lt, quick[i], quick[j]) == _said(
            operator.lt, standard[i], standard[j]
        )
        assert quick[i] != standard[j] or name == "Own"
    assert [_said(hash, one) for one in quick] == [_said(hash, one) for one in standard]


@pytest.mark.parametrize("name", QUICK)
def test_objects_refuse_changes_alike(name):
    for one, another in zip(_objects(QUICK, name), _objects(STANDARD, name), strict=True):
        assert _said(setattr, one, "x", 1) == _said(setattr, another, "x", 1)
        assert _said(delattr, one, "x") == _said(delattr, another, "x")
        with pytest.raises(FrozenInstanceError):
            one.never = 1


@pytest.mark.parametrize("name", QUICK)
def test_objects_are_copied_alike(name):
    for one, another in zip(_objects(QUICK, name), _objects(STANDARD, name), strict=True):
        for made in (copy.copy(one), copy.deepcopy(one), pickle.loads(pickle.dumps(one))):
            assert type(made) is type(one)
            assert repr(made) == repr(one)
        assert str(dataclasses.asdict(one)) == str(dataclasses.asdict(another))
        assert _said(dataclasses.replace, one, x=7.0) == _said(dataclasses.replace, another, x=7.0)


def test_defaults_that_are_made_are_not_shared_and_properties_are_kept():
    one, another = QUICK["Several"](1.0), QUICK["Several"](1.0)
    assert one.y is not another.y
    assert one.twice == 2.0
    assert vars(one)["twice"] == 2.0


def test_classes_that_are_not_frozen_are_those_of_the_library():
    @values.dataclass
    class Open:
        x: int = 0

    one = Open()
    one.x = 1
    assert one == Open(1)
    with pytest.raises(TypeError, match="unhashable"):
        hash(one)


def test_classes_of_the_package_have_the_signatures_of_the_library():
    """Every frozen class is defined once more by the library, from its fields."""
    compared = 0
    for module in walk_packages(lagrange_cli.__path__, "lagrange_cli."):
        if module.name == "lagrange_cli.__main__":
            continue
        for cls in vars(import_module(module.name)).values():
            if not (isinstance(cls, type) and _is_quick(cls)):
                continue
            fields = dataclasses.fields(cls)
            rows = [(f.name, f.type, _like(f)) for f in fields]
            known = dataclasses.make_dataclass(cls.__name__, rows, frozen=True)
            assert _signature(cls) == _signature(known)
            compared += 1
    assert compared > 200


def _is_quick(cls: type) -> bool:
    return getattr(cls.__setattr__, "__module__", "") == values.__name__


def _like(known: dataclasses.Field[Any]) -> Any:
    """A field like another one, not yet of any class."""
    options = {"compare": known.compare, "kw_only": known.kw_only}
    for kind in ("default", "default_factory"):
        if getattr(known, kind) is not dataclasses.MISSING:
            options[kind] = getattr(known, kind)
    return field(**options)
