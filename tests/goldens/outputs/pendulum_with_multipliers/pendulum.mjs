// pendulum: Simple pendulum
//
// A point mass on a massless rod, swinging in a vertical plane, released at rest. The angle is 2
// asin(k cd(sqrt(g/l) t, k)) with k = sin(theta0/2), cd = cn/dn Jacobi's function; the period is 4
// sqrt(l/g) K(k). L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 11, problem
// 1.
//
// Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with closures beside
// them: l[k] is the multiplier and g[k] the gradient of closure k.
// The state y holds the coordinates q, then their velocities v. Functions have no result
// (NaN, or a status that is not 0) where M is singular or a number is not finite.
//
// Coordinates, in their order:
//   x
//   z
//
// Parameters, in their order:
//   m [kg]: mass of the bob
//   l [m]: length of the rod
//   g [m/s^2]: gravitational acceleration
//
// Positions, in their order:
//   y
//
// Closures, in their order:
//   bob: x = l*sin(theta), z = -l*cos(theta)
//
// Made by lagrange VERSION from the scene with SHA-256
// d8ab23885144fff672c2bbbf20ccdd4e6e5060c564f9fb77ff6792c03ba61d08
// This output is yours: use it as you like, under any terms.

export const COORDINATES = ["x", "z"];
export const PARAMETERS = ["m", "l", "g"];
export const INPUTS = [];
export const DEFAULTS = [1.0, 1.0, 9.81];
export const INITIAL = [0.9092974268256817, 0.4161468365471424, 0.0, 0.0];
export const START = 0.0;
export const UNTIL = 20.0;
export const ROWS = 500;
export const STEPS = 20;

/**
 * Tell whether a state of n coordinates obeys closures, but for rounding of its numbers.
 *
 * y is the state led back to them, span the duration of a run: velocities that move no coordinate
 * by more than rounding in it are none.
 */
function is_near(n, span, stated, y) {
  let place = 0.0;
  let rate = 0.0;
  for (let i = 0; i < n; ++i) {
    if (Math.abs(stated[i]) > place) {
      place = Math.abs(stated[i]);
    }
    if (Math.abs(stated[n + i]) > rate) {
      rate = Math.abs(stated[n + i]);
    }
  }
  let bound = 1e-09*rate;
  if (span != 0.0) {
    bound += 7.105427357601002e-15*place/Math.abs(span);
  }
  for (let i = 0; i < n; ++i) {
    if (!(Math.abs(y[i] - stated[i]) <= 1e-09*place)) {
      return false;
    }
    if (!(Math.abs(y[n + i] - stated[n + i]) <= bound)) {
      return false;
    }
  }
  return true;
}

/**
 * Return the largest power of two that is not above x, or the smallest normal number.
 */
function power_of_two(x) {
  let power = 1.0;
  while (power > x && power > 2.2250738585072014e-308) {
    power *= 0.5;
  }
  while (power < 0.5*x) {
    power *= 2.0;
  }
  if (2.0*power <= x) {
    power *= 2.0;
  }
  return power;
}

/**
 * Return the largest of m residuals, in units of the last place of the magnitude m behind.
 */
function residual(m, error) {
  let largest = 0.0;
  for (let k = 0; k < m; ++k) {
    const size = Math.abs(error[k])/(2.0*1.1102230246251565e-16*power_of_two(error[m + k]));
    if (size > largest) {
      largest = size;
    }
  }
  return largest;
}

/**
 * Return the same where changes of all coordinates are found, and rounded, together.
 *
 * The magnitude of one residual counts for another as far as a change of the coordinates that
 * makes the one does the other: square holds the squares of their gradients. A residual that is
 * the difference of nothing (a height that is zero) has no magnitude of its own.
 */
function coupled_residual(m, error, square) {
  let reach = 0.0;
  for (let k = 0; k < m; ++k) {
    if (square[k] > 0.0) {
      const length = error[m + k]/Math.sqrt(square[k]);
      if (length > reach) {
        reach = length;
      }
    }
  }
  for (let k = 0; k < m; ++k) {
    const magnitude = reach*Math.sqrt(square[k]);
    if (magnitude > error[m + k] && magnitude <= 1.7976931348623157e+308) {
      error[m + k] = magnitude;
    }
  }
  return residual(m, error);
}

/**
 * Lead n coordinates back to m closures of positions, by the smallest changes.
 *
 * Their metric is the kinetic energy. Newton's method goes on until only rounding is left, or
 * little more that no change makes smaller. The arrays behind y are overwritten. Tell whether the
 * closures hold; else the configuration is singular, or too far from any that obeys them.
 */
