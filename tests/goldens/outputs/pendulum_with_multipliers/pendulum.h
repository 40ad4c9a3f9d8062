/*
 * pendulum: Simple pendulum
 *
 * A point mass on a massless rod, swinging in a vertical plane, released at rest. The angle is 2
 * asin(k cd(sqrt(g/l) t, k)) with k = sin(theta0/2), cd = cn/dn Jacobi's function; the period is 4
 * sqrt(l/g) K(k). L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 11, problem
 * 1.
 *
 * Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with closure
 * equations beside them and a multiplier l[k] of each. g[k] is the gradient of
 * closure k, so that l[k]*g[k] is the generalized force that it exerts.
 * n = 2 coordinates, 1 multiplier, degrees of freedom: 1.
 * Made by lagrange VERSION from the scene with SHA-256
 * d8ab23885144fff672c2bbbf20ccdd4e6e5060c564f9fb77ff6792c03ba61d08
 * This output is yours: use it as you like, under any terms.
 *
 * State y: the coordinates q, then their velocities v = dq/dt
 *   y[0], y[2]  x
 *   y[1], y[3]  z
 *
 * Positions:
 *   out[0]  y
 *
 * Closures, each with its multiplier:
 *   l[0]  bob: x = l*sin(theta), z = -l*cos(theta)
 *
 * Every function returns 0, or 1 if no accelerations and multipliers are
 * determined (a singular configuration), or 2 if a result is not finite; what it
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

#define pendulum_COORDINATES 2
#define pendulum_MULTIPLIERS 1
#define pendulum_CONSTRAINTS 2
#define pendulum_POSITIONS 1
#define pendulum_EMISSION 0xd56abb4bUL
#define pendulum_WORK 30

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

/* out[0..pendulum_MULTIPLIERS-1]: the multipliers, in the order of the closures above. */
int pendulum_multipliers(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *out);

/* out[0..pendulum_CONSTRAINTS-1]: lhs - rhs of the closures of positions, then
 * what should be zero of the velocities, for each of the closures above: its
 * time derivative, or lhs - rhs of one that holds velocities. */
int pendulum_constraints(double t, const double *y, const double *u, const pendulum_params *p, double *work, double *out);

/*
 * Leads y back to the closures, which it leaves in the course of integration:
 * q by the smallest changes, in the metric of the kinetic energy, until only
 * rounding is left (Newton's method), then v in the same metric. To be called
 * after each step, and before the first where the state is not known to obey
 * the closures. Returns 1 in a singular configuration, 2 if a result is not
 * finite, 3 if y is too far from any state that obeys them; y has then changed.
 */
int pendulum_project(double t, double *y, const double *u, const pendulum_params *p, double *work);

#ifdef __cplusplus
}
#endif

#endif
