"""The Python interface: the pipeline's values, with the steps between them as methods.

``load("scene.yaml").derive().simulate(accuracy=1e-9)`` returns the results of the commands. Every
value is frozen; the modules behind a step are imported when it is taken.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lagrange_cli.cache import Cache
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.scene.model import Scene
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.results.streaming import Stream
    from lagrange_cli.simulate.system.functions import RightHandSide
    from lagrange_cli.studies.tradeoff.measure import Trade

GivenValues = Mapping[str, "float | str"]


def _texts(values: GivenValues | None) -> dict[str, str]:
    """Write numbers as the shortest text that reads back the same; keep expressions."""
    return {
        name: value if isinstance(value, str) else repr(float(value))
        for name, value in (values or {}).items()
    }


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
    from lagrange_cli.scene import read_file

    return LoadedScene(
        read_file(os.fspath(path), parameters=_texts(parameters), initial=_texts(initial))
    )


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
    from lagrange_cli.scene import read_text

    texts = {"parameters": _texts(parameters), "initial": _texts(initial), "times": _texts(times)}
    return LoadedScene(read_text(text, file, **texts))


@dataclass(frozen=True)
class LoadedScene:
    """A scene that was read; ``scene`` is its content."""

    scene: Scene

    def derive(
        self, *, digits: int = 30, forces: bool = False, formulation: Formulation | None = "auto"
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

        Raises
        ------
        InputError
            The scene's geometry or its coordinates are at fault, or there is no such
            formulation.

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
        equations = derive(self.scene, digits=digits, forces=forces, formulation=wanted)
        return Derivation(equations, self.scene if wanted == "auto" else None)

    def __repr__(self) -> str:
        return f"<LoadedScene {self.scene.name}>"


@dataclass(frozen=True)
class Derivation:
    """Certified equations of motion.

    ``str`` gives the text of ``lagrange derive``; notebooks show the equations typeset.

    Attributes
    ----------
    equations
        The equations, with all that is known of the system.
    scene
        The scene, if the formulation was the program's choice: a simulation may then take the
        other one at singular configurations. Else None.
    """

    equations: Equations
    scene: Scene | None = None

    def report(self, *, form: str = "lagrange") -> dict[str, Any]:
        """Return what ``lagrange derive --format json`` writes.

        Examples
        --------
        >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
        >>> derivation.report()["equations"]
        [{'coordinate': 'theta', 'residual': 'l*ddot(theta) + g*sin(theta)'}]
        """
        from lagrange_cli.emit.json_report import derivation_report

        return derivation_report(self.equations, form)

    def text(self, *, form: str = "lagrange", ascii: bool = False) -> str:
        """Return what ``lagrange derive`` prints."""
        from lagrange_cli.emit.text import derivation_text

        return derivation_text(self.equations, ascii=ascii, form=form)

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

    def simulate(
        self,
        *,
        progress: Callable[[float], None] | None = None,
        reached: Callable[[float], None] | None = None,
        stop: Callable[[], bool] | None = None,
        functions: RightHandSide | None = None,
        cache: Cache | None = None,
        stream: Stream | None = None,
        checkpoint: Checkpoint | None = None,
        **options: Any,
    ) -> Trajectory:
        """Integrate; see :func:`lagrange_cli.simulate.simulate` for the options.

        Examples
        --------
        >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
        >>> trajectory = derivation.simulate(until=1.0, accuracy=1e-9)
        >>> trajectory.status, round(trajectory.state["theta"], 6)
        ('ok', -1.491035)
        """
        from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
        from lagrange_cli.simulate.options import SimulationOptions
        from lagrange_cli.simulate.simulation import RunContext

        asked = SimulationOptions(**options)
        context = RunContext(functions, cache, stream, checkpoint, progress, reached, stop)
        wanted = "auto" if self.scene is None else self.scene.simulate.formulation or "auto"
        if wanted == "multiplier":
            return simulate_past_singularities(self._with_multipliers(), asked, None, context)
        maker = None if self.scene is None else self._with_multipliers
        return simulate_past_singularities(self.model(), asked, maker, context)

    def tradeoff(self, **options: Any) -> Trade:
        """Measure speed against accuracy; see
        :func:`lagrange_cli.studies.tradeoff.measure.trade`."""
        from lagrange_cli.studies.tradeoff.measure import trade

        return trade(self.model(), **options)

    def model(self) -> Model:
        """Return the equations as code, without symbols, as simulations run them."""
        from lagrange_cli.simulate.model.build import model_of

        return model_of(self.equations)

    def _with_multipliers(self) -> Model:
        from lagrange_cli.mechanics import derive
        from lagrange_cli.simulate.model.build import model_of

        assert self.scene is not None
        forces = self.equations.constraint_forces is not None
        return model_of(derive(self.scene, forces=forces, formulation="multiplier"))

    def _repr_latex_(self) -> str:
        """Return the equations of motion as notebooks typeset them."""
        from lagrange_cli.emit.latex.equations import equations_latex

        return f"$$\n{equations_latex(self.equations)}\n$$"

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return f"<Derivation of {self.equations.name}>"
