"""C of right-hand sides that end where a motion cannot pass a singular place.

A chart of polar kind (the pole of spherical angles) is stepped over unseen where a motion passes
its singular place closer than steps resolve: the true motion turns there within no time, the
numbers come out on the other side. A right-hand side that does not exist on the other side makes
integrators shorten their steps until they resolve the passage, or end before it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lagrange_cli.emit.c_names import Real
from lagrange_cli.emit.program import Program, results_of

__all__ = ["GUARDED", "PLACES", "guard_source"]

#: The program whose numbers vanish at singular places.
PLACES = "places"

#: Right-hand sides that have a guarded form.
GUARDED = ("rhs", "disturbed", "sided_rhs", "sided_disturbed")

_TEXT = """\
/* Whether a state is beyond a singular place. Behind the parameters stands a number for each
 * place: 0 where it may be passed, else the sign of the place's factor at the start, twice that
 * where the factor keeps it even while the rates listed here are zero. */
static int system_barred_{name}({real} t, const {real} *y, const {real} *u,
                                const system_params *p, {real} *work)
{{
    {real} place[{places}];
    const {real} *side = (const {real} *)p + {offset};
    if (system_places(t, y, u, p, work, place) != 0) {{
        return 1;
    }}
{tests}
    return 0;
}}

/* system_{name}, which does not exist there. */
int system_guarded_{name}({real} t, const {real} *y, const {real} *u, const system_params *p,
                          {real} *work, {real} *dydt)
{{
    return system_barred_{name}(t, y, u, p, work) || system_{name}(t, y, u, p, work, dydt);
}}
"""

_TEST = """\
    if (side[{k}]*place[{k}] < 0 && (side[{k}]*side[{k}] > 1{moves})) {{
        return 1;
    }}"""

_LANES = """\
/* The same at eight states at once; not 0 where it does not exist at one of them. */
int system_guarded_{name}_lanes(const double *restrict t, const double *restrict y,
                                const double *u, const system_params *restrict p, double *work,
                                double *restrict dydt)
{{
    double state[{numbers}];
    int i, l;
    for (l = 0; l < 8; ++l) {{
        for (i = 0; i < {numbers}; ++i) {{
            state[i] = y[8*i + l];
        }}
        if (system_barred_{name}(t[l], state, u, p, work)) {{
            return 1;
        }}
    }}
    return system_{name}_lanes(t, y, u, p, work, dydt);
}}
"""


def guard_source(
    programs: Mapping[str, Program],
    rates: Sequence[Sequence[int]],
    real: Real,
    lanes: str | None = None,
) -> str:
    """What follows the text of a library: its right-hand sides as ``system_guarded_NAME``.

    Parameters
    ----------
    programs
        Those of the library; empty text where :data:`PLACES` is not among them.
    rates
        For each place the numbers, in the state, of the rates that move nothing there.
    lanes
        None: right-hand sides at one state. Else the text that has those at eight states at once,
        which is what the functions given back are for as well.
    """
    if PLACES not in programs:
        return ""
    tests = [
        _TEST.format(k=k, moves="".join(f" || y[{i}] != 0" for i in numbers))
        for k, numbers in enumerate(rates)
    ]
    values = {
        "real": real.name,
        "places": results_of(programs[PLACES]),
        "tests": "\n".join(tests),
        "numbers": 2 * programs["rhs"].coordinates,
    }
    return "\n".join(
        (_TEXT if lanes is None else _LANES).format(
            name=name, offset=programs[name].parameters, **values
        )
        for name in GUARDED
        if name in programs and (lanes is None or f"system_{name}_lanes(" in lanes)
    )
