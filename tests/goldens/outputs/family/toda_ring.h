/*
 * toda_ring: Toda lattice of n particles on a ring
 *
 * Particles whose neighbours repel each other exponentially, closed to a ring, without any
 * coordinates in space: the Lagrangian is given by itself. Completely integrable for every n. M.
 * Toda, Vibration of a chain with nonlinear interaction, Journal of the Physical Society of Japan
 * 22 (1967) 431; H. Flaschka, The Toda lattice II, Physical Review B 9 (1974) 1924.
 *
 * Equations of motion M(q, t) a = f(q, v, t) with n degrees of freedom.
 * Made by lagrange VERSION from the scene with SHA-256
 * a55af92be334a2abe3e9f6fa1120b97fe248272a6c83ded23a758b84640d2f7f
 * This output is yours: use it as you like, under any terms.
 *
 * State y: the coordinates q, then their velocities v = dq/dt
 *   y[0], y[5]  q[1]
 *   y[1], y[6]  q[2]
 *   y[2], y[7]  q[3]
 *   y[3], y[8]  q[4]
 *   y[4], y[9]  q[5]
 *
 * Positions: none, the scene names no Cartesian component.
 *
 * Every function returns 0, or 1 if the mass matrix is singular (or not
 * positive definite where it must be), or 2 if a result is not finite; what it
 * has written is then meaningless.
 * t is the time; u are inputs, of which this system has none (may be null);
 * work holds toda_ring_WORK numbers of scratch space, unrelated to any other call.
 * y and the array of results must not overlap. Nothing is allocated and no
 * state is kept, so that calls from several threads need only separate arrays.
 */
#ifndef LAGRANGE_toda_ring_H
#define LAGRANGE_toda_ring_H

#ifdef __cplusplus
extern "C" {
#endif

#define toda_ring_DOF 5
#define toda_ring_POSITIONS 0
#define toda_ring_EMISSION 0xca0cf5aeUL
#define toda_ring_WORK 1

typedef struct toda_ring_params {
    double none; /* there are no parameters */
} toda_ring_params;

/* Values for all parameters that have one in the scene; the others become NaN. */
void toda_ring_defaults(toda_ring_params *p);

/* dydt[0..2n-1]: time derivative of the state. */
int toda_ring_rhs(double t, const double *y, const double *u, const toda_ring_params *p, double *work, double *dydt);

/* out[0..n*n-1]: mass matrix M(q, t) by rows. */
int toda_ring_mass_matrix(double t, const double *y, const double *u, const toda_ring_params *p, double *work, double *out);

/* out[0..n-1]: forcing f(q, v, t). */
int toda_ring_forcing(double t, const double *y, const double *u, const toda_ring_params *p, double *work, double *out);

/* out[0], out[1], out[2]: kinetic energy T, potential V, and the energy
 * function (sum of v dL/dv, less L), which is T + V in most systems. */
int toda_ring_energy(double t, const double *y, const double *u, const toda_ring_params *p, double *work, double *out);

/* out[0..toda_ring_POSITIONS-1]: Cartesian names in the order above. */
int toda_ring_positions(double t, const double *y, const double *u, const toda_ring_params *p, double *work, double *out);

#ifdef __cplusplus
}
#endif

#endif
