!> Equilibria with touchdown points at prescribed positions and the load as an unknown. If a span opens with zero length, or a point
!> contact is osculating, the equations of the touchdown points are singular; with prescribed positions the equilibrium is regular.
module held_touchdown
   use kinds, only: wp
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use path_control, only: control_t
   use corrector, only: increment_t, correct
   use touchdown_points, only: with_held, shift_touchdown_points, opening_misfit
   use small_dense, only: solve_small
   implicit none
   private
   public :: solve_held

   integer, parameter :: max_iterations = 20
   real(wp), parameter :: small = 1.0e-8_wp  !! misfit (opening_misfit) below which the iteration ends when the misfit no longer
   !! decreases: if the relative curvature is small, the position of least gap is sensitive to rounding
   real(wp), parameter :: least_step = 1.0e-11_wp !! change of the load below the corrector's accuracy, as a share of the load
   real(wp), parameter :: rounding = 1.0e3_wp * epsilon(1.0_wp) !! rounding error of a rotation

contains

   !> Finds the load factor and the position of touchdown points, which move together, by Newton's method with finite differences.
   !> With at most one point and `places` false only the load is unknown, and the sum of the misfits must be zero.
   subroutine solve_held(problem, points, system, places, step, state, ok, also)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: points(2)           !! candidates, 0: none
      type(system_t), intent(inout) :: system
      logical, intent(in) :: places              !! true: the position is an unknown, too
      real(wp), intent(in) :: step(2)            !! steps of load factor and position for finite differences
      type(state_t), intent(inout) :: state      !! a guess on entry
      logical, intent(out) :: ok
      integer, intent(in), optional :: also(:)   !! further candidates with fixed positions
      type(problem_t) :: frozen
      type(state_t) :: other
      real(wp) :: left(2), changed(2), slope(2, 2), move(1, 2), trial(2), best
      integer :: try, k, unknowns
      logical :: singular
      unknowns = merge(2, 1, places)
      best = huge(best)
      frozen = with_held(problem, points)
      if (present(also)) frozen = with_held(frozen, also)
      other = state
      call go_by([0.0_wp, 0.0_wp], other, state, left)
      do try = 1, max_iterations
         if (.not. ok) return
         if (maxval(abs(left)) <= small .and. maxval(abs(left)) >= 0.1_wp * best) return
         if (maxval(abs(left)) <= rounding) return
         best = maxval(abs(left))
         do k = 1, unknowns
            trial = 0.0_wp
            trial(k) = step(k)
            call go_by(trial, state, other, changed)
            if (.not. ok) exit
            slope(k, :) = (changed - left) / step(k)
         end do
         if (.not. ok) then
            ok = best <= small
            return
         end if
         move(1, :) = -left
         if (unknowns == 1) then
            slope(1, 1) = sum(slope(1, :))
            move(1, 1) = -sum(left)
         end if
         call solve_small(unknowns, slope, move, singular)
         ok = .not. singular
         if (.not. ok) return
         trial = 0.0_wp
         trial(:unknowns) = move(1, :unknowns)
         ! Only rounding error is left.
         if (best <= small .and. abs(trial(1)) <= least_step * abs(state%load_factor)) return
         other = state
         call go_by(trial, other, state, left)
         if (.not. ok .and. best <= small) then
            state = other
            ok = .true.
            return
         end if
         ! Rounding of the residual is measured by the load, because the load step may be arbitrarily small.
         if (.not. ok) call go_by(trial, other, state, left, other%load_factor)
      end do
      ok = .false.

   contains

      !> Finds the equilibrium after a change of the load and of the points' positions.
      subroutine go_by(move, from, to, left, whole)
         real(wp), intent(in) :: move(2)         !! changes of load factor and position
         type(state_t), intent(in) :: from
         type(state_t), intent(out) :: to
         real(wp), intent(out) :: left(2)
         real(wp), intent(in), optional :: whole !! load factor as the scale of the increment
         type(control_t) :: control
         type(increment_t) :: report
         real(wp) :: distance(problem%candidates%n)
         to = from
         distance = 0.0_wp
         if (places) distance(pack(points, points > 0)) = move(2)
         call shift_touchdown_points(problem, to, distance)
         control%method = method_load
         control%increment = move(1)
         if (present(whole)) control%whole = whole
         call correct(frozen, from, control, .true., to, system, report)
         ok = report%converged
         left = opening_misfit(problem, points, to)
      end subroutine go_by
   end subroutine solve_held
end module held_touchdown
