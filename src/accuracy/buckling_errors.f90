!> Discretisation errors of the load factors of a buckling step.
!>
!> The enriched problem (the same structure with elements of a higher order) has its own state at the same load, and its own load
!> factors. The k-th load factor is compared with the k-th of the enriched problem, even if modes cross. Let C be the difference
!> between these two load factors. The relative error of the buckling mode is about C / load factor. An error of the mode changes
!> the load factor by its square, C^2 / load factor. The comparison does not show this part of the error; it is added to the bar.
module buckling_errors
   use kinds, only: wp
   use errors, only: error_t
   use model, only: method_load
   use problem, only: problem_t
   use rod_state, only: state_t
   use path_control, only: control_t
   use path_continuity, only: path_tangent_t
   use linear_buckling, only: buckle
   use error_bar, only: new_error_bar
   use enriched_problem, only: enriched_problem_t, why_no_bars
   use enriched_path, only: enriched_path_t, enriched_point_t, new_finer_path, start_point, next_point, no_convergence
   use path_record, only: buckling_t
   use timing, only: timing_start, timing_stop, phase_accuracy
   implicit none
   private
   public :: add_buckling_bars

contains

   !> Adds error bars to the load factors of a buckling step. The run's timers count this work as accuracy, not as buckling.
   subroutine add_buckling_bars(problem, state, buckling)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! converged state about which the load factors were computed
      type(buckling_t), intent(inout) :: buckling
      type(enriched_problem_t), target :: better
      type(enriched_path_t) :: path
      type(enriched_point_t) :: point
      type(control_t) :: control
      type(path_tangent_t) :: heading
      type(buckling_t) :: finer
      type(error_t), allocatable :: error
      real(wp) :: correction, rounding
      integer :: k
      allocate (buckling%bar(size(buckling%load_factor)))
      buckling%unbarred = why_no_bars(problem, state)
      if (buckling%unbarred /= '') return
      call timing_start(phase_accuracy)
      control%method = method_load
      heading = path_tangent_t(0.0_wp * state%u, 1.0_wp)
      call new_finer_path(problem, better, state, control, heading, [integer ::], path)
      allocate (path%modes(size(problem%weight) * 3, 0))
      call start_point(path, better, point)
      if (point%ok) call next_point(path, 0.0_wp, point)
      if (point%ok) call buckle(path%problem, point%state, point%system, size(buckling%load_factor), finer, error)
      call timing_stop(phase_accuracy)
      if (.not. point%ok .or. allocated(error)) then
         buckling%unbarred = no_convergence
         return
      end if
      do k = 1, min(size(buckling%load_factor), size(finer%load_factor))
         associate (factor => buckling%load_factor(k))
            ! Some loads buckle the structure with either sign. Their load factors form pairs of equal magnitude in arbitrary order,
            ! so that magnitudes are compared.
            correction = (abs(finer%load_factor(k)) - abs(factor)) * sign(1.0_wp, factor)
            rounding = (buckling%residual(k)**2 + finer%residual(k)**2 + 4.0_wp * epsilon(rounding)) * abs(factor)
            buckling%bar(k) = new_error_bar(correction, correction**2 / abs(factor), abs(correction), rounding)
         end associate
      end do
      if (any(buckling%bar%estimated)) deallocate (buckling%unbarred)
   end subroutine add_buckling_bars
end module buckling_errors
