"""Picture → file: by matplotlib where it is installed, or as LaTeX for pgfplots."""

from __future__ import annotations

import functools
import io
import os
import shutil
import textwrap
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.notation.symbols import latex_text
from lagrange_cli.simulate.results.pgfplots import pgfplots_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from lagrange_cli.simulate.model.labels import Label
    from lagrange_cli.simulate.results.picture import MarkedPlace, Panel, Picture, PlaneMap

#: Ending of files for pgfplots, which need no matplotlib.
TEX = "tex"

#: More lines than this in one panel have no legend.
_LONGEST_LEGEND = 12

#: Salt of the names of parts of an SVG, so that a picture is the same every time.
_SALT = "lagrange"

#: Inches: the width of the text of a page, that of a single path, the height of panels over time
#: and of others below each other.
_WIDTH, _SINGLE, _HEIGHT, _STACKED = 6.3, 4.4, 1.9, 2.4

#: Points, in which letters are measured, across a dot.
_DOT = 2.5

#: Part of the axes beyond which a mark has its text on the left.
_LEFT = 0.75

#: Points across a mark, and the label of what no legend names.
_MARK, _UNNAMED = 3.5, "_nolegend_"

#: Dots of a legend over those of the picture.
_LEGEND_DOT = 3

#: Inches of a map, and the colour of what has no value, which the bar of colours does not have.
_MAP, _NOTHING = (6.3, 5.4), "0.8"

#: Dots an inch of pictures that are made of dots.
_DPI = 200

#: Characters of a line of the title.
_TITLE = 64

#: Colours that differ in lightness, and dashes: lines can be told apart without colours too.
_COLOURS = ("black", "#0072b2", "#d55e00", "#009e73")
_DASHES = ("-", "--", ":", "-.", (0, (6, 1, 1, 1, 1, 1)))

#: Colour of lines behind the others.
_FAINT = "0.7"

#: Beginning of a picture as .pgf, with what matplotlib leaves to the reader's preamble.
_PGF_HEAD = b"\\begingroup%\n\\providecommand{\\mathdefault}[1]{#1}%\n"

#: Programs of TeX that set the texts of a picture as .pgf.
_TEX_PROGRAMS = ("xelatex", "lualatex", "pdflatex")


