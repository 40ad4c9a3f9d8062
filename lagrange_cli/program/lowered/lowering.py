"""Program → function: statements, loops over what repeats, equations to solve, a finite check.

A small program names its values. In a large one, statements of one shape are loops over the array
``w`` of values; the others keep names of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from lagrange_cli.program.graph.operands import (
    AffineIndex,
    Cell,
    Constant,
    Element,
    FunctionCall,
    Operand,
    Product,
    Variable,
    array_named,
    cell_named,
    rebuilt,
)
from lagrange_cli.program.graph.statement_groups import dependents
from lagrange_cli.program.kinds import ProgramKind
from lagrange_cli.program.lowered.functions import (
    EPSILON,
    RESULTS,
    For,
    Function,
    Let,
    LocalArray,
    Remark,
    Require,
    RequireFinite,
    Solve,
    Step,
    Store,
)
from lagrange_cli.program.lowered.indexed_loops import indexed_body, zeros
from lagrange_cli.program.lowered.parts import Assignments, Part, Pivots, Stores, parts_of
from lagrange_cli.program.lowered.workspace import solver_workspace
from lagrange_cli.program.program import Program
from lagrange_cli.program.systems.loop_rolling import (
    LoopNest,
    LoopStatement,
    Statement,
    roll_loops,
)
from lagrange_cli.program.systems.loops import Zeros

#: Letter of variables → the array that they are numbers of, but for those of multipliers.
_ARRAYS = {
    "q": "y",
    "v": "y",
    "z": "y",
    "u": "u",
    "p": "p",
    "w": "w",
    "m": "matrix",
    "b": "vector",
    "c": "columns",
    "o": RESULTS,
}

#: Letters of accelerations and multipliers, which other functions give.
_GIVEN = "al"

_ZERO = Constant(Fraction(0))


def lowered(program: Program, name: str) -> Function:
    """Return the function of a program.

    Programs that solve a system store the solution that their kind names; the mass matrix is
    stored in full; all others store their outputs one after the other.

    Parameters
    ----------
    name
        Name of the function; ``contact_`` at its beginning tells that it reads flags of contacts,
        and so do the functions that it evaluates first.
    """
    if program.parts:
        body, shape = [*indexed_body(program)], _shape_of_loops(program)
    else:
        parts, shape = parts_of(program)
        body = _Lowering(program).body(parts)
    results = _product(shape)
    check = [RequireFinite(results)] if results else []
    return Function(
        name,
        program.kind,
        (*body, *check),
        shape,
        program.coordinates,
        program.parameters,
        program.driven,
        _given(program, "contact_" if name.startswith("contact_") else ""),
        program.states,
    )


def _shape_of_loops(program: Program) -> tuple[int, ...]:
    n = program.coordinates
    shapes = {ProgramKind.ENERGY: (), ProgramKind.MATRIX: (n, n)}
    shape = shapes.get(program.kind, (program.results,))
    return shape if _product(shape) == program.results else (program.results,)


def _product(shape: tuple[int, ...]) -> int:
    product = 1
    for size in shape:
        product *= size
    return product


def _given(program: Program, prefix: str) -> tuple[str, ...]:
    """Return the functions that give accelerations and multipliers, where these are read."""
    letters = set(map(array_named, program.reads))
    if letters.isdisjoint(_GIVEN):
        return ()
    return (f"{prefix}rhs", *([f"{prefix}multipliers"] if "l" in letters else []))


class _Lowering:
    """Writes the statements of one program."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.stored: set[int] = set()
        self.cells = {
            name: Cell("multipliers", k)
            for block in program.blocks
            for k, name in enumerate(block.multipliers)
        }

    def body(self, parts: Sequence[Part]) -> list[Step]:
        """Return the assignments, then the parts."""
        assignments, blocks = self.program.assignments, self.program.blocks
        late = {name for b in blocks for name, _ in dependents(assignments, b.multipliers)}
        first = Assignments([step for step in assignments if step[0] not in late])
        rolled = [(part, self._rolled(part)) for part in (first, *parts)]
        loops = (item for _, items in rolled for item in items if isinstance(item, LoopNest))
        self.stored = {number for loop in loops for number in loop.numbers("w")}
        steps: list[Step] = []
        if self.stored:
            values = len(assignments)
            steps.append(LocalArray("w", (values,), solver_workspace(self.program)))
        for part, items in rolled:
            steps += self._steps(part, items)
        return steps

    def _rolled(self, part: Part) -> list[Statement | LoopNest]:
        """Return the statements of a part, and loops in place of those that repeat."""
        if isinstance(part, Assignments):
            statements = [Statement(self._cell(n), o) for n, o in part.assignments]
            return self._with_loops(statements, independent=False)
        if isinstance(part, Stores):
            return self._with_loops(part.statements, independent=True, always=part.rolled)
        return []

    def _with_loops(
        self, statements: Sequence[Statement], *, independent: bool, always: bool = False
    ) -> list[Statement | LoopNest]:
        if not (self.program.is_large or always):
            return list(statements)
        return roll_loops(statements, self._locate, independent)

    def _locate(self, name: str) -> Cell | None:
        return None if name == "t" else self._cell(name)

    def _cell(self, name: str) -> Cell:
        cell = self.cells.get(name)
        if cell is None:
            letter, number = cell_named(name)
            layout = self.program.layout
            if letter in _GIVEN:
                first = layout.velocities.start if letter == "a" else layout.size
                cell = Cell("given", number + first)
            else:
                array = _ARRAYS[letter]
                cell = Cell(array, layout.place(letter, number) if array == "y" else number)
            self.cells[name] = cell
        return cell

    def _steps(self, part: Part, items: Sequence[Statement | LoopNest]) -> list[Step]:
        if isinstance(part, Pivots):
            return self._pivots()
        if isinstance(part, Zeros):
            return [zeros(part)]
        if isinstance(part, LocalArray | Solve | For):
            return [part]
        remark = part.remark if isinstance(part, Stores) else ""
        looped = any(isinstance(item, LoopNest) for item in items)
        steps: list[Step] = [Remark(remark)] if remark and looped else []
        return steps + [
            _nest(item) if isinstance(item, LoopNest) else self._single(item) for item in items
        ]

    def _single(self, statement: Statement) -> Let | Store:
        array, number = statement.target
        operand = self._placed(statement.operand)
        if array == "w" and number not in self.stored:
            return Let(f"w{number}", operand)
        return Store(Element(array, AffineIndex(number)), operand)

    def _placed(self, operand: Operand) -> Operand:
        """Return an operand with elements for what stands in arrays; small programs have few."""
        return rebuilt(operand, self._leaf)

    def _leaf(self, variable: Variable) -> Variable | Element:
        """Return the element that a variable is; what is handed to the function keeps its name."""
        if variable.name == "t":
            return variable
        array, number = self._cell(variable.name)
        named = array in "pu" or (array == "y" and not self.program.is_large)
        if named or (array == "w" and number not in self.stored):
            return variable
        return Element(array, AffineIndex(number))

    def _pivots(self) -> list[Step]:
        """Require that the mass matrix is regular, as far as its pivots are written out."""
        program = self.program
        pivots = zip(program.output("pivots"), program.output("scales"), strict=True)
        steps: list[Step] = []
        for block in program.blocks:
            for k in range(len(block.coordinates) if block.unrolled else 0):
                pivot, scale = (self._placed(operand) for operand in next(pivots))
                if not block.definite:
                    steps.append(Require(FunctionCall("abs", (pivot,)), _ZERO))
                elif k and not block.exact:
                    steps.append(Require(pivot, Product((Variable(EPSILON), scale), ())))
                else:
                    steps.append(Require(pivot, _ZERO))
        return steps


def _nest(loop: LoopNest) -> For:
    """Return nested loops."""
    body: tuple[Step, ...] = tuple(map(_repeated, loop.body))
    for count in reversed(loop.counts):
        body = (For(count, body),)
    (nest,) = body
    assert isinstance(nest, For)
    return nest


def _repeated(statement: LoopStatement) -> Store:
    target, *places = statement.places
    assert target is not None
    read = iter(places)

    def placed(variable: Variable) -> Variable | Element:
        place = next(read)
        return variable if place is None else Element(*place)

    return Store(Element(*target), rebuilt(statement.operand, placed))
