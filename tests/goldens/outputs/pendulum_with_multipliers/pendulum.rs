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
//
// Functions return Err where there is no result. Nothing is allocated; local arrays take up to 216
// bytes of the stack.
//
// A crate without std has sin and the like from libm. In its Cargo.toml:
//   [features]
//   libm = ["dep:libm"]
//   [dependencies]
//   libm = { version = "0.2", optional = true }
// With the feature libm this file needs nothing but core and that crate, else std.
#![allow(dead_code, non_snake_case, unused_mut, clippy::all)]

#[cfg(feature = "libm")]
use libm as math;

#[cfg(not(feature = "libm"))]
mod math {
    pub fn sqrt(x: f64) -> f64 { x.sqrt() }
    pub fn fabs(x: f64) -> f64 { x.abs() }
}

/// Number of coordinates; the state y holds them, then their velocities.
pub const N: usize = 2;
/// Coordinates, in their order.
pub const COORDINATES: [&str; 2] = [
    "x",
    "z",
];
/// Parameters, in their order.
pub const PARAMETERS: [&str; 3] = [
    "m",
    "l",
    "g",
];
/// Initial state of the scene.
pub const INITIAL: [f64; 4] = [0.9092974268256817, 0.4161468365471424, 0.0, 0.0];

/// Parameters of the system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    /// `m [kg]: mass of the bob`
    pub m: f64,
    /// `l [m]: length of the rod`
    pub l_: f64,
    /// `g [m/s^2]: gravitational acceleration`
    pub g: f64,
}

/// Parameters as the scene has them; NaN stands for values that must be given.
pub const DEFAULTS: Params = Params {
    m: 1.0,
    l_: 1.0,
    g: 9.81,
};

impl Default for Params {
    fn default() -> Self {
        DEFAULTS
    }
}

/// Why a function has no result; what it has written is then meaningless.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The mass matrix is singular, or no accelerations and multipliers are determined.
    Singular,
    /// A result is not a finite number.
    NotFinite,
}

impl core::fmt::Display for Failure {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Failure::Singular => "the mass matrix is singular",
            Failure::NotFinite => "a result is not finite",
        })
    }
}

/// Tell whether a state of n coordinates obeys closures, but for rounding of its numbers.
///
/// y is the state led back to them, span the duration of a run: velocities that move no coordinate
/// by more than rounding in it are none.
fn is_near(n: usize, span: f64, stated: &[f64], y: &[f64]) -> bool {
    let mut place: f64 = 0.0;
    let mut rate: f64 = 0.0;
    for i in 0..n {
        if math::fabs(stated[i]) > place {
            place = math::fabs(stated[i]);
        }
        if math::fabs(stated[n + i]) > rate {
            rate = math::fabs(stated[n + i]);
        }
    }
    let mut bound: f64 = 1e-09*rate;
    if span != 0.0 {
        bound += 7.105427357601002e-15*place/math::fabs(span);
    }
    for i in 0..n {
        if !(math::fabs(y[i] - stated[i]) <= 1e-09*place) {
            return false;
        }
        if !(math::fabs(y[n + i] - stated[n + i]) <= bound) {
            return false;
        }
    }
    return true;
}

/// Return the largest power of two that is not above x, or the smallest normal number.
fn power_of_two(x: f64) -> f64 {
    let mut power: f64 = 1.0;
    while power > x && power > 2.2250738585072014e-308 {
        power *= 0.5;
    }
    while power < 0.5*x {
        power *= 2.0;
    }
    if 2.0*power <= x {
        power *= 2.0;
    }
    return power;
}

/// Return the largest of m residuals, in units of the last place of the magnitude m behind.
fn residual(m: usize, error: &[f64]) -> f64 {
    let mut largest: f64 = 0.0;
    for k in 0..m {
        let size: f64 = math::fabs(error[k])/(2.0*1.1102230246251565e-16*power_of_two(error[m +
            k]));
        if size > largest {
            largest = size;
        }
    }
    return largest;
}

