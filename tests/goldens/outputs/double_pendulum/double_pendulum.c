/* double_pendulum: see double_pendulum.h, which documents every function. */

#include "double_pendulum.h"

#if double_pendulum_EMISSION != 0x678d863fUL
#error "double_pendulum.c and double_pendulum.h are not of one emission: emit both once more"
#endif

#include <math.h>

void double_pendulum_defaults(double_pendulum_params *p)
{
    p->m1 = 1.0;
    p->m2 = 1.0;
    p->l1 = 1.0;
    p->l2 = 1.0;
    p->g = 9.81;
}

int double_pendulum_rhs(double t, const double *y, const double *u, const double_pendulum_params *p, double *work, double *dydt)
{
    int i;
    const double q_theta1 = y[0];
    const double q_theta2 = y[1];
    const double v_theta1 = y[2];
    const double v_theta2 = y[3];
    (void)t;
    (void)u;
    (void)work;
    const double w0 = q_theta1 - q_theta2;
    const double w1 = sin(w0);
    const double w2 = p->m2*w1;
    const double w3 = p->l1*cos(w0);
    const double w4 = v_theta1*v_theta1;
    const double w5 = p->l1*(p->m1 + w1*w2);
    const double w6 = (p->m1*p->g*sin(q_theta1) + w2*(p->g*cos(q_theta2) +
        p->l2*v_theta2*v_theta2 + w3*w4))/w5;
    if (!(p->m2*p->l2*p->l2 > 0.0)) {
        return 1;
    }
    if (!(p->l1*w5 > 0.0)) {
        return 1;
    }
    dydt[0] = v_theta1;
    dydt[1] = v_theta2;
    dydt[2] = -w6;
    dydt[3] = -((p->g*sin(q_theta2) - p->l1*w1*w4) - w6*w3)/p->l2;
    for (i = 0; i < 4; ++i) {
        if (!isfinite(dydt[i])) {
            return 2;
        }
    }
    return 0;
}

