"""``events`` and ``reset`` of Python with one-sided constraints.

The same as in C (:mod:`lagrange_cli.emit.c.impact`), which explains the method.
"""

from __future__ import annotations

from collections.abc import Mapping

from lagrange_cli.emit.constants import COMPLEMENTARITY_STEPS, IMPACT_TOLERANCES, RATE_TOLERANCE
from lagrange_cli.emit.template_files import filled, python_template
from lagrange_cli.program.program import Program, result_count


def impact_source(programs: Mapping[str, Program], parameter: str) -> list[str]:
    """Definitions of ``events`` and ``reset``, none where there are no contacts.

    Parameters
    ----------
    parameter
        The text of the arguments of all functions behind ``t`` and ``y``. Flags and targets
        stand in ``p`` behind the parameters, or in ``contact`` where that is among them.
    """
    if "gaps" not in programs:
        return []
    u = result_count(programs["gaps"]) // 2
    flags_from = programs["gaps"].parameters - 2 * u
    apart = parameter.endswith("contact")
    replacements = {
        "@SET@": "contact = [*map(float, flags), *map(float, targets)]"
        if apart
        else f"p = [*p[:{flags_from}], *map(float, flags), *map(float, targets)]",
        "@FLAGS@": f"contact[:{u}]" if apart else f"p[{flags_from}:{flags_from + u}]",
        "@OWN@": "_" if apart else "",
        "@FLIGHT@": "_flight_rhs" if apart else "rhs",
        "@FREE@": parameter.removesuffix(", contact"),
        "@EVENTS@": "_contact_events" if apart else "events",
        "@RESET@": "_contact_reset" if apart else "reset",
        "@P@": parameter,
        "@U@": str(u),
        "@TOLERANCE@": repr(RATE_TOLERANCE),
        "@LOOSER@": repr(IMPACT_TOLERANCES),
        "@ULPS@": repr(2.0**-46),
        "@STEPS@": str(COMPLEMENTARITY_STEPS),
    }
    names = ("events", "pushes", "gap_terms", "hit", "reset")
    return [filled(python_template(name), replacements) for name in names]
