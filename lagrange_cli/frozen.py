"""The decorator of data classes, quick to apply to frozen ones.

The standard one compiles six methods of each frozen class. Only ``__init__`` needs a text of its
own: here the others are closures over the names of the fields, and what the class offers is the
same. A command that simulates makes 84 classes before it begins, one that derives 365; that was
two fifths of what it takes beside its libraries (``benchmarks/README.md``).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import MISSING, Field
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

__all__ = ["dataclass"]

#: Options that this decorator leaves to the standard one.
_STANDARD = ("slots", "order", "unsafe_hash", "weakref_slot")

if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(cls=None, /, **options):
        """Make a data class, as :func:`dataclasses.dataclass` with the same options does."""
        if cls is None:
            return lambda decorated: dataclass(decorated, **options)
        usual = options.get("eq", True) and options.get("init", True)
        if not options.get("frozen") or not usual or any(map(options.get, _STANDARD)):
            return dataclasses.dataclass(**options)(cls)
        return _frozen(cls, options.get("repr", True), options.get("kw_only", False))


class _Made:
    """Stands in signatures for a default that is made anew for each value."""

    def __repr__(self) -> str:
        return "<factory>"


def _frozen(cls: type, represented: bool, kw_only: bool) -> type:
    """Give a class its fields and methods; those that it defines itself stay."""
    own = vars(cls).copy()
    cls.__doc__ = cls.__doc__ or ""  # else the standard decorator writes one, which takes long
    dataclasses.dataclass(init=False, repr=False, eq=False, kw_only=kw_only)(cls)
    fields = dataclasses.fields(cls)
    values = _values([field.name for field in fields if field.compare])
    methods: dict[str, Any] = {
        "__init__": _initializer(cls, fields),
        "__setattr__": _refuse_assignment,
        "__delattr__": _refuse_deletion,
        "__eq__": _equality(values),
    }
    if represented:
        methods["__repr__"] = _representation([field.name for field in fields if field.repr])
    for name, method in methods.items():
        if name not in own:
            setattr(cls, name, method)
    # Python puts None there itself where a class defines equality alone.
    if own.get("__hash__") is None and ("__hash__" not in own or "__eq__" in own):
        cls.__hash__ = _hash(values)  # type: ignore[assignment]
    return cls


def _initializer(cls: type, fields: Sequence[Field[Any]]) -> Callable[..., None]:
    """Compile ``__init__``, which sets each field to its argument or default."""
    names: dict[str, Any] = {"_set": object.__setattr__, "_made": _Made()}
    for field in fields:
        given = field.default_factory is MISSING
        names[f"_default_{field.name}"] = field.default if given else field.default_factory
    arguments = ["self", *(_argument(f) for f in fields if f.init and not f.kw_only)]
    keywords = [_argument(f) for f in fields if f.init and f.kw_only]
    head = ", ".join([*arguments, *(["*", *keywords] if keywords else [])])
    lines = [f"_set(self, {f.name!r}, {value})" for f in fields if (value := _value(f))]
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    # Names of fields in classes of this package are all that the text is made of.
    exec(f"def __init__({head}):\n " + "\n ".join(lines or ["pass"]), names)
    method: Callable[..., None] = names["__init__"]
    method.__qualname__ = f"{cls.__qualname__}.__init__"
    method.__annotations__ = {f.name: f.type for f in fields if f.init} | {"return": None}
    return method


def _argument(field: Field[Any]) -> str:
    """Write a field as an argument, with its default."""
    if field.default_factory is not MISSING:
        return f"{field.name}=_made"
    return field.name if field.default is MISSING else f"{field.name}=_default_{field.name}"


def _value(field: Field[Any]) -> str:
    """Write what a field is set to; "" for a default that the class itself has."""
    if field.default_factory is MISSING:
        return field.name if field.init else ""
    made = f"_default_{field.name}()"
    return f"{made} if {field.name} is _made else {field.name}" if field.init else made


def _values(names: Sequence[str]) -> Callable[[Any], tuple[Any, ...]]:
    """Return what gives the values of fields, in a tuple."""
    if len(names) > 1:
        return attrgetter(*names)
    if not names:
        return lambda value: ()
    (name,) = names
    return lambda value: (getattr(value, name),)


def _equality(values: Callable[[Any], tuple[Any, ...]]) -> Callable[[Any, object], Any]:
    def equal(self: Any, other: object) -> Any:
        if other.__class__ is self.__class__:
            return values(self) == values(other)
        return NotImplemented

    return equal


def _hash(values: Callable[[Any], tuple[Any, ...]]) -> Callable[[Any], int]:
    def hashed(self: Any) -> int:
        return hash(values(self))

    return hashed


def _representation(names: Sequence[str]) -> Callable[[Any], str]:
    @recursive_repr()
    def shown(self: Any) -> str:
        values = ", ".join(f"{name}={getattr(self, name)!r}" for name in names)
        return f"{self.__class__.__qualname__}({values})"

    return shown


def _refuse_assignment(self: object, name: str, value: object) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_deletion(self: object, name: str) -> None:
    raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
