"""XML of a unit: modelDescription.xml of both versions, and how its sources are built."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from lagrange_cli.emit.fmu.variables import Kind, Variable
from lagrange_cli.version import __version__

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Kind of a variable → its causality.
_CAUSALITY: dict[Kind, str] = {
    "time": "independent",
    "parameter": "parameter",
    "input": "input",
    "computed input": "output",
    "state": "output",
    "rate": "local",
    "output": "output",
    "indicator": "local",
}


@dataclass(frozen=True)
class FmiUnit:
    """All that the description of a unit says.

    Attributes
    ----------
    identifier
        Identifier of C, after which the library is called.
    token
        Tells the unit from others: GUID in version 2, instantiation token in version 3.
    sources
        Names of its files of C.
    variables
        Its variables, by their references.
    linearized
        It has directional derivatives.
    tolerance
        Relative tolerance of its integrator.
    """

    equations: Equations
    identifier: str
    token: str
    sources: Sequence[str]
    variables: Sequence[Variable]
    linearized: bool
    tolerance: float


def plain_text(text: str) -> str:
    """Replace what XML cannot hold, and breaks of lines, by blanks."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def described_unit(unit: FmiUnit, version: str) -> str:
    """Return modelDescription.xml of version ``2`` or ``3``."""
    is_new = version == "3"
    presentation = unit.equations.presentation
    attributes = {
        "fmiVersion": "3.0" if is_new else "2.0",
        "modelName": plain_text(presentation.name),
        "instantiationToken" if is_new else "guid": unit.token,
        **_described(presentation.title),
        "generationTool": f"lagrange {__version__}",
        "variableNamingConvention": "flat",
    }
    root = ET.Element("fmiModelDescription", attributes)
    if not is_new:
        count = sum(variable.kind == "indicator" for variable in unit.variables)
        root.set("numberOfEventIndicators", str(count))
    _add_interfaces(root, unit, is_new=is_new)
    units = sorted({plain_text(v.unit) for v in unit.variables if v.unit})
    if units:
        definitions = ET.SubElement(root, "UnitDefinitions")
        for name in units:
            ET.SubElement(definitions, "Unit", name=name)
    categories = ET.SubElement(root, "LogCategories")
    ET.SubElement(categories, "Category", name="logStatusError")
    _add_experiment(root, unit)
    (_add_new_variables if is_new else _add_old_variables)(root, unit.variables)
    _add_structure(root, unit.variables, is_new=is_new)
    return _serialized(root)


