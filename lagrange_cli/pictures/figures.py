"""Figures of matplotlib: endings, settings, programs of TeX, and the same bytes every time."""

from __future__ import annotations

import functools
import io
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from lagrange_cli.errors import InputError, Problem

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Salt of the names of parts of an SVG, so that a picture is the same every time.
_SALT = "lagrange"

#: Dots an inch of pictures that are made of dots.
DPI = 200

#: Beginning of a picture as .pgf, with what matplotlib leaves to the reader's preamble.
_PGF_HEAD = b"\\begingroup%\n\\providecommand{\\mathdefault}[1]{#1}%\n"

#: Programs of TeX that set the texts of a picture as .pgf.
_TEX_PROGRAMS = ("xelatex", "lualatex", "pdflatex")


def new_figure(size: tuple[float, float], ending: str) -> Figure:
    """Make an empty figure, in inches, that can be written as a file of this ending.

    Raises
    ------
    InputError
        matplotlib is not installed, or does not know the ending.
    """
    try:
        with _without_backend():
            from matplotlib.backends.backend_agg import FigureCanvasAgg
            from matplotlib.figure import Figure
    except ImportError:
        raise InputError(
            Problem(
                "plots need matplotlib",
                hint="pip install 'lagrange-cli[plot]'",
                rule="missing-extra",
            )
        ) from None
    figure = Figure(figsize=size, layout="constrained")
    known = FigureCanvasAgg(figure).get_supported_filetypes()
    if ending not in known:
        raise InputError(
            Problem(
                f"a plot cannot be written as '.{ending}'",
                hint=f"endings: {', '.join(sorted(known))}",
                rule="output",
            )
        )
    return figure


@contextmanager
def _without_backend() -> Iterator[None]:
    """Hide the name of a backend for windows, which no file needs and which may be unknown."""
    named = os.environ.pop("MPLBACKEND", None)
    try:
        yield
    finally:
        if named is not None:
            os.environ["MPLBACKEND"] = named


@contextmanager
def settings(ending: str, tex_program: str | None = None) -> Iterator[bool]:
    """Set the style of axes and what an ending needs; yields True if TeX sets the texts."""
    from matplotlib import rc_context, rcParams

    changed: Any = {
        "svg.hashsalt": _SALT,
        "pdf.fonttype": 42,
        "axes.formatter.use_mathtext": True,
        "axes.axisbelow": True,
        "axes.titlesize": "medium",
        "figure.titlesize": "large",
        "xtick.direction": "in",
        "ytick.direction": "in",
        "xtick.top": True,
        "ytick.right": True,
        "legend.frameon": False,
        "legend.fontsize": "small",
        "legend.labelspacing": 0.3,
    }
    if ending == "pgf":
        changed["pgf.texsystem"] = tex_program or _tex_program(os.environ.get("PATH"))
        changed["pgf.preamble"] = rcParams["pgf.preamble"] + r"\usepackage{amsmath}"
        # The fonts are those of the document that takes the picture.
        changed |= {"pgf.rcfonts": False, "font.family": "serif"}
    with rc_context(changed):
        yield ending == "pgf" or bool(rcParams["text.usetex"])


def require_ending(ending: str) -> None:
    """Refuse a format that cannot be written here, before there is anything to draw.

    Raises
    ------
    InputError
        matplotlib is not installed or does not know the ending, or TeX is needed and not there.
    """
    new_figure((1, 1), ending)
    if ending == "pgf":
        _tex_program(os.environ.get("PATH"))


@functools.cache
def _tex_program(path: str | None) -> str:
    """Find a program, on a search path, that sets the texts of a .pgf and has what it needs.

    Raises
    ------
    InputError
        There is none.
    """
    from matplotlib import rcParams

    reasons = ["none of them is installed"]
    for program in dict.fromkeys((str(rcParams["pgf.texsystem"]), *_TEX_PROGRAMS)):
        if shutil.which(program, path=path):
            figure = new_figure((1, 1), "pgf")
            figure.text(0, 0, "$x$")
            try:
                with settings("pgf", program):
                    figure.savefig(io.BytesIO(), format="pgf")
            except Exception as error:
                reasons.append(f"{program} fails: {_of_tex(error)}")
            else:
                return program
    said = f"a plot as '.pgf' needs one of {', '.join(_TEX_PROGRAMS)}: {reasons[-1]}"
    raise InputError(Problem(said, hint="--plot plot.tex needs none of them", rule="output"))


def _of_tex(error: Exception) -> str:
    """Return TeX's own words, in an exception of matplotlib; raise another exception again."""
    if not isinstance(error, RuntimeError) and type(error).__name__ != "LatexError":
        raise error
    lines = str(error).splitlines() or [type(error).__name__]
    return next((line[1:].strip() for line in lines if line.startswith("!")), lines[0])


def picture_bytes(figure: Figure, ending: str, dpi: int = DPI) -> bytes:
    """Write a figure as the bytes of a file, the same ones for the same figure.

    Raises
    ------
    InputError
        A program that the user's settings of matplotlib name is not there, or fails.
    """
    file = io.BytesIO()
    # Without a salt the names of parts of an SVG are random.
    try:
        with settings(ending):
            figure.savefig(file, format=ending, dpi=dpi, **_undated(ending))
    except InputError:
        raise
    except Exception as error:
        message = f"matplotlib cannot make the plot: {_of_tex(error)}"
        raise InputError(Problem(message, hint="--plot plot.svg", rule="output")) from error
    return file.getvalue().replace(b"\\begingroup%\n", _PGF_HEAD, 1)


def _undated(ending: str) -> Mapping[str, Any]:
    """Leave out the date where the format has one: the same run, the same bytes."""
    dates = {"svg": "Date", "pdf": "CreationDate"}
    return {"metadata": {dates[ending]: None}} if ending in dates else {}
