"""Procedures of a Fortran module around its functions: projection, contacts, recordings, steps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite

from lagrange_cli.emit.fixed_steps import FixedStep
from lagrange_cli.emit.languages.module_parts import (
    SCRIPT_TOKENS,
    Steps,
    contact_tokens,
    step_texts,
    switch_tokens,
)
from lagrange_cli.emit.languages.printer import (
    Language,
)
from lagrange_cli.emit.languages.values import Contacts, Interface, Projection
from lagrange_cli.emit.template_files import event_lines, filled, template
from lagrange_cli.program.lowered.routines.impacts import INSTANT

#: Numbers of a constant array in one statement, which may have 255 continuation lines.
_LONGEST_TABLE = 600


def _inputs(interface: Interface, t: str, at: str, y: str) -> list[str]:
    """Return the statement that evaluates the scene's inputs at a time, if there are any."""
    recorded = f"recorded({t}, {at}), " if interface.recorded else ""
    return [f"call inputs({t}, {y}, {recorded}p, u, status)"] if interface.inputs else []


def _lines(lines: Sequence[str], depth: int) -> str:
    return "".join(f"{'  ' * depth}{line}\n" for line in lines)


def _taken(language: Language) -> dict[str, str]:
    """Return the tokens of arguments for inputs and mode."""
    interface, contacts = language.interface, language.interface.contacts
    driven = f"real(wp), intent(in) :: u({len(interface.inputs)})"
    return {
        "@U@": "u, " if interface.inputs else "",
        "@DRIVEN@": _lines([driven] if interface.inputs else [], 2),
        "@VALUES@": _lines([f"real(wp) :: u({len(interface.inputs)})"], 2)
        if interface.inputs
        else "",
        "@IN@": "mode, " if contacts else "",
        "@CLOSED@": "closed, " if contacts else "",
        "@STATES@": str(interface.layout.size),
        "@N@": str(len(interface.coordinates)),
        "@C@": str(contacts.count if contacts else 0),
        "@TWICE_C@": str(2 * contacts.count if contacts else 0),
        "@E@": str(interface.events),
        "@TWICE_E@": str(2 * interface.events),
    }


def project_text(language: Language, projection: Projection) -> str:
    """Return the subroutine ``project``, which calls routines."""
    positions, m = projection.positions, projection.closures
    interface = language.interface
    language.routines |= {"lead_velocities", *(["is_near"] if interface.closed else [])}
    first: list[str] = []
    if positions:
        language.routines |= {"lead_positions"}
        passed = ", ".join(["@N@", str(positions), *language.handed("closures")])
        call = f"call lead_positions({passed}, y, error, square, change, found)"
        first = [call, "status = merge(0, 1, found)", "if (.not. found) return"]
    count = interface.contacts.count if interface.contacts else 0
    mode_lines = [f"integer, intent(in) :: closed({count})", f"real(wp) :: mode({2 * count})"]
    replacements = {
        "@POSITIONS@": _lines(first, 2),
        "@HANDED@": ", ".join(language.handed("closures")),
        "@HELD@": _lines(mode_lines if count else [], 2),
        "@FLAGS@": _lines(["mode = flags(closed)"] if count else [], 2),
        "@TWICE@": str(2 * m),
        "@SQUARE@": f", square({positions})" if positions else "",
        "@M@": str(m),
        **_taken(language),
    }
    return filled(template("fortran", "project.f90"), replacements).rstrip("\n")


def recording_lines(language: Language) -> Iterator[str]:
    """Yield the tables of recorded inputs, in parts that the language can hold."""
    for r in language.interface.recorded:
        name, parts = f"recording_{r.number}", list[str]()
        yield ""
        yield f"! {r.text}: starts, each with coefficients behind it."
        for first in range(0, len(r.table), _LONGEST_TABLE):
            numbers = [f"{x!r}_wp" for x in r.table[first : first + _LONGEST_TABLE]]
            parts.append(f"{name}_{len(parts)}")
            declared = f"real(wp), parameter :: {parts[-1]}({len(numbers)})"
            yield from language.broken(f"{declared} = [{', '.join(numbers)}]")
        declared = f"real(wp), parameter :: {name}({len(r.table)})"
        yield from language.broken(f"{declared} = [{', '.join(parts)}]")


def recorded_text(language: Language) -> str:
    """Return the function that evaluates recorded inputs."""
    interface, lines = language.interface, []
    language.routines.add("interpolated")
    for r in interface.recorded:
        ends = f" .and. t <= {r.last!r}_wp" if isfinite(r.last) else ""
        call = f"interpolated({r.rows}, {r.width}, recording_{r.number}, t, at)"
        test = f"if (t >= {r.first!r}_wp{ends}) &"
        lines += [test, f"  recorded({r.number + 1}) = {call}"]
    tokens = {"@TESTS@": _lines(lines, 2), "@INPUTS@": str(len(interface.inputs))}
    return filled(template("fortran", "recorded.f90"), tokens).rstrip("\n")


