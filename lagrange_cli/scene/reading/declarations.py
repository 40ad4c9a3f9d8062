"""Reading the sections that declare names: sizes, parameters, inputs, states, controllers,
particles, points, coordinates, definitions."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Mapping as AbstractMapping
from dataclasses import dataclass, field, replace
from fractions import Fraction

from lagrange_cli.errors import Mark
from lagrange_cli.latex_allowlist import between_dollars, check_latex
from lagrange_cli.scene.declared_numbers import (
    DeclaredController,
    DeclaredInput,
    DeclaredParameter,
    DeclaredState,
    DeclaredSwitch,
    SampledValue,
)
from lagrange_cli.scene.language.expression import Expression, Name, Number, names_in
from lagrange_cli.scene.language.grammar import INEQUALITIES
from lagrange_cli.scene.language.problems import shown
from lagrange_cli.scene.language.tokens import IDENTIFIER
from lagrange_cli.scene.model import (
    DeclaredCoordinate,
    DeclaredFunction,
    Definition,
    Particle,
    Point,
    Size,
)
from lagrange_cli.scene.reading.columns import RECORDED, TABLE, read_recorded, read_table_of
from lagrange_cli.scene.reading.entries import Reading, is_indexed
from lagrange_cli.scene.reading.overrides import given_size
from lagrange_cli.scene.reading.source import Mapping, Scalar, Sequence, SourceNode
from lagrange_cli.scene.unit_table import or_product, value_and_unit

AXES = ("x", "y", "z")

_POSITION = "a list of three entries [x, y, z]"

#: Keys of a state with two values.
_SWITCH = ("on", "off")


def component(axis: str, name: str) -> str:
    """Return the name of a component of a particle's or point's position: ``x_bob``."""
    return f"{axis}_{name}"


def read_sizes(node: SourceNode, reading: Reading) -> tuple[Size, ...]:
    """Read ``sizes``; values given beside the scene replace those of the file."""
    sizes = []
    mapping = reading.mapping(node, "'sizes'", "a mapping of names")
    for key, value in mapping.entries if mapping else ():
        if not reading.is_name(key, "sizes", symbols=True):
            continue
        number = reading.integer(value, f"size '{key.text}'")
        if key.text in reading.overrides:
            number = given_size(key.text, reading.overrides[key.text], reading.problems)
            if number is None:
                # The file is right: without its sizes it would only look wrong.
                reading.problems.raise_if_any()
        elif number is not None and number < 0:
            reading.expected("a whole number from 0", f"size '{key.text}'", value)
        if number is not None:
            sizes.append(Size(key.text, key.mark, number))
    reading.sizes = {size.name: size.value for size in sizes}
    reading.indices = reading.sizes
    return tuple(sizes)


def read_parameters(node: SourceNode, reading: Reading) -> tuple[DeclaredParameter, ...]:
    entries = reading.named(node, "parameters", symbols=True)
    return tuple(_parameter(key, value, reading) for key, value in entries)


def _parameter(key: Scalar, node: SourceNode, reading: Reading) -> DeclaredParameter:
    what = f"parameter '{key.text}'"
    if not isinstance(node, Mapping):
        number = _number(node, what, key.text + ": {{value: {}, unit: {}}}", reading)
        return DeclaredParameter(key.text, key.mark, number)
    fields = reading.fields(node, what, ("value", "unit", "positive", "description", "latex"))
    value = None
    if "value" in fields:
        value = _number(fields["value"], what, "value: {} and unit: {}", reading)
    return DeclaredParameter(
        key.text,
        key.mark,
        value,
        read_text_field(fields, "unit", what, reading),
        _positive(fields, what, reading),
        _description(fields, what, reading),
        read_latex(fields, what, reading),
    )


def _number(node: SourceNode, what: str, form: str, reading: Reading) -> Expression | None:
    """Read the value of a parameter; ``form`` says how it is written with a unit."""
    if not isinstance(node, Scalar) or (parts := value_and_unit(node.text)) is None:
        return reading.expression(node, what)
    reading.problems.add(
        f"{shown(node.text)} is a number with a unit",
        node.mark,
        hint=f"write {form.format(*parts)}{or_product(*parts)}",
        rule="syntax",
    )
    return None


def _positive(fields: dict[str, SourceNode], what: str, reading: Reading) -> bool:
    node = fields.get("positive")
    return node is not None and bool(reading.boolean(node, f"'positive' of {what}"))


def read_inputs(node: SourceNode, reading: Reading) -> tuple[DeclaredInput, ...]:
    """Read ``inputs``: functions of time by name, or a list of names of inputs that are 0."""
    if isinstance(node, Sequence):
        names = reading.listed(node.items, "inputs", "an input")
        return tuple(DeclaredInput(name.text, name.mark, _zero(name.mark)) for name in names)
    inputs = []
    for key, value in reading.named(node, "inputs", symbols=True):
        what = f"input '{key.text}'"
        if isinstance(value, Mapping) and any(k.text in RECORDED for k, _ in value.entries):
            recording = read_recorded(value, what, reading)
            if recording:
                inputs.append(DeclaredInput(key.text, key.mark, recording=recording))
            continue
        is_driven = isinstance(value, Mapping) and not value.entries
        expression = _zero(value.mark) if is_driven else reading.expression(value, what)
        if expression:
            inputs.append(DeclaredInput(key.text, key.mark, expression))
    return tuple(inputs)


def read_states(node: SourceNode, reading: Reading) -> tuple[DeclaredState, ...]:
    """Read ``states``: rates by name, or mappings that say more, or that are switches."""
    entries = reading.named(node, "states", symbols=True)
    return tuple(filter(None, (_state(key, value, reading) for key, value in entries)))


def _state(
    key: Scalar, node: SourceNode, reading: Reading, moved_by: str = "rate"
) -> DeclaredState | None:
    """Read a state, whose field ``rate`` may be the next value that the field ``next`` has."""
    what = f"state '{key.text}'"
    fields = {moved_by: node}
    if isinstance(node, Mapping):
        is_switch = moved_by == "rate" and any(k.text in _SWITCH for k, _ in node.entries)
        first = _SWITCH if is_switch else (moved_by, "unit")
        required = _SWITCH if is_switch else (moved_by,)
        fields = reading.fields(node, what, (*first, "description", "latex"), required=required)
    named = ((fields[k], f"'{k}' of {what}") for k in _SWITCH if k in fields)
    both = list(filter(None, (reading.equation(*entry, INEQUALITIES) for entry in named)))
    switch = DeclaredSwitch(*both) if len(both) == len(_SWITCH) else None
    rate = fields.get(moved_by)
    moved = reading.expression(rate, f"the {moved_by} of {what}") if rate else None
    moved = _zero(key.mark) if switch else moved
    texts = read_text_field(fields, "unit", what, reading), _description(fields, what, reading)
    further = *texts, with_indices(read_latex(fields, what, reading), key.text), switch
    return None if moved is None else DeclaredState(key.text, key.mark, moved, *further)


#: Keys of a controller.
_CONTROLLER = ("every", "hold", "memory")


def read_controllers(
    node: SourceNode, reading: Reading
) -> tuple[tuple[DeclaredController, ...], tuple[DeclaredState, ...]]:
    """Read ``controllers``, one or several by name, and their memory as states of rate 0."""
    mapping = reading.mapping(node, "'controllers'", "a controller or a mapping of names")
    if mapping is None:
        return (), ()
    read = _Controllers(reading)
    if any(key.text in _CONTROLLER for key, _ in mapping.entries):
        read.add("", mapping)
    else:
        for key, value in reading.named(node, "controllers", symbols=False):
            read.add(key.text, value)
    return tuple(read.controllers), tuple(read.memory)


@dataclass
class _Controllers:
    """Controllers as they are read, and their memory."""

    reading: Reading
    controllers: list[DeclaredController] = field(default_factory=list)
    memory: list[DeclaredState] = field(default_factory=list)

    def add(self, name: str, node: SourceNode) -> None:
        """Read a controller; one that stands alone has no name."""
        reading, what = self.reading, f"controller '{name}'" if name else "the controller"
        mapping = reading.mapping(node, what, "a mapping of every, hold and memory")
        if mapping is None:
            return
        fields = reading.fields(mapping, what, _CONTROLLER, required=("every",))
        every = _period(fields["every"], what, reading) if "every" in fields else None
        inputs, memory = list[SampledValue](), list[SampledValue]()
        for key, value in self._named(fields, "hold"):
            expression = reading.expression(value, f"'{key.text}' in 'hold' of {what}")
            inputs += [SampledValue(key.text, key.mark, expression)] if expression else []
        for key, value in self._named(fields, "memory"):
            state = _state(key, value, reading, "next")
            if state is not None:
                memory.append(SampledValue(state.name, state.mark, state.rate))
                self.memory.append(replace(state, rate=_zero(state.mark)))
        setting = [fields[key] for key in ("hold", "memory") if key in fields]
        if not any(not isinstance(value, Mapping) or value.entries for value in setting):
            reading.problems.add(f"{what} has no 'hold'", mapping.mark, rule="missing")
        if every is not None:
            declared = DeclaredController(name, mapping.mark, every, tuple(inputs), tuple(memory))
            self.controllers.append(declared)

    def _named(
        self, fields: AbstractMapping[str, SourceNode], key: str
    ) -> Iterator[tuple[Scalar, SourceNode]]:
        return self.reading.named(fields[key], key, symbols=True) if key in fields else iter(())


def _period(node: SourceNode, what: str, reading: Reading) -> Expression | None:
    """Read ``every``: samples are at exact multiples of a number, or of a parameter's decimals."""
    every = reading.expression(node, f"'every' of {what}")
    if every is None or isinstance(every.node, Name) or not any(names_in(every.node)):
        return every
    hint = "a parameter may have an expression as its value"
    reading.expected("a number or the name of a parameter", f"'every' of {what}", node, hint)
    return None