def described_build(unit: FmiUnit) -> str:
    """Return buildDescription.xml, by which importers of version 3 compile the sources."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    build = ET.SubElement(root, "BuildConfiguration", modelIdentifier=unit.identifier)
    files = ET.SubElement(build, "SourceFileSet", language="C99")
    for name in unit.sources:
        ET.SubElement(files, "SourceFile", name=name)
    return _serialized(root)


def _serialized(root: ET.Element) -> str:
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _described(text: str | None) -> dict[str, str]:
    return {"description": plain_text(text)} if text else {}


def _add_interfaces(root: ET.Element, unit: FmiUnit, *, is_new: bool) -> None:
    """Add model exchange and co-simulation, with what both can do."""
    abilities = {
        "modelIdentifier": unit.identifier,
        "canGetAndSetFMUState" if is_new else "canGetAndSetFMUstate": "true",
        "canSerializeFMUState" if is_new else "canSerializeFMUstate": "true",
    }
    if unit.linearized:
        provides = "providesDirectionalDerivatives" if is_new else "providesDirectionalDerivative"
        abilities[provides] = "true"
        abilities |= {"providesAdjointDerivatives": "true"} if is_new else {}
    exchange = ET.SubElement(root, "ModelExchange", abilities)
    if is_new:
        exchange.set("needsCompletedIntegratorStep", "true")
    steps = ET.SubElement(root, "CoSimulation", abilities)
    steps.set("canHandleVariableCommunicationStepSize", "true")
    for interface in () if is_new else (exchange, steps):
        files = ET.SubElement(interface, "SourceFiles")
        for name in unit.sources:
            ET.SubElement(files, "File", name=name)


def _add_experiment(root: ET.Element, unit: FmiUnit) -> None:
    defaults = unit.equations.system.simulate
    experiment = ET.SubElement(root, "DefaultExperiment", startTime=repr(float(defaults.start)))
    if defaults.until is not None and defaults.until > defaults.start:
        experiment.set("stopTime", repr(float(defaults.until)))
    experiment.set("tolerance", repr(unit.tolerance))


def _attributes(variable: Variable) -> dict[str, str]:
    """Return what both versions write at a variable itself."""
    fixed = variable.kind == "parameter"
    values = {
        "name": plain_text(variable.name),
        "valueReference": str(variable.reference),
        **_described(variable.description),
        "causality": _CAUSALITY[variable.kind],
        "variability": "fixed" if fixed else "continuous",
    }
    if variable.kind in ("state", "parameter"):
        values["initial"] = "exact"
    elif variable.kind not in ("time", "input"):
        values["initial"] = "calculated"
    return values


def _typed(variable: Variable, derivative: str | None) -> dict[str, str]:
    """Return what version 2 writes at the type of a variable, version 3 at the variable."""
    values = {}
    if variable.unit:
        values["unit"] = plain_text(variable.unit)
    if derivative is not None:
        values["derivative"] = derivative
    if variable.start is not None:
        values["start"] = repr(float(variable.start))
    return values


def _add_old_variables(root: ET.Element, variables: Iterable[Variable]) -> None:
    """Add variables with their places, which begin with 1, as references to states."""
    parent = ET.SubElement(root, "ModelVariables")
    for variable in variables:
        state = variable.derivative_of
        element = ET.SubElement(parent, "ScalarVariable", _attributes(variable))
        ET.SubElement(element, "Real", _typed(variable, None if state is None else str(state + 1)))


def _add_new_variables(root: ET.Element, variables: Iterable[Variable]) -> None:
    parent = ET.SubElement(root, "ModelVariables")
    for variable in variables:
        state = variable.derivative_of
        values = _attributes(variable) | _typed(variable, None if state is None else str(state))
        ET.SubElement(parent, "Float64", values)


def _add_structure(root: ET.Element, variables: Sequence[Variable], *, is_new: bool) -> None:
    """Add what is unknown in steps and at the start, and what it depends on."""
    structure = ET.SubElement(root, "ModelStructure")
    outputs = [v for v in variables if _CAUSALITY[v.kind] == "output"]
    rates = [v for v in variables if v.kind == "rate"]
    indicators = [v for v in variables if v.kind == "indicator"]
    initial = [v for v in outputs if v.kind != "state"] + rates
    if is_new:
        for tag, unknowns in (
            ("Output", outputs),
            ("ContinuousStateDerivative", rates),
            ("InitialUnknown", sorted(initial, key=lambda v: v.reference)),
            ("EventIndicator", indicators),
        ):
            for variable in unknowns:
                with_dependencies = tag in ("Output", "ContinuousStateDerivative")
                _add_unknown(structure, tag, variable, 0, with_dependencies=with_dependencies)
        return
    for tag, unknowns in (
        ("Outputs", outputs),
        ("Derivatives", rates),
        ("InitialUnknowns", sorted(initial, key=lambda v: v.reference)),
    ):
        parent = ET.SubElement(structure, tag) if unknowns else structure
        for variable in unknowns:
            with_dependencies = tag != "InitialUnknowns"
            _add_unknown(parent, "Unknown", variable, 1, with_dependencies=with_dependencies)


def _add_unknown(
    parent: ET.Element, tag: str, variable: Variable, first: int, *, with_dependencies: bool
) -> None:
    """Add an unknown; ``first`` is what the first variable is called: its place, or reference."""
    attribute = "index" if first else "valueReference"
    element = ET.SubElement(parent, tag, {attribute: str(variable.reference + first)})
    depends = variable.dependencies
    if variable.kind == "state":
        depends = (variable.reference,)
    elif variable.kind == "computed input":
        depends = ()
    if with_dependencies and depends is not None:
        element.set("dependencies", " ".join(str(place + first) for place in depends))
