"""Equations → Model: programs built, printed in both languages, symbols left behind."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING

from sympy import I, nan, oo, zoo

from lagrange_cli.emit.c_project import workspace
from lagrange_cli.emit.c_simulation import lanes_source, library_source
from lagrange_cli.emit.constraints import constraint_programs
from lagrange_cli.emit.disturbed import disturb
from lagrange_cli.emit.forces import force_columns
from lagrange_cli.emit.python_functions import module_source, program_of
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.equations import Parameter
from lagrange_cli.simulate.model import Code, Defaults, Model, ModelParameter

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations

__all__ = ["model_of"]

#: Evaluators of a simulation, beside the disturbed right-hand side.
FUNCTIONS = ("rhs", "energy", "positions", "velocities")


def model_of(equations: Equations) -> Model:
    """The model of a system for the parameters' values and the initial state it has."""
    unused = equations.facts.unused_parameters
    initial = equations.initial
    facts = asdict(equations.facts)
    del facts["unused_parameters"]
    return Model(
        name=equations.name,
        coordinates=tuple(c.name for c in equations.coordinates),
        kinds=tuple("angle" if c.is_angle else c.unit or "length" for c in equations.coordinates),
        cartesian=tuple(c.name for c in equations.cartesian_names),
        parameters=tuple(
            ModelParameter(p.name, p.value, p.name not in unused) for p in equations.parameters
        ),
        initial=None if initial is None else (*initial.positions, *initial.velocities),
        defaults=Defaults(**asdict(equations.simulate)),
        conserved=tuple(c.kind for c in equations.conserved),
        facts=facts,
        formulation=equations.formulation,
        code=_code(equations),
        multipliers=equations.multipliers,
        residuals=sum(1 + (c.kind == "position") for c in equations.closures),
        outputs=tuple(name for name, _ in equations.outputs),
        forces=tuple(name for name, _ in force_columns(equations)),
    )


def driven(equations: Equations) -> Equations:
    """The equations with the scene's functions of time in place of its inputs.

    Raises
    ------
    InputError
        They make an expression that is no finite real number, as 1/u with u = 0.
    """
    if not equations.inputs:
        return equations
    given = {u.symbol: u.expression for u in equations.inputs}

    def put(expression: Expr) -> Expr:
        found = expression.xreplace(given)
        if found.has(zoo, nan, oo, -oo, I):
            names = ", ".join(f"'{u.name}'" for u in equations.inputs)
            raise InputError(
                Problem(
                    f"with the values of {names} a force or an energy is no finite real number",
                    hint="look at what stands below fractions and under roots",
                    rule="not-real",
                )
            )
        return found

    return replace(
        equations,
        inputs=(),
        forcing=tuple(map(put, equations.forcing)),
        energy=put(equations.energy),
        kinetic=put(equations.kinetic),
        potential=put(equations.potential),
        lagrangian=put(equations.lagrangian),
        outputs=tuple((name, put(e)) for name, e in equations.outputs),
    )


def _code(equations: Equations) -> Code:
    forces = _forces(equations)
    equations = driven(equations)
    programs = {name: program_of(equations, name) for name in FUNCTIONS}
    disturbed = disturb(programs["rhs"])
    programs["disturbed"] = disturbed
    if equations.outputs:
        programs["outputs"] = program_of(equations, "outputs")
    programs |= constraint_programs(equations)
    return Code(
        c=library_source(programs),
        lanes=lanes_source(programs),
        python=module_source(programs),
        work=workspace(programs),
        factors=disturbed.parameters - len(equations.parameters),
        forces=forces,
    )


def _forces(equations: Equations) -> str:
    """A function for the columns of constraint forces, where they were asked for."""
    columns = force_columns(equations)
    if not columns:
        return ""
    unknowns = [*(c.a for c in equations.coordinates), *(c.multiplier for c in equations.closures)]
    known = (*equations.parameters, *(Parameter(s.name, s) for s in unknowns))
    asked = replace(equations, parameters=known, outputs=tuple(columns))
    return module_source({"outputs": program_of(driven(asked), "outputs")})