/// Return the same where changes of all coordinates are found, and rounded, together.
///
/// The magnitude of one residual counts for another as far as a change of the coordinates that
/// makes the one does the other: square holds the squares of their gradients. A residual that is
/// the difference of nothing (a height that is zero) has no magnitude of its own.
fn coupled_residual(m: usize, error: &mut [f64], square: &[f64]) -> f64 {
    let mut reach: f64 = 0.0;
    for k in 0..m {
        if square[k] > 0.0 {
            let length: f64 = error[m + k]/math::sqrt(square[k]);
            if length > reach {
                reach = length;
            }
        }
    }
    for k in 0..m {
        let magnitude: f64 = reach*math::sqrt(square[k]);
        if magnitude > error[m + k] && magnitude <= 1.7976931348623157e+308 {
            error[m + k] = magnitude;
        }
    }
    return residual(m, error);
}

/// Lead n coordinates back to m closures of positions, by the smallest changes.
///
/// Their metric is the kinetic energy. Newton's method goes on until only rounding is left, or
/// little more that no change makes smaller. The arrays behind y are overwritten. Tell whether the
/// closures hold; else the configuration is singular, or too far from any that obeys them.
fn lead_positions(n: usize, m: usize, t: f64, p: &Params, y: &mut [f64],
    error: &mut [f64], square: &mut [f64], change: &mut [f64]) -> bool {
    let mut last: f64 = 0.0;
    for number in 0..50 + 1 {
        if !position_error(t, y, p, error).is_ok() {
            return false;
        }
        let mut size: f64 = residual(m, error);
        if size <= 1.0 {
            return true;
        }
        if number > 0 {
            if !position_reach(t, y, p, square).is_ok() {
                return false;
            }
            size = coupled_residual(m, error, square);
            if size <= 1.0 {
                return true;
            }
            if size <= 1024.0 && 2.0*size > last {
                return true;
            }
        }
        last = size;
        if !position_change(t, y, p, change).is_ok() {
            return false;
        }
        for i in 0..n {
            y[i] += change[i];
        }
    }
    return false;
}

/// Lead the velocities of n coordinates back to m closures, in the same metric.
///
/// The arrays behind y are overwritten. Tell whether the closures hold.
fn lead_velocities(n: usize, m: usize, t: f64, p: &Params, y: &mut [f64],
    error: &mut [f64], change: &mut [f64]) -> bool {
    if !velocity_error(t, y, p, error).is_ok() {
        return false;
    }
    if !(residual(m, error) <= 1.0) {
        if !velocity_change(t, y, p, change).is_ok() {
            return false;
        }
        for i in 0..n {
            y[n + i] += change[i];
        }
    }
    return true;
}

/// Return the power of two that brings a positive number to between 1/2 and 1.
fn scale_of(x: f64) -> f64 {
    return 0.5/power_of_two(x);
}

/// Tell whether elimination leaves little of the inertia of a coordinate.
///
/// c is overwritten. Coordinates without any inertia do not count.
fn is_uneven(n: usize, s: usize, a: &[f64], c: &mut [f64]) -> bool {
    for i in 0..n {
        for j in 0..n {
            c[i*n + j] = a[i*s + j];
        }
    }
    for k in 0..n {
        let row: usize = k*n;
        let inertia: f64 = a[k*s + k];
        if inertia > 7.888609052210118e-31 {
            if !(c[row + k] > 0.00390625*inertia) {
                return true;
            }
        } else {
            for i in 0..n {
                if i != k && a[i*s + k] != 0.0 {
                    return true;
                }
            }
        }
        for i in k + 1..n {
            if c[row + i] != 0.0 {
                let ratio: f64 = c[row + i]/c[row + k];
                for j in i..n {
                    c[i*n + j] -= ratio*c[row + j];
                }
            }
        }
    }
    return false;
}

/// Return the power of two whose square brings a positive number to between 1/4 and 1.
fn root_scale_of(x: f64) -> f64 {
    return scale_of(math::sqrt(x));
}

