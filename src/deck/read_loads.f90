!> Reads the loads of the steps, which grow with the load factor.
module read_loads
   use kinds, only: wp
   use text, only: to_text
   use model, only: model_t, load_t, new_load
   use load_pattern, only: line_load_t, pole_load_t
   use distribution, only: distributed_t
   use cross_section, only: varies
   use element_families, only: collocates
   use initial_overlap, only: deepest_overlap
   use item_values, only: component_dof
   use checked_deck, only: checked_deck_t, node_words, element_words
   use read_supports, only: read_dofs
   use read_sections, only: read_distributed
   implicit none
   private
   public :: note_pushed_out, read_load_cards, load_cards

   !> Keywords of all cards that define loads only; a new load card must be added here. (In a step *BOUNDARY is a load, too.)
   character(*), parameter :: load_cards = 'CLOAD|POLE LOAD|DLOAD|LIQUID|TEMPERATURE|OBSTACLE MOTION|CONTACT INTERFERENCE'

contains

   !> Stores the obstacles that push the structure out in some step, so that nodes may begin behind them.
   subroutine note_pushed_out(deck)
      type(checked_deck_t), intent(inout) :: deck       !! out: names%pushed_out is set
      integer :: i
      logical :: is_new
      do while (deck%next_card('CONTACT INTERFERENCE'))
         if (.not. deck%given('SHRINK')) cycle
         do while (deck%next_line())
            call deck%names%pushed_out%add(deck%text('obstacle'), i, is_new)
         end do
      end do
   end subroutine note_pushed_out

   !> Reads the loads of all steps.
   subroutine read_load_cards(deck, model)
      type(checked_deck_t), intent(inout) :: deck       !! contains the mesh and obstacles
      type(model_t), intent(inout) :: model             !! in: contains sections, supports and contacts; out: also step%load
      integer :: s
      integer :: prescribed_in(3, model%mesh%n_nodes) ! (3, nodes) line of the deck that prescribes the displacement in the present
      ! step; 0: none
      integer :: shrunk_in(size(model%obstacle)) ! (obstacles) line of the deck with the obstacle's SHRINK in the steps since the
      ! last stress-free start; 0: none
      do s = 1, size(model%step)
         model%step(s)%load = new_load(model%mesh%n_nodes, model%mesh%n_elements, size(model%obstacle))
      end do
      prescribed_in = 0
      shrunk_in = 0
      s = 0
      do while (deck%next_card(load_cards//'|BOUNDARY'))
         if (deck%at%step == 0) cycle
         do while (s < deck%at%step)
            s = s + 1
            prescribed_in = 0
            ! A step that has modes as imperfections starts from the stress-free structure.
            if (deck%last_card('IMPERFECTION', s) > 0) shrunk_in = 0
         end do
         associate (load => model%step(s)%load)
            do while (deck%next_line())
               select case (deck%at%keyword)
               case ('CLOAD')
                  call read_node_load(deck, model, load)
               case ('POLE LOAD')
                  call read_pole_load(deck, model, load)
               case ('DLOAD')
                  call read_element_load(deck, model, load)
               case ('LIQUID')
                  call read_liquid(deck, model, load)
               case ('TEMPERATURE')
                  call read_temperature(deck, model, load)
               case ('OBSTACLE MOTION')
                  call read_motion(deck, model, load)
               case ('CONTACT INTERFERENCE')
                  call read_interference(deck, model, shrunk_in, load)
               case ('BOUNDARY')
                  call read_displacement(deck, model, prescribed_in, load)
               end select
            end do
         end associate
      end do
   end subroutine read_load_cards

   !> Reads a data line of *CLOAD: node or set, dof, magnitude.
   subroutine read_node_load(deck, model, load)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(load_t), intent(inout) :: load
      integer, allocatable :: nodes(:)
      integer :: dof
      nodes = deck%nodes('node or set')
      dof = deck%integer('dof')
      if (.not. deck%on_elements('node or set', model%mesh, nodes, ' and cannot carry a load')) return
      load%node_force(dof, nodes) = load%node_force(dof, nodes) + deck%real('magnitude')
   end subroutine read_node_load

   !> Reads a data line of *POLE LOAD: node or set, magnitude, x, y.
   subroutine read_pole_load(deck, model, load)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(load_t), intent(inout) :: load
      integer, allocatable :: nodes(:)
      real(wp) :: pole(2)
      integer :: i
      pole = [deck%real('x'), deck%real('y')]
      nodes = deck%nodes('node or set')
      if (.not. deck%on_elements('node or set', model%mesh, nodes, ' and cannot carry a load')) return
      do i = 1, size(nodes)
         if (norm2(pole - model%mesh%x(:, nodes(i))) <= 0.0_wp) then
            call deck%wrong('x', node_words(model%mesh, nodes(i))//' begins at this point: the force has no direction there')
            return
         end if
         load%pole_load = [load%pole_load, pole_load_t(nodes(i), deck%real('magnitude'), pole)]
      end do
   end subroutine read_pole_load

   !> Reads a data line of *DLOAD: element or set, type, magnitude, direction.
   subroutine read_element_load(deck, model, load)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(load_t), intent(inout) :: load
      integer, allocatable :: elements(:)
      type(distributed_t) :: magnitude
      real(wp) :: direction(2)
      elements = deck%elements('element or set')
      call read_distributed(deck, model, 'magnitude', elements, magnitude)
      if (deck%word('type') == 'GRAV') then
         direction = [deck%real('x direction'), deck%real('y direction')]
         if (.not. deck%given('x direction')) then
            call deck%wrong('x direction', 'GRAV needs a direction: x direction, y direction')
         else if (.not. deck%given('y direction')) then
            call deck%wrong('y direction', 'GRAV needs a direction: x direction, y direction')
         else if (norm2(direction) <= 0.0_wp) then
            call deck%wrong('x direction', 'the direction has no length')
         else
            call add_weight(deck, model, load, elements, magnitude, direction / norm2(direction))
         end if
         return
      else if (deck%count('x direction') > 0) then
         call deck%wrong('x direction', 'a direction goes with GRAV only')
         return
      end if
      select case (deck%word('type'))
      case ('PX')
         call add_dead_load(deck, model, load, elements, magnitude, [1.0_wp, 0.0_wp])
      case ('PY')
         call add_dead_load(deck, model, load, elements, magnitude, [0.0_wp, 1.0_wp])
      case ('PT')
         call add_line(deck, model, load, elements, line_load_t(magnitude, [1.0_wp, 0.0_wp], along_axis=.true.))
      case ('PN')
         call add_line(deck, model, load, elements, line_load_t(magnitude, [0.0_wp, 1.0_wp], along_axis=.true.))
      case ('P')
         if (magnitude%distribution > 0) call deck%wrong('magnitude', 'a pressure that follows the rod is the same along '// &
            'it, or that of a *LIQUID; PN, a dead load to the left, may vary')
         load%pressure(elements) = load%pressure(elements) + magnitude%value
      end select
   end subroutine read_element_load

   !> Adds a dead load whose direction is the same everywhere.
   subroutine add_dead_load(deck, model, load, elements, magnitude, direction)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(load_t), intent(inout) :: load
      integer, intent(in) :: elements(:)
      type(distributed_t), intent(in) :: magnitude
      real(wp), intent(in) :: direction(2)
      integer :: i
      if (magnitude%distribution > 0) then
         call add_line(deck, model, load, elements, line_load_t(magnitude, direction))
         return
      end if
      do i = 1, size(elements)
         load%line_force(:, elements(i)) = load%line_force(:, elements(i)) + magnitude%value * direction
      end do
   end subroutine add_dead_load

   !> Adds a dead load that varies along the rods.
   subroutine add_line(deck, model, load, elements, line)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(load_t), intent(inout) :: load
      integer, intent(in) :: elements(:)
      type(line_load_t), intent(in) :: line
      type(line_load_t) :: new
      integer :: i
      i = findloc(collocates(model%mesh%family(elements)), .false., 1)
      if (i > 0) then
         call deck%wrong('element or set', element_words(model%mesh, elements(i))//' is UL2; loads that vary need GE elements')
         return
      end if
      new = line
      allocate (new%on(model%mesh%n_elements), source=.false.)
      new%on(elements) = .true.
      load%line_load = [load%line_load, new]
   end subroutine add_line

   !> Reads a data line of *LIQUID: element or set, weight, level.
   subroutine read_liquid(deck, model, load)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(load_t), intent(inout) :: load
      integer, allocatable :: elements(:)
      integer :: i
      elements = deck%elements('element or set')
      i = findloc(collocates(model%mesh%family(elements)), .false., 1)
      if (i > 0) call deck%wrong('element or set', element_words(model%mesh, elements(i))//' is UL2; a liquid needs GE elements')
      load%pressure(elements) = load%pressure(elements) + deck%real('weight') * deck%real('level')
      load%gradient(2, elements) = load%gradient(2, elements) - deck%real('weight')
   end subroutine read_liquid

   !> Adds the weight of elements.
   subroutine add_weight(deck, model, load, elements, gravity, direction)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(load_t), intent(inout) :: load
      integer, intent(in) :: elements(:)
      type(distributed_t), intent(in) :: gravity
      real(wp), intent(in) :: direction(2)
      integer, allocatable :: varying(:) ! elements whose mass varies along the rod
      integer :: i
      varying = [integer ::]
      if (gravity%distribution > 0) then
         call deck%wrong('magnitude', 'gravity is the same everywhere; what varies is the mass, from *BEAM SECTION')
         return
      end if
      do i = 1, size(elements)
         associate (e => elements(i))
            if (model%mesh%section(e) == 0) cycle ! another procedure reports this error
            associate (mass => model%section(model%mesh%section(e))%mass)
               if (mass <= 0.0_wp .and. .not. deck%names%sections_incomplete) then
                  call deck%wrong('element or set', element_words(model%mesh, e)//' has no mass; it comes from *DENSITY, '// &
                     'or from mass on *BEAM SECTION, SECTION=STIFFNESS')
                  return
               end if
               if (varies(model%section(model%mesh%section(e)))) then
                  varying = [varying, e]
               else
                  load%line_force(:, e) = load%line_force(:, e) + mass * gravity%value * direction
               end if
            end associate
         end associate
      end do
      if (size(varying) > 0) call add_line(deck, model, load, varying, line_load_t(distributed_t(gravity%value), direction, &
         & weight=.true.))
   end subroutine add_weight

   !> Reads a data line of *TEMPERATURE: element or set, change, gradient.
   subroutine read_temperature(deck, model, load)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(load_t), intent(inout) :: load
      integer, allocatable :: elements(:)
      integer :: i
      elements = deck%elements('element or set')
      do i = 1, size(elements)
         associate (e => elements(i))
            if (model%mesh%section(e) == 0) cycle ! another procedure reports this error
            associate (alpha => model%section(model%mesh%section(e))%expansion)
               if (.not. (abs(alpha) > 0.0_wp .or. deck%names%sections_incomplete)) then
                  call deck%wrong('element or set', element_words(model%mesh, e)//' does not expand; alpha comes from '// &
                     '*EXPANSION, or from alpha on *BEAM SECTION, SECTION=STIFFNESS')
                  return
               end if
               load%strain(e) = load%strain(e) + alpha * deck%real('change')
               ! An element that is hotter on its left side bends to the right.
               load%curvature(e) = load%curvature(e) - alpha * deck%real('gradient')
            end associate
         end associate
      end do
   end subroutine read_temperature

   !> Reads a data line of *BOUNDARY in a step: node or set, dof, last dof, value.
   subroutine read_displacement(deck, model, prescribed_in, load)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      integer, intent(inout) :: prescribed_in(:, :)     !! see read_load_cards
      type(load_t), intent(inout) :: load
      integer, allocatable :: nodes(:)
      character(:), allocatable :: of_node
      logical :: dofs(3)
      integer :: i, dof
      if (.not. deck%given('value')) then
         call deck%wrong('value', 'value is missing; supports stand above the first *STEP, here only prescribed displacements')
         return
      else if (deck%word('dof') /= '') then
         call deck%wrong('dof', deck%word('dof')// &
            ' is a support and belongs above the first *STEP; a step prescribes dofs 1, 2, 6')
         return
      end if
      nodes = deck%nodes('node or set')
      call read_dofs(deck, dofs)
      do i = 1, size(nodes)
         do dof = 1, 3
            if (.not. dofs(dof)) cycle
            of_node = 'dof '//to_text(component_dof(dof))//' of '//node_words(model%mesh, nodes(i))
            if (.not. (model%fixed(dof, nodes(i)) .or. deck%names%supports_incomplete)) then
               call deck%wrong('dof', of_node//' is free; what is prescribed must be supported by a *BOUNDARY above the '// &
                  'first *STEP')
               return
            else if (prescribed_in(dof, nodes(i)) > 0) then
               call deck%wrong('dof', of_node//' is prescribed already, in '//deck%source%line_words(prescribed_in(dof, &
                  nodes(i))))
               return
            end if
            prescribed_in(dof, nodes(i)) = deck%at%line_at
            load%displacement(dof, nodes(i)) = deck%real('value')
         end do
      end do
   end subroutine read_displacement

   !> Reads a data line of *OBSTACLE MOTION: obstacle, dx, dy.
   subroutine read_motion(deck, model, load)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      type(load_t), intent(inout) :: load
      integer :: obstacle
      obstacle = deck%named('obstacle', deck%names%obstacle, 'obstacle')
      if (obstacle == 0) return
      if (model%obstacle(obstacle)%carrier > 0) call deck%wrong('obstacle', trim(model%obstacle(obstacle)%name)// &
         ' moves with '//node_words(model%mesh, model%obstacle(obstacle)%carrier)//': move that node (*BOUNDARY)')
      load%motion(:, obstacle) = load%motion(:, obstacle) + [deck%real('dx'), deck%real('dy')]
   end subroutine read_motion

   !> Reads a data line of *CONTACT INTERFERENCE: obstacle, value; with SHRINK: obstacle.
   subroutine read_interference(deck, model, shrunk_in, load)
      type(checked_deck_t), intent(inout) :: deck
      type(model_t), intent(in) :: model
      integer, intent(inout) :: shrunk_in(:)            !! see read_load_cards
      type(load_t), intent(inout) :: load
      integer :: obstacle, c
      logical :: ok, behind ! behind: the structure begins behind the obstacle
      call deck%touched_obstacle('obstacle', obstacle, ok)
      if (.not. ok) return
      behind = .false.
      do c = 1, size(model%contact)
         if (deck%given('SHRINK') .and. model%contact(c)%obstacle == obstacle) behind = behind .or. &
            deepest_overlap(model, model%contact(c)) > 0.0_wp
      end do
      if (.not. deck%given('SHRINK')) then
         load%closing(obstacle) = load%closing(obstacle) + deck%real('interference')
      else if (shrunk_in(obstacle) > 0) then
         call deck%wrong('obstacle', deck%source%line_words(shrunk_in(obstacle))//' pushes out all that penetrates already')
      else if (.not. (deck%names%contacts_incomplete .or. deck%names%mesh_incomplete .or. behind .or. deck%names%has_modes)) then
         call deck%wrong('obstacle', 'nothing begins behind '//trim(model%obstacle(obstacle)%name))
      else
         load%resolved(obstacle) = 1.0_wp
         if (model%step(deck%at%step)%n_modes == 0) shrunk_in(obstacle) = deck%at%line_at
      end if
   end subroutine read_interference
end module read_loads
