"""Right-hand sides in C for tests of the compiled integrators, and their twins in Python."""

from __future__ import annotations

import numpy as np

from lagrange_cli.cache import open_cache
from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.integrators.events import NativeEvents, TerminalEvents
from lagrange_cli.simulate.integrators.native.c_types import LANES, RHS
from lagrange_cli.simulate.integrators.native.function import NativeRhs
from lagrange_cli.toolchain.compiler import CompileError, find_compiler
from lagrange_cli.toolchain.shared_library import CSource, load_libraries
from tests.simulate.compiling import skip_without_compiler

#: Bodies of f(t, y, p) → out, by name.
SYSTEMS = {
    "pendulum": "out[0] = y[1]; out[1] = -sin(y[0]);",
    "oscillator": "out[0] = y[1]; out[1] = -p[0]*y[0];",
    "kepler": """
        const double r2 = y[0]*y[0] + y[1]*y[1], r3 = r2*sqrt(r2);
        out[0] = y[2]; out[1] = y[3]; out[2] = -p[0]*y[0]/r3; out[3] = -p[0]*y[1]/r3;""",
    "driven": "out[0] = y[1]; out[1] = cos(5.0*t);",
    "constant": "out[0] = 1.0; out[1] = 0.0;",
    "explode": "out[0] = y[0]*y[0]; out[1] = 0.0; if (!(fabs(out[0]) < 1e308)) { return 2; }",
    "overflow": "out[0] = y[1]; out[1] = 1e305*y[1]; if (!(fabs(out[1]) < HUGE_VAL)) { return 2; }",
    "nowhere": "out[0] = out[1] = y[0]; return 1;",
    "wall": "if (y[0] > 1.0) { return 1; } out[0] = y[1]; out[1] = 0.0;",
    "rotation": "out[0] = -y[1]; out[1] = y[0];",
    "three": "out[0] = y[1]; out[1] = y[2]; out[2] = -y[1];",
    "stiff": "out[0] = y[1]; out[1] = -1e5*(y[1] + y[0]);",
    "sums": "out[0] = y[1]; out[1] = p[0] - p[1]*y[0];",
}

#: Bodies of event functions g(t, y) → out.
EVENTS = {
    "bottom": "out[0] = y[0];",
    "level": "out[0] = y[0] - p[0];",
    "limit": "out[0] = p[0] - y[0];",
    "wave": "out[0] = cos(p[0]*t - p[1]);",
    "three_times": "out[0] = p[0] - t; out[1] = 1.0 - t; out[2] = 0.5 + p[0] - t;",
}

#: System → numbers of a state, where they are not two.
DIMENSIONS = {"kepler": 4, "three": 3}

_FUNCTION = """
int {name}(double t, const double *y, const double *u, const double *p, double *work, double *out)
{{
    (void)t; (void)y; (void)u; (void)p; (void)work;
    {body}
    return 0;
}}
"""

_LANES = """
int {name}_lanes(const double *t, const double *y, const double *u, const double *p,
                 double *work, double *out)
{{
    double state[{n}], slope[{n}];
    int i, l, bad = 0;
    for (l = 0; l < 8; ++l) {{
        for (i = 0; i < {n}; ++i) {{ state[i] = y[8*i + l]; }}
        bad |= {name}(t[l], state, u, p, work, slope);
        for (i = 0; i < {n}; ++i) {{ out[8*i + l] = slope[i]; }}
    }}
    return bad;
}}
"""


def text_of_systems():
    parts = ["#include <math.h>"]
    for name, body in {**SYSTEMS, **EVENTS}.items():
        parts.append(_FUNCTION.format(name=name, body=body))
        if name in SYSTEMS:
            parts.append(_LANES.format(name=name, n=DIMENSIONS.get(name, 2)))
    return "\n".join(parts)


def stepping_source(n, files=None):
    """All kernels for states of so many numbers."""
    return CSource(kernels.kernel_files() if files is None else files, kernels.kernel_options(n))


def compiled(*sources, cache=None):
    """Libraries of these sources; without a compiler the test is skipped, but never in CI."""
    try:
        compiler = find_compiler()
    except CompileError as error:
        skip_without_compiler(error.reason)
    return load_libraries(compiler, sources, open_cache() if cache is None else cache)


def native(name, *parameters, lanes=True, fixed_dimension=True):
    """A system of :data:`SYSTEMS` with the integrators for it."""
    n = DIMENSIONS.get(name, 2) if fixed_dimension else kernels.UNROLLED_DIMENSION + 1
    library, stepper = compiled(CSource({"systems.c": text_of_systems()}), stepping_source(n))
    function = LANES((f"{name}_lanes", library)) if lanes else None
    given = np.array(parameters or (0.0,))
    return NativeRhs(RHS((name, library)), given, np.zeros(1), lambda _: stepper, function)


def native_body(body, n, parameters):
    """The system of so many numbers with this body, and the integrators for it."""
    text = "#include <math.h>\n" + _FUNCTION.format(name="system", body=body)
    library, stepper = compiled(CSource({"system.c": text}), stepping_source(n))
    return NativeRhs(RHS(("system", library)), parameters, np.zeros(1), lambda _: stepper)


def interpreted(rhs):
    """The same function as any Python function, which only methods in Python take."""
    return lambda t, y: rhs(t, y)


def native_events(name, *parameters, signs=(1.0,), noise=0.0, reach=()):
    """Event functions of :data:`EVENTS`, positive at first but for those that rise from zero."""
    (library,) = compiled(CSource({"systems.c": text_of_systems()}))
    events = NativeEvents(RHS((name, library)), np.array(parameters or (0.0,)), np.zeros(1))
    return TerminalEvents(None, signs, (noise,) * len(signs), events, reach)
