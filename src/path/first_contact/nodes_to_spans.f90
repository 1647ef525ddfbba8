!> Converts contact at many nodes, found by the complementarity problem, to point and line contacts along the rod.
module nodes_to_spans
   use kinds, only: wp
   use model, only: method_cylindrical
   use problem, only: problem_t
   use rod_state, only: state_t
   use contact_spans, only: contact_span_t
   use contact_set_edits, only: same_set
   use node_contacts, only: touches_at_nodes
   use next_spans, only: next_t, new_next, settle, holds
   use reachability, only: leads_to_next
   use path_control, only: set_tangent
   use path_continuity, only: relation_t, relate, same_path, too_far
   use path_point, only: path_point_t, advance
   use path_state, only: path_state_t, path_tangent_of
   use corrector, only: increment_t
   implicit none
   private
   public :: find_spans_ahead, most_increments

   integer, parameter :: open_nodes(3) = [1, 4, 16]
   integer, parameter :: most_increments = 24 !! largest number of increments with contact at nodes; with values from 12 to 48 every
   !! deck in input has the same results

contains

   !> Makes increments of growing length with contact at nodes, until the contact corresponds to points and lines that pass their
   !> tests.
   subroutine find_spans_ahead(problem, run, nodes, on, next, first, found, report, why)
      type(problem_t), intent(in) :: problem     !! problem at the present point of the path
      type(path_state_t), intent(in) :: run
      type(problem_t), intent(in) :: nodes       !! problem on a mesh whose nodes detect contact
      type(path_state_t), intent(inout) :: on !! in: the run on the mesh of `nodes`; out: the run at the start of the last increment
      type(next_t), intent(out) :: next          !! its contact spans have the numbers 1, 2, ...
      real(wp), intent(out) :: first             !! load factor after the first increment
      logical, intent(out) :: found
      type(increment_t), intent(out) :: report   !! report of the last increment
      character(:), allocatable, intent(out) :: why !! reason of the failure; not allocated if no increment converged
      type(path_point_t) :: ahead
      type(relation_t) :: relation
      integer :: try
      found = .false.
      first = on%last%state%load_factor
      do try = 1, most_increments
         if (on%control%method == method_cylindrical) call set_tangent(nodes, on%last%system, on%last%tangent%u, &
            & on%last%tangent%load, on%control)
         call advance(nodes, on%last, on%control, ahead, report)
         if (report%converged) then
            ahead%tangent = path_tangent_of(nodes, on, ahead)
            relation = relate(nodes, on%last%state, ahead%state, on%last%tangent, ahead%tangent, on%fresh)
            ! At the start of a path there is no previous direction with which the increment could be compared.
            if (problem%is_sampled()) report%converged = same_path(relation) .and. .not. too_far(nodes, on%control, relation)
            if (.not. report%converged) report%message = 'what equilibrium there is ahead lies on another path'
         end if
         if (.not. report%converged) then
            if (report%hopeless) exit
            on%control%increment = 0.5_wp * on%control%increment
            cycle
         end if
         if (.not. allocated(why)) first = ahead%state%load_factor
         call find_spans(nodes, ahead%state, next, found, why)
         ! Close to the point where no increment converged, directions of the path are rounding. Increments further away from it
         ! have a direction.
         if (found) found = leads_to_next(problem, run, next)
         if (found) exit
         on%last = ahead
         on%fresh = .false.
         on%control%increment = 2.0_wp * on%control%increment
      end do
   end subroutine find_spans_ahead

   !> Finds contact spans that correspond to a converged state of contact at nodes, and their equilibrium at the same load. `found`
   !> is false if the tests of the spans fail; slightly further along the path the nodes may represent contact spans better.
   subroutine find_spans(problem, trial, next, found, why)
      type(problem_t), intent(in) :: problem     !! problem on a mesh whose nodes detect contact
      type(state_t), intent(in) :: trial
      type(next_t), intent(out) :: next          !! its contact spans have the numbers 1, 2, ...
      logical, intent(out) :: found
      character(:), allocatable, intent(out) :: why !! reason why no contact spans were found
      type(contact_span_t), allocatable :: contact_span(:), first(:)
      integer :: wave, c, i
      found = .false.
      ! First the nodes in contact are taken literally; further attempts close gaps of a few nodes between them.
      waves: do wave = 1, size(open_nodes)
         contact_span = touches_at_nodes(problem, trial, open_nodes(wave))
         if (wave > 1) then
            if (same_set(contact_span, first)) cycle waves
         end if
         first = contact_span
         call test_these_spans()
         if (found) exit waves
      end do waves

   contains

      !> Finds the equilibrium with the contact spans of `next`, and tests the spans.
      subroutine test_these_spans()
         contact_span%number = [(c, c=1, size(contact_span))]
         why = 'two obstacles touch the rod at one place'
         found = .not. any([(any([(meet(contact_span(c), contact_span(i)), i=1, c - 1)]), c=1, size(contact_span))])
         if (.not. found) return
         next = new_next(problem, trial, contact_span)
         call settle(next, found)
         why = 'equilibrium was not found'
         if (.not. found) return
         why = 'contact did not settle'
         found = holds(next)
      end subroutine test_these_spans

      !> True if two contact spans on different obstacles are at the same place between the ends of a rod segment.
      pure logical function meet(one, other)
         type(contact_span_t), intent(in) :: one, other
         real(wp) :: from, to
         from = max(one%at(1), other%at(1))
         to = min(one%at(2), other%at(2))
         meet = one%contact /= other%contact .and. one%rod_segment == other%rod_segment .and. from <= to .and. &
            & from < problem%layout%rod_segment(one%rod_segment)%length .and. to > 0.0_wp
      end function meet
   end subroutine find_spans
end module nodes_to_spans
