"""The Python interface: the pipeline's values, with the steps between them as methods.

``load("scene.yaml").derive().simulate(accuracy=1e-9)`` returns the results of the commands. Every
value is frozen; the modules behind a step are imported when it is taken.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any

from lagrange_cli.errors import InputError, Problem

if TYPE_CHECKING:
    from lagrange_cli.analysis.values import Analysis
    from lagrange_cli.cache import Cache
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.step_values import Way
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.scene.model import Scene
    from lagrange_cli.scene.reader import SceneText
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint
    from lagrange_cli.simulate.ensemble.result import Ensemble
    from lagrange_cli.simulate.ensemble.variants import Variants
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.model.sensitivities import SensitiveModels
    from lagrange_cli.simulate.results.streaming import Stream
    from lagrange_cli.simulate.system.functions import KeptFunctions, RightHandSide
    from lagrange_cli.studies.fit.fit import Fit
    from lagrange_cli.studies.lyapunov import Lyapunov
    from lagrange_cli.studies.path.models import PathModels
    from lagrange_cli.studies.path.result import Paths
    from lagrange_cli.studies.tradeoff.measure import Trade

GivenValues = Mapping[str, "float | str"]

DrivenInputs = Mapping[str, Callable[[float], float]]


def _text(value: float | str) -> str:
    """Write a number as the shortest text that reads back the same; keep an expression."""
    return value if isinstance(value, str) else repr(float(value))


def _sensitive_inputs() -> InputError:
    message = "the motion's derivatives are not found with inputs that are Python functions"
    hint = "write the input in the scene, as an expression or a file"
    return InputError(Problem(message, hint=hint, rule="sensitivity"))


def _texts(values: GivenValues | None) -> dict[str, str]:
    return {name: _text(value) for name, value in (values or {}).items()}


def load(
    path: str | os.PathLike[str],
    *,
    parameters: GivenValues | None = None,
    initial: GivenValues | None = None,
) -> LoadedScene:
    """Read a scene file.

    Parameters
    ----------
    path
        The YAML file.
    parameters, initial
        Values that replace those of the scene; numbers or expressions.
        Velocities are named ``dot(NAME)``.

    Raises
    ------
    InputError
        The file cannot be read or is not a scene.

    Examples
    --------
    >>> load("systems/pendulums/pendulum.yaml", parameters={"l": 2.0})
    <LoadedScene pendulum>
    """
    from lagrange_cli.files import read_bytes

    file = os.fspath(path)
    name = "<stdin>" if file == "-" else file
    return loads(read_bytes(file), file=name, parameters=parameters, initial=initial)


def loads(
    text: str | bytes,
    *,
    file: str = "<text>",
    parameters: GivenValues | None = None,
    initial: GivenValues | None = None,
    times: GivenValues | None = None,
) -> LoadedScene:
    """Read a scene from its text; see :func:`load`.

    ``file`` is the name that messages have for it; ``times`` replaces ``until`` and ``start`` of
    its section ``simulate``.

    Examples
    --------
    >>> loads("particles: {ball: {mass: 1, position: [x, y, z]}}", file="ball.yaml")
    <LoadedScene ball>
    """
    from lagrange_cli.scene import SceneText

    data = text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass")
    written = SceneText(file, data, _texts(parameters), _texts(initial), _texts(times))
    return LoadedScene(written.read(), written)


@dataclass(frozen=True)
class LoadedScene:
    """A scene that was read: its content, and the text that it was read from."""

    scene: Scene
    source: SceneText

    def derive(
        self,
        *,
        digits: int = 30,
        forces: bool = False,
        formulation: Formulation | None = "auto",
        steps: Way | None = None,
    ) -> Derivation:
        """Derive and certify the equations of motion.

        Parameters
        ----------
        digits
            Decimal digits of the arithmetic that certifies them.
        forces
            Find the constraint forces too.
        formulation
            ``minimal``: few coordinates; ``multiplier``: Cartesian names, with the
            constraints beside them; ``auto``: the program chooses; None: that of the scene's
            section ``simulate``.
        steps
            Keep the derivation's steps, which text, LaTeX and JSON then write, too: by
            ``lagrange``'s equations or by ``dalembert``'s principle.

        Raises
        ------
        InputError
            The scene's geometry or its coordinates are at fault, there is no such
            formulation, or the steps are too long to be read.

        Examples
        --------
        >>> print(load("systems/pendulums/pendulum.yaml").derive())  # doctest: +ELLIPSIS
        pendulum: Simple pendulum
        ...
        Equations of motion
          θ   l θ̈ + g sin θ = 0 ...
        """
        from lagrange_cli.mechanics import derive

        wanted = self.scene.simulate.formulation_for(formulation)
        equations = derive(
            self.scene, digits=digits, forces=forces, formulation=wanted, steps=steps
        )
        return Derivation(equations, self.source, wanted, forces)

    def __repr__(self) -> str:
        return f"<LoadedScene {self.scene.name}>"


@dataclass(frozen=True, repr=False)
class Shown:
    """A page of Markdown, which notebooks typeset."""

    markdown: str

    def _repr_markdown_(self) -> str:
        return self.markdown

    def __repr__(self) -> str:
        return self.markdown


@dataclass(frozen=True)
class Derivation:
    """Certified equations of motion.

    ``str`` gives the text of ``lagrange derive``; notebooks show it typeset.

    Attributes
    ----------
    equations
        The equations, with all that is known of the system.
    source
        The scene's text, with the values that were derived.
    formulation
        The formulation that was asked for; where it was the program's choice, a simulation may
        take the other one at singular configurations.
    forces
        Constraint forces were derived.
    """

    equations: Equations
    source: SceneText
    formulation: Formulation = "auto"
    forces: bool = False

    def report(self, *, form: str = "lagrange", latex: bool = False) -> dict[str, Any]:
        """Return what ``lagrange derive --format json`` writes, ``--with latex`` too.

        Examples
        --------
        >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
        >>> derivation.report()["equations"]
        [{'coordinate': 'theta', 'residual': 'l*ddot(theta) + g*sin(theta)'}]
        """
        from lagrange_cli.emit.json_report import derivation_report

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
        from lagrange_cli.emit.text import derivation_text

        return derivation_text(self.equations, ascii=ascii, form=form, width=width, **options)

    def emit(self, to: str, **options: OptionValue) -> dict[str, str]:
        """Return file name → text in a format of ``lagrange emit --list``.

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
        from lagrange_cli.emit.registry import emitter

        return emitter(to).emit(self.equations, options)

    def show(self, *sections: str, **options: OptionValue) -> Shown:
        """Return parts of the derivation, which notebooks typeset.

        Parameters
        ----------
        sections
            Names of ``lagrange emit --sections``: ``account``, ``equations``, ``certificate`` and
            so on; without any, those of a document.
        options
            Others of ``lagrange emit --to markdown``.

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
        chosen = {"sections": ",".join(sections)} if sections else {}
        return Shown(*self.emit("markdown", **chosen, **options).values())

    def analyze(self, *parts: str, at: GivenValues | None = None) -> Analysis:
        """Find symmetries, equilibria and their stability, the linear system and its modes.

        Parameters
        ----------
        parts
            ``symmetries``, ``equilibria``, ``linearization``, ``modes``; all that can be found if
            there are none.
        at
            Coordinates of the equilibrium to linearize at, and values of inputs that are held;
            numbers or expressions.

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
        """
        from lagrange_cli.analysis.analyze import analyze

        return analyze(self.equations, parts, _texts(at))

    def simulate(
        self,
        *,
        parameters: GivenValues | None = None,
        initial: GivenValues | None = None,
        inputs: DrivenInputs | None = None,
        sensitivity: Sequence[str] = (),
        until: float | None = None,
        accuracy: float | None = None,
        method: str | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        step: float | None = None,
        samples: int | None = None,
        budget: float | None = None,
        progress: Callable[[float], None] | None = None,
        reached: Callable[[float], None] | None = None,
        stop: Callable[[], bool] | None = None,
        functions: RightHandSide | None = None,
        cache: Cache | None = None,
        stream: Stream | None = None,
        checkpoint: Checkpoint | None = None,
    ) -> Trajectory:
        """Integrate the equations of motion; what was built and compiled serves further calls.

        Parameters
        ----------
        parameters, initial
            Values that replace those of the scene, as for :func:`load`. If they may change the
            equations, these are derived and certified again.
        inputs
            Functions of time that replace the scene's inputs of these names, as ``{"F": f}``;
            ``f(t)`` is a finite number. They are to be smooth: they are called wherever a method
            evaluates forces, and what they do between is not known. Python then evaluates the
            equations too, some 100 times slower than compiled code.
        sensitivity
            Names of coordinates, of their ``dot`` and of parameters: the derivatives of the
            motion by these starts and parameters are columns ``d(theta)/d(m)`` and
            ``dot(d(theta)/d(m))`` beside it, and are promised as it is. The scene's coordinates
            are kept.
        until, accuracy, method, rtol, atol, step, samples, budget
            See :class:`.simulate.request.SimulationOptions`; by default the scene's.
        progress, reached, stop, functions, cache, stream, checkpoint
            See :class:`.simulate.simulation.RunContext`.

        Raises
        ------
        InputError
            As :func:`.simulate.simulation.simulate`.

        Examples
        --------
        >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
        >>> trajectory = derivation.simulate(until=1.0, accuracy=1e-9)
        >>> trajectory.status, round(trajectory.state["theta"], 6)
        ('ok', -1.491035)
        >>> derivation.simulate(until=1.0, initial={"theta": 0.1}).status
        'ok'
        >>> swung = derivation.simulate(until=1.0, sensitivity=["l"])
        >>> round(swung.state["d(theta)/d(l)"], 6)
        1.559491
        """
        from lagrange_cli.simulate.charts.simulation import (
            simulate_past_singularities,
            simulate_with_sensitivities,
        )
        from lagrange_cli.simulate.ensemble.members import MemberValues
        from lagrange_cli.simulate.options import SimulationOptions
        from lagrange_cli.simulate.simulation import RunContext
        from lagrange_cli.simulate.system.functions import KeptFunctions

        options = SimulationOptions(
            until=until,
            accuracy=accuracy,
            method=method,
            rtol=rtol,
            atol=atol,
            step=step,
            samples=samples,
            budget=budget,
        )
        alike = cache is None and not inputs
        context = RunContext(
            functions=functions,
            kept=self._functions if alike else KeptFunctions(cache, inputs or {}),
            cache=cache,
            stream=stream,
            checkpoint=checkpoint,
            progress=progress,
            reached=reached,
            stop=stop,
        )
        variants = self._variants(frozenset(inputs or ()))
        values = MemberValues(_texts(parameters), _texts(initial))
        if sensitivity:
            if inputs:
                raise _sensitive_inputs()
            model = self._sensitive_models.of(sensitivity, values.parameters, values.initial)
            return simulate_with_sensitivities(model, options, context)
        free = variants.recipe.formulation == "auto"
        maker = partial(variants.with_multipliers, values) if free else None
        return simulate_past_singularities(variants.of(values), options, maker, context)

    def ensemble(
        self,
        members: Mapping[str, Iterable[float | str]] | Sequence[GivenValues],
        *,
        until: float | None = None,
        accuracy: float | None = None,
        method: str | None = None,
        rtol: float | None = None,
        atol: float | None = None,
        step: float | None = None,
        samples: int | None = None,
        extra: Sequence[str] = (),
        jobs: int | None = 1,
        progress: Callable[[float], None] | None = None,
    ) -> Ensemble:
        """Simulate many motions, each with an accuracy of its own; all samples are in memory.

        Parameters
        ----------
        members
            Parameters and initial values, numbers or expressions. A mapping of names to values
            combines all of them, the last name varies fastest; a sequence of mappings with the
            same names has them one by one.
        until, accuracy, method, rtol, atol, step, samples
            As for :meth:`simulate`.
        extra
            Further columns: ``energy``, ``forces``.
        jobs
            Members that are simulated at a time: 1 in this process alone, more in threads and
            other processes, None as joblib is configured.
        progress
            Called with the part of the members that are finished.

        Raises
        ------
        InputError
            None of a few members can be derived, or an option is wrong. Others that cannot be
            begun have the status ``refused``.

        Examples
        --------
        >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
        >>> ensemble = derivation.ensemble({"theta": [0.1, 0.2], "l": [1, 2, 3]}, until=1.0)
        >>> ensemble
        <Ensemble of pendulum: 6 members, 401 samples; 6 ok>
        >>> ensemble.columns["theta"].shape, ensemble.given["l"].tolist()
        ((6, 401), [1.0, 2.0, 3.0, 1.0, 2.0, 3.0])
        """
        from lagrange_cli.simulate.ensemble.input_file import members_of
        from lagrange_cli.simulate.ensemble.planning import simulate_members
        from lagrange_cli.simulate.options import SimulationOptions

        options = SimulationOptions(
            until=until,
            accuracy=accuracy,
            method=method,
            rtol=rtol,
            atol=atol,
            step=step,
            samples=samples,
        )
        if isinstance(members, Mapping):
            values = members_of({name: list(map(_text, axis)) for name, axis in members.items()})
        else:
            values = members_of([_texts(member) for member in members])
        return simulate_members(
            self._variants(frozenset()),
            values,
            options,
            extra=tuple(extra),
            jobs=jobs,
            progress=progress,
        )

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

        model = self._variants(frozenset()).model
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

    def model(self, sensitivity: Sequence[str] = ()) -> Model:
        """Return the equations as code, without symbols, as simulations run them.

        ``sensitivity``: what the motion is differentiated by, as in :meth:`simulate`.
        """
        return self._sensitive_models.of(sensitivity, {}, {}) if sensitivity else self._model

    # Made once, at the first simulation that needs it.

    @cached_property
    def _model(self) -> Model:
        from lagrange_cli.simulate.model.build import model_of

        return model_of(self.equations)

    @cached_property
    def _sensitive_models(self) -> SensitiveModels:
        from lagrange_cli.simulate.ensemble.members import MemberValues, Recipe
        from lagrange_cli.simulate.ensemble.variants import variants_of
        from lagrange_cli.simulate.model.sensitivities import SensitiveModels

        recipe = Recipe(self.source, self.forces, self.equations.formulation)
        variants = variants_of(self.equations, recipe, self.model)

        def model(parameters: Mapping[str, str], initial: Mapping[str, str]) -> Model:
            values = MemberValues(parameters, initial)
            made = variants.of(values)
            # Numbers that depend on others come as doubles from variants.
            exact = None not in (*made.exact_numbers, *made.exact_initial)
            return made if exact else recipe.model(values)

        return SensitiveModels(self.equations, model)

    @cached_property
    def _functions(self) -> KeptFunctions:
        from lagrange_cli.simulate.system.functions import KeptFunctions

        return KeptFunctions()

    @cached_property
    def _variants(self) -> Callable[[frozenset[str]], Variants]:
        """Names of inputs that are driven → models with other values."""
        from lagrange_cli.simulate.ensemble.members import Recipe
        from lagrange_cli.simulate.ensemble.variants import variants_of

        recipe = partial(Recipe, self.source, self.forces, self.formulation)
        return lru_cache(lambda driven: variants_of(self.equations, recipe(driven), self.model))

    # What notebooks show, unless nobody would read it: pages, and formulas alone in PDF.

    def _repr_markdown_(self) -> str | None:
        from lagrange_cli.emit.latex.markdown import is_readable

        return self.emit("markdown").popitem()[1] if is_readable(self.equations) else None

    def _repr_latex_(self) -> str | None:
        from lagrange_cli.emit.latex.equations import equations_latex
        from lagrange_cli.emit.latex.markdown import is_readable

        if not is_readable(self.equations):
            return None
        return f"$$\n{equations_latex(self.equations)}\n$$"

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return f"<Derivation of {self.equations.name}>"