function lead_positions(n, m, t, p, y, error, square, change) {
  let last = 0.0;
  for (let number = 0; number < 50 + 1; ++number) {
    error.set(position_error(t, y, p));
    if (!error.every(Number.isFinite)) {
      return false;
    }
    let size = residual(m, error);
    if (size <= 1.0) {
      return true;
    }
    if (number > 0) {
      square.set(position_reach(t, y, p));
      if (!square.every(Number.isFinite)) {
        return false;
      }
      size = coupled_residual(m, error, square);
      if (size <= 1.0) {
        return true;
      }
      if (size <= 1024.0 && 2.0*size > last) {
        return true;
      }
    }
    last = size;
    change.set(position_change(t, y, p));
    if (!change.every(Number.isFinite)) {
      return false;
    }
    for (let i = 0; i < n; ++i) {
      y[i] += change[i];
    }
  }
  return false;
}

/**
 * Lead the velocities of n coordinates back to m closures, in the same metric.
 *
 * The arrays behind y are overwritten. Tell whether the closures hold.
 */
function lead_velocities(n, m, t, p, y, error, change) {
  error.set(velocity_error(t, y, p));
  if (!error.every(Number.isFinite)) {
    return false;
  }
  if (!(residual(m, error) <= 1.0)) {
    change.set(velocity_change(t, y, p));
    if (!change.every(Number.isFinite)) {
      return false;
    }
    for (let i = 0; i < n; ++i) {
      y[n + i] += change[i];
    }
  }
  return true;
}

/**
 * Return the power of two that brings a positive number to between 1/2 and 1.
 */
function scale_of(x) {
  return 0.5/power_of_two(x);
}

/**
 * Tell whether elimination leaves little of the inertia of a coordinate.
 *
 * c is overwritten. Coordinates without any inertia do not count.
 */
function is_uneven(n, s, a, c) {
  for (let i = 0; i < n; ++i) {
    for (let j = 0; j < n; ++j) {
      c[i*n + j] = a[i*s + j];
    }
  }
  for (let k = 0; k < n; ++k) {
    const row = k*n;
    const inertia = a[k*s + k];
    if (inertia > 7.888609052210118e-31) {
      if (!(c[row + k] > 0.00390625*inertia)) {
        return true;
      }
    } else {
      for (let i = 0; i < n; ++i) {
        if (i != k && a[i*s + k] != 0.0) {
          return true;
        }
      }
    }
    for (let i = k + 1; i < n; ++i) {
      if (c[row + i] != 0.0) {
        const ratio = c[row + i]/c[row + k];
        for (let j = i; j < n; ++j) {
          c[i*n + j] -= ratio*c[row + j];
        }
      }
    }
  }
  return false;
}

/**
 * Return the power of two whose square brings a positive number to between 1/4 and 1.
 */
function root_scale_of(x) {
  return scale_of(Math.sqrt(x));
}

/**
 * Store factors d of the n coordinates for the matrix of solve_saddle.
 *
 * They are one over the root of the inertia, or of w g^2 where that is more, for the gradient g
 * of each closure. w is the second smallest inertia over g^2 that it meets, if there are two: a
 * coordinate that a closure holds need not have inertia at every state. 0 without either.
 */
function scale_inertia(n, s, a, d) {
  for (let j = 0; j < n; ++j) {
    d[j] = 0.0;
    if (a[j*s + j] != 0.0) {
      d[j] = power_of_two(Math.abs(a[j*s + j]));
    }
  }
  for (let i = n; i < s; ++i) {
    let first = 2.535301200456459e+30;
    let second = 2.535301200456459e+30;
    let count = 0;
    for (let j = 0; j < n; ++j) {
      if (a[i*s + j] != 0.0 && a[j*s + j] != 0.0) {
        const gradient = power_of_two(Math.abs(a[i*s + j]));
        const inertia = power_of_two(Math.abs(a[j*s + j]));
        let ratio = 2.535301200456459e+30;
        if (gradient*2.535301200456459e+30*gradient > inertia) {
          ratio = inertia/gradient/gradient;
        }
        if (ratio < first) {
          second = first;
          first = ratio;
        } else if (ratio < second) {
          second = ratio;
        }
        count += 1;
      }
    }
    if (count == 1) {
      second = first;
    }
    for (let j = 0; j < n; ++j) {
      if (count > 0 && a[i*s + j] != 0.0) {
        const gradient = power_of_two(Math.abs(a[i*s + j]));
        const size = gradient*second*gradient;
        if (size > d[j]) {
          d[j] = size;
        }
      }
    }
  }
  for (let j = 0; j < n; ++j) {
    if (d[j] > 0.0) {
      d[j] = root_scale_of(d[j]);
    }
  }
}