/// Store factors d of the n coordinates for the matrix of solve_saddle.
///
/// They are one over the root of the inertia, or of w g^2 where that is more, for the gradient g
/// of each closure. w is the second smallest inertia over g^2 that it meets, if there are two: a
/// coordinate that a closure holds need not have inertia at every state. 0 without either.
fn scale_inertia(n: usize, s: usize, a: &[f64], d: &mut [f64]) {
    for j in 0..n {
        d[j] = 0.0;
        if a[j*s + j] != 0.0 {
            d[j] = power_of_two(math::fabs(a[j*s + j]));
        }
    }
    for i in n..s {
        let mut first: f64 = 2.535301200456459e+30;
        let mut second: f64 = 2.535301200456459e+30;
        let mut count: usize = 0;
        for j in 0..n {
            if a[i*s + j] != 0.0 && a[j*s + j] != 0.0 {
                let gradient: f64 = power_of_two(math::fabs(a[i*s + j]));
                let inertia: f64 = power_of_two(math::fabs(a[j*s + j]));
                let mut ratio: f64 = 2.535301200456459e+30;
                if gradient*2.535301200456459e+30*gradient > inertia {
                    ratio = inertia/gradient/gradient;
                }
                if ratio < first {
                    second = first;
                    first = ratio;
                } else if ratio < second {
                    second = ratio;
                }
                count += 1;
            }
        }
        if count == 1 {
            second = first;
        }
        for j in 0..n {
            if count > 0 && a[i*s + j] != 0.0 {
                let gradient: f64 = power_of_two(math::fabs(a[i*s + j]));
                let size: f64 = gradient*second*gradient;
                if size > d[j] {
                    d[j] = size;
                }
            }
        }
    }
    for j in 0..n {
        if d[j] > 0.0 {
            d[j] = root_scale_of(d[j]);
        }
    }
}

/// Equilibrate a symmetric matrix of s rows by powers of two (Bunch, J. ACM 18 (1971) 566).
///
/// a[i,j] d[i] d[j] is not small throughout a row. Rows of which d is 0 start from the diagonal,
/// or follow from those that they touch. A row of zeros has no scale.
fn equilibrate(s: usize, a: &[f64], d: &mut [f64]) -> bool {
    let mut left: usize = 0;
    for i in 0..s {
        if !(d[i] > 0.0) {
            left += 1;
        }
    }
    let mut before: usize = s + 1;
    while left > 0 {
        let mut stuck: bool = left == before;
        before = left;
        for i in 0..s {
            if !(d[i] > 0.0) {
                let mut size: f64 = math::sqrt(math::fabs(a[i*s + i]));
                for j in 0..s {
                    let mut entry: f64 = math::fabs(a[i*s + j]);
                    if !stuck {
                        entry *= d[j];
                    }
                    if entry > size {
                        size = entry;
                    }
                }
                if size > 0.0 {
                    d[i] = scale_of(size);
                    if stuck {
                        d[i] = 1.0;
                    }
                    stuck = false;
                    left -= 1;
                }
            }
        }
        if stuck {
            return false;
        }
    }
    return true;
}

/// Solve a x = b for n unknowns by elimination with partial pivoting; x replaces b.
fn solve_pivoted(n: usize, a: &mut [f64], b: &mut [f64]) -> bool {
    for j in 0..n {
        let row: usize = j*n;
        let mut best: usize = j;
        for i in j + 1..n {
            if math::fabs(a[i*n + j]) > math::fabs(a[best*n + j]) {
                best = i;
            }
        }
        if !(math::fabs(a[best*n + j]) > 0.0) {
            return false;
        }
        if best != j {
            let mut swap: f64 = b[j];
            b[j] = b[best];
            b[best] = swap;
            for k in j..n {
                swap = a[row + k];
                a[row + k] = a[best*n + k];
                a[best*n + k] = swap;
            }
        }
        for i in j + 1..n {
            let below: usize = i*n;
            let ratio: f64 = a[below + j]/a[row + j];
            for k in j + 1..n {
                a[below + k] -= ratio*a[row + k];
            }
            b[i] -= ratio*b[j];
        }
    }
    for i in (0..n).rev() {
        let mut value: f64 = b[i];
        for k in i + 1..n {
            value -= a[i*n + k]*b[k];
        }
        b[i] = value/a[i*n + i];
    }
    return true;
}