def draw(picture: Picture, ending: str) -> bytes:
    """Draw a picture; return the bytes of a file of this ending.

    Raises
    ------
    InputError
        matplotlib is not installed, or does not know the ending.
    """
    if ending == TEX:
        return pgfplots_text(picture).encode()
    columns, rows = picture.columns, -(-len(picture.panels) // picture.columns)
    over_time = picture.over_time
    width = _WIDTH if picture.wide or columns > 1 else _SINGLE
    height = rows * (_HEIGHT if over_time else _STACKED if picture.stacked else width / columns)
    figure = new_figure((width, height + 0.4), ending)
    with _settings(ending) as by_tex:
        grid = figure.subplots(rows, columns, squeeze=False, sharex=over_time)
        for axes, panel in zip(grid.flat, picture.panels, strict=False):
            _draw_panel(axes, panel, by_tex)
            if panel.has_legend and _legend_length(panel) <= _LONGEST_LEGEND:
                _draw_legend(axes, outside=columns == 1)
        for axes in grid.flat[len(picture.panels) :]:
            axes.set_visible(False)
        if over_time:
            for axes in grid.flat[:-1]:
                axes.set_xlabel("")
            figure.align_ylabels()
        # Text of a scene is text, not mathematics to be parsed.
        lines = textwrap.wrap(picture.title, _TITLE)
        title = "\n".join(map(latex_text, lines) if by_tex else lines)
        figure.suptitle(title, fontsize="large", parse_math=by_tex)
        return picture_bytes(figure, ending)


def draw_map(plane: PlaneMap, ending: str) -> bytes:
    """Draw a map as an image with a bar of its colours; return the bytes of a file of this ending.

    Raises
    ------
    InputError
        matplotlib is not installed, or does not know the ending; or it is one of TeX, to which
        images are not written.
    """
    require_map_ending(ending)
    figure = new_figure(_MAP, ending)
    with _settings(ending):
        axes = figure.subplots()
        image: Any
        if plane.is_even:
            image = axes.imshow(
                plane.values,
                origin="lower",
                extent=plane.extent,
                aspect="equal" if plane.equal else "auto",
            )
        else:
            image = axes.pcolormesh(
                plane.x, plane.y, plane.values, shading="nearest", rasterized=True
            )
            axes.set_aspect("equal" if plane.equal else "auto")
        axes.set_facecolor(_NOTHING)
        axes.set_xlabel(_shown(plane.x_label, by_tex=False))
        axes.set_ylabel(_shown(plane.y_label, by_tex=False))
        axes.tick_params(direction="out")
        label = _shown(plane.label, by_tex=False)
        figure.colorbar(image, ax=axes, label=label, fraction=0.046, pad=0.03, aspect=28)
        if np.isnan(plane.values).any():
            _draw_key(axes)
        title = "\n".join(textwrap.wrap(plane.title, _TITLE))
        figure.suptitle(title, fontsize="large", parse_math=False)
        return picture_bytes(figure, ending)


def require_map_ending(ending: str) -> None:
    """Refuse a format that a map cannot be written in, before there is anything to draw.

    Raises
    ------
    InputError
        As :func:`draw_map`.
    """
    if ending in (TEX, "pgf"):
        message = f"a map is an image, which is not written as '.{ending}'"
        raise InputError(Problem(message, hint="--plot map.png, map.pdf, map.svg", rule="output"))
    require_ending(ending)


def _draw_key(axes: Axes) -> None:
    """Say below the map which colour stands for no value."""
    from matplotlib.patches import Patch

    patch = Patch(facecolor=_NOTHING, edgecolor="0.5", linewidth=0.5, label="no value")
    place: Any = {"loc": "upper right", "bbox_to_anchor": (1.0, -0.08)}
    axes.legend(handles=[patch], frameon=False, handlelength=1.2, borderpad=0, **place)


def _draw_panel(axes: Axes, panel: Panel, by_tex: bool) -> None:
    for line in panel.faint:
        axes.plot(line.x, line.y, linewidth=0.5, color=_FAINT)
    for number, line in enumerate(panel.named):
        label = _UNNAMED if line.again else _shown(line.label, by_tex)
        (drawn,) = axes.plot(line.x, line.y, linewidth=1.0, label=label)
        colour, dash = (number, number) if line.dash is None else (0, line.dash)
        drawn.set(color=_COLOURS[colour % len(_COLOURS)], linestyle=_DASHES[dash % len(_DASHES)])
        if line.dots:
            drawn.set(linestyle="none", marker=".", markersize=_DOT, markeredgewidth=0)
    for place in panel.places:
        axes.plot([place.x], [place.y], "o", color="black", markersize=_MARK, label=_UNNAMED)
        _name_place(axes, place, by_tex)
    axes.set_xlabel(_shown(panel.x_label, by_tex))
    axes.set_ylabel(_shown(panel.y_label, by_tex))
    axes.tick_params(direction="in", top=True, right=True)
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")
    elif panel.over_time:
        axes.margins(x=0)


def _name_place(axes: Axes, place: MarkedPlace, by_tex: bool) -> None:
    """Write the text of a marked point, on its left where the axes end on its right."""
    low, high = axes.get_xlim()
    side = -1 if place.x > low + _LEFT * (high - low) else 1
    axes.annotate(
        _shown(place.label, by_tex),
        (place.x, place.y),
        (4 * side, 4),
        textcoords="offset points",
        fontsize=8,
        ha="left" if side > 0 else "right",
    )


def _legend_length(panel: Panel) -> int:
    return sum(not line.again for line in panel.named)


def _draw_legend(axes: Axes, *, outside: bool) -> None:
    """Name the lines outside of the axes, where no line is covered."""
    place: Any = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)}
    above: Any = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "ncols": 3}
    axes.legend(**(place if outside else above), frameon=False, markerscale=_LEGEND_DOT)


def _shown(label: Label, by_tex: bool) -> str:
    """Return a label as LaTeX, or in the part of it that matplotlib knows, or in Unicode."""
    if by_tex:
        return label.latex
    from matplotlib.mathtext import MathTextParser

    try:
        MathTextParser("path").parse(label.latex)
    except ValueError:
        return label.plain.replace("$", r"\$")
    return label.latex


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
def _settings(ending: str, tex_program: str | None = None) -> Iterator[bool]:
    """Set what files of an ending need; yields True if TeX sets the texts."""
    from matplotlib import rc_context, rcParams

    changed: Any = {
        "svg.hashsalt": _SALT,
        "pdf.fonttype": 42,
        "axes.formatter.use_mathtext": True,
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
                with _settings("pgf", program):
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


def picture_bytes(figure: Figure, ending: str) -> bytes:
    """Write a figure as the bytes of a file, the same ones for the same figure.

    Raises
    ------
    InputError
        A program that the user's settings of matplotlib name is not there, or fails.
    """
    file = io.BytesIO()
    # Without a salt the names of parts of an SVG are random.
    try:
        with _settings(ending):
            figure.savefig(file, format=ending, dpi=_DPI, **_undated(ending))
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
