!> Discretisation errors at points of the path. At a point given by the path constraint these are the errors of load factor,
!> monitors and positions of touchdown points. A located event has, in addition, another position on the path of the enriched
!> problem; the distance between the two positions is a further error.
module path_errors
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use kinds, only: wp
   use model, only: method_linearised, method_load, method_displacement
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use path_control, only: control_t, metric, is_arc_length
   use path_continuity, only: path_tangent_t, normal_plane
   use path_events, only: event_limit, event_turning
   use monitors, only: monitor_values
   use displacement_functional, only: left_open
   use tangent_modes, only: bending_stiffness
   use tangent_rounding, only: path_stiffness
   use error_bar, only: resolved, error_bar_t, error_bars_t, new_error_bar, no_error_bars
   use enriched_problem, only: enriched_problem_t, why_no_bars
   use enriched_path, only: enriched_path_t, enriched_point_t, new_finer_path, start_point, next_point, values_beside, &
      & no_convergence
   use bordered_system, only: with_stretch
   use state_functional, only: functional_t
   use error_contributions, only: contributions_t, find_contributions, eigenvalue_shares
   use place_functional, only: moving_ends, places_at, named_place
   use mesh_request, only: value_sizes, motion_sizes, stays_within, idle_motion
   use missed_modes, only: unstable_difference, sign_uncertain
   use hidden_contacts, only: may_be_open, may_touch
   use located_zero, only: zero_t, zero_value, left_of_zero, find_event_gap, between_nodes, located_gap, mode_rounding
   implicit none
   private
   public :: point_errors, event_errors

   !> Position of a located event on the path of the enriched problem. At most two steps lead to this position from the point at
   !> which the original problem has the event.
   type :: crossing_t
      real(wp) :: f = 0.0_wp !! event function of the enriched problem at the point where the original problem has the event
      real(wp) :: slope = 0.0_wp !! derivative of the event function along the path, with respect to the controlled quantity
      real(wp) :: way = 0.0_wp !! first step: distance -f/slope along the path, in units of the controlled quantity
      real(wp), allocatable :: near(:)           !! load factor, monitors and positions of touchdown points after the first step
      real(wp) :: more = 0.0_wp                  !! second step: remaining distance to the zero of the event function
      real(wp), allocatable :: rate(:) !! derivative of the values in `near` with respect to the distance along the path, for the
      !! second step
      real(wp), allocatable :: uncertainty(:) !! change of the values in `near` if elements are enriched twice (two more Gauss
      !! points) instead of once
      real(wp) :: rounding = 0.0_wp !! magnitude of the event function after the first step, if this step is so short that
      !! what remains is rounding; else 0
      character(:), allocatable :: why           !! reason why the event could not be found; not allocated: found
   end type crossing_t

   real(wp), parameter :: small_part = 1.0e-3_wp !! part of an increment over which derivatives along the path are computed
   real(wp), parameter :: longest_part = 0.1_wp !! largest part of an increment over which derivatives are computed: over this part
   !! the path is straight to about the same relative accuracy
   real(wp), parameter :: plain = 1.0_wp / longest_part !! smallest change of the event function, in multiples of its rounding
   !! error, from which a slope is computed
   real(wp), parameter :: next_order = 0.5_wp !! error of the enriched polynomial between nodes, over the difference between the
   !! enriched and the original polynomial; 0.25 to 0.45 measured
   real(wp), parameter :: least_bend = 0.1_wp !! smallest ratio, that is used, of the event function's slope after the first step to
   !! the slope before this step
   real(wp), parameter :: no_modes(0, 0) = reshape([real(wp) ::], [0, 0])
   character(*), parameter :: unresolved = 'elements of a higher order change displacements by more than their size', &
      & not_known = 'sums of contact forces have no estimate', &
      & no_function = 'the value that is zero at this point cannot be computed with elements of a higher order'

