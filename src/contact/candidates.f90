!> Contact candidates of *CONTACT cards in one list, ordered along the rods. A candidate is a node with a contact reaction, or a
!> node that only describes the position of a foundation that acts inside the elements. Neighbouring candidates of a contact form a
!> chain.
module candidates
   use kinds, only: wp
   use model, only: model_t
   use rod_geometry, only: geometry_t
   use obstacle_geometry, only: obstacle_gap
   implicit none
   private
   public :: candidates_t, new_candidates, add_candidates, twins

   !> List of candidates, one entry each. The neighbours of a candidate are the next candidates of the same contact along the
   !> elements.
   type :: candidates_t
      integer :: n = 0
      integer, allocatable :: node(:)
      integer, allocatable :: row(:) !! position of the candidate in the results: contact by contact, in the deck's order of nodes
      integer, allocatable :: contact(:)      !! index into model%contact
      integer, allocatable :: obstacle(:)     !! index into model%obstacle
      integer, allocatable :: neighbour(:, :) !! (2, n) candidate before and candidate after this one; 0: none
      integer, allocatable :: element(:, :)   !! (2, n) element between this candidate and its neighbour before and after; 0: none
      integer, allocatable :: twin(:) !! next candidate at the same node, for another obstacle, in a circular list; the only
      !! candidate of a node refers to itself
      real(wp), allocatable :: s(:)           !! nominal arc length along the chain [length]
      real(wp), allocatable :: tributary(:) !! half the length of the adjacent elements of the contact [length]; 1 for stops at
      !! nodes
      real(wp), allocatable :: gap_offset(:) !! (n) value added to the distance from the obstacle to obtain the gap [length]
      real(wp), allocatable :: overlap(:) !! distance by which the obstacle is withdrawn at the start [length], see initial_overlap;
      !! 0 until the problem sets it
      ! Nodes of contact spans. All of them are bilateral; the other properties are:
      !                                     follows  moves  rolls
      !   node inside a line contact           x
      !   end of a line                        x       x
      !   end of a line at a segment boundary  x
      !   point contact                                x      x
      !   point at a segment boundary                         x
      !   point at the end of its rod, at a kink, or at a support that fixes the rotation
      logical, allocatable :: bilateral(:)    !! true: always in contact, and the reaction may have either sign
      integer, allocatable :: contact_span(:) !! contact span to which the node belongs, index into problem%contact_span; 0: contact
      !! at nodes
      logical, allocatable :: follows(:)      !! true: the node has the direction of the track
      logical, allocatable :: moves(:)        !! true: touchdown point, whose node moves along the rod
      logical, allocatable :: rolls(:) !! true: point contact of a smooth rod, whose force moves along the rod as the rod rotates,
      !! even if the node is at a segment boundary and does not move
      logical, allocatable :: held(:)         !! true: touchdown point that is fixed at its present position (with_held)
      real(wp), allocatable :: chain_length(:) !! (contacts) length of the chain if it is closed; 0: the chain is open
   end type candidates_t

