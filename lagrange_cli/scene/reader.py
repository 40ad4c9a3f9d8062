"""From a scene's text to a :class:`~lagrange_cli.scene.model.Scene`.

The registry :data:`SECTIONS` lists every section with the function that reads
it, in the order in which they are read: families need the sizes, helpers refer to
particles and points, so these come first. Suggestions for unknown sections derive from it.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable
from collections.abc import Mapping as AbstractMapping
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import Any

from lagrange_cli.errors import InputError, LagrangeError, Problem
from lagrange_cli.files import MAX_BYTES, read_bytes, too_large
from lagrange_cli.scene.checks.names import check_names
from lagrange_cli.scene.conditions import ErrorExpectation
from lagrange_cli.scene.language.problems import shown, suggestion
from lagrange_cli.scene.language.tokens import IDENTIFIER
from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.reading import conditions, declarations, frames, physics
from lagrange_cli.scene.reading.declarations import read_prose
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.helpers import read_plane
from lagrange_cli.scene.reading.overrides import (
    override_initial,
    override_parameters,
    override_times,
)
from lagrange_cli.scene.reading.source import Mapping, SourceNode, compose, decode
from lagrange_cli.scene.unit_check import check_units


@dataclass(frozen=True, slots=True)
class _Section:
    """Reader of a section; ``declares``: other sections use the names it declares."""

    read: Callable[[SourceNode, Reading], Any]
    declares: bool = False


def _read_name(node: SourceNode, reading: Reading) -> str | None:
    text = reading.text(node, "'name'")
    if text is not None and not (IDENTIFIER.fullmatch(text) and len(text) <= 100):
        reading.expected("an identifier", "'name'", node, f"for example {_identifier(text)}")
        return None
    return text


def _read_title(node: SourceNode, reading: Reading) -> str | None:
    return read_prose(node, "'title'", reading)


def _read_description(node: SourceNode, reading: Reading) -> str | None:
    return read_prose(node, "'description'", reading)


SECTIONS: dict[str, _Section] = {
    "name": _Section(_read_name),
    "title": _Section(_read_title),
    "description": _Section(_read_description),
    "sizes": _Section(declarations.read_sizes, declares=True),
    "parameters": _Section(declarations.read_parameters, declares=True),
    "inputs": _Section(declarations.read_inputs, declares=True),
    "states": _Section(declarations.read_states, declares=True),
    "controllers": _Section(declarations.read_controllers, declares=True),
    "functions": _Section(declarations.read_functions, declares=True),
    "particles": _Section(declarations.read_particles, declares=True),
    "plane": _Section(read_plane),
    "frames": _Section(frames.read_frames, declares=True),
    "bodies": _Section(frames.read_bodies, declares=True),
    "points": _Section(frames.read_points, declares=True),
    "coordinates": _Section(declarations.read_coordinates, declares=True),
    "definitions": _Section(declarations.read_definitions, declares=True),
    "constraints": _Section(physics.read_constraints),
    "potentials": _Section(physics.read_potentials),
    "kinetic": _Section(physics.read_kinetic),
    "forces": _Section(physics.read_forces),
    "dissipation": _Section(physics.read_dissipation),
    "outputs": _Section(physics.read_outputs),
    "initial": _Section(conditions.read_initial),
    "near": _Section(conditions.read_near),
    "simulate": _Section(conditions.read_simulate),
    "expect": _Section(conditions.read_expect),
}


@dataclass(frozen=True)
class SceneText:
    """The text of a scene, and values that replace some of it.

    Attributes
    ----------
    file
        Name used in messages.
    data
        Text, in UTF-8.
    parameters, initial, times
        As :func:`read_text` takes them.
    """

    file: str
    data: bytes
    parameters: AbstractMapping[str, str] = field(default_factory=dict)
    initial: AbstractMapping[str, str] = field(default_factory=dict)
    times: AbstractMapping[str, str] = field(default_factory=dict)

    def read(
        self,
        parameters: AbstractMapping[str, str] | None = None,
        initial: AbstractMapping[str, str] | None = None,
    ) -> Scene:
        """Read the scene, with further values; refuses as :func:`read_text`."""
        return read_text(
            self.data,
            self.file,
            parameters={**self.parameters, **(parameters or {})},
            initial={**self.initial, **(initial or {})},
            times=self.times,
        )


def read_file(
    path: str,
    *,
    parameters: AbstractMapping[str, str] | None = None,
    initial: AbstractMapping[str, str] | None = None,
) -> Scene:
    """Read a scene file (``-``: standard input).

    Parameters
    ----------
    path
        The file, as the user gave it.
    parameters, initial
        Values that replace those of the scene: texts of expressions by name.
        ``parameters`` may set sizes; in ``initial`` a name may be ``dot(x)``.

    Raises
    ------
    InputError
        With every problem found, each with its place.
    """
    data = read_bytes(path)
    file = "<stdin>" if path == "-" else os.fspath(path)
    return read_text(data, file, parameters=parameters, initial=initial)


def read_text(
    data: bytes | str,
    file: str = "<text>",
    *,
    parameters: AbstractMapping[str, str] | None = None,
    initial: AbstractMapping[str, str] | None = None,
    times: AbstractMapping[str, str] | None = None,
) -> Scene:
    """Read a scene from its text; ``file`` is the name used in messages.

    ``times`` replaces ``until`` and ``start`` of its section ``simulate``, by expressions. For
    the others see :func:`read_file`.
    """
    reading = Reading(file, overrides=parameters or {})
    scene = _read(data, reading, initial or {})
    reading.problems.raise_if_any()
    scene = replace(_with_starts_apart(scene), warnings=reading.problems.warnings)
    return override_times(scene, times or {})


def read_partly(data: bytes | str, file: str) -> tuple[Scene | None, tuple[Problem, ...]]:
    """Read what can be understood of a scene that is being written, with all its problems.

    Returns
    -------
    scene
        The scene without what is refused; None if the text is no tree, or exceeds a limit.
    problems
        Errors and warnings.
    """
    reading, scene = Reading(file), None
    try:
        scene = _read(data, reading, {})
        reading.problems.raise_if_any()
    except InputError as refusal:
        return scene, (*refusal.problems, *reading.problems.warnings)
    return scene, reading.problems.warnings


def _read(data: bytes | str, reading: Reading, initial: AbstractMapping[str, str]) -> Scene:
    """Read all sections and check them together; problems are recorded in ``reading``."""
    root, digest = _root(data, reading.file)
    nodes = _sections(root, reading)
    certain = not reading.problems.errors
    for name, section in SECTIONS.items():
        if name in nodes:
            before = len(reading.problems.errors)
            reading.values[name] = section.read(nodes[name], reading)
            new = reading.problems.errors[before:]
            certain &= not (section.declares and new)
            if new:
                reading.doubt(name, nodes[name])
            if section.declares and reading.problems.limits.intersection(new):
                # Without what is too large the rest would only look wrong.
                reading.problems.raise_if_any()
    scene = _scene(reading, nodes, reading.file, digest)
    if certain:
        # Names are looked up only where every declaration was understood.
        scene = override_parameters(scene, reading.overrides, reading.problems)
        scene = override_initial(scene, initial, reading.problems)
        check_names(scene, reading.problems, reading.helper_parts, reading.index_marks)
        if not reading.problems.errors:
            check_units(scene, reading.problems)
    return scene


def _with_starts_apart(scene: Scene) -> Scene:
    """Take initial values of states out of those of coordinates."""
    states = {state.name for state in scene.states}
    if not states:
        return scene
    return replace(
        scene,
        initial=tuple(v for v in scene.initial if v.name not in states),
        state_starts=tuple(v for v in scene.initial if v.name in states),
    )


def expected_error(data: bytes | str, file: str = "<text>") -> ErrorExpectation | None:
    """Return the refusal that a scene expects of itself (``expect: {error: ...}``), if any.

    It is found also in a scene that cannot be read otherwise.
    """
    try:
        root, _ = _root(data, file)
    except LagrangeError:
        return None
    for path in ("expect", "error"):
        entries = (
            {key.text: value for key, value in root.entries} if isinstance(root, Mapping) else {}
        )
        if path not in entries:
            return None
        root = entries[path]
    return conditions.read_error_expectation(root, Reading(file))


def _root(data: bytes | str, file: str) -> tuple[SourceNode, str]:
    raw = data.encode("utf-8", "surrogatepass") if isinstance(data, str) else data
    if len(raw) > MAX_BYTES:
        raise too_large(file)
    return compose(decode(raw, file), file), hashlib.sha256(raw).hexdigest()


def _sections(root: SourceNode, reading: Reading) -> dict[str, SourceNode]:
    nodes: dict[str, SourceNode] = {}
    mapping = reading.mapping(root, "a scene", "a mapping of sections")
    for key, value in mapping.entries if mapping else ():
        if key.text in SECTIONS:
            nodes[key.text] = value
        else:
            hint = suggestion(key.text, SECTIONS, f"known are {', '.join(SECTIONS)}")
            for name in SECTIONS:
                if hint == f"did you mean '{name}'?":
                    reading.doubt(name, value)
            reading.problems.add(
                f"unknown section {shown(key.text)}", key.mark, hint=hint, rule="unknown-key"
            )
    return nodes


def _scene(reading: Reading, nodes: dict[str, SourceNode], file: str, digest: str) -> Scene:
    values = {key: value for key, value in reading.values.items() if value is not None}
    values["constraints"], values["unilateral"] = values.get("constraints", ((), ()))
    plane = values.pop("plane", None)
    if plane and not values.get("particles") and reading.knows_bodies:
        reading.problems.add("'plane' without particles", plane.mark, rule="missing")
    if plane:
        for constraint in (*values["constraints"], *values["unilateral"]):
            if constraint.name == "plane":
                reading.problems.add(
                    "'plane' is both a section and a constraint", constraint.mark, rule="clash"
                )
        stated = (plane.constraint,) if plane.constraint else ()
        values["constraints"] = (*stated, *values["constraints"])
    values.pop("bodies", None)
    frames_read = values.pop("frames", None)
    if frames_read:
        frames.compose(frames_read, reading)
        for section, implied in (
            ("definitions", frames_read.definitions),
            ("constraints", frames_read.constraints),
            ("kinetic", frames_read.kinetic),
        ):
            values[section] = (*values.get(section, ()), *implied)
    if "expect" in values and not reading.sizes.keys().isdisjoint(reading.overrides):
        # Expected states and events are those of the file's sizes.
        values["expect"] = replace(values["expect"], states=(), events=())
    values["controllers"], memory = values.get("controllers", ((), ()))
    values["states"] = (*values.get("states", ()), *memory)
    values.setdefault("name", _identifier(PurePath(file).stem))
    mark = nodes["coordinates"].mark if "coordinates" in nodes else None
    return Scene(
        file=file,
        digest=digest,
        coordinates_mark=mark,
        positive=frozenset(c.name for c in values.get("coordinates", ()) if c.positive),
        links=tuple(reading.links),
        families=tuple(reading.families.items()),
        **values,
    )


def _identifier(text: str) -> str:
    """Return the identifier nearest to a text."""
    name = re.sub(r"[^A-Za-z0-9_]+", "_", text).strip("_")[:100] or "scene"
    return f"scene_{name}"[:100] if name[0].isdigit() else name
