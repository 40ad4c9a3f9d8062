"""An equilibrium, quadratic energies, linear equations, normal modes and coordinates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import sympy as sp

from lagrange_cli.analysis.small_oscillations import SmallOscillations, small_oscillations
from lagrange_cli.notation.build import display_row
from lagrange_cli.notation.labels import free_letter
from lagrange_cli.notation.ordering import symbol_of
from lagrange_cli.notation.tree import Dependence
from lagrange_cli.report.contents.forms.writer import FormWriter
from lagrange_cli.report.inlines import (
    Inline,
    Label,
    Listed,
    Sentence,
    Sign,
    joined,
    say,
    symbol,
    times,
    value,
)
from lagrange_cli.report.tree import Formula, Paragraph, Section, formulas

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.notation.vocabulary import Vocabulary

#: Digits of numbers that have no closed form.
_DIGITS = 6

#: Most normal coordinates that are written out; their sums are lines of as many terms.
_MOST_COORDINATES = 6


def small_oscillation_sections(writer: FormWriter) -> list[Section]:
    """Return the sections in place of Lagrange's equations."""
    equations = writer.equations
    form = small_oscillations(equations, _DIGITS)
    letters = ModeLetters.of(equations, form)
    writer = replace(writer, vocabulary=with_displacements(writer.words, form, letters))
    pairs = zip(form.coordinates, form.rest_values, form.displacements, strict=True)
    places = [
        writer.total(writer.coordinate(c), [place] if d is c else [place, d.q])
        for c, place, d in pairs
    ]
    energies = [writer.total(writer.labels["T"], form.kinetic)]
    if form.potential:
        letter = writer.labels["V_eff" if form.is_effective else "V"]
        energies.append(writer.total(letter, form.potential))
    rows = [
        Formula("", (writer.noted(display_row(shown, writer.words)),), name=writer.coordinate(d))
        for d, shown in zip(form.displacements, form.shown, strict=True)
    ]
    return [
        Section(
            say("Equilibrium"), (formulas(places, result=True), Paragraph(_chosen(writer, form)))
        ),
        Section(
            say("Energies to second order"),
            (
                formulas(energies, result=True),
                *([Paragraph(say("Constants are left out."))] if form.potential else []),
            ),
        ),
        Section(say("Small oscillations"), (formulas(rows, result=True),)),
        *_poles(form),
        *_modes(writer, form, letters),
    ]


def _chosen(writer: FormWriter, form: SmallOscillations) -> Sentence:
    """Say which equilibrium it is."""
    stability = form.at.stability
    if stability is not None and stability.verdict in ("stable", "asymptotically stable"):
        return say("It is the stable equilibrium nearest to the initial configuration.")
    return say(
        "It is the equilibrium nearest to the initial configuration of those that are not found to"
        " be unstable."
    )


def _poles(form: SmallOscillations) -> Iterator[Section]:
    """Exponents of motions with damping or gyroscopic terms."""
    if form.poles:
        listed = Listed(tuple(Inline(_complex(s)) for s in form.poles))
        exponents = say("Exponents of damped and gyroscopic motions: {poles}.", poles=listed)
        yield Section(say("Poles"), (Paragraph(exponents),))


def _modes(writer: FormWriter, form: SmallOscillations, letters: ModeLetters) -> Iterator[Section]:
    """Squares of the angular frequencies, and normal coordinates."""
    if not form.modes:
        return
    squares = [
        writer.row(writer.formula(w**2), mode.square)
        for w, mode in zip(letters.frequencies, form.modes, strict=True)
    ]
    numbers = [
        Inline(symbol(str(w)) + " = " + _decimal(mode.frequency))
        for w, mode in zip(letters.frequencies, form.modes, strict=True)
    ]
    values_note = say("With the values of the parameters {values}.", values=Listed(tuple(numbers)))
    yield Section(
        say("Angular frequencies"), (formulas(squares, result=True), Paragraph(values_note))
    )
    if len(form.modes) > _MOST_COORDINATES:
        return
    sums = [
        writer.total(
            writer.coordinate(d),
            [m.shape[i] * q for m, q in zip(form.modes, letters.places, strict=True)],
        )
        for i, d in enumerate(form.displacements)
    ]
    each = zip(letters.accelerations, letters.frequencies, letters.places, form.modes, strict=True)
    free = [
        Formula("", (writer.tree(a + (0 if mode.square == 0 else w**2 * q)),))
        for a, w, q, mode in each
    ]
    yield Section(
        say("Normal coordinates"), (formulas(sums, result=True), formulas(free, result=True))
    )


def _complex(number: complex) -> Label:
    turned = [times(_decimal(number.imag), Sign("imaginary"))] if number.imag else []
    real = [_decimal(number.real)] if number.real or not turned else []
    return joined(" + ", [*real, *turned])


def _decimal(number: float) -> Label:
    return value(number, f"{number:.{_DIGITS}g}")


@dataclass(frozen=True)
class ModeLetters:
    """Symbols of angular frequencies and normal coordinates, one of each for a mode.

    Attributes
    ----------
    frequencies, places, accelerations
        ω_k, Q_k and Q̈_k.
    """

    frequencies: tuple[sp.Symbol, ...]
    places: tuple[sp.Symbol, ...]
    accelerations: tuple[sp.Symbol, ...]

    @classmethod
    def of(cls, equations: Equations, form: SmallOscillations) -> ModeLetters:
        """Return letters that the scene has no other use for."""
        frequency = free_letter(equations, ("omega", "Omega", "nu", "w"))
        place = free_letter(equations, ("Q", "zeta", "Z", "q"))
        numbers = range(1, len(form.modes) + 1)
        names = [f"{place}_{k}" for k in numbers]
        return cls(
            tuple(sp.Symbol(f"{frequency}_{k}", real=True) for k in numbers),
            tuple(sp.Symbol(name, real=True) for name in names),
            tuple(sp.Symbol(f"ddot({name})", real=True) for name in names),
        )


def with_displacements(
    words: Vocabulary, form: SmallOscillations, letters: ModeLetters
) -> Vocabulary:
    """Names of displacements and normal coordinates, and numbers, beside those of other symbols."""
    atoms, first = dict(words.atoms), len(words.atoms)
    levels = (Dependence.COORDINATE, Dependence.VELOCITY, Dependence.ACCELERATION)
    for rank, d in enumerate(form.displacements, first):
        for order, (variable, level) in enumerate(zip((d.q, d.v, d.a), levels, strict=True)):
            known = symbol_of(d.name, level, rank, order=order, latex=d.latex)
            atoms.setdefault(variable, known)
    for rank, (w, q, a) in enumerate(
        zip(letters.frequencies, letters.places, letters.accelerations, strict=True), len(atoms)
    ):
        atoms[w] = symbol_of(str(w), Dependence.PARAMETER, rank)
        atoms[q] = symbol_of(str(q), Dependence.COORDINATE, rank)
        atoms[a] = symbol_of(str(q), Dependence.ACCELERATION, rank, order=2)
    return replace(words, atoms=atoms, literals={**words.literals, **form.literals})
