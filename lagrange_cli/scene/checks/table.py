"""The names that a scene declares, and clashes between them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from lagrange_cli.errors import Mark
from lagrange_cli.scene.bodies import bodies_of
from lagrange_cli.scene.language.expression import Expression, Name, names_in
from lagrange_cli.scene.language.problems import Problems
from lagrange_cli.scene.model import Constraint, Particle, Point, Scene, Unilateral
from lagrange_cli.scene.reading.declarations import AXES, component
from lagrange_cli.scene.reading.overrides import initial_name

_PARTS = re.compile(r"[A-Za-z]+|[0-9]+|[^\s\\{}_A-Za-z0-9]")


@dataclass(frozen=True, slots=True)
class NameTable:
    """Names of a scene by kind, in the order of the file, with their places.

    Attributes
    ----------
    parameters, inputs, coordinates, definitions
        Declared names.
    cartesian
        Names that stand bare in a position and are not parameters; and names that constraints
        determine likewise.
    components
        ``x_NAME`` → the position entry that it stands for.
    functions
        The scene's own functions, which are no names of values.
    bodies
        Names of particles and points.
    states
        Names of states of first order.
    """

    parameters: Mapping[str, Mark]
    inputs: Mapping[str, Mark]
    coordinates: Mapping[str, Mark]
    definitions: Mapping[str, Mark]
    cartesian: Mapping[str, Mark]
    components: Mapping[str, Expression]
    functions: Mapping[str, Mark]
    bodies: Mapping[str, Mark]
    states: Mapping[str, Mark]

    def __contains__(self, name: object) -> bool:
        return any(
            name in kind
            for kind in (
                ("t", "pi"),
                self.parameters,
                self.inputs,
                self.states,
                self.coordinates,
                self.definitions,
                self.cartesian,
                self.components,
            )
        )

    def known(self) -> list[str]:
        """Return all names that an expression may use."""
        values = (self.parameters, self.inputs, self.states)
        kinds = (
            *values,
            self.coordinates,
            self.definitions,
            self.cartesian,
            self.components,
        )
        return ["t", "pi", *(name for kind in kinds for name in kind)]

    def is_position(self, name: str) -> bool:
        """Say whether a name is a coordinate, a Cartesian name or a component."""
        return any(name in kind for kind in (self.coordinates, self.cartesian, self.components))


def name_table(scene: Scene) -> NameTable:
    """Collect the names of a scene."""
    bodies: tuple[Particle | Point, ...] = (*scene.particles, *scene.points)
    parameters = {p.name: p.mark for p in scene.parameters}
    inputs = {term.name: term.mark for term in scene.inputs}
    states = {state.name: state.mark for state in scene.states}
    components = {
        component(axis, body.name): entry
        for body in bodies
        for axis, entry in zip(AXES, body.position, strict=True)
    }
    cartesian: dict[str, Mark] = {}
    for name, entry in components.items():
        node = entry.node
        if not isinstance(node, Name) or node.name in (*parameters, *inputs, *states, "t", "pi"):
            continue
        # The name of another component refers to that component.
        if node.name == name or node.name not in components:
            cartesian.setdefault(node.name, entry.mark(node.span))
    coordinates = {c.name: c.mark for c in scene.coordinates or ()}
    definitions = {d.name: d.mark for d in scene.definitions}
    functions = {f.name: f.mark for f in scene.functions}
    declared = {*parameters, *inputs, *states, *coordinates, *definitions, *components}
    declared |= {*functions, "t", "pi", "e"}
    for name, mark in dependent_names(scene).items():
        if name not in declared:
            cartesian.setdefault(name, mark)
    for name in scene.eliminated:
        cartesian.setdefault(name, scene.coordinates_mark or Mark(scene.file, 1, 1))
    marks = {body.name: body.mark for body in bodies}
    return NameTable(
        parameters,
        inputs,
        coordinates,
        definitions,
        cartesian,
        components,
        functions,
        marks,
        states,
    )


def dependent_names(scene: Scene) -> dict[str, Mark]:
    """Collect the names that stand in a constraint and in a position, energy or force.

    If nothing else declares such a name, as the angle of a wheel whose centre is the coordinate, or
    the second length of a rope over a pulley, constraints determine it as they do a Cartesian name.
    """
    constrained = {
        node.name
        for constraint in scene.constraints
        for equation in constraint.equations
        for side in (equation.left, equation.right)
        for node in names_in(side.node)
    }
    bodies: tuple[Particle | Point, ...] = (*scene.particles, *scene.points)
    terms = (*scene.kinetic, *scene.potentials, *scene.dissipation)
    expressions = [
        *(entry for body in bodies for entry in body.position),
        *(entry for body in bodies_of(scene) for entry in body.placing),
        *(term.expression for term in terms),
        *(component for force in scene.forces for component in force.components),
    ]
    dependent: dict[str, Mark] = {}
    for expression in expressions if constrained else ():
        for node in names_in(expression.node):
            if node.name in constrained:
                dependent.setdefault(node.name, expression.mark(node.span))
    return dependent


def declares(scene: Scene, name: str) -> bool:
    """Say whether a scene declares a name, which may be ``dot(x)``."""
    return initial_name(name.replace(" ", ""))[0] in name_table(scene)


def check_clashes(
    scene: Scene, table: NameTable, problems: Problems, indices: Mapping[str, Mark]
) -> None:
    """Report names declared twice, and names that print alike."""
    sizes = {size.name: size.mark for size in scene.sizes}
    outputs = {term.name: term.mark for term in scene.outputs}
    _check_declared_twice(table, sizes, indices, outputs, problems)
    _check_components(table, outputs, problems)
    particles = {p.name for p in scene.particles}
    for point in scene.points:
        if point.name in particles:
            message = f"'{point.name}' is both a particle and a point"
            problems.add(message, point.mark, rule="clash")
    _check_alike([(name, name, mark) for name, mark in table.bodies.items()], problems)
    _check_alike(list(_printed(scene, table)), problems)


def _check_declared_twice(
    table: NameTable,
    sizes: Mapping[str, Mark],
    indices: Mapping[str, Mark],
    outputs: Mapping[str, Mark],
    problems: Problems,
) -> None:
    first: dict[str, tuple[str, Mark]] = {}
    kinds = (
        ("a size", sizes),
        ("an index", indices),
        ("a parameter", table.parameters),
        ("an input", table.inputs),
        ("a state", table.states),
        ("a coordinate", table.coordinates),
        ("a definition", table.definitions),
        ("a function", table.functions),
        ("an output", outputs),
    )
    for kind, names in kinds:
        for name, mark in names.items():
            if name in first:
                earlier, place = first[name]
                hint = f"it is {earlier} on line {place.line}"
                if (kind, earlier) == ("a definition", "a coordinate"):
                    independent = [n for n in table.coordinates if n not in table.definitions]
                    hint += f"; without it, coordinates: [{', '.join(independent)}]"
                problems.add(
                    f"'{name}' is {kind} and also {earlier}", mark, hint=hint, rule="clash"
                )
            first.setdefault(name, (kind, mark))
    for name, mark in table.cartesian.items():
        kind, place = first.get(name, ("", mark))
        if kind in ("a size", "an index", "a function", "an output"):
            problems.add(
                f"'{name}' stands in a position and is also {kind}",
                mark,
                hint=f"it is {kind} on line {place.line}",
                rule="clash",
            )


def _check_components(table: NameTable, outputs: Mapping[str, Mark], problems: Problems) -> None:
    """Refuse a declared ``x_bob`` if bob's position has another name for that component."""
    fixed = {**table.parameters, **table.inputs, **table.states}
    for name, entry in table.components.items():
        itself = isinstance(entry.node, Name) and entry.node.name == name
        for kind in (fixed, table.coordinates, table.definitions, outputs):
            if name in kind and not (itself and kind is not fixed):
                axis, _, body = name.partition("_")
                problems.add(
                    f"'{name}' is already the {axis} position of '{body}'",
                    kind[name],
                    hint=f"'{body}' is declared on line {table.bodies[body].line}",
                    rule="clash",
                )


