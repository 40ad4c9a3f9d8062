"""The pipeline Scene → Equations: reduce, derive, certify, assemble."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from lagrange_cli.errors import (
    InconsistentStartError,
    InputError,
    MissingStartError,
    NotRealError,
    SingularError,
)
from lagrange_cli.mechanics.assembly import assemble
from lagrange_cli.mechanics.certify.certificate import certify, explained
from lagrange_cli.mechanics.certify.facts import open_questions, proven_evidence
from lagrange_cli.mechanics.diagnosis.errors import require_size
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified, derive_uncertified
from lagrange_cli.mechanics.dynamics.singular_configurations import singular_configurations
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.formulation import in_formulation, reduced_for
from lagrange_cli.mechanics.structure import require_inertia, require_no_rates_of_inputs
from lagrange_cli.scene.conditions import Formulation
from lagrange_cli.scene.model import Scene
from lagrange_cli.stages import announce

if TYPE_CHECKING:
    from lagrange_cli.mechanics.step_values import Way

#: Errors of an initial state that no configuration has in the coordinates, or several have.
_NOT_REACHED = (InconsistentStartError, MissingStartError, NotRealError, SingularError)
_NOT_REACHED_REMARK = (
    "in multiplier form: the coordinates do not give the initial state, where they are singular"
)


def derive(
    scene: Scene,
    *,
    digits: int = 30,
    points: int = 8,
    forces: bool = False,
    formulation: Formulation = "auto",
    steps: Way | None = None,
) -> Equations:
    """Certified equations of motion of a scene.

    Parameters
    ----------
    digits
        Decimal digits of the certificate, at least 15.
    points
        Random states at which it is checked.
    forces
        Find the constraint forces too.
    formulation
        ``minimal`` or ``multiplier``; ``auto`` as :func:`.formulation.in_formulation` says, and
        ``multiplier`` where the coordinates do not reach the initial state and it does.
    steps
        Keep the steps of the derivation too, by this way.

    Raises
    ------
    InputError
        Located: whatever is wrong with the scene, that there is no such formulation, or that the
        steps are too long to be read.
    InternalError
        The derivation failed its certificate.
    """
    require_size(scene)
    with explained(scene):
        return _in_formulation(scene, _Wanted(digits, points, forces, steps), formulation)


@dataclass(frozen=True)
class _Wanted:
    """Options of a derivation besides its formulation, as :func:`derive` takes them."""

    digits: int
    points: int
    forces: bool
    steps: Way | None


def _in_formulation(scene: Scene, asked: _Wanted, formulation: Formulation) -> Equations:
    """The equations in the formulation asked for, or, for ``auto``, in one that has a start."""
    announce("finding the coordinates")
    reduced, remarks = reduced_for(scene, formulation)

    def derived(wanted: Formulation) -> Equations:
        announce("deriving the equations")
        form, choice = in_formulation(reduced, wanted)
        if asked.steps is not None:
            from lagrange_cli.mechanics.steps.derive_steps import (
                require_displacements,
                require_few_coordinates,
                require_few_terms,
            )

            require_displacements(scene, asked.steps)
            require_few_coordinates(form)
        derivation = derive_uncertified(form)
        if asked.steps is not None:
            require_few_terms(derivation)
        equations = _derived(derivation, asked)
        return replace(
            equations,
            derivation=replace(
                equations.derivation,
                choice=choice,
                remarks=(*equations.derivation.remarks, *remarks),
            ),
        )

    try:
        return derived(formulation)
    except _NOT_REACHED as refusal:
        if formulation != "auto":
            raise
        try:
            equations = derived("multiplier")
        except InputError:
            raise refusal from None
        return replace(
            equations,
            derivation=replace(
                equations.derivation, remarks=(*equations.derivation.remarks, _NOT_REACHED_REMARK)
            ),
        )


def _derived(derivation: Uncertified, asked: _Wanted) -> Equations:
    require_no_rates_of_inputs(derivation)
    seen = certify(derivation, asked.digits, asked.points)
    require_inertia(derivation, seen)
    evidence = proven_evidence(derivation, seen)
    equations = assemble(derivation, evidence)
    questions = tuple(open_questions(derivation, seen, evidence, equations.derivation.conserved))
    equations = replace(
        equations,
        derivation=replace(
            equations.derivation,
            singular=singular_configurations(derivation),
            open_questions=questions,
        ),
    )
    if asked.forces:
        from lagrange_cli.mechanics.reactions.constraint_forces import derive_constraint_forces

        announce("finding the constraint forces")
        reactions = derive_constraint_forces(derivation, evidence, equations)
        equations = replace(
            equations, derivation=replace(equations.derivation, constraint_forces=reactions)
        )
    if asked.steps is not None:
        from lagrange_cli.mechanics.steps.derive_steps import derive_steps

        announce("writing the steps")
        steps = derive_steps(derivation, evidence, equations, asked.steps)
        equations = replace(equations, derivation=replace(equations.derivation, steps=steps))
    return equations
