!> Converts contact at many nodes, found by the complementarity problem, to point and line contacts along the rod.
module nodes_to_spans
   use kinds, only: wp, parallel
   use model, only: method_cylindrical
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_gap, may_react
   use contact_spans, only: contact_span_t
   use contact_set_edits, only: same_set, laid_down
   use span_candidates, only: present_contact_spans
   use track_nodes, only: rod_angle
   use test_kinds, only: span_test_t, any_fails, test_slack, test_vanishing, test_gap
   use other_set, only: other_set_t, copy_other_set, new_other_set, find_equilibrium, tests_of
   use reachability, only: leads_to_next
   use path_control, only: set_tangent
   use path_continuity, only: relation_t, relate, same_path, too_far
   use path_point, only: path_point_t, advance
   use path_state, only: path_state_t, path_tangent_of
   use corrector, only: increment_t
   implicit none
   private
   public :: find_spans_ahead, most_increments

   integer, parameter :: open_nodes(3) = [1, 4, 16] !! largest counts of consecutive open nodes that count as closed, in the order
   !! in which they are tried. With half and twice these numbers none of 146 decks of the tests changes
   integer, parameter :: most_increments = 24 !! largest number of increments with contact at nodes; with values from 12 to 48 every
   !! deck in input has the same results

contains

   !> Makes increments of growing length with contact at nodes, until the contact corresponds to points and lines that pass their
   !> tests.
   subroutine find_spans_ahead(problem, run, on, next, first, found, report, why)
      type(problem_t), intent(in) :: problem     !! at the start of the path, on a mesh whose nodes detect contact
      type(path_state_t), intent(in) :: run      !! the run at the start of the path
      type(path_state_t), intent(inout) :: on !! in: equal to `run`; out: the run at the start of the last increment
      type(other_set_t), intent(out) :: next          !! its contact spans have the numbers 1, 2, ...
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
         if (on%control%method == method_cylindrical) call set_tangent(problem, on%last%system, on%last%tangent%u, &
            & on%last%tangent%load, on%control)
         call advance(problem, on%last, on%control, ahead, report)
         if (report%converged) then
            ahead%tangent = path_tangent_of(problem, on, ahead)
            relation = relate(problem, on%last%state, ahead%state, on%last%tangent, ahead%tangent, on%fresh)
            ! At the start of a path there is no previous direction with which the increment could be compared.
            report%converged = same_path(relation) .and. .not. too_far(problem, on%control, relation)
            if (.not. report%converged) report%message = 'what equilibrium there is ahead lies on another path'
         end if
         if (.not. report%converged) then
            if (report%hopeless) exit
            on%control%increment = 0.5_wp * on%control%increment
            cycle
         end if
         if (.not. allocated(why)) first = ahead%state%load_factor
         call find_spans(problem, ahead%state, next, found, why)
         ! Close to the run's point the chord to an equilibrium is rounding and may have any direction; farther away it shows
         ! whether the equilibrium is ahead.
         if (found) found = leads_to_next(problem, run, next)
         if (found) exit
         on%last = ahead
         on%fresh = .false.
         on%control%increment = 2.0_wp * on%control%increment
      end do
   end subroutine find_spans_ahead

   !> Finds contact spans that correspond to a converged state of contact at nodes, and their equilibrium at the same load. `found`
   !> is false if the tests of the spans fail; a little further along the path the contact at nodes may correspond to valid contact
   !> spans.
   subroutine find_spans(problem, trial, next, found, why)
      type(problem_t), intent(in) :: problem     !! problem on a mesh whose nodes detect contact
      type(state_t), intent(in) :: trial
      type(other_set_t), intent(out) :: next          !! its contact spans have the numbers 1, 2, ...
      logical, intent(out) :: found
      character(:), allocatable, intent(out) :: why !! reason why no contact spans were found
      type(contact_span_t), allocatable :: contact_span(:), first(:)
      integer :: wave, k, c, i
      found = .false.
      ! The first attempt uses the nodes in contact as they are; further attempts count a few open nodes between nodes in contact as
      ! closed.
      waves: do wave = 1, size(open_nodes)
         contact_span = touches_at_nodes(problem, trial, open_nodes(wave))
         if (wave > 1) then
            if (same_set(contact_span, first)) cycle waves
         end if
         first = contact_span
         call test_these_spans()
         if (found) call fill_closed_spans()
         if (found) exit waves
      end do waves

   contains

      !> Replaces free spans whose largest gap is rounding by line contacts, if the tests allow it: the ends of such free spans
      !> carry no contact force, and their positions would be arbitrary.
      subroutine fill_closed_spans()
         type(other_set_t) :: kept
         type(span_test_t), allocatable :: tests(:)
         tests = tests_of(next)
         k = 1
         do while (k <= size(tests))
            if (tests(k)%kind == test_vanishing .and. abs(tests(k)%value) <= test_slack(test_vanishing)) then
               call copy_other_set(next, kept)
               contact_span = laid_down(present_contact_spans(next%problem, next%state), tests(k)%beside, tests(k)%ends)
               call test_these_spans()
               if (found) then
                  tests = tests_of(next)
                  k = 0
               else
                  found = .true.
                  call copy_other_set(kept, next)
               end if
            end if
            k = k + 1
         end do
      end subroutine fill_closed_spans

      !> Finds the equilibrium with the spans in `contact_span`, stores it in `next`, and runs the tests of the spans.
      subroutine test_these_spans()
         contact_span%number = [(c, c=1, size(contact_span))]
         why = 'two obstacles touch the rod at one place'
         found = .not. any([(any([(meet(contact_span(c), contact_span(i)), i=1, c - 1)]), c=1, size(contact_span))])
         if (.not. found) return
         next = new_other_set(problem, trial, contact_span)
         call find_equilibrium(next, found)
         why = 'equilibrium was not found'
         if (.not. found) return
         why = 'contact did not settle'
         found = .not. any_fails(tests_of(next))
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

   !> Contact spans from rows of consecutive nodes in contact: a row of one or two nodes becomes a point contact, a longer row a
   !> line contact on each of its rod segments. A few open nodes between nodes in contact count as closed, because contact forces
   !> concentrated at nodes make the rod wavy.
   function touches_at_nodes(problem, state, most) result(contact_span)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: most        !! largest number of consecutive open nodes that count as closed
      type(contact_span_t), allocatable :: contact_span(:)
      logical, dimension(problem%candidates%n) :: in_contact, active, done
      integer, allocatable :: run(:)
      logical :: closed
      integer :: c
      allocate (contact_span(0))
      in_contact = nodes_in_contact(problem, state)
      active = in_contact
      do c = 1, problem%candidates%n
         if (.not. in_contact(c)) cycle
         call close_waves(problem, in_contact, c, 1, most, active)
         call close_waves(problem, in_contact, c, 2, most, active)
      end do
      done = .not. active
      do c = 1, problem%candidates%n
         if (done(c)) cycle
         call follow_run(problem, active, c, run, closed)
         done(run) = .true.
         if (size(run) <= 2 .and. all(in_contact(run))) then
            contact_span = [contact_span, point_contact_at(problem, state, run(maxloc(state%reaction(run), 1)))]
         else
            contact_span = [contact_span, lines_along(problem, state, run, closed)]
         end if
      end do
   end function touches_at_nodes

   !> (candidates) true: the node is in contact. Included are nodes at zero gap whose contact force is taken by a support on the
   !> obstacle, if a neighbour node is in contact. At a hinge or at a clamp parallel to the obstacle no such neighbour is needed,
   !> because contact may spread from this support.
   function nodes_in_contact(problem, state) result(in_contact)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      logical :: in_contact(problem%candidates%n)
      real(wp) :: gap, normal(2), bend, angle
      integer :: c
      in_contact = state%active .and. problem%deck%contact(problem%candidates%contact)%along
      do c = 1, problem%candidates%n
         if (in_contact(c) .or. .not. problem%deck%contact(problem%candidates%contact(c))%along) cycle
         call candidate_gap(problem, state, c, gap, normal, bend)
         if (may_react(problem, c, normal)) cycle
         angle = rod_angle(problem, state, c)
         associate (near => problem%candidates%neighbour(:, c))
            if (any(state%active(pack(near, near > 0))) .or. .not. problem%model%fixed(3, problem%candidates%node(c)) .or. &
               & abs(dot_product(normal, [cos(angle), sin(angle)])) <= parallel) &
               & in_contact(c) = gap <= test_slack(test_gap) * problem%size
         end associate
      end do
   end function nodes_in_contact

   !> Marks as closed a few open nodes beside a node in contact, up to the next node in contact or the end of the rod.
   pure subroutine close_waves(problem, in_contact, c, side, most, active)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: in_contact(:)     !! (candidates) true: the node is in contact
      integer, intent(in) :: c, side     !! a candidate in contact; side of it on which open nodes are closed: 1 before, 2 after
      integer, intent(in) :: most
      logical, intent(inout) :: active(:) !! (candidates) set to true for the nodes that are marked as closed
      integer :: at, n
      at = c
      do n = 0, most
         at = problem%candidates%neighbour(side, at)
         if (at == 0) exit
         if (in_contact(at)) exit
      end do
      if (n > most) return
      ! Where the end of a rod lies on its obstacle, a single node may carry the whole contact force, and the nodes beyond it are
      ! open. In the first attempt the nodes up to the end are therefore left open.
      if (at == 0 .and. most == 1) return
      at = problem%candidates%neighbour(side, c)
      do while (at > 0)
         if (active(at)) exit
         active(at) = .true.
         at = problem%candidates%neighbour(side, at)
      end do
   end subroutine close_waves

   !> Finds the row of consecutive active candidates that contains candidate c. If all candidates of a closed chain are active, the
   !> row begins at c.
   pure subroutine follow_run(problem, active, c, run, closed)
      type(problem_t), intent(in) :: problem
      logical, intent(in) :: active(:)
      integer, intent(in) :: c
      integer, allocatable, intent(out) :: run(:)
      logical, intent(out) :: closed     !! true: the row covers a whole closed chain
      integer :: first, at, row(size(active)), n
      first = c
      do
         at = problem%candidates%neighbour(1, first)
         if (at == 0) exit
         if (.not. active(at)) exit
         first = at
         if (first == c) exit
      end do
      n = 0
      at = first
      do
         n = n + 1
         row(n) = at
         at = problem%candidates%neighbour(2, at)
         closed = at == first
         if (at == 0 .or. closed) exit
         if (.not. active(at)) exit
      end do
      run = row(:n)
   end subroutine follow_run

   !> Point contact at the node of a candidate.
   pure type(contact_span_t) function point_contact_at(problem, state, c) result(new)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c
      integer :: side
      side = merge(1, 2, problem%candidates%element(2, c) > 0)
      new%contact = problem%candidates%contact(c)
      new%rod_segment = problem%rod_segment(problem%candidates%element(3 - side, c))
      new%at = end_of(problem, state, problem%candidates%element(3 - side, c), side)
   end function point_contact_at

   !> Line contacts for a row of consecutive nodes in contact, one on each rod segment.
   pure function lines_along(problem, state, run, closed) result(line)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: run(:)      !! candidates of the row
      logical, intent(in) :: closed      !! true: the row covers a whole closed chain
      type(contact_span_t), allocatable :: line(:)
      type(contact_span_t) :: new
      integer :: i, e
      allocate (line(0))
      do i = 1, size(run) - merge(0, 1, closed)
         e = problem%candidates%element(2, run(i))
         if (new%rod_segment /= problem%rod_segment(e) .or. (i > 1 .and. e == problem%element_first(problem%rod_segment(e)))) then
            if (new%rod_segment > 0) line = [line, new]
            new%rod_segment = problem%rod_segment(e)
            new%contact = problem%candidates%contact(run(1))
            new%line = .true.
            new%at(1) = end_of(problem, state, e, 1)
         end if
         new%at(2) = end_of(problem, state, e, 2)
      end do
      line = [line, new]
   end function lines_along

   !> Coordinate along its rod segment of one end of an element; exact at segment boundaries.
   pure real(wp) function end_of(problem, state, e, side)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: e, side
      end_of = state%geometry%element(e)%s(side) + problem%origin(e)
      if (side == 1 .and. e == problem%element_first(problem%rod_segment(e))) end_of = 0.0_wp
      if (side == 2 .and. e == problem%element_last(problem%rod_segment(e))) end_of = &
         & problem%layout%rod_segment(problem%rod_segment(e))%length
   end function end_of
end module nodes_to_spans
