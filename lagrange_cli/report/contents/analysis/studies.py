"""Reports of what stands beside a motion or an equilibrium, each a section of an analysis too."""

from __future__ import annotations

from lagrange_cli.analysis.values import FrequencyResponse
from lagrange_cli.report.contents.analysis.numerical import (
    along_section,
    exponents_section,
    response_section,
)
from lagrange_cli.report.inlines import Plain
from lagrange_cli.report.registry import contents_of
from lagrange_cli.report.tree import Document, sections
from lagrange_cli.studies.linear_motion import LinearMotion
from lagrange_cli.studies.lyapunov import Lyapunov


@contents_of.register
def exponents_document(result: Lyapunov) -> Document:
    """Return the exponents of a motion."""
    written = sections(exponents_section(result.summary))
    return Document(result.name, "Lyapunov exponents", Plain(result.name), written)


@contents_of.register
def along_document(result: LinearMotion) -> Document:
    """Return what is known of a linear system along a motion."""
    written = sections(along_section(result.summary))
    return Document(result.name, "a linear system along a motion", Plain(result.name), written)


@contents_of.register
def response_document(result: FrequencyResponse) -> Document:
    """Return the largest gains of frequency responses, which know no scene."""
    return Document("response", "frequency responses", "", sections(response_section(result)))
