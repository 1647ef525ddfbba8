!> Reads *CONTACT, the candidates for contact with an obstacle, and *AXIAL SOIL, whose candidates are the nodes of a rod.
module read_contact
   use kinds, only: wp, parallel
   use text, only: rounded
   use model, only: model_t, contact_t, law_t, elements_among
   use obstacle_types, only: obstacle_t, ground_independent, obstacle_line, obstacle_circle, obstacle_arc
   use element_families, only: collocates
   use contact_spans, only: choose_spans
   use obstacle_geometry, only: obstacle_gap
   use obstacle_curve, only: sharpest_turn
   use initial_overlap, only: overlap_of_nodes, overlap_between, deepest_start
   use checked_deck, only: checked_deck_t, node_words, element_words
   implicit none
   private
   public :: read_contact_cards, read_soil_cards, choose_contact_points

contains

   !> Reads the candidates for contact with each obstacle.
   subroutine read_contact_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains mesh and obstacles
      type(model_t), intent(inout) :: model             !! out: with contact added
      type(contact_t) :: contact
      allocate (deck%names%contact_origin(0))
      do while (deck%next_card('CONTACT'))
         contact = contact_t()
         contact%obstacle = deck%named('OBSTACLE', deck%names%obstacle, 'obstacle')
         contact%node = with_released(model, deck%nodes('NSET'))
         contact%gap = deck%real('GAP')
         if (contact%obstacle > 0 .and. .not. deck%names%mesh_incomplete) &
            call check_contact(deck, model, model%obstacle(contact%obstacle), contact)
         model%contact = [model%contact, contact]
         deck%names%contact_origin = [deck%names%contact_origin, deck%at]
      end do
   end subroutine read_contact_cards

   !> Reads the soil along rods. Each card becomes a two-sided foundation with a force law, whose normal is the axis of the rod, and
   !> its candidates.
   subroutine read_soil_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck !! in: contains mesh, laws, and the names of all obstacles; out: with further
      !! obstacle names
      type(model_t), intent(inout) :: model !! in: contains obstacles and contacts; out: with further obstacles, contacts and laws
      type(obstacle_t) :: soil
      type(contact_t) :: contact
      do while (deck%next_card('AXIAL SOIL'))
         if (.not. deck%defines(deck%names%obstacle, deck%text('NAME'))) cycle
         soil = obstacle_t(name=deck%text('NAME'))
         soil%rigid = .false.
         soil%bilateral = .true.
         soil%along_rod = .true.
         soil%point = reshape([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [2, 2])
         contact = contact_t()
         contact%obstacle = size(model%obstacle) + 1
         allocate (contact%node(0))
         call read_force()
         call read_rod()
         model%obstacle = [model%obstacle, soil]
         if (.not. deck%names%mesh_incomplete) call check_contact(deck, model, soil, contact)
         model%contact = [model%contact, contact]
         deck%names%contact_origin = [deck%names%contact_origin, deck%at]
      end do

   contains

      !> Reads how the force depends on the displacement.
      subroutine read_force()
         type(law_t) :: law
         if (deck%given('LAW') .eqv. deck%given('STIFFNESS')) then
            call deck%wrong_card('the force of soil is given by either STIFFNESS or LAW')
         else if (deck%given('LAW')) then
            soil%law = deck%named('LAW', deck%names%law, 'foundation law')
            if (deck%given('LIMIT')) call deck%wrong('LIMIT', 'a law has its own limit')
         else if (deck%given('LIMIT')) then
            law%name = soil%name
            law%force = [0.0_wp, deck%real('LIMIT'), deck%real('LIMIT')]
            law%penetration = [0.0_wp, 1.0_wp, 2.0_wp] * (deck%real('LIMIT') / deck%real('STIFFNESS'))
            model%law = [model%law, law]
            soil%law = size(model%law)
         else
            soil%modulus = deck%real('STIFFNESS')
         end if
      end subroutine read_force

      !> Reads the rod: its nodes are the candidates, and its direction is the normal of the foundation.
      subroutine read_rod()
         integer, allocatable :: element(:)
         real(wp) :: d(2), along(2)
         integer :: i, side
         element = deck%elements('ELSET')
         along = 0.0_wp
         do i = 1, size(element)
            associate (ends => model%mesh%node(:, element(i)))
               d = model%mesh%x_nominal(:, ends(2)) - model%mesh%x_nominal(:, ends(1))
               d = d / norm2(d)
               if (i == 1) along = d
               if (abs(along(1) * d(2) - along(2) * d(1)) > parallel) then
                  call deck%wrong('ELSET', element_words(model%mesh, element(i))//' has another direction than the first '// &
                     'element; give each straight rod a card of its own')
                  return
               end if
               do side = 1, 2
                  if (.not. any(contact%node == ends(side))) contact%node = [contact%node, ends(side)]
               end do
            end associate
         end do
         if (size(element) > 0) soil%point(:, 2) = [along(2), -along(1)]
      end subroutine read_rod
   end subroutine read_soil_cards

   !> Checks a contact, and determines whether the obstacle may act anywhere along the rod.
   subroutine check_contact(deck, model, obstacle, contact)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(obstacle_t), intent(in) :: obstacle          ! obstacle of the contact
      type(contact_t), intent(inout) :: contact         ! out: components along, distributed and needs are set
      character(:), allocatable :: set
      logical :: soil, may_overlap
      may_overlap = obstacle%bilateral .or. deck%names%pushed_out%find(obstacle%name) > 0
      soil = deck%at%keyword == 'AXIAL SOIL'
      set = 'NSET'
      if (soil) set = 'ELSET'
      call check_candidates()
      call check_directions()
      if (.not. soil) then
         if (obstacle%bilateral .and. deck%given('GAP')) call deck%wrong('GAP', 'obstacle '//trim(obstacle%name)// &
            ' is BILATERAL and holds its candidates where they begin; GAP would have no effect')
         if (deck%word('POINTS') == 'NODES') return
      end if
      call read_points()

   contains

      !> Checks that the candidates are nodes of elements, not listed twice, and on the free side of the obstacle.
      subroutine check_candidates()
         integer :: touched(model%mesh%n_nodes)  ! (nodes) line of the deck with the *CONTACT that names the node; 0: none
         integer :: c, i
         if (.not. deck%on_elements(set, model%mesh, contact%node)) return
         touched = 0
         do c = size(model%contact), 1, -1
            if (model%contact(c)%obstacle == contact%obstacle) touched(model%contact(c)%node) = deck%names%contact_origin(c)%card_at
         end do
         i = findloc(touched(contact%node) > 0, .true., 1)
         if (i > 0) then
            call deck%wrong(set, node_words(model%mesh, contact%node(i))//' is a candidate for this obstacle already, from '// &
               deck%source%line_words(touched(contact%node(i))))
            return
         end if
         call check_size()
         if (may_overlap) return
         ! If obstacles or imperfections have errors, the positions of the obstacle or of the nodes may be wrong: no further
         ! message.
         if (.not. (deck%names%obstacle%incomplete .or. deck%names%imperfections_incomplete)) call check_start()
      end subroutine check_candidates

      !> At the start the structure is stress-free, imperfections included: no node may begin behind an obstacle.
      subroutine check_start()
         character(:), allocatable :: overlap, hint
         real(wp) :: gap, normal(2), bend
         integer :: node
         call overlap_of_nodes(model, contact, overlap, node)
         if (overlap == '') return
         call obstacle_gap(obstacle, model%mesh%x_nominal(:, node), gap, normal, bend)
         if (gap + contact%gap < -deepest_start(model)) then
            ! The node penetrates even without the imperfections: the side or the position of the obstacle is wrong in the deck.
            hint = 'the order of its points'
            if (obstacle%kind == obstacle_circle) hint = 'its SIDE'
            if (obstacle%kind == obstacle_arc) hint = 'which of its angles comes first'
            call obstacle_gap(obstacle, model%mesh%x(:, node), gap, normal, bend)
            overlap = node_words(model%mesh, node)//' begins '//rounded(-gap - contact%gap)//' behind the obstacle; check '// &
               hint//', or GAP; what is meant to penetrate is pushed out by *CONTACT INTERFERENCE, SHRINK'
         end if
         call deck%wrong(set, overlap)
      end subroutine check_start

      !> Contact is detected at nodes and along elements: the convex parts of an obstacle must not be smaller than the elements.
      subroutine check_size()
         real(wp), parameter :: most_turn = 1.0_wp !! largest turn of an obstacle within the length of an element [rad]
         character(:), allocatable :: advice
         real(wp) :: length(model%mesh%n_elements)
         integer :: e
         do e = 1, model%mesh%n_elements
            length(e) = norm2(model%mesh%x(:, model%mesh%node(2, e)) - model%mesh%x(:, model%mesh%node(1, e)))
         end do
         where (.not. elements_among(model%mesh, contact%node)) length = 0.0_wp
         e = maxloc(length, 1)
         if (obstacle%kind == obstacle_line .or. e == 0) return
         if (obstacle%kind == obstacle_circle) then
            if (obstacle%inside .or. length(e) <= obstacle%radius) return
            e = findloc(length > obstacle%radius, .true., 1)
         else
            if (sharpest_turn(obstacle%curve, length(e)) <= most_turn) return
         end if
         advice = 'use more elements'
         ! The deck omits the number of elements: the program makes the mesh, and these elements only serve the output.
         if (model%mesh%placed(e)) advice = 'give a number of elements, so many that none is as long'
         if (obstacle%kind == obstacle_circle) then
            call deck%wrong(set, element_words(model%mesh, e)//' is longer than the radius of the obstacle, which could '// &
               'pass between its nodes; '//advice)
         else
            call deck%wrong(set, 'the obstacle bulges so much within the length of '//element_words(model%mesh, e)// &
               ' that it could pass between its nodes; '//advice//', or a smoother obstacle')
         end if
      end subroutine check_size

      !> All elements of a contact must have the same direction along the rod, because arc lengths and regions are measured along
      !> them.
      subroutine check_directions()
         integer :: leaving(model%mesh%n_nodes), entering(model%mesh%n_nodes), node
         call count_elements(leaving, entering)
         do node = 1, model%mesh%n_nodes
            if (max(leaving(node), entering(node)) /= 2 .or. min(leaving(node), entering(node)) /= 0) cycle
            call deck%wrong(set, 'two elements run against each other at '//node_words(model%mesh, node)// &
               '; along a contact all elements must have one direction')
            return
         end do
      end subroutine check_directions

      !> Determines whether the obstacle may act anywhere along the rod; an error is added if POINTS=ALONG is impossible.
      subroutine read_points()
         character(:), allocatable :: reason, overlap
         reason = ''
         if (obstacle%rigid) then
            contact%along = .not. obstacle%bilateral
            if (.not. contact%along) reason = 'an obstacle that is not BILATERAL'
         else
            reason = distribution_needs()
            contact%distributed = reason == ''
            ! Contact with coupled ground, or without an element between its nodes, always acts at nodes.
            if (reason /= '' .and. obstacle%ground == ground_independent .and. &
               any(elements_among(model%mesh, contact%node))) contact%needs = reason
         end if
         ! If contact is possible anywhere along the rod, obstacles must not penetrate the stress-free structure between the nodes
         ! either.
         if ((contact%along .or. contact%distributed) .and. .not. may_overlap) then
            call overlap_between(model, contact, overlap)
            if (overlap /= '') call deck%wrong(set, overlap)
         end if
         if (soil) return
         if (reason /= '' .and. deck%word('POINTS') == 'ALONG') call deck%wrong('POINTS', 'ALONG needs '//reason)
      end subroutine read_points

      !> For each node, numbers of elements of the contact that begin and that end there.
      pure subroutine count_elements(leaving, entering)
         integer, intent(out) :: leaving(:), entering(:)
         logical :: within(model%mesh%n_elements)
         integer :: e
         within = elements_among(model%mesh, contact%node)
         leaving = 0
         entering = 0
         do e = 1, model%mesh%n_elements
            if (.not. within(e)) cycle
            leaving(model%mesh%node(1, e)) = leaving(model%mesh%node(1, e)) + 1
            entering(model%mesh%node(2, e)) = entering(model%mesh%node(2, e)) + 1
         end do
      end subroutine count_elements

      !> Condition for reactions inside elements that a contact with a foundation does not satisfy; '' if its nodes are those of
      !> unbranched chains of GE elements.
      function distribution_needs() result(reason)
         character(:), allocatable :: reason
         integer :: leaving(model%mesh%n_nodes), entering(model%mesh%n_nodes), e, i
         reason = ''
         if (obstacle%ground /= ground_independent) then
            reason = 'a foundation that does not carry load sideways'
            return
         end if
         e = findloc(elements_among(model%mesh, contact%node) .and. .not. collocates(model%mesh%family), .true., 1)
         if (e > 0) then
            reason = 'GE elements; '//element_words(model%mesh, e)//' is not'
            return
         end if
         call count_elements(leaving, entering)
         do i = 1, size(contact%node)
            associate (node => contact%node(i))
               if (leaving(node) + entering(node) == 0) then
                  reason = 'elements between its nodes; '//node_words(model%mesh, node)//' is alone'
               else if (max(leaving(node), entering(node)) > 1) then
                  reason = 'chains without branches; there is one at '//node_words(model%mesh, node)
               end if
            end associate
            if (reason /= '') return
         end do
      end function distribution_needs
   end subroutine check_contact

   !> The given nodes. A release gives the element ends at its node a node of their own. This node is added if the node of the
   !> release and the node at the other end of such an element are among the given nodes.
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

   !> Chooses the contacts that act anywhere along the rods; an error is added if POINTS=ALONG is impossible.
   subroutine choose_contact_points(deck, model)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(inout) :: model             !! model of a completely read deck without errors
      character(:), allocatable :: needs
      integer :: contact
      call choose_spans(model)
      do contact = 1, size(model%contact)
         deck%at = deck%names%contact_origin(contact)
         associate (chosen => model%contact(contact))
            if (deck%at%keyword /= 'CONTACT') cycle
            if (deck%word('POINTS') /= 'ALONG' .or. chosen%along .or. chosen%distributed) cycle
            needs = 'elements between its nodes'
            if (any(model%step%paper_loop)) needs = 'LOOP=NEWTON in all steps: contact of LOOP=PAPER acts at nodes'
            if (allocated(chosen%needs)) needs = chosen%needs
            call deck%wrong('POINTS', 'ALONG needs '//needs)
         end associate
      end do
      call deck%rewind()
   end subroutine choose_contact_points
end module read_contact
