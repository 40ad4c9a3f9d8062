/*
 * damped_driven_pendulum: Damped driven pendulum
 *
 * A pendulum with friction in its hinge, driven by a torque that varies as cos(omega t). With the
 * dimensionless strength of the drive gamma = 1.073 its motion settles to one of twice the period
 * of the drive; from 1.0829 on it is chaotic. J. R. Taylor, Classical Mechanics (2005), chapter 12.
 *
 * Equations of motion M(q, t) a = f(q, v, t) with n degrees of freedom.
 * Made by lagrange VERSION from the scene with SHA-256
 * 5823946e160ed59aa7ed0ce9a8e0bb53bfff928d45867c3c5fe557d6e7229055
 * This output is yours: use it as you like, under any terms.
 *
 * State y: the coordinates q, then their velocities v = dq/dt
 *   y[0], y[1]  phi [rad]: angle of the rod from the downward vertical
 *
 * Positions:
 *   out[0]  x_bob
 *   out[1]  y_bob
 *   out[2]  z_bob
 *
 * Every function returns 0, or 1 if the mass matrix is singular (or not
 * positive definite where it must be), or 2 if a result is not finite; what it
 * has written is then meaningless.
 * t is the time; u are inputs, of which this system has none (may be null);
 * work holds damped_driven_pendulum_WORK numbers of scratch space, unrelated to any other call.
 * y and the array of results must not overlap. Nothing is allocated and no
 * state is kept, so that calls from several threads need only separate arrays.
 */
#ifndef LAGRANGE_damped_driven_pendulum_H
#define LAGRANGE_damped_driven_pendulum_H

#ifdef __cplusplus
extern "C" {
#endif

#define damped_driven_pendulum_DOF 1
#define damped_driven_pendulum_POSITIONS 3
#define damped_driven_pendulum_EMISSION 0x86c44bf6UL
#define damped_driven_pendulum_WORK 1

typedef struct damped_driven_pendulum_params {
    float m; /* m [kg]: mass of the bob; default 0.1 */
    float omega; /* omega [rad/s]: angular frequency of the drive; default 6.283185307179586 */
    float omega0; /* omega0 [rad/s]: natural angular frequency; default 9.42477796076938 */
    float beta; /* beta [1/s]: damping; default 2.356194490192345 */
    float gamma; /* gamma: torque of the drive over the greatest torque of the weight; default
        1.073 */
    float g; /* g [m/s^2]: gravitational acceleration; default 9.81 */
    float l; /* l [m]: length of the rod; default 0.11044009017014816 */
} damped_driven_pendulum_params;

/* Values for all parameters that have one in the scene; the others become NaN. */
void damped_driven_pendulum_defaults(damped_driven_pendulum_params *p);

/* dydt[0..2n-1]: time derivative of the state. */
int damped_driven_pendulum_rhs(float t, const float *y, const float *u, const damped_driven_pendulum_params *p, float *work, float *dydt);

/* out[0..n*n-1]: mass matrix M(q, t) by rows. */
int damped_driven_pendulum_mass_matrix(float t, const float *y, const float *u, const damped_driven_pendulum_params *p, float *work, float *out);

/* out[0..n-1]: forcing f(q, v, t). */
int damped_driven_pendulum_forcing(float t, const float *y, const float *u, const damped_driven_pendulum_params *p, float *work, float *out);

/* out[0], out[1], out[2]: kinetic energy T, potential V, and the energy
 * function (sum of v dL/dv, less L), which is T + V in most systems. */
int damped_driven_pendulum_energy(float t, const float *y, const float *u, const damped_driven_pendulum_params *p, float *work, float *out);

/* out[0..damped_driven_pendulum_POSITIONS-1]: Cartesian names in the order above. */
int damped_driven_pendulum_positions(float t, const float *y, const float *u, const damped_driven_pendulum_params *p, float *work, float *out);

#ifdef __cplusplus
}
#endif

#endif
