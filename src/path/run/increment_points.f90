!> Points of the path inside an increment that has been made, told apart by a fraction of it.
module increment_points
   use kinds, only: wp
   use model, only: method_linearised, method_load
   use problem, only: problem_t
   use rod_state, only: state_t, is_stress_free
   use bordered_system, only: linearise
   use path_control, only: control_t, is_arc_length, metric, path_length, displacement_between
   use path_continuity, only: path_tangent_t, chord_between, seen_from, between, part_at, alike, &
      & stands_still
   use corrector, only: increment_t, take_increment, correct
   use path_state, only: path_state_t
   implicit none
   private
   public :: division_t, new_division, point_within, chord_fraction

   !> What tells fractions of an increment apart.
   type :: division_t
      type(control_t) :: control
      real(wp) :: whole = 0.0_wp                !! the control's increment over all of it
      real(wp) :: slopes(2) = 1.0_wp            !! its rates at both ends, over their mean
      logical :: smooth = .false.               !! no contact set changes, no node moves along the rod
      real(wp), allocatable :: chord(:, :)      !! (3, nodes) displacements, of one and the same material points
      real(wp) :: length = 0.0_wp               !! of the chord, in the metric
   end type division_t

contains

   !> The strategy itself divides increments of load or displacement control. Those of an arc length the load does where it
   !> grows steadily (what rounding adds across the path, much where a structure hardly moves before it buckles, is nothing
   !> to it), else planes normal to the chord.
   type(division_t) function new_division(problem, run, trial, ahead, load_tells) result(division)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(state_t), intent(in) :: trial           !! its end
      type(path_tangent_t), intent(in) :: ahead         !! tangent there
      logical, intent(in) :: load_tells            !! the load grows steadily over the increment
      real(wp) :: rise
      logical :: still
      division%smooth = alike(problem, run%state, trial)
      division%chord = chord_between(problem, run%state, trial)
      division%length = sqrt(metric(problem, division%chord, division%chord))
      associate (control => division%control)
         control = run%control
         division%whole = control%increment
         if (is_arc_length(control%method)) then
            rise = trial%load_factor - run%state%load_factor
            ! Of what nothing moves by more than rounding only the load tells parts.
            still = stands_still(run%heading, rise) .and. stands_still(ahead, rise) .and. abs(rise) > 0.0_wp
            if ((load_tells .and. division%smooth) .or. still) then
               control%method = method_load
               division%whole = rise
               division%slopes = [run%heading%load, ahead%load] * path_length(problem, run%state, trial) / division%whole
            else if (division%length > 0.0_wp) then
               control%method = method_linearised
               control%load_scale = 0.0_wp
               control%tangent = division%chord / division%length
               control%tangent_load = 0.0_wp
               ! As measured at the nodes of the trial: with contact spans they are elsewhere along the rod.
               division%whole = metric(problem, seen_from(problem, trial, run%state, control%tangent), &
                  & displacement_between(problem, run%state, trial))
               division%slopes = [metric(problem, control%tangent, run%heading%u), metric(problem, control%tangent, ahead%u)]
            end if
         end if
         control%whole = division%whole
      end associate
   end function new_division

   !> The point at a fraction of the increment: from a guess between its ends where these are alike, else from its start.
   subroutine point_within(problem, run, trial, ahead, division, fraction, from_start, keep_contact, here, report)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(inout) :: run            !! its system is factored at the point on return
      type(state_t), intent(in) :: trial
      type(path_tangent_t), intent(in) :: ahead
      type(division_t), intent(inout) :: division
      real(wp), intent(in) :: fraction             !! 0 to 1
      logical, intent(in) :: from_start            !! even where they are alike
      logical, intent(in) :: keep_contact          !! that of the start, whatever the signs say
      type(state_t), intent(out) :: here
      type(increment_t), intent(out) :: report
      integer :: first
      division%control%increment = fraction * division%whole
      if (division%smooth .and. .not. from_start) then
         here = between(problem, run%state, trial, run%heading, ahead, part_at(fraction, division%slopes(1), division%slopes(2)))
         call correct(problem, run%state, division%control, .false., here, run%system, report)
         ! Once more: from a guess as good as this a small residual comes before a small error.
         if (.not. report%converged) return
         first = report%iterations
         call correct(problem, run%state, division%control, .false., here, run%system, report)
         report%iterations = first + report%iterations
      else if (size(problem%mark) > 0 .and. is_stress_free(run%state)) then
         ! At such a start nothing tells where contact with foundations ends: from the other end of the increment backwards.
         division%control%increment = division%control%increment - division%whole
         call linearise(problem, trial, trial, run%system)
         call take_increment(problem, trial, division%control, here, run%system, report, keep_contact=keep_contact)
      else
         call linearise(problem, run%state, run%state, run%system)
         call take_increment(problem, run%state, division%control, here, run%system, report, keep_contact=keep_contact)
      end if
   end subroutine point_within

   !> Where a place lies along the chord, 0 to 1: puts places in order that were found in different ways.
   pure real(wp) function chord_fraction(problem, run, division, place) result(fraction)
      type(problem_t), intent(in) :: problem
      type(path_state_t), intent(in) :: run
      type(division_t), intent(in) :: division
      type(state_t), intent(in) :: place
      fraction = min(max(metric(problem, division%chord, chord_between(problem, run%state, place)) / &
         & division%length**2, 0.0_wp), 1.0_wp)
   end function chord_fraction
end module increment_points
