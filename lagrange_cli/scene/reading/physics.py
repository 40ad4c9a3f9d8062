"""Reading the sections of mechanics: constraints, potentials, kinetic, forces, dissipation,
outputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from lagrange_cli.scene.bodies import ComposedExpression
from lagrange_cli.scene.language.expression import Equation, Expression
from lagrange_cli.scene.language.grammar import INEQUALITIES
from lagrange_cli.scene.language.rotations import ZERO, minus
from lagrange_cli.scene.model import Constraint, ConstraintNotation, Force, Term, Unilateral
from lagrange_cli.scene.reading.declarations import AXES, read_latex, with_indices
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.frames import in_axes_of
from lagrange_cli.scene.reading.helpers import (
    NOTATION,
    Written,
    distance,
    read_potential_helper,
    read_unilateral,
)
from lagrange_cli.scene.reading.interactions import damper, drag, unknown_helper
from lagrange_cli.scene.reading.joints import parallel, pin, weld
from lagrange_cli.scene.reading.rolling.contacts import roll, touch
from lagrange_cli.scene.reading.source import Mapping, Scalar, Sequence, SourceNode
from lagrange_cli.scene.reading.turns import across_plane

#: An equation or inequality, with its restitution.
_OneSided = tuple[Equation, Expression | None]

_FORCES = {"drag": drag, "damper": damper}

#: Helpers of ``constraints`` by their keys, which stand for equations.
_CONSTRAINTS: dict[str, Callable[[Mapping, str, Reading], Written | None]] = {
    "distance": distance,
    "pin": pin,
    "parallel": parallel,
    "weld": weld,
    "touch": touch,
    "roll": roll,
}


def read_constraints(
    node: SourceNode, reading: Reading
) -> tuple[tuple[Constraint, ...], tuple[Unilateral, ...]]:
    """Read constraints by equations, and those by inequalities."""
    constraints = []
    one_sided: list[tuple[Scalar, list[_OneSided], ConstraintNotation]] = []
    for key, value in reading.named(node, "constraints", symbols=False):
        what = f"constraint '{key.text}'"
        if isinstance(value, Mapping) and (helper := _helper(value)) is not None:
            written = helper(value, what, reading)
            notation = _notation(key, value, what, reading)
            if written is not None:
                constraints.append(
                    Constraint(key.text, key.mark, written.equations, notation, written.joint)
                )
            continue
        relations, notation = _relations(value, what, reading), _notation(key, value, what, reading)
        inequalities = [r for r in relations if r[0].relation != "="]
        if not relations or _is_mixed(key, relations, inequalities, reading):
            continue
        if inequalities:
            one_sided.append((key, inequalities, notation))
        else:
            equations = tuple(r[0] for r in relations)
            constraints.append(Constraint(key.text, key.mark, equations, notation))
    taken = {*(c.name for c in constraints), *(key.text for key, _, _ in one_sided)}
    return tuple(constraints), tuple(u for entry in one_sided for u in _unilateral(*entry, taken))


def _helper(node: Mapping) -> Callable[[Mapping, str, Reading], Written | None] | None:
    """Return the reader of a constraint that is a helper; None of one that is relations."""
    keys = [key.text for key, _ in node.entries]
    if "unilateral" in keys or "equation" in keys:
        return None
    return next((_CONSTRAINTS[key] for key in keys if key in _CONSTRAINTS), _unknown_constraint)


def _unknown_constraint(node: Mapping, what: str, reading: Reading) -> None:
    unknown_helper(node, what, (*_CONSTRAINTS, "unilateral", "equation"), reading)


def _notation(key: Scalar, node: SourceNode, what: str, reading: Reading) -> ConstraintNotation:
    """Read the LaTeX of a constraint that is a mapping."""
    if not isinstance(node, Mapping):
        return ConstraintNotation()
    fields = {entry.text: value for entry, value in node.entries if entry.text in NOTATION}
    multiplier = read_latex(fields, what, reading, "multiplier")
    return ConstraintNotation(
        with_indices(read_latex(fields, what, reading), key.text, below=True),
        with_indices(multiplier, key.text),
    )


def _is_mixed(
    key: Scalar, relations: list[_OneSided], inequalities: list[_OneSided], reading: Reading
) -> bool:
    """Say whether a constraint has equations beside inequalities, which is refused."""
    mixed = bool(inequalities) and len(inequalities) < len(relations)
    if mixed:
        reading.problems.add(
            f"constraint '{key.text}' has equations beside inequalities",
            inequalities[0][0].mark(),
            hint="give the inequality a name of its own: its contact and release are called by it",
            rule="shape",
        )
    return mixed


def _relations(node: SourceNode, what: str, reading: Reading) -> list[_OneSided]:
    """Read equations and inequalities of a constraint, each with its restitution."""
    if isinstance(node, Mapping):
        keys = [key.text for key, _ in node.entries]
        if "unilateral" in keys:
            one_sided = read_unilateral(node, what, reading)
            return [one_sided] if one_sided else []
        node = reading.fields(node, what, ("equation", *NOTATION))["equation"]
    items = node.items if isinstance(node, Sequence) else (node,)
    if not items:
        reading.expected("an equation or inequality", what, node)
    read = [reading.equation(item, what, ("=", *INEQUALITIES)) for item in items]
    return [(equation, None) for equation in read if equation]


def _unilateral(
    key: Scalar, inequalities: list[_OneSided], notation: ConstraintNotation, taken: set[str]
) -> Iterator[Unilateral]:
    """Yield the one-sided constraints of one entry, numbered if there are several."""
    for number, (inequality, restitution) in enumerate(inequalities, 1):
        name, shown = key.text, notation
        if len(inequalities) > 1:
            shown = ConstraintNotation(
                notation.index_text(f"{number}"),
                notation.multiplier and notation.multiplier_text(f"{number}"),
            )
            name = f"{name}_{number}"
            while name in taken:
                name += "_"
            taken.add(name)
        yield Unilateral(name, key.mark, inequality, restitution, shown)


def read_potentials(node: SourceNode, reading: Reading) -> tuple[Term, ...]:
    terms = []
    for key, value in reading.named(node, "potentials", symbols=False):
        what = f"potential '{key.text}'"
        expression: Expression | None
        if isinstance(value, Mapping):
            expression = read_potential_helper(value, what, reading)
        else:
            expression = reading.expression(value, what)
        if expression:
            terms.append(Term(key.text, key.mark, expression))
    return tuple(terms)


def read_kinetic(node: SourceNode, reading: Reading) -> tuple[Term, ...]:
    return _terms(node, "kinetic", "kinetic energy", reading)


def read_dissipation(node: SourceNode, reading: Reading) -> tuple[Term, ...]:
    return _terms(node, "dissipation", "dissipation", reading)


def read_outputs(node: SourceNode, reading: Reading) -> tuple[Term, ...]:
    return _terms(node, "outputs", "output", reading, symbols=True)


def _terms(
    node: SourceNode, section: str, word: str, reading: Reading, *, symbols: bool = False
) -> tuple[Term, ...]:
    terms = []
    for key, value in reading.named(node, section, symbols=symbols):
        expression = reading.expression(value, f"{word} '{key.text}'")
        if expression:
            terms.append(Term(key.text, key.mark, expression))
    return tuple(terms)


def read_forces(node: SourceNode, reading: Reading) -> tuple[Force, ...]:
    forces: list[Force] = []
    for key, value in reading.named(node, "forces", symbols=False):
        forces += _forces(key, value, reading)
    return tuple(forces)


def _forces(key: Scalar, node: SourceNode, reading: Reading) -> tuple[Force, ...]:
    """Read the forces of an entry: two for a damper, else one."""
    what = f"force '{key.text}'"
    mapping = reading.mapping(node, what, "a mapping {on, force}")
    if mapping is None:
        return ()
    for name, _ in mapping.entries:
        if name.text in _FORCES:
            return _FORCES[name.text](key, mapping, what, reading)
    is_torque = any(name.text == "torque" for name, _ in mapping.entries)
    acting = "torque" if is_torque else "force"
    fields = reading.fields(mapping, what, ("on", acting, "axes"), required=("on", acting))
    if "on" not in fields or acting not in fields:
        return ()
    on = fields["on"]
    read = _torque if is_torque else _components
    components = read(fields[acting], what, reading)
    if "axes" in fields and components is not None:
        components = _along_axes(fields["axes"], fields[acting], components, what, reading)
    if not isinstance(on, Scalar):
        reading.expected("a particle, point or coordinate", f"'on' of {what}", on)
        return ()
    target = reading.reference(on)
    if components is None or target is None:
        return ()
    return (Force(key.text, key.mark, target, on.mark, components, is_torque),)


def _torque(node: SourceNode, what: str, reading: Reading) -> tuple[Expression, ...] | None:
    """Read a torque: three components, or one in the sense of turns in the plane of the scene."""
    across = across_plane(reading)
    if across is None or isinstance(node, Sequence):
        if isinstance(node, Sequence):
            return _components(node, what, reading)
        reading.expected("a list of three components", what, node)
        return None
    torque = reading.expression(node, what)
    if torque is None:
        return None
    if AXES[across] == "y":  # from x to z is against y
        torque = ComposedExpression(minus(torque.node), torque.text, torque.origin, torque.exact)
    zero = ComposedExpression(ZERO, "0", torque.origin, exact=False)
    return tuple(torque if k == across else zero for k in range(3))


def _along_axes(
    axes: SourceNode,
    node: SourceNode,
    components: tuple[Expression, ...],
    what: str,
    reading: Reading,
) -> tuple[Expression, ...] | None:
    """Return components along the axes of a frame along those of space."""
    if len(components) != 3:
        reading.expected("a list of three components", what, node)
        return None
    x, y, z = components
    return in_axes_of(axes, (x, y, z), what, reading)


def _components(node: SourceNode, what: str, reading: Reading) -> tuple[Expression, ...] | None:
    """Read three components of a Cartesian force, or one of a generalized force."""
    if not isinstance(node, Sequence):
        single = reading.expression(node, what)
        return (single,) if single else None
    read = [reading.expression(item, what) for item in node.items]
    if len(read) != 3:
        reading.expected("an expression or a list of three", what, node)
        return None
    components = tuple(part for part in read if part)
    return components if len(components) == 3 else None
