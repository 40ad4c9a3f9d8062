"""Documents, code and reports of a derivation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

from lagrange_cli.api.derived import Derived

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue

AnyDerived = TypeVar("AnyDerived", bound=Derived)


@dataclass(frozen=True, repr=False)
class Shown:
    """A page of Markdown, which notebooks typeset."""

    markdown: str

    def _repr_markdown_(self) -> str:
        return self.markdown

    def __repr__(self) -> str:
        return self.markdown


def with_brackets(derived: AnyDerived, *brackets: str) -> AnyDerived:
    """Return the derivation with Poisson brackets in its Hamilton's form.

    Parameters
    ----------
    brackets
        Each two functions, ``"L_z, H"``, as ``lagrange derive --bracket`` takes them.

    Raises
    ------
    InputError
        Located: a text is not two functions over (q, p, t); or there is no Hamiltonian.

    Examples
    --------
    >>> derivation = load("systems/celestial/two_bodies.yaml").derive()
    >>> derivation.with_brackets("boost_x, P_x").report(form="hamiltonian")["brackets"][0]
    {'first': 'boost_x', 'second': 'P_x', 'value': 'm1 + m2', 'rate': None, 'conserved': None}
    """
    if not brackets:
        return derived
    from lagrange_cli.analysis.forms.brackets import WrittenBracket, with_brackets

    written = [WrittenBracket(text, "--bracket") for text in brackets]
    return replace(derived, equations=with_brackets(derived.equations, written))


def report(derived: Derived, *, form: str = "lagrange", latex: bool = False) -> dict[str, Any]:
    """Return what ``lagrange derive --format json`` writes, ``--with latex`` too.

    Examples
    --------
    >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
    >>> derivation.report()["equations"]
    [{'coordinate': 'theta', 'residual': 'l*ddot(theta) + g*sin(theta)'}]
    """
    from lagrange_cli.emit.json_report import derivation_report

    return derivation_report(derived.equations, form, latex=latex)


def text(
    derived: Derived,
    *,
    form: str = "lagrange",
    ascii: bool = False,
    width: int = 80,
    **options: OptionValue,
) -> str:
    """Return what ``lagrange derive`` prints in a window of ``width`` columns.

    ``options``: ``sections`` and ``language``, as of the command.
    """
    from lagrange_cli.emit.text import derivation_text

    return derivation_text(derived.equations, ascii=ascii, form=form, width=width, **options)


def emit(derived: Derived, to: str, **options: OptionValue) -> dict[str, str]:
    """Return file name → text in a format of ``lagrange emit --list``.

    Raises
    ------
    InputError
        There is no such format or option.

    Examples
    --------
    >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
    >>> list(derivation.emit("c"))
    ['pendulum.h', 'pendulum.c']
    """
    from lagrange_cli.emit.registry import emitter

    return emitter(to).emit(derived.equations, options)


def show(derived: Derived, *sections: str, **options: OptionValue) -> Shown:
    """Return parts of the derivation, which notebooks typeset.

    Parameters
    ----------
    sections
        Names of ``lagrange emit --sections``: ``account``, ``equations``, ``certificate`` and
        so on; without any, those of a document.
    options
        Others of ``lagrange emit --to markdown``.

    Raises
    ------
    InputError
        There is no such part or option, or constraint forces were not derived.

    Examples
    --------
    >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
    >>> print(derivation.show("certificate"))  # doctest: +ELLIPSIS
    # Simple pendulum
    ...
    ## Certificate
    <BLANKLINE>
    At 8 random states these equations were compared...
    """
    chosen = {"sections": ",".join(sections)} if sections else {}
    return Shown(*emit(derived, "markdown", **chosen, **options).values())


def markdown(derived: Derived) -> str:
    return emit(derived, "markdown").popitem()[1]


def formulas(derived: Derived) -> str:
    from lagrange_cli.emit.latex.document import equations_latex

    return f"$$\n{equations_latex(derived.equations)}\n$$"
