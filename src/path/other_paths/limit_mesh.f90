!> Meshes of a limit curve. The last limit point is remeshed if the error of its load exceeds the tolerance. At the ends of contact
!> with foundations the interface points move along the curve, and the elements beside them are refined as the foundation becomes
!> stiffer.
!>
!> A limit curve over the modulus of a foundation may end with a rigid obstacle (make_rigid). The parts of the rods that carry
!> pressure become contact spans, or contact at nodes if rods or deck do not allow contact spans.
module limit_mesh
   use problem, only: copy_problem, problem_t, new_problem
   use kinds, only: wp
   use model, only: step_t, method_linearised, model_t, limit_curve_t
   use linear_system, only: new_system, system_t
   use span_problem, only: new_span_problem, same_spans, place_spans
   use span_candidates, only: present_contact_spans
   use ground_cuts, only: find_cuts, marked
   use ground_segments, only: assign_segments, segment_at
   use state_transfer, only: carried, carried_field
   use second_parameter, only: problem_at, rigid_problem, carry_state
   use limit_search, only: follower_t, copy_follower, trial_t, set_follower_tangent, search, as_value, small_drop
   use path_continuity, only: path_tangent_at
   use error_report, only: bars_on_curve
   use error_bar, only: error_bars_t
   use mesh_density, only: mesh_density_t
   use mesh_request, only: refinement_t, request_mesh, most_meshes
   use timing, only: count_up, counter_remeshed
   use rod_state, only: state_t
   use span_division, only: outgrown
   use ground_mark, only: cut_t
   use mesh_transfer, only: carry_over
   use path_control, only: control_t
   use corrector, only: increment_t, correct
   use contact_spans, only: contact_span_t, choose_spans
   use force_law, only: carries
   implicit none
   private
   public :: bars_here, refine_limit_point, renew_marks, solve_on_mesh, make_rigid

