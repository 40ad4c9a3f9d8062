"""Systems with constraints in C, each with its projection, for tests of the integrators.

Written by hand: M = diag(masses), closures φ_k = (squared length − l²)/2, multipliers from
(Φ M⁻¹ Φᵀ) λ = −(bias + Φ M⁻¹ f).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lagrange_cli.simulate import kernels
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, function_type, projection_type
from lagrange_cli.simulate.integrators.native.function import NativeRhs
from lagrange_cli.simulate.integrators.right_hand_side import FunctionRhs
from lagrange_cli.toolchain.shared_library import CSource
from tests.simulate.native_systems import compiled, stepping_source

#: A pendulum of parameters l, g in x, z; y = [x, z, vx, vz].
_PENDULUM = """
#include "numbers.h"
int pendulum(double t, const double *y, const double *u, const double *p, double *work,
             double *out)
{
    const double s = y[0]*y[0] + y[1]*y[1];
    const double k = (p[1]*y[1] - y[2]*y[2] - y[3]*y[3])/s;
    (void)t; (void)u; (void)work;
    out[0] = y[2];
    out[1] = y[3];
    out[2] = k*y[0];
    out[3] = k*y[1] - p[1];
    return !(s > 0.0);
}

int pendulum_project(double t, double *y, const double *u, const double *p, double *work)
{
    double size = HUGE_VAL, c, s;
    int k;
    (void)t; (void)u; (void)work;
    for (k = 0; k < 20; ++k) {
        s = y[0]*y[0] + y[1]*y[1];
        c = (s - p[0]*p[0])/(2.0*s);
        if (!(fabs(c) < size)) {
            break;
        }
        size = fabs(c);
        y[0] -= c*y[0];
        y[1] -= c*y[1];
    }
    s = y[0]*y[0] + y[1]*y[1];
    c = (y[0]*y[2] + y[1]*y[3])/s;
    y[2] -= c*y[0];
    y[3] -= c*y[1];
    return !(size < 1e-14) || !(s > 0.0);
}
"""

#: Two bobs on rods, parameters m1, m2, l1, l2, g; y = [x1, z1, x2, z2, their velocities].
_DOUBLE_PENDULUM = """
#include "numbers.h"
/* l from (Phi M^-1 Phi^T) l = r for the rods of y. */
static int multipliers(const double *y, const double *p, const double *r, double *l)
{
    const double dx = y[2] - y[0], dz = y[3] - y[1];
    const double a = (y[0]*y[0] + y[1]*y[1])/p[0], b = -(y[0]*dx + y[1]*dz)/p[0];
    const double c = (dx*dx + dz*dz)*(1.0/p[0] + 1.0/p[1]), d = a*c - b*b;
    l[0] = (c*r[0] - b*r[1])/d;
    l[1] = (a*r[1] - b*r[0])/d;
    return !(d > 0.0);
}

/* x += M^-1 Phi^T l for the rods of y. */
static void pull(const double *y, const double *p, const double *l, double *x)
{
    const double dx = y[2] - y[0], dz = y[3] - y[1];
    x[0] += (l[0]*y[0] - l[1]*dx)/p[0];
    x[1] += (l[0]*y[1] - l[1]*dz)/p[0];
    x[2] += l[1]*dx/p[1];
    x[3] += l[1]*dz/p[1];
}

int double_pendulum(double t, const double *y, const double *u, const double *p, double *work,
                    double *out)
{
    const double *v = y + 4;
    const double wx = v[2] - v[0], wz = v[3] - v[1];
    double r[2], l[2];
    int i;
    (void)t; (void)u; (void)work;
    r[0] = p[4]*y[1] - v[0]*v[0] - v[1]*v[1];
    r[1] = -wx*wx - wz*wz;
    if (multipliers(y, p, r, l)) {
        return 1;
    }
    for (i = 0; i < 4; ++i) {
        out[i] = v[i];
        out[4 + i] = i%2 ? -p[4] : 0.0;
    }
    pull(y, p, l, out + 4);
    return 0;
}

int double_pendulum_project(double t, double *y, const double *u, const double *p, double *work)
{
    double *v = y + 4, r[2], l[2], size = HUGE_VAL, now;
    int k;
    (void)t; (void)u; (void)work;
    for (k = 0; k < 20; ++k) {
        const double dx = y[2] - y[0], dz = y[3] - y[1];
        r[0] = -0.5*(y[0]*y[0] + y[1]*y[1] - p[2]*p[2]);
        r[1] = -0.5*(dx*dx + dz*dz - p[3]*p[3]);
        now = fmax(fabs(r[0])/(p[2]*p[2]), fabs(r[1])/(p[3]*p[3]));
        if (!(now < size) || multipliers(y, p, r, l)) {
            break;
        }
        size = now;
        pull(y, p, l, y);
    }
    r[0] = -(y[0]*v[0] + y[1]*v[1]);
    r[1] = -((y[2] - y[0])*(v[2] - v[0]) + (y[3] - y[1])*(v[3] - v[1]));
    if (!(size < 1e-14) || multipliers(y, p, r, l)) {
        return 1;
    }
    pull(y, p, l, v);
    return 0;
}
"""

#: x may not pass 1, where its projection fails; y = [x, v].
_EDGE = """
int edge(double t, const double *y, const double *u, const double *p, double *work, double *out)
{
    (void)t; (void)u; (void)p; (void)work;
    out[0] = y[1];
    out[1] = 0.0;
    return 0;
}

int edge_project(double t, double *y, const double *u, const double *p, double *work)
{
    (void)t; (void)u; (void)p; (void)work;
    return y[0] > 1.0;
}
"""

TEXTS = {"pendulum": _PENDULUM, "double_pendulum": _DOUBLE_PENDULUM, "edge": _EDGE}
DIMENSIONS = {"pendulum": 4, "double_pendulum": 8, "edge": 2}


def constrained(name, *parameters, fixed_dimension=True, real=DOUBLE):
    """A system with its projection, and the integrators for it."""
    n = DIMENSIONS[name] if fixed_dimension else kernels.UNROLLED_DIMENSION + 1
    options, kernel_texts = kernels.options_of(real), kernels.kernel_files()
    if options:  # those of Gauss are of doubles alone
        kernel_texts = {k: text for k, text in kernel_texts.items() if not k.startswith("gauss")}
    system = {"system.c": TEXTS[name], "numbers.h": kernels.source("numbers.h")}
    stepping = stepping_source(n, kernel_texts)
    stepping = replace(stepping, options=(*stepping.options, *options))
    library, stepper = compiled(CSource(system, options), stepping)
    return NativeRhs(
        function_type(real)((name, library)),
        np.array(parameters or (0.0,)),
        np.zeros(1),
        lambda _: stepper,
        real=real,
        projection=projection_type(real)((f"{name}_project", library)),
    )


def interpreted(rhs):
    """The same functions as any Python functions, which only methods in Python take."""
    return FunctionRhs(lambda t, y: rhs(t, y), lambda t, y: rhs.project(t, y))


def rods(states):
    """Lengths of the rods of double pendulums, and the velocities along them, shape (m, 4)."""
    q1, q2, v1, v2 = (states[:, k : k + 2] for k in (0, 2, 4, 6))
    first, second = np.linalg.norm(q1, axis=1), np.linalg.norm(q2 - q1, axis=1)
    along = (q1 * v1).sum(axis=1), ((q2 - q1) * (v2 - v1)).sum(axis=1)
    return np.column_stack([first, second, *along])