/**
 * Equilibrate a symmetric matrix of s rows by powers of two (Bunch, J. ACM 18 (1971) 566).
 *
 * a[i,j] d[i] d[j] is not small throughout a row. Rows of which d is 0 start from the diagonal,
 * or follow from those that they touch. A row of zeros has no scale.
 */
function equilibrate(s, a, d) {
  let left = 0;
  for (let i = 0; i < s; ++i) {
    if (!(d[i] > 0.0)) {
      left += 1;
    }
  }
  let before = s + 1;
  while (left > 0) {
    let stuck = left == before;
    before = left;
    for (let i = 0; i < s; ++i) {
      if (!(d[i] > 0.0)) {
        let size = Math.sqrt(Math.abs(a[i*s + i]));
        for (let j = 0; j < s; ++j) {
          let entry = Math.abs(a[i*s + j]);
          if (!stuck) {
            entry *= d[j];
          }
          if (entry > size) {
            size = entry;
          }
        }
        if (size > 0.0) {
          d[i] = scale_of(size);
          if (stuck) {
            d[i] = 1.0;
          }
          stuck = false;
          left -= 1;
        }
      }
    }
    if (stuck) {
      return false;
    }
  }
  return true;
}

/**
 * Solve a x = b for n unknowns by elimination with partial pivoting; x replaces b.
 */
function solve_pivoted(n, a, b) {
  for (let j = 0; j < n; ++j) {
    const row = j*n;
    let best = j;
    for (let i = j + 1; i < n; ++i) {
      if (Math.abs(a[i*n + j]) > Math.abs(a[best*n + j])) {
        best = i;
      }
    }
    if (!(Math.abs(a[best*n + j]) > 0.0)) {
      return false;
    }
    if (best != j) {
      let swap = b[j];
      b[j] = b[best];
      b[best] = swap;
      for (let k = j; k < n; ++k) {
        swap = a[row + k];
        a[row + k] = a[best*n + k];
        a[best*n + k] = swap;
      }
    }
    for (let i = j + 1; i < n; ++i) {
      const below = i*n;
      const ratio = a[below + j]/a[row + j];
      for (let k = j + 1; k < n; ++k) {
        a[below + k] -= ratio*a[row + k];
      }
      b[i] -= ratio*b[j];
    }
  }
  for (let i = n - 1; i >= 0; --i) {
    let value = b[i];
    for (let k = i + 1; k < n; ++k) {
      value -= a[i*n + k]*b[k];
    }
    b[i] = value/a[i*n + i];
  }
  return true;
}

/**
 * Solve M x = f + G^T l, G x + C l = g for n numbers x and m numbers l.
 *
 * Of the matrix [M, G^T; G, C] by rows, the upper triangle of M, the rows of G and the diagonal
 * C are given: C is 0, or 1 where a row of G and g are zero, which makes that number of l zero.
 * [x; l] replaces [f; g] in b; scales d, a copy of the matrix and the defect of the solution are
 * overwritten. Units do not matter: M is divided by its size, and rows and columns are scaled
 * alike, all by powers of two. Then comes elimination with pivoting; where M is nearly singular
 * the solution is refined once, so that every row holds to the rounding of its own terms (Skeel,
 * Math. Comput. 35 (1980) 817).
 */
