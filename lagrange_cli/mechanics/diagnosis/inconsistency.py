"""Irreducible inconsistent sets of equations, and their proofs.

A proof rests on substitutions without a choice, and on a false equation between
numbers, the triangle inequality (:mod:`.rod_lengths`) or a sum of squares
(:mod:`.proofs.sum_of_squares`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InconsistentError, InputError, Problem
from lagrange_cli.mechanics.diagnosis.errors import isolated_start_error, no_configuration_error
from lagrange_cli.mechanics.diagnosis.rod_lengths import overlong_rod_error
from lagrange_cli.mechanics.elimination.eliminate import Elimination, StatedEquation, substitute
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.rank import RANK_TOLERANCE
from lagrange_cli.mechanics.numerics.sampling import Sampler, typical_length
from lagrange_cli.mechanics.proofs.sum_of_squares import contradicting_equations
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.quoting import contradict, leave_out, quoted, written

#: Most equations that are reduced to an irreducible set, an elimination each. This and the next two
#: numbers keep a refusal quick; beyond them it names more equations. None is tuned.
_MOST = 40
#: Most equations that are tried each by itself.
_MOST_SINGLE = 200
#: Most equations that are reduced by a search for a configuration each.
_MOST_SEARCHES = 12
#: Most names that a message lists: half a line of a terminal.
_NAMED = 4

_Sides = tuple[sp.Expr, sp.Expr]


@dataclass(frozen=True)
class _Proof:
    """Reduced equations that are not all satisfied.

    Attributes
    ----------
    numbers
        True if they are false as numbers, false if by a sum of squares.
    """

    equations: tuple[_Sides, ...]
    numbers: bool


def irreducible_subset(
    suspects: Sequence[int], wrong: Callable[[Sequence[int]], bool]
) -> list[int]:
    """Reduce suspects to a set that is still wrong, of which no member can be left out.

    The deletion filter of Chinneck and Dravnieks (ORSA J. Computing 3, 1991).
    """
    subset = list(suspects)
    for candidate in suspects:
        fewer = [k for k in subset if k != candidate]
        if fewer and wrong(fewer):
            subset = fewer
    return subset


def proven_inconsistency(
    names: Names,
    stated: Sequence[StatedEquation],
    suspects: Sequence[int],
    reference: Mapping[sp.Symbol, mpf],
) -> InputError | None:
    """Name an irreducible inconsistent set of the suspects in an error; None without proof.

    Parameters
    ----------
    suspects
        Numbers of stated equations.
    reference
        Values of parameters, among others.
    """
    constants = {p: reference[p] for p in names.parameters.values() if p in reference}

    def wrong(numbers: Sequence[int]) -> bool:
        return _proof(names, [stated[k] for k in numbers], constants) is not None

    suspects = sorted(suspects)
    if len(suspects) > _MOST or not wrong(suspects):
        return None
    chosen = [stated[k] for k in irreducible_subset(suspects, wrong)]
    rods = overlong_rod_error(names, chosen, reference)
    proof = _proof(names, chosen, constants)
    assert proof is not None
    return rods or _refusal(names, chosen, proof)


def contradiction_error(
    names: Names,
    elimination: Elimination,
    number: int,
    reduced: sp.Expr,
    reference: Mapping[sp.Symbol, mpf],
) -> InputError:
    """Refuse a stated equation that was reduced to a false one."""
    used = sorted(elimination.touched[number] | {number})
    proven = proven_inconsistency(names, elimination.stated, used, reference)
    if proven is not None:
        return proven
    stated = [elimination.stated[k] for k in used]
    listed = quoted([s.constraint for s in stated])
    return InconsistentError(
        Problem(
            f"with what else is given {listed} comes to {written(reduced)} = 0,"
            " which does not hold",
            elimination.stated[number].equation.mark(),
            hint=leave_out([s.constraint for s in stated]),
            rule="inconsistent",
        )
    )


def diagnose_no_configuration(
    names: Names,
    elimination: Elimination,
    restricting: Sequence[int],
    sampler: Sampler,
    reference: Mapping[sp.Symbol, mpf],
) -> InputError:
    """Explain why no configuration was found: by a proof, or by the equations of a search.

    Parameters
    ----------
    restricting
        Numbers of the equations of the search; empty if names were not real.
    sampler
        Draws configurations that satisfy them.
    """
    proven = overlong_rod_error(names, elimination.stated, reference)
    if proven is None and restricting:
        proven = proven_inconsistency(
            names, elimination.stated, elimination.behind(restricting), reference
        )
    if proven is None:
        proven = proven_inconsistency(
            names, elimination.stated, range(len(elimination.stated)), reference
        )
    proven = proven or _by_itself(names, elimination, restricting, reference)
    if proven is not None:
        return proven
    if restricting and _are_met(elimination, restricting, reference):
        return isolated_start_error(names.scene, elimination, restricting)
    if 1 < len(restricting) <= _MOST_SEARCHES:
        rows = irreducible_subset(
            range(len(restricting)), lambda fewer: sampler.draw(closures=fewer) is None
        )
        restricting = [restricting[k] for k in rows]
        proven = proven_inconsistency(
            names, elimination.stated, elimination.behind(restricting), reference
        )
    return proven or no_configuration_error(names.scene, elimination, restricting)


def _are_met(
    elimination: Elimination, restricting: Sequence[int], reference: Mapping[sp.Symbol, mpf]
) -> bool:
    """Say whether the given configuration is complete and satisfies equations by number."""
    residuals = [left - right for left, right in (elimination.pending[k] for k in restricting)]
    if not all(r.free_symbols <= reference.keys() for r in residuals):
        return False
    try:
        sizes = evaluate(residuals, reference)
    except (DomainError, ZeroDivisionError, OverflowError):
        return False
    scale = typical_length([reference[s] for r in residuals for s in r.free_symbols])
    return all(abs(value) <= RANK_TOLERANCE * scale**2 for value in sizes)


def _by_itself(
    names: Names,
    elimination: Elimination,
    restricting: Sequence[int],
    reference: Mapping[sp.Symbol, mpf],
) -> InputError | None:
    """Find a single equation that nothing satisfies; None without proof."""
    constants = {p: reference[p] for p in names.parameters.values() if p in reference}
    tried = set()
    for number in restricting[:_MOST_SINGLE]:
        left, right = elimination.pending[number]
        shape = _shape(left - right, constants)
        if shape in tried:
            continue
        tried.add(shape)
        if contradicting_equations([left - right], constants):
            return proven_inconsistency(
                names, elimination.stated, elimination.behind([number]), reference
            )
    return None


def _shape(equation: sp.Expr, constants: Mapping[sp.Symbol, mpf]) -> sp.Expr:
    """Number the unknowns of an equation, so that elements of a family have one shape."""
    unknowns = sorted(equation.free_symbols - constants.keys(), key=str)
    return equation.xreplace({s: sp.Symbol(f"{k}", real=True) for k, s in enumerate(unknowns)})


def is_contradictory(
    names: Names,
    stated: Sequence[StatedEquation],
    constants: Mapping[sp.Symbol, mpf],
    products: Sequence[bool] = (False, True),
) -> bool:
    """Say whether equations and inequalities are proven not to hold together.

    ``products``: as :func:`.proofs.sum_of_squares.contradicting_equations` tries them.
    """
    return _proof(names, stated, constants, products) is not None


def _proof(
    names: Names,
    stated: Sequence[StatedEquation],
    constants: Mapping[sp.Symbol, mpf],
    products: Sequence[bool] = (False, True),
) -> _Proof | None:
    declared = set(names.coordinates.values())
    unknowns = [s for s in names.cartesian.values() if s not in names.given and s not in declared]
    parameters = frozenset(names.parameters.values())
    equations = [s for s in stated if not s.one_sided]
    state = substitute(equations, names.given, unknowns, parameters, constants)
    pending = list(state.pending.values())
    for sides in pending:
        if _is_false(sides, parameters | {names.t}, constants):
            return _Proof((sides,), numbers=True)
    # A number that is not negative is a square.
    pending += [(state.reduce(s.phi), sp.Dummy(real=True) ** 2) for s in stated if s.one_sided]
    numbers = contradicting_equations(
        [left - right for left, right in pending], constants, products
    )
    if numbers is None:
        return None
    return _Proof(tuple(pending[k] for k in numbers), numbers=False)


def _is_false(
    sides: _Sides, settled: frozenset[sp.Symbol], constants: Mapping[sp.Symbol, mpf]
) -> bool:
    """Say whether an equation without moving names is not satisfied.

    ``settled`` symbols without a value may have any value: they satisfy identities alone.
    """
    left, right = sides
    symbols = (left - right).free_symbols
    if not symbols <= settled:
        return False
    point = {
        p: constants.get(p, mpmath.sqrt(2 + k)) for k, p in enumerate(sorted(symbols, key=str))
    }
    terms = [*sp.Add.make_args(left), *sp.Add.make_args(right)]
    try:
        *parts, total = evaluate([*terms, left - right], point)
    except DomainError:
        return False
    return bool(abs(total) > RANK_TOLERANCE * sum(map(abs, parts)))


def _refusal(names: Names, stated: Sequence[StatedEquation], proof: _Proof) -> InputError:
    named = list(dict.fromkeys(s.constraint for s in stated))
    listed = quoted(named)
    defined = any(s in names.given for s in stated[0].phi.free_symbols)
    if len(stated) > 1:
        message = f"{contradict(named, 'contradicts itself')}: {_outcome(names, proof)}"
    elif defined:
        message = f"constraint {listed} contradicts the definitions: {_outcome(names, proof)}"
    elif proof.numbers and stated[0].phi.free_symbols:
        message = f"constraint {listed} holds for no motion: the parameters do not satisfy it"
    else:
        message = f"constraint {listed} cannot hold: {_no_real(names, proof)} satisfies it"
    return InconsistentError(
        Problem(
            message,
            stated[-1].equation.mark(),
            hint=leave_out([s.constraint for s in stated]),
            rule="inconsistent",
        )
    )


def _outcome(names: Names, proof: _Proof) -> str:
    """Describe the reduced equations in words."""
    if len(proof.equations) > 1:
        return f"{_no_real(names, proof)} satisfies them together"
    ((left, right),) = proof.equations
    come = f"together they give {written(left)} = {written(right)}"
    return come if proof.numbers else f"{come}, which {_no_real(names, proof)} satisfies"


def _no_real(names: Names, proof: _Proof) -> str:
    symbols = {s for a, b in proof.equations for s in (a - b).free_symbols}
    moving = sorted(str(s) for s in symbols - set(names.parameters.values()))
    if len(moving) > _NAMED:
        return "no configuration"
    return f"no real {', '.join(moving)}" if moving else "no number"
