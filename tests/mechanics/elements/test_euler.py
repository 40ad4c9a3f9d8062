"""Bodies by Newton's and Euler's laws: planted mistakes never pass the certificate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
import sympy as sp

from lagrange_cli.errors import InternalError
from lagrange_cli.mechanics import derive, derive_uncertified, reduce
from lagrange_cli.mechanics.certify.certificate import certify
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.scene import read_text
from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.language.rotations import ZERO
from lagrange_cli.scene.model import Definition, Scene, Term

ARM = """
parameters: {m: 2, n: 1, l: 0.5, A: 0.3, B: 0.4, C: 0.2, g: 9.81}
bodies:
  upper: {turn: [z: a, x: b], centre: [0, 0, 0.2], mass: m, inertia: [A, B, C]}
  lower: {on: upper, at: [0, 0, l], turn: {y: c}, centre: [0.1, 0, 0.3], mass: n,
          inertia: [0.1, 0.2, 0.25]}
coordinates: [a, b, c]
potentials: {weight: {gravity: g}}
"""


def _with_term(scene: Scene, name: str, change: Callable[[Term], Term]) -> Scene:
    terms = tuple(change(t) if t.name == name else t for t in scene.kinetic)
    assert terms != scene.kinetic
    return replace(scene, kinetic=terms)


def _with_definition(scene: Scene, name: str, meaning: str) -> Scene:
    definitions = []
    for d in scene.definitions:
        if d.name == name:
            node = (
                ZERO
                if meaning == "0"
                else next(e.expression.node for e in scene.definitions if e.name == meaning)
            )
            d = Definition(name, d.mark, replace(d.expression, node=node))
        definitions.append(d)
    assert tuple(definitions) != scene.definitions
    return replace(scene, definitions=tuple(definitions))


def _energy_of(text: str, name: str) -> Expression:
    return next(t.expression for t in read_text(text).kinetic if t.name == name)


MISTAKES: dict[str, Callable[[Scene], Scene]] = {
    "moments about other axes": lambda scene: _with_term(
        scene,
        "rotation(upper)",
        lambda t: replace(
            t,
            expression=_energy_of(ARM.replace("[A, B, C]", "[C, B, A]"), "rotation(upper)"),
        ),
    ),
    "a component of the spin is left out": lambda scene: _with_definition(
        scene, "omega_3(lower)", "0"
    ),
    "the spin of the parent for that of the child": lambda scene: _with_definition(
        scene, "omega_2(lower)", "omega_2(upper)"
    ),
    "no turning of a body": lambda scene: replace(
        scene, kinetic=tuple(t for t in scene.kinetic if t.name != "rotation(lower)")
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES.values(), ids=MISTAKES.keys())
def test_mistakes_of_energies_and_spins_do_not_pass(mistake: Callable[[Scene], Scene]) -> None:
    with pytest.raises(InternalError, match=r"disagree with Newton's law"):
        derive(mistake(read_text(ARM)))


def test_what_is_right_passes() -> None:
    assert derive(read_text(ARM)).derivation.certificate.mismatch < 1e-40


def _without_gyroscopic_terms(derivation: Uncertified) -> Uncertified:
    """Leave out of f what is of moments and two velocities, as ω × I ω is."""
    moments = {sp.Symbol(s, real=True) for s in "ABC"}
    forcing = tuple(
        tuple(t for t in terms if not t.free_symbols & moments) for terms in derivation.forcing
    )
    assert forcing != derivation.forcing
    return replace(derivation, forcing=forcing)


def test_equations_without_gyroscopic_terms_do_not_pass() -> None:
    derivation = derive_uncertified(reduce(read_text(ARM)))
    with pytest.raises(InternalError, match=r"disagree with Newton's law"):
        certify(_without_gyroscopic_terms(derivation), 30, 8)


def test_torques_do_work_on_all_turns_below() -> None:
    text = ARM + "forces: {motor: {on: lower, torque: [0.1, 0.2, 0.3], axes: lower}}\n"
    equations = derive(read_text(text))
    (force,) = equations.system.forces
    assert force.is_torque
    by_name = {
        c.name: q for c, q in zip(equations.system.coordinates, force.generalized, strict=True)
    }
    # The axis of the last joint is the second of the body.
    assert by_name["c"] == sp.Rational(1, 5)
    assert by_name["a"] != 0
    wrong = replace(
        derive_uncertified(reduce(read_text(text))), forces=(replace(force, generalized=(0, 0, 0)),)
    )
    with pytest.raises(InternalError):
        certify(wrong, 30, 8)
