"""Answers to an exercise against the derivation of its scene: what is wrong, and by which term."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from time import perf_counter

import sympy
from sympy import Expr

from lagrange_cli.analysis.symmetries.linear_symmetries import linear_symmetries
from lagrange_cli.cache import Cache
from lagrange_cli.check.compare import (
    Agreement,
    lagrangians_agree,
    linear_row,
    proportional,
    within_span,
)
from lagrange_cli.check.model import Report, SceneReport
from lagrange_cli.check.terms import Closest, Difference, closest
from lagrange_cli.check.walk import name_of
from lagrange_cli.errors import InputError, Mark, Problem, nearest
from lagrange_cli.files import read_bytes
from lagrange_cli.mechanics import interpret
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.dynamics.accelerations import differentiated, explicit_form
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.stored_derivation import stored_derivation
from lagrange_cli.notation.scene_language import to_scene_language
from lagrange_cli.scene import SceneText
from lagrange_cli.scene.answers import Answers, read_answers
from lagrange_cli.scene.language.expression import Add, Equation, Expression, Name, Neg, Node


def judged_answers(
    scene: str, answers: Sequence[str], parameters: dict[str, str], cache: Cache | None
) -> Report:
    """Judge files of answers to the exercise that a scene is.

    A file that holds no answers is ``invalid`` in the report.

    Raises
    ------
    InputError
        The scene is refused.
    """
    text = SceneText(name_of(scene), read_bytes(scene), parameters)
    equations = stored_derivation(text.read(), text, cache)
    return Report(tuple(_judged(path, equations) for path in answers))


def _judged(path: str, equations: Equations) -> SceneReport:
    started = perf_counter()
    functions = {f.name: f.arity for f in equations.system.functions}
    try:
        answers = read_answers(path, dict(equations.presentation.sizes), functions)
        problems = tuple(_first_of_families(_wrong(answers, _Derived(equations))))
    except InputError as error:
        return SceneReport(path, "invalid", perf_counter() - started, error.problems)
    return SceneReport(path, "fail" if problems else "pass", perf_counter() - started, problems)


def _first_of_families(problems: Iterable[Problem]) -> Iterator[Problem]:
    """Yield the first problem at each place, with the number of those of the same family."""
    families: dict[tuple[Mark | None, str], list[Problem]] = {}
    for problem in problems:
        families.setdefault((problem.mark, problem.rule), []).append(problem)
    for first, *others in families.values():
        count = len(others)
        several = f"{count} others of this family are wrong, too"
        hint = "another of this family is wrong, too" if count == 1 else several
        yield replace(first, hint=hint) if count else first


class _Derived:
    """The derivation that answers are compared with.

    Attributes
    ----------
    equations
        The derivation.
    unknown
        Accelerations and multipliers, which equations of motion are linear in.
    residuals
        Left sides of the equations of motion, each with its coordinate.
    rows
        Coefficients of the unknown and what is left, of these and of closures differentiated.
    """

    def __init__(self, equations: Equations) -> None:
        system = equations.system
        self.equations = equations
        start = {p.symbol: p.exact for p in system.parameters if p.start_of and p.exact is not None}
        self.residuals = {
            shown.coordinate: shown.residual.xreplace(start) for shown in equations.derivation.shown
        }
        self.unknown = [c.a for c in system.coordinates]
        self.unknown += [closure.multiplier for closure in system.pushing]
        residuals = [
            *self.residuals.values(),
            *(differentiated(equations, closure).residual for closure in system.closures),
        ]
        rows = (linear_row(residual, self.unknown) for residual in residuals)
        self.rows = [row for row in rows if row is not None]

    def solves(self, row: list[Expr]) -> Agreement:
        """Say whether a row of an equation linear in the unknown follows from those derived."""
        verdict = within_span(row, self.rows, self.equations)
        if verdict is Agreement.DIFFERENT and self.equations.system.closures:
            # It may follow where the closures hold, which random states do not satisfy.
            return Agreement.UNDECIDED
        return verdict

    def closest(self, written: Expr, others: Sequence[Expr]) -> Closest | None:
        return closest(written, others, self.unknown)

    def clauses(self, differences: Sequence[Difference], where: str) -> str:
        """Describe terms that are off, a clause each; ``where``: the side of those missing."""
        return "; ".join(self._clause(difference, where) for difference in differences)

    def _clause(self, difference: Difference, where: str) -> str:
        def text(term: Expr) -> str:
            return to_scene_language(term, self.equations)

        if difference.written == 0:
            return f"the term {text(difference.right)} is missing{where}"
        # Signs are those of the side on which a term was written.
        has_minus = difference.written.could_extract_minus_sign()
        term = f"the term {text(-difference.written if has_minus else difference.written)}"
        if difference.right == 0:
            return f"{term} is too much"
        if difference.factor == -1:
            return f"{term} has the wrong sign"
        return f"{term} lacks the factor {text(difference.factor)}"


def _wrong(answers: Answers, derived: _Derived) -> Iterator[Problem]:
    """Yield a problem for everything that is wrong, or cannot be decided."""
    yield from _dof(answers, derived.equations)
    yield from _cyclic(answers, derived.equations)
    yield from _lagrangian(answers, derived)
    yield from _equations(answers, derived)
    yield from _conserved(answers, derived)


def _dof(answers: Answers, equations: Equations) -> Iterator[Problem]:
    account = equations.derivation.account
    if answers.dof is None or answers.dof == account.dof:
        return
    off = answers.dof - account.dof
    extra = f", E = {account.extra}" if account.extra else ""
    yield Problem(
        f"{answers.dof} degrees of freedom are {abs(off)} too {'many' if off > 0 else 'few'}",
        answers.marks["dof"],
        hint=f"{', '.join(account.counted)}{extra}, K = {account.constraints}",
        rule="dof",
    )


def _cyclic(answers: Answers, equations: Equations) -> Iterator[Problem]:
    if answers.cyclic is None:
        return
    derivation, named = equations.derivation, {name for name, _ in answers.cyclic}
    coordinates = [c.name for c in equations.system.coordinates]
    for name, mark in answers.cyclic:
        if name not in coordinates:
            hint = nearest(name, coordinates) or f"coordinates are {', '.join(coordinates)}"
            raise InputError(Problem(f"'{name}' is no coordinate", mark, hint, "unknown-name"))
        if name in derivation.open_questions:
            message = f"it cannot be decided whether '{name}' is cyclic"
            yield Problem(message, mark, rule="cyclic")
        elif name not in derivation.cyclic:
            yield Problem(f"'{name}' is not cyclic", mark, rule="cyclic")
    for name in derivation.cyclic:
        if name not in named:
            yield Problem(f"'{name}' is cyclic, too", answers.marks["cyclic"], rule="cyclic")


def _lagrangian(answers: Answers, derived: _Derived) -> Iterator[Problem]:
    if answers.lagrangian is None:
        return
    equations = derived.equations
    written = interpret(equations, answers.lagrangian)
    right = equations.system.lagrangian
    verdict = lagrangians_agree(written, right, equations)
    if verdict is Agreement.SAME:
        return
    message = "it cannot be decided whether this is a Lagrangian of the system"
    if verdict is Agreement.DIFFERENT:
        near = derived.closest(written, [right])
        message = "this is no Lagrangian of the system" + _colon(derived, near)
    yield Problem(message, answers.lagrangian.mark(), rule="lagrangian")


def _colon(derived: _Derived, near: Closest | None, where: str = "") -> str:
    """Return what is off behind a colon, if the closest one is close."""
    is_close = near is not None and len(near.differences) <= 2 * near.agreeing
    return f": {derived.clauses(near.differences, where)}" if near is not None and is_close else ""


# Equations of motion.


def _equations(answers: Answers, derived: _Derived) -> Iterator[Problem]:
    """Yield equations that do not hold along the motion, and coordinates that have none."""
    if answers.equations is None:
        return
    equations = derived.equations
    right, met, missing = list[list[Expr]](), set[str](), len(derived.residuals)
    for written in answers.equations:
        residual = interpret(equations, written.left) - interpret(equations, written.right)
        row = linear_row(residual, derived.unknown)
        same = _same(residual, derived)
        if same is None and (verdict := _verdict(residual, row, derived)) is not Agreement.SAME:
            problem, about = _off(written, residual, verdict, derived)
            met |= {about} if about is not None else set()
            missing -= 1
            yield problem
        elif row is not None and any(entry != 0 for entry in row[:-1]):
            follows = right and within_span(row, right, equations) is not Agreement.DIFFERENT
            missing -= not follows
            right.append(row)
            met |= {same} if same is not None else set()
    for name, residual in derived.residuals.items():
        row = linear_row(residual, derived.unknown)
        if missing <= 0 or name in met or row is None:
            continue
        if not right or within_span(row, right, equations) is Agreement.DIFFERENT:
            missing -= 1
            message = f"there is no equation of motion of '{name}'"
            yield Problem(message, answers.marks["equations"], rule="equations")


def _same(residual: Expr, derived: _Derived) -> str | None:
    """Return the coordinate of whose equation a residual is a multiple."""
    for name, known in derived.residuals.items():
        # Multiples hold the same unknown.
        alike = all(residual.has(s) == known.has(s) for s in derived.unknown)
        if alike and proportional(residual, known, derived.equations) is Agreement.SAME:
            return name
    return None


def _verdict(residual: Expr, row: list[Expr] | None, derived: _Derived) -> Agreement:
    if row is None or not any(entry != 0 for entry in row):
        return Agreement.DIFFERENT
    if not any(entry != 0 for entry in row[:-1]):
        closures = [closure.expression for closure in derived.equations.system.closures]
        near = derived.closest(residual, closures)
        is_closure = near is not None and not near.differences
        return Agreement.SAME if is_closure else Agreement.DIFFERENT
    return derived.solves(row)


def _off(
    written: Equation, residual: Expr, verdict: Agreement, derived: _Derived
) -> tuple[Problem, str | None]:
    """Return what is wrong with an equation, and the coordinate whose equation it is close to."""
    if verdict is Agreement.UNDECIDED:
        message = "it cannot be decided whether this holds along the motion"
        return Problem(message, written.mark(), rule="equations"), None
    known = [*derived.residuals.items(), *_solved(residual, derived)]
    near = derived.closest(residual, [expression for _, expression in known])
    clauses = _colon(derived, near, " on the left")
    if near is None or not clauses:
        message = "this does not hold along the motion"
        return Problem(message, written.mark(), rule="equations"), None
    name = known[near.index][0]
    place = _place(written, near.differences[0], derived.equations)
    return Problem(f"in the equation of '{name}' {clauses[2:]}", place, rule="equations"), name


def _solved(residual: Expr, derived: _Derived) -> Iterator[tuple[str, Expr]]:
    """Yield the acceleration that a residual alone holds, solved for, of coupled ones."""
    if sum(residual.has(symbol) for symbol in derived.unknown) != 1:
        return
    solved = explicit_form(derived.equations).accelerations
    for c, value in zip(derived.equations.system.coordinates, solved, strict=True):
        if value is not None and residual.has(c.a):
            yield c.name, c.a - value


def _place(written: Equation, difference: Difference, equations: Equations) -> Mark:
    """Return the place of the term that is off, or that of the equation."""
    for side in (written.left, written.right):
        for node in _summands(side.node):
            term = interpret(equations, Expression(node, side.text, side.origin, side.exact))
            if difference.written != 0 and sympy.expand(term) in (
                difference.written,
                -difference.written,
            ):
                return side.mark(node.span)
    return written.mark()


def _summands(node: Node) -> Iterator[Node]:
    if isinstance(node, Add):
        for _, term in node.terms:
            yield from _summands(term)
    elif isinstance(node, Neg):
        yield from _summands(node.operand)
    else:
        yield node


# Conserved quantities.


def _conserved(answers: Answers, derived: _Derived) -> Iterator[Problem]:
    """Yield what is not conserved, and what is and was not named."""
    if answers.conserved is None:
        return
    equations = derived.equations
    known = {one.name: one.expression for one in equations.derivation.conserved}
    names = [q.node.name if isinstance(q.node, Name) else "" for q in answers.conserved]
    further = {}
    if any(name[:2] in ("P_", "L_", "J_") or name.startswith("boost_") for name in names):
        further = {one.name: one.expression for one in linear_symmetries(equations).proven}
    right: list[list[Expr]] = []
    for name, quantity in zip(names, answers.conserved, strict=True):
        if name in known or name in further:
            right.append(_gradient((further | known)[name], equations))
            continue
        if name in ("energy", "jacobi") or name in {
            f"p_{c.name}" for c in equations.system.coordinates
        }:
            yield Problem(f"'{name}' is not conserved", quantity.mark(), rule="conserved")
            continue
        written = interpret(equations, quantity)
        verdict = _is_conserved(written, [*known.values()], derived)
        if verdict is Agreement.SAME:
            right.append(_gradient(written, equations))
        else:
            yield _not_conserved(quantity, written, verdict, known, derived)
    for name, expression in known.items():
        row = _gradient(expression, equations)
        if not right or within_span(row, right, equations) is Agreement.DIFFERENT:
            mark = answers.marks["conserved"]
            yield Problem(f"'{name}' is conserved, too", mark, rule="conserved")


def _gradient(expression: Expr, equations: Equations) -> list[Expr]:
    """Return the derivatives of a quantity by coordinates, velocities and time."""
    moving = [s for c in equations.system.coordinates for s in (c.q, c.v)]
    return [derivative(expression, s) for s in (*moving, equations.system.t)]


def _is_conserved(written: Expr, known: Sequence[Expr], derived: _Derived) -> Agreement:
    """Decide by the rate of a quantity, or by its being a function of what is conserved."""
    equations = derived.equations
    gradient = _gradient(written, equations)
    if not any(entry != 0 for entry in gradient):
        return Agreement.DIFFERENT  # a constant says nothing
    rows = [_gradient(expression, equations) for expression in known]
    if rows and within_span(gradient, rows, equations) is Agreement.SAME:
        return Agreement.SAME
    system = equations.system
    chain = [(c.q, c.v) for c in system.coordinates] + [(c.v, c.a) for c in system.coordinates]
    rate = sympy.Add(derivative(written, system.t), *(derivative(written, s) * r for s, r in chain))
    row = linear_row(rate, derived.unknown)
    if row is None or system.contacts:
        return Agreement.UNDECIDED
    return derived.solves(row)


def _without_constants(expression: Expr, equations: Equations) -> Expr:
    moving = {s for c in equations.system.coordinates for s in (c.q, c.v)} | {equations.system.t}
    return sympy.Add(*(t for t in sympy.Add.make_args(sympy.expand(expression)) if t.has(*moving)))


def _not_conserved(
    quantity: Expression,
    written: Expr,
    verdict: Agreement,
    known: dict[str, Expr],
    derived: _Derived,
) -> Problem:
    if verdict is Agreement.UNDECIDED:
        message = "it cannot be decided whether this is conserved"
    else:
        near = derived.closest(
            _without_constants(written, derived.equations),
            [_without_constants(expression, derived.equations) for expression in known.values()],
        )
        clauses = _colon(derived, near)
        message = "this is not conserved"
        if near is not None and clauses:
            message += f"; of '{[*known][near.index]}' {clauses[2:]}"
    return Problem(message, quantity.mark(), rule="conserved")
