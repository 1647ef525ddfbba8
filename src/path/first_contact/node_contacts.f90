!> Contact at nodes, interpreted as point and line contacts along the rod.
module node_contacts
   use kinds, only: wp, parallel
   use problem, only: problem_t
   use rod_state, only: state_t, candidate_gap, may_react
   use contact_spans, only: contact_span_t
   use track_nodes, only: rod_angle
   use test_kinds, only: test_slack, test_gap
   implicit none
   private
   public :: touches_at_nodes

contains

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
            contact_span = [contact_span, point_at(problem, state, run(maxloc(state%reaction(run), 1)))]
         else
            contact_span = [contact_span, lines_along(problem, state, run, closed)]
         end if
      end do
   end function touches_at_nodes

   !> (candidates) true: the node is in contact. Included are nodes without contact force whose force is taken by a support on the
   !> obstacle: beside nodes in contact; and also without such a neighbour at a hinge or at a clamp parallel to the obstacle,
   !> because contact may spread from there.
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
      integer, intent(in) :: c, side     !! a candidate in contact; side 1: the open nodes are before it, 2: after it
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
      ! At the end of a rod that lies along its obstacle one node may carry the whole contact force.
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

   !> Point contact at a node.
   pure type(contact_span_t) function point_at(problem, state, c) result(new)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: c
      integer :: side
      side = merge(1, 2, problem%candidates%element(2, c) > 0)
      new%contact = problem%candidates%contact(c)
      new%rod_segment = problem%rod_segment(problem%candidates%element(3 - side, c))
      new%at = end_of(problem, state, problem%candidates%element(3 - side, c), side)
   end function point_at

   !> Line contacts for consecutive nodes in contact.
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
end module node_contacts
