"""Certified equations of motion, with all that can be done with them."""

from __future__ import annotations

from dataclasses import dataclass

from lagrange_cli.api import analysis, documents, motion, studies
from lagrange_cli.api.derived import Derived


@dataclass(frozen=True)
class Derivation(Derived):
    """Certified equations of motion.

    ``str`` gives the text of ``lagrange derive``; notebooks show it typeset. Its fields are those
    of :class:`~.derived.Derived`; each method is a function of these, in the module that is named.
    """

    # Documents, code and reports.
    with_brackets = documents.with_brackets
    report = documents.report
    text = documents.text
    emit = documents.emit
    show = documents.show

    # Analyses of the equations.
    analyze = analysis.analyze
    linearize = analysis.linearize
    frequency_response = analysis.frequency_response
    plot_effective_potential = analysis.plot_effective_potential
    plot_response = analysis.plot_response
    plot_modes = analysis.plot_modes
    animate_modes = analysis.animate_modes

    # Motions and studies of them.
    simulate = motion.simulate
    ensemble = motion.ensemble
    tradeoff = studies.tradeoff
    fit = studies.fit
    lyapunov = studies.lyapunov
    section = studies.section
    path = studies.path
    path_models = studies.path_models

    # Notebooks show the page, and the formulas alone in PDF.
    _repr_markdown_ = documents.markdown
    _repr_latex_ = documents.formulas

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return f"<Derivation of {self.equations.presentation.name}>"
