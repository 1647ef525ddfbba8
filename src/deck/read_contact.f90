!> Reads *CONTACT: candidates for contact with an obstacle.
module read_contact
   use kinds, only: wp
   use text, only: to_text, rounded
   use model, only: model_t, contact_t
   use obstacle_types, only: ground_independent, obstacle_line, obstacle_circle, obstacle_arc
   use element_families, only: collocates
   use contact_spans, only: choose_spans
   use obstacle_geometry, only: obstacle_gap
   use obstacle_curve, only: sharpest_turn
   use initial_overlap, only: overlap_of_nodes, overlap_between, deepest_start
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: given, parameter_word, parameter_real, parameter_place, value_place
   use deck_names, only: deck_names_t, find_set, find_named
   use read_interference, only: pushes_out
   implicit none
   private
   public :: read_contact_cards, choose_contact_points

contains

   !> Reads the candidates for contact with each obstacle.
   subroutine read_contact_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! with mesh and obstacles
      type(model_t), intent(inout) :: model             !! receives contact
      type(diagnostics_t), intent(inout) :: diagnostics
      type(contact_t) :: contact
      integer, allocatable :: touched(:, :)             ! by obstacle and node: line of the *CONTACT
      character(:), allocatable :: reason, points
      integer :: card, set
      allocate (model%contact(0), touched(size(model%obstacle), model%mesh%n_nodes))
      touched = 0
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'CONTACT') cycle
         call find_named(deck, names%obstacle, diagnostics, card, value_place(deck, card, 'OBSTACLE'), 'obstacle', &
            contact%obstacle)
         call find_set(deck, names, diagnostics, card, 'NSET', 'node', set)
         contact%node = with_released(model, names%node_set%members(set))
         contact%gap = parameter_real(deck, card, 'GAP')
         points = parameter_word(deck, card, 'POINTS')
         contact%along = .false.
         contact%distributed = .false.
         if (allocated(contact%needs)) deallocate (contact%needs)
         if (contact%obstacle > 0 .and. .not. names%mesh_incomplete) then
            call check_candidates(deck, names, model, diagnostics, card, contact, touched(contact%obstacle, :))
            call check_directions(deck, model, diagnostics, card, contact)
            if (model%obstacle(contact%obstacle)%bilateral .and. given(deck, card, 'GAP')) call complain(deck, diagnostics, &
               card, parameter_place(deck, card, 'GAP'), 'obstacle '//trim(model%obstacle(contact%obstacle)%name)// &
               ' is BILATERAL and holds its candidates where they begin; GAP would have no effect')
            if (points /= 'NODES') then
               contact%along = model%obstacle(contact%obstacle)%rigid .and. .not. model%obstacle(contact%obstacle)%bilateral
               if (.not. model%obstacle(contact%obstacle)%rigid) then
                  reason = distribution_needs(model, contact)
                  contact%distributed = reason == ''
                  if (contact%distributed) call check_between(deck, model, diagnostics, card, contact)
                  if (reason /= '' .and. points == 'ALONG') call complain_of_points(deck, diagnostics, card, reason)
                  if (reason /= '' .and. .not. stands_at_nodes(model, contact)) contact%needs = reason
               else if (points == 'ALONG' .and. .not. contact%along) then
                  call complain_of_points(deck, diagnostics, card, 'an obstacle that is not BILATERAL')
               end if
            end if
         end if
         model%contact = [model%contact, contact]
      end do
   end subroutine read_contact_cards

   !> The given nodes, and the nodes of element ends released at them if the rod beyond belongs to the nodes, too.
   pure function with_released(model, nodes) result(more)
      type(model_t), intent(in) :: model
      integer, intent(in) :: nodes(:)
      integer, allocatable :: more(:)
      integer :: i, e
      more = nodes
      do i = 1, size(model%release)
         associate (release => model%release(i))
            if (.not. any(nodes == release%node) .or. any(nodes == release%own)) cycle
            do e = 1, model%mesh%n_elements
               if (any(model%mesh%node(:, e) == release%own) .and. (any(nodes == model%mesh%node(1, e)) .or. &
                  any(nodes == model%mesh%node(2, e)))) exit
            end do
            if (e <= model%mesh%n_elements) more = [more, release%own]
         end associate
      end do
   end function with_released

   !> Chooses the contacts that act along the rods; an error is added if POINTS=ALONG is impossible.
   subroutine choose_contact_points(deck, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(model_t), intent(inout) :: model             !! read completely, without errors
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: card, contact
      call choose_spans(model)
      contact = 0
      do card = 1, deck%n_cards
         if (.not. deck%card(card)%sound .or. deck%card(card)%keyword /= 'CONTACT') cycle
         contact = contact + 1
         associate (chosen => model%contact(contact))
            if (parameter_word(deck, card, 'POINTS') /= 'ALONG' .or. chosen%along .or. chosen%distributed) cycle
            if (allocated(chosen%needs)) then
               call complain_of_points(deck, diagnostics, card, chosen%needs)
            else if (any(model%step%paper_loop)) then
               call complain_of_points(deck, diagnostics, card, &
                  & 'LOOP=NEWTON in all steps: contact of LOOP=PAPER acts at nodes')
            else
               call complain_of_points(deck, diagnostics, card, 'elements between its nodes')
            end if
         end associate
      end do
   end subroutine choose_contact_points

   subroutine complain_of_points(deck, diagnostics, card, needs)
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      character(*), intent(in) :: needs
      call complain(deck, diagnostics, card, parameter_place(deck, card, 'POINTS'), 'ALONG needs '//needs)
   end subroutine complain_of_points

   !> Checks that the candidates are nodes of elements, not listed twice, and on the free side of the obstacle.
   subroutine check_candidates(deck, names, model, diagnostics, card, contact, touched)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(contact_t), intent(in) :: contact
      integer, intent(inout) :: touched(:)
      integer :: i, node
      do i = 1, size(contact%node)
         node = contact%node(i)
         if (.not. names%connected(node)) then
            call wrong('node '//label(node)//' belongs to no element')
            return
         else if (touched(node) > 0) then
            call wrong('node '//label(node)//' is a candidate for this obstacle already, from '// &
               deck%source%line_words(touched(node)))
            return
         end if
         touched(node) = deck%card(card)%place%line
      end do
      call check_size()
      if (model%obstacle(contact%obstacle)%bilateral) return
      if (pushes_out(deck, model%obstacle(contact%obstacle)%name)) return
      if (names%obstacle%incomplete .or. names%imperfections_incomplete) return ! the position of the obstacle or of the nodes may
      ! be wrong
      call check_start()

   contains

      !> The structure is stress-free at the start with its imperfections, so no node may begin behind an obstacle.
      subroutine check_start()
         character(:), allocatable :: overlap, hint
         real(wp) :: gap, normal(2), bend
         integer :: node
         call overlap_of_nodes(model, contact, overlap, node)
         if (overlap == '') return
         call obstacle_gap(model%obstacle(contact%obstacle), model%mesh%x_nominal(:, node), gap, normal, bend)
         gap = gap + contact%gap
         if (gap < -deepest_start(model)) then
            ! The imperfection is not the cause.
            hint = 'the order of its points'
            if (model%obstacle(contact%obstacle)%kind == obstacle_circle) hint = 'its SIDE'
            if (model%obstacle(contact%obstacle)%kind == obstacle_arc) hint = 'which of its angles comes first'
            call obstacle_gap(model%obstacle(contact%obstacle), model%mesh%x(:, node), gap, normal, bend)
            overlap = 'node '//label(node)//' begins '//rounded(-gap - contact%gap)//' behind the obstacle; check '//hint// &
               & ', or GAP; what is meant to penetrate is pushed out by *CONTACT INTERFERENCE, SHRINK'
         end if
         call wrong(overlap)
      end subroutine check_start

      !> Contact is detected at nodes and along elements: the convex parts of an obstacle must not be smaller than the elements.
      subroutine check_size()
         real(wp), parameter :: most_turn = 1.0_wp !! [rad] largest turn of an obstacle within the length of an element
         logical :: candidate(model%mesh%n_nodes)
         integer :: e, longest
         real(wp) :: length(model%mesh%n_elements)
         associate (obstacle => model%obstacle(contact%obstacle))
            candidate = .false.
            candidate(contact%node) = .true.
            length = 0.0_wp
            do e = 1, model%mesh%n_elements
               if (.not. all(candidate(model%mesh%node(:, e)))) cycle
               length(e) = norm2(model%mesh%x(:, model%mesh%node(2, e)) - model%mesh%x(:, model%mesh%node(1, e)))
            end do
            longest = maxloc(length, 1)
            select case (obstacle%kind)
            case (obstacle_line)
               return
            case (obstacle_circle)
               if (obstacle%inside .or. length(longest) <= obstacle%radius) return
               longest = findloc(length > obstacle%radius, .true., 1)
               call wrong('element '//to_text(model%mesh%element_label(longest))//' is longer than the radius of the '// &
                  'obstacle, which could pass between its nodes; '//more_elements(longest))
            case default
               if (sharpest_turn(obstacle%curve, length(longest)) <= most_turn) return
               call wrong('the obstacle bulges so much within the length of element '// &
                  to_text(model%mesh%element_label(longest))//' that it could pass between its nodes; '// &
                  more_elements(longest)//', or a smoother obstacle')
            end select
         end associate
      end subroutine check_size

      !> Advice on an element that is too long.
      function more_elements(e) result(words)
         integer, intent(in) :: e
         character(:), allocatable :: words
         words = 'use more elements'
         ! The measured elements only carry the output.
         if (model%mesh%placed(e)) words = 'give a number of elements, so many that none is as long'
      end function more_elements

      subroutine wrong(message)
         character(*), intent(in) :: message
         call complain(deck, diagnostics, card, parameter_place(deck, card, 'NSET'), message)
      end subroutine wrong

      function label(n) result(string)
         integer, intent(in) :: n
         character(:), allocatable :: string
         string = to_text(model%mesh%node_label(n))
      end function label
   end subroutine check_candidates

   !> If reactions are distributed, obstacles must not penetrate the stress-free structure between the nodes either.
   subroutine check_between(deck, model, diagnostics, card, contact)
      type(deck_t), intent(in) :: deck
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(contact_t), intent(in) :: contact
      character(:), allocatable :: overlap
      associate (obstacle => model%obstacle(contact%obstacle))
         if (obstacle%bilateral .or. pushes_out(deck, obstacle%name)) return
      end associate
      call overlap_between(model, contact, overlap)
      if (overlap /= '') call complain(deck, diagnostics, card, parameter_place(deck, card, 'NSET'), overlap)
   end subroutine check_between

   !> All elements of a contact must have the same direction along the rod: arc lengths and regions count along them.
   subroutine check_directions(deck, model, diagnostics, card, contact)
      type(deck_t), intent(in) :: deck
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: card
      type(contact_t), intent(in) :: contact
      logical :: candidate(model%mesh%n_nodes)
      integer :: starting(model%mesh%n_nodes), ending(model%mesh%n_nodes), e, node
      candidate = .false.
      candidate(contact%node) = .true.
      starting = 0
      ending = 0
      do e = 1, model%mesh%n_elements
         if (.not. all(candidate(model%mesh%node(:, e)))) cycle
         starting(model%mesh%node(1, e)) = starting(model%mesh%node(1, e)) + 1
         ending(model%mesh%node(2, e)) = ending(model%mesh%node(2, e)) + 1
      end do
      do node = 1, model%mesh%n_nodes
         if (max(starting(node), ending(node)) /= 2 .or. min(starting(node), ending(node)) /= 0) cycle
         call complain(deck, diagnostics, card, value_place(deck, card, 'NSET'), &
            'two elements run against each other at node '//to_text(model%mesh%node_label(node))// &
            '; along a contact all elements must have one direction')
         return
      end do
   end subroutine check_directions

   !> True for a contact with a foundation that the deck requires to act at nodes: coupled ground, or no element with both nodes in
   !> the contact.
   function stands_at_nodes(model, contact) result(stands)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      logical :: stands
      logical :: candidate(model%mesh%n_nodes)
      candidate = .false.
      candidate(contact%node) = .true.
      stands = model%obstacle(contact%obstacle)%ground /= ground_independent .or. &
         & .not. any(candidate(model%mesh%node(1, :)) .and. candidate(model%mesh%node(2, :)))
   end function stands_at_nodes

   !> Condition for reactions inside elements that a contact with a foundation does not meet; '' if its nodes are those of
   !> unbranched chains of GE elements.
   function distribution_needs(model, contact) result(reason)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      character(:), allocatable :: reason
      logical :: candidate(model%mesh%n_nodes)
      integer :: leaving(model%mesh%n_nodes), entering(model%mesh%n_nodes), e, i, node
      reason = ''
      if (model%obstacle(contact%obstacle)%ground /= ground_independent) then
         reason = 'a foundation that does not carry load sideways'
         return
      end if
      candidate = .false.
      candidate(contact%node) = .true.
      leaving = 0
      entering = 0
      do e = 1, model%mesh%n_elements
         if (.not. all(candidate(model%mesh%node(:, e)))) cycle
         leaving(model%mesh%node(1, e)) = leaving(model%mesh%node(1, e)) + 1
         entering(model%mesh%node(2, e)) = entering(model%mesh%node(2, e)) + 1
         if (collocates(model%mesh%family(e))) cycle
         reason = 'GE elements; element '//to_text(model%mesh%element_label(e))//' is not'
         return
      end do
      do i = 1, size(contact%node)
         node = contact%node(i)
         if (leaving(node) + entering(node) == 0) then
            reason = 'elements between its nodes; node '//to_text(model%mesh%node_label(node))//' is alone'
         else if (max(leaving(node), entering(node)) > 1) then
            reason = 'chains without branches; there is one at node '//to_text(model%mesh%node_label(node))
         end if
         if (reason /= '') return
      end do
   end function distribution_needs
end module read_contact
