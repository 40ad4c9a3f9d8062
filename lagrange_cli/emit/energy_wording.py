"""Wording of what an energy is lost to, and of T + V beside Jacobi's integral."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lagrange_cli.analysis.symmetries.conserved_quantities import EnergyLoss, EnergySum
    from lagrange_cli.emit.language import Language


def loss_line(
    loss: EnergyLoss, lagrangian: str, time: str, say: Language, words: Callable[[str], str]
) -> str:
    """Say why an energy is not conserved: ``L depends on t; friction takes energy``.

    Parameters
    ----------
    loss
        What was found.
    lagrangian, time
        L and t within a sentence.
    say
        The language.
    words
        Writes names of the scene within a sentence.
    """
    return "; ".join(_reasons(loss, lagrangian, time, say, words))


def _reasons(
    loss: EnergyLoss, lagrangian: str, time: str, say: Language, words: Callable[[str], str]
) -> Iterator[str]:
    if loss.depends_on_time:
        yield say("{lagrangian} depends on {time}", lagrangian=lagrangian, time=time)
    for name in loss.inputs:
        yield say("{lagrangian} holds the input {name}", lagrangian=lagrangian, name=words(name))
    if loss.friction:
        yield say("friction takes energy")
    for name in loss.forces:
        yield say("the force {name} does work", name=words(name))
    for name in loss.moving:
        yield say("the constraint {name} moves", name=words(name))


def sum_line(found: EnergySum, say: Language) -> str:
    """Say whether T + V is conserved beside, or in place of, Jacobi's integral."""
    if found.conserved is None:
        return say("not decided whether this is conserved")
    if found.conserved:
        return say("conserved too") if found.with_jacobi else say("conserved")
    return say("not conserved: what moves constraints or axes does work")
