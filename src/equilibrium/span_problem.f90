!> The problem on a mesh that goes with the contact: a few elements for every span, between breakpoints of the rods and
!> touchdown points, and one candidate for every node in contact.
module span_problem
   use kinds, only: wp, pi
   use model, only: obstacle_line
   use problem, only: problem_t, copy_problem, remeshed_problem, mesh_sampled, mesh_of_marks, mesh_of_spans
   use reference_curve, only: curve_point
   use rod_layout, only: stretch_element
   use rod_state, only: state_t
   use remeshed_model, only: division_t
   use mesh_demand, only: demand_t, between, equal_shares
   use contact_touch, only: touch_t, covers, sort_touches
   use ground_mark, only: cut_t
   use ground_cuts, only: add_marks, graded
   use candidates, only: add_candidates, twins
   use neutral_spans, only: free_clamps
   use rolling_rods, only: find_rolling
   use conforming_element, only: conforming_size
   implicit none
   private
   public :: new_span_problem, same_spans, new_sampled_problem, place_spans, present_touches, touch_place, outgrown, rolls_at
   public :: present_demand, looking_demand

   ! Every free span has a node inside, and one in contact is smooth: no layer forms at its ends.
   integer, parameter :: least_free = 2, least_conforming = 2
   real(wp), parameter :: whole_number = 0.01_wp    !! that near to one a sum of parts is it
   integer, parameter :: least_placed = 2           !! of a mesh that is made for a tolerance: its error is watched
   real(wp), parameter :: at_breakpoint = 1.0e-9_wp !! of a stretch: as near as that is there
   ! Elements that tell what touches: at least, and at most where the deck has more.
   integer, parameter :: sampling = 64, enough = 256
   !> Shortest elements, over the size: order 4 errs by the fourth power of their length, which is rounding there, and the rounding
   !> of places over the square of the length makes half of the digits of a curvature.
   real(wp), parameter :: finest = sqrt(sqrt(epsilon(1.0_wp)))

