!> Passes converged points to the recorder, with the path tangent and the independent checks.
module point_recording
   use kinds, only: wp
   use errors, only: error_t
   use problem, only: problem_t
   use rod_state, only: state_t, is_stress_free
   use force_free_contact, only: count_released
   use path_control, only: path_length, metric
   use monitors, only: monitor_rate
   use path_continuity, only: path_tangent_t, path_tangent_at
   use corrector, only: increment_t
   use path_state, only: path_state_t
   use path_outcome, only: outcome_t
   use point_report, only: report_point
   use point_checks, only: check_point
   use span_regions, only: tell_places
   use error_bar, only: error_bars_t
   use error_report, only: note_load
   use path_record, only: recorder_t, point_t
   use run_accuracy, only: place_t
   use timing, only: count_up, count_largest, counter_points, counter_largest
   implicit none
   private
   public :: record

   character(2), parameter :: has_corner(3) = ['C+', 'C-', 'BP'] !! labels at which the path may have a corner

contains

   !> Passes a converged point to the recorder and to the independent checks. If the point fails the checks, the path ends there,
   !> and outcome%why is set.
   subroutine record(problem, run, state, label, report, recorder, outcome, touching, bars, heading)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(state_t), intent(in) :: state
      character(*), intent(in) :: label
      type(increment_t), intent(in) :: report
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      logical, intent(in), optional :: touching(:) !! (candidates) shown as contact, though without force yet
      type(error_bars_t), allocatable, intent(in), optional :: bars
      type(path_tangent_t), intent(in), optional :: heading !! path tangent; absent: unknown
      type(point_t) :: point
      type(state_t) :: shown
      type(error_t), allocatable :: error
      type(path_tangent_t) :: tangent
      character(:), allocatable :: wrong
      integer :: m
      logical :: weak
      shown = state
      if (present(touching)) shown%active = state%active .or. touching
      point = report_point(problem, shown, run%system, run%points, label)
      if (present(bars)) then
         if (allocated(bars)) point%bars = bars
      end if
      if (present(heading) .and. .not. any(label == has_corner)) then
         ! At a limit point the tangent per load is arbitrarily long; its own length is used throughout.
         tangent = path_tangent_at(problem, run%system, heading%u, heading%load)
         if (metric(problem, tangent%u, tangent%u) > 0.0_wp) point%rate = tangent%load * &
            & [1.0_wp, (monitor_rate(problem, m, state, run%system), m=1, size(point%monitor))]
      end if
      point%iterations = report%iterations
      point%residual = max(report%residual, run%system%force_residual)
      point%lcp_size = report%lcp_size
      point%lcp_pivots = report%lcp_pivots
      point%arc_length = run%arc_length + path_length(problem, run%state, state)
      call count_released(problem, state, run%system, point%free_pivots, weak)
      ! The stress-free start has no force as reference of a residual.
      if (is_stress_free(state)) point%residual = 0.0_wp
      run%points = run%points + 1
      if (allocated(run%onset%region) .and. label == 'C+') point%region = [point%region, run%onset%region]
      if (allocated(point%bars) .and. allocated(point%region)) call tell_places(point%bars, point%region)
      call check_point(problem, state, run%system, place_t(run%branch, problem%step, run%points, state%load_factor), &
         & merge(run%onset%element, 0, label == 'C+'), point, outcome%accuracy, wrong)
      call note_load(problem%step, state%load_factor, outcome%accuracy)
      call count_up(counter_points)
      if (.not. problem%is_sampled()) call count_largest(counter_largest, problem%model%mesh%n_elements)
      call recorder%point(point, error)
      if (allocated(error)) then
         outcome%why = error%message
      else if (wrong /= '') then
         outcome%why = wrong
         outcome%wrong = .true.
      end if
   end subroutine record
end module point_recording