def _printed(scene: Scene, table: NameTable) -> Iterator[tuple[str, str, Mark]]:
    """Yield names with the text that they print as, and their places."""
    latex = {p.name: p.latex for p in scene.parameters}
    latex.update({c.name: c.latex for c in scene.coordinates or ()})
    latex.update({s.name: s.latex for s in scene.states})
    for name, text, _ in latex_names(scene):
        latex[name] = latex.get(name) or text
    marks: dict[str, Mark] = {}
    values = (table.parameters, table.inputs, table.states)
    declared = (*values, table.coordinates, table.definitions)
    for kind in (*declared, table.cartesian):
        for name, mark in kind.items():
            marks.setdefault(name, mark)
    for term in scene.outputs:
        marks.setdefault(term.name, term.mark)
    for name, mark in marks.items():
        yield name, latex.get(name) or name, mark
    for constraint in constraints(scene):
        multiplier = constraint.notation.multiplier_text()
        if multiplier is not None:
            yield f"lambda_{constraint.name}", multiplier, constraint.mark


def _check_alike(printed: list[tuple[str, str, Mark]], problems: Problems) -> None:
    """Refuse names that look alike in print, such as ``x1`` and ``x_1``."""
    first: dict[tuple[str, ...], tuple[str, Mark]] = {}
    for name, text, mark in printed:
        key = tuple(part for part in _PARTS.findall(text) if text != name or part not in "[],")
        if not any(part.isalpha() for part in key) and text == name:
            problems.add(f"'{name}' holds no letter", mark, rule="name")
        elif key in first:
            earlier, place = first[key]
            problems.add(
                f"'{name}' prints like '{earlier}'",
                mark,
                hint=f"'{earlier}' is on line {place.line}",
                rule="clash",
            )
        first.setdefault(key, (name, mark))


_AXES = ("x", "y", "z")


def latex_names(scene: Scene) -> Iterator[tuple[str, str, Mark]]:
    """Yield names beside those of parameters and coordinates with their LaTeX and their places.

    The components of a particle or point have its LaTeX below them.
    """
    for definition in scene.definitions:
        if definition.latex is not None:
            yield definition.name, definition.latex, definition.mark
    bodies: tuple[Particle | Point, ...] = (*scene.particles, *scene.points)
    for body in bodies:
        if body.latex is not None:
            for axis in _AXES:
                yield f"{axis}_{body.name}", f"{axis}_{{{body.latex}}}", body.mark


def constraints(scene: Scene) -> tuple[Constraint | Unilateral, ...]:
    """Return all constraints, inequalities last."""
    return (*scene.constraints, *scene.unilateral)


def stating(scene: Scene, equation: str) -> tuple[Constraint | Unilateral, str] | None:
    """Find the constraint that an equation is named after, and the equation's number in it.

    ``equation``: name of a closure equation or gap, such as ``rod`` or ``plumb_2``.
    """
    entries = {entry.name: entry for entry in constraints(scene)}
    if equation in entries:
        return entries[equation], ""
    name, _, number = equation.rstrip("_").rpartition("_")
    return (entries[name], number) if name in entries else None