function solve_saddle(n, m, a, b, d, copy, defect) {
  const s = n + m;
  let size = 0.0;
  let unit = 1.0;
  for (let i = 0; i < n; ++i) {
    for (let j = i; j < n; ++j) {
      if (Math.abs(a[i*s + j]) > size) {
        size = Math.abs(a[i*s + j]);
      }
    }
  }
  if (size > 0.0) {
    unit = scale_of(size);
  }
  for (let i = 0; i < s; ++i) {
    for (let j = i; j < s; ++j) {
      if (j < n) {
        a[i*s + j] *= unit;
      } else if (i < n) {
        a[i*s + j] = a[j*s + i];
      } else if (i < j) {
        a[i*s + j] = 0.0;
      }
      a[j*s + i] = a[i*s + j];
    }
    if (i < n) {
      b[i] *= unit;
    }
    d[i] = 0.0;
  }
  const uneven = is_uneven(n, s, a, copy);
  if (uneven) {
    scale_inertia(n, s, a, d);
  }
  if (!equilibrate(s, a, d)) {
    return false;
  }
  for (let i = 0; i < s; ++i) {
    for (let j = 0; j < s; ++j) {
      a[i*s + j] = a[i*s + j]*d[i]*d[j];
      copy[i*s + j] = a[i*s + j];
    }
    b[i] *= d[i];
    defect[i] = b[i];
  }
  if (!solve_pivoted(s, a, b)) {
    return false;
  }
  if (uneven) {
    for (let i = 0; i < s; ++i) {
      for (let j = 0; j < s; ++j) {
        defect[i] -= copy[i*s + j]*b[j];
      }
    }
    if (!solve_pivoted(s, copy, defect)) {
      return false;
    }
  }
  for (let i = 0; i < s; ++i) {
    if (!(Math.abs(a[i*s + i]) > s*1.1102230246251565e-16)) {
      return false;
    }
    if (uneven) {
      b[i] += defect[i];
    }
    b[i] *= d[i];
    if (i >= n) {
      b[i] /= -unit;
    }
  }
  return true;
}

