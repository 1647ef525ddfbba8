!> Equilibrium of a contact set in which the size of one contact or free span is prescribed and the load factor is unknown.
!>
!> Unknowns are the distance along the path tangent and the places of all touchdown points, except that the two ends of the contact
!> or free span of prescribed size keep their distance, or a single end keeps its place; equations are the conditions of all
!> touchdown points. For given unknowns the touchdown points are fixed, and the equilibrium in the plane normal to the path tangent
!> is regular: with fixed ends neither a free span that opens with zero length nor an osculating contact is singular, and the
!> equilibrium is nearly linear in the unknowns, even where the load hardly changes. The unknowns are found by Broyden's method,
!> whose first matrix is made of finite differences.
module sized_equilibrium
   use kinds, only: wp
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

   ! With half or twice each of these values no run of a sample of the tests changes.
   integer, parameter :: max_iterations = 20
   integer, parameter :: renewed_after = 6      !! iterations after which the matrix is computed from finite differences again
   real(wp), parameter :: small = 1.0e-5_wp     !! largest last move of an unknown / its step for finite differences
   real(wp), parameter :: settled = 1.0e-8_wp   !! largest error in the last iteration, as a share of the first error
   real(wp), parameter :: near = 0.1_wp !! largest error, as a share of the first error, from which Newton's method with free
   !! touchdown points completes the solution
   real(wp), parameter :: farthest = 1.0e6_wp !! longest move along the path in one iteration / step along the path for finite
   !! differences
   real(wp), parameter :: rounding = 1.0e3_wp * epsilon(1.0_wp) !! rounding error of a rotation [rad]

   real(wp), parameter :: part_of_span = 1.0e-3_wp !! largest step of a place for finite differences / length of a span beside it
   real(wp), parameter :: shorter = 0.25_wp !! factor by which a move is shortened if no equilibrium is found after it, or errors
   !! grow
   integer, parameter :: most_cuts = 5 !! largest number of times that a step for finite differences is multiplied by `shorter`
   real(wp), parameter :: sharper = 1.0e-4_wp !! residual of the equilibrium for given unknowns / tolerance of the step: a free span
   !! between straight walls resists a shift along itself by hardly more than its residual
   real(wp), parameter :: neutral = 1.0e-8_wp !! unknowns are not moved in directions with a smaller effect on the errors, as a
   !! share of the largest effect

