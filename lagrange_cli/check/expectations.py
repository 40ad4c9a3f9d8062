"""The checks of expectations, one for each key of ``expect``.

To add a key, add its field to :class:`~lagrange_cli.scene.conditions.Expect` and a function to
:data:`CHECKS`. A check takes the scene's expectations and the equations. It yields a located
problem for each expectation that does not hold, and nothing for keys that the scene does not have.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias

from sympy import Expr

from lagrange_cli.analysis.forms.hamiltonian import hamiltonian_form
from lagrange_cli.analysis.symmetries.linear_symmetries import linear_symmetries
from lagrange_cli.check.compare import (
    Agreement,
    expressions_agree,
    lagrangians_agree,
    proportional,
)
from lagrange_cli.check.equilibria import (
    expected_equilibria,
    expected_frequencies,
    expected_law,
)
from lagrange_cli.check.model import edits_at
from lagrange_cli.errors import Edit, Mark, Problem, nearest
from lagrange_cli.mechanics import interpret
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.notation.build import display_sum
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.scene_language import to_scene_language
from lagrange_cli.notation.vocabulary import vocabulary, with_symbols
from lagrange_cli.scene.conditions import Expect
from lagrange_cli.scene.language.expression import Equation

if TYPE_CHECKING:
    from lagrange_cli.analysis.forms.hamiltonian import Hamiltonian


_Check: TypeAlias = Callable[[Expect, Equations], Iterator[Problem]]


def _dof(expect: Expect, equations: Equations) -> Iterator[Problem]:
    account = equations.derivation.account
    if expect.dof is not None and expect.dof != account.dof:
        extra = f", E = {account.extra}" if account.extra else ""
        yield Problem(
            f"expected dof {expect.dof}, found {account.dof}",
            expect.dof_mark,
            hint=f"{', '.join(account.counted)}{extra}, K = {account.constraints}",
            rule="dof",
            edits=edits_at(expect.dof_mark, str(account.dof)),
        )


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "none"


#: A list between brackets on one line, of names without quotes.
_FLAT_LIST = re.compile(r"\[[^\[\]{}#'\"]*\]")


def _edit_of_list(mark: Mark | None, names: tuple[str, ...]) -> tuple[Edit, ...]:
    """Replace a list of names; those that are no flat list on one line are left to a person."""
    flat = None if mark is None else _FLAT_LIST.match(mark.text, mark.column - 1)
    if mark is None or flat is None:
        return ()
    return edits_at(replace(mark, length=len(flat.group())), f"[{', '.join(names)}]")


def _cyclic(expect: Expect, equations: Equations) -> Iterator[Problem]:
    if expect.cyclic is None:
        return
    if set(expect.cyclic) != set(equations.derivation.cyclic):
        yield Problem(
            f"expected cyclic coordinates: {_listed(expect.cyclic)}; "
            f"found: {_listed(equations.derivation.cyclic)}",
            expect.cyclic_mark,
            rule="cyclic",
            edits=_edit_of_list(expect.cyclic_mark, equations.derivation.cyclic),
        )
        return
    names = {c.name for c in equations.system.coordinates}
    for name in filter(names.__contains__, equations.derivation.open_questions):
        yield Problem(
            f"it cannot be decided whether '{name}' is cyclic",
            expect.cyclic_mark,
            hint="leave 'cyclic' out: the list says of every coordinate whether it is",
            rule="cyclic",
        )


def _conserved(expect: Expect, equations: Equations) -> Iterator[Problem]:
    """Require each listed quantity to be conserved; an empty list says that none is.

    Symmetries are looked for where a quantity is neither a cyclic momentum nor an energy.
    """
    if expect.conserved is None:
        return
    names = {c.name for c in equations.system.coordinates}
    if not expect.conserved:
        for name in equations.derivation.open_questions:
            if name not in names:
                yield Problem(
                    f"it cannot be decided whether '{name}' is conserved",
                    expect.conserved_mark,
                    hint="leave 'conserved' out: an empty list says that nothing is",
                    rule="conserved",
                )
    conserved = tuple(c.name for c in equations.derivation.conserved)
    if not expect.conserved and conserved:
        yield Problem(
            f"expected no conserved quantity; found: {_listed(conserved)}",
            expect.conserved_mark,
            rule="conserved",
        )
    if not expect.conserved and not conserved:
        further = tuple(symmetry.name for symmetry in linear_symmetries(equations).proven)
        if further:
            yield Problem(
                f"expected no conserved quantity; symmetries give {_listed(further)}",
                expect.conserved_mark,
                rule="conserved",
            )
    if not set(expect.conserved) <= set(conserved):
        conserved += tuple(symmetry.name for symmetry in linear_symmetries(equations).proven)
    for name in expect.conserved:
        if name not in conserved:
            yield Problem(
                f"'{name}' is not found to be conserved; found: {_listed(conserved)}",
                expect.conserved_mark,
                hint=nearest(name, conserved),
                rule="conserved",
            )


def _equations(expect: Expect, equations: Equations) -> Iterator[Problem]:
    """Require each expected equation to be a nonzero multiple of a derived one, each of another."""
    unmatched, start = list(equations.derivation.shown), _start(equations)
    for expected in expect.equations or ():
        residual, undecided = _residual(equations, expected), False
        for derived in unmatched:
            verdict = proportional(residual, derived.residual.xreplace(start), equations)
            if verdict is Agreement.SAME:
                unmatched.remove(derived)
                break
            undecided = undecided or verdict is Agreement.UNDECIDED
        else:
            listed = [
                f"{derived.coordinate}: {to_scene_language(derived.residual, equations)} = 0"
                for derived in equations.derivation.shown
            ]
            yield Problem(
                "it cannot be decided whether this is a multiple of a derived equation"
                if undecided
                else "no derived equation is a multiple of this one",
                expected.mark(),
                hint="derived\n  " + "\n  ".join(listed),
                rule="equations",
            )


def _start(equations: Equations) -> dict[Expr, Expr]:
    """Return values of constants of integration, whose symbols no scene can write."""
    named = [p for p in equations.system.parameters if p.start_of is not None]
    return {p.symbol: p.exact for p in named if p.exact is not None}


def _residual(equations: Equations, expected: Equation) -> Expr:
    return interpret(equations, expected.left) - interpret(equations, expected.right)


def _lagrangian(expect: Expect, equations: Equations) -> Iterator[Problem]:
    if expect.lagrangian is None:
        return
    expected = interpret(equations, expect.lagrangian)
    derived = equations.system.lagrangian.xreplace(_start(equations))
    verdict = lagrangians_agree(expected, derived, equations)
    if verdict is not Agreement.SAME:
        yield Problem(
            "expected Lagrangian is not the derived one, nor differs by a total time derivative"
            if verdict is Agreement.DIFFERENT
            else "it cannot be decided whether the expected Lagrangian is the derived one",
            expect.lagrangian.mark(),
            hint=f"derived: {to_scene_language(equations.system.lagrangian, equations)}",
            rule="lagrangian",
        )


def _hamiltonian(expect: Expect, equations: Equations) -> Iterator[Problem]:
    """Require H as a function of coordinates, momenta and time."""
    if expect.hamiltonian is None:
        return
    form = hamiltonian_form(equations)
    momenta = [pair.momentum for pair in form.pairs]
    expected = interpret(equations, expect.hamiltonian, {m.name: m.symbol for m in momenta})
    # Velocities that stay in H are those that the momenta determine.
    over = {m.symbol: m.expression for m in momenta} if form.coupled else {}
    over |= _start(equations)
    verdict = expressions_agree(expected.xreplace(over), form.expression.xreplace(over), equations)
    if verdict is not Agreement.SAME:
        yield Problem(
            "expected Hamiltonian is not the derived one"
            if verdict is Agreement.DIFFERENT
            else "it cannot be decided whether the expected Hamiltonian is the derived one",
            expect.hamiltonian.mark(),
            hint=f"derived: {_in_scene_language(equations, form)}",
            rule="hamiltonian",
        )


def _in_scene_language(equations: Equations, form: Hamiltonian) -> str:
    """Write H as the scene language does."""
    momenta = [(pair.momentum.symbol, pair.momentum.name, None) for pair in form.pairs]
    words = with_symbols(vocabulary(equations), momenta)
    return ScenePrinter().inline(display_sum(form.parts, words))


#: Name of a key of ``expect`` → its check, in the order in which they are made; those of motions
#: are in :data:`.motions.MOTION_CHECKS`. ``error`` is in neither: it is met by a refusal, and then
#: there are no equations to check.
CHECKS: dict[str, _Check] = {
    "dof": _dof,
    "cyclic": _cyclic,
    "conserved": _conserved,
    "equations": _equations,
    "lagrangian": _lagrangian,
    "hamiltonian": _hamiltonian,
    "equilibrium": expected_law,
    "equilibria": expected_equilibria,
    "frequencies": expected_frequencies,
}
