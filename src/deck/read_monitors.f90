!> Reads *MONITOR (displacements and reactions of nodes, contact reactions of obstacles, section quantities) and *CONTACT PRINT
!> (columns of the listing with the beginning or end of contact).
module read_monitors
   use kinds, only: wp
   use text, only: to_text, same_name
   use model, only: model_t, monitor_t, contact_print_t, quantity_reaction, quantity_contact, quantity_section, &
      & section_moment, section_stress
   use cross_section, only: outer_fibre
   use item_values, only: component_dof
   use deck_names, only: element_words
   use distribution, only: same_length
   use obstacle_types, only: obstacle_circle, obstacle_arc
   use checked_deck, only: checked_deck_t
   implicit none
   private
   public :: read_monitor_cards, read_contact_print_cards

contains

   !> Reads the monitors.
   subroutine read_monitor_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! in: contains the mesh; out: also the monitors
      type(model_t), intent(inout) :: model             !! in: contains supports and contacts; out: also monitor
      type(monitor_t) :: monitor
      logical :: ok
      do while (deck%next_card('MONITOR'))
         if (same_name(deck%text('NAME'), 'LOAD')) then
            call deck%wrong('NAME', 'LOAD means the load factor')
            cycle
         end if
         if (.not. deck%defines(deck%names%monitor, deck%text('NAME'))) cycle
         monitor = monitor_t(name=deck%text('NAME'))
         allocate (monitor%node(0), monitor%element(0))
         if (deck%given('OBSTACLE')) then
            monitor%quantity = quantity_contact
            call deck%touched_obstacle('OBSTACLE', monitor%obstacle, ok)
         end if
         if (deck%given('ELSET')) then
            if (deck%given('OBSTACLE')) call deck%wrong('ELSET', 'a monitor observes an obstacle or sections, not both')
            monitor%quantity = quantity_section
            monitor%element = deck%elements('ELSET')
         end if
         if (deck%next_line()) then
            monitor%factor = deck%real('factor')
            monitor%offset = deck%real('offset')
            if (monitor%quantity == quantity_section) then
               call read_section_quantity()
            else
               if (monitor%quantity /= quantity_contact) monitor%node = deck%nodes('node or set')
               ! The words are in the order x, y, rotation: first those of displacements, then those of reactions.
               if (monitor%quantity /= quantity_contact .and. deck%integer('quantity') > size(component_dof)) &
                  & monitor%quantity = quantity_reaction
               monitor%component = modulo(deck%integer('quantity') - 1, size(component_dof)) + 1
               call check_monitor()
            end if
         end if
         model%monitor = [model%monitor, monitor]
      end do

   contains

      !> Reads the data line of a monitor of section quantities.
      subroutine read_section_quantity()
         real(wp) :: length
         integer :: i
         monitor%component = modulo(deck%integer('quantity') - 1, section_stress) + 1
         monitor%where = deck%integer('quantity') > section_stress
         monitor%largest = .not. deck%given('s')
         monitor%place = deck%real('s')
         if (monitor%where .and. deck%given('s')) call deck%wrong('s', 'the place of the largest value is looked for along the set')
         if (deck%names%mesh_incomplete) return
         length = 0.0_wp
         do i = 1, size(monitor%element)
            associate (e => monitor%element(i))
               length = length + (model%mesh%s(2, e) - model%mesh%s(1, e))
               if (model%mesh%section(e) == 0) cycle ! another procedure reports this error
               if (monitor%component > section_moment .and. .not. outer_fibre(model%section(model%mesh%section(e))) > 0.0_wp) then
                  call deck%wrong('quantity', element_words(model%mesh, e)//' has no shape with an outermost fibre; that takes '// &
                     'SECTION=RECT, CIRC or PIPE')
                  return
               end if
            end associate
         end do
         if (monitor%place > length * (1.0_wp + same_length)) call deck%wrong('s', 'the elements of ELSET are only '// &
            to_text(length)//' long')
      end subroutine read_section_quantity

      !> Checks that the nodes belong to elements; for a reaction, that at least one node is supported.
      subroutine check_monitor()
         if (size(monitor%node) == 0) return
         if (.not. deck%on_elements('node or set', model%mesh, monitor%node)) return
         if (monitor%quantity == quantity_reaction .and. .not. deck%names%supports_incomplete) then
            associate (part => monitor%component, node => monitor%node)
               if (.not. any(model%fixed(part, node) .or. model%spring(part, node) > 0.0_wp)) call deck%wrong('quantity', &
                  & 'no *BOUNDARY of the model part supports this, so there is no reaction')
            end associate
         end if
      end subroutine check_monitor
   end subroutine read_monitor_cards

   !> Reads the columns of the listing in the order of the deck.
   subroutine read_contact_print_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the obstacles
      type(model_t), intent(inout) :: model             !! in: contains contacts; out: also contact_print
      type(contact_print_t) :: print
      character(:), allocatable :: word
      logical :: ok
      do while (deck%next_card('CONTACT PRINT'))
         call deck%touched_obstacle('OBSTACLE', print%obstacle, ok)
         if (.not. ok) cycle
         associate (obstacle => model%obstacle(print%obstacle))
            do while (deck%next_line())
               word = deck%word('quantity')
               print%at_end = index(word, 'END') == 1
               print%angle = index(word, 'ANGLE') > 0
               print%region = deck%integer('stretch')
               if (print%angle .and. .not. (obstacle%kind == obstacle_circle .or. obstacle%kind == obstacle_arc)) then
                  call deck%wrong('quantity', 'angles are those of circles and arcs; '//trim(obstacle%name)//' is neither')
                  cycle
               end if
               model%contact_print = [model%contact_print, print]
            end do
         end associate
      end do
   end subroutine read_contact_print_cards
end module read_monitors