/// Solve M x = f + G^T l, G x + C l = g for n numbers x and m numbers l.
///
/// Of the matrix [M, G^T; G, C] by rows, the upper triangle of M, the rows of G and the diagonal
/// C are given: C is 0, or 1 where a row of G and g are zero, which makes that number of l zero.
/// [x; l] replaces [f; g] in b; scales d, a copy of the matrix and the defect of the solution are
/// overwritten. Units do not matter: M is divided by its size, and rows and columns are scaled
/// alike, all by powers of two. Then comes elimination with pivoting; where M is nearly singular
/// the solution is refined once, so that every row holds to the rounding of its own terms (Skeel,
/// Math. Comput. 35 (1980) 817).
fn solve_saddle(n: usize, m: usize, a: &mut [f64], b: &mut [f64], d: &mut [f64],
    copy: &mut [f64], defect: &mut [f64]) -> bool {
    let s: usize = n + m;
    let mut size: f64 = 0.0;
    let mut unit: f64 = 1.0;
    for i in 0..n {
        for j in i..n {
            if math::fabs(a[i*s + j]) > size {
                size = math::fabs(a[i*s + j]);
            }
        }
    }
    if size > 0.0 {
        unit = scale_of(size);
    }
    for i in 0..s {
        for j in i..s {
            if j < n {
                a[i*s + j] *= unit;
            } else if i < n {
                a[i*s + j] = a[j*s + i];
            } else if i < j {
                a[i*s + j] = 0.0;
            }
            a[j*s + i] = a[i*s + j];
        }
        if i < n {
            b[i] *= unit;
        }
        d[i] = 0.0;
    }
    let uneven: bool = is_uneven(n, s, a, copy);
    if uneven {
        scale_inertia(n, s, a, d);
    }
    if !equilibrate(s, a, d) {
        return false;
    }
    for i in 0..s {
        for j in 0..s {
            a[i*s + j] = a[i*s + j]*d[i]*d[j];
            copy[i*s + j] = a[i*s + j];
        }
        b[i] *= d[i];
        defect[i] = b[i];
    }
    if !solve_pivoted(s, a, b) {
        return false;
    }
    if uneven {
        for i in 0..s {
            for j in 0..s {
                defect[i] -= copy[i*s + j]*b[j];
            }
        }
        if !solve_pivoted(s, copy, defect) {
            return false;
        }
    }
    for i in 0..s {
        if !(math::fabs(a[i*s + i]) > f64::from(s as u32)*1.1102230246251565e-16) {
            return false;
        }
        if uneven {
            b[i] += defect[i];
        }
        b[i] *= d[i];
        if i >= n {
            b[i] /= -unit;
        }
    }
    return true;
}

