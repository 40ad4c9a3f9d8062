! pendulum: Simple pendulum
!
! A point mass on a massless rod, swinging in a vertical plane, released at rest. The angle is 2
! asin(k cd(sqrt(g/l) t, k)) with k = sin(theta0/2), cd = cn/dn Jacobi's function; the period is 4
! sqrt(l/g) K(k). L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 11, problem 1.
!
! Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with closures beside
! them: l[k] is the multiplier and g[k] the gradient of closure k.
! The state y holds the coordinates q, then their velocities v. Functions have no result
! (NaN, or a status that is not 0) where M is singular or a number is not finite.
!
! Coordinates, in their order:
!   x
!   z
!
! Parameters, in their order:
!   m [kg]: mass of the bob
!   l [m]: length of the rod
!   g [m/s^2]: gravitational acceleration
!
! Positions, in their order:
!   y
!
! Closures, in their order:
!   bob: x = l*sin(theta), z = -l*cos(theta)
!
! Made by lagrange VERSION from the scene with SHA-256
! d8ab23885144fff672c2bbbf20ccdd4e6e5060c564f9fb77ff6792c03ba61d08
! This output is yours: use it as you like, under any terms.

module pendulum
  use, intrinsic :: iso_fortran_env, only: real64
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
  implicit none
  private
  public :: parameters, integrate, rhs, mass_matrix, forcing, energy, positions, velocities, &
    multipliers, constraints, initial, project, is_near

  integer, parameter :: wp = real64

  !> Parameters, with their values in the scene.
  type :: parameters
    ! m [kg]: mass of the bob
    real(wp) :: m = 1.0_wp
    ! l [m]: length of the rod
    real(wp) :: l_ = 1.0_wp
    ! g [m/s^2]: gravitational acceleration
    real(wp) :: g = 9.81_wp
  end type parameters

  !> Initial state.
  real(wp), parameter :: initial(4) = [0.9092974268256817_wp, 0.4161468365471424_wp, 0.0_wp, &
    0.0_wp]

