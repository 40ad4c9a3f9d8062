/*
 * pendulum_driven_support: Pendulum whose support is driven to and fro
 *
 * The support moves along a horizontal line as A cos(Omega t); the rod is a constraint that depends
 * on time. No momentum and no energy is conserved. L. D. Landau and E. M. Lifshitz, Mechanics (3rd
 * ed., 1976), section 5, problem 3b.
 *
 * Equations of motion M(q, t) a = f(q, v, t) with n degrees of freedom.
 * Made by lagrange VERSION from the scene with SHA-256
 * 9ae90a2a153119514a6f78ff4be207ac26d4f51a66ac45ce9f56b0520f8a9276
 * This output is yours: use it as you like, under any terms.
 *
 * State y: the coordinates q, then their velocities v = dq/dt
 *   y[0], y[1]  theta [rad]: angle of the rod from the downward vertical
 *
 * Positions:
 *   out[0]  x
 *   out[1]  y
 *   out[2]  z
 *   out[3]  x_support
 *   out[4]  y_support
 *   out[5]  z_support
 *
 * Every function returns 0, or 1 if the mass matrix is singular (or not
 * positive definite where it must be), or 2 if a result is not finite; what it
 * has written is then meaningless.
 * t is the time; u are inputs, of which this system has none (may be null);
 * work holds pendulum_driven_support_WORK numbers of scratch space, unrelated to any other call.
 * y and the array of results must not overlap. Nothing is allocated and no
 * state is kept, so that calls from several threads need only separate arrays.
 */
#ifndef LAGRANGE_pendulum_driven_support_H
#define LAGRANGE_pendulum_driven_support_H

#ifdef __cplusplus
extern "C" {
#endif

#define pendulum_driven_support_DOF 1
#define pendulum_driven_support_POSITIONS 6
#define pendulum_driven_support_EMISSION 0x9707e9ddUL
#define pendulum_driven_support_WORK 1

typedef struct pendulum_driven_support_params {
    double m; /* m [kg]: mass of the bob; default 0.5 */
    double l; /* l [m]: length of the rod; default 1.0 */
    double A; /* A [m]: amplitude of the support; default 0.2 */
    double Omega; /* Omega [rad/s]: angular frequency of the support; default 2.5 */
    double g; /* g [m/s^2]: gravitational acceleration; default 9.81 */
} pendulum_driven_support_params;

/* Values for all parameters that have one in the scene; the others become NaN. */
void pendulum_driven_support_defaults(pendulum_driven_support_params *p);

/* dydt[0..2n-1]: time derivative of the state. */
int pendulum_driven_support_rhs(double t, const double *y, const double *u, const pendulum_driven_support_params *p, double *work, double *dydt);

/* out[0..n*n-1]: mass matrix M(q, t) by rows. */
int pendulum_driven_support_mass_matrix(double t, const double *y, const double *u, const pendulum_driven_support_params *p, double *work, double *out);

/* out[0..n-1]: forcing f(q, v, t). */
int pendulum_driven_support_forcing(double t, const double *y, const double *u, const pendulum_driven_support_params *p, double *work, double *out);

/* out[0], out[1], out[2]: kinetic energy T, potential V, and the energy
 * function (sum of v dL/dv, less L), which is T + V in most systems. */
int pendulum_driven_support_energy(double t, const double *y, const double *u, const pendulum_driven_support_params *p, double *work, double *out);

/* out[0..pendulum_driven_support_POSITIONS-1]: Cartesian names in the order above. */
int pendulum_driven_support_positions(double t, const double *y, const double *u, const pendulum_driven_support_params *p, double *work, double *out);

#ifdef __cplusplus
}
#endif

#endif
