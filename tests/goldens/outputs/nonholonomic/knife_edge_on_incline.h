/*
 * knife_edge_on_incline: Knife edge on an inclined plane
 *
 * A skate that turns steadily on a plane inclined by alpha, x pointing downhill: it may slide along
 * its edge and not across. Released without speed it does not slide off, but moves on a cycloid
 * across the slope. Yu. I. Neimark and N. A. Fufaev, Dynamics of Nonholonomic Systems (1972),
 * chapter III; A. M. Bloch, Nonholonomic Mechanics and Control (2nd ed., 2015), section 1.6.
 *
 * Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with closure
 * equations beside them and a multiplier l[k] of each. g[k] is the gradient of
 * closure k, so that l[k]*g[k] is the generalized force that it exerts.
 * n = 3 coordinates, 1 multiplier, degrees of freedom: 3.
 * Made by lagrange VERSION from the scene with SHA-256
 * dc353cd94f3299aca70ba3ade1394b3838a03af9c2fae77ab87b5944e739bb88
 * This output is yours: use it as you like, under any terms.
 *
 * State y: the coordinates q, then their velocities v = dq/dt
 *   y[0], y[3]  x [m]: downhill
 *   y[1], y[4]  y [m]: across
 *   y[2], y[5]  phi [rad]: direction of the edge
 *
 * Positions:
 *   out[0]  z_skate
 *
 * Closures, each with its multiplier:
 *   l[0]  edge: dot(x)*sin(phi) = dot(y)*cos(phi) (of velocities)
 *
 * Every function returns 0, or 1 if no accelerations and multipliers are
 * determined (a singular configuration), or 2 if a result is not finite; what it
 * has written is then meaningless.
 * t is the time; u are inputs, of which this system has none (may be null);
 * work holds knife_edge_on_incline_WORK numbers of scratch space, unrelated to any other call.
 * y and the array of results must not overlap. Nothing is allocated and no
 * state is kept, so that calls from several threads need only separate arrays.
 */
#ifndef LAGRANGE_knife_edge_on_incline_H
#define LAGRANGE_knife_edge_on_incline_H

#ifdef __cplusplus
extern "C" {
#endif

#define knife_edge_on_incline_COORDINATES 3
#define knife_edge_on_incline_MULTIPLIERS 1
#define knife_edge_on_incline_CONSTRAINTS 1
#define knife_edge_on_incline_POSITIONS 1
#define knife_edge_on_incline_EMISSION 0x92da26d8UL
#define knife_edge_on_incline_WORK 30

typedef struct knife_edge_on_incline_params {
    double m; /* m [kg]; default 1.0 */
    double J; /* J [kg m^2]: moment of inertia about the vertical; default 0.1 */
    double g; /* g [m/s^2]; default 9.81 */
    double alpha; /* alpha [rad]: inclination; default 0.3 */
} knife_edge_on_incline_params;

/* Values for all parameters that have one in the scene; the others become NaN. */
void knife_edge_on_incline_defaults(knife_edge_on_incline_params *p);

/* dydt[0..2n-1]: time derivative of the state. */
int knife_edge_on_incline_rhs(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *dydt);

/* out[0..n*n-1]: mass matrix M(q, t) by rows. */
int knife_edge_on_incline_mass_matrix(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out);

/* out[0..n-1]: forcing f(q, v, t). */
int knife_edge_on_incline_forcing(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out);

/* out[0], out[1], out[2]: kinetic energy T, potential V, and the energy
 * function (sum of v dL/dv, less L), which is T + V in most systems. */
int knife_edge_on_incline_energy(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out);

/* out[0..knife_edge_on_incline_POSITIONS-1]: Cartesian names in the order above. */
int knife_edge_on_incline_positions(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out);

/* out[0..knife_edge_on_incline_MULTIPLIERS-1]: the multipliers, in the order of the closures above. */
int knife_edge_on_incline_multipliers(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out);

/* out[0..knife_edge_on_incline_CONSTRAINTS-1]: lhs - rhs of the closures of positions, then
 * what should be zero of the velocities, for each of the closures above: its
 * time derivative, or lhs - rhs of one that holds velocities. */
int knife_edge_on_incline_constraints(double t, const double *y, const double *u, const knife_edge_on_incline_params *p, double *work, double *out);

/*
 * Leads y back to the closures, which it leaves in the course of integration:
 * q by the smallest changes, in the metric of the kinetic energy, until only
 * rounding is left (Newton's method), then v in the same metric. To be called
 * after each step, and before the first where the state is not known to obey
 * the closures. Returns 1 in a singular configuration, 2 if a result is not
 * finite, 3 if y is too far from any state that obeys them; y has then changed.
 */
int knife_edge_on_incline_project(double t, double *y, const double *u, const knife_edge_on_incline_params *p, double *work);

#ifdef __cplusplus
}
#endif

#endif
