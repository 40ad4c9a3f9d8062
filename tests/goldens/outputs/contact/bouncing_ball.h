/*
 * bouncing_ball: Ball bouncing on a floor
 *
 * A ball thrown horizontally bounces with the coefficient of restitution e. Its bounces follow each
 * other at 2 e^k sqrt(2 h/g), so that infinitely many of them end at sqrt(2 h/g) (1 + e)/(1 - e),
 * here at 4.06 s. Brach, Mechanical Impact Dynamics, 1991, section 1.4.
 *
 * Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with one-sided
 * constraints beside them and a multiplier l[k] of each. g[k] is the gradient of
 * the gap of contact k, so that l[k]*g[k] is the generalized force that it exerts.
 * A contact pushes, l[k] >= 0, while it is closed; l[k] = 0 while it is open.
 * n = 2 coordinates, degrees of freedom: 2.
 * Made by lagrange VERSION from the scene with SHA-256
 * 66f753407555c50a83bd77a53c6b989af4bfbbbcb84e02761419d8f2fe69a2a0
 * This output is yours: use it as you like, under any terms.
 *
 * State y: the coordinates q, then their velocities v = dq/dt
 *   y[0], y[2]  x
 *   y[1], y[3]  z
 *
 * Positions:
 *   out[0]  y
 *
 * Contacts, each with its number in mode and its multiplier:
 *   mode[0], l[0]  floor: z >= 0
 *
 * mode[k] is 1 where contact k is closed and 0 where it is open (a null pointer: all
 * are). Integrate with a fixed mode until one of the numbers that bouncing_ball_events gives
 * falls through zero, say number k; find when; call bouncing_ball_reset at the state there,
 * with event = k; go on with the state and the mode that it leaves. Begin with mode
 * all 0 and event = -1. Behind an event the gap of what has opened is zero but for
 * rounding, of either sign.
 *
 * Every function returns 0, or 1 if no accelerations and multipliers are
 * determined (a singular configuration), or 2 if a result is not finite; what it
 * has written is then meaningless.
 * t is the time; u are inputs, of which this system has none (may be null);
 * work holds bouncing_ball_WORK numbers of scratch space, unrelated to any other call.
 * y and the array of results must not overlap. Nothing is allocated and no
 * state is kept, so that calls from several threads need only separate arrays.
 */
#ifndef LAGRANGE_bouncing_ball_H
#define LAGRANGE_bouncing_ball_H

#ifdef __cplusplus
extern "C" {
#endif

#define bouncing_ball_DOF 2
#define bouncing_ball_CONTACTS 1
#define bouncing_ball_MULTIPLIERS 1
#define bouncing_ball_CONSTRAINTS 2
#define bouncing_ball_POSITIONS 1
#define bouncing_ball_EMISSION 0x8c278f21UL
#define bouncing_ball_WORK 40

typedef struct bouncing_ball_params {
    double m; /* m; default 1.0 */
    double g; /* g; default 9.81 */
    double h; /* h [m]: height of the start; default 1.0 */
    double u; /* u [m/s]: horizontal speed; default 0.5 */
    double e; /* e: coefficient of restitution; default 0.8 */
} bouncing_ball_params;

/* Values for all parameters that have one in the scene; the others become NaN. */
void bouncing_ball_defaults(bouncing_ball_params *p);

/* dydt[0..2n-1]: time derivative of the state. */
int bouncing_ball_rhs(double t, const double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work, double *dydt);

/* out[0..n*n-1]: mass matrix M(q, t) by rows. */
int bouncing_ball_mass_matrix(double t, const double *y, const double *u, const bouncing_ball_params *p, double *work, double *out);

/* out[0..n-1]: forcing f(q, v, t). */
int bouncing_ball_forcing(double t, const double *y, const double *u, const bouncing_ball_params *p, double *work, double *out);

/* out[0], out[1], out[2]: kinetic energy T, potential V, and the energy
 * function (sum of v dL/dv, less L), which is T + V in most systems. */
int bouncing_ball_energy(double t, const double *y, const double *u, const bouncing_ball_params *p, double *work, double *out);

/* out[0..bouncing_ball_POSITIONS-1]: Cartesian names in the order above. */
int bouncing_ball_positions(double t, const double *y, const double *u, const bouncing_ball_params *p, double *work, double *out);

/* out[0..bouncing_ball_MULTIPLIERS-1]: the multipliers of the closures, then of the contacts,
 * zero for one that is open. */
int bouncing_ball_multipliers(double t, const double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work, double *out);

/* out[0..bouncing_ball_CONSTRAINTS-1]: the gaps of the contacts, then their rates,
 * zero for one that is open. */
int bouncing_ball_constraints(double t, const double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work, double *out);

/*
 * Leads y back to what is closed, which it leaves in the course of integration:
 * q by the smallest changes, in the metric of the kinetic energy, until only
 * rounding is left (Newton's method), then v in the same metric. To be called
 * after each step. Returns 1 in a singular configuration, 2 if a result is not
 * finite, 3 if y is too far from any state that obeys them; y has then changed.
 */
int bouncing_ball_project(double t, double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work);

/* out[k]: falls through zero where contact k opens or closes: its multiplier
 * where it is closed, its gap where it is open. Returns 1 in a singular
 * configuration or if a number is not finite. */
int bouncing_ball_events(double t, const double *y, const double *u, const bouncing_ball_params *p, const int *mode, double *work, double *out);

/*
 * What happens at an event of contact number event, or at a start (event = -1):
 * an impact where what closes approaches, by Newton's law with impulses that only
 * push, all that is closed taking part (bounce 1: with the restitution of each
 * contact; 0: without, to end a sequence of ever shorter bounces). y, of which
 * v may change, and mode are then those to go on with. Returns 1 in a singular
 * configuration or if a number is not finite, 4 if the contacts leave no motion (walls
 * that close in) or a restitution is not between 0 and 1; y and mode are then meaningless.
 */
int bouncing_ball_reset(double t, double *y, const double *u, const bouncing_ball_params *p, int *mode, int event, double bounce, double *work);

#ifdef __cplusplus
}
#endif

#endif
