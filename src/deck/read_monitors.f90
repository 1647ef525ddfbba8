!> Reads *MONITOR (displacements and reactions of nodes, contact reactions of obstacles, section quantities) and *CONTACT PRINT
!> (columns of the listing with the beginning or end of contact). Reads *ACCURACY, too, and checks the conditions under which the
!> number of elements may be omitted.
module read_monitors
   use kinds, only: wp
   use text, only: to_text, same_name
   use model, only: model_t, monitor_t, contact_print_t, quantity_reaction, quantity_contact, quantity_section, step_t, &
      & elements_among
   use section_kinds, only: section_kind
   use obstacle_types, only: obstacle_circle, obstacle_arc
   use cross_section, only: outer_fibre
   use item_values, only: component_dof
   use distribution, only: same_length
   use checked_deck, only: checked_deck_t, element_words
   implicit none
   private
   public :: read_monitor_cards, read_contact_print_cards, read_accuracy_cards, check_placed

   real(wp), parameter :: widest = 0.01_wp       !! widest error bar of a load, over the load, if the deck requests no accuracy
   ! Tolerances of the residual and of event locations over the requested error. The residual should be a tenth of the error that
   ! the last correction leaves, see corrector. If the tolerance turns out to be too large, the iteration is continued:
   real(wp), parameter :: part_of_residual = 1.0e-3_wp, part_of_place = 0.01_wp
   real(wp), parameter :: closest = 1.0e-11_wp   !! smallest tolerance of event locations; below it the event function is rounding
   real(wp), parameter :: coarsest = 1.0e-5_wp   !! largest tolerance of the residual: a tenth of the limit in the balance checks

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
         monitor%component = modulo(deck%integer('quantity') - 1, size(section_kind)) + 1
         monitor%where = deck%integer('quantity') > size(section_kind)
         monitor%largest = .not. deck%given('s')
         monitor%place = deck%real('s')
         if (monitor%where .and. deck%given('s')) call deck%wrong('s', 'the place of the largest value is looked for along the set')
         if (deck%names%mesh_incomplete) return
         length = 0.0_wp
         do i = 1, size(monitor%element)
            associate (e => monitor%element(i))
               length = length + (model%mesh%s(2, e) - model%mesh%s(1, e))
               if (model%mesh%section(e) == 0) cycle ! another procedure reports this error
               if (section_kind(monitor%component)%of_fibre .and. &
                  & .not. outer_fibre(model%section(model%mesh%section(e))) > 0.0_wp) then
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

   !> Sets the error bars and errors that the steps request. If the program makes the mesh, every step has a requested error.
   subroutine read_accuracy_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the monitors
      type(model_t), intent(inout) :: model             !! contains its steps
      integer :: s, k
      logical :: makes_mesh
      makes_mesh = any(model%mesh%placed)
      call deck%visit_omitted('ACCURACY')
      do s = 1, size(model%step)
         model%step(s)%asked_of = [(k, k=0, size(model%monitor))]
         model%step(s)%widest_bar = widest
         call read_card(deck, makes_mesh, model%step(s))
      end do
      call deck%rewind()
      do while (deck%next_card('ACCURACY'))
         call read_card(deck, makes_mesh, model%step(deck%at%step))
      end do
      if (makes_mesh) call balance_iteration(deck, model)
   end subroutine read_accuracy_cards

   !> Adjusts the tolerances of the iteration to the requested error: an error of 1e-3 does not need a residual of 1e-9. The errors
   !> left by Newton's method and by the location of events become a small part of the requested error. Tolerances that the deck
   !> gives are kept.
   subroutine balance_iteration(deck, model)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(inout) :: model
      logical :: locate_given(size(model%step))
      integer :: s
      locate_given = .false.
      do while (deck%next_card('CONTROLS'))
         locate_given(deck%at%step) = deck%given('LOCATE')
      end do
      do s = 1, size(model%step)
         associate (step => model%step(s), finest => min(model%step(s)%asked, model%step(s)%asked_of_path))
            if (.not. step%tolerance_given) step%tolerance = max(step%tolerance, min(part_of_residual * finest, coarsest))
            if (.not. locate_given(s)) step%locate_tolerance = max(closest, min(part_of_place * finest, coarsest))
         end associate
      end do
   end subroutine balance_iteration

   !> Reads one *ACCURACY card.
   subroutine read_card(deck, makes_mesh, step)
      type(checked_deck_t), intent(inout) :: deck
      logical, intent(in) :: makes_mesh
      type(step_t), intent(inout) :: step
      integer :: monitor
      step%error_bars = deck%word('POINTS') /= 'NONE'
      step%bars_everywhere = deck%word('POINTS') == 'ALL'
      if (makes_mesh .or. deck%given('TOLERANCE')) then
         step%asked = deck%real('TOLERANCE')
         step%widest_bar = step%asked
      end if
      step%asked_of_path = step%asked
      if (deck%given('PATH')) step%asked_of_path = deck%real('PATH')
      if (deck%given('WIDEST')) step%widest_bar = deck%real('WIDEST')
      if (deck%given('PATH') .and. .not. makes_mesh) call deck%wrong('PATH', 'PATH goes with a number of elements that is left out')
      if (makes_mesh .and. .not. step%error_bars) call deck%wrong('POINTS', &
         'POINTS must not be NONE where a number of elements is left out')
      if (deck%at%n_lines == 0) return
      step%asked_of = [integer ::]
      do while (deck%next_line())
         monitor = deck%quantity('monitor')
         if (monitor >= 0) step%asked_of = [step%asked_of, monitor]
      end do
   end subroutine read_card

   !> Checks omitted numbers of elements: it must be permitted to move the nodes along the rod, so that no contact acts at them.
   subroutine check_placed(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the lines that define curves
      type(model_t), intent(in) :: model                !! model of a completely read deck without errors
      logical :: reported(size(model%curve)), stay(model%mesh%n_elements)
      integer :: c, e
      reported = .false.
      do c = size(model%contact), 1, -1
         associate (contact => model%contact(c), obstacle => model%obstacle(model%contact(c)%obstacle))
            if (obstacle%at_nodes .or. (obstacle%rigid .and. contact%along) .or. contact%distributed) cycle
            stay = model%mesh%placed .and. elements_among(model%mesh, contact%node)
            do e = 1, model%mesh%n_elements
               if (.not. stay(e)) cycle
               if (reported(model%mesh%curve(e))) cycle
               reported(model%mesh%curve(e)) = .true.
               deck%at = deck%at_line(deck%names%curve_line(model%mesh%curve(e)))
               call deck%wrong_line('the number of elements cannot be left out here: contact with '//trim(obstacle%name)// &
                  ' acts at the nodes')
            end do
         end associate
      end do
      call deck%rewind()
   end subroutine check_placed
end module read_monitors
