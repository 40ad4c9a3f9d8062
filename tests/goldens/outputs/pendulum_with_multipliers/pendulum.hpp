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
// C++17. Functions are templates over the number type T: float, double, long double, or any
// type with arithmetic and functions of its own, such as dual numbers that differentiate. They
// return NaN where the mass matrix is singular. They allocate nothing and throw nothing.

#ifndef LAGRANGE_pendulum_HPP
#define LAGRANGE_pendulum_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace pendulum {

namespace detail {

/// Quotient of two integers, correctly rounded in the number type.
template <class T>
constexpr T ratio(double a, double b)
{
    return T(a)/T(b);
}

/// Half the distance from 1 to the next number; that of double for types that do not tell theirs.
template <class T>
T rounding()
{
    using limits = std::numeric_limits<T>;
    return limits::is_specialized ? limits::epsilon()/T(2) : T(0x1p-53);
}

/// NaN for every result.
template <class T, std::size_t N>
std::array<T, N> undefined(std::array<T, N> out)
{
    out.fill(T(std::numeric_limits<double>::quiet_NaN()));
    return out;
}

} // namespace detail

/// Number of coordinates; the state y holds them, then their velocities.
inline constexpr std::size_t dof = 2;
template <class T>
using State = std::array<T, 2*dof>;
/// Coordinates, in their order.
inline constexpr std::array<const char*, 2> coordinate_names{
    "x",
    "z",
};
/// Parameters, in their order.
inline constexpr std::array<const char*, 3> parameter_names{
    "m",
    "l",
    "g",
};
/// Initial state of the scene.
inline constexpr std::array<double, 4> initial_state{0.9092974268256817,
    0.4161468365471424, 0.0, 0.0};

/// Parameters as the scene has them; NaN stands for values that must be given.
template <class T>
struct Params {
    T m = T(1.0); // m [kg]: mass of the bob
    T l_ = T(1.0); // l [m]: length of the rod
    T g = T(9.81); // g [m/s^2]: gravitational acceleration
};

/// Tell whether a state of n coordinates obeys closures, but for rounding of its numbers.
///
/// y is the state led back to them, span the duration of a run: velocities that move no coordinate
/// by more than rounding in it are none.
template <class T>
bool is_near(std::size_t n, T span, const T* stated, const T* y)
{
    using std::abs;
    using std::sqrt;
    T place = T(0.0);
    T rate = T(0.0);
    for (std::size_t i = 0; i < n; ++i) {
        if (abs(stated[i]) > place) {
            place = abs(stated[i]);
        }
        if (abs(stated[n + i]) > rate) {
            rate = abs(stated[n + i]);
        }
    }
    T bound = T(1e-09)*rate;
    if (span != T(0.0)) {
        bound += T(7.105427357601002e-15)*place/abs(span);
    }
    for (std::size_t i = 0; i < n; ++i) {
        if (!(abs(y[i] - stated[i]) <= T(1e-09)*place)) {
            return false;
        }
        if (!(abs(y[n + i] - stated[n + i]) <= bound)) {
            return false;
        }
    }
    return true;
}

/// Return the largest power of two that is not above x, or the smallest normal number.
template <class T>
T power_of_two(T x)
{
    using std::abs;
    using std::sqrt;
    T power = T(1.0);
    while (power > x && power > T(2.2250738585072014e-308)) {
        power *= T(0.5);
    }
    while (power < T(0.5)*x) {
        power *= T(2.0);
    }
    if (T(2.0)*power <= x) {
        power *= T(2.0);
    }
    return power;
}