contains

   !> Finds the equilibrium, with its load factor. Where the errors have become small but noise keeps the iteration from settling,
   !> for instance if a free span resists a shift along itself by hardly more than the residual, Newton's method with free touchdown
   !> points finds an equilibrium nearby; its size then differs a little from the prescribed size.
   subroutine solve_sized(problem, held, system, plane, along, state, ok)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: held(2) !! candidates of the two ends whose distance is prescribed; or the candidate of an end whose
      !! place is prescribed, and 0
      type(system_t), intent(inout) :: system
      type(control_t), intent(in) :: plane      !! plane normal to the path tangent, at the nodes of `state`
      real(wp), intent(in) :: along             !! step along the path tangent for finite differences
      type(state_t), intent(inout) :: state     !! a guess on entry
      logical, intent(out) :: ok
      type(problem_t) :: frozen
      type(state_t) :: other, best
      integer, allocatable :: ends(:)
      real(wp), allocatable :: unit(:), error(:), slope(:, :)
      integer :: c, k, n, try
      type(increment_t) :: report
      logical :: done
      real(wp) :: first, least
      ends = pack([(c, c=1, problem%candidates%n)], problem%candidates%contact_span > 0 .and. problem%candidates%moves)
      n = size(ends)
      frozen = with_held(problem, ends)
      frozen%model%step(frozen%step)%sharper = sharper
      unit = [(merge(along, part_of_span * maxval(problem%layout%rod_segment%length), k == n), k=1, n)]
      call shorten_steps()
      allocate (error(n), slope(n, n))
      other = state
      call go_by(spread(0.0_wp, 1, n), other, state, error)
      if (.not. ok) return
      first = maxval(abs(error))
      least = first
      best = state
      do try = 0, max_iterations
         if (.not. ok) exit
         if (maxval(abs(error)) <= rounding) return
         if (modulo(try, renewed_after) == 0) call find_slopes()
         if (ok) call improve(done)
         if (ok .and. done) return
         if (.not. ok .or. maxval(abs(error)) >= least) cycle
         least = maxval(abs(error))
         best = state
      end do
      ok = least <= near * first
      if (ok) call correct(problem, best, plane, .true., state, system, report)
      if (ok) ok = report%converged

   contains

      !> Shortens the steps by which places are moved for finite differences to a small part of the spans beside them.
      subroutine shorten_steps()
         real(wp) :: distance(problem%candidates%n), part
         type(state_t) :: moved
         integer :: i
         do i = 1, n - 1
            moved = state
            distance = distances(merge(unit, 0.0_wp, [(c, c=1, n)] == i))
            call shift_touchdown_points(problem, moved, distance, part)
            if (part > part_of_span) unit(i) = unit(i) * part_of_span / part
         end do
      end subroutine shorten_steps

      !> Derivatives of the errors by the unknowns, by finite differences. Near a limit point there may be no equilibrium after the
      !> whole step.
      subroutine find_slopes()
         real(wp) :: changed(n)
         integer :: i, cut
         do i = 1, n
            do cut = 0, most_cuts
               call go_by(merge(unit, 0.0_wp, [(c, c=1, n)] == i), state, other, changed)
               if (ok) exit
               unit(i) = shorter * unit(i)
            end do
            if (.not. ok) return
            slope(i, :) = (changed - error) / unit(i)
         end do
      end subroutine find_slopes

      !> Makes one iteration: moves the unknowns and updates the matrix of derivatives.
      subroutine improve(done)
         logical, intent(out) :: done           !! true: moves and errors are small
         real(wp) :: move(n), changed(n), remaining(n), whole, size_of_move
         integer :: i
         done = .false.
         call solve(error, move)
         if (.not. ok) return
         size_of_move = norm2(move / unit)
         ! A move that leads so far would end on another path.
         ok = abs(move(n)) <= farthest * along
         if (.not. ok) return
         whole = part_allowed(move)
         move = whole * move
         other = state
         do
            call go_by(move, other, state, changed)
            ! A move no longer than the steps for finite differences is accepted without a check.
            if (all(abs(move) <= unit)) exit
            if (ok) then
               if (maxval(abs(changed)) <= maxval(abs(error))) exit
               ! Errors of different touchdown points differ by powers of the prescribed length; therefore errors may grow if the
               ! move that would remove them becomes shorter (natural monotonicity, Deuflhard 1974).
               call solve(changed, remaining)
               if (.not. ok) return
               if (norm2(remaining / unit) <= size_of_move) exit
            end if
            whole = shorter * whole
            move = shorter * move
         end do
         if (.not. ok) return
         ! Broyden's update by the difference between the changed errors and those that the matrix predicted.
         error = (changed - (1.0_wp - whole) * error) / max(dot_product(move, move), sqrt(tiny(whole)))
         do i = 1, n
            slope(i, :) = slope(i, :) + error * move(i)
         end do
         error = changed
         ! Errors in directions that are not moved must be small, too.
         done = whole >= 1.0_wp .and. maxval(abs(move) / unit) <= small .and. maxval(abs(error)) <= settled * first
      end subroutine improve

      !> Solves for the move that removes the given errors. Unknowns are measured by their effects, so that only combinations of
      !> them can be neutral.
      subroutine solve(error, move)
         real(wp), intent(in) :: error(:)
         real(wp), intent(out) :: move(:)
         real(wp) :: effect(n)
         effect = max(norm2(slope, 2), tiny(effect))
         call solve_least(transpose(slope / spread(effect, 2, n)), -error, neutral, move, ok)
         move = move / effect
      end subroutine solve

      !> Finds the equilibrium after a change of the unknowns, of which the distance along the path is the last.
      subroutine go_by(change, from, to, error)
         real(wp), intent(in) :: change(:)
         type(state_t), intent(in) :: from
         type(state_t), intent(out) :: to
         real(wp), intent(out) :: error(:)      !! errors of the touchdown points' conditions
         type(control_t) :: control
         type(increment_t) :: report
         real(wp) :: distance(problem%candidates%n), all(problem%candidates%n)
         distance = distances(change)
         to = from
         call shift_touchdown_points(problem, to, distance)
         control = plane
         control%increment = change(n)
         call correct(frozen, from, control, .true., to, system, report)
         ok = report%converged
         if (.not. ok) return
         all = touchdown_errors(problem, to)
         error = all(ends)
      end subroutine go_by

      !> Distances by which touchdown points move for a change of the unknowns.
      pure function distances(change) result(distance)
         real(wp), intent(in) :: change(:)
         real(wp) :: distance(problem%candidates%n)
         integer :: i, k
         distance = 0.0_wp
         k = 0
         do i = 1, n
            if (ends(i) == held(1) .or. ends(i) == held(2)) cycle
            k = k + 1
            distance(ends(i)) = change(k)
         end do
         if (all_held()) distance(held) = change(k + 1)
      end function distances

      !> Largest part of a move, at most 1, after which every span still has a part of its length.
      real(wp) function part_allowed(move) result(part)
         real(wp), intent(in) :: move(:)
         real(wp), dimension(problem%candidates%n) :: whole, reduced
         type(state_t) :: moved
         integer :: c
         whole = distances(move)
         reduced = whole
         moved = state
         call shift_touchdown_points(problem, moved, reduced)
         part = 1.0_wp
         do c = 1, size(whole)
            if (abs(whole(c)) > 0.0_wp) part = min(part, reduced(c) / whole(c))
         end do
      end function part_allowed

      !> True if two ends keep their distance, false if one end keeps its place.
      pure logical function all_held()
         all_held = held(1) > 0 .and. held(2) > 0
      end function all_held
   end subroutine solve_sized
end module sized_equilibrium
