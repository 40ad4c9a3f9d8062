"""C of right-hand sides that end where a motion cannot pass a singular configuration.

The singular configuration of a chart of polar kind (the pole of spherical angles) is stepped over
unseen if a motion passes it closer than steps resolve: the true motion turns there within no time,
the numbers come out on the other side. A right-hand side that does not exist on the other side
makes integrators shorten their steps until they resolve the passage, or end before it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lagrange_cli.emit.c.names import Real
from lagrange_cli.emit.template_files import c_template, filled
from lagrange_cli.program.program import Program, result_count

#: The program whose numbers vanish at singular configurations.
GUARD_PROGRAM = "places"

#: Right-hand sides that have a guarded form, and what the names of perturbed ones hold.
_GUARDED = ("rhs", "disturbed", "sided_rhs", "sided_disturbed")
_PERTURBED = "disturbed"

_TEST = """\
    if (side[{k}]*place[{k}] < 0 && (side[{k}]*side[{k}] > 1{moves})) {{
        return 1;
    }}"""


def guard_source(
    programs: Mapping[str, Program],
    rates: Sequence[Sequence[int]],
    real: Real,
    lanes: str | None = None,
) -> str:
    """Write the guarded right-hand sides that follow a library, as ``system_guarded_NAME``.

    Parameters
    ----------
    programs
        Those of the library; empty text where :data:`GUARD_PROGRAM` is not among them.
    rates
        For each singular configuration the numbers, in the state, of the rates that move nothing
        there.
    lanes
        None: right-hand sides at one state. Else the text that has those at eight states at once,
        which is what the functions given back are for as well.
    """
    if GUARD_PROGRAM not in programs:
        return ""
    tests = [
        _TEST.format(k=k, moves="".join(f" || y[{i}] != 0" for i in numbers))
        for k, numbers in enumerate(rates)
    ]
    values = {
        "@REAL@": real.name,
        "@PLACES@": str(result_count(programs[GUARD_PROGRAM])),
        "@TESTS@": "\n".join(tests),
        "@NUMBERS@": str(2 * programs["rhs"].coordinates),
    }
    # All perturbed ones are handed as many factors as the one that reads most.
    most = max((p.parameters for name, p in programs.items() if _PERTURBED in name), default=0)
    offsets = {
        name: most if _PERTURBED in name else program.parameters
        for name, program in programs.items()
    }
    template = c_template("guarded" if lanes is None else "guarded_lanes")
    return "\n".join(
        filled(template, {"@FUNCTION@": name, "@OFFSET@": str(offsets[name]), **values})
        for name in _GUARDED
        if name in programs and (lanes is None or f"system_{name}_lanes(" in lanes)
    )
