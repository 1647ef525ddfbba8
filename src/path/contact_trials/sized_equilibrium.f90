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

   ! Half and twice each of these values change no run of a sample of the tests.
   integer, parameter :: max_iterations = 20
   integer, parameter :: renewed_after = 6      !! iterations after which the matrix is made of differences again
   real(wp), parameter :: small = 1.0e-5_wp     !! moves of the last iteration, in steps for finite differences
   real(wp), parameter :: settled = 1.0e-8_wp   !! largest error then, as a share of the first one
   real(wp), parameter :: near = 0.1_wp         !! largest error, as a share of the first one, from which Newton's method with free
   !! touchdown points does the rest
   real(wp), parameter :: farthest = 1.0e6_wp   !! distance along the path in one iteration / its step for finite differences
   real(wp), parameter :: rounding = 1.0e3_wp * epsilon(1.0_wp) !! rounding error of a rotation [rad]

   real(wp), parameter :: part_of_span = 1.0e-3_wp !! largest step of a place for finite differences / length of a span beside it
   real(wp), parameter :: shorter = 0.25_wp     !! factor on a move for which no equilibrium is found or errors grow
   integer, parameter :: most_cuts = 5          !! number of times that a step for finite differences is shortened by this factor
   real(wp), parameter :: sharper = 1.0e-4_wp !! residual of the equilibrium for given unknowns / tolerance of the step: a free span
   !! between straight walls resists a shift along itself by hardly more than its residual
   real(wp), parameter :: neutral = 1.0e-8_wp   !! directions with smaller effect, as a share of the largest, are not moved

contains

   !> Finds the equilibrium, with its load factor. Where the errors have become small but noise keeps the iteration from settling,
   !> for instance if a free span resists a shift along itself by hardly more than the residual, Newton's method with free touchdown
   !> points finds an equilibrium near it, whose size differs a little from the prescribed one.
   subroutine solve_sized(problem, held, system, plane, along, state, ok)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: held(2)            !! candidates of the ends with prescribed distance, or one end with prescribed place
      !! and 0
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

      !> Shortens the steps of places to a small part of the spans beside them.
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

      !> One iteration.
      subroutine improve(done)
         logical, intent(out) :: done           !! true: moves and errors are small
         real(wp) :: move(n), changed(n), remaining(n), whole, size_of_move
         integer :: i
         done = .false.
         call solve(error, move)
         if (.not. ok) return
         size_of_move = norm2(move / unit)
         ! An equilibrium so far away is on another path.
         ok = abs(move(n)) <= farthest * along
         if (.not. ok) return
         whole = part_allowed(move)
         move = whole * move
         other = state
         do
            call go_by(move, other, state, changed)
            ! Steps for finite differences are short enough.
            if (all(abs(move) <= unit)) exit
            if (ok) then
               if (maxval(abs(changed)) <= maxval(abs(error))) exit
               ! Errors of different touchdown points differ by powers of the prescribed length; they may grow if the remaining move
               ! becomes shorter (natural monotonicity, Deuflhard 1974).
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

      !> Finds the equilibrium after a change of the unknowns; the distance along the path comes last.
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

      !> Part of a move by which every span keeps a part of its length.
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
