"""Scenes from files and texts, and their derivation."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.api.derivation import Derivation
from lagrange_cli.api.values import GivenValues, texts

if TYPE_CHECKING:
    from lagrange_cli.cache import Cache
    from lagrange_cli.mechanics.step_values import Way
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.scene.model import Scene
    from lagrange_cli.scene.reader import SceneText


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
    written = SceneText(file, data, texts(parameters), texts(initial), texts(times))
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
        cache: Cache | None = None,
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
            ``lagrange``'s equations, ``dalembert``'s principle, or the principle of
            ``virtual-work``, which leads to equilibria.
        cache
            Holds derivations of earlier runs, and takes this one; None to derive anew.

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
        from lagrange_cli.mechanics.stored_derivation import stored_derivation

        wanted = self.scene.simulate.formulation_for(formulation)
        equations = stored_derivation(
            self.scene,
            self.source,
            cache,
            digits=digits,
            forces=forces,
            formulation=wanted,
            steps=steps,
        )
        return Derivation(equations, self.source, wanted, forces)

    def __repr__(self) -> str:
        return f"<LoadedScene {self.scene.name}>"
