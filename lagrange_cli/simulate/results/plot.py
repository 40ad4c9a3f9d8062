"""Trajectory → picture, with matplotlib where it is installed."""

from __future__ import annotations

import io
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Problem

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from lagrange_cli.simulate.results.columns import Sampled
    from lagrange_cli.simulate.results.trajectory import Trajectory

#: More lines than this in one panel have no legend.
_LONGEST_LEGEND = 12

#: Salt of the names of parts of an SVG, so that a picture is the same every time.
_SALT = "lagrange"


def draw(trajectory: Trajectory, ending: str) -> bytes:
    """Draw coordinates, velocities and energy over time; return the picture's bytes.

    Raises
    ------
    InputError
        matplotlib is not installed, or does not know the ending.
    """
    figure = new_figure((8, 8), ending)
    top, middle, bottom = figure.subplots(3, 1, sharex=True)
    dots = [f"dot({name})" for name in trajectory.coordinates]
    shown = trajectory.decimated or trajectory
    _lines(top, shown, trajectory.coordinates, "coordinates")
    _lines(middle, shown, dots, "velocities")
    bottom.plot(shown.t, shown.energy, color="black")
    bottom.set_ylabel("energy")
    bottom.set_xlabel("t")
    # Text of a scene is text, not mathematics to be parsed.
    top.set_title(trajectory.name, parse_math=False)
    return picture(figure, ending)


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


def require_program(ending: str) -> None:
    """Refuse a format that another program makes, where that is not installed.

    Raises
    ------
    InputError
        It is not.
    """
    if ending == "pgf" and shutil.which("xelatex") is None:
        message = "a plot as '.pgf' needs xelatex, which is not installed"
        raise InputError(Problem(message, hint="--plot plot.pdf", rule="output"))


def picture(figure: Figure, ending: str) -> bytes:
    """Write a figure as the bytes of a file, the same ones for the same figure.

    Raises
    ------
    InputError
        A program that the user's settings of matplotlib name is not there, or fails.
    """
    from matplotlib import rc_context

    file = io.BytesIO()
    # Without a salt the names of parts of an SVG are random.
    try:
        with rc_context({"svg.hashsalt": _SALT}):
            figure.savefig(file, format=ending, metadata=_undated(ending))
    except RuntimeError as error:
        first = next(iter(str(error).splitlines()), type(error).__name__)
        message = f"matplotlib cannot make the plot: {first}"
        raise InputError(Problem(message, hint="--plot plot.svg", rule="output")) from error
    return file.getvalue()


def _lines(axes: Axes, shown: Sampled | Trajectory, names: Sequence[str], label: str) -> None:
    for name in names:
        axes.plot(shown.t, shown.columns[name], label=name)
    axes.set_ylabel(label)
    if len(names) <= _LONGEST_LEGEND:
        for text in axes.legend(loc="best").get_texts():
            text.set_parse_math(False)


def _undated(ending: str) -> dict[str, None] | None:
    """Leave out the date where the format has one: the same run, the same bytes."""
    return (
        {"Date": None} if ending == "svg" else {"CreationDate": None} if ending == "pdf" else None
    )
