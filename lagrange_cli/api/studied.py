"""What is found out about the equations and their motions."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.api.moving import GivenMembers, Moving, members_given
from lagrange_cli.api.values import GivenValues, text_of, texts
from lagrange_cli.errors import InputError, Problem

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.varied import Varied
    from lagrange_cli.analysis.response_values import FrequencyResponse
    from lagrange_cli.api.analyzed import Analyzed
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.studies.fit.fit import Fit
    from lagrange_cli.studies.linear_motion import LinearMotion
    from lagrange_cli.studies.lyapunov import Lyapunov
    from lagrange_cli.studies.path.models import PathModels
    from lagrange_cli.studies.path.result import Paths
    from lagrange_cli.studies.section.result import Section
    from lagrange_cli.studies.tradeoff.measure import Trade


class Studied(Moving):
    """Analyses of the equations, and studies of many motions."""

    def analyze(
        self,
        *parts: str,
        at: GivenValues | None = None,
        steady: bool = False,
        branches: Mapping[str, tuple[float | str, float | str]] | None = None,
    ) -> Analyzed:
        """Find symmetries, equilibria and their stability, the linear system and its modes.

        Parameters
        ----------
        parts
            ``symmetries``, ``equilibria``, ``linearization``, ``modes``; all that can be found if
            there are none.
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

        over = None if branches is None else self._varied(branches)
        return Analyzed.of(analyze(self.equations, parts, texts(at), steady=steady, branches=over))

    def _varied(self, branches: Mapping[str, tuple[float | str, float | str]]) -> Varied:
        from lagrange_cli.analysis.branches.varied import varied

        if len(branches) != 1:
            raise ValueError("branches are followed over one parameter")
        ((name, (first, last)),) = branches.items()
        ends = text_of(first), text_of(last)
        return varied(self.equations, self.source.read(), name, ends, "--branches")

    def tradeoff(
        self,
        *,
        methods: Sequence[str] | None = None,
        repeat: int = 20,
        until: float | None = None,
        budget: float = 1.0,
        progress: Callable[[float], None] | None = None,
    ) -> Trade:
        """Measure speed against accuracy, of the methods of this program on this machine.

        Parameters
        ----------
        methods, repeat, until, budget, progress
            As :func:`lagrange_cli.studies.tradeoff.measure.trade` has them.

        Raises
        ------
        InputError
            A method is unknown or cannot run here; the scene cannot be simulated.
        AccuracyError
            There is no reference that is accurate enough.

        Examples
        --------
        >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
        >>> derivation.tradeoff(methods=["DOP853"], repeat=1).points[0].setting.method
        'DOP853'
        """
        from lagrange_cli.studies.tradeoff.measure import trade

        model = self._variants(frozenset(), (), ()).model
        return trade(
            model,
            methods=methods,
            repeat=repeat,
            until=until,
            budget=budget,
            progress=progress,
            functions=self._functions(model),
        )

    def fit(
        self,
        measurements: str | os.PathLike[str],
        free: Sequence[str],
        *,
        accuracy: float = 1e-8,
        progress: Callable[[float], None] | None = None,
    ) -> Fit:
        """Fit parameters and starts to measurements by least squares, with standard errors.

        Parameters
        ----------
        measurements
            A CSV file: ``t`` and columns of a trajectory; beside one perhaps ``sigma(NAME)``.
        free
            Names of parameters, and of coordinates or their ``dot`` for their starts; the
            scene's values are the first ones.
        accuracy
            Of the motions.
        progress
            Called with the part of the work that is done, at most.

        Raises
        ------
        InputError
            As :func:`lagrange_cli.studies.fit.fit.fit_motion`.
        """
        from lagrange_cli.studies.fit.fit import fit_motion, require_free
        from lagrange_cli.studies.fit.measurements import read_measurements

        table = read_measurements(os.fspath(measurements))
        equations = self.equations
        numbers: dict[str, float | None] = {p.name: p.value for p in equations.parameters}
        state = equations.initial
        for k, c in enumerate(equations.coordinates):
            numbers[c.name] = None if state is None else state.positions[k]
            numbers[f"dot({c.name})"] = None if state is None else state.velocities[k]
        positive = [p.name for p in equations.parameters if p.positive]
        parameters = {p.name for p in equations.parameters}

        def run(values: Mapping[str, float], by: Sequence[str], samples: int) -> Trajectory:
            return self.simulate(
                parameters={k: x for k, x in values.items() if k in parameters},
                initial={k: x for k, x in values.items() if k not in parameters},
                sensitivity=by,
                until=float(table.times[-1]),
                accuracy=accuracy,
                samples=samples,
            )

        return fit_motion(run, table, require_free(free, numbers), positive, progress)

    def lyapunov(
        self,
        *,
        until: float,
        accuracy: float = 1e-8,
        progress: Callable[[float], None] | None = None,
    ) -> Lyapunov:
        """Find the Lyapunov exponents of the motion, from the largest, with their spreads.

        Parameters
        ----------
        until
            The end of the time over which they are averaged.
        accuracy
            Of the motion and of displacements, in each of a thousand intervals.
        progress
            Called with the part of the time that is done.

        Raises
        ------
        InputError
            As :func:`lagrange_cli.studies.lyapunov.lyapunov_exponents`; or there are no
            derivatives of the motion, as with contacts.
        """
        from lagrange_cli.studies.lyapunov import lyapunov_exponents

        names = [c.name for c in self.equations.coordinates]
        starts = [*names, *(f"dot({name})" for name in names)]
        model = self.model(starts)
        return lyapunov_exponents(model, until, accuracy=accuracy, progress=progress)

    def plot_effective_potential(self, path: str | os.PathLike[str]) -> str:
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
        from lagrange_cli.files import write_file
        from lagrange_cli.simulate.results.plot import draw
        from lagrange_cli.studies.effective_potential import (
            effective_potential,
            picture_of_potential,
        )

        found = effective_potential(self.equations)
        write_file(path, draw(picture_of_potential(found), _ending(path)))
        return found.told

    def frequency_response(
        self, low: float, high: float, *, at: GivenValues | None = None
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
        from lagrange_cli.analysis.frequency_response import frequency_response

        if not (0 < low < high < float("inf")):
            message = f"frequencies are positive and ascend, not from {low:g} to {high:g}"
            raise InputError(Problem(message, hint="0.1..100", rule="response"))
        if not self.equations.inputs:
            hint = "inputs: [F] declares one, and forces may hold it"
            raise InputError(Problem("the scene has no inputs", hint=hint, rule="response"))
        linear = self.analyze("linearization", at=at).linearization
        assert linear is not None
        return frequency_response(linear.state_space, low, high)

    def plot_response(self, path: str | os.PathLike[str], response: FrequencyResponse) -> None:
        """Draw the Bode diagram of a frequency response by matplotlib.

        Raises
        ------
        InputError
            matplotlib is not installed, or cannot write such a file.
        """
        from lagrange_cli.files import write_file
        from lagrange_cli.studies.bode import bode_diagram

        title = self.equations.title or self.equations.name
        write_file(path, bode_diagram(response, title, _ending(path)))

    def plot_modes(self, path: str | os.PathLike[str], *, at: GivenValues | None = None) -> str:
        """Draw the shapes of the modes; return a remark on what is not drawn, or an empty one.

        Parameters
        ----------
        path
            A picture by matplotlib.
        at
            As of :meth:`analyze`.

        Raises
        ------
        InputError
            There are no modes, or the system cannot be drawn; matplotlib is not installed, or
            cannot write such a file.
        """
        from lagrange_cli.files import write_file
        from lagrange_cli.studies.mode_pictures import draw_modes, mode_pictures

        pictures = mode_pictures(self.equations, texts(at), moving=False)
        write_file(path, draw_modes(pictures, _ending(path)))
        return pictures.remark

    def animate_modes(self, path: str | os.PathLike[str], *, at: GivenValues | None = None) -> str:
        """Draw the modes moving, as ``.svg`` or ``.gif``; as :meth:`plot_modes`."""
        from lagrange_cli.files import write_file
        from lagrange_cli.studies.mode_pictures import animated_modes, mode_pictures

        pictures = mode_pictures(self.equations, texts(at), moving=True)
        write_file(path, animated_modes(pictures, _ending(path)))
        return pictures.remark

    def linearize(
        self,
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
            return self.simulate(until=until, accuracy=to, samples=samples, initial=initial)

        return linear_motion(self.equations, motion, accuracy)

    def section(
        self,
        condition: str,
        members: GivenMembers | None = None,
        *,
        until: float | None = None,
        accuracy: float | None = None,
        method: str | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        budget: float | None = None,
        jobs: int | None = 1,
        progress: Callable[[float], None] | None = None,
    ) -> Section:
        """Find the points at which the motion, or each of many, meets a Poincaré section.

        Parameters
        ----------
        condition
            An equation and inequalities between expressions of the scene language over the state,
            the time and the scene's names: ``"theta2 = 0, dot(theta2) > 0"``. Angles of which whole
            turns change nothing are equal modulo these.
        members
            Parameters and initial values of many motions, as :meth:`ensemble` takes them; None for
            the scene's motion.
        until, accuracy, method, rtol, atol, budget
            As for :meth:`simulate`; the budget is that of all motions. With a method nothing is
            promised.
        jobs, progress
            As for :meth:`ensemble`.

        Raises
        ------
        InputError
            Located: the condition is none, or as :meth:`simulate` or :meth:`ensemble`.

        Examples
        --------
        >>> derivation = load("systems/oscillators/henon_heiles.yaml").derive()
        >>> section = derivation.section("x = 0, dot(x) > 0", until=100)
        >>> section
        <Section of henon_heiles where x = 0, dot(x) > 0: 17 points>
        >>> round(float(section.columns["y"][1]), 6)
        0.342928
        """
        from lagrange_cli.simulate.ensemble.members import Recipe
        from lagrange_cli.simulate.ensemble.variants import variants_of
        from lagrange_cli.simulate.model.sections import WrittenCondition
        from lagrange_cli.simulate.options import SimulationOptions
        from lagrange_cli.simulate.simulation import RunContext
        from lagrange_cli.studies.section.members import section_of_members, single_section
        from lagrange_cli.studies.section.models import section_model

        written = WrittenCondition(condition, "section")
        options = SimulationOptions(
            until=until, accuracy=accuracy, method=method, rtol=rtol, atol=atol, budget=budget
        )
        known = section_model(self.equations, written)
        if members is None:
            return single_section(known, options, RunContext(progress=progress))
        recipe = Recipe(self.source, self.forces, self.formulation, section=written)
        models = variants_of(self.equations, recipe, self.model)
        values = members_given(members)
        return section_of_members(known, models, values, options, jobs=jobs, progress=progress)

    def path(
        self,
        start: GivenValues,
        end: GivenValues,
        *,
        accuracy: float = 1e-9,
        starts: int = 32,
        turns: int = 0,
        samples: int = 101,
        progress: Callable[[float], None] | None = None,
    ) -> Paths:
        """Find the paths of stationary action between two configurations at two times.

        Parameters
        ----------
        start, end
            Values of all coordinates and of the time ``t``, as numbers or as expressions over
            the parameters.
        accuracy, starts, turns, samples, progress
            See :func:`.studies.path.find.find_paths`.

        Raises
        ------
        InputError
            The motion is not that of stationary action, or as ``find_paths``.
        AccuracyError
            No path was found.

        Examples
        --------
        >>> derivation = load("systems/lecture/thrown_ball.yaml").derive()
        >>> paths = derivation.path({"x": 0, "z": 0, "t": 0}, {"x": 4, "z": 0, "t": 1})
        >>> paths.solutions[0].conjugacy.kind
        'minimum'
        """
        from lagrange_cli.studies.path.ends import end_of, read_ends
        from lagrange_cli.studies.path.find import find_paths

        written = end_of(start, "start"), end_of(end, "end")
        models = self.path_models()
        first, last = read_ends(*written, models.motion.coordinates, self.source.read)
        return find_paths(
            models,
            first,
            last,
            accuracy=accuracy,
            starts=starts,
            turns=turns,
            samples=samples,
            progress=progress,
        )

    def path_models(self) -> PathModels:
        """Return the models that :meth:`path` finds its solutions with.

        Raises
        ------
        InputError
            The motion is not that of stationary action, with the reason.
        """
        from lagrange_cli.studies.path.lagrangian import periodic_coordinates, with_action
        from lagrange_cli.studies.path.models import PathModels

        acting = replace(self, equations=with_action(self.equations))
        rates = [f"dot({c.name})" for c in self.equations.coordinates]
        return PathModels(acting.model(), acting.model(rates), periodic_coordinates(self.equations))


def _ending(path: str | os.PathLike[str]) -> str:
    """Return the ending of a file's name, without its dot."""
    return os.path.splitext(os.fspath(path))[1].lower().lstrip(".")