def read_functions(node: SourceNode, reading: Reading) -> tuple[DeclaredFunction, ...]:
    """Read ``functions``: names of arguments by name, or mappings that say more."""
    functions = []
    for key, value in reading.named(node, "functions", symbols=True):
        function = _function(key, value, reading)
        if function is not None:
            functions.append(function)
        # From here on: a function contains only functions that are declared before it.
        reading.functions[key.text] = function.arity if function else 1
    return tuple(functions)


def _function(key: Scalar, node: SourceNode, reading: Reading) -> DeclaredFunction | None:
    what = f"function '{key.text}'"
    if not IDENTIFIER.fullmatch(key.text):
        reading.problems.add(f"{what} has an index", key.mark, rule="name")
        return None
    fields = {"of": node}
    if isinstance(node, Mapping):
        known = ("of", "equals", "latex")
        if any(k.text == "file" for k, _ in node.entries):
            fields = reading.fields(node, what, TABLE, required=TABLE[:3])
            return _tabulated(key, fields, what, reading)
        fields = reading.fields(node, what, known, required=("of",))
    argument = fields.get("of")
    if argument is None:
        return None
    if not isinstance(argument, Scalar) or not IDENTIFIER.fullmatch(argument.text):
        reading.expected("the name of its argument", what, argument)
        return None
    expression = reading.expression(fields["equals"], what) if "equals" in fields else None
    latex = read_latex(fields, what, reading)
    place = (key.text, key.mark, argument.text, argument.mark)
    return DeclaredFunction(*place, expression, latex)


