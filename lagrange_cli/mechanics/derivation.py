"""The pipeline Scene → Equations: reduce, derive, certify, assemble."""

from __future__ import annotations

from dataclasses import replace

from lagrange_cli.errors import (
    InconsistentStartError,
    InputError,
    MissingStartError,
    NotRealError,
    SingularError,
)
from lagrange_cli.mechanics.assembly import assemble
from lagrange_cli.mechanics.certify.certificate import certify, not_real
from lagrange_cli.mechanics.certify.facts import open_questions, proven_evidence
from lagrange_cli.mechanics.diagnosis.errors import nesting_error, require_size
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified, derive_uncertified
from lagrange_cli.mechanics.dynamics.singular_configurations import singular_configurations
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.formulation import in_formulation, reduced_for
from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.mechanics.structure import require_inertia, require_no_rates_of_inputs
from lagrange_cli.scene.conditions import Formulation
from lagrange_cli.scene.model import Scene
from lagrange_cli.stages import announce

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

    Raises
    ------
    InputError
        Located: whatever is wrong with the scene, or that there is no such formulation.
    InternalError
        The derivation failed its certificate.
    """
    require_size(scene)
    try:
        return _in_formulation(scene, digits, points, forces, formulation)
    except DomainError:
        # Which part it was is known where the error is caught; here only that it is one of them.
        raise not_real(scene) from None
    except RecursionError:
        raise nesting_error(scene) from None


def _in_formulation(
    scene: Scene, digits: int, points: int, forces: bool, formulation: Formulation
) -> Equations:
    """The equations in the formulation asked for, or, for ``auto``, in one that has a start."""
    announce("finding the coordinates")
    reduced, remarks = reduced_for(scene, formulation)

    def derived(wanted: Formulation) -> Equations:
        announce("deriving the equations")
        form, choice = in_formulation(reduced, wanted)
        equations = _derived(derive_uncertified(form), digits, points, forces)
        return replace(equations, choice=choice, remarks=(*equations.remarks, *remarks))

    try:
        return derived(formulation)
    except _NOT_REACHED as refusal:
        if formulation != "auto":
            raise
        try:
            equations = derived("multiplier")
        except InputError:
            raise refusal from None
        return replace(equations, remarks=(*equations.remarks, _NOT_REACHED_REMARK))


def _derived(derivation: Uncertified, digits: int, points: int, forces: bool) -> Equations:
    require_no_rates_of_inputs(derivation)
    seen = certify(derivation, digits, points)
    require_inertia(derivation, seen)
    evidence = proven_evidence(derivation, seen)
    equations = assemble(derivation, evidence)
    questions = tuple(open_questions(derivation, seen, evidence, equations.conserved))
    equations = replace(
        equations, singular=singular_configurations(derivation), open_questions=questions
    )
    if not forces:
        return equations
    from lagrange_cli.mechanics.reactions.constraint_forces import derive_constraint_forces

    announce("finding the constraint forces")
    reactions = derive_constraint_forces(derivation, evidence, equations)
    return replace(equations, constraint_forces=reactions)
