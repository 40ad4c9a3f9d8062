"""Certified equations of motion, with all that can be done with them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Self

from lagrange_cli.api import analysis, motion, studies
from lagrange_cli.api.derived import Derived
from lagrange_cli.api.values import page_in
from lagrange_cli.drawn import Reported
from lagrange_cli.emit.base import OptionValue, Package, completed
from lagrange_cli.report.document_options import HTML_OPTIONS
from lagrange_cli.report.formats import ReportForm
from lagrange_cli.report.tables import json_text
from lagrange_cli.report.tree import Document

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.report import Page


@dataclass(frozen=True, repr=False)
class Shown(Reported):
    """A document, which notebooks show.

    Attributes
    ----------
    document
        What it holds.
    language
        The language of its words.
    """

    document: Document
    language: str = "en"

    @property
    def reported(self) -> Document:
        return self.document

    def __repr__(self) -> str:
        return str(ReportForm("markdown", self.language).written(self.document))


@dataclass(frozen=True)
class Derivation(Derived, Reported):
    """Certified equations of motion.

    ``str`` gives the text of ``lagrange derive``; notebooks show it typeset. Its fields are those
    of :class:`~.derived.Derived`; a method that is assigned is explained in its module.
    """

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
    page = studies.page
    animate = studies.animate
    path = studies.path
    path_models = studies.path_models

    def with_brackets(self, *brackets: str) -> Self:
        """Return the derivation with Poisson brackets in its Hamilton's form.

        Parameters
        ----------
        brackets
            Each two functions, ``"L_z, H"``, as ``lagrange derive --bracket`` takes them.

        Raises
        ------
        InputError
            Located: a text is not two functions over (q, p, t); or there is no Hamiltonian.

        Examples
        --------
        >>> derivation = load("systems/celestial/two_bodies.yaml").derive()
        >>> derivation.with_brackets("boost_x, P_x").report(form="hamiltonian")["brackets"][0]
        {'first': 'boost_x', 'second': 'P_x', 'value': 'm1 + m2', 'rate': None, 'conserved': None}
        """
        if not brackets:
            return self
        from lagrange_cli.analysis.forms.brackets import WrittenBracket, with_brackets

        written = [WrittenBracket(text, "--bracket") for text in brackets]
        return replace(self, equations=with_brackets(self.equations, written))

    def report(self, *, form: str = "lagrange", latex: bool = False) -> dict[str, Any]:
        """Return what ``lagrange derive --format json`` writes, ``--with latex`` too.

        Examples
        --------
        >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
        >>> derivation.report()["equations"]
        [{'coordinate': 'theta', 'residual': 'l*ddot(theta) + g*sin(theta)'}]
        """
        from lagrange_cli.report.values.derivation import derivation_report

        return derivation_report(self.equations, form, latex=latex)

    def text(
        self,
        *,
        form: str = "lagrange",
        ascii: bool = False,
        width: int = 80,
        **options: OptionValue,
    ) -> str:
        """Return what ``lagrange derive`` prints in a window of ``width`` columns.

        ``options``: ``sections`` and ``language``, as of the command.
        """
        from lagrange_cli.report.contents.derivation.contents import derivation_text

        return derivation_text(self.equations, ascii=ascii, form=form, width=width, **options)

    def written(
        self,
        to: str,
        *,
        form: str = "lagrange",
        ascii: bool = False,
        encoding: str = "utf-8",
        **options: OptionValue,
    ) -> str | Page:
        """Return what ``lagrange derive --format`` writes.

        Parameters
        ----------
        to
            One of :data:`.formats.DERIVED`, which has the ``options`` of each.
        ascii
            Text in plain ASCII, as also where the encoding has no more.
        """
        if to == "json":
            return json_text(self.report(form=form, latex=bool(options.get("latex"))))
        if to != "text":
            return self.emit(to, form=form, **options).popitem()[1]
        from lagrange_cli.report.contents.derivation.contents import derivation_page

        write = partial(derivation_page, self.equations, form=form, options=options)
        return page_in(encoding, lambda plain: write(ascii=plain), ascii)

    def emit(self, to: str, **options: OptionValue) -> dict[str, str]:
        """Return file name → text in a format of ``lagrange emit --list``; what an FMI unit holds.

        Raises
        ------
        InputError
            There is no such format or option.

        Examples
        --------
        >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
        >>> list(derivation.emit("c"))
        ['pendulum.h', 'pendulum.c']
        """
        from lagrange_cli.api.emitters import emitter

        return emitter(to).emit(self.equations, options)

    def package(self, to: str, **options: OptionValue) -> Package:
        """Return the files of a format as bytes, those with compiled code too.

        Raises
        ------
        InputError
            There is no such format or option.

        Examples
        --------
        >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
        >>> list(derivation.package("fmu", fmi="3").files)
        ['pendulum.fmu']
        """
        from lagrange_cli.api.emitters import emitter

        name = self.equations.presentation.name
        return emitter(to).package(name, self.emit(to, **options))

    def show(self, *sections: str, **options: OptionValue) -> Shown:
        """Return parts of the derivation, which notebooks typeset.

        Parameters
        ----------
        sections
            Names of ``lagrange emit --sections``: ``account``, ``equations``, ``certificate`` and
            so on; without any, those of a document.
        options
            Others of ``lagrange emit --to html``.

        Raises
        ------
        InputError
            There is no such part or option, or constraint forces were not derived.

        Examples
        --------
        >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
        >>> print(derivation.show("certificate"))  # doctest: +ELLIPSIS
        # Simple pendulum
        ...
        ## Certificate
        <BLANKLINE>
        At 8 random states these equations were compared...
        """
        from lagrange_cli.report.contents.derivation.documents import asked_document

        chosen = {"sections": ",".join(sections)} if sections else {}
        complete = completed("html", HTML_OPTIONS, {**chosen, **options})
        document, language = asked_document("html", self.equations, complete, None)
        return Shown(document, language.code)

    @property
    def reported(self) -> Equations:
        return self.equations

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return f"<Derivation of {self.equations.presentation.name}>"
