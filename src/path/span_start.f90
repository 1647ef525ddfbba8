!> The start of a path with contact spans: nodes find out what touches.
module span_start
   use kinds, only: wp
   use problem, only: problem_t
   use rod_state, only: state_t
   use linear_system, only: system_t
   use bordered_system, only: linearise
   use contact_touch, only: touch_t, covers
   use span_problem, only: new_span_problem, new_sampled_problem, chain_starts
   use nodal_touches, only: along
   use nodes_to_spans, only: find_spans
   use state_transfer, only: carried
   use path_control, only: displacement_between, is_arc_length, set_tangent
   use path_run, only: run_t, forget_mesh
   use path_continuity, only: heading_at
   use path_events, only: new_probe
   use rod_geometry, only: geometry_t, new_geometry
   use obstacle_geometry, only: obstacle_gap
   use timing, only: timers_t
   implicit none
   private
   public :: prepare_spans, enter_spans

   integer, parameter :: max_tries = 30  !! increments with contact at nodes

contains

   !> The problem that a path with contact spans starts with: without spans where nothing touches yet, else with nodes that find
   !> out what does. Unchanged where the deck has no contact that spans describe.
   subroutine prepare_spans(problem)
      type(problem_t), intent(inout) :: problem      !! of the deck
      type(touch_t), allocatable :: clamp(:)
      real(wp) :: gap, normal(2), bend
      logical :: touches
      integer :: k, i
      if (.not. any(problem%deck%contact%along)) return
      allocate (problem%covered(size(problem%layout%stretch), size(problem%deck%contact)))
      do k = 1, size(problem%deck%contact)
         problem%covered(:, k) = covers(problem%deck, problem%layout, k)
      end do
      problem%chain_start = chain_starts(problem)
      touches = .false.
      allocate (clamp(0))
      do k = 1, size(problem%deck%contact)
         associate (contact => problem%deck%contact(k))
            if (.not. contact%along) cycle
            do i = 1, size(contact%node)
               call obstacle_gap(problem%deck%obstacle(contact%obstacle), problem%deck%mesh%x(:, contact%node(i)), gap, normal, &
                  & bend)
               if (gap + contact%gap + problem%overlap(k) > 1.0e-10_wp * problem%size) cycle
               if (clamped_along(problem, k, contact%node(i), normal)) then
                  clamp = [clamp, touch_at_end(problem, k, contact%node(i), size(clamp) + 1)]
               else
                  touches = .true.
               end if
            end do
         end associate
      end do
      if (touches) then
         problem = new_sampled_problem(problem)
      else
         problem = new_span_problem(problem, clamp)
      end if
   end subroutine prepare_spans

   !> True for the end of a rod that a support clamps along the obstacle: contact may spread from there, but does not carry
   !> anything yet.
   logical function clamped_along(problem, contact, node, normal) result(clamped)
      type(problem_t), intent(in) :: problem         !! of the deck
      integer, intent(in) :: contact, node
      real(wp), intent(in) :: normal(2)              !! of the obstacle there
      type(geometry_t) :: home
      real(wp) :: angle
      integer :: e, side
      clamped = problem%model%fixed(3, node) .and. count(problem%beside(:, node) > 0) == 1 .and. &
         & all(problem%model%fixed(1:2, node) .or. abs(normal) <= along)
      if (.not. clamped) return
      side = merge(1, 2, problem%beside(2, node) > 0)
      e = problem%beside(3 - side, node)
      home = new_geometry(problem%model, problem%tableau)
      angle = home%element(e)%end_angle(side)
      clamped = problem%covered(problem%stretch(e), contact) .and. abs(dot_product(normal, [cos(angle), sin(angle)])) <= along
   end function clamped_along

   !> A point contact at such an end.
   type(touch_t) function touch_at_end(problem, contact, node, number) result(touch)
      type(problem_t), intent(in) :: problem         !! of the deck
      integer, intent(in) :: contact, node, number
      touch%contact = contact
      touch%number = number
      touch%stretch = problem%stretch(maxval(problem%beside(:, node)))
      if (problem%beside(1, node) > 0) touch%at = problem%layout%stretch(touch%stretch)%length
   end function touch_at_end

   !> Takes a converged state of contact at nodes for one of contact spans, and the run with it. Where that fails the run goes on
   !> with contact at nodes, and tries again later.
   subroutine enter_spans(problem, run, trial, entered, timers)
      type(problem_t), intent(inout) :: problem  !! sampled on entry
      type(run_t), intent(inout) :: run
      type(state_t), intent(inout) :: trial
      logical, intent(out) :: entered
      type(timers_t), intent(inout) :: timers
      type(problem_t) :: next
      type(system_t) :: system
      type(state_t) :: state
      character(:), allocatable :: why
      integer :: k
      call find_spans(problem, trial, next, state, system, entered, why, timers)
      if (.not. entered) then
         run%span_tries = run%span_tries + 1
         if (run%span_tries > max_tries) run%stuck = 'contact at nodes did not turn into points and lines along the rod: '//why
         call linearise(problem, trial, run%state, run%system, timers)
         return
      end if
      run%span_tries = 0
      do k = 1, size(next%touch)
         next%touch(k)%number = run%touches + k
      end do
      run%touches = run%touches + size(next%touch)
      run%state = carried(problem, run%state, next)
      run%system = system
      problem = next
      trial = state
      call forget_mesh(run)
      run%heading = heading_at(problem, run%system, displacement_between(problem, run%state, trial), &
         & trial%load_factor - run%state%load_factor)
      if (is_arc_length(run%control%method)) &
         & call set_tangent(problem, run%system, run%heading%u, run%heading%load, run%control)
      run%probe = new_probe(problem, run%state, run%system, run%heading%load)
   end subroutine enter_spans
end module span_start
