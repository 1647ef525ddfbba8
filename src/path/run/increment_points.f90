!> Points of the path inside a completed increment, given by their fraction of the increment.
module increment_points
   use kinds, only: wp
   use model, only: method_linearised, method_load
   use problem, only: problem_t
   use rod_state, only: state_t, is_stress_free
   use path_control, only: control_t, is_arc_length, metric, path_length, displacement_between
   use path_continuity, only: chord_between, transferred_field, between, part_at, alike, stands_still
   use corrector, only: increment_t, correct
   use path_point, only: path_point_t, advance, evaluate_tests
   use path_state, only: path_state_t, path_tangent_of
   implicit none
   private
   public :: increment_measure_t, new_measure, point_within, chord_fraction, part_of_increment

   !> How fractions of an increment are measured: the constraint of points inside the increment, and scales.
   type :: increment_measure_t
      type(control_t) :: control                 !! constraint of points inside the increment
      real(wp) :: whole = 0.0_wp !! change of the controlled quantity over the whole increment, in the quantity's units
      real(wp) :: slopes(2) = 1.0_wp !! derivatives of the controlled quantity by the fraction at both ends, divided by the mean
      !! derivative over the increment
      logical :: smooth = .false.               !! true: no contact change inside the increment, and no node moves along its rod
      real(wp), allocatable :: chord(:, :) !! (3, nodes) difference of the displacements at both ends, for the same material points
      real(wp) :: length = 0.0_wp               !! length of the chord in the path metric
   end type increment_measure_t

contains

   !> Chooses the constraint for points inside an increment. Under load or displacement control the constraint prescribes the
   !> controlled quantity. Inside an arc-length increment it prescribes the load factor if this changes monotonically: such points
   !> are not affected by rounding transverse to the path, which is large in structures that hardly move before they buckle.
   !> Otherwise the points lie in planes normal to the chord of the increment.
   type(increment_measure_t) function new_measure(problem, run, trial, steady_load) result(measure)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial      !! end of the increment
      logical, intent(in) :: steady_load            !! true: the load changes monotonically over the increment
      real(wp) :: rise
      logical :: still
      measure%smooth = alike(problem, run%last%state, trial%state)
      measure%chord = chord_between(problem, run%last%state, trial%state)
      measure%length = sqrt(metric(problem, measure%chord, measure%chord))
      associate (control => measure%control, ahead => trial%tangent)
         control = run%control
         measure%whole = control%increment
         if (is_arc_length(control%method)) then
            rise = trial%state%load_factor - run%last%state%load_factor
            ! If no node moves by more than rounding, only the load can divide the increment.
            still = stands_still(run%last%tangent, rise) .and. stands_still(ahead, rise) .and. abs(rise) > 0.0_wp
            if ((steady_load .and. measure%smooth) .or. still) then
               control%method = method_load
               measure%whole = rise
               measure%slopes = [run%last%tangent%load, ahead%load] * path_length(problem, run%last%state, &
                  & trial%state) / measure%whole
            else if (measure%length > 0.0_wp) then
               control%method = method_linearised
               control%load_scale = 0.0_wp
               control%tangent = measure%chord / measure%length
               control%tangent_load = 0.0_wp
               ! The chord connects the positions of the same material points, the nodes of the trial: contact spans move nodes
               ! along their rods.
               measure%whole = metric(problem, transferred_field(problem, trial%state, run%last%state, control%tangent), &
                  & displacement_between(problem, run%last%state, trial%state))
               measure%slopes = [metric(problem, control%tangent, run%last%tangent%u), metric(problem, control%tangent, ahead%u)]
            end if
         end if
         control%whole = measure%whole
      end associate
   end function new_measure

   !> Corrects the point at a fraction of the increment. If both ends of the increment have the same contact set, the predictor is
   !> `near` or a point interpolated between the ends. Otherwise the corrector starts from the first end.
   subroutine point_within(problem, run, trial, measure, fraction, from_start, keep_contact, here, report, near)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial      !! end of the increment
      type(increment_measure_t), intent(inout) :: measure
      real(wp), intent(in) :: fraction             !! fraction of the increment, 0 to 1
      logical, intent(in) :: from_start !! true: the corrector starts from the first end even if interpolation is possible
      logical, intent(in) :: keep_contact !! true: the contact set of the first end is kept, even if gaps or reactions have the
      !! wrong sign
      type(path_point_t), intent(out) :: here      !! undefined unless report%converged
      type(increment_t), intent(out) :: report
      type(path_point_t), intent(in), optional :: near !! known point of the increment, used as predictor
      measure%control%increment = fraction * measure%whole
      if (measure%smooth .and. .not. from_start) then
         if (present(near)) then
            here%state = near%state
         else
            here%state = between(problem, run%last%state, trial%state, run%last%tangent, trial%tangent, part_at(fraction, &
               & measure%slopes(1), measure%slopes(2)))
         end if
         here%system = run%last%system
         call correct(problem, run%last%state, measure%control, .false., here%state, here%system, report, exact=0.0_wp)
      else if (size(problem%mark) > 0 .and. is_stress_free(run%last%state)) then
         ! At a stress-free start the end of contact with a foundation is undefined. The point is then found from the other end of
         ! the increment, by an increment backwards.
         measure%control%increment = measure%control%increment - measure%whole
         call advance(problem, trial, measure%control, here, report, keep_contact)
      else
         call advance(problem, run%last, measure%control, here, report, keep_contact)
      end if
      if (.not. report%converged) return
      here%tangent = path_tangent_of(problem, run, here)
      call evaluate_tests(problem, here)
   end subroutine point_within

   !> Position of a state within the increment, from 0 to 1: the projection of the state onto the chord between the ends. Events
   !> that were located by different methods are ordered by this position.
   pure real(wp) function chord_fraction(problem, run, measure, place) result(fraction)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(increment_measure_t), intent(in) :: measure
      type(state_t), intent(in) :: place
      fraction = min(max(metric(problem, measure%chord, chord_between(problem, run%last%state, place)) / &
         & measure%length**2, 0.0_wp), 1.0_wp)
   end function chord_fraction
   !> Fraction of an increment at a state inside the increment. The fraction is that of the load change if new_measure chose the
   !> load as constraint, else that of the chord, onto which the state is projected.
   pure real(wp) function part_of_increment(problem, run, trial, measure, place) result(fraction)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(path_point_t), intent(in) :: trial      !! end of the increment
      type(increment_measure_t), intent(in) :: measure
      type(state_t), intent(in) :: place
      real(wp) :: rise
      rise = trial%state%load_factor - run%last%state%load_factor
      if (measure%control%method == method_load .and. abs(rise) > 0.0_wp) then
         fraction = min(max((place%load_factor - run%last%state%load_factor) / rise, 0.0_wp), 1.0_wp)
      else if (measure%length > 0.0_wp) then
         fraction = chord_fraction(problem, run, measure, place)
      else
         fraction = 1.0_wp
      end if
   end function part_of_increment
end module increment_points
