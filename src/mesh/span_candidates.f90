!> The nodes at which what touches is held: one candidate for every one of them, and where the ends of touches stand in a state.
module span_candidates
   use kinds, only: wp, pi
   use problem, only: problem_t
   use reference_curve, only: curve_point
   use rod_state, only: state_t
   use remeshed_model, only: division_t
   use contact_spans, only: contact_span_t
   use candidates, only: add_candidates, twins
   use conforming_element, only: conforming_size
   implicit none
   private
   public :: add_touch_candidates, present_contact_spans, touch_place, rolls_at

contains

   !> One candidate for every node in contact with an obstacle, all of them held. A line that goes on over a breakpoint of the
   !> rod shares the node there.
   subroutine add_touch_candidates(problem, division)
      type(problem_t), intent(inout) :: problem
      type(division_t), intent(in) :: division(:)    !! (stretches) that of its mesh
      integer :: last(problem%model%mesh%n_nodes), first(size(problem%touch)), end(size(problem%touch))
      integer, allocatable :: contact(:), earlier(:), which(:)
      integer :: k, i, c, n, before, side, e, before_all, stretch_first, stretch_last
      do k = 1, size(problem%touch)
         call touched_nodes(problem%touch(k), division(problem%touch(k)%stretch)%at, first(k), end(k))
      end do
      n = sum(end - first + 1)
      allocate (contact(n), earlier(n), which(n))
      last = 0
      before_all = problem%candidates%n
      c = 0
      n = 0
      do k = 1, size(problem%touch)
         do i = first(k), end(k)
            n = n + 1
            which(n) = last(node_of(problem%touch(k)%stretch, i))
            do while (which(n) > 0)
               if (contact(which(n)) == problem%touch(k)%contact) exit
               which(n) = earlier(which(n))
            end do
            if (which(n) > 0) cycle
            c = c + 1
            which(n) = c
            contact(c) = problem%touch(k)%contact
            earlier(c) = last(node_of(problem%touch(k)%stretch, i))
            last(node_of(problem%touch(k)%stretch, i)) = c
         end do
      end do
      call add_candidates(problem%candidates, c)
      n = 0
      do k = 1, size(problem%touch)
         associate (touch => problem%touch(k), list => problem%candidates)
            stretch_first = problem%element_first(touch%stretch)
            stretch_last = problem%element_last(touch%stretch)
            before = 0
            touch%element = stretch_first - 1 + [first(k), end(k) - 1]
            touch%candidate = before_all + which(n + [1, end(k) - first(k) + 1])
            do i = first(k), end(k)
               n = n + 1
               c = before_all + which(n)
               ! Node i of the stretch stands at the end of the element before e and the beginning of e.
               e = stretch_first + i - 1
               if (list%touch(c) == 0) then
                  list%node(c) = node_of(touch%stretch, i)
                  list%contact(c) = touch%contact
                  list%obstacle(c) = problem%model%contact(touch%contact)%obstacle
                  list%gap_offset(c) = problem%model%contact(touch%contact)%gap
                  list%overlap(c) = problem%overlap(touch%contact)
                  list%bilateral(c) = .true.
                  list%touch(c) = k
                  list%moves(c) = e > stretch_first .and. e <= stretch_last .and. (.not. touch%line .or. i == first(k) .or. &
                     & i == end(k))
               end if
               list%follows(c) = touch%line .or. list%follows(c)
               if (e > stretch_first) list%element(1, c) = e - 1
               if (e <= stretch_last) list%element(2, c) = e
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
               if (problem%covered(problem%stretch(e), list%contact(c))) list%element(side, c) = e
            end do
            list%rolls(c) = .not. list%follows(c)
            if (.not. list%moves(c)) list%rolls(c) = list%rolls(c) .and. runs_through(problem, list%element(:, c))
            ! What lies on one side as another contact's line holds it.
            if (list%rolls(c)) list%rolls(c) = .not. any(problem%conforms(pack(list%element(:, c), list%element(:, c) > 0)) > 0)
         end do
         list%twin = twins(list%node, problem%model%mesh%n_nodes)
      end associate
      problem%coupling%entry = [problem%coupling%entry, spread(0, 1, problem%candidates%n - size(problem%coupling%entry))]

   contains

      !> A node of the mesh by its number along a stretch, from 1.
      pure integer function node_of(stretch, i) result(node)
         integer, intent(in) :: stretch, i
         associate (e => problem%element_first(stretch) + i - 1, mesh => problem%model%mesh)
            if (e <= problem%element_last(stretch)) then
               node = mesh%node(1, e)
            else
               node = mesh%node(2, e - 1)
            end if
         end associate
      end function node_of
   end subroutine add_touch_candidates

   !> The nodes of a stretch, by their numbers along it, from the first to the last of a touch.
   pure subroutine touched_nodes(touch, at, first, last)
      type(contact_span_t), intent(in) :: touch
      real(wp), intent(in) :: at(:)                  !! coordinates of all of them
      integer, intent(out) :: first, last
      first = findloc(at >= touch%at(1), .true., 1)
      last = findloc(at <= touch%at(2), .true., 1, back=.true.)
   end subroutine touched_nodes

   !> True for an end of a stretch where the rod goes on smoothly past the obstacle of a contact: a point that touches there rolls.
   pure logical function rolls_at(problem, contact, stretch, side)
      type(problem_t), intent(in) :: problem         !! of contact spans
      integer, intent(in) :: contact, stretch
      integer, intent(in) :: side                    !! 1: where it begins, 2: where it ends
      integer :: e(2), i
      e(1) = problem%element_first(stretch)
      if (side == 2) e(1) = problem%element_last(stretch)
      e = problem%beside(:, problem%model%mesh%node(side, e(1)))
      rolls_at = all(e > 0)
      do i = 1, 2
         if (rolls_at) rolls_at = problem%covered(problem%stretch(e(i)), contact)
      end do
      if (rolls_at) rolls_at = runs_through(problem, e)
   end function rolls_at

   !> True for a smooth rod at the node between two elements, free to turn there.
   pure logical function runs_through(problem, element)
      type(problem_t), intent(in) :: problem
      integer, intent(in) :: element(2)              !! that ends there, and that begins; 0: none, or the obstacle does not see it
      real(wp), parameter :: same = 1.0e-6_wp        ! as curve_goes_on
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
      runs_through = runs_through .and. abs(turn) <= same
   end function runs_through

   !> The touches where a state has their ends now.
   function present_contact_spans(problem, state) result(touch)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(contact_span_t), allocatable :: touch(:)
      integer :: k, side, e
      touch = problem%touch
      do k = 1, size(touch)
         do side = 1, 2
            ! Ends at breakpoints stay.
            if (touch(k)%at(side) <= 0.0_wp .or. touch(k)%at(side) >= problem%layout%stretch(touch(k)%stretch)%length) cycle
            e = touch(k)%element(side)
            touch(k)%at(side) = state%geometry%element(e)%s(side) + problem%origin(e)
         end do
         if (.not. touch(k)%line) touch(k)%at(2) = touch(k)%at(1)
      end do
   end function present_contact_spans

   !> Coordinate of a candidate along the stretch of its touch.
   pure real(wp) function touch_place(problem, state, candidate) result(at)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: candidate
      integer :: e, side, touch
      touch = problem%candidates%touch(candidate)
      side = 2
      e = problem%candidates%element(2, candidate)
      if (e > 0 .and. touch > 0) then
         ! A node that two stretches share.
         if (problem%stretch(e) /= problem%touch(touch)%stretch) e = 0
      end if
      if (e == 0) then
         side = 1
         e = problem%candidates%element(1, candidate)
      end if
      at = state%geometry%element(e)%s(3 - side) + problem%origin(e)
   end function touch_place
end module span_candidates
