"""Words and mathematics within a line, free of formats and languages.

A :class:`Sentence` is a phrase of the catalogue with its parts; formulas are :class:`Label` trees
for general ones (∂L/∂θ, Σ_i F_i · δr_i) and display trees for expressions. A writer turns each into
text by its letters and a language; labels are added to each other and to signs: ``slope + " = 0"``.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, TypeAlias

from lagrange_cli.notation.ordering import symbol_of
from lagrange_cli.notation.tree import Dependence, DisplayNode, DisplaySymbol, with_symbols

if TYPE_CHECKING:
    from lagrange_cli.mechanics.families.forms import Range
    from lagrange_cli.report.letters import Letters
    from lagrange_cli.report.phrases.language import Language


class Written(ABC):
    """A part of a line."""

    @abstractmethod
    def write(self, to: Lettering) -> str:
        """Return the part in the letters of a format, and in a language."""


# Mathematics.


class Label(Written):
    """A general formula, or a part of one."""

    def __add__(self, tail: Label | str) -> Label:
        return Chain((self, tail))

    def __radd__(self, head: str) -> Label:
        return Chain((head, self))


@dataclass(frozen=True)
class Chain(Label):
    """Formulas and signs one after the other; signs are ASCII and the same in every format."""

    parts: tuple[Text, ...]

    def __bool__(self) -> bool:
        return bool(self.parts)

    def write(self, to: Lettering) -> str:
        return "".join(p if isinstance(p, str) else p.write(to) for p in self.parts)


#: No formula.
NOTHING: Label = Chain(())


def joined(sign: Label | str, parts: Iterable[Text]) -> Label:
    """Return formulas with a sign between them."""
    shown = [part for part in parts if part]
    return Chain(tuple(p for part in shown for p in (sign, part))[1:])


@dataclass(frozen=True)
class Expression(Label):
    """An expression on one line."""

    node: DisplayNode

    def write(self, to: Lettering) -> str:
        return to.letters.formula(to.node(self.node))


@dataclass(frozen=True)
class Less(Label):
    """An expression that is added to a formula, with its sign: `` + a`` or `` - a``."""

    node: DisplayNode

    def write(self, to: Lettering) -> str:
        text = to.letters.formula(to.node(self.node))
        minus = to.letters.minus
        return f" - {text.removeprefix(minus)}" if text.startswith(minus) else f" + {text}"


@dataclass(frozen=True)
class Mark(Label):
    """A formula that a format prints by the method of its letters that ``kind`` names.

    Attributes
    ----------
    kind
        Name of a method of :class:`~.letters.Letters`.
    parts
        Formulas, which are written first, and what the method takes besides.
    """

    kind: str
    parts: tuple[object, ...]

    def write(self, to: Lettering) -> str:
        shown = (p.write(to) if isinstance(p, Written) else p for p in self.parts)
        text: str = getattr(to.letters, self.kind)(*shown)
        return text


@dataclass(frozen=True)
class Sign(Label):
    """A sign that formats have letters of their own for."""

    kind: Literal[
        "cross_product",
        "dot_product",
        "virtual_work",
        "comma",
        "at_least_sign",
        "at_most_sign",
        "imaginary",
    ]

    def write(self, to: Lettering) -> str:
        text: str = getattr(to.letters, self.kind)
        return text


DOT, CROSS = Sign("dot_product"), Sign("cross_product")
WORK, COMMA = Sign("virtual_work"), Sign("comma")
AT_LEAST, AT_MOST = Sign("at_least_sign"), Sign("at_most_sign")


def symbol(name: str, order: int = 0, latex: str | None = None) -> Label:
    """A name of the scene, or one like it, with its dots."""
    return Mark("symbol", (name, order, latex))


def vector(letter: str, order: int = 0) -> Label:
    """A vector of particle i."""
    return Mark("vector", (letter, order))


def bold(letter: str, order: int = 0) -> Label:
    """A vector or matrix, with its dots."""
    return Mark("bold", (letter, order))


def partial(operand: Label, by: Label) -> Label:
    """A partial derivative."""
    return Mark("partial", (operand, by))


def bracket(first: Label, second: Label) -> Label:
    """A Poisson bracket."""
    return Mark("bracket", (first, second))


def rate(operand: Label) -> Label:
    """A total time derivative, d/dt before its operand."""
    return Mark("rate", (operand,))


def differential(operand: Label) -> Label:
    """A total time derivative as one fraction."""
    return Mark("differential", (operand,))


def virtual(operand: Label) -> Label:
    """A virtual displacement."""
    return Mark("virtual", (operand,))


def square(operand: Label) -> Label:
    """The square of a symbol."""
    return Mark("square", (operand,))


def at_least(operand: Label) -> Label:
    """A formula that is not negative."""
    return Mark("at_least", (operand,))


def magnitude(operand: Label) -> Label:
    """The magnitude of a vector."""
    return Mark("size", (operand,))


def below(letter: Label | str, index: Label | str) -> Label:
    """A letter with a symbol as its index."""
    return Mark("below", (letter, index))


def entry(letter: Label, row: int, column: int) -> Label:
    """An entry of a matrix."""
    return Mark("entry", (letter, row, column))


def total(index: str, body: Label) -> Label:
    """A sum over an index."""
    return Mark("total", (index, body))


def times(first: Label | str, second: Label | str) -> Label:
    """A product."""
    return Mark("times", (first, second))


def group(body: Label) -> Label:
    """A sum that is a factor, in parentheses."""
    return Mark("group", (body,))


def named(name: Written | str) -> Label:
    """Words of the scene, or a sentence, as a label in a formula."""
    return Mark("named", (name,))


def upright(phrase: Written) -> Label:
    """Words of the program within a formula."""
    return Mark("upright", (phrase,))


def value(number: float, literal: str | None = None) -> Label:
    """A value, as the scene wrote it if that is known."""
    return Mark("value", (number, literal))


def numeral(number: complex, digits: int = 6) -> Label:
    """A real or complex number in so many digits."""
    parts = number.real + 0.0, abs(number.imag)
    real, turned = (value(x, f"{x:.{digits}g}") for x in parts)
    if not number.imag:
        return real
    sign = "-" if number.imag < 0 else "+" if number.real else ""
    imaginary = times(turned, Sign("imaginary"))
    return real + f" {sign} " + imaginary if number.real else sign + imaginary


def literal(text: str) -> Label:
    """A number in the digits of a text."""
    return value(float(text), text)


def label_node(label: Label) -> DisplayNode:
    """A general formula or number as an expression."""
    return replace(symbol_of("", Dependence.NUMBER, 0), label=label)


def rounded(number: float) -> Label:
    """A small number, in one digit."""
    return Mark("number", (number,))


def routhian() -> Label:
    """The letter of Routh's function where the scene has an R of its own."""
    return Mark("routhian", ())