contains

   !> Errors at a point of the path. The constraint that fixes the point is: given load, given monitor, or the plane normal to the
   !> path.
   subroutine point_errors(problem, finer, state, system, control, heading, bars, places, keeps_mesh)
      type(problem_t), intent(in) :: problem
      type(enriched_problem_t), intent(inout), target :: finer !! the enriched problem; it is made here if necessary
      type(state_t), intent(in) :: state         !! converged
      type(system_t), intent(in) :: system       !! factored at `state`
      type(control_t), intent(in) :: control
      type(path_tangent_t), intent(in) :: heading     !! path tangent at `state`
      type(error_bars_t), intent(out) :: bars
      logical, intent(in) :: places              !! true: the positions of touchdown points also get error bars
      logical, intent(in), optional :: keeps_mesh !! true: the mesh is not refined because of kinks inside elements, see why_no_bars
      type(enriched_path_t) :: path
      type(enriched_point_t) :: point
      type(contributions_t) :: shares
      type(error_bar_t) :: given
      real(wp), allocatable :: value(:), unseen(:)
      real(wp) :: sizes(2)
      logical :: hidden(problem%model%mesh%n_elements)
      integer, allocatable :: ends(:)
      bars = no_error_bars(size(problem%model%monitor), why_no_bars(problem, state, keeps_mesh))
      hidden = may_be_open(problem, state)
      if (any(hidden)) bars%may_change = hidden
      if (bars%why /= '') return
      ends = [integer ::]
      if (places) ends = moving_ends(problem)
      call begin(problem, finer, state, system, point_constraint(problem, state, control, heading), heading, ends, no_modes, &
         & path, point, shares, value)
      if (point%ok) bars%missed = unstable_difference(problem, state, system, path, point, 0)
      if (point%ok .and. places) bars%unsure = sign_uncertain(problem, state, system, path, point)
      call values_beside(path, point)
      bars%too_coarse = .not. point%ok
      ! Elements given by the deck stay, and the bars tell how coarse they are.
      if (point%ok .and. any(problem%layout%rod_segment%placed)) bars%too_coarse = .not. resolves(problem, state, point%state)
      if (bars%too_coarse) then
         bars%why = no_convergence
         if (point%ok) bars%why = unresolved
         return
      end if
      sizes = motion_sizes(problem, state%u)
      if (may_touch(problem, state, system%force_scale, sizes(1), path%problem, point%state)) bars%may_change = &
         & spread(.true., 1, size(hidden))
      unseen = point%value - value - shares%sum(:size(value))
      call set_bars(problem, state, system, ends, shares, value, point%value - value, unseen, shares%size, shares%rounding, bars)
      ! The quantity prescribed by the constraint has no error.
      given = new_error_bar(0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp)
      if (path%control%method == method_load) bars%load = given
      if (path%control%method == method_displacement) bars%monitor(path%control%monitor) = given
      call move_alloc(point%system, finer%system)
   end subroutine point_errors

   !> True if a mesh resolves the displacements at all: elements of a higher order change them by less than their size. Otherwise
   !> they may be the errors of the mesh alone, and contributions of elements to the change say nothing about finer meshes. Numbers
   !> of interest need not show it, for instance if they are zero by symmetry.
   logical function resolves(problem, state, better)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state         !! equilibrium on the mesh
      type(state_t), intent(in) :: better        !! that with elements of a higher order
      resolves = stays_within(problem, state, better, idle_motion(problem)) .and. stays_within(problem, better, state, &
         & idle_motion(problem))
   end function resolves

   !> Errors of a located event. The distance to the event along the path of the enriched problem is the value of the event function
   !> on the enriched problem, divided by the slope of the function.
   subroutine event_errors(problem, finer, state, system, zero, heading, length, rise, bars, keeps_mesh)
      type(problem_t), intent(in) :: problem
      type(enriched_problem_t), intent(inout), target :: finer !! the enriched problem; it is made here if necessary
      type(state_t), intent(in) :: state         !! located state of the event
      type(system_t), intent(in) :: system       !! factored at `state`
      type(zero_t), intent(in) :: zero           !! test function of the event
      type(path_tangent_t), intent(in) :: heading     !! path tangent at `state`
      real(wp), intent(in) :: length, rise !! arc length, and change of the load factor, of the path increment that contains the
      !! event
      type(error_bars_t), intent(out) :: bars
      logical, intent(in), optional :: keeps_mesh !! true: the mesh is not refined because of kinks inside elements, see why_no_bars
      type(control_t) :: control
      type(enriched_path_t) :: path
      type(enriched_point_t) :: first
      type(crossing_t) :: crossing
      type(contributions_t) :: shares
      real(wp), allocatable :: by_eigenvalue(:)  ! (elements) error contributions to the eigenvalue of a bifurcation
      real(wp), allocatable :: left_out(:, :)    ! (unknowns, any number) null vectors; displacements along them are rounding
      real(wp), allocatable :: modes(:, :), value(:), final(:), unseen(:), sizes(:), rounding(:)
      type(functional_t), allocatable :: gap     ! gap to a foundation, if this gap is the event function; else not allocated
      real(wp) :: reach, local, most, uncertainty, noise
      integer, allocatable :: ends(:)
      integer :: e
      bars = no_error_bars(size(problem%model%monitor), why_no_bars(problem, state, keeps_mesh, located_gap(problem, zero, state)))
      if (bars%why /= '') return
      allocate (modes(size(system%residual), 0))
      if (allocated(zero%modes)) modes = zero%modes
      if (.not. (length > 0.0_wp .or. abs(rise) > 0.0_wp)) then
         bars%why = 'nothing moves there'
         return
      end if
      ! At a bifurcation a lower bound of the displacement keeps the weight of the load from vanishing with small displacements.
      control = normal_plane(problem, state, heading, merge(1.0_wp, 0.0_wp, size(modes, 2) > 0))
      ! Length of the path increment in units of the controlled quantity (the quantity that the constraint prescribes). At a limit
      ! point the load does not contribute to this length; if no node moves, only the load does.
      reach = length
      if (control%method == method_linearised) reach = sqrt(metric(problem, control%tangent, control%tangent)) * length + &
         & control%load_scale**2 * abs(control%tangent_load * rise)
      if (control%method == method_load) reach = abs(rise)
      ends = moving_ends(problem)
      call find_event_gap(problem, zero, state, system, gap)
      left_out = modes
      if (allocated(zero%coincident)) left_out = zero%coincident
      call begin(problem, finer, state, system, control, heading, ends, left_out, path, first, shares, value, gap)
      path%at_limit = zero_is(zero, event_limit)
      if (size(modes, 2) > 0) by_eigenvalue = eigenvalue_shares(problem, system, first%system, modes)
      if (first%ok) call next_point(path, 0.0_wp, first)
      if (.not. first%ok) then
         bars%why = no_convergence
         bars%too_coarse = .true.
         return
      end if
      bars%unfolding = shares%unfolding
      ! The event explains one difference for each null vector in `left_out`. At a limit point it explains one more, because its own
      ! null vector is not in `left_out`.
      bars%missed = unstable_difference(problem, state, system, path, first, size(left_out, 2) + merge(0, 1, size(modes, 2) > 0))
      call find_crossing(path, zero, reach, load_rounding(), first, crossing)
      if (.not. allocated(crossing%why)) call measure_uncertainty(path, zero, first, crossing)
      if (allocated(crossing%why)) then
         bars%why = crossing%why
         bars%too_coarse = bars%why == no_convergence .or. size(modes, 2) > 0
         return
      end if
      bars%way = (crossing%way + crossing%more) / reach * length
      if (zero_is(zero, event_limit)) bars%turned = crossing%f * heading%load < 0.0_wp
      final = crossing%near + (crossing%more - left_of_zero(problem, zero, state) / crossing%slope) * crossing%rate
      unseen = abs(first%value - value - shares%sum(:size(value))) + abs(crossing%more * crossing%rate) + abs(crossing%uncertainty)
      sizes = shares%size(:size(value)) + abs(crossing%near - first%value)
      noise = location_rounding()
      rounding = shares%rounding(:size(value)) + abs(crossing%rate) * noise / abs(crossing%slope)
      if (zero_is(zero, event_limit)) rounding(1) = shares%rounding(1) + 0.5_wp * noise**2 / abs(crossing%slope)
      call between_nodes(problem, zero, state, system, heading%load, path%problem, first%state, crossing%f, e, local, &
         & most, uncertainty)
      call share_way()
      call set_bars(problem, state, system, ends, shares, value, final - value, unseen, sizes, rounding, bars)
      call move_alloc(first%system, finer%system)

   contains

      !> Distributes the error of the event's position over the elements. The weights are the elements' contributions: for a
      !> bifurcation, those to the eigenvalue and to the positions of touchdown points; for an end of foundation contact, those to
      !> the gap; otherwise, those to the load. The part of the error that does not come from nodal values belongs to the element
      !> that contains the event.
      subroutine share_way()
         real(wp) :: part(size(shares%element, 2)), moved, own, by_event
         integer :: m
         part = shares%element(1, :)
         if (allocated(by_eigenvalue)) part = bifurcation_shares()
         do m = 1, size(value)
            moved = abs(final(m) - first%value(m))
            by_event = abs(crossing%rate(m) / crossing%slope)
            own = min(abs(local) * by_event, moved)
            if (allocated(gap)) then
               shares%element(m, :) = shares%element(m, :) + shares%element(size(value) + 1, :) * by_event
               shares%inside(m) = abs(shares%inside(m)) + shares%inside(size(value) + 1) * by_event
            else if (sum(part) > 0.0_wp) then
               shares%element(m, :) = shares%element(m, :) + (moved - own) * part / sum(part)
            end if
            if (e == 0) cycle
            own = max(own, next_order * most * by_event) + uncertainty * by_event
            shares%element(m, e) = shares%element(m, e) + own
            shares%inside(m) = abs(shares%inside(m)) + own
         end do
      end subroutine share_way

      !> Contributions of the elements to the eigenvalue of a bifurcation. The contributions for fixed touchdown points are known
      !> for each element. The rest of the eigenvalue's error comes from moved touchdown points and is distributed in proportion to
      !> the contributions to their positions.
      function bifurcation_shares() result(part)
         real(wp) :: part(size(shares%element, 2)), of_ends(size(shares%element, 2)), rest
         part = by_eigenvalue
         of_ends = sum(shares%element(size(value) - size(ends) + 1:size(value), :), dim=1)
         rest = abs(crossing%f) - sum(part)
         if (rest > 0.0_wp .and. sum(of_ends) > 0.0_wp) part = part + rest * of_ends / sum(of_ends)
      end function bifurcation_shares

      !> Rounding error of the load rate if the load rate is the event function; otherwise zero.
      real(wp) function load_rounding() result(error)
         real(wp) :: stiffness, rounding, work
         error = 0.0_wp
         ! At a limit point located to the last bit the stiffness is singular, and the factorisation has added springs at unknowns:
         ! the solution of these equations is then not the path tangent.
         if (.not. zero_is(zero, event_limit) .or. system%factor%deficient) return
         call path_stiffness(problem, state, system, stiffness, rounding)
         work = abs(dot_product(system%tangent, system%load) * heading%load)
         if (work > 0.0_wp) error = rounding / work
      end function load_rounding

      !> Rounding error of the event function: load rate, rate of a monitor, or eigenvalue.
      real(wp) function location_rounding() result(error)
         real(wp) :: stiffness, rounding
         error = 0.0_wp
         if (zero_is(zero, event_limit)) then
            error = load_rounding()
            if (error > 0.0_wp .or. system%factor%deficient) error = max(error, crossing%rounding)
         else if (zero_is(zero, event_turning)) then
            ! The path tangent has the relative error of the stiffness along the path. This error, times the turn of the path over
            ! the increment, is the error of the monitor's rate.
            call path_stiffness(problem, state, system, stiffness, rounding)
            stiffness = max(stiffness, bending_stiffness(problem))
            error = rounding / stiffness * abs(crossing%slope) * reach
         else if (allocated(zero%modes)) then
            error = mode_rounding(problem, state, system, zero%modes(:, 1))
         end if
      end function location_rounding
   end subroutine event_errors

   !> True if the zero is an event of the given kind whose event function is smooth there.
   pure logical function zero_is(zero, kind)
      type(zero_t), intent(in) :: zero
      integer, intent(in) :: kind                !! kind of event: event_...
      zero_is = .false.
      if (.not. allocated(zero%event)) return
      ! A limit point at a corner of a force law is excluded: there the load rate jumps from one sign to the other.
      zero_is = zero%event%kind == kind .and. zero%event%law%candidate == 0
   end function zero_is

   !> Locates the event on the path of the enriched problem. A first step covers the distance -f/slope (event function f); a second
   !> distance follows from the remaining value of f. If the first distance is short, no further point is computed, except at a
   !> limit point.
   subroutine find_crossing(path, zero, reach, rounding, first, crossing)
      type(enriched_path_t), intent(in) :: path
      type(zero_t), intent(in) :: zero           !! test function of the event
      real(wp), intent(in) :: reach              !! increment that contains the event, in units of the controlled quantity
      real(wp), intent(in) :: rounding           !! rounding error of the event function; 0: unknown
      type(enriched_point_t), intent(in) :: first   !! point of the enriched path at which the original problem has the event
      type(crossing_t), intent(out) :: crossing
      type(enriched_point_t) :: ahead, near
      real(wp) :: part, f_ahead, bend
      logical :: known
      associate (f => crossing%f, slope => crossing%slope, way => crossing%way, more => crossing%more, control => path%control)
         f = value_at(first)
         part = small_part
         do
            ahead = first
            call next_point(path, part * reach, ahead)
            if (.not. ahead%ok) then
               crossing%why = no_convergence
               return
            end if
            f_ahead = value_at(ahead)
            if (.not. (ieee_is_finite(f) .and. ieee_is_finite(f_ahead))) then
               crossing%why = no_function
               return
            end if
            ! The slope is taken over a distance so long that the change of the event function exceeds rounding.
            if (abs(f_ahead - f) > plain * rounding .or. part >= longest_part) exit
            part = 10.0_wp * part
         end do
         slope = (f_ahead - f) / (part * reach)
         crossing%rate = (ahead%value - first%value) / (part * reach)
         known = ieee_is_finite(slope)
         if (known) known = abs(slope) > 0.0_wp
         if (.not. known) then
            crossing%why = no_function
            return
         end if
         way = -f / slope
         if (abs(way) <= part * reach .and. .not. zero_is(zero, event_limit)) then
            ! The zero lies between two points that have already been computed.
            crossing%near = first%value + way * crossing%rate
            crossing%rate(1) = load_rate(first%heading)
            return
         end if
         near = first
         call next_point(path, way, near)
         if (.not. near%ok) then
            crossing%why = no_convergence
            return
         end if
         ! The remaining distance follows from the event function at the end of the first step.
         more = value_at(near)
         if (.not. ieee_is_finite(more)) then
            crossing%why = no_function
            return
         end if
         ! The slope at the end of a long first step shows whether the enriched path has this event at all. The length of the step
         ! follows from the slope at its start. With the values f at the start and `more` at the end, the slope of a parabola at the
         ! end is 1 - 2 more/f times its slope at the start.
         bend = 1.0_wp
         if (abs(way) > part * reach) then
            bend = 1.0_wp - 2.0_wp * more / f
         else
            crossing%rounding = abs(more)
         end if
         more = -more / (slope * max(bend, least_bend))
         crossing%near = near%value
         crossing%rate(1) = load_rate(near%heading)
         ! At a limit point the event function is the load rate. It decreases linearly to zero, so that its mean over the remaining
         ! distance is half of its value.
         if (zero_is(zero, event_limit)) crossing%rate(1) = 0.5_wp * crossing%rate(1)
      end associate

   contains

      !> Event function at a point of the enriched path.
      real(wp) function value_at(point)
         type(enriched_point_t), intent(in) :: point
         value_at = zero_value(path%problem, zero, point%state, point%system, point%heading%load)
      end function value_at

      !> Derivative of the load factor with respect to the controlled quantity along the enriched path.
      real(wp) function load_rate(heading) result(rate)
         type(path_tangent_t), intent(in) :: heading   !! path tangent at a point of the enriched path
         rate = 1.0_wp
         if (path%control%method /= method_load) rate = heading%load / (metric(path%problem, path%control%tangent, heading%u) + &
            & path%control%load_scale**2 * path%control%tangent_load * heading%load)
      end function load_rate
   end subroutine find_crossing

   !> Uncertainty of the path of the enriched problem: change of the values at the event if the elements get one more Gauss point.
   !> On meshes that hardly resolve the solution this change is as large as that of the first enrichment.
   subroutine measure_uncertainty(path, zero, first, crossing)
      type(enriched_path_t), intent(in) :: path
      type(zero_t), intent(in) :: zero           !! test function of the event
      type(enriched_point_t), intent(in) :: first   !! point of the enriched path at which the original problem has the event
      type(crossing_t), intent(inout) :: crossing
      type(enriched_problem_t), target :: finest
      type(enriched_path_t) :: next
      type(enriched_point_t) :: point
      call new_finer_path(path%problem, finest, first%state, path%control, path%heading, path%ends, next)
      next%modes = path%modes
      next%at_limit = path%at_limit
      call start_point(next, finest, point)
      call next_point(next, 0.0_wp, point)
      if (.not. point%ok) then
         crossing%why = no_convergence
         return
      end if
      crossing%uncertainty = point%value - first%value - crossing%rate / crossing%slope * (zero_value(next%problem, zero, &
         & point%state, point%system, point%heading%load) - crossing%f)
   end subroutine measure_uncertainty

   !> Constraint that identifies the same point on the paths of the original and the enriched problem: the load or monitor
   !> prescribed by the strategy, else the plane normal to the path.
   function point_constraint(problem, state, control, heading) result(held)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(control_t), intent(in) :: control
      type(path_tangent_t), intent(in) :: heading
      type(control_t) :: held
      held%method = control%method
      held%monitor = control%monitor
      if (is_arc_length(control%method)) held = normal_plane(problem, state, heading)
   end function point_constraint

   !> Linearises the enriched problem at the point of the original problem, and computes the error contributions of the elements.
   subroutine begin(problem, finer, state, system, control, heading, ends, modes, path, point, shares, value, gap)
      type(problem_t), intent(in) :: problem
      type(enriched_problem_t), intent(inout), target :: finer
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system
      type(control_t), intent(in) :: control
      type(path_tangent_t), intent(in) :: heading
      integer, intent(in) :: ends(:)             !! candidates of the touchdown points whose positions are values
      real(wp), intent(in) :: modes(:, :) !! (unknowns, multiplicity) null vectors of a bifurcation; no columns at other points
      type(enriched_path_t), intent(out) :: path
      type(enriched_point_t), intent(out) :: point
      type(contributions_t), intent(out) :: shares
      real(wp), allocatable, intent(out) :: value(:) !! load factor, monitors, and positions of touchdown points
      type(functional_t), intent(in), optional :: gap !! gap to a foundation, if this gap is the event function
      call new_finer_path(problem, finer, state, control, heading, ends, path)
      path%modes = modes
      call start_point(path, finer, point)
      value = [state%load_factor, monitor_values(problem, state, system), places_at(problem, state, ends)]
      if (system%rigidity%n > 0) then
         call find_contributions(problem, state, with_stretch(system), path%problem, point%state, point%system, control, ends, &
            & modes, shares, gap)
      else
         call find_contributions(problem, state, system, path%problem, point%state, point%system, control, ends, modes, shares, gap)
      end if
   end subroutine begin

   !> Error bars from the estimates. Inside an element the enriched polynomial is only one order better than the original one, not
   !> two. The true error of a monitor there may be twice the estimate, so that a bound of it (shares%inside) is added to the bar.
   subroutine set_bars(problem, state, system, ends, shares, value, correction, unseen, sizes, rounding, bars)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(system_t), intent(in) :: system       !! factored at `state`
      integer, intent(in) :: ends(:)             !! candidates of the touchdown points
      type(contributions_t), intent(in) :: shares
      real(wp), intent(in) :: value(:), correction(:), unseen(:), sizes(:), rounding(:)
      type(error_bars_t), intent(inout) :: bars
      real(wp) :: noise(size(value)), kind_size(size(value))
      integer :: m, n, k
      noise = rounding + 4.0_wp * epsilon(noise) * abs(value)
      n = 1 + size(bars%monitor)
      ! Reference value of each number. An error below `resolved` times this value counts as bounded (error_bar). With `resolved` as
      ! the allowed error, value_sizes keeps this product above the rounding of positions and forces.
      kind_size(:n) = value_sizes(problem, system%force_scale, abs(state%load_factor), motion_sizes(problem, state%u), resolved)
      kind_size(n + 1:) = problem%size
      if (shares%known(1)) bars%load = new_error_bar(correction(1), unseen(1), sizes(1), noise(1), kind_size(1))
      bars%load%bar = bars%load%bar + abs(shares%inside(1))
      do m = 1, size(bars%monitor)
         if (.not. shares%known(m + 1)) cycle
         bars%monitor(m) = new_error_bar(correction(m + 1), unseen(m + 1), sizes(m + 1), noise(m + 1), kind_size(m + 1))
         bars%monitor(m)%bar = bars%monitor(m)%bar + abs(shares%inside(m + 1))
         associate (bar => bars%monitor(m))
            bar%no_number = bar%bounded .and. abs(value(m + 1)) <= bar%bar .and. 2.0_wp * bar%rounding >= bar%bar
         end associate
      end do
      bars%share = shares%element(:n, :)
      bars%rest = shares%rest(:n)
      if (size(ends) > 0) allocate (bars%place(size(ends)))
      do k = 1, size(ends)
         bars%place(k) = named_place(problem, ends(k), value(n + k))
         bars%place(k)%bar = new_error_bar(correction(n + k), unseen(n + k), sizes(n + k), noise(n + k), kind_size(n + k))
      end do
      if (.not. all(shares%known)) bars%why = not_known
      do m = 1, size(bars%monitor)
         if (left_open(problem, m, state, system)) bars%monitor(m) = error_bar_t()
      end do
   end subroutine set_bars
end module path_errors
