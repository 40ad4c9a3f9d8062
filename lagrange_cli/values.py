"""Frozen data classes as those of the standard library, quicker to define.

The library compiles the text of six methods for each class; the package has hundreds of classes,
and half of the time in which a command is imported went there. Here one method is compiled,
``__init__``; the others read the names of the fields.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(
        cls: type | None = None, /, *, frozen: bool = False, **options: bool
    ) -> type | Callable[[type], type]:
        """Make a data class, as the decorator of this name in :mod:`dataclasses` does.

        Of its options a frozen class can have ``slots`` and ``kw_only``.
        """
        make = _frozen if frozen else dataclasses.dataclass
        return make(cls, **options) if cls is not None else lambda known: make(known, **options)


def _frozen(cls: type, slots: bool = False, kw_only: bool = False) -> type:
    """Make a frozen data class."""
    plain: Callable[..., type] = dataclasses.dataclass
    made = plain(cls, init=False, repr=False, eq=False, slots=slots, kw_only=kw_only)
    fields = dataclasses.fields(made)
    methods = {
        **_comparison(tuple(field.name for field in fields if field.compare)),
        **({"__getstate__": _state, "__setstate__": _restore} if slots else {}),
        "__init__": _initializer(made, fields),
        "__repr__": _representation,
        "__setattr__": _refuse_change,
        "__delattr__": _refuse_removal,
    }
    for name, method in methods.items():
        # A class that defines __eq__ and no __hash__ has None there.
        if vars(made).get(name) is None:
            setattr(made, name, method)
    return made


def _comparison(names: tuple[str, ...]) -> dict[str, Any]:
    """Return ``__eq__`` and ``__hash__`` by the values of some fields."""
    values = attrgetter(*names) if len(names) > 1 else _few_values(names)

    def equal(one: Any, another: Any) -> Any:
        if another.__class__ is not one.__class__:
            return NotImplemented
        return values(one) == values(another)

    return {"__eq__": equal, "__hash__": lambda one: hash(values(one))}


def _few_values(names: tuple[str, ...]) -> Callable[[Any], tuple[Any, ...]]:
    """Return a function that gives the values of one field, or of none, as a tuple."""
    return lambda one: tuple([getattr(one, name) for name in names])


def _initializer(cls: type, fields: tuple[dataclasses.Field[Any], ...]) -> Callable[..., None]:
    """Compile ``__init__``: names of fields are the only text in it that is not from here."""
    known: dict[str, Any] = {"_set": object.__setattr__, "_absent": object()}
    parameters: dict[bool, list[str]] = {False: [], True: ["*"]}
    lines = ["pass"]
    for field in fields:
        name = value = parameter = field.name
        if field.default is not dataclasses.MISSING:
            known[f"_default_{name}"] = field.default
            parameter = f"{name}=_default_{name}"
        elif field.default_factory is not dataclasses.MISSING:
            known[f"_make_{name}"] = field.default_factory
            parameter = f"{name}=_absent"
            value = f"_make_{name}() if {name} is _absent else {name}"
        parameters[field.kw_only is True].append(parameter)
        lines.append(f"_set(self, {name!r}, {value})")
    named = parameters[True] if len(parameters[True]) > 1 else []
    head = ", ".join(["self", *parameters[False], *named])
    exec(f"def __init__({head}):\n  " + "\n  ".join(lines), known)
    made: Callable[..., None] = known["__init__"]
    made.__qualname__ = f"{cls.__qualname__}.__init__"
    made.__annotations__ = {field.name: field.type for field in fields} | {"return": None}
    return made


def _representation(one: Any) -> str:
    shown = (f"{field.name}={getattr(one, field.name)!r}" for field in dataclasses.fields(one))
    return f"{one.__class__.__qualname__}({', '.join(shown)})"


def _refuse_change(one: Any, name: str, value: Any) -> NoReturn:
    raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_removal(one: Any, name: str) -> NoReturn:
    raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")


def _state(one: Any) -> list[Any]:
    """Return the values of an object with slots, to be pickled and copied."""
    return [getattr(one, field.name) for field in dataclasses.fields(one)]


def _restore(one: Any, values: list[Any]) -> None:
    for field, value in zip(dataclasses.fields(one), values, strict=True):
        object.__setattr__(one, field.name, value)
