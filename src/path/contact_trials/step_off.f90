!> Short steps along the path of a contact set, to see whether all tests of the set are satisfied there: the path of a wrong set has
!> a tensile force, a penetration, a negative length or a negative pressure.
module step_off
   use kinds, only: wp
   use model, only: method_load
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use path_control, only: control_t, metric
   use path_continuity, only: path_tangent_t, path_tangent_at, normal_plane
   use corrector, only: increment_t, correct
   use test_kinds, only: span_test_t, test_slack
   use span_tests, only: run_span_tests
   use other_set, only: other_set_t
   implicit none
   private
   public :: tangent_along, along, step_by, failing

contains

   !> Path tangent of a set at its equilibrium, oriented along a given direction: displacements and load factor are measured in
   !> units of their present values.
   function tangent_along(next, direction, load) result(heading)
      type(other_set_t), intent(in) :: next           !! system factored
      real(wp), intent(in) :: direction(:, :)    !! (3, nodes of next)
      real(wp), intent(in) :: load               !! load factor's component of the direction
      type(path_tangent_t) :: heading
      heading = path_tangent_at(next%problem, next%system, 0.0_wp * direction, 1.0_wp)
      if (along(next, heading, direction, load, next%state%load_factor) >= 0.0_wp) return
      heading%u = -heading%u
      heading%load = -heading%load
   end function tangent_along

   !> Product of a path tangent and a direction, with displacements and load factor in units of their present values.
   real(wp) function along(next, heading, direction, load, whole_load)
      type(other_set_t), intent(in) :: next
      type(path_tangent_t), intent(in) :: heading
      real(wp), intent(in) :: direction(:, :)    !! (3, nodes of next)
      real(wp), intent(in) :: load               !! load factor's component of the direction
      real(wp), intent(in) :: whole_load         !! unit of load factors in the product
      along = metric(next%problem, heading%u, direction) / whole_square(next) + heading%load * load / &
         & max(whole_load**2, sqrt(tiny(load)))
   end function along

   !> Square of the total displacement; at least the square of the smallest displacement that half of the decimal digits resolve.
   real(wp) function whole_square(next)
      type(other_set_t), intent(in) :: next
      whole_square = max(metric(next%problem, next%state%u, next%state%u), epsilon(whole_square))
   end function whole_square

   !> Steps from the equilibrium of a set along the path tangent, and runs all tests there.
   subroutine step_by(next, heading, distance, state, system, tests)
      type(other_set_t), intent(in) :: next
      type(path_tangent_t), intent(in) :: heading
      real(wp), intent(in) :: distance           !! largest change, as a share of the total displacement and of the load factor
      type(state_t), intent(out) :: state
      type(system_t), intent(inout) :: system    !! factored at the state
      type(span_test_t), allocatable, intent(out) :: tests(:) !! not allocated: no equilibrium was found
      type(control_t) :: plane
      type(increment_t) :: report
      associate (problem => next%problem)
         plane = normal_plane(problem, next%state, heading)
         if (plane%method == method_load) then
            plane%increment = sign(distance * max(abs(next%state%load_factor), epsilon(distance)), heading%load)
         else
            plane%increment = distance * sqrt(whole_square(next))
         end if
         ! The rounding error of the residual is judged relative to the whole displacement or load, because the step may be
         ! arbitrarily small.
         plane%whole = plane%increment / distance
         state = next%state
         call correct(problem, next%state, plane, .true., state, system, report)
         if (.not. report%converged) return
         call linearise(problem, state, state, system)
         if (.not. system%ok) return
         tests = run_span_tests(problem, state, max(system%force_scale, tiny(1.0_wp)))
      end associate
   end subroutine step_by

   !> The tests that fail.
   pure function failing(tests) result(failed)
      type(span_test_t), intent(in) :: tests(:)
      type(span_test_t), allocatable :: failed(:)
      failed = pack(tests, .not. tests%value >= -test_slack(tests%kind))
   end function failing
end module step_off