/// Return the largest of m residuals, in units of the last place of the magnitude m behind.
template <class T>
T residual(std::size_t m, const T* error)
{
    using std::abs;
    using std::sqrt;
    T largest = T(0.0);
    for (std::size_t k = 0; k < m; ++k) {
        const T size = abs(error[k])/(T(2.0)*detail::rounding<T>()*power_of_two(error[m + k]));
        if (size > largest) {
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
template <class T>
T coupled_residual(std::size_t m, T* error, const T* square)
{
    using std::abs;
    using std::sqrt;
    T reach = T(0.0);
    for (std::size_t k = 0; k < m; ++k) {
        if (square[k] > T(0.0)) {
            const T length = error[m + k]/sqrt(square[k]);
            if (length > reach) {
                reach = length;
            }
        }
    }
    for (std::size_t k = 0; k < m; ++k) {
        const T magnitude = reach*sqrt(square[k]);
        if (magnitude > error[m + k] && magnitude <= T(1.7976931348623157e+308)) {
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
template <class T>
bool lead_positions(std::size_t n, std::size_t m, T t, const Params<T>& p, T* y,
    T* error, T* square, T* change)
{
    using std::abs;
    using std::sqrt;
    T last = T(0.0);
    for (std::size_t number = 0; number < 50 + 1; ++number) {
        if (!position_error(t, y, p, error)) {
            return false;
        }
        T size = residual(m, error);
        if (size <= T(1.0)) {
            return true;
        }
        if (number > 0) {
            if (!position_reach(t, y, p, square)) {
                return false;
            }
            size = coupled_residual(m, error, square);
            if (size <= T(1.0)) {
                return true;
            }
            if (size <= T(1024.0) && T(2.0)*size > last) {
                return true;
            }
        }
        last = size;
        if (!position_change(t, y, p, change)) {
            return false;
        }
        for (std::size_t i = 0; i < n; ++i) {
            y[i] += change[i];
        }
    }
    return false;
}

/// Lead the velocities of n coordinates back to m closures, in the same metric.
///
/// The arrays behind y are overwritten. Tell whether the closures hold.
template <class T>
bool lead_velocities(std::size_t n, std::size_t m, T t, const Params<T>& p, T* y,
    T* error, T* change)
{
    using std::abs;
    using std::sqrt;
    if (!velocity_error(t, y, p, error)) {
        return false;
    }
    if (!(residual(m, error) <= T(1.0))) {
        if (!velocity_change(t, y, p, change)) {
            return false;
        }
        for (std::size_t i = 0; i < n; ++i) {
            y[n + i] += change[i];
        }
    }
    return true;
}

/// Return the power of two that brings a positive number to between 1/2 and 1.
template <class T>
T scale_of(T x)
{
    using std::abs;
    using std::sqrt;
    return T(0.5)/power_of_two(x);
}

/// Tell whether elimination leaves little of the inertia of a coordinate.
///
/// c is overwritten. Coordinates without any inertia do not count.
template <class T>
bool is_uneven(std::size_t n, std::size_t s, const T* a, T* c)
{
    using std::abs;
    using std::sqrt;
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) {
            c[i*n + j] = a[i*s + j];
        }
    }
    for (std::size_t k = 0; k < n; ++k) {
        const std::size_t row = k*n;
        const T inertia = a[k*s + k];
        if (inertia > T(7.888609052210118e-31)) {
            if (!(c[row + k] > T(0.00390625)*inertia)) {
                return true;
            }
        } else {
            for (std::size_t i = 0; i < n; ++i) {
                if (i != k && a[i*s + k] != T(0.0)) {
                    return true;
                }
            }
        }
        for (std::size_t i = k + 1; i < n; ++i) {
            if (c[row + i] != T(0.0)) {
                const T ratio = c[row + i]/c[row + k];
                for (std::size_t j = i; j < n; ++j) {
                    c[i*n + j] -= ratio*c[row + j];
                }
            }
        }
    }
    return false;
}

/// Return the power of two whose square brings a positive number to between 1/4 and 1.
template <class T>
T root_scale_of(T x)
{
    using std::abs;
    using std::sqrt;
    return scale_of(sqrt(x));
}

/// Store factors d of the n coordinates for the matrix of solve_saddle.
///
/// They are one over the root of the inertia, or of w g^2 where that is more, for the gradient g
/// of each closure. w is the second smallest inertia over g^2 that it meets, if there are two: a
/// coordinate that a closure holds need not have inertia at every state. 0 without either.
template <class T>
void scale_inertia(std::size_t n, std::size_t s, const T* a, T* d)
{
    using std::abs;
    using std::sqrt;
    for (std::size_t j = 0; j < n; ++j) {
        d[j] = T(0.0);
        if (a[j*s + j] != T(0.0)) {
            d[j] = power_of_two(abs(a[j*s + j]));
        }
    }
    for (std::size_t i = n; i < s; ++i) {
        T first = T(2.535301200456459e+30);
        T second = T(2.535301200456459e+30);
        std::size_t count = 0;
        for (std::size_t j = 0; j < n; ++j) {
            if (a[i*s + j] != T(0.0) && a[j*s + j] != T(0.0)) {
                const T gradient = power_of_two(abs(a[i*s + j]));
                const T inertia = power_of_two(abs(a[j*s + j]));
                T ratio = T(2.535301200456459e+30);
                if (gradient*T(2.535301200456459e+30)*gradient > inertia) {
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
        for (std::size_t j = 0; j < n; ++j) {
            if (count > 0 && a[i*s + j] != T(0.0)) {
                const T gradient = power_of_two(abs(a[i*s + j]));
                const T size = gradient*second*gradient;
                if (size > d[j]) {
                    d[j] = size;
                }
            }
        }
    }
    for (std::size_t j = 0; j < n; ++j) {
        if (d[j] > T(0.0)) {
            d[j] = root_scale_of(d[j]);
        }
    }
}

/// Equilibrate a symmetric matrix of s rows by powers of two (Bunch, J. ACM 18 (1971) 566).
///
/// a[i,j] d[i] d[j] is not small throughout a row. Rows of which d is 0 start from the diagonal,
/// or follow from those that they touch. A row of zeros has no scale.
template <class T>
bool equilibrate(std::size_t s, const T* a, T* d)
{
    using std::abs;
    using std::sqrt;
    std::size_t left = 0;
    for (std::size_t i = 0; i < s; ++i) {
        if (!(d[i] > T(0.0))) {
            left += 1;
        }
    }
    std::size_t before = s + 1;
    while (left > 0) {
        bool stuck = left == before;
        before = left;
        for (std::size_t i = 0; i < s; ++i) {
            if (!(d[i] > T(0.0))) {
                T size = sqrt(abs(a[i*s + i]));
                for (std::size_t j = 0; j < s; ++j) {
                    T entry = abs(a[i*s + j]);
                    if (!stuck) {
                        entry *= d[j];
                    }
                    if (entry > size) {
                        size = entry;
                    }
                }
                if (size > T(0.0)) {
                    d[i] = scale_of(size);
                    if (stuck) {
                        d[i] = T(1.0);
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

/// Solve a x = b for n unknowns by elimination with partial pivoting; x replaces b.
template <class T>
bool solve_pivoted(std::size_t n, T* a, T* b)
{
    using std::abs;
    using std::sqrt;
    for (std::size_t j = 0; j < n; ++j) {
        const std::size_t row = j*n;
        std::size_t best = j;
        for (std::size_t i = j + 1; i < n; ++i) {
            if (abs(a[i*n + j]) > abs(a[best*n + j])) {
                best = i;
            }
        }
        if (!(abs(a[best*n + j]) > T(0.0))) {
            return false;
        }
        if (best != j) {
            T swap = b[j];
            b[j] = b[best];
            b[best] = swap;
            for (std::size_t k = j; k < n; ++k) {
                swap = a[row + k];
                a[row + k] = a[best*n + k];
                a[best*n + k] = swap;
            }
        }
        for (std::size_t i = j + 1; i < n; ++i) {
            const std::size_t below = i*n;
            const T ratio = a[below + j]/a[row + j];
            for (std::size_t k = j + 1; k < n; ++k) {
                a[below + k] -= ratio*a[row + k];
            }
            b[i] -= ratio*b[j];
        }
    }
    for (std::size_t i = n; i-- > 0;) {
        T value = b[i];
        for (std::size_t k = i + 1; k < n; ++k) {
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
template <class T>
bool solve_saddle(std::size_t n, std::size_t m, T* a, T* b, T* d, T* copy, T* defect)
{
    using std::abs;
    using std::sqrt;
    const std::size_t s = n + m;
    T size = T(0.0);
    T unit = T(1.0);
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = i; j < n; ++j) {
            if (abs(a[i*s + j]) > size) {
                size = abs(a[i*s + j]);
            }
        }
    }
    if (size > T(0.0)) {
        unit = scale_of(size);
    }
    for (std::size_t i = 0; i < s; ++i) {
        for (std::size_t j = i; j < s; ++j) {
            if (j < n) {
                a[i*s + j] *= unit;
            } else if (i < n) {
                a[i*s + j] = a[j*s + i];
            } else if (i < j) {
                a[i*s + j] = T(0.0);
            }
            a[j*s + i] = a[i*s + j];
        }
        if (i < n) {
            b[i] *= unit;
        }
        d[i] = T(0.0);
    }
    const bool uneven = is_uneven(n, s, a, copy);
    if (uneven) {
        scale_inertia(n, s, a, d);
    }
    if (!equilibrate(s, a, d)) {
        return false;
    }
    for (std::size_t i = 0; i < s; ++i) {
        for (std::size_t j = 0; j < s; ++j) {
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
        for (std::size_t i = 0; i < s; ++i) {
            for (std::size_t j = 0; j < s; ++j) {
                defect[i] -= copy[i*s + j]*b[j];
            }
        }
        if (!solve_pivoted(s, copy, defect)) {
            return false;
        }
    }
    for (std::size_t i = 0; i < s; ++i) {
        if (!(abs(a[i*s + i]) > T(static_cast<double>(s))*detail::rounding<T>())) {
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

/// State derivative [v, a].
template <class T>
std::array<T, 4> rhs(T t, const std::array<T, 4>& y, const Params<T>& p = {})
{
    (void)t;
    std::array<T, 4> out{};
    const T m = p.m;
    const T g = p.g;
    const T x = y[0];
    const T z = y[1];
    const T x_dot = y[2];
    const T z_dot = y[3];
    out[0] = x_dot;
    out[1] = z_dot;
    std::array<T, 9> matrix{};
    std::array<T, 3> vector{};
    matrix[0] = m;
    matrix[1] = T(0.0);
    matrix[4] = m;
    matrix[6] = T(2.0)*x;
    matrix[7] = T(2.0)*z;
    matrix[8] = T(0.0);
    vector[0] = T(0.0);
    vector[1] = -m*g;
    vector[2] = -T(2.0)*(x_dot*x_dot + z_dot*z_dot);
    std::array<T, 3> scales{};
    std::array<T, 9> copy{};
    std::array<T, 3> defect{};
    if (!(solve_saddle(2, 1, matrix.data(), vector.data(), scales.data(), copy.data(), defect.data()))) {
        return detail::undefined(out);
    }
    out[2] = vector[0];
    out[3] = vector[1];
    return out;
}

/// Mass matrix M(q, t) of M a = f, n by n, by rows.
template <class T>
std::array<T, 4> mass_matrix(T t, const std::array<T, 4>& y, const Params<T>& p = {})
{
    (void)t;
    (void)y;
    std::array<T, 4> out{};
    const T m = p.m;
    out[0] = m;
    out[1] = T(0.0);
    out[3] = m;
    out[2] = out[1];
    return out;
}

/// Forcing f(q, v, t) of M a = f.
template <class T>
std::array<T, 2> forcing(T t, const std::array<T, 4>& y, const Params<T>& p = {})
{
    (void)t;
    (void)y;
    std::array<T, 2> out{};
    const T m = p.m;
    const T g = p.g;
    out[0] = T(0.0);
    out[1] = -m*g;
    return out;
}

/// Energy function: the sum of v dL/dv, less L (T + V in most systems).
template <class T>
T energy(T t, const std::array<T, 4>& y, const Params<T>& p = {})
{
    (void)t;
    std::array<T, 1> out{};
    const T m = p.m;
    const T g = p.g;
    const T z = y[1];
    const T x_dot = y[2];
    const T z_dot = y[3];
    out[0] = m*(T(0.5)*(x_dot*x_dot + z_dot*z_dot) + g*z);
    return out[0];
}

/// Positions, in the order of the heading.
template <class T>
std::array<T, 1> positions(T t, const std::array<T, 4>& y, const Params<T>& p = {})
{
    (void)t;
    (void)y;
    (void)p;
    std::array<T, 1> out{};
    out[0] = T(0.0);
    return out;
}

/// Time derivatives of the positions.
template <class T>
std::array<T, 1> velocities(T t, const std::array<T, 4>& y, const Params<T>& p = {})
{
    (void)t;
    (void)y;
    (void)p;
    std::array<T, 1> out{};
    out[0] = T(0.0);
    return out;
}

/// Multipliers, in the order of the closures.
template <class T>
std::array<T, 1> multipliers(T t, const std::array<T, 4>& y, const Params<T>& p = {})
{
    (void)t;
    std::array<T, 1> out{};
    const T m = p.m;
    const T g = p.g;
    const T x = y[0];
    const T z = y[1];
    const T x_dot = y[2];
    const T z_dot = y[3];
    std::array<T, 9> matrix{};
    std::array<T, 3> vector{};
    matrix[0] = m;
    matrix[1] = T(0.0);
    matrix[4] = m;
    matrix[6] = T(2.0)*x;
    matrix[7] = T(2.0)*z;
    matrix[8] = T(0.0);
    vector[0] = T(0.0);
    vector[1] = -m*g;
    vector[2] = -T(2.0)*(x_dot*x_dot + z_dot*z_dot);
    std::array<T, 3> scales{};
    std::array<T, 9> copy{};
    std::array<T, 3> defect{};
    if (!(solve_saddle(2, 1, matrix.data(), vector.data(), scales.data(), copy.data(), defect.data()))) {
        return detail::undefined(out);
    }
    out[0] = vector[2];
    return out;
}

/// Residuals: lhs - rhs of closures of positions, then rates of all closures.
template <class T>
std::array<T, 2> constraints(T t, const std::array<T, 4>& y, const Params<T>& p = {})
{
    (void)t;
    std::array<T, 2> out{};
    const T l_ = p.l_;
    const T x = y[0];
    const T z = y[1];
    const T x_dot = y[2];
    const T z_dot = y[3];
    out[0] = x*x + z*z - l_*l_;
    out[1] = T(2.0)*(x*x_dot + z*z_dot);
    return out;
}

/// Residuals of closures of positions, then magnitudes of their terms.
template <class T>
bool position_error(T t, const T* y, const Params<T>& p, T* out)
{
    using std::abs;
    (void)t;
    const T l_ = p.l_;
    const T x = y[0];
    const T z = y[1];
    const T w0 = x*x;
    const T w1 = z*z;
    const T w2 = l_*l_;
    out[0] = w0 + w1 - w2;
    out[1] = abs(w0) + abs(w1) + abs(w2) + abs(T(2.0)*w0) + abs(T(2.0)*w1);
    return true;
}

/// Squares of the gradients of closures of positions.
template <class T>
bool position_reach(T t, const T* y, const Params<T>& p, T* out)
{
    (void)t;
    const T m = p.m;
    const T x = y[0];
    const T z = y[1];
    out[0] = T(4.0)*(x*x + z*z)/m;
    return true;
}

/// Change of q that leads to the closures, in the metric of the energy.
template <class T>
bool position_change(T t, const T* y, const Params<T>& p, T* out)
{
    (void)t;
    const T m = p.m;
    const T l_ = p.l_;
    const T x = y[0];
    const T z = y[1];
    std::array<T, 9> matrix{};
    std::array<T, 3> vector{};
    matrix[0] = m;
    matrix[1] = T(0.0);
    matrix[4] = m;
    matrix[6] = T(2.0)*x;
    matrix[7] = T(2.0)*z;
    matrix[8] = T(0.0);
    vector[0] = T(0.0);
    vector[1] = T(0.0);
    vector[2] = -x*x - z*z + l_*l_;
    std::array<T, 3> scales{};
    std::array<T, 9> copy{};
    std::array<T, 3> defect{};
    if (!(solve_saddle(2, 1, matrix.data(), vector.data(), scales.data(), copy.data(), defect.data()))) {
        return false;
    }
    out[0] = vector[0];
    out[1] = vector[1];
    return true;
}

/// Residuals of the rates of closures, then magnitudes of their terms.
template <class T>
bool velocity_error(T t, const T* y, const Params<T>& p, T* out)
{
    using std::abs;
    (void)t;
    (void)p;
    const T x = y[0];
    const T z = y[1];
    const T x_dot = y[2];
    const T z_dot = y[3];
    const T w0 = x*x_dot;
    const T w1 = z*z_dot;
    out[0] = T(2.0)*(w0 + w1);
    out[1] = abs(T(2.0)*w0) + abs(T(2.0)*w1);
    return true;
}

/// Change of v that leads to the closures, in the metric of the energy.
template <class T>
bool velocity_change(T t, const T* y, const Params<T>& p, T* out)
{
    (void)t;
    const T m = p.m;
    const T x = y[0];
    const T z = y[1];
    const T x_dot = y[2];
    const T z_dot = y[3];
    std::array<T, 9> matrix{};
    std::array<T, 3> vector{};
    matrix[0] = m;
    matrix[1] = T(0.0);
    matrix[4] = m;
    matrix[6] = T(2.0)*x;
    matrix[7] = T(2.0)*z;
    matrix[8] = T(0.0);
    vector[0] = T(0.0);
    vector[1] = T(0.0);
    vector[2] = -T(2.0)*(x*x_dot + z*z_dot);
    std::array<T, 3> scales{};
    std::array<T, 9> copy{};
    std::array<T, 3> defect{};
    if (!(solve_saddle(2, 1, matrix.data(), vector.data(), scales.data(), copy.data(), defect.data()))) {
        return false;
    }
    out[0] = vector[0];
    out[1] = vector[1];
    return true;
}

/// State led back to the closures, which it leaves in the course of integration: q by the smallest
/// changes in the metric of the kinetic energy, until only rounding is left, then v in the same
/// metric. NaN in a singular configuration, or too far from any state that obeys the closures.
template <class T>
State<T> project(T t, State<T> y, const Params<T>& p = {})
{
    std::array<T, 2*1> error{};
    std::array<T, dof> change{};
    const bool led = lead_positions(dof, 1, t, p, y.data(), error.data(), std::array<T, 1>{}.data(),
                       change.data()) &&
        lead_velocities(dof, 1, t, p, y.data(), error.data(), change.data());
    return led ? y : detail::undefined(y);
}

} // namespace pendulum

#endif