def ranges(spans: Sequence[Range]) -> Label:
    """The values of indices: ``i, j = 1, …, n``; nothing without any."""
    return Mark("ranges", (tuple(spans),)) if spans else NOTHING


# Words.


@dataclass(frozen=True)
class Plain(Written):
    """A text of the scene, or of a refusal, whose characters are no markup."""

    text: str

    def write(self, to: Lettering) -> str:
        return to.letters.words(self.text)


@dataclass(frozen=True)
class Count(Written):
    """A whole number, its thousands apart as the language has them."""

    number: int

    def write(self, to: Lettering) -> str:
        return to.say.number(self.number)


@dataclass(frozen=True)
class Prose(Written):
    """A title or description of a scene, which may hold formulas between dollars."""

    text: str

    def write(self, to: Lettering) -> str:
        return to.letters.prose(self.text)


@dataclass(frozen=True)
class Typed(Written):
    """A text that is typed on a command line."""

    text: str

    def write(self, to: Lettering) -> str:
        return to.letters.typed(self.text)


@dataclass(frozen=True)
class Unit(Written):
    """A unit."""

    text: str

    def write(self, to: Lettering) -> str:
        return to.letters.unit(self.text)


@dataclass(frozen=True)
class Inline(Written):
    """A formula within a sentence; a text is the same in every format, as an axis x."""

    formula: Text

    def write(self, to: Lettering) -> str:
        return to.letters.inline(to.text(self.formula))