def _tabulated(
    key: Scalar, fields: dict[str, SourceNode], what: str, reading: Reading
) -> DeclaredFunction | None:
    """Read a function that a file gives, of one argument or of a list of two."""
    if "of" not in fields:
        return None
    node = fields["of"]
    nodes = node.items if isinstance(node, Sequence) else (node,)
    if len(nodes) not in (1, 2):
        reading.expected("one argument or a list of two", what, node)
        return None
    over = [reading.expression(argument, f"'of' of {what}") for argument in nodes]
    table = read_table_of(fields, len(nodes), what, reading)
    arguments = tuple(e for e in over if e is not None)
    if table is None or len(arguments) < len(over):
        return None
    text = ", ".join(e.text for e in arguments)
    latex = read_latex(fields, what, reading)
    return DeclaredFunction(
        key.text, key.mark, text, node.mark, latex=latex, table=table, over=arguments
    )


def _zero(mark: Mark) -> Expression:
    return Expression(Number(Fraction(0), "0", (0, 1)), "0", mark, exact=False)


def read_particles(node: SourceNode, reading: Reading) -> tuple[Particle, ...]:
    particles = []
    for key, value in reading.named(node, "particles", symbols=False):
        what = f"particle '{key.text}'"
        mapping = reading.mapping(value, what, "a mapping {mass, position, latex}")
        if mapping is None:
            continue
        fields = reading.fields(mapping, what, ("mass", "position", "latex"), required=("mass",))
        position: tuple[Expression, Expression, Expression] | None
        if "position" in fields:
            position = _position(fields["position"], what, reading)
        else:
            position = _own_components(key.text, key.mark)
        mass = None
        if "mass" in fields:
            mass = reading.expression(fields["mass"], f"the mass of {what}")
        latex = with_indices(read_latex(fields, what, reading), key.text)
        if mass and position:
            particles.append(Particle(key.text, key.mark, mass, position, latex))
    return tuple(particles)


def read_point(key: Scalar, value: SourceNode, reading: Reading) -> Point | None:
    """Read an entry of ``points``: a position, or a mapping that has one."""
    what, latex = f"point '{key.text}'", None
    if isinstance(value, Mapping):
        fields = reading.fields(value, what, ("position", "latex"), required=("position",))
        latex = with_indices(read_latex(fields, what, reading), key.text)
        if "position" not in fields:
            return None
        value = fields["position"]
    position = _position(value, what, reading)
    return Point(key.text, key.mark, position, latex) if position else None