contains

   !> Makes the list of candidates from the nodes of all contacts: chain by chain, in the direction of the elements.
   function new_candidates(model, geometry, distributed) result(list)
      type(model_t), intent(in) :: model
      type(geometry_t), intent(in) :: geometry
      logical, intent(in) :: distributed      !! true: contacts with distributed reactions; false: all other contacts
      type(candidates_t) :: list
      integer, allocatable :: next(:), previous(:)
      logical, allocatable :: member(:), done(:)
      integer, allocatable :: order(:)
      integer :: c, e, i, node, total, first, rows

      total = 0
      do c = 1, size(model%contact)
         if (is_listed(c)) total = total + size(model%contact(c)%node)
      end do
      allocate (list%node(total), list%row(total), list%contact(total), list%obstacle(total), list%s(total), list%tributary(total))
      allocate (list%gap_offset(total), list%bilateral(total))
      allocate (list%overlap(total), source=0.0_wp)
      allocate (list%contact_span(total), source=0)
      allocate (list%follows(total), list%moves(total), list%rolls(total), list%held(total), source=.false.)
      allocate (list%neighbour(2, total), list%element(2, total), source=0)
      allocate (list%chain_length(size(model%contact)), source=0.0_wp)
      allocate (list%twin(total))
      if (total == 0) return
      allocate (order(model%mesh%n_nodes))
      rows = 0
      do c = 1, size(model%contact)
         order(model%contact(c)%node) = [(rows + i, i=1, size(model%contact(c)%node))]
         rows = rows + size(model%contact(c)%node)
         if (.not. is_listed(c)) cycle
         associate (contact => model%contact(c), mesh => model%mesh)
            allocate (member(mesh%n_nodes), done(mesh%n_nodes), source=.false.)
            allocate (next(mesh%n_nodes), previous(mesh%n_nodes), source=0)
            member(contact%node) = .true.
            do e = 1, mesh%n_elements
               if (model%obstacle(contact%obstacle)%at_nodes) exit
               if (.not. (member(mesh%node(1, e)) .and. member(mesh%node(2, e)))) cycle
               ! At a joint of several elements the chain continues along the first element; each of the other elements begins a new
               ! chain.
               if (next(mesh%node(1, e)) == 0) next(mesh%node(1, e)) = e
               if (previous(mesh%node(2, e)) == 0) previous(mesh%node(2, e)) = e
            end do
            first = list%n
            ! Open chains begin at nodes without a previous element. All elements that remain form closed chains.
            do i = 1, size(contact%node)
               node = contact%node(i)
               if (.not. done(node) .and. previous(node) == 0) call follow_chain(node)
            end do
            do i = 1, size(contact%node)
               if (.not. done(contact%node(i))) call follow_chain(contact%node(i))
            end do
            deallocate (member, done, next, previous)
         end associate
      end do
      list%twin = twins(list%node, model%mesh%n_nodes)

   contains

      !> True if the nodes of a contact belong to this list; the candidates of contact spans are made by span_candidates.
      pure logical function is_listed(c)
         integer, intent(in) :: c
         is_listed = (model%contact(c)%distributed .eqv. distributed) .and. .not. model%contact(c)%spans
      end function is_listed

      !> Appends the nodes from `start` along the elements until the chain ends or closes.
      subroutine follow_chain(start)
         integer, intent(in) :: start
         integer :: at, element, here, begin, side
         real(wp) :: s, half, gap, normal(2), bend
         at = start
         s = 0.0_wp
         begin = list%n + 1
         if (list%n > first) s = list%s(list%n)
         do
            done(at) = .true.
            list%n = list%n + 1
            here = list%n
            list%node(here) = at
            list%row(here) = order(at)
            list%contact(here) = c
            list%obstacle(here) = model%contact(c)%obstacle
            list%gap_offset(here) = model%contact(c)%gap
            list%bilateral(here) = model%obstacle(list%obstacle(here))%bilateral
            call obstacle_gap(model%obstacle(list%obstacle(here)), geometry%x(:, at), gap, normal, bend)
            if (list%bilateral(here)) then
               ! A bilateral contact is free of force at the start, even if its node is not on the obstacle.
               list%gap_offset(here) = -gap
            else if (model%obstacle(list%obstacle(here))%at_nodes) then
               list%gap_offset(here) = model%contact(c)%gap - gap
            end if
            list%s(here) = s
            list%tributary(here) = 0.0_wp
            element = next(at)
            if (element == 0) exit
            half = 0.5_wp * geometry%element(element)%length
            s = s + 2.0_wp * half
            list%element(2, here) = element
            at = model%mesh%node(2, element)
            if (at == start) then
               list%neighbour(2, here) = begin
               list%neighbour(1, begin) = here
               list%element(1, begin) = element
               list%chain_length(c) = s
               exit
            end if
            if (done(at) .or. previous(at) /= element) then
               list%element(2, here) = 0
               exit
            end if
            list%neighbour(2, here) = here + 1
            list%neighbour(1, here + 1) = here
            list%element(1, here + 1) = element
         end do
         do here = begin, list%n
            do side = 1, 2
               if (list%element(side, here) == 0) cycle
               list%tributary(here) = list%tributary(here) + 0.5_wp * geometry%element(list%element(side, here))%length
            end do
            if (model%obstacle(model%contact(c)%obstacle)%at_nodes) list%tributary(here) = 1.0_wp
         end do
      end subroutine follow_chain

   end function new_candidates

   !> Appends `more` bilateral candidates to a list. Their nodes, contacts and neighbours are not yet set.
   pure subroutine add_candidates(list, more)
      type(candidates_t), intent(inout) :: list
      integer, intent(in) :: more
      integer :: zero(more), pair(2, more), i
      real(wp) :: none(more)
      zero = 0
      pair = 0
      none = 0.0_wp
      list%node = [list%node(:list%n), zero]
      list%row = [list%row(:list%n), zero]
      list%contact = [list%contact(:list%n), zero]
      list%obstacle = [list%obstacle(:list%n), zero]
      list%neighbour = reshape([list%neighbour(:, :list%n), pair], [2, list%n + more])
      list%element = reshape([list%element(:, :list%n), pair], [2, list%n + more])
      list%twin = [list%twin(:list%n), [(list%n + i, i=1, more)]]
      list%s = [list%s(:list%n), none]
      list%tributary = [list%tributary(:list%n), none]
      list%gap_offset = [list%gap_offset(:list%n), none]
      list%overlap = [list%overlap(:list%n), none]
      list%bilateral = [list%bilateral(:list%n), zero == 0]
      list%contact_span = [list%contact_span(:list%n), zero]
      list%follows = [list%follows(:list%n), zero > 0]
      list%moves = [list%moves(:list%n), zero > 0]
      list%rolls = [list%rolls(:list%n), zero > 0]
      list%held = [list%held(:list%n), zero > 0]
      list%n = list%n + more
   end subroutine add_candidates

   !> Circular lists that connect the candidates of the same node.
   pure function twins(node, n_nodes) result(twin)
      integer, intent(in) :: node(:)           !! (candidates) node of each candidate
      integer, intent(in) :: n_nodes
      integer :: twin(size(node)), first(n_nodes), last(n_nodes), c
      first = 0
      last = 0
      do c = 1, size(node)
         if (first(node(c)) == 0) then
            first(node(c)) = c
         else
            twin(last(node(c))) = c
         end if
         last(node(c)) = c
         twin(c) = first(node(c))
      end do
   end function twins
end module candidates
