/*
 * double_pendulum: Double pendulum
 *
 * Two point masses on massless rods, the second hung from the first, in a vertical plane. Both
 * angles are taken from the downward vertical. Chaotic at large amplitudes. L. D. Landau and E. M.
 * Lifshitz, Mechanics (3rd ed., 1976), section 5, problem 1.
 *
 * Equations of motion M(q, t) a = f(q, v, t) with n degrees of freedom.
 * Made by lagrange VERSION from the scene with SHA-256
 * 608b30109126f091f647f3cf513a931dabd5513f457625dc33716b33ba5af17b
 * This output is yours: use it as you like, under any terms.
 *
 * State y: the coordinates q, then their velocities v = dq/dt
 *   y[0], y[2]  theta1 [rad]: angle of the upper rod from the downward vertical
 *   y[1], y[3]  theta2 [rad]: angle of the lower rod from the downward vertical
 *
 * Positions:
 *   out[0]  x1
 *   out[1]  y1
 *   out[2]  z1
 *   out[3]  x2
 *   out[4]  y2
 *   out[5]  z2
 *
 * Every function returns 0, or 1 if the mass matrix is singular (or not
 * positive definite where it must be), or 2 if a result is not finite; what it
 * has written is then meaningless.
 * t is the time; u are inputs, of which this system has none (may be null);
 * work holds double_pendulum_WORK numbers of scratch space, unrelated to any other call.
 * y and the array of results must not overlap. Nothing is allocated and no
 * state is kept, so that calls from several threads need only separate arrays.
 */
#ifndef LAGRANGE_double_pendulum_H
#define LAGRANGE_double_pendulum_H

#ifdef __cplusplus
extern "C" {
#endif

#define double_pendulum_DOF 2
#define double_pendulum_POSITIONS 6
#define double_pendulum_EMISSION 0x678d863fUL
#define double_pendulum_WORK 1

typedef struct double_pendulum_params {
    double m1; /* m1 [kg]: mass of the upper bob; default 1.0 */
    double m2; /* m2 [kg]: mass of the lower bob; default 1.0 */
    double l1; /* l1 [m]: length of the upper rod; default 1.0 */
    double l2; /* l2 [m]: length of the lower rod; default 1.0 */
    double g; /* g [m/s^2]: gravitational acceleration; default 9.81 */
} double_pendulum_params;

/* Values for all parameters that have one in the scene; the others become NaN. */
void double_pendulum_defaults(double_pendulum_params *p);

/* dydt[0..2n-1]: time derivative of the state. */
int double_pendulum_rhs(double t, const double *y, const double *u, const double_pendulum_params *p, double *work, double *dydt);

/* out[0..n*n-1]: mass matrix M(q, t) by rows. */
int double_pendulum_mass_matrix(double t, const double *y, const double *u, const double_pendulum_params *p, double *work, double *out);

/* out[0..n-1]: forcing f(q, v, t). */
int double_pendulum_forcing(double t, const double *y, const double *u, const double_pendulum_params *p, double *work, double *out);

/* out[0], out[1], out[2]: kinetic energy T, potential V, and the energy
 * function (sum of v dL/dv, less L), which is T + V in most systems. */
int double_pendulum_energy(double t, const double *y, const double *u, const double_pendulum_params *p, double *work, double *out);

/* out[0..double_pendulum_POSITIONS-1]: Cartesian names in the order above. */
int double_pendulum_positions(double t, const double *y, const double *u, const double_pendulum_params *p, double *work, double *out);

#ifdef __cplusplus
}
#endif

#endif
