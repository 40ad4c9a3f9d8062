"""The texts of an FMI unit, and its archive with a library made by this machine's compiler."""

from __future__ import annotations

import io
import platform
import uuid
import zipfile
from collections.abc import Mapping
from dataclasses import replace
from html import escape
from pathlib import PurePosixPath
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from lagrange_cli.cache import digest
from lagrange_cli.emit.base import Package
from lagrange_cli.emit.fmu.description import FmiUnit, described_build, described_unit, plain_text
from lagrange_cli.emit.fmu.variables import (
    Variable,
    input_start,
    is_computed,
    variables_of,
    written_outputs,
)
from lagrange_cli.emit.naming import unique_identifiers
from lagrange_cli.emit.template_files import filled, unit_template
from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.toolchain.compiler import CompileError, find_compiler
from lagrange_cli.toolchain.shared_library import CSource, portable_object
from lagrange_cli.version import __version__

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Relative tolerance where neither the scene nor an importer states one, as of a simulation.
_TOLERANCE = 1e-9

#: Units of more coordinates have no directional derivatives: those of all outputs by all states
#: are a full matrix, which for a chain of a thousand links would have millions of entries.
_MOST_LINEARIZED = 64

#: Version of the standard → template of the functions that it asks for.
_INTERFACES = {"2": "fmi2", "3": "fmi3"}

#: What a unit says of steps that became too small where forces jump.
_JUMPS = (
    ": forces jump with a sign, as those of dry friction where a body comes to rest,"
    " which a unit does not follow"
)

#: Options beside those of every compilation: functions of the interface alone can be seen, so that
#: units of one name can be loaded side by side; ``-s`` leaves out names of files.
_OPTIONS = ("-O2", "-fvisibility=hidden", "-s")

#: Time of every file in the archive, the first that the format has: bytes depend on no clock.
_EPOCH = (1980, 1, 1, 0, 0, 0)

#: Machine → the name of its folder in version 2; others are named as in version 3.
_OLD_PLATFORMS = {"x86_64": "linux64", "i686": "linux32"}


def emit_fmu(equations: Equations, options: Mapping[str, str | bool]) -> dict[str, str]:
    """Return what a unit holds beside its library: path within the archive → text.

    Parameters
    ----------
    options
        ``fmi``: version of the standard, ``2`` or ``3``.

    Raises
    ------
    InputError
        The system cannot be a unit: nothing moves, or a start or a parameter has no value.
    """
    _require_numbers(equations)
    for state in equations.system.switches:
        message = f"an FMI unit does not find where the state '{state.name}' changes its value"
        place = Mark(equations.presentation.file, 1, 1)
        raise InputError(Problem(message, place, "all other languages do", "emit-switch"))
    version = str(options["fmi"])
    code = _code(equations)
    (source,) = (name for name in code if name.endswith(".c"))
    stem = source.removesuffix(".c")
    (identifier,) = unique_identifiers([equations.presentation.name], frozenset())
    variables = variables_of(equations)
    templates = unit_template("unit"), unit_template(_INTERFACES[version])
    unit = FmiUnit(
        equations=equations,
        identifier=identifier,
        token=_token(repr(variables), *code.values(), *templates),
        sources=(f"{stem}_fmi.c", source),
        variables=variables,
        linearized=_is_linearized(equations),
        tolerance=equations.system.simulate.accuracy or _TOLERANCE,
    )
    texts = {
        "modelDescription.xml": described_unit(unit, version),
        "documentation/index.html": _documentation(unit, version),
        f"sources/{stem}_fmi.c": _wrapper(unit, f"{stem}.h", version),
        **{f"sources/{name}": text for name, text in code.items()},
    }
    if version == "3":
        texts["sources/buildDescription.xml"] = described_build(unit)
    return texts


def _is_linearized(equations: Equations) -> bool:
    return len(equations.system.coordinates) <= _MOST_LINEARIZED


def _code(equations: Equations) -> dict[str, str]:
    """Emit C whose outputs are all of the unit, with their derivatives."""
    # Here and not above: a unit whose texts are remembered is packed without mathematics.
    from lagrange_cli.emit.c.module import emit_c

    system = replace(equations.system, outputs=written_outputs(equations))
    options = dict.fromkeys(("main", "header_only", "jacobian", "canonical"), False)
    linearized = {"linearization": _is_linearized(equations)}
    return emit_c(replace(equations, system=system), {"real": "double", **options, **linearized})


def _require_numbers(equations: Equations) -> None:
    """Refuse what has no start: every state and every parameter of a unit has one."""
    system = equations.system
    missing = [parameter.name for parameter in system.parameters if parameter.value is None]
    if not system.coordinates:
        raise _refused(equations, "has no degrees of freedom", "a unit has states, which move")
    if missing:
        options_text = " ".join(f"-p {name}=VALUE" for name in missing)
        raise _refused(equations, f"gives no value of '{missing[0]}'", f"add {options_text}")
    if system.initial is None:
        raise _refused(equations, "gives no initial state", "add values to 'initial'")


def _refused(equations: Equations, why: str, hint: str) -> InputError:
    name = equations.presentation.name
    return InputError(Problem(f"'{name}' cannot be an FMI unit: it {why}", hint=hint, rule="fmu"))


def _token(*texts: str) -> str:
    """Return a name of the unit that follows from what it holds."""
    return "{" + str(uuid.UUID(digest(*texts)[:32])) + "}"


