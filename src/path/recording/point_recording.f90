!> Passes converged points to the recorder, with the path tangent and the independent checks.
module point_recording
   use kinds, only: wp
   use errors, only: error_t
   use problem, only: problem_t
   use rod_state, only: state_t, is_stress_free
   use force_free_contact, only: count_opening
   use path_control, only: path_length, metric
   use monitors, only: monitor_rate
   use path_continuity, only: path_tangent_t, path_tangent_at
   use corrector, only: increment_t
   use path_point, only: path_point_t
   use path_state, only: path_state_t
   use path_outcome, only: outcome_t
   use point_report, only: report_point
   use contact_checks, only: span_sums_t, sum_spans
   use point_checks, only: check_point
   use span_regions, only: assign_place_bars
   use error_bar, only: error_bars_t
   use error_report, only: note_load
   use path_record, only: recorder_t, point_t
   use run_accuracy, only: place_t
   use timing, only: count_up, count_largest, counter_points, counter_largest
   use contact_labels, only: contact_gained, contact_lost
   implicit none
   private
   public :: record

   !> Labels of points at which the path may have a corner.
   character(2), parameter :: has_corner(3) = [contact_gained, contact_lost, 'BP']

contains

   !> Passes a converged point to the recorder and to the independent checks. If the point fails a check, the path ends there, and
   !> outcome%why is set.
   subroutine record(problem, run, point, label, report, recorder, outcome, touching, bars, smooth, pivots)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run
      type(path_point_t), intent(in) :: point
      character(*), intent(in) :: label !! label of the point: LP, BP, ...; '' for an ordinary point
      type(increment_t), intent(in) :: report
      class(recorder_t), intent(inout) :: recorder
      type(outcome_t), intent(inout) :: outcome
      logical, intent(in), optional :: touching(:) !! (candidates) true: the result shows the node in contact, though its contact
      !! force is still zero
      type(error_bars_t), allocatable, intent(in), optional :: bars
      logical, intent(in), optional :: smooth !! true: the path is smooth at the point; its tangent is that of the point; absent:
      !! unknown
      integer, intent(in), optional :: pivots !! number of negative pivots just before the point, needed where an eigenvalue may be
      !! zero; absent: that of the point's system
      type(point_t) :: row
      type(state_t) :: shown
      type(span_sums_t) :: spans
      type(error_t), allocatable :: error
      type(path_tangent_t) :: tangent
      character(:), allocatable :: wrong
      integer :: m
      integer :: opening                         ! number of unstable directions that open force-free contacts
      logical :: weak, has_tangent
      associate (state => point%state, system => point%system)
         shown = state
         if (present(touching)) shown%active = state%active .or. touching
         spans = sum_spans(problem, state)
         row = report_point(problem, shown, system, spans, run%points, label)
         if (present(pivots)) row%negative_pivots = pivots
         if (present(bars)) then
            if (allocated(bars)) row%bars = bars
         end if
         has_tangent = present(smooth) .and. .not. any(label == has_corner)
         if (has_tangent) has_tangent = smooth
         if (has_tangent) then
            ! At a limit point rates by the load factor are unbounded; all rates are therefore taken by arc length.
            tangent = path_tangent_at(problem, system, point%tangent%u, point%tangent%load)
            if (metric(problem, tangent%u, tangent%u) > 0.0_wp) row%rate = tangent%load * &
               & [1.0_wp, (monitor_rate(problem, m, state, system), m=1, size(row%monitor))]
         end if
         row%iterations = report%iterations
         row%residual = max(report%residual, system%force_residual)
         row%lcp_size = report%lcp_size
         row%lcp_pivots = report%lcp_pivots
         row%arc_length = run%arc_length + path_length(problem, run%last%state, state)
         call count_opening(problem, state, system, opening, weak)
         row%free_pivots = row%negative_pivots + opening
         ! At the stress-free start there is no force to which the residual could be related.
         if (is_stress_free(state)) row%residual = 0.0_wp
         run%points = run%points + 1
         run%recorded_load = state%load_factor
         if (allocated(run%onset%region) .and. label == contact_gained) row%region = [row%region, run%onset%region]
         if (allocated(row%bars) .and. allocated(row%region)) call assign_place_bars(row%bars, row%region)
         call check_point(problem, state, system, spans, place_t(run%branch, problem%step, run%points, state%load_factor), &
            & merge(run%onset%element, 0, label == contact_gained), row, outcome%accuracy, wrong)
         call note_load(problem%step, state%load_factor, outcome%accuracy)
      end associate
      call count_up(counter_points)
      if (.not. problem%is_sampled()) call count_largest(counter_largest, problem%model%mesh%n_elements)
      call recorder%take(row, error)
      if (allocated(error)) then
         outcome%why = error%message
      else if (wrong /= '') then
         outcome%why = wrong
         outcome%wrong = .true.
      end if
   end subroutine record
end module point_recording