int double_pendulum_mass_matrix(double t, const double *y, const double *u, const double_pendulum_params *p, double *work, double *out)
{
    int i;
    const double q_theta1 = y[0];
    const double q_theta2 = y[1];
    (void)t;
    (void)u;
    (void)work;
    const double w0 = p->m2*p->l2;
    out[0] = p->l1*p->l1*(p->m1 + p->m2);
    out[1] = p->l1*cos(q_theta1 - q_theta2)*w0;
    out[3] = p->l2*w0;
    out[2] = out[1];
    for (i = 0; i < 4; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int double_pendulum_forcing(double t, const double *y, const double *u, const double_pendulum_params *p, double *work, double *out)
{
    int i;
    const double q_theta1 = y[0];
    const double q_theta2 = y[1];
    const double v_theta1 = y[2];
    const double v_theta2 = y[3];
    (void)t;
    (void)u;
    (void)work;
    const double w0 = p->m2*p->l2;
    const double w1 = sin(q_theta1 - q_theta2)*(p->l1*w0);
    out[0] = -p->l1*p->g*(p->m1 + p->m2)*sin(q_theta1) - v_theta2*v_theta2*w1;
    out[1] = -p->g*sin(q_theta2)*w0 + v_theta1*v_theta1*w1;
    for (i = 0; i < 2; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int double_pendulum_energy(double t, const double *y, const double *u, const double_pendulum_params *p, double *work, double *out)
{
    int i;
    const double q_theta1 = y[0];
    const double q_theta2 = y[1];
    const double v_theta1 = y[2];
    const double v_theta2 = y[3];
    (void)t;
    (void)u;
    (void)work;
    const double w0 = p->l1*v_theta1;
    const double w1 = w0*w0;
    const double w2 = p->l2*v_theta2;
    const double w3 = 0.5*(p->m2*(w1 + w2*(w2 + 2.0*cos(q_theta1 - q_theta2)*w0)) + p->m1*w1);
    const double w4 = p->l1*cos(q_theta1);
    const double w5 = p->m2*p->g*(w4 + p->l2*cos(q_theta2)) + p->m1*p->g*w4;
    out[0] = w3;
    out[1] = -w5;
    out[2] = w3 - w5;
    for (i = 0; i < 3; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

int double_pendulum_positions(double t, const double *y, const double *u, const double_pendulum_params *p, double *work, double *out)
{
    int i;
    const double q_theta1 = y[0];
    const double q_theta2 = y[1];
    (void)t;
    (void)u;
    (void)work;
    const double w0 = p->l1*sin(q_theta1);
    const double w1 = p->l1*cos(q_theta1);
    out[0] = w0;
    out[1] = 0.0;
    out[2] = -w1;
    out[3] = w0 + p->l2*sin(q_theta2);
    out[4] = 0.0;
    out[5] = -w1 - p->l2*cos(q_theta2);
    for (i = 0; i < 6; ++i) {
        if (!isfinite(out[i])) {
            return 2;
        }
    }
    return 0;
}

/*
 * A small program around the functions above: classical Runge-Kutta steps of
 * fixed size, a CSV line for each of 500 intervals. Arguments: NAME=VALUE sets
 * a parameter or an initial value; until=T and steps=N (steps in an interval).
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define double_pendulum_STATE (2*double_pendulum_DOF)

/* One step of size h from time t; y is advanced. */
static int double_pendulum_stepped(double t, double h, const double_pendulum_params *p, double *y)
{
    static double k[4][double_pendulum_STATE], s[double_pendulum_STATE], work[double_pendulum_WORK];
    static const double at[4] = {0.0, 0.5, 0.5, 1.0};
    int stage, i, status;
    for (stage = 0; stage < 4; ++stage) {
        for (i = 0; i < double_pendulum_STATE; ++i) {
            s[i] = y[i] + (stage > 0 ? at[stage]*h*k[stage - 1][i] : 0.0);
        }
        status = double_pendulum_rhs(t + at[stage]*h, s, 0, p, work, k[stage]);
        if (status != 0) {
            return status;
        }
    }
    for (i = 0; i < double_pendulum_STATE; ++i) {
        y[i] += h/6.0*(k[0][i] + 2.0*(k[1][i] + k[2][i]) + k[3][i]);
    }
    return 0;
}

int main(int argc, char **argv)
{
    static const char *const state[] = {"theta1", "theta2", "dot(theta1)", "dot(theta2)"};
    static double y[double_pendulum_STATE] = {1.5, 2.0, 0.0, 0.0};
    static int given[double_pendulum_STATE] = {1, 1, 1, 1};
    double_pendulum_params p;
    double start = 0.0, until = 10.0;
    long steps = 20, row, step;
    int i, k, status;
    double_pendulum_defaults(&p);
    for (i = 1; i < argc; ++i) {
        char *value = strchr(argv[i], '='), *end = 0;
        int known = 0;
        if (value != 0) {
            *value++ = '\0';
            for (k = 0; k < double_pendulum_STATE; ++k) {
                if (strcmp(argv[i], state[k]) == 0) {
                    y[k] = strtod(value, &end);
                    given[k] = known = 1;
                }
            }
            if (!known && strcmp(argv[i], "m1") == 0) {
                p.m1 = strtod(value, &end);
                known = 1;
            }
            if (!known && strcmp(argv[i], "m2") == 0) {
                p.m2 = strtod(value, &end);
                known = 1;
            }
            if (!known && strcmp(argv[i], "l1") == 0) {
                p.l1 = strtod(value, &end);
                known = 1;
            }
            if (!known && strcmp(argv[i], "l2") == 0) {
                p.l2 = strtod(value, &end);
                known = 1;
            }
            if (!known && strcmp(argv[i], "g") == 0) {
                p.g = strtod(value, &end);
                known = 1;
            }
            if (!known && strcmp(argv[i], "until") == 0) {
                until = strtod(value, &end);
                known = 1;
            }
            if (!known && strcmp(argv[i], "steps") == 0) {
                steps = strtol(value, &end, 10);
                known = steps > 0;
            }
        }
        if (!known || end == value || *end != '\0') {
            fprintf(stderr, "%s: not NAME=NUMBER with a known name\n", argv[i]);
            return 2;
        }
    }
    for (k = 0; k < double_pendulum_STATE; ++k) {
        if (!given[k]) {
            fprintf(stderr, "initial value needed: %s=VALUE\n", state[k]);
            return 2;
        }
    }
    printf("t");
    for (k = 0; k < double_pendulum_STATE; ++k) {
        printf(",%s", state[k]);
    }
    for (row = 0; row <= 500; ++row) {
        const double h = (until - start)/((double)500*(double)steps);
        printf("\n%.17g", (start + (double)(row*steps)*h));
        for (k = 0; k < double_pendulum_STATE; ++k) {
            printf(",%.17g", y[k]);
        }
        for (step = 0; row < 500 && step < steps; ++step) {
            status = double_pendulum_stepped(start + (double)(row*steps + step)*h, h, &p, y);
            if (status != 0) {
                fprintf(stderr, "\nstopped: %s\n",
                        status == 1 ? "singular mass matrix" : "result is not finite");
                return 1;
            }
        }
    }
    printf("\n");
    if (fflush(stdout) != 0 || ferror(stdout)) {
        fprintf(stderr, "the table could not be written\n");
        return 1;
    }
    return 0;
}
