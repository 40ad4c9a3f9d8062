"""Values as bytes, so that the cache can keep them: frozen dataclasses and SymPy's expressions.

The bytes are a pickle that is restricted on both sides. A function, an open file or a generator is
refused when it is written. Reading makes instances of classes of this package, of SymPy, mpmath and
the standard types named below, and calls nothing else, so that a forged entry runs no code of its
own. Expressions are rebuilt node by node as they were: SymPy's constructors would order and merge
sums and products that were written down in the order of print.
"""

from __future__ import annotations

import io
import pickle
import sys
from types import FunctionType
from typing import Any

#: Packages whose classes may stand in a value.
_PACKAGES = frozenset({"lagrange_cli", "sympy", "mpmath"})
#: Further classes, by module and name.
_CLASSES = frozenset(
    {
        ("builtins", "frozenset"),
        ("builtins", "set"),
        ("builtins", "complex"),
        ("fractions", "Fraction"),
        ("decimal", "Decimal"),
        ("collections", "OrderedDict"),
    }
)
#: Functions that values name: those that rebuild expressions, and the mark of an unwritten form.
_FUNCTIONS = frozenset(
    {
        (__name__, "unevaluated"),
        (__name__, "unknown_function_class"),
        ("lagrange_cli.mechanics.stored_derivation", "unwritten"),
    }
)


def to_bytes(value: object) -> bytes | None:
    """Serialize a value; None if it holds a function, or is nested too deeply."""
    stream = io.BytesIO()
    try:
        _Writer(stream, protocol=5).dump(value)
    except (pickle.PicklingError, TypeError, AttributeError, RecursionError):
        return None
    return stream.getvalue()


def from_bytes(data: bytes) -> Any:
    """Deserialize a value that :func:`to_bytes` wrote.

    Raises
    ------
    pickle.UnpicklingError
        The bytes name something that is no class of a value.
    """
    return _Reader(io.BytesIO(data)).load()


class _Writer(pickle.Pickler):
    """Writes compound expressions as their class and arguments, and refuses functions."""

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, FunctionType) and (obj.__module__, obj.__name__) not in _FUNCTIONS:
            raise pickle.PicklingError("a function is no value")
        sympy = sys.modules.get("sympy")
        if sympy is None:
            return NotImplemented
        if isinstance(obj, sympy.core.function.UndefinedFunction):
            return unknown_function_class, (obj.__name__,)
        if isinstance(obj, (sympy.Add, sympy.Mul, sympy.Pow, sympy.Function)):
            return unevaluated, (obj.func, obj.args)
        return NotImplemented


class _Reader(pickle.Unpickler):
    """Makes instances of the classes that values have, and of no other."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) in _FUNCTIONS:
            return super().find_class(module, name)
        if module.partition(".")[0] in _PACKAGES or (module, name) in _CLASSES:
            named = super().find_class(module, name)
            if isinstance(named, type):
                return named
        raise pickle.UnpicklingError(f"{module}.{name} is no class of a value")


def unevaluated(kind: Any, arguments: tuple[Any, ...]) -> Any:
    """Rebuild a sum, product, power or function with its arguments in their order."""
    return kind(*arguments, evaluate=False)


def unknown_function_class(name: str) -> Any:
    """Rebuild the class of a real function that a scene names without giving it."""
    import sympy

    return sympy.Function(name, real=True)