contains

   !> Computes the error bars of the last limit point.
   subroutine bars_here(follower, bars)
      type(follower_t), intent(in) :: follower
      type(error_bars_t), allocatable, intent(out) :: bars
      call bars_on_curve(follower%problem, follower%state, follower%system, path_tangent_at(follower%problem, follower%system, &
         & follower%control%tangent, follower%control%tangent_load), follower%unit(1), &
         & small_drop * follower%state%load_factor, bars)
   end subroutine bars_here

   !> Locates the last limit point again on finer meshes until the error of its load is within the tolerance. If the search fails on
   !> a mesh, the result on the previous mesh is kept.
   subroutine refine_limit_point(follower, step, bars)
      type(follower_t), intent(inout) :: follower
      type(step_t), intent(in) :: step
      type(error_bars_t), allocatable, intent(out) :: bars !! error bars of the limit point; not allocated: unknown
      type(follower_t) :: kept
      type(trial_t) :: trial
      type(mesh_density_t), allocatable :: demand(:)
      type(refinement_t) :: last
      real(wp) :: place(2), sizes(1 + size(follower%problem%deck%monitor))
      integer :: tries, searches
      logical :: unsettled
      if (.not. (step%error_bars .and. step%asked > 0.0_wp .and. any(follower%problem%layout%rod_segment%placed))) return
      do tries = 0, most_meshes
         call bars_here(follower, bars)
         sizes = abs(follower%state%load_factor)
         call request_mesh(follower%problem, follower%state, bars, sizes, [0], step%asked, .true., tries, .false., last, &
            & unsettled, demand)
         if (.not. allocated(demand)) return
         call copy_follower(follower, kept)
         call take_mesh(follower, demand)
         place = 0.0_wp
         if (follower%system%ok) call search(follower, step, place, [1.0_wp, 0.0_wp], trial, searches)
         if (.not. (follower%system%ok .and. trial%report%converged)) then
            call copy_follower(kept, follower)
            return
         end if
         call count_up(counter_remeshed)
         call copy_problem(trial%problem, follower%problem)
         follower%state = trial%state
         call set_follower_tangent(follower, follower%control%tangent, 0.0_wp)
         deallocate (bars)
      end do
   end subroutine refine_limit_point

   !> Transfers the last limit point (follower_t) to another mesh; its state there is not yet in equilibrium.
   subroutine take_mesh(follower, demand)
      type(follower_t), intent(inout) :: follower
      type(mesh_density_t), intent(in) :: demand(:)
      type(follower_t) :: next
      call copy_follower(follower, next)
      next%base%demand = demand
      next%base = new_span_problem(next%base, present_contact_spans(follower%problem, follower%state), follower%state, &
         & find_cuts(follower%problem, follower%state))
      next%problem = problem_at(next%base, follower%curve, as_value(follower%curve, follower%coordinate))
      next%state = carried(follower%problem, follower%state, next%problem)
      call assign_segments(next%problem, next%state, carried=.true.)
      next%control%tangent = carried_field(follower%problem, follower%state, follower%control%tangent, next%problem, next%state)
      if (allocated(next%control%previous)) deallocate (next%control%previous)
      next%system = new_system(next%problem)
      call set_follower_tangent(next, next%control%tangent, 0.0_wp)
      call copy_follower(next, follower)
   end subroutine take_mesh

   !> Transfers a limit point to a mesh with nodes at the present ends of foundation contact. The present mesh is kept if it has
   !> these nodes and is fine enough beside them.
   subroutine renew_marks(base, problem, state, direction, ok)
      type(problem_t), intent(inout) :: base     !! the problem with the value of the parameter from the deck
      type(problem_t), intent(inout) :: problem
      type(state_t), intent(inout) :: state
      real(wp), allocatable, intent(inout) :: direction(:, :) !! (3, nodes) displacements of the direction along the path
      logical, intent(out) :: ok                 !! false: no equilibrium was found
      type(cut_t), allocatable :: cut(:)
      ok = .true.
      if (size(problem%mark) == 0) return
      cut = find_cuts(problem, state)
      if (marked(problem, state, cut)) then
         if (.not. outgrown(problem, state, cut)) return
      end if
      call solve_on_mesh(new_span_problem(problem, present_contact_spans(problem, state), state, cut), problem, state, &
         & direction, ok)
      if (ok) base = same_spans(base, problem)
   end subroutine renew_marks

   !> Transfers a limit point to a mesh without interface points, on which the ends of contact lie inside elements.
   subroutine take_marks_off(problem, state, direction, ok)
      type(problem_t), intent(inout) :: problem
      type(state_t), intent(inout) :: state
      real(wp), allocatable, intent(inout) :: direction(:, :) !! (3, nodes) displacements of the direction along the path
      logical, intent(out) :: ok                              !! false: no equilibrium was found
      ok = .true.
      if (size(problem%mark) == 0) return
      call solve_on_mesh(new_span_problem(problem, present_contact_spans(problem, state), state), problem, state, direction, &
         & ok)
   end subroutine take_marks_off

   !> Corrects the state to equilibrium on another mesh, in the plane normal to the path direction.
   subroutine solve_on_mesh(next, problem, state, direction, ok)
      type(problem_t), intent(in) :: next
      type(problem_t), intent(inout) :: problem
      type(state_t), intent(inout) :: state
      real(wp), allocatable, intent(inout) :: direction(:, :) !! (3, nodes) displacements of the direction along the path
      logical, intent(out) :: ok                              !! false: no equilibrium was found
      type(state_t) :: there
      type(system_t) :: system
      type(control_t) :: plane
      type(increment_t) :: report
      call carry_over(problem, next, state, direction)
      system = new_system(next)
      plane%method = method_linearised
      plane%tangent = direction
      plane%increment = 0.0_wp
      call copy_problem(next, problem)
      there = state
      call correct(problem, there, plane, .true., state, system, report)
      ok = report%converged
   end subroutine solve_on_mesh

   !> Makes the obstacle of the curve rigid. With contact spans the returned state is in equilibrium; with contact at nodes it is
   !> only a predictor.
   subroutine make_rigid(curve, problem, state, direction, ok)
      type(limit_curve_t), intent(in) :: curve
      type(problem_t), intent(inout) :: problem  !! in: problem at the last limit point; out: the problem with a rigid obstacle
      type(state_t), intent(inout) :: state
      real(wp), allocatable, intent(inout) :: direction(:, :) !! (3, nodes) displacements of the direction along the path
      logical, intent(out) :: ok                 !! false: no equilibrium was found
      type(model_t) :: deck
      deck = problem%deck
      deck%obstacle(curve%obstacle)%rigid = .true.
      where (deck%contact%obstacle == curve%obstacle)
         deck%contact%along = deck%contact%distributed
         deck%contact%distributed = .false.
      end where
      call choose_spans(deck)
      if (all(deck%contact%along .or. deck%contact%obstacle /= curve%obstacle)) then
         call make_line_contacts()
      else
         call take_marks_off(problem, state, direction, ok)
         if (ok) call use_contact_at_nodes()
      end if

   contains

      !> Makes the obstacle of the curve rigid, with contact at nodes.
      subroutine use_contact_at_nodes()
         type(problem_t) :: next
         next = rigid_problem(problem, curve)
         state = carry_state(problem, next, state)
         call copy_problem(next, problem)
      end subroutine use_contact_at_nodes

      !> Replaces the foundation contact that carries pressure by line contacts.
      subroutine make_line_contacts()
         type(problem_t) :: base
         type(contact_span_t), allocatable :: contact_span(:)
         call copy_problem(problem, base)
         deallocate (base%deck)
         base%deck = deck
         call place_spans(new_problem(deck), base)
         contact_span = present_contact_spans(problem, state)
         call solve_on_mesh(new_span_problem(base, [contact_span, pressed_lines(maxval([0, contact_span%number]))], state), &
            & problem, state, direction, ok)
      end subroutine make_line_contacts

      !> Line contacts on the obstacle of the curve: the parts of each rod segment that carry pressure.
      function pressed_lines(last) result(line)
         integer, intent(in) :: last !! largest identity number of a contact span so far; new line contacts continue from it
         type(contact_span_t), allocatable :: line(:)
         type(cut_t), allocatable :: cut(:)
         real(wp), allocatable :: at(:)
         real(wp) :: stiffness
         integer :: contact, rod_segment, k, i, segment
         logical :: before
         allocate (line(0))
         cut = find_cuts(problem, state)
         do contact = 1, size(problem%deck%contact)
            if (problem%deck%contact(contact)%obstacle /= curve%obstacle) cycle
            do rod_segment = 1, size(problem%layout%rod_segment)
               at = [0.0_wp, pack(cut%at, cut%rod_segment == rod_segment .and. cut%contact == contact .and. .not. cut%at_end), &
                  & problem%layout%rod_segment(rod_segment)%length]
               before = .false.
               do k = 1, size(at) - 1
                  call segment_at(problem, state, rod_segment, contact, 0.5_wp * (at(k) + at(k + 1)), segment, stiffness)
                  i = size(line)
                  if (carries(segment) .and. before) then
                     line(i)%at(2) = at(k + 1)
                  else if (carries(segment)) then
                     line = [line, contact_span_t(number=last + i + 1, contact=contact, rod_segment=rod_segment, at=at(k:k + 1), &
                        & line=.true.)]
                  end if
                  before = carries(segment)
               end do
            end do
         end do
      end function pressed_lines
   end subroutine make_rigid
end module limit_mesh