/// State derivative [v, a].
pub fn rhs(t: f64, y: &[f64; 4], p: &Params, out: &mut [f64; 4]) -> Result<(), Failure> {
    let _ = t;
    let m = p.m;
    let g = p.g;
    let x = y[0];
    let z = y[1];
    let x_dot = y[2];
    let z_dot = y[3];
    out[0] = x_dot;
    out[1] = z_dot;
    let mut matrix = [0.0_f64; 9];
    let mut vector = [0.0_f64; 3];
    matrix[0] = m;
    matrix[1] = 0.0;
    matrix[4] = m;
    matrix[6] = 2.0*x;
    matrix[7] = 2.0*z;
    matrix[8] = 0.0;
    vector[0] = 0.0;
    vector[1] = -m*g;
    vector[2] = -2.0*(x_dot*x_dot + z_dot*z_dot);
    let mut scales = [0.0_f64; 3];
    let mut copy = [0.0_f64; 9];
    let mut defect = [0.0_f64; 3];
    if !(solve_saddle(2, 1, &mut matrix, &mut vector, &mut scales, &mut copy, &mut defect)) {
        return Err(Failure::Singular);
    }
    out[2] = vector[0];
    out[3] = vector[1];
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Mass matrix M(q, t) of M a = f, n by n, by rows.
pub fn mass_matrix(t: f64, y: &[f64; 4], p: &Params, out: &mut [f64; 4]) -> Result<(), Failure> {
    let _ = t;
    let _ = y;
    let m = p.m;
    out[0] = m;
    out[1] = 0.0;
    out[3] = m;
    out[2] = out[1];
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Forcing f(q, v, t) of M a = f.
pub fn forcing(t: f64, y: &[f64; 4], p: &Params, out: &mut [f64; 2]) -> Result<(), Failure> {
    let _ = t;
    let _ = y;
    let m = p.m;
    let g = p.g;
    out[0] = 0.0;
    out[1] = -m*g;
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Energy function: the sum of v dL/dv, less L (T + V in most systems).
pub fn energy(t: f64, y: &[f64; 4], p: &Params) -> Result<f64, Failure> {
    let mut out = [0.0_f64; 1];
    let _ = t;
    let m = p.m;
    let g = p.g;
    let z = y[1];
    let x_dot = y[2];
    let z_dot = y[3];
    out[0] = m*(0.5*(x_dot*x_dot + z_dot*z_dot) + g*z);
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(out[0])
}

/// Positions, in the order of the heading.
pub fn positions(t: f64, y: &[f64; 4], p: &Params, out: &mut [f64; 1]) -> Result<(), Failure> {
    let _ = t;
    let _ = y;
    let _ = p;
    out[0] = 0.0;
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Time derivatives of the positions.
pub fn velocities(t: f64, y: &[f64; 4], p: &Params, out: &mut [f64; 1]) -> Result<(), Failure> {
    let _ = t;
    let _ = y;
    let _ = p;
    out[0] = 0.0;
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Multipliers, in the order of the closures.
pub fn multipliers(t: f64, y: &[f64; 4], p: &Params, out: &mut [f64; 1]) -> Result<(), Failure> {
    let _ = t;
    let m = p.m;
    let g = p.g;
    let x = y[0];
    let z = y[1];
    let x_dot = y[2];
    let z_dot = y[3];
    let mut matrix = [0.0_f64; 9];
    let mut vector = [0.0_f64; 3];
    matrix[0] = m;
    matrix[1] = 0.0;
    matrix[4] = m;
    matrix[6] = 2.0*x;
    matrix[7] = 2.0*z;
    matrix[8] = 0.0;
    vector[0] = 0.0;
    vector[1] = -m*g;
    vector[2] = -2.0*(x_dot*x_dot + z_dot*z_dot);
    let mut scales = [0.0_f64; 3];
    let mut copy = [0.0_f64; 9];
    let mut defect = [0.0_f64; 3];
    if !(solve_saddle(2, 1, &mut matrix, &mut vector, &mut scales, &mut copy, &mut defect)) {
        return Err(Failure::Singular);
    }
    out[0] = vector[2];
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Residuals: lhs - rhs of closures of positions, then rates of all closures.
pub fn constraints(t: f64, y: &[f64; 4], p: &Params, out: &mut [f64; 2]) -> Result<(), Failure> {
    let _ = t;
    let l_ = p.l_;
    let x = y[0];
    let z = y[1];
    let x_dot = y[2];
    let z_dot = y[3];
    out[0] = x*x + z*z - l_*l_;
    out[1] = 2.0*(x*x_dot + z*z_dot);
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Residuals of closures of positions, then magnitudes of their terms.
fn position_error(t: f64, y: &[f64], p: &Params, out: &mut [f64]) -> Result<(), Failure> {
    let _ = t;
    let l_ = p.l_;
    let x = y[0];
    let z = y[1];
    let w0 = x*x;
    let w1 = z*z;
    let w2 = l_*l_;
    out[0] = w0 + w1 - w2;
    out[1] = math::fabs(w0) + math::fabs(w1) + math::fabs(w2) + math::fabs(2.0*w0) +
        math::fabs(2.0*w1);
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Squares of the gradients of closures of positions.
fn position_reach(t: f64, y: &[f64], p: &Params, out: &mut [f64]) -> Result<(), Failure> {
    let _ = t;
    let m = p.m;
    let x = y[0];
    let z = y[1];
    out[0] = 4.0*(x*x + z*z)/m;
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Change of q that leads to the closures, in the metric of the energy.
fn position_change(t: f64, y: &[f64], p: &Params, out: &mut [f64]) -> Result<(), Failure> {
    let _ = t;
    let m = p.m;
    let l_ = p.l_;
    let x = y[0];
    let z = y[1];
    let mut matrix = [0.0_f64; 9];
    let mut vector = [0.0_f64; 3];
    matrix[0] = m;
    matrix[1] = 0.0;
    matrix[4] = m;
    matrix[6] = 2.0*x;
    matrix[7] = 2.0*z;
    matrix[8] = 0.0;
    vector[0] = 0.0;
    vector[1] = 0.0;
    vector[2] = -x*x - z*z + l_*l_;
    let mut scales = [0.0_f64; 3];
    let mut copy = [0.0_f64; 9];
    let mut defect = [0.0_f64; 3];
    if !(solve_saddle(2, 1, &mut matrix, &mut vector, &mut scales, &mut copy, &mut defect)) {
        return Err(Failure::Singular);
    }
    out[0] = vector[0];
    out[1] = vector[1];
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Residuals of the rates of closures, then magnitudes of their terms.
fn velocity_error(t: f64, y: &[f64], p: &Params, out: &mut [f64]) -> Result<(), Failure> {
    let _ = t;
    let _ = p;
    let x = y[0];
    let z = y[1];
    let x_dot = y[2];
    let z_dot = y[3];
    let w0 = x*x_dot;
    let w1 = z*z_dot;
    out[0] = 2.0*(w0 + w1);
    out[1] = math::fabs(2.0*w0) + math::fabs(2.0*w1);
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Change of v that leads to the closures, in the metric of the energy.
fn velocity_change(t: f64, y: &[f64], p: &Params, out: &mut [f64]) -> Result<(), Failure> {
    let _ = t;
    let m = p.m;
    let x = y[0];
    let z = y[1];
    let x_dot = y[2];
    let z_dot = y[3];
    let mut matrix = [0.0_f64; 9];
    let mut vector = [0.0_f64; 3];
    matrix[0] = m;
    matrix[1] = 0.0;
    matrix[4] = m;
    matrix[6] = 2.0*x;
    matrix[7] = 2.0*z;
    matrix[8] = 0.0;
    vector[0] = 0.0;
    vector[1] = 0.0;
    vector[2] = -2.0*(x*x_dot + z*z_dot);
    let mut scales = [0.0_f64; 3];
    let mut copy = [0.0_f64; 9];
    let mut defect = [0.0_f64; 3];
    if !(solve_saddle(2, 1, &mut matrix, &mut vector, &mut scales, &mut copy, &mut defect)) {
        return Err(Failure::Singular);
    }
    out[0] = vector[0];
    out[1] = vector[1];
    if !out.iter().all(|x| x.is_finite()) {
        return Err(Failure::NotFinite);
    }
    Ok(())
}

/// Lead a state back to the closures, which it leaves in the course of integration: q by the
/// smallest changes in the metric of the kinetic energy, until only rounding is left, then v in
/// the same metric.
pub fn project(t: f64, y: &mut [f64; 2 * N], p: &Params) -> Result<(), Failure> {
    let mut error = [0.0; 2 * 1];
    let mut change = [0.0; N];
    let led = lead_positions(N, 1, t, p, y, &mut error[..2 * 1], &mut [0.0; 1], &mut change) &&
        lead_velocities(N, 1, t, p, y, &mut error, &mut change);
    if led {
        Ok(())
    } else {
        Err(Failure::Singular)
    }
}
