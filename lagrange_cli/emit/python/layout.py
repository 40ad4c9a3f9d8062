"""Lines of Python: assignments, tuples, unpacked names, definitions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from textwrap import wrap

from lagrange_cli.emit.python.vocabulary import Vocabulary

#: Columns of a line.
WIDTH = 100

#: Names that hold more are unpacked one by one, if less than half of them are read.
_FEW_NAMES = 12

TAB = "    "


@dataclass(frozen=True)
class Signature:
    """Heading of a function.

    Attributes
    ----------
    label
        Its name in the module.
    arguments
        Text of its arguments behind ``t`` and ``y``.
    doc
        First line of its docstring.
    opening
        Lines before all others.
    equations
        Equations that the function solves, as comments.
    """

    label: str
    arguments: str
    doc: str
    opening: tuple[str, ...] = ()
    equations: tuple[str, ...] = ()

    @property
    def passed(self) -> str:
        """Return the arguments as they are handed on."""
        return passed_on(f"t, y, {self.arguments}")


def passed_on(arguments: str) -> str:
    """Return the arguments of a function without their defaults."""
    return ", ".join(argument.split("=")[0] for argument in arguments.split(", "))


@dataclass
class Tables:
    """Tables of indices that the functions of a module share."""

    names: dict[tuple[int, ...], str] = field(default_factory=dict)

    def name(self, table: tuple[int, ...]) -> str:
        return self.names.setdefault(table, f"AT_{len(self.names)}")

    def source(self) -> str:
        """Define the tables."""
        lines: list[str] = []
        for table, name in self.names.items():
            lines += assignment(name, f"np.array([{', '.join(map(str, table))}])", "")
        return "\n".join(["# Tables of indices.", *lines, ""]) if lines else ""


def assignment(target: str, text: str, tab: str = TAB) -> list[str]:
    """Return the lines of an assignment, in parentheses where it is long."""
    if len(line := f"{tab}{target} = {text}") <= WIDTH:
        return [line]
    inner = tab + TAB
    lines = wrap(text, WIDTH - len(inner), break_long_words=False, break_on_hyphens=False)
    return [f"{tab}{target} = (", *(inner + part for part in lines), f"{tab})"]


def listing(target: str, items: Iterable[str]) -> list[str]:
    """Return the lines that define a tuple, which break between its entries only."""
    texts = list(items)
    whole = f"{', '.join(texts)}{',' if len(texts) == 1 else ''}"
    if len(line := f"{target} = ({whole})") <= WIDTH:
        return [line]
    lines = [f"{target} = ("]
    for text in texts:
        if len(lines) > 1 and len(lines[-1]) + len(text) + 2 <= WIDTH:
            lines[-1] += f" {text},"
        else:
            lines.append(f"{TAB}{text},")
    return [*lines, ")"]


def defined(signature: Signature, body: Sequence[str], vocabulary: Vocabulary) -> str:
    """Return the definition of a function with a body."""
    head = f"def {signature.label}(t, y, {signature.arguments}):"
    decorator = [vocabulary.decorator] if vocabulary.decorator else []
    return "\n".join([*decorator, head, f'{TAB}"""{signature.doc}"""', *body, ""])


def unpacked(
    targets: Sequence[str], read: Sequence[bool], source: str, one: Callable[[int], str]
) -> list[str]:
    """Return the lines that give names to the numbers of an array or a tuple.

    Parameters
    ----------
    targets
        Names of all numbers.
    read
        Tells for each whether it is read.
    one
        Text of one number by its index.
    """
    indices = [k for k, is_read in enumerate(read) if is_read]
    if not indices:
        return []
    if len(targets) > _FEW_NAMES and 2 * len(indices) < len(targets):
        return [f"{TAB}{targets[k]} = {one(k)}" for k in indices]
    text = ", ".join(targets)
    if len(targets) == 1:
        return [f"{TAB}({text},) = {source}"]
    if len(line := f"{TAB}{text} = {source}") <= WIDTH:
        return [line]
    inner = wrap(f"{text},", WIDTH - 2 * len(TAB), break_long_words=False)
    return [f"{TAB}(", *(2 * TAB + part for part in inner), f"{TAB}) = {source}"]


def returned(text: str, tab: str = TAB) -> list[str]:
    """Return the lines of a return statement, in parentheses where it is long."""
    if len(line := f"{tab}return {text}") <= WIDTH:
        return [line]
    inner = tab + TAB
    lines = wrap(text, WIDTH - len(inner), break_long_words=False, break_on_hyphens=False)
    return [f"{tab}return (", *(inner + part for part in lines), f"{tab})"]


def row_of(target: str) -> str:
    """Return the array of a number, with its row in a matrix."""
    array, _, index = target.partition("[")
    row, comma, _ = index.partition(", ")
    return f"{array}[{row}" if comma else array


def joined(pairs: Sequence[tuple[str, str]], tab: str) -> str:
    """Assign several values in one line."""
    if len({text for _, text in pairs}) == 1:
        return f"{tab}{' = '.join(target for target, _ in pairs)} = {pairs[0][1]}"
    return f"{tab}{', '.join(t for t, _ in pairs)} = {', '.join(x for _, x in pairs)}"
