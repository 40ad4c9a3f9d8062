"""Errors of a failed reduction, each with a hint that mends it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy as sp

from lagrange_cli.errors import InconsistentError, InputError, Mark, Problem, SingularError
from lagrange_cli.mechanics.elimination.eliminate import Elimination, StatedEquation
from lagrange_cli.mechanics.elimination.solve_equation import solutions
from lagrange_cli.mechanics.numerics.sampling import DRAWS, PLACED_DRAWS
from lagrange_cli.mechanics.symbols.quoting import (
    changed_initial,
    coordinates_snippet,
    fewer_coordinates_snippet,
    leave_out,
    must_stay,
    near_snippet,
    quoted,
    undeclared_names,
    written,
)
from lagrange_cli.scene.bodies import bodies_of
from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.model import Scene

#: Coordinates, particles or constraints of a system that is derived: a derivation takes about a
#: hundredth of a second for each, and a megabyte for some tens of them.
LARGEST_SYSTEM = 20_000


def require_size(scene: Scene) -> None:
    """Refuse a system that is too large to be derived, before anything is done with it."""
    for what, parts in (
        ("coordinates", scene.coordinates or ()),
        ("particles", scene.particles),
        ("constraints", scene.constraints),
    ):
        if len(parts) > LARGEST_SYSTEM:
            mark = parts[LARGEST_SYSTEM].mark
            message = f"{len(parts):,} {what}: systems of up to {LARGEST_SYSTEM:,} are derived"
            hint = "the equations of a family are those of fewer members: set its size by -p"
            raise InputError(Problem(message, mark, hint, rule="limit"))


def nesting_error(scene: Scene) -> InputError:
    """Build the refusal of expressions nested hundreds of levels deep."""
    mark = scene.definitions[0].mark if scene.definitions else Mark(scene.file, 1, 1)
    message = "expressions nest too deeply once names stand for what they are defined as"
    return InputError(Problem(message, mark, "define fewer names by each other", rule="limit"))


def not_positive(name: str, value: Expression) -> InputError:
    """Refuse a value of a coordinate that is declared positive."""
    message = f"coordinate '{name}' is declared positive, found {value.text}"
    return InputError(Problem(message, value.mark(), rule="not-positive"))


def require_enough(scene: Scene, elimination: Elimination) -> None:
    """Refuse declared coordinates if open names outnumber the equations that hold any of them."""
    if scene.coordinates is None:
        return
    usable = sum(bool(_open_names(elimination, number)) for number in elimination.pending)
    excess = len(elimination.unknowns) - usable
    if excess > 0:
        raise too_few_error(scene, elimination, excess)


def _open_names(elimination: Elimination, number: int) -> list[sp.Symbol]:
    left, right = elimination.pending[number]
    return elimination.in_order((left - right).free_symbols)


def too_few_error(scene: Scene, elimination: Elimination, excess: int) -> InputError:
    """Refuse declared coordinates and constraints that leave names undetermined."""
    open_names = [u.name for u in elimination.unknowns]
    have = [c.name for c in scene.coordinates or ()]
    # Equations between coordinates alone remove degrees of freedom.
    fixing = sum(not _open_names(elimination, number) for number in elimination.pending)
    free = _undetermined(elimination)
    free += [name for name in open_names if name not in free][: max(0, excess - len(free))]
    which = quoted(open_names)
    if len(free) < len(open_names):
        which = f"{len(free)} of {which}"
    return InputError(
        Problem(
            f"too few coordinates: nothing determines {which}"
            f" ({len(have)} declared, {len(have) + len(free) - fixing} degrees of freedom)",
            scene.coordinates_mark,
            hint=_definitions_snippet(elimination, have) or coordinates_snippet([*have, *free]),
            rule="too-few-coordinates",
        )
    )


def _definitions_snippet(elimination: Elimination, have: Sequence[str]) -> str:
    """Return definitions over a declared coordinate that nothing holds, of names on a circle;
    empty where that is not so."""
    used = {s.name for sides in elimination.pending.values() for e in sides for s in e.free_symbols}
    unrelated = [name for name in have if name not in used]
    names = [u for u in elimination.unknowns if u.name not in have]
    if len(unrelated) != 1 or len(names) != 2 or len(elimination.pending) != 1:
        return ""
    ((left, right),) = elimination.pending.values()
    square = sp.expand(names[0] ** 2 + names[1] ** 2 - left + right)
    if not square.free_symbols.isdisjoint(names):
        return ""
    is_square = square.is_Pow and square.exp == 2
    radius = str(square.base) if is_square else f"sqrt({square})".replace("**", "^")
    (angle,), (across, down) = unrelated, (u.name for u in names)
    return f"definitions: {{{across}: {radius}*sin({angle}), {down}: -{radius}*cos({angle})}}"


def _undetermined(elimination: Elimination) -> list[str]:
    """List open names that no equation is left to determine.

    A largest matching of equations and names, by augmenting paths.
    """
    by: dict[sp.Symbol, int] = {}

    def assign(number: int, tried: set[sp.Symbol]) -> bool:
        for s in reversed(_open_names(elimination, number)):
            if s not in tried:
                tried.add(s)
                if s not in by or assign(by[s], tried):
                    by[s] = number
                    return True
        return False

    for number in elimination.pending:
        assign(number, set())
    return [s.name for s in elimination.unknowns if s not in by]


def too_many_error(
    scene: Scene,
    stated: StatedEquation,
    involved: Sequence[sp.Symbol],
    remaining: Sequence[str],
    dropped: tuple[str, sp.Expr],
) -> InputError:
    """Refuse a constraint that relates coordinates, or fixes one.

    Parameters
    ----------
    remaining
        The coordinates but for the one to be ``dropped``, which comes with its value.
    """
    name, value = dropped
    verb = "fixes" if len(involved) == 1 else "relates"
    hint = fewer_coordinates_snippet(scene, remaining, {name: written(value)})
    if must_stay(scene, name):
        hint = _WITHOUT_ONE.format(quoted(involved))
    return InputError(
        Problem(
            f"too many coordinates: constraint '{stated.constraint}' {verb} {quoted(involved)}"
            f" ({len(remaining) + 1} declared)",
            stated.equation.mark(),
            hint=hint,
            rule="too-many-coordinates",
        )
    )


#: Hint for the case that a force or ``expect`` names every coordinate.
_WITHOUT_ONE = (
    "leave one of {} out of 'coordinates', and let no force act on it and 'expect' not name it"
)


def remaining_coordinates(scene: Scene, *phis: sp.Expr) -> list[str]:
    """Write the coordinates that remain beside proposed equations φ = 0; empty if all do."""
    declared = [c.name for c in scene.coordinates or ()]
    dropped: dict[str, str] = {}
    undeclared = undeclared_names(scene)
    for phi in phis:
        if any(s.name in undeclared for s in phi.free_symbols):
            continue  # the equation determines such a name, not a coordinate
        for q in sorted(phi.free_symbols, key=str, reverse=True):
            free = q.name in declared and q.name not in dropped and not must_stay(scene, q.name)
            ways = (solutions(phi, q) or []) if free else []
            if len(ways) == 1:
                dropped[q.name] = written(ways[0])
                break
    remaining = [name for name in declared if name not in dropped]
    return [fewer_coordinates_snippet(scene, remaining, dropped)] if dropped else []


def dependence_error(
    scene: Scene, coordinates: Sequence[str], mixed: Sequence[str], ways: int
) -> InputError:
    """Refuse ``mixed`` coordinates that move particles in fewer ``ways`` than there are of them."""
    hint = "give one of them inertia in 'kinetic', or leave it out"
    for name in reversed(mixed):
        if not must_stay(scene, name):
            value = next(
                (e.value.text for e in scene.initial if (e.name, e.order) == (name, 0)), "1"
            )
            remaining = [coordinate for coordinate in coordinates if coordinate != name]
            hint = f"{hint}:\n{fewer_coordinates_snippet(scene, remaining, {name: value})}"
            break
    return InputError(
        Problem(
            f"the coordinates {quoted(mixed)} are not independent:"
            f" they move the particles in {ways} {'way' if ways == 1 else 'ways'} only",
            scene.coordinates_mark or Mark(scene.file, 1, 1),
            hint=hint,
            rule="dependent-coordinates",
        )
    )


def no_configuration_error(
    scene: Scene, elimination: Elimination, related: Sequence[int] = ()
) -> InputError:
    """Report that no real configuration was found, naming the constraints solved or kept.

    Parameters
    ----------
    related
        Numbers of the equations that a search was to satisfy.
    """
    used = [elimination.stated[k] for k in sorted(set(elimination.by.values()))] or list(
        elimination.stated
    )
    starts = PLACED_DRAWS if related else DRAWS
    if related:
        used = equations_behind(elimination, related)
    constraints = list(dict.fromkeys(s.constraint for s in used))
    named = quoted(constraints) or "the scene"
    hint = "give one in 'initial' or 'near'"
    if len(constraints) > 1:
        hint += ", or leave one of these constraints out"
    return InconsistentError(
        Problem(
            f"no configuration found in {starts} starts that satisfies {named}",
            used[0].equation.mark() if used else Mark(scene.file, 1, 1),
            hint=hint,
            rule="inconsistent",
        )
    )


def isolated_start_error(
    scene: Scene, elimination: Elimination, related: Sequence[int]
) -> InputError:
    """Refuse a configuration that satisfies equations while none beside it does."""
    constraints = list(dict.fromkeys(s.constraint for s in equations_behind(elimination, related)))
    return SingularError(
        Problem(
            f"nothing moves at the given configuration: it satisfies {quoted(constraints)}, and no"
            " other one beside it was found that does",
            equations_behind(elimination, related)[-1].equation.mark(),
            hint="what is taut has no equations of motion: give it room, as a longer rod",
            rule="singular",
        )
    )


def no_solution_error(stated: StatedEquation) -> InputError:
    """Refuse an equation whose solution by an inverse function does not satisfy it."""
    return InconsistentError(
        Problem(
            f"constraint '{stated.constraint}' cannot hold where the given configuration is",
            stated.equation.mark(),
            hint="one side has a range that the other does not reach",
            rule="inconsistent",
        )
    )


def satisfied_elsewhere_error(
    scene: Scene, stated: StatedEquation, values: Mapping[str, str]
) -> InputError:
    """Refuse an equation that definitions satisfy around some values, but not at the start."""
    place = ", ".join(f"{name} = {value}" for name, value in values.items())
    initial = {e.name for e in scene.initial if not e.order}
    known = values.keys() <= initial | {e.name for e in scene.near}
    why = "not around the initial configuration" if known else "no initial configuration chooses it"
    line = (
        changed_initial(scene, values) if initial & values.keys() else near_snippet(scene, values)
    )
    return SingularError(
        Problem(
            f"constraint '{stated.constraint}' is satisfied by the definitions on a part of the"
            f" configurations only, as around {place}: {why}",
            stated.equation.mark(),
            hint=f"start there, or leave the constraint out\n{line}",
            rule="singular",
        )
    )


def equations_behind(elimination: Elimination, numbers: Sequence[int]) -> list[StatedEquation]:
    """List equations by number, with the equations that were put into them."""
    return [elimination.stated[k] for k in elimination.behind(numbers)]


def singular_error(scene: Scene, elimination: Elimination, numbers: Sequence[int]) -> InputError:
    """Refuse needed equations whose gradients depend on each other wherever they hold."""
    stated = equations_behind(elimination, numbers)
    named = list(dict.fromkeys(s.constraint for s in stated))
    what, why = "constraint", "is singular: wherever it holds, its gradient vanishes"
    if len(named) > 1:
        what = "constraints"
        why = "are singular: wherever they hold, their gradients depend on each other"
    hint = "write it so that it crosses zero where it holds"
    if len(named) > 1:
        hint = leave_out(named)
    squares = [s for s in stated if all(map(_is_square, sp.Add.make_args(s.phi)))]
    if len(squares) == 1:
        hint = "write equations that cross zero: x = 0 in place of x^2 = 0"
        roots = _roots(squares[0].phi)
        lines = [f"{squares[0].constraint}: {_crossing(roots)}"]
        lines += remaining_coordinates(scene, *roots)
        hint = "\n".join([hint, *lines])
    return SingularError(
        Problem(
            f"{what} {quoted(named)} {why}",
            elimination.stated[numbers[-1]].equation.mark(),
            hint=hint,
            rule="singular",
        )
    )


def _roots(squares: sp.Expr) -> list[sp.Expr]:
    """Take the square root of each term of a sum of squares."""
    return [
        sp.Mul(
            *(
                b ** (e / 2)
                for b, e in (f.as_base_exp() for f in sp.Mul.make_args(term))
                if e.is_even
            )
        )
        for term in sp.Add.make_args(squares)
    ]


def _crossing(roots: Sequence[sp.Expr]) -> str:
    """Write equations that say that expressions vanish."""
    equations = [f"{written(root)} = 0" for root in roots]
    return equations[0] if len(equations) == 1 else f"[{', '.join(equations)}]"


def is_sum_of_squares(phi: sp.Expr) -> bool:
    """Say whether φ is a sum of squares of one sign, which vanishes only if each of them does."""
    signs = set[bool]()
    for term in sp.Add.make_args(phi):
        number, product = term.as_coeff_Mul()
        if product.is_number or not _is_square(product):
            return False
        signs.add(bool(number > 0))
    return len(signs) == 1


def _is_square(term: sp.Expr) -> bool:
    factors = (f.as_base_exp() for f in sp.Mul.make_args(term) if not f.is_number)
    return all(exponent.is_even for _, exponent in factors)


def unwritten_chain(scene: Scene) -> InputError:
    """The refusal to write equations that a recursion over many frames gives."""
    return InputError(
        Problem(
            "the equations of this chain of bodies are derived and certified by recursion over its"
            " frames, and too long to be written",
            bodies_of(scene)[-1].mark,
            hint="code is written by lagrange emit --to c, motions are found by lagrange simulate",
            rule="too-large",
        )
    )