def contacts_text(language: Language, contacts: Contacts) -> str:
    """Return the subroutines of the interface that take a mode."""
    arrays = language.interface.reset_arrays
    declared = ", ".join(f"{name}({size})" for name, size in arrays.items())
    call = ", ".join(
        [
            *(str(len(language.interface.coordinates)), str(contacts.count)),
            *language.handed("contacts"),
            f"merge({contacts.count}, event - 1, event < 1)",
            *("bounce", f"{INSTANT!r}_wp*abs(t)", "y", "after", *arrays, "status"),
        ]
    )
    tokens = {
        **contact_tokens(language),
        "@ARRAYS@": _lines(language.broken(f"real(wp) :: after(@TWICE_C@), {declared}"), 2),
        "@ZEROS@": _lines(language.broken("; ".join(f"{name} = 0.0_wp" for name in arrays)), 2),
        "@RESET@": _lines(language.broken(f"call reset_contacts({call})"), 2),
        **_taken(language),
    }
    return filled(template("fortran", "contacts.f90"), tokens).rstrip("\n")


def switches_text(language: Language) -> str:
    """Return the subroutine that changes states with two values."""
    arguments = (
        "@SIZE@, @S@, @HANDED@, merge(@S@, event - 1, event < 1), places, y, values, changed"
    )
    call = f"call change_values({arguments}, status)"
    tokens = {
        "@CHANGE@": _lines(language.broken(call), 2),
        **switch_tokens(language),
        **_taken(language),
    }
    return filled(template("fortran", "switches.f90"), tokens).rstrip("\n")


def _event_tokens(language: Language) -> dict[str, str]:
    """Return the tokens of a run that stops at events."""
    interface, switches = language.interface, language.interface.switches.names
    count = interface.contacts.count if interface.contacts else 0
    calls = ["call events(t, y, @U@p, mode, out(:@C@), status)"] if count else []
    calls += ["if (status /= 0) return"] if count and switches else []
    calls += ["call switches(t, y, @U@p, out(@C@ + 1:), status)"] if switches else []
    values = ["mode"] if count else []
    values += ["nint(y(places + 1))"] if switches else []
    mode = [f"integer, intent(inout) :: mode({count})"] if count else []
    ignored = ["associate (unused_mode => mode)", "end associate"] if not count else []
    event = _lines(_inputs(interface, "t", "t", "y"), 0)
    return {
        "@FALLS@": _lines([*_inputs(interface, "t", "t", "y"), *calls], 2),
        "@HAPPENS@": event_lines(
            lambda name: template("fortran", f"{name}.f90").replace("@EVENT@", event),
            interface.event_kinds,
            ("if (event <= @C@) then", "end if"),
            *("      ", "  "),
        ),
        "@VALUES_NOW@": values[0] if len(values) == 1 else f"[{', '.join(values)}]",
        "@MODE@": _lines(mode, 2),
        "@IGNORED@": _lines(ignored, 2),
        "@K@": ", k" if switches else "",
        "@CONTACTS@": str(count),
        "@S@": str(len(switches)),
    }


def integrate_text(language: Language) -> str:
    """Return the subroutine ``integrate``, with those that follow events."""
    interface, has_events = language.interface, language.interface.events > 0
    name = "integrate_events" if has_events else "integrate"
    language.routines |= {"advance"} if has_events else set()
    middle = "t + 0.5_wp*h" if has_events else "t + (step + 0.5_wp)*h"
    stage = _inputs(interface, "s", middle, "y + at(stage)*h*slope")
    behind, state = ("t + h", "out") if has_events else ("t + (step + 1)*h", "y")
    fails = "if (status /= 0) return"
    project = f"call project({behind}, {state}, @U@p, @IN@status)"
    projected = [*_inputs(interface, behind, behind, state), project, fails]
    tokens = {
        "@STAGE@": _lines([*stage, fails] if stage else [], 3 if has_events else 4),
        "@PROJECTED@": _lines(projected if interface.projection else [], 2 if has_events else 3),
        **_event_tokens(language),
        **SCRIPT_TOKENS,
        "@U_LOCAL@": f", u({len(interface.inputs)})" if interface.inputs else "",
        **_taken(language),
    }
    return filled(template("fortran", f"{name}.f90"), tokens).rstrip("\n")


def fixed_step_texts(language: Language, steps: Steps) -> list[str]:
    """Return the subroutines of fixed steps that are asked for."""

    def further(method: FixedStep) -> dict[str, str]:
        arrays = ", ".join(f"arrays(:, {k + 1})" for k in range(method.arrays))
        call = f"call {method.routine}(@SIZE@, @HANDED@, t, h, y, {arrays}, done)"
        return {
            "@CALL@": _lines(language.broken(call), 2),
            "@ARRAYS@": str(method.arrays),
            **_taken(language),
        }

    text = template("fortran", "fixed_step.f90")
    return step_texts(language, steps, text, "status is 3", "  !> ", further)
