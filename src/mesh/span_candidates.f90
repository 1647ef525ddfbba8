!> Contact candidates for contact spans, one for each node in contact, and the positions of the ends of contact spans in a state.
module span_candidates
   use kinds, only: wp, pi, parallel
   use model, only: obstacle_of
   use problem, only: problem_t
   use reference_curve, only: curve_point
   use rod_state, only: state_t
   use remeshed_model, only: division_t
   use contact_spans, only: contact_span_t
   use candidates, only: add_candidates, twins
   use conforming_element, only: conforming_size
   implicit none
   private
   public :: add_span_candidates, present_contact_spans, touch_place, rolls_at

contains

   !> For each node in contact with an obstacle, adds a candidate that is always active. Line contacts on both sides of a segment
   !> boundary share the candidate at the boundary.
   subroutine add_span_candidates(problem, division)
      type(problem_t), intent(inout) :: problem
      type(division_t), intent(in) :: division(:)    !! (rod segments) coordinates of the mesh nodes along the segment
      integer :: last(problem%model%mesh%n_nodes), first(size(problem%contact_span)), end(size(problem%contact_span))
      integer, allocatable :: contact(:), earlier(:), which(:)
      integer :: k, i, c, n, before, side, e, before_all, segment_first, segment_last
      do k = 1, size(problem%contact_span)
         associate (span => problem%contact_span(k), at => division(problem%contact_span(k)%rod_segment)%at)
            first(k) = findloc(at >= span%at(1), .true., 1)
            end(k) = findloc(at <= span%at(2), .true., 1, back=.true.)
         end associate
      end do
      n = sum(end - first + 1)
      allocate (contact(n), earlier(n), which(n))
      last = 0
      before_all = problem%candidates%n
      c = 0
      n = 0
      do k = 1, size(problem%contact_span)
         do i = first(k), end(k)
            n = n + 1
            which(n) = last(node_of(problem%contact_span(k)%rod_segment, i))
            do while (which(n) > 0)
               if (contact(which(n)) == problem%contact_span(k)%contact) exit
               which(n) = earlier(which(n))
            end do
            if (which(n) > 0) cycle
            c = c + 1
            which(n) = c
            contact(c) = problem%contact_span(k)%contact
            earlier(c) = last(node_of(problem%contact_span(k)%rod_segment, i))
            last(node_of(problem%contact_span(k)%rod_segment, i)) = c
         end do
      end do
      call add_candidates(problem%candidates, c)
      n = 0
      do k = 1, size(problem%contact_span)
         associate (contact_span => problem%contact_span(k), list => problem%candidates)
            segment_first = problem%element_first(contact_span%rod_segment)
            segment_last = problem%element_last(contact_span%rod_segment)
            before = 0
            contact_span%element = segment_first - 1 + [first(k), end(k) - 1]
            contact_span%candidate = before_all + which(n + [1, end(k) - first(k) + 1])
            do i = first(k), end(k)
               n = n + 1
               c = before_all + which(n)
               ! Node i of the segment is the node between elements e - 1 and e.
               e = segment_first + i - 1
               if (list%contact_span(c) == 0) then
                  list%node(c) = node_of(contact_span%rod_segment, i)
                  list%contact(c) = contact_span%contact
                  list%obstacle(c) = obstacle_of(problem%deck%contact(contact_span%contact), problem%deck%mesh%node(:, &
                     & problem%layout%rod_segment(contact_span%rod_segment)%element(1)))
                  list%gap_offset(c) = problem%model%contact(contact_span%contact)%gap
                  list%overlap(c) = problem%overlap(contact_span%contact)
                  list%bilateral(c) = .true.
                  list%contact_span(c) = k
                  list%moves(c) = e > segment_first .and. e <= segment_last .and. (.not. contact_span%line .or. i == first(k) .or. &
                     & i == end(k))
               end if
               list%follows(c) = contact_span%line .or. list%follows(c)
               if (e > segment_first) list%element(1, c) = e - 1
               if (e <= segment_last) list%element(2, c) = e
               if (before > 0) then
                  list%neighbour(2, before) = c
                  list%neighbour(1, c) = before
                  problem%conforms(e - 1) = before
                  problem%z_size(e - 1) = conforming_size(problem%model%mesh%stages(e - 1))
               end if
               before = c
            end do
         end associate
      end do
      associate (list => problem%candidates)
         do c = before_all + 1, list%n
            do side = 1, 2
               e = problem%beside(side, list%node(c))
               if (e == 0 .or. list%element(side, c) > 0) cycle
               if (problem%covered(problem%rod_segment(e), list%contact(c))) list%element(side, c) = e
            end do
            list%rolls(c) = .not. list%follows(c)
            if (.not. list%moves(c)) list%rolls(c) = list%rolls(c) .and. runs_through(problem, list%element(:, c))
            ! A line contact with another obstacle beside this node fixes the direction of the rod: the force of the point contact
            ! then does not move along the rod.
            if (list%rolls(c)) list%rolls(c) = .not. any(problem%conforms(pack(list%element(:, c), list%element(:, c) > 0)) > 0)
         end do
         list%twin = twins(list%node, problem%model%mesh%n_nodes)
      end associate
      problem%coupling%entry = [problem%coupling%entry, spread(0, 1, problem%candidates%n - size(problem%coupling%entry))]

   contains

      !> Mesh node at a given position in the sequence of nodes of a rod segment.
      pure integer function node_of(rod_segment, i) result(node)
         integer, intent(in) :: rod_segment, i !! index of the rod segment; position of the node along the segment, from 1
         associate (e => problem%element_first(rod_segment) + i - 1, mesh => problem%model%mesh)
            if (e <= problem%element_last(rod_segment)) then
               node = mesh%node(1, e)
            else
               node = mesh%node(2, e - 1)
            end if
         end associate
      end function node_of
   end subroutine add_span_candidates

   !> True if the force of a point contact can move past an end of a rod segment as the rod rolls on the obstacle. There the rod is
   !> smooth, and the contact covers both sides.
   pure logical function rolls_at(problem, contact, rod_segment, side)
      type(problem_t), intent(in) :: problem         !! problem with contact spans
      integer, intent(in) :: contact, rod_segment
      integer, intent(in) :: side                    !! end of the segment: 1: its beginning, 2: its end
      integer :: e(2), i
      e(1) = problem%element_first(rod_segment)
      if (side == 2) e(1) = problem%element_last(rod_segment)
      e = problem%beside(:, problem%model%mesh%node(side, e(1)))
      rolls_at = all(e > 0)
      do i = 1, 2
         if (rolls_at) rolls_at = problem%covered(problem%rod_segment(e(i)), contact)
      end do
      if (rolls_at) rolls_at = runs_through(problem, e)
   end function rolls_at

   !> True if the rod is smooth at the node between two elements and free to rotate there.
   pure logical function runs_through(problem, element)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: element(2) !! elements before and after the node; 0: there is none, or the contact does not cover it
      real(wp) :: x(2), angle(2), speed, turn
      integer :: side
      runs_through = all(element > 0)
      if (.not. runs_through) return
      associate (mesh => problem%model%mesh)
         runs_through = .not. problem%model%fixed(3, mesh%node(2, element(1)))
         do side = 1, 2
            call curve_point(problem%model%curve(mesh%curve(element(side))), problem%model%imperfection, &
               & mesh%s(3 - side, element(side)), x, angle(side), speed)
         end do
      end associate
      turn = modulo(angle(2) - angle(1) + pi, 2.0_wp * pi) - pi
      runs_through = runs_through .and. abs(turn) <= parallel
   end function runs_through

   !> Contact spans with the positions of their ends in a given state.
   function present_contact_spans(problem, state) result(contact_span)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), allocatable :: contact_span(:)
      integer :: k, side, e
      contact_span = problem%contact_span
      do k = 1, size(contact_span)
         do side = 1, 2
            ! Ends of contact spans at segment boundaries do not move.
            if (contact_span(k)%at(side) <= 0.0_wp .or. contact_span(k)%at(side) >= &
               & problem%layout%rod_segment(contact_span(k)%rod_segment)%length) cycle
            e = contact_span(k)%element(side)
            contact_span(k)%at(side) = state%geometry%element(e)%s(side) + problem%origin(e)
         end do
         if (.not. contact_span(k)%line) contact_span(k)%at(2) = contact_span(k)%at(1)
      end do
   end function present_contact_spans

   !> Coordinate of a candidate along the rod segment of its contact span.
   pure real(wp) function touch_place(problem, state, candidate) result(at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      integer :: e, side, contact_span
      contact_span = problem%candidates%contact_span(candidate)
      side = 2
      e = problem%candidates%element(2, candidate)
      if (e > 0 .and. contact_span > 0) then
         ! The node may be the boundary of two segments; the contact span belongs to one of them.
         if (problem%rod_segment(e) /= problem%contact_span(contact_span)%rod_segment) e = 0
      end if
      if (e == 0) then
         side = 1
         e = problem%candidates%element(1, candidate)
      end if
      at = state%geometry%element(e)%s(3 - side) + problem%origin(e)
   end function touch_place
end module span_candidates
