"""Analyses of a derivation: symmetries, equilibria, the linear system, pictures."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

from lagrange_cli.api.derived import Derived
from lagrange_cli.api.motion import simulate
from lagrange_cli.api.values import GivenValues, text_of, texts
from lagrange_cli.errors import InputError, Problem

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.parameter import Varied
    from lagrange_cli.analysis.values import FrequencyResponse
    from lagrange_cli.api.analyzed import Analyzed
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.studies.linear_motion import LinearMotion


def analyze(
    derived: Derived,
    *parts: str,
    at: GivenValues | None = None,
    steady: bool = False,
    branches: Mapping[str, tuple[float | str, float | str]] | None = None,
) -> Analyzed:
    """Find symmetries, equilibria and their stability, the linear system, modes, lost contacts.

    Parameters
    ----------
    parts
        ``symmetries``, ``equilibria``, ``linearization``, ``modes``, ``contacts``; all that can
        be found if there are none.
    at
        Coordinates of the equilibrium to linearize at, and values of inputs that are held;
        numbers or expressions. Of steady motions also momenta ``p_phi`` or rates ``dot(phi)``
        of ignored coordinates, by default the momenta of the initial state.
    steady
        Find steady motions, in which ignored coordinates turn uniformly and the others rest,
        in place of equilibria.
    branches
        A parameter and its range: branches of equilibria are followed over it. Alone unless
        parts are named.

    Raises
    ------
    InputError
        A part that is named cannot be found, or there is no equilibrium at ``at``.

    Examples
    --------
    >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
    >>> [point.stability.verdict for point in derivation.analyze().equilibria.points]
    ['stable', 'unstable']
    >>> derivation.analyze("linearization", at={"theta": "pi"}).linearization.stiffness
    array([[-9.81]])
    >>> table = load("systems/lecture/masses_through_hole.yaml").derive()
    >>> orbit = table.analyze("modes", at={"dot(theta)": 3}, steady=True)
    >>> [str(mode.exact_square) for mode in orbit.modes]
    ['3*M*dot(theta)**2/(M + m)']
    >>> hoop = load("systems/beads/bead_on_rotating_hoop.yaml").derive()
    >>> [mark.kind for mark in hoop.analyze(branches={"omega": (0, 12)}).branches.marks]
    ['pitchfork']
    """
    from lagrange_cli.analysis.analyze import analyze
    from lagrange_cli.api.analyzed import Analyzed

    over = None if branches is None else _varied(derived, branches)
    return Analyzed.of(analyze(derived.equations, parts, texts(at), steady=steady, branches=over))


def _varied(derived: Derived, branches: Mapping[str, tuple[float | str, float | str]]) -> Varied:
    from lagrange_cli.analysis.branches.parameter import varied

    if len(branches) != 1:
        raise ValueError("branches are followed over one parameter")
    ((name, (first, last)),) = branches.items()
    ends = text_of(first), text_of(last)
    return varied(derived.equations, derived.source.read(), name, ends, "--branches")


def require_picture(ending: str) -> None:
    """Refuse an ending that pictures cannot be written with here, before there is one to draw.

    Raises
    ------
    InputError
        matplotlib is not installed or does not know the ending, or TeX is needed and not there.
    """
    from lagrange_cli.pictures.figures import require_ending

    require_ending(ending)


def plot_effective_potential(derived: Derived, path: str | os.PathLike[str]) -> str:
    """Draw V_eff of Routh's form about the start, with the turning points; return these.

    Parameters
    ----------
    path
        A picture by matplotlib, or ``.tex`` for pgfplots.

    Raises
    ------
    InputError
        As :func:`lagrange_cli.studies.effective_potential.effective_potential`; matplotlib is
        not installed, or cannot write such a file.
    """
    from lagrange_cli.pictures.drawing import draw_into
    from lagrange_cli.studies.effective_potential import effective_potential

    potential = effective_potential(derived.equations)
    draw_into(path, potential)
    return potential.phrase


def frequency_response(
    derived: Derived, low: float, high: float, *, at: GivenValues | None = None
) -> FrequencyResponse:
    """Find the responses of outputs to inputs between two angular frequencies.

    Parameters
    ----------
    low, high
        The angular frequencies, positive and ascending.
    at
        As of :meth:`analyze`.

    Raises
    ------
    InputError
        There are no inputs, no equilibrium, or no such frequencies.

    Examples
    --------
    >>> derivation = load("systems/oscillators/driven_spring.yaml").derive()
    >>> found = derivation.frequency_response(0.1, 100)
    >>> [round(peak.frequency, 6) for peak in found.channels[0].peaks]
    [6.324555]
    """
    from lagrange_cli.analysis.linear.frequency_response import frequency_response

    if not (0 < low < high < float("inf")):
        message = f"frequencies are positive and ascend, not from {low:g} to {high:g}"
        raise InputError(Problem(message, hint="0.1..100", rule="response"))
    if not derived.equations.system.inputs:
        hint = "inputs: [F] declares one, and forces may hold it"
        raise InputError(Problem("the scene has no inputs", hint=hint, rule="response"))
    linear = analyze(derived, "linearization", at=at).linearization
    assert linear is not None
    orders = [u.order for u in derived.equations.system.inputs]
    return frequency_response(linear.state_space, low, high, orders)


def plot_response(
    derived: Derived, path: str | os.PathLike[str], response: FrequencyResponse
) -> None:
    """Draw the Bode diagram of a frequency response, as :func:`plot_modes` draws modes.

    Raises
    ------
    InputError
        matplotlib is not installed, or cannot write such a file.
    """
    from lagrange_cli.pictures.drawing import draw_into
    from lagrange_cli.pictures.drawn.responses import BodeDiagram
    from lagrange_cli.simulate.model.labels import labels_of

    draw_into(path, BodeDiagram(response, labels_of(derived.equations)))


def plot_modes(
    derived: Derived, path: str | os.PathLike[str], *, at: GivenValues | None = None
) -> str:
    """Draw the shapes of the modes; return a remark on what is not drawn, or an empty one.

    Parameters
    ----------
    path
        A picture by matplotlib, or ``.tex`` for pgfplots.
    at
        As of :meth:`analyze`.

    Raises
    ------
    InputError
        There are no modes, or the system cannot be drawn; matplotlib is not installed, or
        cannot write such a file.
    """
    from lagrange_cli.pictures.drawing import draw_into
    from lagrange_cli.pictures.drawn.modes import mode_pictures

    pictures = mode_pictures(derived.equations, texts(at), moving=False)
    draw_into(path, pictures)
    return pictures.remark


def animate_modes(
    derived: Derived, path: str | os.PathLike[str], *, at: GivenValues | None = None
) -> str:
    """Draw the modes moving, as ``.svg`` or ``.gif``; as :meth:`plot_modes`."""
    from lagrange_cli.files import write_file
    from lagrange_cli.pictures.drawn.modes import mode_pictures
    from lagrange_cli.pictures.moving import animated

    pictures = mode_pictures(derived.equations, texts(at), moving=True)
    write_file(path, animated(pictures, _ending(path)))
    return pictures.remark


def linearize(
    derived: Derived,
    *,
    until: float | None = None,
    accuracy: float = 1e-6,
    samples: int | None = None,
    initial: GivenValues | None = None,
) -> LinearMotion:
    """Linearize along the motion: A(t), B(t), C(t), D(t) at its samples.

    Parameters
    ----------
    until, samples, initial
        As for :meth:`simulate`.
    accuracy
        Of the motion, and of the matrices, as :class:`.studies.linear_motion.LinearMotion`
        measures them.

    Raises
    ------
    InputError
        As :func:`lagrange_cli.studies.linear_motion.linear_motion`.

    Examples
    --------
    >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
    >>> beside = derivation.linearize(until=1.0, samples=3)
    >>> beside.matrices["A"].shape, beside.states
    ((3, 2, 2), ('theta', 'dot(theta)'))
    """
    from lagrange_cli.studies.linear_motion import linear_motion

    def motion(to: float) -> Trajectory:
        return simulate(derived, until=until, accuracy=to, samples=samples, initial=initial)

    return linear_motion(derived.equations, motion, accuracy)


def _ending(path: str | os.PathLike[str]) -> str:
    """Return the ending of a file's name, without its dot."""
    return os.path.splitext(os.fspath(path))[1].lower().lstrip(".")