contains

   !> The problem with a set of touches; loads, step and all that goes before are those of `base`.
   function new_span_problem(base, touches, state, cuts) result(problem)
      type(problem_t), intent(in) :: base            !! of the same deck, on any mesh
      type(touch_t), intent(in) :: touches(:)
      type(state_t), intent(in), optional :: state   !! of `base`: no span that goes on gets fewer elements than it has
      type(cut_t), intent(in), optional :: cuts(:)   !! sorted: where the laws of foundations have their corners
      type(problem_t) :: problem
      type(touch_t) :: touch(size(touches))
      type(division_t) :: division(size(base%layout%stretch))
      type(cut_t), allocatable :: cut(:)
      integer :: k
      allocate (cut(0))
      if (present(cuts)) cut = cuts
      touch = touches
      do k = 1, size(touch)
         associate (length => base%layout%stretch(touch(k)%stretch)%length)
            where (touch(k)%at <= at_breakpoint * length) touch(k)%at = 0.0_wp
            where (touch(k)%at >= (1.0_wp - at_breakpoint) * length) touch(k)%at = length
         end associate
      end do
      call sort_touches(touch)
      do k = 1, size(division)
         division(k)%at = stretch_division(base, touch, cut, k, state)
      end do
      call lay_spans(base, touch, cut, division, problem)
   end function new_span_problem

   !> The problem with the touches and on the mesh of another one that has the same stretches: what differs are values in the deck.
   function same_spans(base, like) result(problem)
      type(problem_t), intent(in) :: base            !! on any mesh
      type(problem_t), intent(in) :: like            !! with spans
      type(problem_t) :: problem
      type(touch_t) :: touch(size(like%touch))
      type(division_t) :: division(size(like%layout%stretch))
      type(cut_t) :: cut(size(like%mark))
      integer :: k, i
      do k = 1, size(division)
         associate (first => like%element_first(k), last => like%element_last(k))
            division(k)%at = [0.0_wp, like%model%mesh%s(2, first:last) + like%origin(first:last)]
            division(k)%at(last - first + 2) = like%layout%stretch(k)%length
         end associate
      end do
      do k = 1, size(cut)
         associate (c => like%mark(k)%candidate(2), chain => like%ground%chain)
            associate (e => chain%element(2, c))
               cut(k) = cut_t(stretch=like%stretch(e), contact=chain%contact(c), at=like%model%mesh%s(1, e) + like%origin(e), &
                  & level=like%mark(k)%level, segment=like%mark(k)%segment)
            end associate
         end associate
      end do
      touch = like%touch
      do k = 1, size(touch)
         ! The node that stands there, but for rounding.
         associate (at => division(touch(k)%stretch)%at)
            do i = 1, 2
               touch(k)%at(i) = at(minloc(abs(at - touch(k)%at(i)), 1))
            end do
         end associate
      end do
      call lay_spans(base, touch, cut, division, problem)
   end function same_spans

   !> The problem with a set of touches on a mesh that has nodes at their ends.
   subroutine lay_spans(base, touch, cut, division, problem)
      type(problem_t), intent(in) :: base
      type(touch_t), intent(in) :: touch(:)          !! sorted
      type(cut_t), intent(in) :: cut(:)              !! sorted
      type(division_t), intent(in) :: division(:)    !! (stretches)
      type(problem_t), intent(out) :: problem
      problem = remeshed_problem(with_spans(base, .true.), division)
      problem%touch = touch
      call add_touch_candidates(problem, division)
      call add_marks(problem, cut, division)
      if (size(problem%mark) > 0) problem%mesh_kind = mesh_of_marks
      if (any(base%deck%contact%along)) problem%mesh_kind = mesh_of_spans
      call free_clamps(problem)
      call find_rolling(problem)
   end subroutine lay_spans

   !> The problem before any contact span is known: a mesh fine enough to tell by its nodes what touches.
   function new_sampled_problem(base, touch) result(problem)
      type(problem_t), intent(in) :: base            !! of the deck
      type(touch_t), intent(in), optional :: touch(:) !! places at which a node stands, too
      type(problem_t) :: problem
      type(division_t) :: division(size(base%layout%stretch))
      real(wp) :: length, share
      integer :: k, n, i
      length = sum(base%layout%stretch%length)
      do k = 1, size(division)
         associate (whole => base%layout%stretch(k))
            division(k)%at = whole%at
            share = whole%length / length
            n = max(min(size(whole%element), max(ceiling(enough * share), 4)), ceiling(sampling * share))
            if (whole%free) division(k)%at = [(whole%length * i / n, i=0, n)]
         end associate
      end do
      if (present(touch)) then
         do k = 1, size(touch)
            associate (at => division(touch(k)%stretch)%at)
               i = minloc(abs(at - touch(k)%at(1)), 1)
               if (i > 1 .and. i < size(at)) at(i) = touch(k)%at(1)
            end associate
         end do
      end if
      problem = remeshed_problem(with_spans(base, .false.), division)
      problem%mesh_kind = mesh_sampled
   end function new_sampled_problem

   !> Where spans may be, and what they count from, as the deck has it.
   subroutine place_spans(deck, problem)
      type(problem_t), intent(in) :: deck            !! on the deck's mesh
      type(problem_t), intent(inout) :: problem      !! of the same deck, on any mesh
      logical, allocatable :: covered(:, :)
      integer :: k
      allocate (covered(size(deck%layout%stretch), size(deck%deck%contact)))
      do k = 1, size(deck%deck%contact)
         covered(:, k) = covers(deck%deck, deck%layout, k)
      end do
      problem%covered = covered
      problem%chain_start = chain_starts(deck)
      problem%overlap = deck%overlap
   end subroutine place_spans

   !> Coordinates of the beginnings of all stretches along the chains of the contacts, 0 where there is none.
   function chain_starts(deck) result(start)
      type(problem_t), intent(in) :: deck            !! on the deck's mesh
      real(wp) :: start(size(deck%layout%stretch), size(deck%deck%contact)) !! (stretches, contacts)
      integer :: i
      start = 0.0_wp
      do i = 1, deck%candidates%n
         if (deck%candidates%element(2, i) == 0) cycle
         associate (stretch => deck%stretch(deck%candidates%element(2, i)))
            if (deck%layout%stretch(stretch)%element(1) == deck%candidates%element(2, i)) &
               & start(stretch, deck%candidates%contact(i)) = deck%candidates%s(i)
         end associate
      end do
   end function chain_starts

   !> The problem whose deck has its contacts as spans, or at nodes.
   function with_spans(base, spans) result(problem)
      type(problem_t), intent(in) :: base
      logical, intent(in) :: spans
      type(problem_t) :: problem
      call copy_problem(base, problem)
      problem%deck%contact%spans = problem%deck%contact%along .and. spans
   end function with_spans

   !> Coordinates of the nodes along a stretch: equal parts of every span, or shares of what is wanted there.
   function stretch_division(base, touch, cut, stretch, state) result(at)
      type(problem_t), intent(in) :: base
      type(touch_t), intent(in) :: touch(:)          !! sorted
      type(cut_t), intent(in) :: cut(:)              !! sorted
      integer, intent(in) :: stretch
      type(state_t), intent(in), optional :: state
      real(wp), allocatable :: at(:), middle(:)
      real(wp) :: from, layer(2), all, free
      integer :: k
      associate (whole => base%layout%stretch(stretch))
         if (.not. whole%free) then
            at = whole%at
            return
         end if
         if (.not. (whole%placed .or. any(cut%stretch == stretch)) .and. base%ground%founded(base%along( &
            & base%element_first(stretch)))) then
            at = whole%at
            return
         end if
         if (present(state)) middle = element_middles(base, state, stretch)
         all = real(size(whole%element), wp)
         free = all
         do k = 1, size(touch)
            if (touch(k)%stretch == stretch) &
               & free = free - deck_elements(base, stretch, touch(k)%at(2)) + deck_elements(base, stretch, touch(k)%at(1))
         end do
         at = [0.0_wp]
         from = 0.0_wp
         do k = 1, size(touch)
            if (touch(k)%stretch /= stretch) cycle
            call divide_free(touch(k)%at(1))
            if (touch(k)%line) call divide(touch(k)%at(2), touch(k)%contact)
         end do
         call divide_free(whole%length)
      end associate

   contains

      !> A free span, which foundations may divide further.
      subroutine divide_free(to)
         real(wp), intent(in) :: to
         integer :: i
         layer = [layer_at(from), 0.0_wp]
         do i = 1, size(cut)
            if (cut(i)%stretch /= stretch .or. cut(i)%at <= from .or. cut(i)%at >= to) cycle
            layer(2) = cut(i)%layer(1)
            call divide(cut(i)%at, 0)
            layer(1) = cut(i)%layer(2)
         end do
         layer(2) = layer_at(to)
         call divide(to, 0)
         layer = 0.0_wp
      end subroutine divide_free

      !> The layer of a foundation whose contact ends next to an end of the stretch.
      pure real(wp) function layer_at(end)
         real(wp), intent(in) :: end
         integer :: i
         layer_at = 0.0_wp
         do i = 1, size(cut)
            if (cut(i)%stretch == stretch .and. cut(i)%at_end .and. abs(cut(i)%at - end) <= 0.0_wp) &
               & layer_at = max(layer_at, maxval(cut(i)%layer))
         end do
      end function layer_at

      !> Nodes up to the end of a span. Free spans share all elements of the deck; in contact there are as many as the deck has
      !> there, a quarter of them where the rod is perfect; but not less than a span needs, nor more than rounding allows. A mesh
      !> that is made has what is asked for, in contact, too: a line without pressure buckles as a free span does.
      subroutine divide(to, contact)
         real(wp), intent(in) :: to
         integer, intent(in) :: contact              ! of a line, 0: a free span
         real(wp) :: wanted
         integer :: n, least, i, stages
         type(demand_t) :: deck
         if (.not. to > from) return
         stages = base%deck%mesh%stages(base%layout%stretch(stretch)%element(1))
         if (base%layout%stretch(stretch)%placed) then
            wanted = between(base%demand(stretch), from, to)
            n = max(least_placed, ceiling(min(wanted, (to - from) / (finest * base%size)) - whole_number))
            if (any(layer > 0.0_wp)) then
               n = max(1, n)
               associate (shares => graded(base%demand(stretch), from, to, n, layer, stages))
                  at = [at, shares(2:)]
               end associate
               from = to
               return
            end if
            associate (shares => equal_shares(base%demand(stretch), from, to, n))
               at = [at, shares(2:)]
            end associate
            from = to
            return
         end if
         wanted = deck_elements(base, stretch, to) - deck_elements(base, stretch, from)
         least = least_free
         if (any(cut%stretch == stretch)) then
            n = max(1, ceiling(wanted - whole_number))
            deck%at = base%layout%stretch(stretch)%at
            deck%elements = spread(1.0_wp, 1, size(deck%at) - 1)
            associate (nodes => graded(deck, from, to, n, layer, stages))
               at = [at, nodes(2:)]
            end associate
            from = to
            return
         end if
         if (contact == 0) then
            wanted = wanted * all / max(free, tiny(free))
         else
            least = least_conforming
            if (is_perfect(base, stretch)) wanted = merge(0.0_wp, 0.25_wp, on_straight(base, contact)) * wanted
         end if
         n = max(least, nint(min(wanted, (to - from) / (finest * base%size))))
         if (present(state)) n = max(n, count(middle > from .and. middle < to))
         at = [at, [(from + (to - from) * i / n, i=1, n - 1)], to]
         from = to
      end subroutine divide
   end function stretch_division

   !> True for a stretch without imperfections: in contact it is as smooth as the obstacle.
   pure logical function is_perfect(base, stretch)
      type(problem_t), intent(in) :: base
      integer, intent(in) :: stretch
      is_perfect = all(base%deck%curve(base%deck%mesh%curve(base%layout%stretch(stretch)%element))%imperfection == 0)
   end function is_perfect

   !> True for a straight obstacle: there one element is exact for a perfect rod, its axial force is linear.
   pure logical function on_straight(base, contact)
      type(problem_t), intent(in) :: base
      integer, intent(in) :: contact
      on_straight = base%deck%obstacle(base%deck%contact(contact)%obstacle)%kind == obstacle_line
   end function on_straight

   !> How many of the deck's elements lie before a coordinate, parts counted.
   pure real(wp) function deck_elements(base, stretch, at) result(n)
      type(problem_t), intent(in) :: base
      integer, intent(in) :: stretch
      real(wp), intent(in) :: at
      integer :: low
      associate (whole => base%layout%stretch(stretch))
         low = stretch_element(whole, at)
         n = low - 1 + (at - whole%at(low)) / (whole%at(low + 1) - whole%at(low))
      end associate
   end function deck_elements

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

   !> The nodes of a stretch, by their numbers along it, from the first to the last of a touch.
   pure subroutine touched_nodes(touch, at, first, last)
      type(touch_t), intent(in) :: touch
      real(wp), intent(in) :: at(:)                  !! coordinates of all of them
      integer, intent(out) :: first, last
      first = findloc(at >= touch%at(1), .true., 1)
      last = findloc(at <= touch%at(2), .true., 1, back=.true.)
   end subroutine touched_nodes

   !> Middles of the elements of a stretch.
   pure function element_middles(problem, state, stretch) result(middle)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: stretch
      real(wp), allocatable :: middle(:)
      integer :: e
      middle = [(0.5_wp * sum(state%geometry%element(e)%s) + problem%origin(e), &
         & e=problem%element_first(stretch), problem%element_last(stretch))]
   end function element_middles

   !> What is demanded of the next mesh, but more where elements are so much too long to tell what touches them, up to what tells
   !> it anywhere.
   function looking_demand(problem, longer) result(demand)
      type(problem_t), intent(in) :: problem
      real(wp), intent(in) :: longer                 !! than they should be, a factor
      type(demand_t) :: demand(size(problem%layout%stretch))
      real(wp) :: most
      integer :: k
      demand = problem%demand
      do k = 1, size(demand)
         most = sampling * problem%layout%stretch(k)%length / sum(problem%layout%stretch%length)
         demand(k)%elements = demand(k)%elements * max(1.0_wp, min(longer, most / sum(demand(k)%elements)))
      end do
   end function looking_demand

   !> The demand that a mesh fulfils where its nodes stand now.
   function present_demand(problem, state) result(demand)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(demand_t) :: demand(size(problem%layout%stretch))
      integer :: k, i, n
      do k = 1, size(demand)
         n = problem%element_last(k) - problem%element_first(k) + 1
         allocate (demand(k)%at(n + 1), source=0.0_wp)
         do i = 1, n
            associate (e => problem%along(problem%element_first(k) + i - 1))
               demand(k)%at(i + 1) = state%geometry%element(e)%s(2) + problem%origin(e)
            end associate
         end do
         demand(k)%elements = spread(1.0_wp, 1, n)
      end do
   end function present_demand

   !> True where some span has grown so much that it wants a quarter more elements than it has.
   logical function outgrown(problem, state, cuts)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(cut_t), intent(in), optional :: cuts(:)   !! sorted, where the kinks of foundations are
      type(touch_t), allocatable :: touch(:)
      type(cut_t), allocatable :: cut(:)
      real(wp), allocatable :: at(:), now(:), ends(:)
      integer :: k, i
      touch = present_touches(problem, state)
      call sort_touches(touch)
      allocate (cut(0))
      if (present(cuts)) cut = cuts
      outgrown = .false.
      do k = 1, size(problem%layout%stretch)
         if (problem%layout%stretch(k)%placed) cycle
         at = stretch_division(problem, touch, cut, k, state)
         do i = 1, size(cut)
            if (cut(i)%stretch == k) outgrown = outgrown .or. coarse_beside(cut(i))
         end do
         at = 0.5_wp * (at(2:) + at(:size(at) - 1))
         now = element_middles(problem, state, k)
         ends = [0.0_wp]
         do i = 1, size(touch)
            if (touch(i)%stretch == k) ends = [ends, touch(i)%at]
         end do
         do i = 1, size(cut)
            if (cut(i)%stretch == k) ends = [ends, cut(i)%at]
         end do
         ends = [ends, problem%layout%stretch(k)%length]
         do i = 2, size(ends)
            outgrown = outgrown .or. 4 * count(at > ends(i - 1) .and. at < ends(i)) > &
               & 5 * count(now > ends(i - 1) .and. now < ends(i))
         end do
      end do

   contains

      !> True where an element beside a mark with a layer is a quarter longer than a new mesh would have it.
      pure logical function coarse_beside(mark)
         type(cut_t), intent(in) :: mark
         real(wp) :: wanted(2), has(2)
         integer :: e, j
         coarse_beside = .false.
         j = minloc(abs(at - mark%at), 1)
         if (j == 1 .or. j == size(at)) return
         wanted = [at(j) - at(j - 1), at(j + 1) - at(j)]
         has = 0.0_wp
         do e = problem%element_first(k), problem%element_last(k)
            associate (s => state%geometry%element(e)%s + problem%origin(e))
               if (s(1) < mark%at - 0.1_wp * wanted(1) .and. s(2) <= mark%at + 0.1_wp * wanted(2)) has(1) = s(2) - s(1)
               if (s(1) >= mark%at - 0.1_wp * wanted(1)) then
                  has(2) = s(2) - s(1)
                  exit
               end if
            end associate
         end do
         coarse_beside = any(has > 1.25_wp * wanted .and. mark%layer > 0.0_wp)
      end function coarse_beside
   end function outgrown

   !> The touches where a state has their ends now.
   function present_touches(problem, state) result(touch)
      type(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(touch_t), allocatable :: touch(:)
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
   end function present_touches

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
end module span_problem
