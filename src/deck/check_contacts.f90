!> Conditions on the nodes of contacts, checked if the rest of the deck has no errors: for candidates of an obstacle with coupled
!> ground, and for contact and stops at nodes that are tied to others.
!>
!> Contact with a rigid obstacle eliminates a displacement of the node. A tied node has no independent displacement: the node to
!> which it is tied must have the contact, at the same position and as a candidate for the same obstacle. The force of a foundation
!> acts on the nodes to which a node is tied; coupled ground requires independent unknowns of its nodes. A node that carries an
!> obstacle has independent unknowns and touches nothing; a node that may touch the obstacle moves with it.
module check_contacts
   use kinds, only: wp
   use text, only: to_text
   use model, only: model_t, contact_t
   use obstacle_types, only: ground_independent, ground_half_space
   use obstacle_geometry, only: obstacle_gap
   use rod_geometry, only: geometry_t, new_geometry
   use candidates, only: candidates_t, new_candidates
   use surface_patches, only: patches_t, new_patches, couples, first_overlap
   use checked_deck, only: checked_deck_t, node_words
   implicit none
   private
   public :: check_ground_candidates, check_contact_of_tied_nodes, check_carriers, keep_leaders

   integer, parameter :: most_candidates = 1500 !! largest number of candidates; their compliances form a full matrix

