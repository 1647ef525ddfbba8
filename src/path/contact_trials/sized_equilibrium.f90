!> Equilibrium of a contact set in which the size of one contact or free span is prescribed and the load factor is unknown.
!>
!> Unknowns are the load factor and the places of all touchdown points, except that the two ends of the contact or free span of
!> prescribed size keep their distance, or a single end keeps its place; equations are the conditions of all touchdown points. For
!> given unknowns the touchdown points are fixed, and the equilibrium is regular: with fixed ends neither a free span that opens
!> with zero length nor an osculating contact is singular, and the equilibrium is nearly linear in the unknowns. The unknowns are
!> found by Broyden's method, whose first matrix is made of finite differences.
module sized_equilibrium
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use path_control, only: control_t
   use corrector, only: increment_t, correct
   use touchdown_points, only: with_held, shift_touchdown_points, touchdown_errors
   use least_norm, only: solve_least
   implicit none
   private
   public :: solve_sized

   integer, parameter :: max_iterations = 20
   integer, parameter :: renewed_after = 6      !! iterations after which the matrix is made of differences again
   real(wp), parameter :: small = 1.0e-3_wp     !! moves of load factor and places, in steps for finite differences, up to which
   !! Newton's method with free touchdown points does the rest
   real(wp), parameter :: settled = 1.0e-6_wp   !! largest error then, as a share of the first one
   real(wp), parameter :: farthest = 1.0e6_wp   !! change of the load factor in one iteration / its step for finite differences
   real(wp), parameter :: rounding = 1.0e3_wp * epsilon(1.0_wp) !! rounding error of a rotation [rad]

   real(wp), parameter :: neutral = 1.0e-8_wp   !! directions with smaller effect, as a share of the largest, are not moved

contains

   !> Finds the equilibrium and its load factor.
   subroutine solve_sized(problem, held, system, step, state, ok)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: held(2)            !! candidates of the ends with prescribed distance, or one end with prescribed place
      !! and 0
      type(system_t), intent(inout) :: system
      real(wp), intent(in) :: step(2)           !! steps of load factor and places for finite differences
      type(state_t), intent(inout) :: state     !! a guess on entry
      logical, intent(out) :: ok
      type(problem_t) :: frozen
      type(state_t) :: other
      integer, allocatable :: ends(:)
      real(wp), allocatable :: unit(:), error(:), changed(:), slope(:, :), move(:, :)
      integer :: c, k, n, try
      real(wp) :: whole, first
      ends = pack([(c, c=1, problem%candidates%n)], problem%candidates%contact_span > 0 .and. problem%candidates%moves)
      n = size(ends)
      frozen = with_held(problem, ends)
      unit = [(merge(step(1), step(2), k == n), k=1, n)]
      allocate (error(n), changed(n), slope(n, n), move(1, n))
      other = state
      call go_by(spread(0.0_wp, 1, n), other, state, error)
      first = maxval(abs(error))
      do try = 0, max_iterations
         if (.not. ok) return
         if (maxval(abs(error)) <= rounding) return
         if (modulo(try, renewed_after) == 0) then
            do k = 1, n
               call go_by(merge(merge(step(1), step(2), k == n), 0.0_wp, [(c, c=1, n)] == k), state, other, changed)
               if (.not. ok) return
               slope(k, :) = (changed - error) / merge(step(1), step(2), k == n)
            end do
         end if
         ! Unknowns are measured by their steps.
         call solve_least(transpose(slope * spread(unit, 2, n)), -error, neutral, move(1, :), ok)
         if (.not. ok) return
         move(1, :) = unit * move(1, :)
         ! An equilibrium at a load so far away is none of this path.
         ok = abs(move(1, n)) <= farthest * step(1)
         if (.not. ok) return
         whole = 1.0_wp
         if (any(abs(move(1, :n - 1)) > longest_move())) whole = longest_move() / maxval(abs(move(1, :n - 1)))
         move = whole * move
         other = state
         call go_by(move(1, :), other, state, changed)
         if (.not. ok) return
         ! Broyden's update by the difference between the changed errors and those that the matrix predicted.
         error = (changed - (1.0_wp - whole) * error) / max(dot_product(move(1, :), move(1, :)), sqrt(tiny(whole)))
         do k = 1, n
            slope(k, :) = slope(k, :) + error * move(1, k)
         end do
         error = changed
         ! Errors in directions that are not moved must be small, too.
         if (whole >= 1.0_wp .and. maxval(abs(move(1, :)) / unit) <= small .and. maxval(abs(error)) <= settled * first) return
      end do
      ok = .false.

   contains

      !> Finds the equilibrium after a change of the unknowns; the load factor comes last.
      subroutine go_by(change, from, to, error)
         real(wp), intent(in) :: change(:)
         type(state_t), intent(in) :: from
         type(state_t), intent(out) :: to
         real(wp), intent(out) :: error(:)      !! errors of the touchdown points' conditions
         type(control_t) :: control
         type(increment_t) :: report
         real(wp) :: distance(problem%candidates%n), all(problem%candidates%n)
         integer :: i, k
         distance = 0.0_wp
         k = 0
         do i = 1, n
            if (ends(i) == held(1) .or. ends(i) == held(2)) cycle
            k = k + 1
            distance(ends(i)) = change(k)
         end do
         if (all_held()) distance(held) = change(k + 1)
         to = from
         call shift_touchdown_points(problem, to, distance)
         control%method = method_load
         control%increment = change(n)
         control%whole = from%load_factor
         call correct(frozen, from, control, .true., to, system, report)
         ok = report%converged
         if (.not. ok) return
         all = touchdown_errors(problem, to)
         error = all(ends)
      end subroutine go_by

      !> Longest move of a touchdown point: half of an element beside it, so that spans, which have two elements at least, stay
      !> open.
      real(wp) function longest_move() result(longest)
         integer :: i, side
         longest = huge(longest)
         do i = 1, n
            do side = 1, 2
               longest = min(longest, 0.5_wp * state%geometry%element(problem%candidates%element(side, ends(i)))%length)
            end do
         end do
      end function longest_move

      !> True if two ends keep their distance, false if one end keeps its place.
      pure logical function all_held()
         all_held = held(1) > 0 .and. held(2) > 0
      end function all_held
   end subroutine solve_sized
end module sized_equilibrium
