/* pendulum: see pendulum.h, which documents every function. */

#include "pendulum.h"

#if pendulum_EMISSION != 0x3e9289daUL
#error "pendulum.c and pendulum.h are not of one emission: emit both once more"
#endif

#include <math.h>

void pendulum_defaults(pendulum_params *p)
{
    p->m = 1.0;
    p->l = 1.0;
    p->g = 9.81;
}

int pendulum_rhs(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *dydt)
{
    int i;
    const double q_theta = y[0];
    const double v_theta = y[1];
    (void)t;
    (void)u;
    (void)work;
    const double w0 = p->m*p->l;
    const double w1 = p->l*w0;
    if (!(w1 > 0.0)) {
        return 1;
    }
    dydt[0] = v_theta;
    dydt[1] = -p->g*sin(q_theta)*w0/w1;
    for (i = 0; i < 2; ++i) {
        if (!isfinite(dydt[i])) {
            return 2;
        }
    }
    return 0;
}

int pendulum_mass_matrix(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *out)
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

int pendulum_forcing(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *out)
{
    int i;
    const double q_theta = y[0];
    (void)t;
    (void)u;
    (void)work;
    out[0] = -p->m*p->l*p->g*sin(q_theta);
    for (i = 0; i < 1; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int pendulum_energy(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *out)
{
    int i;
    const double q_theta = y[0];
    const double v_theta = y[1];
    (void)t;
    (void)u;
    (void)work;
    const double w0 = p->m*p->l;
    const double w1 = v_theta*(p->l*v_theta);
    const double w2 = p->g*cos(q_theta);
    out[0] = 0.5*w0*w1;
    out[1] = -w0*w2;
    out[2] = w0*(0.5*w1 - w2);
    for (i = 0; i < 3; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int pendulum_positions(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *out)
{
    int i;
    const double q_theta = y[0];
    (void)t;
    (void)u;
    (void)work;
    out[0] = p->l*sin(q_theta);
    out[1] = 0.0;
    out[2] = -p->l*cos(q_theta);
    for (i = 0; i < 3; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}