contains

   !> Checks the candidates of obstacles on coupled ground: their number; their tributary lengths (positive for a half-space); and
   !> that no two candidates load the same place of the ground.
   subroutine check_ground_candidates(deck, model)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model !! model of a deck without errors
      type(geometry_t) :: geometry
      type(candidates_t) :: list
      type(patches_t) :: patches
      character(:), allocatable :: problem
      integer :: contact
      if (.not. any(couples(model%obstacle))) return
      geometry = new_geometry(model)
      list = new_candidates(model, geometry, distributed=.false.)
      patches = new_patches(model, list, geometry)
      ! The error is reported at the last card that takes part in it.
      do contact = size(model%contact), 1, -1
         if (.not. couples(model%obstacle(model%contact(contact)%obstacle))) cycle
         problem = contact_problem(model%contact(contact)%obstacle)
         if (problem == '') cycle
         deck%at = deck%names%contact_origin(contact)
         call deck%wrong('NSET', problem)
         exit
      end do
      call deck%rewind()

   contains

      !> Reason why an obstacle with coupled ground cannot have its candidates; '' if it can.
      function contact_problem(obstacle) result(problem)
         integer, intent(in) :: obstacle
         character(:), allocatable :: problem
         integer :: pair(2), alone
         problem = ''
         if (patches%n > most_candidates) then
            problem = 'all obstacles that carry load sideways have '//to_text(patches%n)//' candidates; with a full matrix of '// &
               'compliances '//to_text(most_candidates)//' are allowed'
            return
         end if
         alone = findloc(list%obstacle == obstacle .and. .not. list%tributary > 0.0_wp, .true., 1)
         if (alone > 0 .and. model%obstacle(obstacle)%ground == ground_half_space) then
            problem = node_words(model%mesh, list%node(alone))//' is a candidate without an element to another one: a force on '// &
               'no area sinks into a half-space without limit'
            return
         end if
         pair = first_overlap(patches, list, obstacle)
         if (pair(1) == 0) return
         problem = 'nodes '//to_text(model%mesh%node_label(list%node(pair(1))))//' and '// &
            to_text(model%mesh%node_label(list%node(pair(2))))//' load the same place of the ground, which carries load '// &
            'sideways; give one of the rods an obstacle of its own'
      end function contact_problem
   end subroutine check_ground_candidates

   !> Reports the first node of each *CONTACT and *GAP at which contact is impossible.
   subroutine check_contact_of_tied_nodes(deck, model)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model !! model of a deck without errors
      integer :: contact
      do contact = 1, size(model%contact)
         deck%at = deck%names%contact_origin(contact)
         call check_tied_nodes(trim(merge('NSET       ', 'node or set', deck%at%keyword == 'CONTACT')), model%contact(contact))
      end do
      call deck%rewind()

   contains

      !> Reports the first node of a contact at which contact is impossible.
      subroutine check_tied_nodes(name, contact)
         character(*), intent(in) :: name                  ! name of the parameter or field that names the nodes
         type(contact_t), intent(in) :: contact
         character(:), allocatable :: why
         integer :: i
         associate (obstacle => model%obstacle(contact%obstacle))
            if (.not. obstacle%rigid .and. obstacle%ground == ground_independent) return
            do i = 1, size(contact%node)
               if (.not. any(model%tie%node == contact%node(i) .and. (model%tie%component < 3 .or. .not. obstacle%rigid))) cycle
               if (.not. obstacle%rigid) then
                  why = 'cannot lie on ground that carries load sideways: that needs rods without joints'
               else if (obstacle%at_nodes) then
                  why = 'cannot have a rigid stop: give it to the node that it follows, or give it a STIFFNESS'
               else if (leader_touches(model, contact, contact%node(i), leader(model, contact%node(i)))) then
                  cycle
               else
                  why = 'cannot touch a rigid obstacle: let the node that it follows touch it, give the obstacle a '// &
                     'foundation, or take a stiff rod instead of the joint'
               end if
               call deck%wrong(name, node_words(model%mesh, contact%node(i))//' follows another one and '//why)
               return
            end do
         end associate
      end subroutine check_tied_nodes
   end subroutine check_contact_of_tied_nodes

   !> Reports obstacles that their nodes cannot carry, and nodes that cannot move with an obstacle.
   subroutine check_carriers(deck, model)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model !! model of a deck without errors
      integer :: contact, card
      do contact = 1, size(model%contact)
         deck%at = deck%names%contact_origin(contact)
         if (deck%at%keyword == 'CONTACT') call check_nodes(model%contact(contact))
      end do
      call deck%rewind()
      card = 0
      do while (deck%next_card('OBSTACLE'))
         card = card + 1
         associate (carrier => model%obstacle(card)%carrier)
            if (carrier == 0) cycle
            if (any(model%tie%node == carrier)) call deck%wrong('NODE', &
               node_words(model%mesh, carrier)//' follows another one: let the node that it follows carry the obstacle')
         end associate
      end do

   contains

      !> Reports the first node of a contact that cannot touch the obstacle, because a node carries the obstacle or the node itself
      !> carries one.
      subroutine check_nodes(contact)
         type(contact_t), intent(in) :: contact
         real(wp), parameter :: rounded = 1.0e-10_wp ! accuracy of positions, over the structure's size; decks give ten digits or
         ! more
         real(wp) :: gap, normal(2), bend
         integer :: i
         associate (own => model%obstacle(contact%obstacle)%carrier, obstacle => model%obstacle(contact%obstacle))
            do i = 1, size(contact%node)
               associate (node => contact%node(i))
                  if (any(model%obstacle%carrier == node)) then
                     call deck%wrong('NSET', node_words(model%mesh, node)//' carries an obstacle, and cannot touch one')
                     return
                  end if
                  if (own == 0) cycle
                  call obstacle_gap(obstacle, model%mesh%x(:, node), gap, normal, bend)
                  if (all(model%fixed(1:2, node)) .and. gap + contact%gap <= rounded * norm2(model%mesh%x(:, node))) then
                     call deck%wrong('NSET', node_words(model%mesh, node)//' is held in x and y, and begins on '// &
                        trim(obstacle%name)//', which a node carries and could not move: leave it out')
                     return
                  end if
               end associate
            end do
         end associate
      end subroutine check_nodes
   end subroutine check_carriers

   !> Of tied nodes at the same position only one remains in contact: nodes that are tied to another node of the same rigid contact
   !> are removed from the contact.
   subroutine keep_leaders(model)
      type(model_t), intent(inout) :: model             !! model that has passed check_contact_of_tied_nodes
      logical, allocatable :: stays(:)
      integer :: c, i, lead
      do c = 1, size(model%contact)
         associate (contact => model%contact(c))
            if (.not. model%obstacle(contact%obstacle)%rigid) cycle
            allocate (stays(size(contact%node)), source=.true.)
            do i = 1, size(contact%node)
               lead = leader(model, contact%node(i))
               if (lead == contact%node(i)) cycle
               stays(i) = .not. any(contact%node == lead)
            end do
         end associate
         model%contact(c)%node = pack(model%contact(c)%node, stays)
         deallocate (stays)
      end do
   end subroutine keep_leaders

   !> Node that has the same displacements x and y as a tied node, with chains of ties resolved; 0 if there is none or a tie has an
   !> arm.
   pure integer function leader(model, node) result(lead)
      type(model_t), intent(in) :: model
      integer, intent(in) :: node
      integer :: i, of, found
      lead = node
      do
         of = 0
         found = 0
         do i = 1, size(model%tie)
            associate (tie => model%tie(i))
               if (tie%node /= lead .or. tie%component == 3) cycle
               found = found + 1
               ! Only a tie that makes the component equal to the same component of another node counts.
               if (size(tie%of) /= 1 .or. tie%part(1) /= tie%component .or. abs(tie%factor(1) - 1.0_wp) > 0.0_wp .or. &
                  & (tie%turner /= 0 .and. norm2(tie%arm) > 0.0_wp)) of = -1
               if (of == 0) of = tie%of(1)
               if (of /= tie%of(1)) of = -1
            end associate
         end do
         if (found == 0) return
         lead = 0
         if (of <= 0 .or. found == 1) return
         lead = of
      end do
   end function leader

   !> True if a node's leader is at the same position and is a candidate for the same obstacle with the same GAP.
   pure logical function leader_touches(model, contact, node, lead)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: contact
      integer, intent(in) :: node, lead                 !! node; its leader, 0: none
      integer :: k
      leader_touches = .false.
      if (lead == 0) return
      associate (x => model%mesh%x)
         if (norm2(x(:, node) - x(:, lead)) > 8.0_wp * epsilon(x) * maxval(abs(x))) return
      end associate
      do k = 1, size(model%contact)
         associate (other => model%contact(k))
            if (other%obstacle /= contact%obstacle .or. abs(other%gap - contact%gap) > 0.0_wp) cycle
            leader_touches = leader_touches .or. any(other%node == lead)
         end associate
      end do
   end function leader_touches
end module check_contacts
