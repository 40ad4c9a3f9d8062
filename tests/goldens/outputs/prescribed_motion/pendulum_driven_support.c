/* pendulum_driven_support: see pendulum_driven_support.h, which documents every function. */

#include "pendulum_driven_support.h"

#if pendulum_driven_support_EMISSION != 0x9707e9ddUL
#error "pendulum_driven_support.c and pendulum_driven_support.h are not of one emission: emit both once more"
#endif

#include <math.h>

void pendulum_driven_support_defaults(pendulum_driven_support_params *p)
{
    p->m = 0.5;
    p->l = 1.0;
    p->A = 0.2;
    p->Omega = 2.5;
    p->g = 9.81;
}

int pendulum_driven_support_rhs(double t, const double *y, const double *u, const pendulum_driven_support_params *p, double *work, double *dydt)
{
    int i;
    const double q_theta = y[0];
    const double v_theta = y[1];
    (void)u;
    (void)work;
    const double w0 = p->m*p->l;
    const double w1 = p->l*w0;
    if (!(w1 > 0.0)) {
        return 1;
    }
    dydt[0] = v_theta;
    dydt[1] = -w0*(p->g*sin(q_theta) - p->A*p->Omega*p->Omega*cos(q_theta)*cos(p->Omega*t))/w1;
    for (i = 0; i < 2; ++i) {
        if (!isfinite(dydt[i])) {
            return 2;
        }
    }
    return 0;
}

int pendulum_driven_support_mass_matrix(double t, const double *y, const double *u, const pendulum_driven_support_params *p, double *work, double *out)
{
    int i;
    (void)t;
    (void)y;
    (void)u;
    (void)work;
    out[0] = p->m*p->l*p->l;
    for (i = 0; i < 1; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int pendulum_driven_support_forcing(double t, const double *y, const double *u, const pendulum_driven_support_params *p, double *work, double *out)
{
    int i;
    const double q_theta = y[0];
    (void)u;
    (void)work;
    out[0] = -p->m*p->l*(p->g*sin(q_theta) -
        p->A*p->Omega*p->Omega*cos(q_theta)*cos(p->Omega*t));
    for (i = 0; i < 1; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int pendulum_driven_support_energy(double t, const double *y, const double *u, const pendulum_driven_support_params *p, double *work, double *out)
{
    int i;
    const double q_theta = y[0];
    const double v_theta = y[1];
    (void)u;
    (void)work;
    const double w0 = p->l*v_theta;
    const double w1 = w0*w0;
    const double w2 = sin(p->Omega*t)*(p->A*p->Omega);
    const double w3 = w2*w2;
    const double w4 = cos(q_theta);
    const double w5 = w4*(p->l*p->g);
    out[0] = 0.5*p->m*(w1 + w3 - 2.0*w4*w2*w0);
    out[1] = -p->m*w5;
    out[2] = p->m*(0.5*w1 - 0.5*w3 - w5);
    for (i = 0; i < 3; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int pendulum_driven_support_positions(double t, const double *y, const double *u, const pendulum_driven_support_params *p, double *work, double *out)
{
    int i;
    const double q_theta = y[0];
    (void)u;
    (void)work;
    const double w0 = p->A*cos(p->Omega*t);
    out[0] = w0 + p->l*sin(q_theta);
    out[1] = 0.0;
    out[2] = -p->l*cos(q_theta);
    out[3] = w0;
    out[4] = 0.0;
    out[5] = 0.0;
    for (i = 0; i < 6; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}
