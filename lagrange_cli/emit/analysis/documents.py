"""Documents of an analysis in every format that documents of derivations have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.emit.analysis.contents import analysis_sections
from lagrange_cli.emit.base import OptionValue, completed, unknown_choice
from lagrange_cli.emit.document.contents import Content
from lagrange_cli.emit.document_options import ANALYZED, LATEX_OPTIONS
from lagrange_cli.emit.latex.equations import emit_latex
from lagrange_cli.emit.latex.markdown import emit_markdown
from lagrange_cli.emit.typst.document import emit_typst

if TYPE_CHECKING:
    from lagrange_cli.analysis.result import Analysis
    from lagrange_cli.mechanics.equations import Equations

_Emit: TypeAlias = Callable[["Equations", Mapping[str, OptionValue], Content], dict[str, str]]

#: Format → what writes a content in it.
_FORMATS: dict[str, _Emit] = {
    "latex": emit_latex,
    "markdown": emit_markdown,
    "typst": emit_typst,
}

#: What options of derivations are where a document holds none.
_DEFAULTS: dict[str, OptionValue] = {option.name: option.default for option in LATEX_OPTIONS}


def analysis_document(
    analysis: Analysis, to: str, options: Mapping[str, OptionValue] | None = None
) -> dict[str, str]:
    """Return file name → text of an analysis in ``latex``, ``markdown`` or ``typst``.

    Parameters
    ----------
    analysis
        What was found.
    to
        The format.
    options
        Those of :data:`~.document_options.ANALYZED`; those absent take their defaults.

    Raises
    ------
    InputError
        There is no such format or option, or the option does not take the value.
    """
    if to not in _FORMATS:
        listed = ", ".join(_FORMATS)
        message = f"an analysis has no format '{to}'; there are {listed}"
        raise unknown_choice(message, to, list(_FORMATS))
    chosen = completed(to, ANALYZED[to], options or {})
    content = Content("analysis", partial(analysis_sections, analysis))
    return _FORMATS[to](analysis.equations, {**_DEFAULTS, **chosen}, content)
