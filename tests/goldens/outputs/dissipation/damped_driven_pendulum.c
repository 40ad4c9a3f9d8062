/* damped_driven_pendulum: see damped_driven_pendulum.h, which documents every function. */

#include "damped_driven_pendulum.h"

#if damped_driven_pendulum_EMISSION != 0x86c44bf6UL
#error "damped_driven_pendulum.c and damped_driven_pendulum.h are not of one emission: emit both once more"
#endif

#include <math.h>

void damped_driven_pendulum_defaults(damped_driven_pendulum_params *p)
{
    p->m = 0.1f;
    p->omega = 6.283185307179586f;
    p->omega0 = 9.42477796076938f;
    p->beta = 2.356194490192345f;
    p->gamma = 1.073f;
    p->g = 9.81f;
    p->l = 0.11044009017014816f;
}

int damped_driven_pendulum_rhs(float t, const float *y, const float *u, const damped_driven_pendulum_params *p, float *work, float *dydt)
{
    int i;
    const float q_phi = y[0];
    const float v_phi = y[1];
    (void)u;
    (void)work;
    const float w0 = p->m*p->l;
    const float w1 = p->l*w0;
    if (!(w1 > 0.0f)) {
        return 1;
    }
    dydt[0] = v_phi;
    dydt[1] = -(2.0f*p->beta*v_phi*w1 + p->g*w0*(sinf(q_phi) - p->gamma*cosf(p->omega*t)))/w1;
    for (i = 0; i < 2; ++i) {
        if (!isfinite(dydt[i])) {
            return 2;
        }
    }
    return 0;
}

int damped_driven_pendulum_mass_matrix(float t, const float *y, const float *u, const damped_driven_pendulum_params *p, float *work, float *out)
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

int damped_driven_pendulum_forcing(float t, const float *y, const float *u, const damped_driven_pendulum_params *p, float *work, float *out)
{
    int i;
    const float q_phi = y[0];
    const float v_phi = y[1];
    (void)u;
    (void)work;
    const float w0 = p->m*p->l;
    out[0] = -2.0f*p->beta*p->l*v_phi*w0 - p->g*w0*(sinf(q_phi) - p->gamma*cosf(p->omega*t));
    for (i = 0; i < 1; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int damped_driven_pendulum_energy(float t, const float *y, const float *u, const damped_driven_pendulum_params *p, float *work, float *out)
{
    int i;
    const float q_phi = y[0];
    const float v_phi = y[1];
    (void)t;
    (void)u;
    (void)work;
    const float w0 = p->m*p->l;
    const float w1 = v_phi*(p->l*v_phi);
    const float w2 = p->g*cosf(q_phi);
    out[0] = 0.5f*w0*w1;
    out[1] = -w0*w2;
    out[2] = w0*(0.5f*w1 - w2);
    for (i = 0; i < 3; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int damped_driven_pendulum_positions(float t, const float *y, const float *u, const damped_driven_pendulum_params *p, float *work, float *out)
{
    int i;
    const float q_phi = y[0];
    (void)t;
    (void)u;
    (void)work;
    out[0] = p->l*sinf(q_phi);
    out[1] = 0.0f;
    out[2] = -p->l*cosf(q_phi);
    for (i = 0; i < 3; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}
