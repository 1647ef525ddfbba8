!> From contact at many nodes, where the complementarity problem finds what touches, to points and lines along the rod.
module nodes_to_spans
   use kinds, only: wp
   use model, only: method_cylindrical
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t
   use contact_set_edits, only: same_set, laid_down
   use span_candidates, only: present_contact_spans
   use test_kinds, only: span_test_t, test_slack, test_vanishing
   use node_contacts, only: touches_at_nodes
   use bordered_system, only: linearise
   use next_spans, only: next_t, copy_next, new_next, settle, tests_of, holds
   use reachability, only: leads_to_next
   use path_control, only: set_tangent
   use path_continuity, only: path_tangent_t, relation_t, relate, same_path, too_far
   use path_state, only: path_state_t, path_tangent_of
   use corrector, only: increment_t, take_increment
   implicit none
   private
   public :: find_spans_ahead

   integer, parameter :: open_nodes(3) = [1, 4, 16]
   integer, parameter :: most_increments = 24   !! with contact at nodes

contains

   !> Increments with contact at nodes, longer and longer, until what they say turns into points and lines that hold.
   subroutine find_spans_ahead(problem, run, nodes, on, next, first, found, report, why)
      type(problem_t), intent(in) :: problem     !! where the run stands
      type(path_state_t), intent(in) :: run
      type(problem_t), intent(in) :: nodes       !! sampled
      type(path_state_t), intent(inout) :: on !! the run with these, at the start of the last increment on return, its system
      !! factored anywhere
      type(next_t), intent(out) :: next          !! its touches have the numbers 1, 2, ...
      real(wp), intent(out) :: first             !! load factor that the first increment led to
      logical, intent(out) :: found
      type(increment_t), intent(out) :: report   !! of the last increment
      character(:), allocatable, intent(out) :: why !! not found: the reason; not allocated where no increment converged
      type(state_t) :: ahead
      type(path_tangent_t) :: onward
      type(relation_t) :: relation
      integer :: try
      found = .false.
      first = on%state%load_factor
      do try = 1, most_increments
         if (on%control%method == method_cylindrical) call set_tangent(nodes, on%system, on%heading%u, on%heading%load, on%control)
         call take_increment(nodes, on%state, on%control, ahead, on%system, report)
         if (report%converged) then
            onward = path_tangent_of(nodes, on, ahead)
            relation = relate(nodes, on%state, ahead, on%heading, onward, on%fresh)
            ! From a start there is nothing that directions could be wrong about.
            if (problem%is_sampled()) report%converged = same_path(relation) .and. .not. too_far(nodes, on%control, relation)
            if (.not. report%converged) report%message = 'what equilibrium there is ahead lies on another path'
         end if
         if (.not. report%converged) then
            if (report%hopeless) exit
            call linearise(nodes, on%state, on%state, on%system)
            on%control%increment = 0.5_wp * on%control%increment
            cycle
         end if
         if (.not. allocated(why)) first = ahead%load_factor
         call find_spans(nodes, ahead, next, found, why)
         ! Near a dead end directions are noise: from further away they tell.
         if (found) found = leads_to_next(problem, run, next)
         if (found) exit
         on%state = ahead
         on%heading = onward
         on%fresh = .false.
         on%control%increment = 2.0_wp * on%control%increment
      end do
   end subroutine find_spans_ahead

   !> The contact spans that a converged state of contact at nodes means, and their equilibrium at the same load. Not found where
   !> their tests do not hold: then nodes say more a little further on.
   subroutine find_spans(problem, trial, next, found, why)
      type(problem_t), intent(in) :: problem     !! sampled
      type(state_t), intent(in) :: trial
      type(next_t), intent(out) :: next          !! its touches have the numbers 1, 2, ...
      logical, intent(out) :: found
      character(:), allocatable, intent(out) :: why !! not found: the reason
      type(contact_span_t), allocatable :: touch(:), first(:)
      integer :: wave, k, c
      found = .false.
      ! From what the nodes say to what they may mean.
      waves: do wave = 1, size(open_nodes)
         touch = touches_at_nodes(problem, trial, open_nodes(wave))
         if (wave > 1) then
            if (same_set(touch, first)) cycle waves
         end if
         first = touch
         call take_these()
         if (found) call lay_closed_spans()
         if (found) exit waves
      end do waves

   contains

      !> A free span that as good as lies on the obstacle does so where the line holds, too: its ends carry nothing, and would be
      !> anywhere.
      subroutine lay_closed_spans()
         type(next_t) :: kept
         type(span_test_t), allocatable :: tests(:)
         tests = tests_of(next)
         k = 1
         do while (k <= size(tests))
            if (tests(k)%kind == test_vanishing .and. abs(tests(k)%value) <= test_slack(test_vanishing)) then
               call copy_next(next, kept)
               touch = laid_down(present_contact_spans(next%problem, next%state), tests(k)%beside, tests(k)%ends)
               call take_these()
               if (found) then
                  tests = tests_of(next)
                  k = 0
               else
                  found = .true.
                  call copy_next(kept, next)
               end if
            end if
            k = k + 1
         end do
      end subroutine lay_closed_spans

      !> Equilibrium with these touches, and whether it holds.
      subroutine take_these()
         touch%number = [(c, c=1, size(touch))]
         next = new_next(problem, trial, touch)
         call settle(next, found)
         why = 'equilibrium was not found'
         if (.not. found) return
         why = 'contact did not settle'
         found = holds(next)
      end subroutine take_these
   end subroutine find_spans
end module nodes_to_spans