def _wrapper(unit: FmiUnit, header: str, version: str) -> str:
    """Return the C of the interface around the emitted functions."""
    # Here and not above: a unit whose texts are remembered is packed without mathematics.
    from lagrange_cli.mechanics.kinks import JUMPING

    system = unit.equations.system
    closures, contacts = len(system.closures), len(system.contacts)
    positions = sum(closure.kind == "position" for closure in system.closures)
    computed = [is_computed(entry, system.t) for entry in system.inputs]
    starts = [v.start for v in unit.variables if v.kind == "state" and v.start is not None]
    inputs = [
        0.0 if known else input_start(unit.equations, entry)
        for known, entry in zip(computed, system.inputs, strict=True)
    ]
    replacements = {
        "@INTERFACE@\n": unit_template(_INTERFACES[version]),
        "@COORDINATES@": str(len(system.coordinates)),
        "@BEHIND@": f" + {len(system.states)}" if system.states else "",
        "@PARAMETERS@": str(len(system.parameters)),
        "@INPUTS@": str(len(system.inputs)),
        "@OUTPUTS@": str(len(written_outputs(unit.equations))),
        "@CONTACTS@": str(contacts),
        "@MULTIPLIERS@": str(closures + contacts),
        "@CONSTRAINTS@": str(positions + closures + 2 * contacts),
        "@LINEARIZED@": str(int(unit.linearized)),
        "@TOLERANCE@": repr(unit.tolerance),
        "@TOKEN@": unit.token,
        "@JUMPS@": _JUMPS if any(f.atoms(*JUMPING) for f in system.forcing) else "",
        "@STARTS@": ", ".join(map(repr, starts)),
        "@INPUT_STARTS@": ", ".join(map(repr, inputs)) or "0.0",
        "@COMPUTED@": ", ".join(str(int(known)) for known in computed) or "0",
        "@START@": repr(float(system.simulate.start)),
        "@UNWANTED@": ", 0" if system.pushing else "",
        "@HEADER@": header,
        "@NAME@": unit.identifier,
    }
    return filled(unit_template("unit"), replacements)


_PAGE = """\
<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><title>{title}</title></head>
<body>
<h1>{title}</h1>
<p>{description}</p>
<p>A unit of the Functional Mock-up Interface {version} for model exchange and co-simulation,
made by lagrange {tool} from the scene with SHA-256 {digest}. Its content is yours: use it as you
like, under any terms.</p>
<p>In co-simulation it makes steps of its own, of order 5 by the method of Dormand and Prince, each
with a relative error of at most a thousandth of the tolerance that the importer states ({tolerance}
where none is stated), and it finds the instants at which contacts open and close. Inputs are
constant during a communication step.</p>
<table>
<thead><tr><th>Variable</th><th>Kind</th><th>Start</th><th>Unit</th><th>Meaning</th></tr></thead>
<tbody>
{rows}
</tbody>
</table>
</body>
</html>
"""


def _documentation(unit: FmiUnit, version: str) -> str:
    """Return the page that importers show."""
    presentation = unit.equations.presentation
    return _PAGE.format(
        title=escape(plain_text(presentation.title or presentation.name)),
        description=escape(plain_text(presentation.description or "")),
        version=f"{version}.0",
        tool=__version__,
        digest=escape(presentation.digest),
        tolerance=unit.tolerance,
        rows="\n".join(map(_row, unit.variables)),
    )


def _row(variable: Variable) -> str:
    start = "" if variable.start is None else repr(float(variable.start))
    cells = (variable.name, variable.kind, start, variable.unit or "", variable.description or "")
    return "<tr>" + "".join(f"<td>{escape(plain_text(cell))}</td>" for cell in cells) + "</tr>"


def pack_unit(name: str, texts: Mapping[str, str]) -> Package:
    """Pack the texts of :func:`emit_fmu` into an archive, with a library if there is a
    compiler; without one a remark says so.

    Parameters
    ----------
    name
        Name of the archive.
    """
    root = ET.fromstring(texts["modelDescription.xml"])
    exchange = root.find("ModelExchange")
    assert exchange is not None
    members = {path: text.encode() for path, text in texts.items()}
    sources = {
        PurePosixPath(path).name: text
        for path, text in texts.items()
        if PurePosixPath(path).suffix in (".c", ".h")
    }
    remarks = []
    try:
        library = portable_object(find_compiler(), CSource(sources, _OPTIONS))
        folder = _platform(root.attrib["fmiVersion"])
        members[f"binaries/{folder}/{exchange.attrib['modelIdentifier']}.so"] = library
    except CompileError as error:
        remarks.append(f"{name} holds sources and no library: {error.reason}")
    return Package({name: _zipped(members)}, tuple(remarks))


def _platform(version: str) -> str:
    """Return the folder of this machine's libraries."""
    machine = platform.machine()
    return (
        _OLD_PLATFORMS.get(machine, f"{machine}-linux") if version == "2.0" else f"{machine}-linux"
    )


def _zipped(members: Mapping[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        # The description first: importers look for it.
        for path in sorted(members, key=lambda path: (path != "modelDescription.xml", path)):
            entry = zipfile.ZipInfo(path, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = (0o755 if path.endswith(".so") else 0o644) << 16
            archive.writestr(entry, members[path])
    return stream.getvalue()