contains

  !> State derivative [v, a].
  pure subroutine rhs(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(4)
    integer, intent(out) :: status
    real(wp) :: x, z, x_dot, z_dot
    real(wp) :: matrix(9)
    real(wp) :: vector(3)
    real(wp) :: scales(3)
    real(wp) :: copy(9)
    real(wp) :: defect(3)
    logical :: found
    associate (unused_t => t)
    end associate
    status = 0
    x = y(1)
    z = y(2)
    x_dot = y(3)
    z_dot = y(4)
    out(1) = x_dot
    out(2) = z_dot
    matrix(1) = p%m
    matrix(2) = 0.0_wp
    matrix(5) = p%m
    matrix(7) = 2.0_wp*x
    matrix(8) = 2.0_wp*z
    matrix(9) = 0.0_wp
    vector(1) = 0.0_wp
    vector(2) = -p%m*p%g
    vector(3) = -2.0_wp*(x_dot*x_dot + z_dot*z_dot)
    call solve_saddle(2, 1, matrix(1), vector(1), scales(1), copy(1), defect(1), found)
    if (.not. (found)) then
      status = 1
      return
    end if
    out(3) = vector(1)
    out(4) = vector(2)
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine rhs

  !> Mass matrix M(q, t) of M a = f, n by n, by rows.
  pure subroutine mass_matrix(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(4)
    integer, intent(out) :: status
    associate (unused_t => t, unused_y => y)
    end associate
    status = 0
    out(1) = p%m
    out(2) = 0.0_wp
    out(4) = p%m
    out(3) = out(2)
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine mass_matrix

  !> Forcing f(q, v, t) of M a = f.
  pure subroutine forcing(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(2)
    integer, intent(out) :: status
    associate (unused_t => t, unused_y => y)
    end associate
    status = 0
    out(1) = 0.0_wp
    out(2) = -p%m*p%g
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine forcing

  !> Energy function: the sum of v dL/dv, less L (T + V in most systems).
  pure subroutine energy(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out
    integer, intent(out) :: status
    real(wp) :: z, x_dot, z_dot
    associate (unused_t => t)
    end associate
    status = 0
    z = y(2)
    x_dot = y(3)
    z_dot = y(4)
    out = p%m*(0.5_wp*(x_dot*x_dot + z_dot*z_dot) + p%g*z)
    if (.not. ieee_is_finite(out)) status = 2
  end subroutine energy

  !> Positions, in the order of the heading.
  pure subroutine positions(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(1)
    integer, intent(out) :: status
    associate (unused_t => t, unused_y => y, unused_p => p)
    end associate
    status = 0
    out(1) = 0.0_wp
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine positions

  !> Time derivatives of the positions.
  pure subroutine velocities(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(1)
    integer, intent(out) :: status
    associate (unused_t => t, unused_y => y, unused_p => p)
    end associate
    status = 0
    out(1) = 0.0_wp
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine velocities

  !> Multipliers, in the order of the closures.
  pure subroutine multipliers(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(1)
    integer, intent(out) :: status
    real(wp) :: x, z, x_dot, z_dot
    real(wp) :: matrix(9)
    real(wp) :: vector(3)
    real(wp) :: scales(3)
    real(wp) :: copy(9)
    real(wp) :: defect(3)
    logical :: found
    associate (unused_t => t)
    end associate
    status = 0
    x = y(1)
    z = y(2)
    x_dot = y(3)
    z_dot = y(4)
    matrix(1) = p%m
    matrix(2) = 0.0_wp
    matrix(5) = p%m
    matrix(7) = 2.0_wp*x
    matrix(8) = 2.0_wp*z
    matrix(9) = 0.0_wp
    vector(1) = 0.0_wp
    vector(2) = -p%m*p%g
    vector(3) = -2.0_wp*(x_dot*x_dot + z_dot*z_dot)
    call solve_saddle(2, 1, matrix(1), vector(1), scales(1), copy(1), defect(1), found)
    if (.not. (found)) then
      status = 1
      return
    end if
    out(1) = vector(3)
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine multipliers

  !> Residuals: lhs - rhs of closures of positions, then rates of all closures.
  pure subroutine constraints(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(2)
    integer, intent(out) :: status
    real(wp) :: x, z, x_dot, z_dot
    associate (unused_t => t)
    end associate
    status = 0
    x = y(1)
    z = y(2)
    x_dot = y(3)
    z_dot = y(4)
    out(1) = x*x + z*z - p%l_*p%l_
    out(2) = 2.0_wp*(x*x_dot + z*z_dot)
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine constraints

  !> Residuals of closures of positions, then magnitudes of their terms.
  pure subroutine position_error(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(2)
    integer, intent(out) :: status
    real(wp) :: x, z, w0, w1, w2
    associate (unused_t => t)
    end associate
    status = 0
    x = y(1)
    z = y(2)
    w0 = x*x
    w1 = z*z
    w2 = p%l_*p%l_
    out(1) = w0 + w1 - w2
    out(2) = abs(w0) + abs(w1) + abs(w2) + abs(2.0_wp*w0) + abs(2.0_wp*w1)
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine position_error

  !> Squares of the gradients of closures of positions.
  pure subroutine position_reach(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(1)
    integer, intent(out) :: status
    real(wp) :: x, z
    associate (unused_t => t)
    end associate
    status = 0
    x = y(1)
    z = y(2)
    out(1) = 4.0_wp*(x*x + z*z)/p%m
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine position_reach

  !> Change of q that leads to the closures, in the metric of the energy.
  pure subroutine position_change(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(2)
    integer, intent(out) :: status
    real(wp) :: x, z
    real(wp) :: matrix(9)
    real(wp) :: vector(3)
    real(wp) :: scales(3)
    real(wp) :: copy(9)
    real(wp) :: defect(3)
    logical :: found
    associate (unused_t => t)
    end associate
    status = 0
    x = y(1)
    z = y(2)
    matrix(1) = p%m
    matrix(2) = 0.0_wp
    matrix(5) = p%m
    matrix(7) = 2.0_wp*x
    matrix(8) = 2.0_wp*z
    matrix(9) = 0.0_wp
    vector(1) = 0.0_wp
    vector(2) = 0.0_wp
    vector(3) = -x*x - z*z + p%l_*p%l_
    call solve_saddle(2, 1, matrix(1), vector(1), scales(1), copy(1), defect(1), found)
    if (.not. (found)) then
      status = 1
      return
    end if
    out(1) = vector(1)
    out(2) = vector(2)
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine position_change

  !> Residuals of the rates of closures, then magnitudes of their terms.
  pure subroutine velocity_error(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(2)
    integer, intent(out) :: status
    real(wp) :: x, z, x_dot, z_dot, w0, w1
    associate (unused_t => t, unused_p => p)
    end associate
    status = 0
    x = y(1)
    z = y(2)
    x_dot = y(3)
    z_dot = y(4)
    w0 = x*x_dot
    w1 = z*z_dot
    out(1) = 2.0_wp*(w0 + w1)
    out(2) = abs(2.0_wp*w0) + abs(2.0_wp*w1)
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine velocity_error

  !> Change of v that leads to the closures, in the metric of the energy.
  pure subroutine velocity_change(t, y, p, out, status)
    real(wp), intent(in) :: t, y(4)
    type(parameters), intent(in) :: p
    real(wp), intent(out) :: out(2)
    integer, intent(out) :: status
    real(wp) :: x, z, x_dot, z_dot
    real(wp) :: matrix(9)
    real(wp) :: vector(3)
    real(wp) :: scales(3)
    real(wp) :: copy(9)
    real(wp) :: defect(3)
    logical :: found
    associate (unused_t => t)
    end associate
    status = 0
    x = y(1)
    z = y(2)
    x_dot = y(3)
    z_dot = y(4)
    matrix(1) = p%m
    matrix(2) = 0.0_wp
    matrix(5) = p%m
    matrix(7) = 2.0_wp*x
    matrix(8) = 2.0_wp*z
    matrix(9) = 0.0_wp
    vector(1) = 0.0_wp
    vector(2) = 0.0_wp
    vector(3) = -2.0_wp*(x*x_dot + z*z_dot)
    call solve_saddle(2, 1, matrix(1), vector(1), scales(1), copy(1), defect(1), found)
    if (.not. (found)) then
      status = 1
      return
    end if
    out(1) = vector(1)
    out(2) = vector(2)
    if (.not. all(ieee_is_finite(out))) status = 2
  end subroutine velocity_change

  !> Lead a state back to the closures, which it leaves in the course of integration: q by the
  !> smallest changes in the metric of the kinetic energy, then v. status is 1 in a singular
  !> configuration, or too far from any state that obeys the closures.
  pure subroutine project(t, y, p, status)
    real(wp), intent(in) :: t
    real(wp), intent(inout) :: y(4)
    type(parameters), intent(in) :: p
    integer, intent(out) :: status
    real(wp) :: change(2), error(2), square(1)
    logical :: found
    call lead_positions(2, 1, t, p, y, error, square, change, found)
    status = merge(0, 1, found)
    if (.not. found) return
    call lead_velocities(2, 1, t, p, y, error, change, found)
    status = merge(0, 1, found)
  end subroutine project

  !> Tell whether a state of n coordinates obeys closures, but for rounding of its numbers.
  !>
  !> y is the state led back to them, span the duration of a run: velocities that move no coordinate
  !> by more than rounding in it are none.
  pure function is_near(n, span, stated, y) result(found)
    logical :: found
    integer, intent(in) :: n
    real(wp), intent(in) :: span
    real(wp), intent(in) :: stated(*)
    real(wp), intent(in) :: y(*)
    real(wp) :: place
    real(wp) :: rate
    integer :: i
    real(wp) :: bound
    place = 0.0_wp
    rate = 0.0_wp
    do i = 0, n - 1
      if (abs(stated(i + 1)) > place) then
        place = abs(stated(i + 1))
      end if
      if (abs(stated(n + i + 1)) > rate) then
        rate = abs(stated(n + i + 1))
      end if
    end do
    bound = 1e-09_wp*rate
    if (.not. (abs(span) <= 0.0_wp)) then
      bound = bound + 7.105427357601002e-15_wp*place/abs(span)
    end if
    do i = 0, n - 1
      if (.not. (abs(y(i + 1) - stated(i + 1)) <= 1e-09_wp*place)) then
        found = .false.
        return
      end if
      if (.not. (abs(y(n + i + 1) - stated(n + i + 1)) <= bound)) then
        found = .false.
        return
      end if
    end do
    found = .true.
    return
  end function is_near

  !> Return the largest power of two that is not above x, or the smallest normal number.
  pure function power_of_two(x) result(found)
    real(wp) :: found
    real(wp), intent(in) :: x
    real(wp) :: power
    power = 1.0_wp
    do while (power > x .and. power > 2.2250738585072014e-308_wp)
      power = power*0.5_wp
    end do
    do while (power < 0.5_wp*x)
      power = power*2.0_wp
    end do
    if (2.0_wp*power <= x) then
      power = power*2.0_wp
    end if
    found = power
    return
  end function power_of_two

  !> Return the largest of m residuals, in units of the last place of the magnitude m behind.
  pure function residual(m, error) result(found)
    real(wp) :: found
    integer, intent(in) :: m
    real(wp), intent(in) :: error(*)
    real(wp) :: largest
    integer :: k
    real(wp) :: size
    largest = 0.0_wp
    do k = 0, m - 1
      size = abs(error(k + 1))/(2.0_wp*1.1102230246251565e-16_wp*power_of_two(error(m + k + 1)))
      if (size > largest) then
        largest = size
      end if
    end do
    found = largest
    return
  end function residual

  !> Return the same where changes of all coordinates are found, and rounded, together.
  !>
  !> The magnitude of one residual counts for another as far as a change of the coordinates that
  !> makes the one does the other: square holds the squares of their gradients. A residual that is
  !> the difference of nothing (a height that is zero) has no magnitude of its own.
  pure subroutine coupled_residual(m, error, square, found)
    real(wp), intent(out) :: found
    integer, intent(in) :: m
    real(wp), intent(inout) :: error(*)
    real(wp), intent(in) :: square(*)
    real(wp) :: reach
    integer :: k
    real(wp) :: length
    real(wp) :: magnitude
    reach = 0.0_wp
    do k = 0, m - 1
      if (square(k + 1) > 0.0_wp) then
        length = error(m + k + 1)/sqrt(square(k + 1))
        if (length > reach) then
          reach = length
        end if
      end if
    end do
    do k = 0, m - 1
      magnitude = reach*sqrt(square(k + 1))
      if (magnitude > error(m + k + 1) .and. magnitude <= 1.7976931348623157e+308_wp) then
        error(m + k + 1) = magnitude
      end if
    end do
    found = residual(m, error)
    return
  end subroutine coupled_residual

  !> Lead n coordinates back to m closures of positions, by the smallest changes.
  !>
  !> Their metric is the kinetic energy. Newton's method goes on until only rounding is left, or
  !> little more that no change makes smaller. The arrays behind y are overwritten. Tell whether the
  !> closures hold; else the configuration is singular, or too far from any that obeys them.
  pure subroutine lead_positions(n, m, t, p, y, error, square, change, found)
    logical, intent(out) :: found
    integer, intent(in) :: n
    integer, intent(in) :: m
    real(wp), intent(in) :: t
    type(parameters), intent(in) :: p
    real(wp), intent(inout) :: y(*)
    real(wp), intent(inout) :: error(*)
    real(wp), intent(inout) :: square(*)
    real(wp), intent(inout) :: change(*)
    real(wp) :: last
    integer :: number
    real(wp) :: size
    integer :: i
    real(wp) :: measured
    integer :: status
    last = 0.0_wp
    do number = 0, 50 + 1 - 1
      call position_error(t, y, p, error, status)
      if (.not. status == 0) then
        found = .false.
        return
      end if
      size = residual(m, error)
      if (size <= 1.0_wp) then
        found = .true.
        return
      end if
      if (number > 0) then
        call position_reach(t, y, p, square, status)
        if (.not. status == 0) then
          found = .false.
          return
        end if
        call coupled_residual(m, error, square, measured)
        size = measured
        if (size <= 1.0_wp) then
          found = .true.
          return
        end if
        if (size <= 1024.0_wp .and. 2.0_wp*size > last) then
          found = .true.
          return
        end if
      end if
      last = size
      call position_change(t, y, p, change, status)
      if (.not. status == 0) then
        found = .false.
        return
      end if
      do i = 0, n - 1
        y(i + 1) = y(i + 1) + change(i + 1)
      end do
    end do
    found = .false.
    return
  end subroutine lead_positions

  !> Lead the velocities of n coordinates back to m closures, in the same metric.
  !>
  !> The arrays behind y are overwritten. Tell whether the closures hold.
  pure subroutine lead_velocities(n, m, t, p, y, error, change, found)
    logical, intent(out) :: found
    integer, intent(in) :: n
    integer, intent(in) :: m
    real(wp), intent(in) :: t
    type(parameters), intent(in) :: p
    real(wp), intent(inout) :: y(*)
    real(wp), intent(inout) :: error(*)
    real(wp), intent(inout) :: change(*)
    integer :: i
    integer :: status
    call velocity_error(t, y, p, error, status)
    if (.not. status == 0) then
      found = .false.
      return
    end if
    if (.not. (residual(m, error) <= 1.0_wp)) then
      call velocity_change(t, y, p, change, status)
      if (.not. status == 0) then
        found = .false.
        return
      end if
      do i = 0, n - 1
        y(n + i + 1) = y(n + i + 1) + change(i + 1)
      end do
    end if
    found = .true.
    return
  end subroutine lead_velocities

  !> Return the power of two that brings a positive number to between 1/2 and 1.
  pure function scale_of(x) result(found)
    real(wp) :: found
    real(wp), intent(in) :: x
    found = 0.5_wp/power_of_two(x)
    return
  end function scale_of

  !> Tell whether elimination leaves little of the inertia of a coordinate.
  !>
  !> c is overwritten. Coordinates without any inertia do not count.
  pure subroutine is_uneven(n, s, a, c, found)
    logical, intent(out) :: found
    integer, intent(in) :: n
    integer, intent(in) :: s
    real(wp), intent(in) :: a(*)
    real(wp), intent(inout) :: c(*)
    integer :: i
    integer :: j
    integer :: k
    integer :: row
    real(wp) :: inertia
    real(wp) :: ratio
    do i = 0, n - 1
      do j = 0, n - 1
        c(i*n + j + 1) = a(i*s + j + 1)
      end do
    end do
    do k = 0, n - 1
      row = k*n
      inertia = a(k*s + k + 1)
      if (inertia > 7.888609052210118e-31_wp) then
        if (.not. (c(row + k + 1) > 0.00390625_wp*inertia)) then
          found = .true.
          return
        end if
      else
        do i = 0, n - 1
          if (i /= k .and. .not. (abs(a(i*s + k + 1)) <= 0.0_wp)) then
            found = .true.
            return
          end if
        end do
      end if
      do i = k + 1, n - 1
        if (.not. (abs(c(row + i + 1)) <= 0.0_wp)) then
          ratio = c(row + i + 1)/c(row + k + 1)
          do j = i, n - 1
            c(i*n + j + 1) = c(i*n + j + 1) - ratio*c(row + j + 1)
          end do
        end if
      end do
    end do
    found = .false.
    return
  end subroutine is_uneven

  !> Return the power of two whose square brings a positive number to between 1/4 and 1.
  pure function root_scale_of(x) result(found)
    real(wp) :: found
    real(wp), intent(in) :: x
    found = scale_of(sqrt(x))
    return
  end function root_scale_of

  !> Store factors d of the n coordinates for the matrix of solve_saddle.
  !>
  !> They are one over the root of the inertia, or of w g^2 where that is more, for the gradient g
  !> of each closure. w is the second smallest inertia over g^2 that it meets, if there are two: a
  !> coordinate that a closure holds need not have inertia at every state. 0 without either.
  pure subroutine scale_inertia(n, s, a, d)
    integer, intent(in) :: n
    integer, intent(in) :: s
    real(wp), intent(in) :: a(*)
    real(wp), intent(inout) :: d(*)
    integer :: j
    integer :: i
    real(wp) :: first
    real(wp) :: second
    integer :: count
    real(wp) :: gradient
    real(wp) :: inertia
    real(wp) :: ratio
    real(wp) :: size
    do j = 0, n - 1
      d(j + 1) = 0.0_wp
      if (.not. (abs(a(j*s + j + 1)) <= 0.0_wp)) then
        d(j + 1) = power_of_two(abs(a(j*s + j + 1)))
      end if
    end do
    do i = n, s - 1
      first = 2.535301200456459e+30_wp
      second = 2.535301200456459e+30_wp
      count = 0
      do j = 0, n - 1
        if (.not. (abs(a(i*s + j + 1)) <= 0.0_wp) .and. .not. (abs(a(j*s + j + 1)) <= 0.0_wp)) then
          gradient = power_of_two(abs(a(i*s + j + 1)))
          inertia = power_of_two(abs(a(j*s + j + 1)))
          ratio = 2.535301200456459e+30_wp
          if (gradient*2.535301200456459e+30_wp*gradient > inertia) then
            ratio = inertia/gradient/gradient
          end if
          if (ratio < first) then
            second = first
            first = ratio
          else if (ratio < second) then
            second = ratio
          end if
          count = count + 1
        end if
      end do
      if (count == 1) then
        second = first
      end if
      do j = 0, n - 1
        if (count > 0 .and. .not. (abs(a(i*s + j + 1)) <= 0.0_wp)) then
          gradient = power_of_two(abs(a(i*s + j + 1)))
          size = gradient*second*gradient
          if (size > d(j + 1)) then
            d(j + 1) = size
          end if
        end if
      end do
    end do
    do j = 0, n - 1
      if (d(j + 1) > 0.0_wp) then
        d(j + 1) = root_scale_of(d(j + 1))
      end if
    end do
  end subroutine scale_inertia

  !> Equilibrate a symmetric matrix of s rows by powers of two (Bunch, J. ACM 18 (1971) 566).
  !>
  !> a[i,j] d[i] d[j] is not small throughout a row. Rows of which d is 0 start from the diagonal,
  !> or follow from those that they touch. A row of zeros has no scale.
  pure subroutine equilibrate(s, a, d, found)
    logical, intent(out) :: found
    integer, intent(in) :: s
    real(wp), intent(in) :: a(*)
    real(wp), intent(inout) :: d(*)
    integer :: left
    integer :: i
    integer :: before
    logical :: stuck
    real(wp) :: size
    integer :: j
    real(wp) :: entry
    left = 0
    do i = 0, s - 1
      if (.not. (d(i + 1) > 0.0_wp)) then
        left = left + 1
      end if
    end do
    before = s + 1
    do while (left > 0)
      stuck = left == before
      before = left
      do i = 0, s - 1
        if (.not. (d(i + 1) > 0.0_wp)) then
          size = sqrt(abs(a(i*s + i + 1)))
          do j = 0, s - 1
            entry = abs(a(i*s + j + 1))
            if (.not. stuck) then
              entry = entry*d(j + 1)
            end if
            if (entry > size) then
              size = entry
            end if
          end do
          if (size > 0.0_wp) then
            d(i + 1) = scale_of(size)
            if (stuck) then
              d(i + 1) = 1.0_wp
            end if
            stuck = .false.
            left = left - 1
          end if
        end if
      end do
      if (stuck) then
        found = .false.
        return
      end if
    end do
    found = .true.
    return
  end subroutine equilibrate

  !> Solve a x = b for n unknowns by elimination with partial pivoting; x replaces b.
  pure subroutine solve_pivoted(n, a, b, found)
    logical, intent(out) :: found
    integer, intent(in) :: n
    real(wp), intent(inout) :: a(*)
    real(wp), intent(inout) :: b(*)
    integer :: j
    integer :: row
    integer :: best
    integer :: i
    real(wp) :: swap
    integer :: k
    integer :: below
    real(wp) :: ratio
    real(wp) :: value
    do j = 0, n - 1
      row = j*n
      best = j
      do i = j + 1, n - 1
        if (abs(a(i*n + j + 1)) > abs(a(best*n + j + 1))) then
          best = i
        end if
      end do
      if (.not. (abs(a(best*n + j + 1)) > 0.0_wp)) then
        found = .false.
        return
      end if
      if (best /= j) then
        swap = b(j + 1)
        b(j + 1) = b(best + 1)
        b(best + 1) = swap
        do k = j, n - 1
          swap = a(row + k + 1)
          a(row + k + 1) = a(best*n + k + 1)
          a(best*n + k + 1) = swap
        end do
      end if
      do i = j + 1, n - 1
        below = i*n
        ratio = a(below + j + 1)/a(row + j + 1)
        do k = j + 1, n - 1
          a(below + k + 1) = a(below + k + 1) - ratio*a(row + k + 1)
        end do
        b(i + 1) = b(i + 1) - ratio*b(j + 1)
      end do
    end do
    do i = n - 1, 0, -1
      value = b(i + 1)
      do k = i + 1, n - 1
        value = value - a(i*n + k + 1)*b(k + 1)
      end do
      b(i + 1) = value/a(i*n + i + 1)
    end do
    found = .true.
    return
  end subroutine solve_pivoted

  !> Solve M x = f + G^T l, G x + C l = g for n numbers x and m numbers l.
  !>
  !> Of the matrix [M, G^T; G, C] by rows, the upper triangle of M, the rows of G and the diagonal
  !> C are given: C is 0, or 1 where a row of G and g are zero, which makes that number of l zero.
  !> [x; l] replaces [f; g] in b; scales d, a copy of the matrix and the defect of the solution are
  !> overwritten. Units do not matter: M is divided by its size, and rows and columns are scaled
  !> alike, all by powers of two. Then comes elimination with pivoting; where M is nearly singular
  !> the solution is refined once, so that every row holds to the rounding of its own terms (Skeel,
  !> Math. Comput. 35 (1980) 817).
  pure subroutine solve_saddle(n, m, a, b, d, copy, defect, found)
    logical, intent(out) :: found
    integer, intent(in) :: n
    integer, intent(in) :: m
    real(wp), intent(inout) :: a(*)
    real(wp), intent(inout) :: b(*)
    real(wp), intent(inout) :: d(*)
    real(wp), intent(inout) :: copy(*)
    real(wp), intent(inout) :: defect(*)
    integer :: s
    real(wp) :: size
    real(wp) :: unit
    integer :: i
    integer :: j
    logical :: uneven
    logical :: succeeded
    s = n + m
    size = 0.0_wp
    unit = 1.0_wp
    do i = 0, n - 1
      do j = i, n - 1
        if (abs(a(i*s + j + 1)) > size) then
          size = abs(a(i*s + j + 1))
        end if
      end do
    end do
    if (size > 0.0_wp) then
      unit = scale_of(size)
    end if
    do i = 0, s - 1
      do j = i, s - 1
        if (j < n) then
          a(i*s + j + 1) = a(i*s + j + 1)*unit
        else if (i < n) then
          a(i*s + j + 1) = a(j*s + i + 1)
        else if (i < j) then
          a(i*s + j + 1) = 0.0_wp
        end if
        a(j*s + i + 1) = a(i*s + j + 1)
      end do
      if (i < n) then
        b(i + 1) = b(i + 1)*unit
      end if
      d(i + 1) = 0.0_wp
    end do
    call is_uneven(n, s, a, copy, succeeded)
    uneven = succeeded
    if (uneven) then
      call scale_inertia(n, s, a, d)
    end if
    call equilibrate(s, a, d, succeeded)
    if (.not. succeeded) then
      found = .false.
      return
    end if
    do i = 0, s - 1
      do j = 0, s - 1
        a(i*s + j + 1) = a(i*s + j + 1)*d(i + 1)*d(j + 1)
        copy(i*s + j + 1) = a(i*s + j + 1)
      end do
      b(i + 1) = b(i + 1)*d(i + 1)
      defect(i + 1) = b(i + 1)
    end do
    call solve_pivoted(s, a, b, succeeded)
    if (.not. succeeded) then
      found = .false.
      return
    end if
    if (uneven) then
      do i = 0, s - 1
        do j = 0, s - 1
          defect(i + 1) = defect(i + 1) - copy(i*s + j + 1)*b(j + 1)
        end do
      end do
      call solve_pivoted(s, copy, defect, succeeded)
      if (.not. succeeded) then
        found = .false.
        return
      end if
    end if
    do i = 0, s - 1
      if (.not. (abs(a(i*s + i + 1)) > real(s, wp)*1.1102230246251565e-16_wp)) then
        found = .false.
        return
      end if
      if (uneven) then
        b(i + 1) = b(i + 1) + defect(i + 1)
      end if
      b(i + 1) = b(i + 1)*d(i + 1)
      if (i >= n) then
        b(i + 1) = b(i + 1)/(-unit)
      end if
    end do
    found = .true.
    return
  end subroutine solve_saddle

  !> Advance a state from t to until by so many classical Runge-Kutta steps of fixed size.
  pure subroutine integrate(y, t, until, steps, p, status)
    real(wp), intent(inout) :: y(4)
    real(wp), intent(in) :: t, until
    integer, intent(in) :: steps
    type(parameters), intent(in) :: p
    integer, intent(out) :: status
    real(wp), parameter :: at(4) = [0.0_wp, 0.5_wp, 0.5_wp, 1.0_wp]
    real(wp) :: h, s, slope(4), change(4)
    integer :: step, stage
    status = 0
    h = (until - t)/steps
    do step = 0, steps - 1
      change = 0.0_wp
      slope = 0.0_wp
      do stage = 1, 4
        s = t + (step + at(stage))*h
        call rhs(s, y + at(stage)*h*slope, p, slope, status)
        if (status /= 0) return
        change = change + merge(1.0_wp, 2.0_wp, stage == 1 .or. stage == 4)*slope
      end do
      y = y + h/6.0_wp*change
      call project(t + (step + 1)*h, y, p, status)
      if (status /= 0) return
    end do
  end subroutine integrate

end module pendulum

!> Integrates from the initial state and prints CSV. Arguments: NAME=VALUE sets a parameter or an
!> initial value; until=T and steps=N (steps in an interval) set the run.
program pendulum_main
  use, intrinsic :: iso_fortran_env, only: error_unit, wp => real64
  use pendulum, only: parameters, integrate, project, is_near
  implicit none
  integer, parameter :: states = 4, rows = 500, total = 9
  real(wp), parameter :: start = 0.0_wp
  character(len=6) :: names(total)
  real(wp) :: values(total)
  logical :: known(total)
  type(parameters) :: p
  character(len=1000) :: argument
  real(wp) :: y(states), t, stated(4)
  integer :: i, row, status
  data names(1:9) / &
    'x', 'z', 'dot(x)', 'dot(z)', 'm', 'l', 'g', 'until', 'steps' /
  data values(1:9) / &
    0.9092974268256817_wp, 0.4161468365471424_wp, 0.0_wp, 0.0_wp, 1.0_wp, 1.0_wp, 9.81_wp, &
    20.0_wp, 20.0_wp /
  data known(1:9) / &
    .true., .true., .true., .true., .true., .true., .true., .true., .true. /

  do i = 1, command_argument_count()
    call get_command_argument(i, argument)
    if (.not. understood(trim(argument))) then
      write (error_unit, '(2a)') trim(argument), ': not NAME=NUMBER with a known name'
      stop 1, quiet=.true.
    end if
  end do
  if (.not. all(known)) then
    write (error_unit, '(a)', advance='no') 'values needed:'
    do i = 1, total
      if (.not. known(i)) write (error_unit, '(3a)', advance='no') ' ', trim(names(i)), '=VALUE'
    end do
    write (error_unit, '()')
    stop 1, quiet=.true.
  end if

  y = values(:states)
  p = parameters(values(5), values(6), values(7))
  stated = y
  call project(start, y, p, status)
  if (status /= 0 .or. .not. is_near(2, values(total - 1) - start, stated, y)) then
    write (error_unit, '(a)', advance='no') 'the initial state violates the constraints'
    if (status == 0) write (error_unit, '("; nearest:", *(a, g0))', advance='no') &
      (' '//trim(names(i))//'=', y(i), i = 1, states)
    write (error_unit, '()')
    stop 1, quiet=.true.
  end if
  write (*, '(*(a, :, ","))') 't', (trim(names(i)), i = 1, states)
  do row = 0, rows
    t = time(row)
    write (*, '(*(g0, :, ","))') t, y
    if (row == rows) exit
    call integrate(y, t, time(row + 1), nint(values(total)), p, status)
    if (status /= 0) then
      write (error_unit, '(a, g0, 2a)') 'stopped after t = ', t, ': ', &
        merge('the mass matrix is singular', 'a result is not finite     ', status == 1)
      stop 1, quiet=.true.
    end if
  end do

contains

  !> Time of a row.
  real(wp) function time(number)
    integer, intent(in) :: number
    time = start + (values(total - 1) - start)*(real(number, wp)/rows)
  end function time

  !> Set a value by NAME=NUMBER; false if the text is not that.
  logical function understood(text)
    character(len=*), intent(in) :: text
    integer :: equals, place, problem
    real(wp) :: number
    equals = index(text, '=')
    understood = .false.
    if (equals < 2 .or. verify(text(equals + 1:), '0123456789+-.eE') > 0) return
    do place = equals + 2, len(text)
      ! Fortran reads 5-3 as 5e-3.
      if (scan(text(place:place), '+-') > 0 .and. scan(text(place - 1:place - 1), 'eE') == 0) return
    end do
    do place = 1, total
      if (names(place) == text(:equals - 1)) exit
    end do
    read (text(equals + 1:), *, iostat=problem) number
    if (problem /= 0 .or. place > total .or. abs(number) > huge(number)) return
    if (place == total .and. (number < 1 .or. number > 1e9_wp .or. number > aint(number))) return
    values(place) = number
    known(place) = .true.
    understood = .true.
  end function understood

end program pendulum_main
