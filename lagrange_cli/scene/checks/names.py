"""Checks of the names in a scene: known, in their place, and not in circles."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

from lagrange_cli.errors import Mark
from lagrange_cli.scene.bodies import ComposedExpression
from lagrange_cli.scene.checks.dependencies import (
    NONSMOOTH,
    ExpressionTraits,
    TraitsByShape,
    dependency_order,
    rate_node,
)
from lagrange_cli.scene.checks.external import (
    check_controllers,
    check_inputs,
    check_states,
)
from lagrange_cli.scene.checks.table import NameTable, check_clashes, name_table
from lagrange_cli.scene.checks.targets import check_quaternions, check_target
from lagrange_cli.scene.checks.uses import Restrictions, Use, uses
from lagrange_cli.scene.conditions import InitialValue
from lagrange_cli.scene.language.expression import (
    Call,
    Expression,
    Name,
    names_in,
    own_function,
    walk,
)
from lagrange_cli.scene.language.problems import Problems, rate_hint, shown, suggestion
from lagrange_cli.scene.model import DeclaredFunction, Scene

_CONSTANT = ExpressionTraits(constant=True)
#: Events of a one-sided constraint, as ``expect`` calls them.
_EVENT_KINDS = ("contact", "release", "zeno")
#: Restricted names → wording, names besides parameters, terms that definitions may hold.
_ALONE: dict[str, tuple[str, tuple[str, ...], str]] = {
    "constants": ("constant", (), "them"),
    "time": ("a function of t alone", ("t",), "parameters"),
}
#: Allowed time derivatives → function that exceeds them, and a hint.
_RATES = {
    0: ("dot(...)", "positions and numbers do not depend on velocities"),
    1: ("ddot(...)", "second derivatives stand in 'equations' of 'expect' only"),
    2: ("a third derivative", ""),
}


def check_names(
    scene: Scene,
    problems: Problems,
    parts: Iterable[tuple[Expression, str]] = (),
    indices: Mapping[str, Mark] = MappingProxyType({}),
) -> None:
    """Record every problem with the names of a scene.

    ``parts`` are the expressions that were given to helpers; unknown names are
    reported there rather than in the expression that the helper stands for. ``indices``
    are those of families, with their places.

    A scene without problems has only known names, none declared twice, no
    circles among definitions or parameters, and in every expression only names
    and functions that its place allows.
    """
    table = name_table(scene)
    check_clashes(scene, table, problems, indices)
    all_uses = list(uses(scene, table.cartesian))
    before = len(problems.errors)
    reported: set[tuple[str, object]] = set()
    for expression, what in parts:
        _check_known(Use(expression, what, Restrictions()), table, reported, problems)
    for use in all_uses:
        # What frames imply holds what is written in them, which is among the parts.
        if not isinstance(use.expression, ComposedExpression):
            _check_known(use, table, reported, problems)
    check_controllers(scene, problems)
    _check_functions(scene, table, problems)
    _check_values(scene, table, problems)
    for force in scene.forces:
        check_target(force, scene, table, problems)
    check_quaternions(scene, table, problems)
    _check_expected(scene, table, problems)
    meanings = _meanings(scene, table)
    order, circles = dependency_order(meanings)
    for circle in circles:
        _report_circle(circle, scene, table, problems)
    if len(problems.errors) == before:
        _check_places(all_uses, scene, meanings, order, problems)
    if scene.coordinates is None and not problems.errors:
        _warn_of_lone_names(scene, table, all_uses, problems)


def _check_known(
    use: Use, table: NameTable, reported: set[tuple[str, object]], problems: Problems
) -> None:
    only_parameters = use.place.names == "parameters"
    for node in _first_uses(use.expression):
        if node.name in table and not only_parameters:
            continue
        if use.place.multipliers and node.name.startswith("lambda_"):
            continue  # whether there is one is known once the scene is reduced
        if use.place.momenta and node.name.lower().lstrip("p").startswith("_"):
            continue  # likewise
        mark = use.expression.mark(node.span)
        # Once in what a helper was written out to, and once for all elements of a family.
        again = {(node.name, use.what), (node.name.partition("[")[0], mark)}
        known_already = not reported.isdisjoint(again)
        reported |= again
        if known_already:
            continue
        if node.name not in table:
            multiplier = node.name.startswith("lambda_")
            problems.add(
                f"unknown name {shown(node.name)} in {use.what}",
                mark,
                hint=(multiplier and use.place.hint) or _suggestion(node.name, table),
                rule="unknown-name",
            )
        elif only_parameters and node.name != "pi" and node.name not in table.parameters:
            problems.add(
                f"{shown(node.name)} in {use.what} is not a parameter",
                mark,
                hint="only parameters and pi can stand here",
                rule="not-constant",
            )


def _check_functions(scene: Scene, table: NameTable, problems: Problems) -> None:
    """Check arguments of unknown functions, and the expressions of given ones."""
    for function in scene.functions:
        for expression in function.over:
            _check_argument(function, expression, table, problems)
        if function.table is not None:
            continue
        if function.expression is None:
            if function.argument not in table:
                problems.add(
                    f"unknown name {shown(function.argument)} in function '{function.name}'",
                    function.argument_mark,
                    hint=_suggestion(function.argument, table),
                    rule="unknown-name",
                )
            continue
        for node in _first_uses(function.expression):
            if node.name not in (function.argument, "pi") and node.name not in table.parameters:
                problems.add(
                    f"{shown(node.name)} in function '{function.name}' is neither its argument"
                    " nor a parameter",
                    function.expression.mark(node.span),
                    rule="not-constant",
                )


def _check_argument(
    function: DeclaredFunction, expression: Expression, table: NameTable, problems: Problems
) -> None:
    """Check the names in what a table is said to be a function of."""
    for node in _first_uses(expression):
        if node.name not in table and node.name not in ("t", "pi"):
            problems.add(
                f"unknown name {shown(node.name)} in function '{function.name}'",
                expression.mark(node.span),
                hint=_suggestion(node.name, table),
                rule="unknown-name",
            )


def _first_uses(expression: Expression) -> Iterable[Name]:
    """Return the first occurrence of every name of an expression."""
    first: dict[str, Name] = {}
    for node in names_in(expression.node):
        first.setdefault(node.name, node)
    return first.values()


def _suggestion(name: str, table: NameTable) -> str:
    family = name.partition("[")[0] + "["
    elements = [known for known in table.known() if known.startswith(family)]
    if elements:
        others = f" to '{elements[-1]}'" if len(elements) > 1 else ""
        return f"known are '{elements[0]}'{others}"
    otherwise = "declare it in 'parameters', 'coordinates' or 'definitions'"
    if name in table.functions:
        return f"it is a function: write {name}(...)"
    if not table.coordinates:
        otherwise = f"declare it in 'parameters' or 'definitions', or write coordinates: [{name}]"
    if name == "e":
        otherwise = "for the exponential function write exp(...)"
    known = table.known()
    moving = [term for term in known if term not in ("t", "pi", *table.parameters)]
    return rate_hint(name, moving) or suggestion(name, known, otherwise)


def _check_values(scene: Scene, table: NameTable, problems: Problems) -> None:
    """Check the names that ``initial``, ``near`` and ``state`` give values to."""
    sections = [("'initial'", scene.initial), ("'near'", scene.near)]
    sections += [("'state' of 'expect'", state.values) for state in scene.expect.states]
    for what, values in sections:
        seen: set[tuple[str, int]] = set()
        for value in values:
            _check_value(value, what, table, problems)
            if (value.name, value.order) in seen:
                problems.add(f"'{value.name}' is given twice", value.mark, rule="duplicate")
            seen.add((value.name, value.order))


def _check_value(value: InitialValue, what: str, table: NameTable, problems: Problems) -> None:
    if table.is_position(value.name):
        return
    if value.name in table.states:
        if value.order:
            problems.add(
                f"the rate of the state '{value.name}' in {what} is what 'states' says",
                value.mark,
                hint=f"give its value: {value.name}",
                rule="not-coordinate",
            )
        return
    positions = [*table.coordinates, *table.cartesian, *table.components, *table.states]
    if value.name in table:
        message = f"'{value.name}' in {what} is not a coordinate"
        problems.add(message, value.mark, rule="not-coordinate")
    else:
        problems.add(
            f"unknown name {shown(value.name)} in {what}",
            value.mark,
            hint=rate_hint(value.name, positions)
            or suggestion(value.name, positions, "expected NAME or dot(NAME)"),
            rule="unknown-name",
        )


def _check_expected(scene: Scene, table: NameTable, problems: Problems) -> None:
    """Check the names that ``expect`` calls cyclic or conserved, and those of events."""
    expect = scene.expect
    known = [f"{kind}:{u.name}" for kind in _EVENT_KINDS for u in scene.unilateral]
    for event in expect.events:
        if event.name not in known:
            hint = f"known are {', '.join(known)}" if known else "no constraint is one-sided here"
            if event.name.partition(":")[0] in _EVENT_KINDS:
                hint = suggestion(event.name, known, hint)
            problems.add(
                f"unknown event {shown(event.name)} in 'expect'",
                event.mark,
                hint=hint,
                rule="unknown-name",
            )
    positions = [*table.coordinates, *table.cartesian]
    for mark, names, known in (
        (expect.cyclic_mark, expect.cyclic, positions),
        (expect.conserved_mark, expect.conserved, _quantities(positions)),
    ):
        for name in names or ():
            if mark and name not in known:
                problems.add(
                    f"unknown name {shown(name)} in 'expect'",
                    mark,
                    hint=suggestion(name, known),
                    rule="unknown-name",
                )


def _quantities(positions: Sequence[str]) -> list[str]:
    of_all = [f"{stem}_{axis}" for stem in ("P", "L", "boost") for axis in "xyz"]
    others = [f"J_{k + 1}" for k in range(len(positions))]
    return ["energy", "jacobi", *(f"p_{name}" for name in positions), *of_all, *others]


def _meanings(scene: Scene, table: NameTable) -> dict[str, Expression]:
    """Map names to their expressions: definitions, components, values of parameters."""
    meanings = {d.name: d.expression for d in scene.definitions}
    for name, entry in table.components.items():
        itself = isinstance(entry.node, Name) and entry.node.name == name
        if not itself:
            meanings.setdefault(name, entry)
    for parameter in scene.parameters:
        if parameter.value:
            meanings[parameter.name] = parameter.value
    return meanings


def _report_circle(circle: list[str], scene: Scene, table: NameTable, problems: Problems) -> None:
    start = min(range(len(circle)), key=lambda i: _declared(circle[i], table).line)
    names = [*circle[start:], *circle[:start]]
    kind = "parameters" if names[0] in table.parameters else "definitions"
    shown = " -> ".join([*names, names[0]])
    problems.add(f"{kind} go in a circle: {shown}", _declared(names[0], table), rule="cycle")


def _declared(name: str, table: NameTable) -> Mark:
    for kind in (table.definitions, table.parameters):
        if name in kind:
            return kind[name]
    return table.components[name].mark()


def _check_places(
    all_uses: list[Use],
    scene: Scene,
    meanings: dict[str, Expression],
    order: list[str],
    problems: Problems,
) -> None:
    """Check that every expression contains only names and functions allowed in its place."""
    parameters = {p.name: _CONSTANT for p in scene.parameters}
    # In dynamics parameters are symbols; in numbers their values count.
    inputs = {term.name: ExpressionTraits(first_input=term.name) for term in scene.inputs}
    states = {
        state.name: ExpressionTraits(
            first_state=state.name, first_switch=state.name if state.switch else None
        )
        for state in scene.states
    }
    # Tables have no second derivative at their points.
    tables = {f.name: ExpressionTraits(rough=f.name) for f in scene.functions if f.table}
    symbolic: dict[str, ExpressionTraits] = {"pi": _CONSTANT}
    symbolic |= {**parameters, **inputs, **states, **tables}
    numeric: dict[str, ExpressionTraits] = dict(symbolic)
    traits = TraitsByShape()
    for name in order:
        names = numeric if name in parameters else symbolic
        with problems.collect_at(meanings[name]):
            names[name] = traits.of_tree(meanings[name].node, names)
    for use in all_uses:
        names = numeric if use.place.names == "parameters" else symbolic
        with problems.collect_at(use.expression, use.what):
            _check_place(use, traits.of_tree(use.expression.node, names), names, scene, problems)


def _check_place(
    use: Use,
    traits: ExpressionTraits,
    names: dict[str, ExpressionTraits],
    scene: Scene,
    problems: Problems,
) -> None:
    if traits.rate > use.place.rate:
        _report_rate(use, names, problems)
    if traits.rough and use.place.smooth:
        node = next(n for n in walk(use.expression.node) if _is_rough(n, names))
        problems.add(
            f"{traits.rough}(...) cannot stand in {use.what}",
            use.expression.mark(node.span),
            hint=use.place.hint
            or "positions and constraints need functions with a derivative everywhere",
            rule="not-smooth",
        )
    if use.place.names in _ALONE:
        _check_constant(use, names, problems)
        return
    if traits.first_input:
        check_inputs(use, names, scene, problems)
    if traits.first_state:
        check_states(use, names, problems)


def _check_constant(use: Use, names: dict[str, ExpressionTraits], problems: Problems) -> None:
    """Refuse names that are not constant, t among them, in expressions of constants."""
    says, allowed, terms = _ALONE[use.place.names]
    for node in _first_uses(use.expression):
        if names.get(node.name, ExpressionTraits()).constant or node.name in allowed:
            continue
        known = ", ".join([*allowed, "parameters"])
        problems.add(
            f"'{node.name}' in {use.what} is not {says}",
            use.expression.mark(node.span),
            hint=f"only {known}, pi and definitions in terms of {terms} can stand here",
            rule="not-constant",
        )
        return


def _is_rough(node: object, names: dict[str, ExpressionTraits]) -> bool:
    if isinstance(node, Call):
        name = own_function(node.function)
        return name in NONSMOOTH or names.get(name, ExpressionTraits()).rough is not None
    return isinstance(node, Name) and names.get(node.name, ExpressionTraits()).rough is not None


def _report_rate(use: Use, names: dict[str, ExpressionTraits], problems: Problems) -> None:
    node = rate_node(use.expression.node, names, use.place.rate)
    assert node is not None
    mark = use.expression.mark(node.span)
    function, hint = _RATES[use.place.rate]
    problems.add(
        f"{function} cannot stand in {use.what}",
        mark,
        hint=use.place.hint or hint,
        rule="misplaced-rate",
    )


def _warn_of_lone_names(
    scene: Scene, table: NameTable, all_uses: list[Use], problems: Problems
) -> None:
    """Warn of names that stand bare in one position and nowhere else."""
    mentions: dict[str, int] = {}
    for use in all_uses:
        for node in _first_uses(use.expression):
            mentions[node.name] = mentions.get(node.name, 0) + 1
    for name in (*table.definitions, *(v.name for v in (*scene.initial, *scene.near))):
        mentions[name] = mentions.get(name, 0) + 1
    for component, entry in table.components.items():
        if not isinstance(entry.node, Name) or entry.node.name == component:
            continue
        name = entry.node.name
        if name in table.cartesian and mentions[name] == 1 and component not in mentions:
            problems.warn(
                f"'{name}' stands in no other section; it is taken as a coordinate",
                table.cartesian[name],
                hint="list it in 'coordinates' if that is meant",
                rule="lone-name",
            )
