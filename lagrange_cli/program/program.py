"""Equations → Program: straight-line code that every target language prints.

A program has inputs, assignments in an order in which each needs only what stands before it, and
outputs by name. It names nothing after the scene: the inputs are ``t``, ``q0, q1, …``, ``v0, …``,
``p0, …``, ``u0, …``, ``z0, …`` (coordinates, velocities, parameters, driven inputs, states of
first order, in the order of the Equations) and the assigned names ``w0, w1, …``. Only what the
requested outputs need is computed, and each value once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from lagrange_cli.mechanics.free_symbols import require_given
from lagrange_cli.program.graph.operands import Operand, variables
from lagrange_cli.program.graph.schedule import LARGEST_IN_ORDER, in_families, order_of, schedule
from lagrange_cli.program.graph.value_graph import (
    ScaledNode,
    ValueGraph,
    expand_angle_sums,
    inputs_of,
)
from lagrange_cli.program.kinds import STATE_RATES, ProgramKind, is_right_hand_side, kind_of
from lagrange_cli.program.operations import count_operations
from lagrange_cli.program.solvers.blocks import (
    LARGEST_UNROLLED,
    MassMatrixSystem,
    MatrixBlock,
    solve_blocks,
)
from lagrange_cli.program.solvers.jacobians import Jacobian, slopes_of, solve_jacobian
from lagrange_cli.program.solvers.sensitivities import (
    LARGEST_WITH_SENSITIVITIES,
    state_rates,
    with_sensitivities,
)
from lagrange_cli.program.systems.agreement import articulated_tree, composite_chain
from lagrange_cli.program.systems.constraint_systems import (
    CANONICAL_OUTPUTS,
    CANONICAL_SYSTEMS,
    CLOSURE_OUTPUTS,
    CLOSURE_SYSTEMS,
)
from lagrange_cli.program.systems.contact_systems import (
    CONTACT_OUTPUTS,
    CONTACT_SYSTEMS,
    weighted_closures,
)
from lagrange_cli.program.systems.direct_derivation import (
    DirectDerivation,
    DirectEnergy,
    is_derivable,
)
from lagrange_cli.program.systems.large_systems import LargeSystem, is_large_system, large_system
from lagrange_cli.program.systems.loops import ProgramPart
from lagrange_cli.state_layout import StateLayout

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.findings import DerivationSources


@dataclass(frozen=True)
class Program:
    """Straight-line code, or loops, that compute outputs from inputs.

    Attributes
    ----------
    coordinates, parameters, driven, states
        Numbers of inputs ``q0, …``, ``p0, …``, ``u0, …`` and ``z0, …``.
    assignments
        Names and operands, each after those that it needs.
    outputs
        Names and operands.
    blocks
        The blocks of a system that outputs solve (see
        :mod:`lagrange_cli.program.solvers.blocks`).
    parts
        Loops of a large system instead of assignments and outputs (see
        :mod:`lagrange_cli.program.systems.large_systems`).
    work, results
        Numbers of workspace that the parts take, and numbers that they store.
    kind
        The quantity that the program computes.
    jacobian
        Layout of stored derivatives; None in other programs.
    """

    coordinates: int
    parameters: int
    assignments: tuple[tuple[str, Operand], ...]
    outputs: tuple[tuple[str, tuple[Operand, ...]], ...]
    blocks: tuple[MatrixBlock, ...] = ()
    driven: int = 0
    parts: tuple[ProgramPart, ...] = ()
    work: int = 0
    results: int = 0
    kind: ProgramKind = ProgramKind.VALUES
    jacobian: Jacobian | None = None
    states: int = 0

    @property
    def layout(self) -> StateLayout:
        """Layout of the state vector that is read."""
        return StateLayout(self.coordinates, self.states)

    @property
    def is_large(self) -> bool:
        """Tell whether statements of one shape stand together, to be written as loops."""
        statements = len(self.assignments) + len(self.results_in_order)
        return bool(self.parts) or statements > LARGEST_IN_ORDER

    @property
    def results_in_order(self) -> list[Operand]:
        """The operands of all outputs, one after the other."""
        return [operand for _, operands in self.outputs for operand in operands]

    @property
    def multipliers(self) -> int:
        """The number of multipliers that a program of derivatives may read."""
        return 0 if self.jacobian is None else self.jacobian.multipliers

    @cached_property
    def reads(self) -> frozenset[str]:
        """The names of the inputs that are read."""
        operands = [*(operand for _, operand in self.assignments), *self.results_in_order]
        names = {variable.name for variable in variables(*operands)}
        return frozenset(names - {name for name, _ in self.assignments})

    @property
    def composite_numbers(self) -> int:
        """The number of outputs that a mass matrix is multiplied out of; 0 if it is one itself."""
        is_whole = self.kind is not ProgramKind.MATRIX or "mass_matrix" in dict(self.outputs)
        return 0 if is_whole or self.parts else len(self.results_in_order)

    def output(self, name: str) -> tuple[Operand, ...]:
        """The operands of one output."""
        return dict(self.outputs)[name]


def result_count(program: Program) -> int:
    """Count the numbers that a program stores."""
    return program.results or len(program.results_in_order)


#: Output that solves no system → its expressions.
OUTPUTS: dict[str, Callable[[Equations], Iterable[Expr]]] = {
    "mass_matrix": lambda e: (
        entry for i, row in enumerate(e.system.mass_matrix) for entry in row[i:]
    ),
    "forcing": lambda e: e.system.forcing,
    "energy": lambda e: (e.system.energy,),
    "kinetic": lambda e: (e.system.kinetic,),
    "potential": lambda e: (e.system.potential,),
    "positions": lambda e: (c.position for c in e.system.cartesian_names),
    "velocities": lambda e: (c.velocity for c in e.system.cartesian_names),
    # Recorded inputs are arguments of the program.
    "inputs": lambda e: (u.symbol if u.recording else u.expression for u in e.system.inputs),
    "outputs": lambda e: (expression for _, expression in e.system.outputs),
    "switches": lambda e: (s.switch.until(s.symbol) for s in e.system.states if s.switch),
    **CLOSURE_OUTPUTS,
    **CONTACT_OUTPUTS,
    **CANONICAL_OUTPUTS,
}

#: Output → the system with the mass matrix that it solves.
SYSTEMS = {**CLOSURE_SYSTEMS, **CONTACT_SYSTEMS, **CANONICAL_SYSTEMS}


def build_program(equations: Equations, outputs: Sequence[str], *, loops: bool = True) -> Program:
    """Build the program that computes the named outputs.

    Parameters
    ----------
    outputs
        Names from :data:`OUTPUTS`, or one of :data:`SYSTEMS` (``acceleration``),
        which stands for the outputs ``acceleration``, ``pivots``, ``scales``,
        ``dense_matrix`` and ``dense_forcing`` that
        :func:`lagrange_cli.program.solvers.blocks.solve_blocks` explains.
    loops
        Large systems become loops; False for outputs that these do not know.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in emitted code.
    """
    require_given(equations.system.functions)
    if loops and is_large_system(equations):
        weighted = weighted_closures(equations, outputs)
        large = large_system(weighted, lambda name: tuple(OUTPUTS[name](weighted.equations)))
        if large is not None:
            return replace(_of_parts(equations, large), kind=kind_of(outputs, solves=large.solves))
    short = {"energy": _of_energy, "mass_matrix": _of_chain}.get(" ".join(outputs))
    program = None if short is None else short(equations)
    if program is not None:
        return program
    takes = not _OF_DERIVATION.isdisjoint(outputs)
    return _grouped(_written(equations, outputs, direct=takes and _is_direct(equations)))


#: Outputs that need mass matrix and forcing.
_OF_DERIVATION = {*SYSTEMS, "mass_matrix", "forcing"}


def _graph(equations: Equations, *, direct: bool) -> ValueGraph:
    """Make a graph over the inputs, and derive M and f on it if ``direct``."""
    inputs = inputs_of(equations)
    if not direct or equations.derivation.sources is None:
        return ValueGraph(inputs)
    graphs = _DERIVED.setdefault(equations.derivation.sources, {})
    if tuple(inputs) not in graphs:
        _derive(equations, equations.derivation.sources)
    return graphs[tuple(inputs)].copy()


def _derive(equations: Equations, sources: DerivationSources) -> DirectDerivation:
    """Derive M and f on a graph over the inputs, which later programs reuse."""
    inputs = inputs_of(equations)
    derivation = DirectDerivation(ValueGraph(inputs), equations)
    derivation.define()
    _DERIVED.setdefault(sources, {})[tuple(inputs)] = derivation.values
    return derivation


#: Graphs with M and f on them, by sources and inputs.
_DERIVED: WeakKeyDictionary[DerivationSources, dict[tuple[tuple[Expr, str, int], ...], ValueGraph]]
_DERIVED = WeakKeyDictionary()


#: Most coordinates of a system that is written both ways although one is bound to be shorter.
_LARGEST_COUNTED = 16

#: Operations before sharing, for each collected term, up to which direct code is shorter: a quarter
#: of them is left, and a term takes 3. Chains of pendulums have 5 to 8, rigid bodies of points,
#: whose collected equations are far shorter, 47 and more: any number between would do.
_BEFORE_SHARING = 8

#: Whether code for some sources takes M and f from the graph.
_DIRECT: WeakKeyDictionary[DerivationSources, bool] = WeakKeyDictionary()


def _is_direct(equations: Equations) -> bool:
    """Tell whether M and f derived on the graph take fewer operations than the collected ones.

    They have to agree with these.
    """
    sources = equations.derivation.sources
    if sources is None or not is_derivable(equations) or is_large_system(equations):
        return False
    if sources not in _DIRECT:
        derivation = _derive(equations, sources)
        fewer = _takes_fewer(equations, sources, derivation)
        _DIRECT[sources] = fewer and derivation.agrees()
    return _DIRECT[sources]


def _takes_fewer(
    equations: Equations, sources: DerivationSources, derivation: DirectDerivation
) -> bool:
    """Count operations both ways, unless one way is known to take fewer."""
    terms, n = sources.collected_terms, len(equations.system.mass_matrix)
    if terms is None:
        return True
    if not equations.system.pushing and n <= LARGEST_UNROLLED:
        return False  # solved in closed form, for which expressions are collected
    if n > _LARGEST_COUNTED and derivation.operations <= _BEFORE_SHARING * terms:
        return True
    direct, collected = (
        count_operations(_written(equations, ("acceleration",), direct=way)).total
        for way in (True, False)
    )
    return direct < collected


def _of_energy(equations: Equations) -> Program | None:
    """Build the program of the energy from positions, if it has many coordinates and is shorter."""
    if len(equations.system.mass_matrix) <= _LARGEST_COUNTED or not is_derivable(equations):
        return None
    direct = DirectEnergy(ValueGraph(inputs_of(equations)), equations)
    program = _ordered(direct.values.copy(), equations, [("energy", [direct.energy])], ())
    count = count_operations(program).total
    if count > direct.operations_shown:
        shown = _written(equations, ("energy",), direct=False)
        if count >= count_operations(shown).total:
            return _grouped(shown)
    return _grouped(replace(program, kind=ProgramKind.ENERGY)) if direct.agrees() else None


def _of_chain(equations: Equations) -> Program | None:
    """Build the program of M from composite bodies, if these are a long chain."""
    values = ValueGraph(inputs_of(equations))
    columns = composite_chain(values, equations, SYSTEMS["acceleration"](equations))
    if columns is None:
        return None
    wanted = list(columns._asdict().items())
    program = _grouped(_ordered(values, equations, wanted, ()))
    return replace(program, kind=ProgramKind.MATRIX, results=program.coordinates**2)


def _written(equations: Equations, outputs: Sequence[str], *, direct: bool) -> Program:
    """Build a program of statements."""
    values = _graph(equations, direct=direct)
    wanted: list[tuple[str, list[ScaledNode]]] = []
    blocks: tuple[MatrixBlock, ...] = ()
    for name in outputs:
        if name in SYSTEMS:
            system = SYSTEMS[name](equations)
            blocks, solution = _solution(values, equations, system)
            wanted.extend(solution)
            if equations.system.states and is_right_hand_side(name):
                wanted.append((STATE_RATES, state_rates(values, equations)))
        else:
            wanted.append((name, [values.convert(e) for e in OUTPUTS[name](equations)]))
    program = _ordered(values, equations, wanted, blocks)
    return replace(program, kind=kind_of(outputs, solves=bool(blocks)))


def _ordered(
    values: ValueGraph,
    equations: Equations,
    wanted: list[tuple[str, list[ScaledNode]]],
    blocks: tuple[MatrixBlock, ...],
) -> Program:
    """Write statements with sines and cosines of as few angles as accuracy allows."""
    if not any(block.exact for block in blocks):
        needed = [number for _, nodes in wanted for _, number in nodes]
        expand_angle_sums(values, order_of(values, needed))
    return replace(_scheduled(values, equations, wanted), blocks=blocks)


def _scheduled(
    values: ValueGraph, equations: Equations, wanted: list[tuple[str, list[ScaledNode]]]
) -> Program:
    """Write the statements that compute some values, each where it is first needed."""
    assignments, outputs = schedule(values, wanted)
    s = equations.system
    n, p, u, z = map(len, (s.coordinates, s.parameters, s.inputs, s.states))
    return Program(n, p, assignments, outputs, driven=u, states=z)


def _grouped(program: Program) -> Program:
    """Bring statements of one shape together; their operations stay the same."""
    assignments, outputs = in_families(program.assignments, program.outputs)
    return replace(program, assignments=assignments, outputs=outputs)


def _solution(
    values: ValueGraph, equations: Equations, system: MassMatrixSystem
) -> tuple[tuple[MatrixBlock, ...], list[tuple[str, list[ScaledNode]]]]:
    """Return the blocks of a system and the outputs that solve it, with its sensitivities."""
    if not equations.system.sensitivities:
        return solve_blocks(
            values, equations, system, tree=articulated_tree(values, equations, system)
        )
    blocks, solution = solve_blocks(values, equations, system, LARGEST_WITH_SENSITIVITIES)
    return with_sensitivities(values, equations, system, blocks, dict(solution))


#: Name of the variables of a derivative → their symbols.
_COLUMNS: dict[str, Callable[[Equations], list[Symbol]]] = {
    "state": lambda e: list(e.system.state_symbols),
    "inputs": lambda e: [source.symbol for source in e.system.inputs],
    "parameters": lambda e: [
        p.symbol
        for p in e.system.parameters[: len(e.system.parameters) - 2 * len(e.system.contacts)]
    ],
}


def build_jacobian(equations: Equations, by: str, *, sparse: bool = True) -> Program:
    """Build the program that differentiates the state's rates, of accelerations that it is given.

    Parameters
    ----------
    equations
        With contacts those with flags (:func:`.contact_systems.with_contact_flags`).
    by
        ``state`` (coordinates, then velocities), ``inputs`` or ``parameters``.
    sparse
        Store the numbers alone that need not be zero where they are few.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in emitted code.
    """
    require_given(equations.system.functions)
    values = _graph(equations, direct=_is_direct(equations))
    system = SYSTEMS["contact_acceleration" if equations.system.contacts else "acceleration"](
        equations
    )
    jacobian, wanted = solve_jacobian(
        values, equations, system, _COLUMNS[by](equations), sparse=sparse
    )
    return _of_jacobian(_scheduled(values, equations, wanted), jacobian)


def build_slopes(equations: Equations, outputs: Sequence[str], by: str) -> Program:
    """Build the program that differentiates outputs that solve no system.

    The values of ``outputs``, names from :data:`OUTPUTS`, are the rows of the result one after the
    other. Variables and errors are those of :func:`build_jacobian`.
    """
    require_given(equations.system.functions)
    values = ValueGraph(inputs_of(equations))
    nodes = [values.convert(e) for name in outputs for e in OUTPUTS[name](equations)]
    jacobian, wanted = slopes_of(values, nodes, _COLUMNS[by](equations))
    return _of_jacobian(_scheduled(values, equations, wanted), jacobian)


def _of_jacobian(program: Program, jacobian: Jacobian) -> Program:
    kind = ProgramKind.JACOBIAN
    return replace(_grouped(program), results=jacobian.size, kind=kind, jacobian=jacobian)


def _of_parts(equations: Equations, system: LargeSystem) -> Program:
    """A program of loops. Its block, if any, stands for the closures that it solves."""
    n = len(equations.system.coordinates)
    block = MatrixBlock(tuple(range(n)), True, True, closures=system.closures)
    return Program(
        n,
        len(equations.system.parameters),
        (),
        (),
        (block,) if system.solves else (),
        len(equations.system.inputs),
        system.parts,
        system.work,
        system.results,
    )
