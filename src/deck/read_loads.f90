!> Reads the loads of the steps, which grow with the load factor.
module read_loads
   use kinds, only: wp
   use text, only: to_text
   use model, only: model_t, load_t, new_load
   use point_load, only: point_load_t
   use pole_load, only: pole_load_t
   use diagnostics, only: diagnostics_t
   use deck_cards, only: deck_t, complain
   use card_values, only: field_given, field_place, field_word, field_integer, field_real
   use deck_names, only: deck_names_t, find_nodes, find_elements
   use read_obstacles, only: read_motion
   use read_interference, only: read_interference_line
   use read_supports, only: read_dofs, dof_number
   implicit none
   private
   public :: read_load_cards, is_load_card, load_cards

   !> Keywords of all cards that are loads only; a new load card is added here. (*BOUNDARY in a step is a load, too.)
   character(*), parameter :: load_card(*) = [character(20) :: 'CLOAD', 'POLE LOAD', 'DLOAD', 'TEMPERATURE', 'OBSTACLE MOTION', &
      & 'CONTACT INTERFERENCE']

contains

   !> True for the keyword of a load card.
   pure logical function is_load_card(keyword)
      character(*), intent(in) :: keyword
      is_load_card = any(load_card == keyword)
   end function is_load_card

   !> All load cards, for messages: *CLOAD, *DLOAD ...
   pure function load_cards() result(list)
      character(:), allocatable :: list
      integer :: i
      list = '*'//trim(load_card(1))
      do i = 2, size(load_card)
         list = list//', *'//trim(load_card(i))
      end do
   end function load_cards

   !> Reads the loads of all steps.
   subroutine read_load_cards(deck, names, model, diagnostics)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names           !! with the mesh and obstacles
      type(model_t), intent(inout) :: model             !! with sections, supports and contacts; receives step%load
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: card, line, s
      integer :: prescribed_in(3, model%mesh%n_nodes)   ! line of the deck, for the step being read
      integer :: shrunk_in(size(model%obstacle))        ! (obstacles) line of the deck, for the steps since the last stress-free
      ! start
      do s = 1, size(model%step)
         model%step(s)%load = new_load(model%mesh%n_nodes, model%mesh%n_elements, size(model%obstacle))
      end do
      prescribed_in = 0
      shrunk_in = 0
      do card = 1, deck%n_cards
         if (deck%card(card)%keyword == 'STEP') then
            prescribed_in = 0
            if (begins_anew(deck, deck%card(card)%step)) shrunk_in = 0
         end if
         if (.not. deck%card(card)%sound .or. deck%card(card)%step == 0) cycle
         associate (load => model%step(deck%card(card)%step)%load)
            do line = deck%card(card)%first_line, deck%card(card)%last_line
               if (.not. deck%data_line(line)%sound) cycle
               select case (deck%card(card)%keyword)
               case ('CLOAD')
                  call read_node_load(deck, names, model, diagnostics, line, load)
               case ('POLE LOAD')
                  call read_pole_load(deck, names, model, diagnostics, line, load)
               case ('DLOAD')
                  call read_element_load(deck, names, model, diagnostics, line, load)
               case ('TEMPERATURE')
                  call read_temperature(deck, names, model, diagnostics, line, load)
               case ('OBSTACLE MOTION')
                  call read_motion(deck, names, diagnostics, line, load)
               case ('CONTACT INTERFERENCE')
                  call read_interference_line(deck, names, model, diagnostics, line, shrunk_in, load)
               case ('BOUNDARY')
                  call read_displacement(deck, names, model, diagnostics, line, prescribed_in, load)
               end select
            end do
         end associate
      end do
   end subroutine read_load_cards

   !> True for a step with modes as imperfections: it starts from the stress-free structure.
   pure logical function begins_anew(deck, step)
      type(deck_t), intent(in) :: deck
      integer, intent(in) :: step
      integer :: card
      begins_anew = .false.
      do card = 1, deck%n_cards
         if (deck%card(card)%step == step) begins_anew = begins_anew .or. deck%card(card)%keyword == 'IMPERFECTION'
      end do
   end function begins_anew

   !> Reads *CLOAD: node or set, dof, magnitude.
   subroutine read_node_load(deck, names, model, diagnostics, line, load)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      type(load_t), intent(inout) :: load
      integer, allocatable :: nodes(:)
      integer :: dof, i
      dof = findloc(dof_number, field_integer(deck, line, 2), 1)
      if (dof == 0) then
         call complain(deck, diagnostics, deck%data_line(line)%card, field_place(deck, line, 2), &
            'dof must be 1, 2 or 6, not '//to_text(field_integer(deck, line, 2)))
         return
      end if
      call find_nodes(deck, names, diagnostics, line, 1, nodes)
      do i = 1, size(nodes)
         if (.not. is_connected(deck, names, model, diagnostics, line, nodes(i))) return
         load%node_force(dof, nodes(i)) = load%node_force(dof, nodes(i)) + field_real(deck, line, 3)
      end do
   end subroutine read_node_load

   !> Reads *POLE LOAD: node or set, magnitude, x, y.
   subroutine read_pole_load(deck, names, model, diagnostics, line, load)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      type(load_t), intent(inout) :: load
      integer, allocatable :: nodes(:)
      class(point_load_t), allocatable :: point
      real(wp) :: pole(2)
      integer :: i
      pole = [field_real(deck, line, 3), field_real(deck, line, 4)]
      call find_nodes(deck, names, diagnostics, line, 1, nodes)
      do i = 1, size(nodes)
         if (.not. is_connected(deck, names, model, diagnostics, line, nodes(i))) return
         if (norm2(pole - model%mesh%x(:, nodes(i))) <= 0.0_wp) then
            call complain(deck, diagnostics, deck%data_line(line)%card, field_place(deck, line, 3), &
               'node '//to_text(model%mesh%node_label(nodes(i)))//' begins at this point: the force has no direction there')
            return
         end if
         point = pole_load_t(node=nodes(i), magnitude=field_real(deck, line, 2), pole=pole)
         call load%add_point(point)
      end do
   end subroutine read_pole_load

   !> Reads *DLOAD: element or set, type, magnitude, direction.
   subroutine read_element_load(deck, names, model, diagnostics, line, load)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      type(load_t), intent(inout) :: load
      integer, allocatable :: elements(:)
      character(:), allocatable :: word
      real(wp) :: magnitude, direction(2)
      integer :: card, i, e
      card = deck%data_line(line)%card
      call find_elements(deck, names, diagnostics, line, 1, elements)
      word = field_word(deck, line, 2)
      magnitude = field_real(deck, line, 3)
      direction = [field_real(deck, line, 4), field_real(deck, line, 5)]
      if (word == 'GRAV') then
         if (.not. (field_given(deck, line, 4) .and. field_given(deck, line, 5))) then
            call complain(deck, diagnostics, card, field_place(deck, line, merge(5, 4, field_given(deck, line, 4))), &
               'GRAV needs a direction: x direction, y direction')
            return
         else if (norm2(direction) <= 0.0_wp) then
            call complain(deck, diagnostics, card, field_place(deck, line, 4), 'the direction has no length')
            return
         end if
         direction = direction / norm2(direction)
      else if (deck%data_line(line)%n_fields > 3) then
         call complain(deck, diagnostics, card, field_place(deck, line, 4), 'a direction goes with GRAV only')
         return
      end if
      do i = 1, size(elements)
         e = elements(i)
         select case (word)
         case ('PX')
            load%line_force(1, e) = load%line_force(1, e) + magnitude
         case ('PY')
            load%line_force(2, e) = load%line_force(2, e) + magnitude
         case ('P')
            load%pressure(e) = load%pressure(e) + magnitude
         case default
            if (model%mesh%section(e) == 0) cycle ! reported elsewhere
            associate (mass => model%section(model%mesh%section(e))%mass)
               if (mass <= 0.0_wp .and. .not. names%sections_incomplete) then
                  call complain(deck, diagnostics, card, field_place(deck, line, 1), 'element '// &
                     to_text(model%mesh%element_label(e))//' has no mass; it comes from *DENSITY, or from mass on '// &
                     '*BEAM SECTION, SECTION=STIFFNESS')
                  return
               end if
               load%line_force(:, e) = load%line_force(:, e) + mass * magnitude * direction
            end associate
         end select
      end do
   end subroutine read_element_load

   !> Reads *TEMPERATURE: element or set, change, gradient.
   subroutine read_temperature(deck, names, model, diagnostics, line, load)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      type(load_t), intent(inout) :: load
      integer, allocatable :: elements(:)
      integer :: i, e
      call find_elements(deck, names, diagnostics, line, 1, elements)
      do i = 1, size(elements)
         e = elements(i)
         if (model%mesh%section(e) == 0) cycle ! reported elsewhere
         associate (alpha => model%section(model%mesh%section(e))%expansion)
            if (.not. (abs(alpha) > 0.0_wp .or. names%sections_incomplete)) then
               call complain(deck, diagnostics, deck%data_line(line)%card, field_place(deck, line, 1), 'element '// &
                  to_text(model%mesh%element_label(e))//' does not expand; alpha comes from *EXPANSION, or from alpha on '// &
                  '*BEAM SECTION, SECTION=STIFFNESS')
               return
            end if
            load%strain(e) = load%strain(e) + alpha * field_real(deck, line, 2)
            ! An element that is hotter on its left side bends to the right.
            load%curvature(e) = load%curvature(e) - alpha * field_real(deck, line, 3)
         end associate
      end do
   end subroutine read_temperature

   !> Reads *BOUNDARY in a step: node or set, dof, last dof, value.
   subroutine read_displacement(deck, names, model, diagnostics, line, prescribed_in, load)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line
      integer, intent(inout) :: prescribed_in(:, :)
      type(load_t), intent(inout) :: load
      integer, allocatable :: nodes(:)
      logical :: dofs(3)
      integer :: card, i, dof
      card = deck%data_line(line)%card
      if (.not. field_given(deck, line, 4)) then
         call complain(deck, diagnostics, card, field_place(deck, line, 4), &
            'value is missing; supports stand above the first *STEP, here only prescribed displacements')
         return
      end if
      if (field_word(deck, line, 2) /= '') then
         call complain(deck, diagnostics, card, field_place(deck, line, 2), &
            field_word(deck, line, 2)//' is a support and belongs above the first *STEP; a step prescribes dofs 1, 2, 6')
         return
      end if
      call find_nodes(deck, names, diagnostics, line, 1, nodes)
      call read_dofs(deck, diagnostics, line, dofs)
      do i = 1, size(nodes)
         do dof = 1, 3
            if (.not. dofs(dof)) cycle
            if (.not. (model%fixed(dof, nodes(i)) .or. names%supports_incomplete)) then
               call complain(deck, diagnostics, card, field_place(deck, line, 2), 'dof '//to_text(dof_number(dof))// &
                  ' of node '//to_text(model%mesh%node_label(nodes(i)))//' is free; what is prescribed must be '// &
                  'supported by a *BOUNDARY above the first *STEP')
               return
            else if (prescribed_in(dof, nodes(i)) > 0) then
               call complain(deck, diagnostics, card, field_place(deck, line, 2), 'dof '//to_text(dof_number(dof))// &
                  ' of node '//to_text(model%mesh%node_label(nodes(i)))//' is prescribed already, in '// &
                  deck%source%line_words(prescribed_in(dof, nodes(i))))
               return
            end if
            prescribed_in(dof, nodes(i)) = deck%data_line(line)%line
            load%displacement(dof, nodes(i)) = field_real(deck, line, 4)
         end do
      end do
   end subroutine read_displacement

   !> False if a loaded node belongs to no element; an error is then added.
   logical function is_connected(deck, names, model, diagnostics, line, node)
      type(deck_t), intent(in) :: deck
      type(deck_names_t), intent(in) :: names
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer, intent(in) :: line, node
      is_connected = names%connected(node) .or. names%mesh_incomplete
      if (.not. is_connected) call complain(deck, diagnostics, deck%data_line(line)%card, field_place(deck, line, 1), &
         'node '//to_text(model%mesh%node_label(node))//' belongs to no element and cannot carry a load')
   end function is_connected
end module read_loads