/** State derivative [v, a]. */
export function rhs(t, y, p = DEFAULTS) {
  const out = new Float64Array(4);
  const m = p[0];
  const g = p[2];
  const x = y[0];
  const z = y[1];
  const x_dot = y[2];
  const z_dot = y[3];
  out[0] = x_dot;
  out[1] = z_dot;
  const matrix = new Float64Array(9);
  const vector = new Float64Array(3);
  matrix[0] = m;
  matrix[1] = 0.0;
  matrix[4] = m;
  matrix[6] = 2.0*x;
  matrix[7] = 2.0*z;
  matrix[8] = 0.0;
  vector[0] = 0.0;
  vector[1] = -m*g;
  vector[2] = -2.0*(x_dot*x_dot + z_dot*z_dot);
  const scales = new Float64Array(3);
  const copy = new Float64Array(9);
  const defect = new Float64Array(3);
  if (!solve_saddle(2, 1, matrix.subarray(0), vector.subarray(0), scales.subarray(0), copy.subarray(0), defect.subarray(0))) return out.fill(NaN);
  out[2] = vector[0];
  out[3] = vector[1];
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/** Mass matrix M(q, t) of M a = f, n by n, by rows. */
export function mass_matrix(t, y, p = DEFAULTS) {
  const out = new Float64Array(4);
  const m = p[0];
  out[0] = m;
  out[1] = 0.0;
  out[3] = m;
  out[2] = out[1];
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/** Forcing f(q, v, t) of M a = f. */
export function forcing(t, y, p = DEFAULTS) {
  const out = new Float64Array(2);
  const m = p[0];
  const g = p[2];
  out[0] = 0.0;
  out[1] = -m*g;
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/** Energy function: the sum of v dL/dv, less L (T + V in most systems). */
export function energy(t, y, p = DEFAULTS) {
  const out = new Float64Array(1);
  const m = p[0];
  const g = p[2];
  const z = y[1];
  const x_dot = y[2];
  const z_dot = y[3];
  out[0] = m*(0.5*(x_dot*x_dot + z_dot*z_dot) + g*z);
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out[0];
}

/** Positions, in the order of the heading. */
export function positions(t, y, p = DEFAULTS) {
  const out = new Float64Array(1);
  out[0] = 0.0;
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/** Time derivatives of the positions. */
export function velocities(t, y, p = DEFAULTS) {
  const out = new Float64Array(1);
  out[0] = 0.0;
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/** Multipliers, in the order of the closures. */
export function multipliers(t, y, p = DEFAULTS) {
  const out = new Float64Array(1);
  const m = p[0];
  const g = p[2];
  const x = y[0];
  const z = y[1];
  const x_dot = y[2];
  const z_dot = y[3];
  const matrix = new Float64Array(9);
  const vector = new Float64Array(3);
  matrix[0] = m;
  matrix[1] = 0.0;
  matrix[4] = m;
  matrix[6] = 2.0*x;
  matrix[7] = 2.0*z;
  matrix[8] = 0.0;
  vector[0] = 0.0;
  vector[1] = -m*g;
  vector[2] = -2.0*(x_dot*x_dot + z_dot*z_dot);
  const scales = new Float64Array(3);
  const copy = new Float64Array(9);
  const defect = new Float64Array(3);
  if (!solve_saddle(2, 1, matrix.subarray(0), vector.subarray(0), scales.subarray(0), copy.subarray(0), defect.subarray(0))) return out.fill(NaN);
  out[0] = vector[2];
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/** Residuals: lhs - rhs of closures of positions, then rates of all closures. */
export function constraints(t, y, p = DEFAULTS) {
  const out = new Float64Array(2);
  const l_ = p[1];
  const x = y[0];
  const z = y[1];
  const x_dot = y[2];
  const z_dot = y[3];
  out[0] = x*x + z*z - l_*l_;
  out[1] = 2.0*(x*x_dot + z*z_dot);
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/** Residuals of closures of positions, then magnitudes of their terms. */
function position_error(t, y, p = DEFAULTS) {
  const out = new Float64Array(2);
  const l_ = p[1];
  const x = y[0];
  const z = y[1];
  const w0 = x*x;
  const w1 = z*z;
  const w2 = l_*l_;
  out[0] = w0 + w1 - w2;
  out[1] = Math.abs(w0) + Math.abs(w1) + Math.abs(w2) + Math.abs(2.0*w0) + Math.abs(2.0*w1);
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/** Squares of the gradients of closures of positions. */
function position_reach(t, y, p = DEFAULTS) {
  const out = new Float64Array(1);
  const m = p[0];
  const x = y[0];
  const z = y[1];
  out[0] = 4.0*(x*x + z*z)/m;
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/** Change of q that leads to the closures, in the metric of the energy. */
function position_change(t, y, p = DEFAULTS) {
  const out = new Float64Array(2);
  const m = p[0];
  const l_ = p[1];
  const x = y[0];
  const z = y[1];
  const matrix = new Float64Array(9);
  const vector = new Float64Array(3);
  matrix[0] = m;
  matrix[1] = 0.0;
  matrix[4] = m;
  matrix[6] = 2.0*x;
  matrix[7] = 2.0*z;
  matrix[8] = 0.0;
  vector[0] = 0.0;
  vector[1] = 0.0;
  vector[2] = -x*x - z*z + l_*l_;
  const scales = new Float64Array(3);
  const copy = new Float64Array(9);
  const defect = new Float64Array(3);
  if (!solve_saddle(2, 1, matrix.subarray(0), vector.subarray(0), scales.subarray(0), copy.subarray(0), defect.subarray(0))) return out.fill(NaN);
  out[0] = vector[0];
  out[1] = vector[1];
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/** Residuals of the rates of closures, then magnitudes of their terms. */
function velocity_error(t, y, p = DEFAULTS) {
  const out = new Float64Array(2);
  const x = y[0];
  const z = y[1];
  const x_dot = y[2];
  const z_dot = y[3];
  const w0 = x*x_dot;
  const w1 = z*z_dot;
  out[0] = 2.0*(w0 + w1);
  out[1] = Math.abs(2.0*w0) + Math.abs(2.0*w1);
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/** Change of v that leads to the closures, in the metric of the energy. */
function velocity_change(t, y, p = DEFAULTS) {
  const out = new Float64Array(2);
  const m = p[0];
  const x = y[0];
  const z = y[1];
  const x_dot = y[2];
  const z_dot = y[3];
  const matrix = new Float64Array(9);
  const vector = new Float64Array(3);
  matrix[0] = m;
  matrix[1] = 0.0;
  matrix[4] = m;
  matrix[6] = 2.0*x;
  matrix[7] = 2.0*z;
  matrix[8] = 0.0;
  vector[0] = 0.0;
  vector[1] = 0.0;
  vector[2] = -2.0*(x*x_dot + z*z_dot);
  const scales = new Float64Array(3);
  const copy = new Float64Array(9);
  const defect = new Float64Array(3);
  if (!solve_saddle(2, 1, matrix.subarray(0), vector.subarray(0), scales.subarray(0), copy.subarray(0), defect.subarray(0))) return out.fill(NaN);
  out[0] = vector[0];
  out[1] = vector[1];
  if (!out.every(Number.isFinite)) return out.fill(NaN);
  return out;
}

/**
 * State led back to the closures, which it leaves in the course of integration: q by the smallest
 * changes in the metric of the kinetic energy, until only rounding is left, then v in the same
 * metric. NaN in a singular configuration, or too far from any state that obeys the closures.
 */
export function project(t, y, p = DEFAULTS) {
  const led = Float64Array.from(y);
  const change = new Float64Array(2);
  const done = lead_positions(2, 1, t, p, led, new Float64Array(2 * 1),
      new Float64Array(1), change) && lead_velocities(2, 1, t, p, led,
      new Float64Array(2 * 1), change);
  return done ? led : led.fill(NaN);
}

/** Names of the results of constraints. */
export const RESIDUALS = ["bob", "rate of bob"];

/** What is wrong with a state at the start, led to the closures; empty if it is rounding alone. */
function violation(stated, led, until, p) {
  if (is_near(2, until - START, stated, led)) return '';
  const residuals = constraints(START, stated, p).map(Math.abs);
  const size = residuals.reduce((largest, x) => Math.max(largest, x), 0);
  const wrong = `the initial state violates the constraints by ${size.toPrecision(3)}`
    + ` (${RESIDUALS[residuals.indexOf(size)]})`;
  if (!led.every(Number.isFinite)) return `${wrong}; no state that obeys them was found near it`;
  const names = [...COORDINATES, ...COORDINATES.map((name) => `dot(${name})`)];
  return `${wrong}; nearest: ${names.map((name, k) => `${name}=${led[k]}`).join(' ')}`;
}


/** State after one classical Runge-Kutta step of size h from time t. */
function stepped(t, h, y, p) {
  const slope = (s, state) => rhs(s, state, p);
  const moved = (k, by) => y.map((value, i) => value + by * k[i]);
  const k1 = slope(t, y);
  const k2 = slope(t + h / 2, moved(k1, h / 2));
  const k3 = slope(t + h / 2, moved(k2, h / 2));
  const k4 = slope(t + h, moved(k3, h));
  const next = y.map((value, i) => value + h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]));
  return project(t + h, next, p);
}

/** State after so many classical Runge-Kutta steps of fixed size from t to until. */
export function integrate(y, t, until, steps, p = DEFAULTS) {
  const h = (until - t) / steps;
  for (let k = 0; k < steps; ++k) {
    y = stepped(t + k * h, h, y, p);
  }
  return y;
}

/**
 * Integrate from INITIAL and print CSV; NAME=VALUE sets parameters and initial values, until=T and
 * steps=N (steps in an interval) the run. Returns an error message, empty if there is none.
 */
export function main(given) {
  const state = [...COORDINATES, ...COORDINATES.map((name) => `dot(${name})`)];
  const names = [...state, ...PARAMETERS, 'until', 'steps'];
  const values = [...(INITIAL ?? state.map(() => null)), ...DEFAULTS, UNTIL, STEPS];
  for (const argument of given) {
    const [name, text, ...more] = argument.split('=');
    const place = names.indexOf(name);
    const number = text && text.trim() && !more.length ? Number(text) : NaN;
    const isCount = Number.isInteger(number) && number > 0;
    if (place < 0 || !Number.isFinite(number) || (place === names.length - 1 && !isCount)) {
      return `${argument}: not NAME=NUMBER with a known name`;
    }
    values[place] = number;
  }
  const missing = names.filter((_, k) => values[k] === null);
  if (missing.length) {
    return `values needed: ${missing.map((name) => `${name}=VALUE`).join(', ')}`;
  }
  const [until, steps] = values.slice(-2);
  let y = Float64Array.from(values.slice(0, state.length));
  const p = values.slice(state.length, -2);
  const stated = y;
  y = project(START, y, p);
  const wrong = violation(stated, y, until, p);
  if (wrong) return wrong;
  console.log(['t', ...state].join(','));
  for (let row = 0; row <= ROWS; ++row) {
    const t = START + (until - START) * (row / ROWS);
    console.log([t, ...y].join(','));
    if (row < ROWS) {
      const next = START + (until - START) * ((row + 1) / ROWS);
      y = integrate(y, t, next, steps, p);
    }
    if (!y.every(Number.isFinite)) {
      return `stopped after t = ${t}: singular, or a result is not finite`;
    }
  }
  return '';
}

if (typeof process === 'object' && process.argv[1] && import.meta.url.endsWith(
    `/${encodeURIComponent(process.argv[1].split(/[\\/]/).pop())}`)) {
  process.stdout.on('error', (error) => {
    console.error(`the table could not be written: ${error.message}`);
    process.exitCode = 1;
  });
  const problem = main(process.argv.slice(2));
  if (problem) {
    console.error(problem);
    process.exitCode = 1;
  }
}