@dataclass(frozen=True)
class Listed(Written):
    """Parts with a text between them, as a comma; labels are formulas within the line.

    ``opens``: true if the first letter is a capital, false if it is small, None if it stays.
    """

    parts: tuple[Written | str, ...]
    between: str = ", "
    opens: bool | None = None

    def __bool__(self) -> bool:
        return bool(self.parts)

    def write(self, to: Lettering) -> str:
        text = self.between.join(map(to.within, self.parts))
        if self.opens is None:
            return text
        return (text[:1].upper() if self.opens else text[:1].lower()) + text[1:]


@dataclass(frozen=True)
class Sentence(Written):
    """A phrase of the catalogue, or a sentence, with its parts in their places.

    Labels among them are formulas within the sentence.

    Attributes
    ----------
    english
        The English text, with the names of parts in braces.
    parts
        Each part by its name.
    count, many
        A number, and the text for several of what it counts; no number if there is one text.
    """

    english: str
    parts: tuple[tuple[str, Written | str | int], ...] = ()
    count: int | None = field(default=None, kw_only=True)
    many: str = field(default="", kw_only=True)

    def write(self, to: Lettering) -> str:
        shown = {k: p if isinstance(p, int) else to.within(p) for k, p in self.parts}
        if self.count is None:
            return to.say(self.english, **shown)
        return to.say.counted(self.count, self.english, self.many, **shown)


class _Speaker:
    """Makes sentences of phrases; parts that are texts are the same in every format."""

    def __call__(self, english: str, **parts: Written | str | int) -> Sentence:
        return Sentence(english, tuple(parts.items()))

    def counted(self, count: int, one: str, many: str, **parts: Written | str | int) -> Sentence:
        """Make a sentence of one thing or of several, with ``{count}`` as one of its parts."""
        return Sentence(one, tuple(parts.items()), count=count, many=many)

    def first(
        self, is_first: bool, first: str, later: str, **parts: Written | str | int
    ) -> Sentence:
        """Make the first sentence of a list, or a later one, which may be shorter."""
        return self(first if is_first else later, **parts)


say = _Speaker()


def enumerated(formulas: Sequence[Label]) -> Written:
    """Return formulas within a sentence: ``x, y and z``."""
    if len(formulas) < 2:
        return Listed(tuple(formulas))
    return say("{first} and {last}", first=Listed(tuple(formulas[:-1])), last=formulas[-1])


def in_parentheses(text: Text, *remarks: Text) -> Listed:
    """Return a text with remarks in parentheses behind it."""
    return Listed((text, " (", Listed(remarks), ")"), between="")


def opened(text: Text) -> Listed:
    """Return a text whose first letter is a capital."""
    return Listed((text,), opens=True)


def closed(text: Written) -> Listed:
    """Return a text whose first letter is small."""
    return Listed((text,), opens=False)


Text: TypeAlias = Written | str
"""Words within a line; texts, as digits and signs, are the same in every format and language."""


@dataclass(frozen=True)
class Lettering:
    """Letters of a format, and a language."""

    letters: Letters
    say: Language

    def text(self, text: Text) -> str:
        """Return words or a formula in the letters of the format; texts stay as they are."""
        return text if isinstance(text, str) else text.write(self)

    def within(self, part: Text) -> str:
        """Return a part of a sentence; a label is a formula within it."""
        text = self.text(part)
        return self.letters.inline(text) if isinstance(part, Label) else text

    def node(self, node: DisplayNode) -> DisplayNode:
        """Return a display tree whose labels are in the letters of the format."""
        return with_symbols(node, self._symbol)

    def _symbol(self, symbol: DisplaySymbol) -> DisplaySymbol:
        if not isinstance(symbol.label, Written):
            return symbol
        return replace(symbol, name=symbol.label.write(self), spelled=True, label=None)
