"""Analyses as values that show themselves."""

from __future__ import annotations

import io
import os
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from lagrange_cli.analysis.result import Analysis
from lagrange_cli.api.values import page_in
from lagrange_cli.drawn import Drawn, Reported
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.report.tables import json_text

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.report import Page


@dataclass(frozen=True, repr=False)
class Analyzed(Analysis, Drawn, Reported):
    """An analysis that formats write, and that notebooks typeset; its picture has its branches."""

    @classmethod
    def of(cls, analysis: Analysis) -> Analyzed:
        """The same analysis with the ways to write it."""
        return cls(**{field.name: getattr(analysis, field.name) for field in fields(analysis)})

    def report(self) -> dict[str, Any]:
        """Return what ``lagrange analyze --format json`` writes."""
        from lagrange_cli.report.values.analysis import analysis_report

        return analysis_report(self)

    def text(self, *, ascii: bool = False, width: int = 80, language: str = "en") -> str:
        """Return what ``lagrange analyze`` prints in a window of ``width`` columns."""
        from lagrange_cli.report.contents.analysis.documents import analysis_page

        return analysis_page(self, ascii=ascii, code=language).text(width)

    def written(
        self, to: str, *, ascii: bool = False, encoding: str = "utf-8", **options: OptionValue
    ) -> str | Page:
        """Return what ``lagrange analyze --format`` writes.

        Parameters
        ----------
        to
            One of :data:`.formats.ANALYZED`, which has the ``options`` of each.
        ascii
            Text in plain ASCII, as also where the encoding has no more.
        """
        if to == "json":
            return json_text(self.report())
        if to != "text":
            return self.emit(to, **options).popitem()[1]
        from lagrange_cli.report.contents.analysis.documents import analysis_page

        code = str(options.get("language", "en"))
        return page_in(encoding, lambda plain: analysis_page(self, ascii=plain, code=code), ascii)

    def emit(self, to: str, **options: OptionValue) -> dict[str, str]:
        """Return file name → text in ``latex``, ``markdown``, ``typst`` or ``html``.

        ``options``: those of ``lagrange analyze --format``.

        Raises
        ------
        InputError
            There is no such format or option.

        Examples
        --------
        >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
        >>> list(derivation.analyze("modes").emit("latex", style="snippet"))
        ['pendulum.tex']
        """
        from lagrange_cli.report.contents.analysis.documents import analysis_document

        return analysis_document(self, to, options)

    def write_matrices(self, path: str | os.PathLike[str]) -> None:
        """Write the linear system, one along a motion and responses as an ``.npz`` file.

        Raises
        ------
        InputError
            There is none of these, or the file cannot be written.
        """
        from lagrange_cli.files import write_file

        write_file(os.fspath(path), matrices_of(self.report()))

    def plot_loci(self, path: str | os.PathLike[str]) -> None:
        """Draw root loci: the poles along branches of equilibria in the complex plane.

        Parameters and errors are those of :meth:`plot`.
        """
        from lagrange_cli.pictures.drawing import draw_into
        from lagrange_cli.pictures.drawn.branches import RootLoci

        draw_into(path, RootLoci(self))

    def drawn(self, ending: str, *, loci: bool = False) -> bytes:
        """Return the bytes of the picture that :meth:`plot` writes, in a file of this ending.

        ``loci``: of that of :meth:`plot_loci`.
        """
        from lagrange_cli.pictures.drawing import drawn, picture_of
        from lagrange_cli.pictures.drawn.branches import RootLoci

        return drawn(picture_of(RootLoci(self) if loci else self), ending)

    def __repr__(self) -> str:
        """Return what the terminal shows."""
        return self.text()


#: Names in a response.
_NAMED = ("inputs", "outputs")


def _along_arrays(report: dict[str, Any]) -> dict[str, Any]:
    """Return the linear system along a motion by name, as NumPy arrays for a file."""
    import numpy as np

    from lagrange_cli.studies.linear_motion import NAMES

    values = report["along"]
    texts = {key: np.array(values[key], dtype=str) for key in NAMES}
    numbers = values.keys() - NAMES - {"status", "reason", "accuracy"}
    return {key: np.array(values[key], dtype=float) for key in sorted(numbers)} | texts


def matrices_of(report: dict[str, Any]) -> bytes:
    """Return the matrices of a report as the bytes of an ``.npz`` file.

    Raises
    ------
    InputError
        The linear system was left out.
    """
    import numpy as np

    from lagrange_cli.report.values.linear import linearization_arrays, response_arrays

    if report["linearization"] is None and not report.keys() & {"along", "response"}:
        reasons = [left["reason"] for left in report["left_out"]]
        raise InputError(Problem(f"there is no linear system: {reasons[0]}", rule="analyze"))
    arrays: dict[str, Any] = {}
    if "along" in report:
        arrays = _along_arrays(report)
    elif report["linearization"] is not None:
        arrays = dict(linearization_arrays(report))
    if "response" in report:
        texts = {key: np.array(report["response"][key], dtype=str) for key in _NAMED}
        arrays = texts | arrays | response_arrays(report)
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()
