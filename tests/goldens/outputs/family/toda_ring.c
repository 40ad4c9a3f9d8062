/* toda_ring: see toda_ring.h, which documents every function. */

#include "toda_ring.h"

#if toda_ring_EMISSION != 0xca0cf5aeUL
#error "toda_ring.c and toda_ring.h are not of one emission: emit both once more"
#endif

#include <math.h>

void toda_ring_defaults(toda_ring_params *p)
{
    p->none = 0.0;
}

int toda_ring_rhs(double t, const double *y, const double *u, const toda_ring_params *p, double *work, double *dydt)
{
    int i;
    const double q_q_1 = y[0];
    const double q_q_2 = y[1];
    const double q_q_3 = y[2];
    const double q_q_4 = y[3];
    const double q_q_5 = y[4];
    const double v_q_1 = y[5];
    const double v_q_2 = y[6];
    const double v_q_3 = y[7];
    const double v_q_4 = y[8];
    const double v_q_5 = y[9];
    (void)t;
    (void)u;
    (void)p;
    (void)work;
    const double w0 = exp(q_q_1 - q_q_2);
    const double w1 = exp(-q_q_1 + q_q_5);
    const double w2 = exp(q_q_2 - q_q_3);
    const double w3 = exp(q_q_3 - q_q_4);
    const double w4 = exp(q_q_4 - q_q_5);
    if (!(1.0 > 0.0)) {
        return 1;
    }
    if (!(1.0 > 0.0)) {
        return 1;
    }
    if (!(1.0 > 0.0)) {
        return 1;
    }
    if (!(1.0 > 0.0)) {
        return 1;
    }
    if (!(1.0 > 0.0)) {
        return 1;
    }
    dydt[0] = v_q_1;
    dydt[1] = v_q_2;
    dydt[2] = v_q_3;
    dydt[3] = v_q_4;
    dydt[4] = v_q_5;
    dydt[5] = -w0 + w1;
    dydt[6] = w0 - w2;
    dydt[7] = w2 - w3;
    dydt[8] = w3 - w4;
    dydt[9] = -w1 + w4;
    for (i = 0; i < 10; ++i) {
        if (!isfinite(dydt[i])) {
            return 2;
        }
    }
    return 0;
}

int toda_ring_mass_matrix(double t, const double *y, const double *u, const toda_ring_params *p, double *work, double *out)
{
    int i;
    (void)t;
    (void)y;
    (void)u;
    (void)p;
    (void)work;
    out[0] = 1.0;
    out[1] = 0.0;
    out[2] = 0.0;
    out[3] = 0.0;
    out[4] = 0.0;
    out[6] = 1.0;
    out[7] = 0.0;
    out[8] = 0.0;
    out[9] = 0.0;
    out[12] = 1.0;
    out[13] = 0.0;
    out[14] = 0.0;
    out[18] = 1.0;
    out[19] = 0.0;
    out[24] = 1.0;
    out[5] = out[1];
    out[10] = out[2];
    out[15] = out[3];
    out[20] = out[4];
    out[11] = out[7];
    out[16] = out[8];
    out[21] = out[9];
    out[17] = out[13];
    out[22] = out[14];
    out[23] = out[19];
    for (i = 0; i < 25; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int toda_ring_forcing(double t, const double *y, const double *u, const toda_ring_params *p, double *work, double *out)
{
    int i;
    const double q_q_1 = y[0];
    const double q_q_2 = y[1];
    const double q_q_3 = y[2];
    const double q_q_4 = y[3];
    const double q_q_5 = y[4];
    (void)t;
    (void)u;
    (void)p;
    (void)work;
    const double w0 = exp(q_q_1 - q_q_2);
    const double w1 = exp(-q_q_1 + q_q_5);
    const double w2 = exp(q_q_2 - q_q_3);
    const double w3 = exp(q_q_3 - q_q_4);
    const double w4 = exp(q_q_4 - q_q_5);
    out[0] = -w0 + w1;
    out[1] = w0 - w2;
    out[2] = w2 - w3;
    out[3] = w3 - w4;
    out[4] = -w1 + w4;
    for (i = 0; i < 5; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int toda_ring_energy(double t, const double *y, const double *u, const toda_ring_params *p, double *work, double *out)
{
    int i;
    const double q_q_1 = y[0];
    const double q_q_2 = y[1];
    const double q_q_3 = y[2];
    const double q_q_4 = y[3];
    const double q_q_5 = y[4];
    const double v_q_1 = y[5];
    const double v_q_2 = y[6];
    const double v_q_3 = y[7];
    const double v_q_4 = y[8];
    const double v_q_5 = y[9];
    (void)t;
    (void)u;
    (void)p;
    (void)work;
    const double w0 = 0.5*(v_q_1*v_q_1 + v_q_2*v_q_2 + v_q_3*v_q_3 + v_q_4*v_q_4 + v_q_5*v_q_5);
    const double w1 = 5.0 - exp(q_q_1 - q_q_2) - exp(q_q_2 - q_q_3) - exp(q_q_3 - q_q_4) -
        exp(q_q_4 - q_q_5) - exp(-q_q_1 + q_q_5);
    out[0] = w0;
    out[1] = -w1;
    out[2] = -w1 + w0;
    for (i = 0; i < 3; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int toda_ring_positions(double t, const double *y, const double *u, const toda_ring_params *p, double *work, double *out)
{
    (void)t;
    (void)y;
    (void)u;
    (void)p;
    (void)work;
    (void)out;
    return 0;
}