def _position(
    node: SourceNode, what: str, reading: Reading
) -> tuple[Expression, Expression, Expression] | None:
    sequence = reading.items(node, f"the position of {what}", _POSITION)
    if sequence is None:
        return None
    if len(sequence.items) != 3:
        reading.expected(_POSITION, f"the position of {what}", sequence)
        return None
    parts = [
        reading.expression(item, f"the {axis} position of {what}")
        for axis, item in zip(AXES, sequence.items, strict=True)
    ]
    x, y, z = parts
    return (x, y, z) if x and y and z else None


def _own_components(name: str, mark: Mark) -> tuple[Expression, Expression, Expression]:
    """Return the position of a particle that states none: its components are coordinates."""
    x, y, z = (
        Expression(Name(text, (0, len(text))), text, mark, exact=False)
        for text in (component(axis, name) for axis in AXES)
    )
    return (x, y, z)


def read_coordinates(node: SourceNode, reading: Reading) -> tuple[DeclaredCoordinate, ...]:
    if isinstance(node, Mapping):
        entries = reading.named(node, "coordinates", symbols=True)
        return tuple(_coordinate(key, value, reading) for key, value in entries)
    sequence = reading.items(node, "'coordinates'", "a list of names or a mapping")
    items = sequence.items if sequence else ()
    names = reading.listed(items, "coordinates", "a coordinate")
    return tuple(DeclaredCoordinate(name.text, name.mark) for name in names)


def _coordinate(key: Scalar, node: SourceNode, reading: Reading) -> DeclaredCoordinate:
    what = f"coordinate '{key.text}'"
    mapping = reading.mapping(node, what, "a mapping {latex, unit, positive, description}")
    if mapping is None:
        return DeclaredCoordinate(key.text, key.mark)
    fields = reading.fields(mapping, what, ("latex", "unit", "positive", "description"))
    return DeclaredCoordinate(
        key.text,
        key.mark,
        read_latex(fields, what, reading),
        read_text_field(fields, "unit", what, reading),
        _description(fields, what, reading),
        _positive(fields, what, reading),
    )


def read_definitions(node: SourceNode, reading: Reading) -> tuple[Definition, ...]:
    definitions = []
    for key, value in reading.named(node, "definitions", symbols=True):
        what, latex = f"definition '{key.text}'", None
        if isinstance(value, Mapping) and any(k.text == "equals" for k, _ in value.entries):
            fields = reading.fields(value, what, ("equals", "latex"))
            latex = with_indices(read_latex(fields, what, reading), key.text)
            value = fields["equals"]
        expression = reading.expression(value, what)
        if expression:
            definitions.append(Definition(key.text, key.mark, expression, latex))
    return tuple(definitions)


def _description(fields: dict[str, SourceNode], what: str, reading: Reading) -> str | None:
    if "description" not in fields:
        return None
    return read_prose(fields["description"], f"'description' of {what}", reading)


def read_text_field(
    fields: AbstractMapping[str, SourceNode], key: str, what: str, reading: Reading
) -> str | None:
    """Read the text at a key; None without it."""
    return reading.text(fields[key], f"'{key}' of {what}") if key in fields else None


def read_prose(node: SourceNode, what: str, reading: Reading) -> str | None:
    """Read a text that may hold formulas between dollars; warn of those that are not allowed."""
    text = reading.text(node, what)
    for formula in between_dollars(text or ""):
        refused = check_latex(formula[1])
        if refused and "\\" in formula[1]:
            reading.problems.warn(
                f"'{formula[0]}' in {what} prints as it stands here: as a formula it {refused}",
                node.mark,
                hint="formulas in texts take what 'latex' keys take",
                rule="latex",
            )
    return text


def read_latex(
    fields: AbstractMapping[str, SourceNode], what: str, reading: Reading, key: str = "latex"
) -> str | None:
    """Read a symbol in LaTeX at a key, of the macros that are allowed; None without it."""
    text = read_text_field(fields, key, what, reading)
    refused = check_latex(text) if text is not None else None
    if refused:
        reading.problems.add(
            f"'{key}' of {what} {refused}",
            fields[key].mark,
            hint="it takes letters, digits, sub- and superscripts and macros of mathematics",
            rule="latex",
        )
        return None
    return text


def with_indices(latex: str | None, name: str, *, below: bool = False) -> str | None:
    """Add the indices of a family's element to the LaTeX that all its elements share.

    ``below``: it stands below a letter itself.
    """
    if latex is None or not is_indexed(name):
        return latex
    indices = name.partition("[")[2].rstrip("]")
    return f"{latex},{indices}" if below else f"{{{latex}}}_{{{indices}}}"
