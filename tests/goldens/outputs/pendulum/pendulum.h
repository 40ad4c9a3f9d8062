/*
 * pendulum: Simple pendulum
 *
 * A point mass on a massless rod, swinging in a vertical plane, released at rest. The angle is 2
 * asin(k cd(sqrt(g/l) t, k)) with k = sin(theta0/2), cd = cn/dn Jacobi's function; the period is 4
 * sqrt(l/g) K(k). L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 11, problem
 * 1.
 *
 * Equations of motion M(q, t) a = f(q, v, t) with n degrees of freedom.
 * Made by lagrange VERSION from the scene with SHA-256
 * d8ab23885144fff672c2bbbf20ccdd4e6e5060c564f9fb77ff6792c03ba61d08
 * This output is yours: use it as you like, under any terms.
 *
 * State y: the coordinates q, then their velocities v = dq/dt
 *   y[0], y[1]  theta [rad]: angle from the downward vertical
 *
 * Positions:
 *   out[0]  x
 *   out[1]  y
 *   out[2]  z
 *
 * Every function returns 0, or 1 if the mass matrix is singular (or not
 * positive definite where it must be), or 2 if a result is not finite; what it
 * has written is then meaningless.
 * t is the time; u are inputs, of which this system has none (may be null);
 * work holds pendulum_WORK numbers of scratch space, unrelated to any other call.
 * y and the array of results must not overlap. Nothing is allocated and no
 * state is kept, so that calls from several threads need only separate arrays.
 */
#ifndef LAGRANGE_pendulum_H
#define LAGRANGE_pendulum_H

#ifdef __cplusplus
extern "C" {
#endif

#define pendulum_DOF 1
#define pendulum_POSITIONS 3
#define pendulum_EMISSION 0x3e9289daUL
#define pendulum_WORK 1

typedef struct pendulum_params {
    double m; /* m [kg]: mass of the bob; default 1.0 */
    double l; /* l [m]: length of the rod; default 1.0 */
    double g; /* g [m/s^2]: gravitational acceleration; default 9.81 */
} pendulum_params;

/* Values for all parameters that have one in the scene; the others become NaN. */
void pendulum_defaults(pendulum_params *p);

/* dydt[0..2n-1]: time derivative of the state. */
int pendulum_rhs(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *dydt);

/* out[0..n*n-1]: mass matrix M(q, t) by rows. */
int pendulum_mass_matrix(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *out);

/* out[0..n-1]: forcing f(q, v, t). */
int pendulum_forcing(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *out);

/* out[0], out[1], out[2]: kinetic energy T, potential V, and the energy
 * function (sum of v dL/dv, less L), which is T + V in most systems. */
int pendulum_energy(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *out);

/* out[0..pendulum_POSITIONS-1]: Cartesian names in the order above. */
int pendulum_positions(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *out);

#ifdef __cplusplus
}
#endif

#endif
